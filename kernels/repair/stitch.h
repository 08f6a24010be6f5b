// Cracks and T-junctions: where the borders of facets run along one another without sharing their vertices.
//
// After Guéziec, Taubin, Lazarus and Horn, "Cutting and stitching: converting sets of polygons to manifold
// surfaces", IEEE TVCG 7(2), 2001, with borders split at each other's vertices first, as Barequet and Kumar
// do
// ("Repairing CAD models", IEEE Visualization 1997). Merging vertices and splitting an edge at a vertex map
// cycles of edges to cycles, so what stays open afterwards still runs in closed loops, for the filling of
// holes.
#pragma once

#include "kernels/repair/soup.h"

namespace slabwright {

struct Stitched {
    std::uint64_t cracks = 0;       ///< stretches of border that were brought together with others
    std::uint64_t t_junctions = 0;  ///< edges split at vertices of other facets
    double crack_mm = 0;            ///< the farthest that a vertex moved
    double t_junction_mm = 0;       ///< the farthest that a vertex lay from the edge that now leads to it
    Xyz crack_at{}, t_junction_at{};
};

/// Merges vertices of borders that are nearest to one another, and splits edges of borders at vertices of
/// others that lie on them, first those that coincide, then farther and farther apart, up to `tolerance_mm`.
/// Only edges that an odd number of facets use are looked at, so what is closed stays as it is. A vertex
/// moves at most by half the shortest open edge beside it, so that fine detail stays. Near-linear.
/// Deterministic.
Stitched stitch(Context& context, FacetSoup& soup, double tolerance_mm);

}  // namespace slabwright
