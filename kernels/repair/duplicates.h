// Facets given more than once, and facets without area that close nothing.
#pragma once

#include "kernels/repair/soup.h"

namespace slabwright {

struct DroppedFacets {
    std::uint64_t count = 0;
    double area_mm2 = 0;  ///< of the largest
    Xyz where{};          ///< its middle
};

/// Keeps one of facets with the same three vertices, wherever a patch of such facets is bordered by an odd
/// number of others: where it is bordered by an even number, it is the joint of two bodies, or all is there
/// twice, and it stays. Near-linear.
DroppedFacets drop_duplicates(Context& context, FacetSoup& soup);

/// Drops facets with two equal corners, and those without area that have an edge of their own: one that lies
/// between others closes a T-junction, and stays.
DroppedFacets drop_degenerates(Context& context, FacetSoup& soup);

}  // namespace slabwright
