// Whether dowels.csv gives the holes into which the plan's dowels go, seen from the slab's underside.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "engine/simulate/build_replay.h"

namespace slabwright {

/// Drills the list's holes into slabs that lie turned over, turns these back, lays them, and looks for a hole
/// over each dowel and a dowel under each hole. Violations, each with its line: dowel.list_unreadable (a line
/// that is none, after which nothing more is read), dowel.list (no dowel under a hole within .1 mm of place,
/// diameter and depth, a hole twice, another length than its dowel's; or, without a line, a dowel with no
/// hole over it).
[[nodiscard]] std::vector<Violation> check_dowel_list(std::string_view text, const BuildPlan& build);

}  // namespace slabwright
