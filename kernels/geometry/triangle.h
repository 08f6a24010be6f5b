// A triangle's nearest point, and its crossing with a vertical line.
#pragma once

#include <array>

#include "kernels/geometry/vectors.h"

namespace slabwright {

using Triangle = std::array<Point3, 3>;

/// The nearest point of the segment from a to b.
[[nodiscard]] Point3 closest_on_segment(const Point3& point, const Point3& a, const Point3& b);

/// The nearest point of a triangle; of a degenerate one, the nearest of its edges.
[[nodiscard]] Point3 closest_on_triangle(const Point3& point, const Triangle& triangle);

/// Square of the distance to a triangle, and its nearest point, by the regions of its corners, edges and
/// face: one pass, in which the face of a sliver may be decided by rounding. Where a gouge is judged, take
/// closest_on_triangle.
[[nodiscard]] double squared_distance(const Point3& point, const Triangle& triangle, Point3& nearest);

/// Winding number of a facet's outline around (x, y), seen from above: +1 facing up, −1 facing down, 0 beside
/// it. Half-open, so over a closed mesh the sum is 0 everywhere, on edges and vertices too.
[[nodiscard]] int facet_winding(const std::array<Vec3f, 3>& facet, double x, double y);

/// Height of a facet's plane over (x, y), kept within the facet's own range; its top when it is vertical.
[[nodiscard]] double facet_height(const std::array<Vec3f, 3>& facet, double x, double y);

}  // namespace slabwright
