// Slabs that are milled on both sides (METHOD.md section 16): which of a plan's slabs have their undersides
// milled, what stays all the same, and the plan of each underside.
#pragma once

#include <array>
#include <vector>

#include "engine/layers/layers.h"
#include "engine/plan.h"
#include "engine/planner/cut_layers.h"
#include "kernels/features/unmade_air.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// Refuses what a job with layers.sides other than `one` cannot ask for yet.
/// @param pattern with neighbours
/// @throws Error(no_plan, "layers.sides"), Error(no_plan, "underside.open") for a pattern that is open at its
/// base
void check_two_sided(const Job& job, MeshView pattern);

/// Layers for slabs that are milled on both sides. With `automatic`, those of `from_above` where that leaves
/// no air higher than tolerances.undercut, or no more.
/// @param gaps of the pattern
/// @throws as place_layers_both_sides()
[[nodiscard]] LayerPlacement place_two_sided(Context& context, const Job& job, const LayerRequest& request,
                                             const AirGaps& gaps, const LayerPlacement& from_above);

/// How each of a plan's layers is milled: on both sides where that makes air higher than tolerances.undercut
/// and a cubic millimetre at least. Its web is a film where the slab hangs together without one, else one
/// in strips, or a whole one.
/// @param pattern with neighbours. @throws as underside_target()
[[nodiscard]] std::vector<MilledLayer> milled_layers(Context& context, const Plan& plan, MeshView pattern,
                                                     const AirGaps& gaps);

/// A layer's slab as it is milled from below. @param web mm, MilledLayer::web
[[nodiscard]] TurnedSlab turned_slab(const Plan& plan, const Layer& layer, double web);

/// Says what stays filled, and refuses what the job does not accept.
/// @param origin of the frame that places are told in
/// @throws Error(no_plan, "undercut.unmade")
void settle_unmade(Context& context, Plan& plan, const AirGaps& gaps, const std::vector<MilledLayer>& milled,
                   const std::array<double, 2>& origin);

/// Says of each layer that is milled on both sides which floor over what is milled from below would break,
/// under its cutters or the press of the next slab: "floor.weak".
/// @param plan its layers' programs, their forces and joints. @throws as air_gaps()
void warn_of_floors(Context& context, Plan& plan, MeshView pattern, const AirGaps& gaps,
                    const std::vector<MilledLayer>& milled);

/// Fills Plan::undersides.
/// @param plan its layers, blanks and dowels; their joints
/// @param pattern with neighbours
/// @param origin of the frame that the table's keep-outs count in
/// @throws as make_plan(), and underside_target()
void plan_undersides(Context& context, Plan& plan, MeshView pattern, const std::vector<MilledLayer>& milled,
                     ProgressShare share, const std::array<double, 2>& origin);

}  // namespace slabwright
