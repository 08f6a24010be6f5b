// Which tool a narrow cavity wants: of the library, of a catalogue, or none before the layers lie otherwise
// (SHAPING 6; METHOD.md section 6).
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/job.h"
#include "kernels/features/cavities.h"

namespace slabwright {

struct CavityTool {
    int number = 0;  ///< in the library; 0: of a catalogue
    std::string name;
    double diameter_mm = 0, flute_length_mm = 0, stickout_mm = 0;
    double left_mm2 = 0;  ///< of the cavity, seen from above, that it does not enter
    double step_mm = 0;   ///< the deepest that it cuts at once, for its edges' force alone not to bend it by
                          ///< more than tolerances.cusp; half its diameter at most
};

struct CavityAdvice {
    NarrowCavity cavity;
    std::size_t layer = 0;   ///< from 0: in which a tool reaches down the farthest
    double reach_mm = 0;     ///< there, from the layer's top
    double stickout_mm = 0;  ///< that a tool needs for it, cutting.holder_clearance counted
    /// Of the library's end mills that are long enough the widest of those that leave least.
    std::optional<CavityTool> tool;
    /// Of a catalogue the thickest flat end mill that reaches all but a twentieth of what the library leaves,
    /// or, where that one would be too short, one that is long enough and reaches at least half. None where
    /// the library leaves less than a square millimetre.
    std::optional<CavityTool> missing;
    /// z of a layer boundary without which that tool, or one of the library that is narrow enough, is too
    /// short.
    std::optional<double> boundary_mm;
};

/// One for each cavity, in their order. Lengths are asked for as the planner asks: flutes reach from the
/// layer's top to the floor, with overrun and holder clearance (max_layer_of).
[[nodiscard]] std::vector<CavityAdvice> advise_on_cavities(const Job& job,
                                                           std::span<const NarrowCavity> cavities);

}  // namespace slabwright
