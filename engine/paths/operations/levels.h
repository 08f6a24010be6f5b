// Finishing by level contours.
#pragma once

#include <vector>

#include "engine/paths/runs/layer_cut.h"

namespace slabwright {

/// Vertical walls, by the flat end mill.
[[nodiscard]] Operation finish_walls(const LayerCut& cut);
/// Steep slopes, by the ball end mill.
[[nodiscard]] Operation finish_levels(const LayerCut& cut, std::vector<Diagnostic>& diagnostics);

}  // namespace slabwright
