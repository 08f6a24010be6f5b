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
/// An edge of no length (of a facet with two equal corners) has no partner either. Where facets lie on one another at
/// an edge (within a microradian), bodies are kept apart. Scratch: 48 bytes a facet at most, charged.
/// @param corners three per facet, finite
/// @throws Error(input, "mesh.too_large") over 715 827 882 facets
[[nodiscard]] Mesh weld(Context& context, std::span<const std::array<Vec3f, 3>> corners);

/// Merges vertices nearer than `tolerance_mm` (each to the lowest index of its cluster; clusters are chained) and pairs
/// the edges again; facets left with two equal corners are removed. `merged` counts the vertices that went; the others
/// are numbered by first use.
/// @throws Error(usage, "weld.tolerance") unless the tolerance is positive and finite
struct ToleranceWeld {
    Mesh mesh;
    std::uint64_t merged = 0, removed_facets = 0;
};
[[nodiscard]] ToleranceWeld weld_within(Context& context, MeshView mesh, double tolerance_mm);

/// Fills `neighbours` from `facets` (as weld() does).
void pair_edges(Context& context, Mesh& mesh);

}  // namespace slabwright
