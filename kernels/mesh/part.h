// What of a mesh lies between two heights.
#pragma once

#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// The facets that reach into [low, high] (mm), those that only touch it and those beside any of them
/// included, in their order, with the vertices that they name in theirs: between the heights, and in what is
/// asked of facets there and across their edges, it is as good as the whole. A facet beside one that is left
/// out is open there.
/// @param mesh with neighbours
/// @throws Error(cancelled)
[[nodiscard]] Mesh part_between(Context& context, MeshView mesh, double low, double high);

}  // namespace slabwright
