// The holes that are drilled by hand: OUT/dowels.csv.
#pragma once

#include <string>
#include <vector>

#include "engine/plan.h"
#include "engine/schedule/cut_list.h"
#include "engine/schedule/dowels.h"

namespace slabwright {

/// A line for each hole in a slab's underside, as the slab lies turned over from left to right, mm from its
/// left and front edges then (io/FORMATS.md).
[[nodiscard]] std::string dowels_csv(const std::vector<UndersideHole>& holes);

/// "8 of 8 x 17 mm, 4 of 8 x 20 mm": what to cut from dowel rod, the shortest first; "" where there are none.
[[nodiscard]] std::string dowels_text(const std::vector<UndersideHole>& holes);

}  // namespace slabwright
