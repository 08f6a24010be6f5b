// Which sides of its facets the solid lies on that a mesh means. Real exports hold bodies that overlap, that
// are inside out, and surfaces that fold through themselves. The solid is where the winding number is not
// zero: overlaps count 2 and bodies inside out −1, and all of that is wood, since leaving wood never spoils a
// part. A facet then may bound the solid with its front, with its back, in part, or not at all.
#pragma once

#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// Finds facets that meet others which are not beside them: these are unsure. All others form patches that
/// nothing passes through, so the winding numbers on either side of a patch are the same everywhere, and are
/// counted at one point. O(n log n) for facets that are small beside the whole. Deterministic.
/// @param mesh with neighbours; open in its lowest plane only, else the winding number means nothing
/// @return none when all are surface, as on every sound mesh of single bodies
/// @throws Error(cancelled), Error(no_plan, "memory.limit")
[[nodiscard]] BulkVector<FacetRole> facet_roles(Context& context, MeshView mesh);

}  // namespace slabwright
