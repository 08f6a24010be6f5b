#include "kernels/mesh/windings.h"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <numeric>

#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

using Point = std::array<double, 3>;

/// Whether the step from a to b crosses the ray from q towards +x in the plane, and in which direction. The
/// side is computed from the lower end, so that two facets that share the edge agree to the last bit.
int crossing(const Point& a, const Point& b, const Point& q) {
    if ((a[1] <= q[1]) == (b[1] <= q[1])) return 0;
    const bool up = a[1] <= q[1];
    const Point &low = up ? a : b, &high = up ? b : a;
    const double side = (high[0] - low[0]) * (q[1] - low[1]) - (high[1] - low[1]) * (q[0] - low[0]);
    if (!(side > 0)) return 0;
    return up ? 1 : -1;
}

/// Of the facet's plane at a place within its outline.
double height_at(const std::array<Point, 3>& p, const Point& q) {
    const auto [low, high] = std::minmax({p[0][2], p[1][2], p[2][2]});
    const double ux = p[1][0] - p[0][0], uy = p[1][1] - p[0][1], uz = p[1][2] - p[0][2];
    const double vx = p[2][0] - p[0][0], vy = p[2][1] - p[0][1], vz = p[2][2] - p[0][2];
    const double nz = ux * vy - uy * vx;
    if (nz == 0) return high;
    const double nx = uy * vz - uz * vy, ny = uz * vx - ux * vz;
    return std::clamp(p[0][2] - ((q[0] - p[0][0]) * nx + (q[1] - p[0][1]) * ny) / nz, low, high);
}

}  // namespace

std::vector<int> windings_at(Context& context, MeshView mesh, std::span<const Point> points) {
    std::vector<int> winding(points.size(), 0);
    if (points.empty()) return winding;
    std::vector<std::uint32_t> by_x(points.size());
    std::iota(by_x.begin(), by_x.end(), 0U);
    std::sort(by_x.begin(), by_x.end(), [&](std::uint32_t a, std::uint32_t b) {
        return points[a][0] != points[b][0] ? points[a][0] < points[b][0] : a < b;
    });
    constexpr std::size_t grain = std::size_t{1} << 15;
    parallel_for(context, mesh.size(), grain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t f = begin; f < end; ++f) {
            std::array<Point, 3> p;
            for (std::size_t k = 0; k < 3; ++k) {
                const Vec3f& v = mesh.vertices[mesh.facets[f][k]];
                p[k] = {v.x, v.y, v.z};
            }
            const auto [x0, x1] = std::minmax({p[0][0], p[1][0], p[2][0]});
            const auto [y0, y1] = std::minmax({p[0][1], p[1][1], p[2][1]});
            auto at = std::lower_bound(by_x.begin(), by_x.end(), x0,
                                       [&](std::uint32_t i, double x) { return points[i][0] < x; });
            for (; at != by_x.end() && points[*at][0] <= x1; ++at) {
                const Point& q = points[*at];
                if (q[1] < y0 || q[1] > y1) continue;
                const int turns = crossing(p[0], p[1], q) + crossing(p[1], p[2], q) + crossing(p[2], p[0], q);
                if (turns != 0 && height_at(p, q) > q[2])
                    std::atomic_ref(winding[*at]).fetch_add(turns, std::memory_order_relaxed);
            }
        }
    });
    return winding;
}

}  // namespace slabwright
