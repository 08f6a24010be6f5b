// Roughing, level by level from the top.
#pragma once

#include <cstddef>
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

/// A level, and what has been cleared when it is cut.
struct RoughStep {
    RoughLevel level;
    double above = 0;       ///< mm: what stands there stands this high
    std::size_t floor = 0;  ///< of a terrace: the step that has cleared what is free at a lower height; of
                            ///< others: itself
};
/// Even levels, as deep as the tool may cut and `wood` asks for, in the order in which they are cut: after
/// each the terraces over it, from below, where rough_levels() would put levels. What is cut there are only
/// the slopes and floors that the level has left standing.
[[nodiscard]] std::vector<RoughStep> terraced_steps(const LayerCut& cut, const Tool& tool, double floor,
                                                    double cusp, const RoughSteps& wood);

/// The end mill's, which may have no moves, and before it, where it is of use, the face mill's
/// (open_waste.h).
[[nodiscard]] std::vector<Operation> rough_layer(const LayerCut& cut);

}  // namespace slabwright
