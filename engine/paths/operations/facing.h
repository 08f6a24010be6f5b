// Face milling: from the bonded slab down to the layer's top.
#pragma once

#include "engine/paths/runs/layer_cut.h"

namespace slabwright {

/// How deep the face mill cuts at most, mm.
[[nodiscard]] double face_step(const Job& job, const Tool& face);
[[nodiscard]] Operation face_layer(const LayerCut& cut);

}  // namespace slabwright
