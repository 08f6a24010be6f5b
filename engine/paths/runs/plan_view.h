// Lines of points in 0.1 µm, seen from above.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/moves/thinning.h"
#include "kernels/geometry/units.h"

namespace slabwright {

/// Of a segment of Point2 or PathPoint, and of a line of them; 0.1 µm.
template <class Point>
[[nodiscard]] double plan_length(const Point& a, const Point& b) {
    return std::hypot(static_cast<double>(b.x) - a.x, static_cast<double>(b.y) - a.y);
}
template <class Point>
[[nodiscard]] double plan_length(const std::vector<Point>& line) {
    double sum = 0;
    for (std::size_t k = 1; k < line.size(); ++k) sum += plan_length(line[k - 1], line[k]);
    return sum;
}

/// The place at share t of the way from a to b, at the height of b.
[[nodiscard]] inline PathPoint between(const PathPoint& a, const PathPoint& b, double t) {
    return {static_cast<std::int32_t>(std::lround(a.x + t * (static_cast<double>(b.x) - a.x))),
            static_cast<std::int32_t>(std::lround(a.y + t * (static_cast<double>(b.y) - a.y))), b.z};
}

/// Whether a place lies nearer to a line than `reach`, 0.1 µm.
[[nodiscard]] inline bool near_line(const PathPoint& p, std::span<const PathPoint> line, double reach) {
    for (std::size_t k = 1; k < line.size(); ++k) {
        const double ax = line[k - 1].x, ay = line[k - 1].y, dx = line[k].x - ax, dy = line[k].y - ay,
                     l2 = dx * dx + dy * dy;
        const double t = l2 > 0 ? std::clamp(((p.x - ax) * dx + (p.y - ay) * dy) / l2, 0.0, 1.0) : 0;
        const double ex = p.x - ax - t * dx, ey = p.y - ay - t * dy;
        if (ex * ex + ey * ey < reach * reach) return true;
    }
    return false;
}

/// The rectangle between two places, mm, counter-clockwise.
[[nodiscard]] inline Loops rectangle(double x0, double y0, double x1, double y1) {
    Loops loops;
    loops.points = {{to_units(x0), to_units(y0)},
                    {to_units(x1), to_units(y0)},
                    {to_units(x1), to_units(y1)},
                    {to_units(x0), to_units(y1)}};
    loops.close_loop();
    return loops;
}

}  // namespace slabwright
