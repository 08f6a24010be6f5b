// Edges that face others near by. Internal to polygons.
#pragma once

#include <vector>

#include "kernels/polygons/loops.h"
#include "kernels/polygons/plane_edges.h"

namespace slabwright {

/// Of a solid's edges those that can bound air narrower than a width, and what lies near them. The Voronoi
/// diagram of these is that of all, where a disc in the air no wider than `width` touches walls on sides of
/// it that are `spread_rad` apart or more: there the walls' normals are as far apart, and the places no
/// farther than the width; and whatever else the disc might touch lies no farther from either. Decided for
/// stretches of some edges by their boxes and the angles that their normals take, so more may stay than need
/// be. O(n log n) where few stretches lie beside each other.
/// @param width units
[[nodiscard]] std::vector<PlaneEdge> facing_edges(const Loops& solid, double width, double spread_rad);

}  // namespace slabwright
