// Whether a facet reaches into a tool.
#pragma once

#include "kernels/cutting/tool_shape.h"
#include "kernels/geometry/triangle.h"

namespace slabwright {

/// Whether some point of the triangle lies above the under side of a tool part, its axis at (x, y) and its
/// tip at tip_z: a cutter-location test ("drop") over facet, edges and corners. Exact but for rounding: along
/// an edge the height over the under side is concave, and its maximum is bracketed until its sign is certain
/// or the bracket is 1e-6 mm high.
/// @param at such a point, if there is one
[[nodiscard]] bool pokes(const Triangle& triangle, double x, double y, double tip_z, const Envelope& envelope,
                         Point3& at);

/// Horizontal distance from an upright line through `point` to what of the triangle is higher than the point,
/// and its nearest point `at`; infinite if nothing is.
[[nodiscard]] double nearest_over(const Point3& point, const Triangle& triangle, Point3& at);

}  // namespace slabwright
