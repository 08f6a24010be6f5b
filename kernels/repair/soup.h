// A mesh under repair: loose facets over shared vertices, and the edges at which they do not fit together.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/mesh/edges.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"
#include "kernels/repair/xyz.h"

namespace slabwright {

/// Facets may be dropped and added; vertices only added. No neighbours.
struct FacetSoup {
    BulkVector<Vec3f> vertices;
    BulkVector<Index3> facets;

    [[nodiscard]] Xyz at(std::uint32_t vertex) const { return xyz(vertices[vertex]); }
    [[nodiscard]] Xyz twice_area_of(std::size_t facet) const {
        const Index3& f = facets[facet];
        return twice_area(at(f[0]), at(f[1]), at(f[2]));
    }
    /// Removes the facets that are marked, keeps the order of the rest. @param dropped one for each facet
    void drop(const std::vector<bool>& dropped);
};

[[nodiscard]] inline bool has_equal_corners(const Index3& f) {
    return f[0] == f[1] || f[1] == f[2] || f[2] == f[0];
}

/// Every use of an edge by a facet, sorted by (low, high, code): of all edges, or of those whose both ends
/// are wanted. Facets with two equal corners do not count. 12 bytes a use, charged while it is sorted.
/// @param wanted empty: all; else one for each vertex
[[nodiscard]] std::vector<EdgeUse> sorted_uses(Context& context, const FacetSoup& soup,
                                               const std::vector<bool>& wanted = {});

/// Calls on_edge(uses) for every edge of sorted uses.
template <class OnEdge>
void for_each_edge(std::span<const EdgeUse> uses, OnEdge&& on_edge) {
    for (std::size_t i = 0, j = 0; i < uses.size(); i = j) {
        while (j < uses.size() && uses[j].low == uses[i].low && uses[j].high == uses[i].high) ++j;
        on_edge(uses.subspan(i, j - i));
    }
}

/// How many more facets run along an edge from its low to its high end than the other way.
[[nodiscard]] inline int excess(std::span<const EdgeUse> uses) {
    int sum = 0;
    for (const EdgeUse& use : uses) sum += use.reversed() ? -1 : 1;
    return sum;
}

/// Vertices at the ends of edges that an odd number of facets use, whichever way these face. The ends of
/// every such edge that splitting edges at vertices and merging vertices can make are among them.
[[nodiscard]] std::vector<bool> rim_vertices(std::span<const EdgeUse> uses, std::size_t vertex_count);

}  // namespace slabwright
