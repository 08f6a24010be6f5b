// The closed loops that are missing to a mesh: directed so that the facets that close them run along.
#pragma once

#include "kernels/repair/soup.h"

namespace slabwright {

struct BoundaryLoop {
    std::vector<std::uint32_t> vertices;
    std::uint32_t beside = 0;  ///< a facet at one of its edges
    Xyz middle{}, normal{};    ///< unit normal of the surface that closes it; zero where it has none
    double area_mm2 = 0;       ///< of that surface, as seen along the normal
    double length_mm = 0;
    double diagonal_mm = 0;  ///< of its box
    double flatness_mm = 0;  ///< farthest of its points from its plane
};

/// Cuts the surplus of edges into loops that visit no vertex twice. At a vertex of several, a loop goes on
/// along the edge that leads back most sharply: along the other side of a slit. Deterministic.
[[nodiscard]] std::vector<BoundaryLoop> boundary_loops(const FacetSoup& soup, std::span<const EdgeUse> uses);

}  // namespace slabwright
