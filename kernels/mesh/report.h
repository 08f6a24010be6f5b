// What is wrong with a mesh, counted and placed (METHOD.md section 1). Nothing is repaired here.
#pragma once

#include <cstdint>
#include <vector>

#include "kernels/mesh/bulk_memory.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// A count, and the lowest facet (index in the file's order) that shows it; kNoFacet when the count is 0.
struct Finding {
    std::uint64_t count = 0;
    std::uint32_t first_facet = kNoFacet;
};

/// How far above its lowest vertex a pattern's base may lie, mm: exports and turning in single precision
/// leave a flat base flat to about 1e-5 of its size. What lies lower is the base.
inline constexpr double kBaseFlatness = 0.01;

struct MeshReport {
    std::uint64_t facets = 0, vertices = 0, components = 0;
    Finding
        open_edges;  ///< edges with one facet (here and below, a facet with two equal corners does not count)
    Finding open_edges_off_base;  ///< those of them that do not lie wholly in the base (kBaseFlatness)
    Finding non_manifold_edges;   ///< edges with more than two facets
    Finding
        misoriented_edges;  ///< edges whose facets do not run along them in opposite directions, one for one
    Finding degenerate_facets;  ///< two equal corners, or no area
    Finding duplicate_facets;   ///< same three (different) vertices as an earlier facet, whichever way round
    /// Components of negative volume, closed but for edges in the base, around which the other
    /// components make no material (winding number at most 0); a cavity, which lies in material, is none.
    Finding inverted_components;
    double volume_mm3 = 0;  ///< signed, of the whole; an opening in the lowest plane counts as filled
    double area_mm2 = 0;
    Box3 box;
    /// Component of every facet, numbered by lowest facet. Facets that are paired across an edge belong
    /// together, and so do all facets of a misoriented edge; bodies that touch along an edge stay two.
    BulkVector<std::uint32_t> component_of;
};

/// Reports on a mesh whose adjacency is filled. Deterministic.
/// @param odd vertices that weld() or pair_edges() named on this very mesh: only edges with their lower end
/// there are searched for
///        faults; without it all are
[[nodiscard]] MeshReport report_mesh(Context& context, MeshView mesh,
                                     const std::vector<std::uint32_t>* odd = nullptr);

}  // namespace slabwright
