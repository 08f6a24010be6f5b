// Dowels in the joints between layers (METHOD.md section 18): what brings a slab that is laid by hand to its
// place.
//
// The holes in a layer's top are drilled by a program of that layer, when all else of it is cut; those in the
// underside of the next slab by hand, before it is laid. Dowels stand in the pattern's wood alone: the waste
// beside it is gone when the next slab comes, and a flask's frame may carry clamps.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "engine/plan.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// mm of wood that stay beyond a hole's end, the point of a drill of 118° left out, and between two holes of
/// one slab that run past each other.
inline constexpr double kLeastWoodAtDowel = 3;

/// mm that a dowel's hole goes into a layer of this height, full diameter: what the rules ask for, or what
/// the layer leaves room for; 0 where that is less than half a diameter.
[[nodiscard]] double dowel_depth(const JointDowels& rules, double layer_mm);

/// The lowest layer that has room for a hole of half a diameter, mm.
[[nodiscard]] double least_layer_for_dowels(const JointDowels& rules);

/// The heights between which the wood around a dowel is looked at: its holes, the drill's points, and
/// kLeastWoodAtDowel beyond these. @param z of the joint, mm
[[nodiscard]] std::array<double, 2> wood_around(const JointDowel& dowel, double z);

/// How near the surface between two heights comes to an upright line at (x, y), seen from above, mm; infinite
/// where no facet reaches between them. O(1).
/// @param facet its corners, mm
[[nodiscard]] double plan_distance(const std::array<std::array<double, 3>, 3>& facet,
                                   const std::array<double, 2>& heights, double x, double y);

/// Whether a slab that is turned on the stack by half a turn, or by a quarter where it is as long as it is
/// wide, would go over all of these dowels within two diameters.
[[nodiscard]] bool fits_turned(std::span<const JointDowel> dowels, const Blank& slab);

/// What of a joint's glue lies beside the holes of its dowels.
[[nodiscard]] Loops outside_dowels(const Loops& glue, std::span<const JointDowel> dowels);

/// The dowels that a layer is laid on: those in the top of the one below.
[[nodiscard]] std::span<const JointDowel> dowels_under(const Plan& plan, const Layer& layer);

/// A hole in the underside of a layer's lowest slab, drilled before that is laid.
struct UndersideHole {
    int layer = 0;                   ///< Layer::index
    int number = 0;                  ///< of the layer's, from 1
    double x = 0, y = 0;             ///< mm from the left and the front edge of the slab as it lies turned
                                     ///< over from left to right: its left edge is then that of greatest x
    double diameter = 0, depth = 0;  ///< mm
    double dowel_length = 0;         ///< mm
    friend bool operator==(const UndersideHole&, const UndersideHole&) = default;
};

/// Of all layers whose undersides no program mills, upwards, in the order of their dowels.
[[nodiscard]] std::vector<UndersideHole> underside_holes(const Plan& plan);

/// Fills Layer::dowels: for each joint between two layers `per_joint` dowels around which, for a radius and
/// the clearance, no surface of the pattern comes between the heights of wood_around(). The first two are as
/// far apart as can be among the places that are looked at (corners of that region and a grid over it), each
/// further one is as far as can be from its nearest; ties go to the lower x, then y. The last is chosen so
/// that the slab does not fit turned; where two dowels cannot do that, a third is added. Joints within a
/// layer have none: nothing is cut before they are glued.
///
/// Diagnostics: dowel.none (no place), dowel.few (not as many as asked for), dowel.turned (the slab fits
/// turned).
/// @param pattern without supports, pattern-base
/// @param plan its job, layers and blanks
/// @throws Error(no_plan, "dowel.none") where the job requires them; Error(no_plan, "memory.limit"),
/// Error(cancelled)
void place_dowels(Context& context, MeshView pattern, Plan& plan);

}  // namespace slabwright
