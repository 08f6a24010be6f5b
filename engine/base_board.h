// The board under the first layer, which is cut into and thrown away.
#pragma once

#include <vector>

#include "engine/job.h"

namespace slabwright {

/// How deep the base board may be cut, mm: Machine::base_board_cut, but no deeper than the board is thick; or
/// as deep as the largest ball end mill's radius reaches below the pattern, but for 2 mm of the board, so
/// that nothing comes through it to the table. Planner, proof and report ask here.
[[nodiscard]] double board_cut_limit(const Machine& machine, const std::vector<Tool>& tools);

}  // namespace slabwright
