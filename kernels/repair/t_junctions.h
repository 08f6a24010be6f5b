// Splits edges of borders at vertices that lie on them.
#pragma once

#include "kernels/repair/soup.h"

namespace slabwright {

struct EdgeSplits {
    std::uint64_t edges = 0;  ///< that were split
    double farthest_mm = 0;   ///< of the vertices from their edge
    Xyz where{};              ///< that vertex
};

/// Splits every odd edge (used by an odd number of facets) at the ends of other odd edges that lie within
/// `tolerance_mm` of it and run along it. Of three or more facets the one is split that no other faces.
/// @param off_ends_mm vertices nearer to an end of the edge are left: they are to be merged with that
/// @param uses sorted_uses() of the soup, of the edges between rim vertices
EdgeSplits split_at_vertices(Context& context, FacetSoup& soup, std::span<const EdgeUse> uses,
                             double tolerance_mm, double off_ends_mm);

}  // namespace slabwright
