// Fewer facets for a picture: pairs of vertices are merged where that moves the surface least.
#pragma once

#include <cstddef>

#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// A mesh of at most about `facets` facets that looks like the one given: edges are collapsed in the order of Garland and Heckbert's
/// quadric error (1997), in rounds of collapses that share no vertex, so that the result is the same on any number of threads. A
/// collapse that would turn a facet over or pinch the surface is left out, so a mesh of many small shells may keep more facets than asked.
/// Over four million facets, vertices in one cell of a fine grid are merged first. A mesh with fewer facets comes back as it is, without
/// its degenerate facets and unused vertices. Says nothing of the error: surface_deviation() measures it.
/// @param facets wished for, 4 or more
/// @returns vertices and facets; neighbours are not filled
[[nodiscard]] Mesh decimate(Context& context, MeshView mesh, std::size_t facets);

}  // namespace slabwright
