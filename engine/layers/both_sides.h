// Where layers part whose slabs are milled on both sides (METHOD.md section 16).
//
// Milled from both sides, air between two bodies of solid is made as soon as one boundary lies in it, and air
// with nothing under it always is. So down-facing flats bind no boundary; what counts is how much air lies
// between two boundaries as a whole: intervals that boundaries stab, each weighted by its volume.
#pragma once

#include "engine/layers/layers.h"
#include "kernels/features/unmade_air.h"

namespace slabwright {

struct BothSidesWeights {
    double filled_gap = 0;  ///< mm: air less high may stay
    /// Air counts in steps of this. 0: a ten-thousandth of the air between solid and solid, 1 mm³ at least.
    double step_mm3 = 0;
    double layer_mm3 = 0;  ///< what one layer more must make; 0: a thousandth of that air, or
                           ///< 3e-5 of the part's box where that is more
};

/// A dynamic program over heights of features, frequent ends of gaps and a thousand levels. It minimises, in
/// this order: air that stays and layers at their price in air, in steps; floors over recesses that a
/// boundary leaves under 3 mm where the part goes on above them; broken Type I by area; exposed glue; broken
/// Type III; layers; wood. No layer is thinner than min_layer where another way up is left. Deterministic,
/// some tenths of a second.
/// @param request its down-facing flats are not looked at
/// @param gaps of the part, with its bottom on z = 0
/// @throws Error(usage, "layers.request") as place_layers()
[[nodiscard]] LayerPlacement place_layers_both_sides(const LayerRequest& request, const AirGaps& gaps,
                                                     const BothSidesWeights& weights = {});

}  // namespace slabwright
