// The convex hull of points, up to a tolerance (Barber, Dobkin, Huhdanpaa: The Quickhull algorithm for convex
// hulls, ACM TOMS 22, 1996).
#pragma once

#include <span>
#include <vector>

#include "kernels/mesh/mesh.h"

namespace slabwright {

/// Facets whose hull no point leaves by more than `tolerance`, their corners indices of points,
/// counter-clockwise seen from outside. Points of one plane are told apart by a billionth of the extent, so
/// that every facet has an area; the result depends on the points and their order alone.
/// @param tolerance mm, over 0
/// @return none where the points lie within `tolerance` of a plane
[[nodiscard]] std::vector<Index3> convex_hull(std::span<const Vec3f> points, double tolerance);

}  // namespace slabwright
