// Into a finish cut and out of it on arcs that touch the run.
#pragma once

#include <vector>

#include "engine/paths/runs/layer_cut.h"

namespace slabwright {

enum class PartSide { left, right };

/// Gives a finish run at one level a tangential arc into the cut and one out of it, on its free side, where
/// drops of the cutter prove the room and nothing stands that would be entered head-on. A closed run (its
/// last point is its first) is cut a little past its beginning, so that no mark stays there.
/// @param side of the run on which the part is
/// @returns whether the arc into the cut found room
bool add_leads(PathBuilder& path, const LayerCut& cut, const DropIndex& part, double chord,
               std::vector<PathPoint>& run, PartSide side = PartSide::right);

}  // namespace slabwright
