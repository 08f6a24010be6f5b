#include "kernels/polygons/hull.h"

#include <algorithm>

namespace slabwright {

// Andrew's monotone chain. Differences of coordinates are below 2³², so their products are taken in 128 bits.
std::vector<Point2> convex_hull(std::vector<Point2> points) {
    std::sort(points.begin(), points.end());
    points.erase(std::unique(points.begin(), points.end()), points.end());
    if (points.size() < 3) return points;
    const auto turn = [](Point2 a, Point2 b, Point2 c) {
        const __int128 left = static_cast<__int128>(std::int64_t{b.x} - a.x) * (std::int64_t{c.y} - a.y);
        const __int128 right = static_cast<__int128>(std::int64_t{b.y} - a.y) * (std::int64_t{c.x} - a.x);
        return left > right ? 1 : left < right ? -1 : 0;
    };
    std::vector<Point2> hull;
    for (int pass = 0; pass < 2; ++pass) {
        const std::size_t start = hull.size();
        for (const Point2 p : points) {
            while (hull.size() >= start + 2 && turn(hull[hull.size() - 2], hull.back(), p) <= 0)
                hull.pop_back();
            hull.push_back(p);
        }
        hull.pop_back();
        std::reverse(points.begin(), points.end());
    }
    return hull;
}

}  // namespace slabwright
