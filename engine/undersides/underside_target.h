// What a slab's underside is milled to (METHOD.md section 16).
//
// Before a slab is laid it lies upside down on a spoil board, and what of the layer's air has solid under the
// layer's top is milled out from below. The target is a solid like any pattern, in the turned slab's frame
// (TurnedSlab): the pattern itself, turned, and a tray. The tray's floor is the web that stays under the
// layer's top, so that nothing comes loose before it is bonded; its rim is all of the slab that lies farther
// from the milled air than cutters need. Bodies may overlap: the solid is where the winding number is not
// zero. So an underside is planned and proven as any layer is.
#pragma once

#include "engine/plan.h"
#include "kernels/features/unmade_air.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"
#include "kernels/polygons/loops.h"

namespace slabwright {

/// mm of a slab that stay under its layer's top where its underside is milled and pieces of it would else
/// come loose: in strips along x, or, where these do not hold all pieces either, a little thicker and
/// everywhere. TurnedSlab::web says which.
inline constexpr double kStripWeb = 3, kWholeWeb = 3.5;
/// mm of the strips, and from each to the next; the middle of the first lies half of that behind the slab's
/// front edge.
inline constexpr double kStripWidth = 6, kStripPitch = 40;
/// mm over the spoil board that always stay; the top side takes them away. What the facing takes is among
/// them.
inline constexpr double kUndersideFilm = 0.5;

/// The thinnest web that leaves a film. @param height, slab_thickness of the layer, mm
[[nodiscard]] double film_web(double height, double slab_thickness);
/// z of the floor of what is milled, beside strips, in the turned slab's frame, mm.
[[nodiscard]] double recess_floor(const TurnedSlab& slab);
/// Whether its web comes in strips.
[[nodiscard]] bool has_strips(const TurnedSlab& slab);
/// The layer of a slab that is milled on both sides, for what stays filled. In the frame that the slab's
/// blank is told in.
[[nodiscard]] MilledLayer milled_layer(const TurnedSlab& slab);

/// mm around milled air that all end mills of the job need: the widest one, twice what roughing leaves, and
/// room for leads.
[[nodiscard]] double underside_room(const Job& job);

/// Where a slab's underside is milled, in the pattern's frame: the air that is open from below and has solid
/// of the layer above it, seen from above, and the room around it. Empty where there is none.
/// @param pattern pattern-base, mm, with neighbours
/// @throws as slice() and shadows()
[[nodiscard]] Loops underside_region(Context& context, MeshView pattern, const TurnedSlab& slab);

/// A region of the pattern's frame in the turned slab's, nested.
[[nodiscard]] Loops turned_region(const Loops& region, const TurnedSlab& slab);

/// The target, with neighbours and roles, in the turned slab's frame.
/// @param pattern pattern-base, mm, with neighbours
/// @throws Error(no_plan, "underside.open") for a pattern that is open at its base, Error(no_plan,
/// "underside.none") where nothing is to be milled, Error(no_plan, "underside.outline") where the region's
/// outline cannot be filled; as underside_region()
[[nodiscard]] Mesh underside_target(Context& context, MeshView pattern, const TurnedSlab& slab);

/// Dowels of the joint under a slab as they are drilled into its underside: in the turned slab's frame, as
/// deep in its top there as they stand in it. @param dowels pattern-base
[[nodiscard]] std::vector<JointDowel> turned_dowels(const TurnedSlab& slab,
                                                    std::span<const JointDowel> dowels);

}  // namespace slabwright
