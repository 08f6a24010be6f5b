// The outline of a mesh seen from above.
#pragma once

#include <span>
#include <vector>

#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"
#include "kernels/polygons/loops.h"

namespace slabwright {

/// What the mesh covers, seen along z: the union of its up-facing facets, projected and rounded to 0.1 µm.
/// Outer loops run counter-clockwise, holes (through the whole pattern) clockwise; nested.
/// @param mesh adjacency filled
/// @throws Error(no_plan, "memory.limit"), Error(cancelled), and what simplify() throws
[[nodiscard]] Loops silhouette(Context& context, MeshView mesh);

struct HeightRange {
    double low = 0, high = 0;  ///< mm
};

/// For each range of heights the union of all sections in it, seen along z: what stays of a slab that is
/// milled from above, undercuts filled. Every column of it begins in the section just above `low` or on a
/// facet that faces down in the range, so that is what is united. Rounded and turned as silhouette().
/// @param mesh adjacency filled
/// @throws as slice() and silhouette()
[[nodiscard]] std::vector<Loops> shadows(Context& context, MeshView mesh,
                                         std::span<const HeightRange> ranges);

}  // namespace slabwright
