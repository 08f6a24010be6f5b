// Runs without the stretches that would cut nothing.
#pragma once

#include <vector>

#include "engine/paths/runs/layer_cut.h"
#include "engine/paths/runs/level_runs.h"

namespace slabwright {

/// Takes out of finishing runs, which come in the order in which they are cut, what would cut nothing of the
/// layer's stock (LayerCut::stock; without it they stay as they are): both ends of open ones, and of the
/// middle what is longer than `worth_leaving` (mm), of closed ones too, which then are open. What is left of
/// a run may be several; groups keep their number.
/// @param cutter the operation's
void take_out_idle(const LayerCut& cut, const CutterShape& cutter, double worth_leaving,
                   std::vector<std::vector<LevelRun>>& groups);

}  // namespace slabwright
