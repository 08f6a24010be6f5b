// Which side of each facet is outside.
#pragma once

#include "kernels/repair/soup.h"

namespace slabwright {

struct Turned {
    std::uint64_t facets = 0, patches = 0;  ///< turned over, and in how many connected pieces
    double area_mm2 = 0;                    ///< of the largest piece
    Xyz where{};                            ///< the middle of its first facet
    std::uint64_t one_sided = 0;            ///< edges whose two facets cannot agree, as on a Möbius strip
    /// By facet: whether its piece of surface held so many facets of either side that what the file says of
    /// its outside tells nothing.
    std::vector<bool> unsure;
};

/// Spreads the orientation over all edges with two facets; each piece of surface that is connected so keeps
/// the side of the larger part of its area. Where three or more facets meet, whole pieces are then turned,
/// in the order of the edges' lengths, so that as many facets run one way as the other. A mesh whose facets
/// agree everywhere stays as it is. Near-linear. Deterministic.
Turned orient(Context& context, FacetSoup& soup);

}  // namespace slabwright
