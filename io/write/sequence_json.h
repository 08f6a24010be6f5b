// sequence.json: the machine's steps (METHOD.md section 12), schema slabwright.sequence/1.
#pragma once

#include <string>

#include "engine/plan.h"
#include "engine/simulate/build_replay.h"

namespace slabwright {

/// The steps in order, each with the ids of those that must be done before, and where glue goes on each layer
/// as closed polygons in mm. A glue step names its polygons by a JSON pointer into the file.
[[nodiscard]] std::string sequence_json(const Plan& plan);

/// The same of a sequence that was read, or made from one that was.
[[nodiscard]] std::string sequence_json(const BuildSequence& sequence);

}  // namespace slabwright
