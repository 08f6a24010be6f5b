// Fewer facets for a picture: pairs of vertices are merged where that moves the surface least.
#pragma once

#include <cstddef>

#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// A mesh of at most about `facets` facets that looks like the one given: edges are collapsed in the order of
/// Garland and Heckbert's quadric error (1997), in rounds of collapses that share no vertex, so that the
/// result is the same on any number of threads. A collapse that would turn a facet over or pinch the surface
/// is left out, so a mesh of many small shells may keep more facets than asked. From `clustered_from` facets
/// on, vertices in one cell of a grid are merged first, which leaves about a tenth of so many facets. A mesh
/// with fewer facets comes back as it is, without its degenerate facets and unused vertices. Says nothing of
/// the error: surface_deviation() measures it.
/// @param facets wished for, 4 or more
/// @param clustered_from four million or more leave enough for some 100 000 facets; a grid for fewer is for
/// tests
/// @returns vertices and facets; neighbours are not filled
[[nodiscard]] Mesh decimate(Context& context, MeshView mesh, std::size_t facets,
                            std::size_t clustered_from = 4'000'000);

}  // namespace slabwright
