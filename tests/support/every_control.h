// What tests of every control go over.
#pragma once

#include <string>
#include <vector>

#include "engine/controls.h"
#include "engine/job.h"
#include "tests/support/places.h"

namespace slabwright::support {

inline const std::vector<Post> kPosts = [] {
    std::vector<Post> all;
    for (const Control& control : kControls) all.push_back(control.post);
    return all;
}();
inline constexpr LengthUnit kUnits[] = {LengthUnit::mm, LengthUnit::inch};
inline const std::string kModels = support::checkout("tests/data/");

}  // namespace slabwright::support
