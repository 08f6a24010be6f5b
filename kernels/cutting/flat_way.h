// Whether a flat cutter's straight way, level or not, is free of a layer's solid.
#pragma once

#include "kernels/cutting/layer_solid.h"
#include "kernels/geometry/vectors.h"

namespace slabwright {

/// Exact over facets, as DropIndex::drop is over a place. With s ≥ 0 the way's slope, u the distance along it
/// from its lower end a and w that across, a point p is met first by the rim before the cutter's middle, when
/// that has gone t = u − √(r² − w²), and stands over the cutter's face by
///     f(p) = z(p) − z_a − s·t  for 0 ≤ t ≤ l.
/// Along a facet f changes evenly with u, so it is greatest on an edge that is not concave, or where t is 0
/// or l; along an edge it is concave.
/// @param a, b the middle of the cutter's face at the ends, mm; there it is taken to be free
/// @param over mm: what stands over the face by no more than that, positive, is none
[[nodiscard]] bool flat_way_is_free(const LayerSolid& solid, double radius, Vec3d a, Vec3d b, double over);

}  // namespace slabwright
