// The convex hull of points in the plane.
#pragma once

#include <vector>

#include "kernels/polygons/loops.h"

namespace slabwright {

/// Convex hull, counter-clockwise, without points on its edges; of fewer than three distinct points, those
/// points.
[[nodiscard]] std::vector<Point2> convex_hull(std::vector<Point2> points);

}  // namespace slabwright
