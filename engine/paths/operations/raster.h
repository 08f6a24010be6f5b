// Finishing by a projected raster.
#pragma once

#include <vector>

#include "engine/paths/runs/layer_cut.h"

namespace slabwright {

[[nodiscard]] Operation finish_raster(const LayerCut& cut, std::vector<Diagnostic>& diagnostics);

}  // namespace slabwright
