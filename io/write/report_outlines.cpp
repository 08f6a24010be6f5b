#include "io/write/report_outlines.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

namespace slabwright {

namespace {

/// Douglas and Peucker on a closed loop, from its first point and the one farthest from that.
std::vector<Point2> thinned_loop(std::span<const Point2> loop, double tolerance_mm) {
    const std::size_t n = loop.size();
    if (n < 5) return {loop.begin(), loop.end()};
    const auto at = [&](std::size_t k) { return loop[k % n]; };
    const auto length = [](double x, double y) { return std::sqrt(x * x + y * y); };
    std::size_t far = 1;
    double most = -1;
    for (std::size_t k = 1; k < n; ++k)
        if (const double d =
                length(static_cast<double>(at(k).x) - at(0).x, static_cast<double>(at(k).y) - at(0).y);
            d > most)
            most = d, far = k;
    std::vector<char> kept(n + 1, 0);
    kept[0] = kept[far] = kept[n] = 1;
    std::vector<std::pair<std::size_t, std::size_t>> open{{0, far}, {far, n}};
    while (!open.empty()) {
        const auto [a, b] = open.back();
        open.pop_back();
        const double ax = at(a).x, ay = at(a).y, ux = at(b).x - ax, uy = at(b).y - ay, uu = ux * ux + uy * uy;
        std::size_t worst = a;
        double distance = tolerance_mm * kUnitsPerMm;
        for (std::size_t k = a + 1; k < b; ++k) {
            const double wx = at(k).x - ax, wy = at(k).y - ay,
                         t = uu > 0 ? std::clamp((wx * ux + wy * uy) / uu, 0.0, 1.0) : 0;
            if (const double d = length(wx - t * ux, wy - t * uy); d > distance) distance = d, worst = k;
        }
        if (worst == a) continue;
        kept[worst] = 1;
        open.emplace_back(a, worst);
        open.emplace_back(worst, b);
    }
    std::vector<Point2> result;
    for (std::size_t k = 0; k < n; ++k)
        if (kept[k]) result.push_back(loop[k]);
    return result;
}

}  // namespace

std::vector<std::int64_t> outline(std::span<const Point2> loop) {
    std::vector<std::int64_t> flat;
    for (const Point2 p : thinned_loop(loop, kOutlineTolerance)) {
        flat.push_back(std::llround(to_mm(p.x) * kHundredths));
        flat.push_back(std::llround(to_mm(p.y) * kHundredths));
    }
    return flat;
}

}  // namespace slabwright
