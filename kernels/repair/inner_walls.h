// Pieces of surface that divide a solid, or stand off it as fins, and without which it is closed.
#pragma once

#include "kernels/repair/soup.h"

namespace slabwright {

struct DroppedWalls {
    std::uint64_t count = 0;
    double area_mm2 = 0;        ///< of the largest
    Xyz where{};                ///< the middle of its first facet
    std::vector<bool> dropped;  ///< by facet, as they were numbered before; empty: none
};

/// Drops pieces (facets connected across edges of two) that meet others where three facets and more share an
/// edge, for most of their border, and without which every edge of their border balances: an inner wall
/// encloses nothing that the pieces around it do not enclose without it. The smallest first, for of three
/// surfaces that meet along one line the one that divides the other two is the smallest; none over a
/// twentieth of all area.
DroppedWalls drop_inner_walls(Context& context, FacetSoup& soup);

}  // namespace slabwright
