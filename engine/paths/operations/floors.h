// Finishing of up-facing flats by the flat end mill.
#pragma once

#include "engine/paths/runs/layer_cut.h"

namespace slabwright {

[[nodiscard]] Operation finish_floors(const LayerCut& cut);

}  // namespace slabwright
