// Finishing by projected offsets.
#pragma once

#include <vector>

#include "engine/paths/runs/layer_cut.h"

namespace slabwright {

[[nodiscard]] Operation finish_offsets(const LayerCut& cut, std::vector<Diagnostic>& diagnostics);

}  // namespace slabwright
