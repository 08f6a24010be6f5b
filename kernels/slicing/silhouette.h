// The outline of a mesh seen from above.
#pragma once

#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"
#include "kernels/polygons/loops.h"

namespace slabwright {

/// What the mesh covers, seen along z: the union of its up-facing facets, projected and rounded to 0.1 µm.
/// Outer loops run counter-clockwise, holes (through the whole pattern) clockwise; nested.
/// @param mesh adjacency filled
/// @throws Error(no_plan, "memory.limit"), Error(cancelled), and what simplify() throws
[[nodiscard]] Loops silhouette(Context& context, MeshView mesh);

}  // namespace slabwright
