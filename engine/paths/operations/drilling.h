// Vertical holes by a drill (FINISH 3.3): down in pecks, up to clear the chips.
#pragma once

#include <span>

#include "engine/layer_job.h"
#include "engine/paths/runs/layer_cut.h"

namespace slabwright {

/// The layer's holes, one program a drill, in the library's order; of a drill's holes the nearest comes next.
/// Each peck is one of the drill's stepdown_max at most; before it the drill comes out of the hole.
[[nodiscard]] std::vector<Operation> drill_holes(const LayerCut& cut);

}  // namespace slabwright
