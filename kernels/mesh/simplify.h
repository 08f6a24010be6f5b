// Fewer facets for the same surface: what a finely facetted plane, wall or fillet has more of than a
// tolerance asks for.
#pragma once

#include <span>

#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// A mesh whose surface lies within `tolerance_mm` of the given one, and the given one within it of the
/// result: a bound, not an estimate. Vertices are only taken away (each is drawn along an edge into a
/// neighbour), none is moved, so planes stay the planes they are. A vertex goes where between the facets that
/// were around it and those that follow the gap, measured along their mean normal at every place where edges
/// of the one cross those of the other, and the gap already granted to those facets are within the tolerance,
/// where no new facet turns by more than a degree from all of the old ones, gets flatter than it need be, or
/// joins sheets that were apart. Open edges, and vertices around which the facets do not form one fan, stay.
///
/// Where a surface is flatter than 30° and crosses one of the `planes`, its section by the plane would move
/// much farther than the surface itself: there it stays as it is, but for what lies in one plane exactly.
///
/// Works in blocks of space, in parallel, twice over blocks that do not share borders; the result is the same
/// on any number of threads, and its facets come in the order of the blocks. Besides the meshes 64 MB, 32
/// bytes for each facet that stays and 2 for each of `mesh`, charged.
/// @param mesh with or without neighbours
/// @returns a mesh with neighbours
/// @throws Error(usage, "simplify.tolerance") unless the tolerance is positive and finite; Error(no_plan,
/// "memory.limit"), Error(cancelled)
/// @param planes heights in mm, in any order
[[nodiscard]] Mesh simplify(Context& context, MeshView mesh, double tolerance_mm,
                            std::span<const double> planes = {});

}  // namespace slabwright
