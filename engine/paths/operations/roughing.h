// Roughing, level by level from the top.
#pragma once

#include <vector>

#include "engine/paths/runs/layer_cut.h"

namespace slabwright {

/// A level of roughing, mm.
struct RoughLevel {
    double tip = 0;    ///< where the tip runs
    double spare = 0;  ///< what must be spared lies above this height
};
/// The levels of a flat end mill, descending: one `floor` (mm) over every up-facing flat and one on the
/// layer's bottom, and between them the stepdowns that the tool allows and at which the stairs on slopes
/// are no thicker than `cusp` (mm along the normal).
[[nodiscard]] std::vector<RoughLevel> rough_levels(const LayerCut& cut, const Tool& tool, double floor,
                                                   double cusp);

/// The end mill's, which may have no moves, and before it, where it is of use, the face mill's
/// (open_waste.h).
[[nodiscard]] std::vector<Operation> rough_layer(const LayerCut& cut);

}  // namespace slabwright
