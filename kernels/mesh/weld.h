// From facet corners to a mesh: equal corners become one vertex, edges find their neighbours.
#pragma once

#include <array>
#include <span>

#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// Welds bit-exactly (−0 equals +0). Vertices are numbered by first use, facets keep their order and count, degenerate
/// ones included. Edges are paired one for one in opposite directions; where more than two facets meet, each pair is
/// chosen so that the solid lies between its facets (so sections stay closed); what finds no partner is kNoFacet.
/// @param corners three per facet, finite
[[nodiscard]] Mesh weld(Context& context, std::span<const std::array<Vec3f, 3>> corners);

/// Merges vertices nearer than `tolerance_mm` (each to the lowest index of its cluster) and pairs the edges again;
/// facets that lose their area this way are removed. `merged` counts the vertices that went.
struct ToleranceWeld {
    Mesh mesh;
    std::uint64_t merged = 0, removed_facets = 0;
};
[[nodiscard]] ToleranceWeld weld_within(Context& context, MeshView mesh, double tolerance_mm);

/// Fills `neighbours` from `facets` (as weld() does).
void pair_edges(Context& context, Mesh& mesh);

}  // namespace slabwright
