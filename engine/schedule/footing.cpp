#include "engine/schedule/footing.h"

#include <algorithm>
#include <cmath>

#include "kernels/polygons/hull.h"

namespace slabwright {

namespace {

std::vector<std::array<double, 2>> hull_of(const Loops& region) {
    std::vector<std::array<double, 2>> hull;
    for (const Point2 p : convex_hull(region.points)) hull.push_back({to_mm(p.x), to_mm(p.y)});
    return hull;
}

}  // namespace

AreaMoments area_moments(const Loops& region) {
    AreaMoments m;
    if (region.points.empty()) return m;
    // Coordinates count from the first point: far from the origin the second moments would cancel otherwise.
    const double ox = to_mm(region.points[0].x), oy = to_mm(region.points[0].y);
    double a2 = 0, sx = 0, sy = 0, sxx = 0, syy = 0, sxy = 0;
    for (std::size_t l = 0; l < region.size(); ++l) {
        const auto loop = region.loop(l);
        for (std::size_t i = 0; i < loop.size(); ++i) {
            const Point2 p = loop[i], q = loop[i + 1 < loop.size() ? i + 1 : 0];
            const double x0 = to_mm(p.x) - ox, y0 = to_mm(p.y) - oy, x1 = to_mm(q.x) - ox,
                         y1 = to_mm(q.y) - oy;
            const double cross = x0 * y1 - x1 * y0;
            a2 += cross;
            sx += cross * (x0 + x1);
            sy += cross * (y0 + y1);
            sxx += cross * (x0 * x0 + x0 * x1 + x1 * x1);
            syy += cross * (y0 * y0 + y0 * y1 + y1 * y1);
            sxy += cross * (x0 * y1 + 2 * x0 * y0 + 2 * x1 * y1 + x1 * y0);
        }
    }
    if (!(a2 > 0)) return m;
    m.area = a2 / 2;
    const double cx = sx / 6 / m.area, cy = sy / 6 / m.area;
    m.x = cx + ox;
    m.y = cy + oy;
    m.ixx = std::max(0.0, sxx / 12 - m.area * cx * cx);
    m.iyy = std::max(0.0, syy / 12 - m.area * cy * cy);
    m.ixy = sxy / 24 - m.area * cx * cy;
    return m;
}

Footing::Footing(const Loops& glue, const Loops& contact)
    : glue_(area_moments(glue)), hull_(hull_of(contact)), glue_hull_(hull_of(glue)) {}

double Footing::pull_mpa(const FootingLoad& load) const {
    if (!(glue_.area > 0)) return INFINITY;
    const double det = glue_.ixx * glue_.iyy - glue_.ixy * glue_.ixy;
    if (!(det > 0)) return INFINITY;
    // The pull of unit bending (mx, my) = force × lever at p: (mx, my)ᵀ·I⁻¹·(p − centroid).
    const auto solve = [&](double x, double y) -> std::array<double, 2> {
        return {(glue_.iyy * x - glue_.ixy * y) / det, (glue_.ixx * y - glue_.ixy * x) / det};
    };
    double down = 0, mx = 0, my = 0;
    for (const DownForce& w : load.weights) {
        down += w.n;
        mx += w.n * (w.x - glue_.x);
        my += w.n * (w.y - glue_.y);
    }
    double most = -INFINITY;
    for (const auto& p : glue_hull_) {
        const auto lever = solve(p[0] - glue_.x, p[1] - glue_.y);
        double cutter = 0;
        for (const auto& q : load.push_at)
            cutter = std::max(cutter, std::fabs(1 / glue_.area + (q[0] - glue_.x) * lever[0] +
                                                (q[1] - glue_.y) * lever[1]));
        most = std::max(most, load.push_n * cutter + load.side_bending_nmm * std::hypot(lever[0], lever[1]) -
                                  down / glue_.area - mx * lever[0] - my * lever[1]);
    }
    return std::max(0.0, most);
}

double Footing::turning(const FootingLoad& load, double bears_mpa) const {
    if (!(glue_.area > 0) || hull_.size() < 3) return INFINITY;
    double most = 0;
    for (std::size_t i = 0; i < hull_.size(); ++i) {
        const auto &a = hull_[i], &b = hull_[i + 1 < hull_.size() ? i + 1 : 0];
        const double length = std::hypot(b[0] - a[0], b[1] - a[1]);
        const double nx = (b[1] - a[1]) / length, ny = (a[0] - b[0]) / length;  // outwards
        const auto beyond = [&](double x, double y) { return nx * (x - a[0]) + ny * (y - a[1]); };
        double turns = load.side_bending_nmm, pushed = 0;
        for (const DownForce& w : load.weights) turns += w.n * beyond(w.x, w.y);
        for (const auto& q : load.push_at) pushed = std::max(pushed, std::fabs(beyond(q[0], q[1])));
        turns += load.push_n * pushed;
        if (!(turns > 0)) continue;
        const double holds = bears_mpa * glue_.area * -beyond(glue_.x, glue_.y);
        most = std::max(most, holds > 0 ? turns / holds : INFINITY);
    }
    return most;
}

double Footing::outside_by(double x, double y) const {
    double nearest = INFINITY;
    bool inside = hull_.size() >= 3;
    for (std::size_t i = 0; i < hull_.size(); ++i) {
        const auto &a = hull_[i], &b = hull_[i + 1 < hull_.size() ? i + 1 : 0];
        const double dx = b[0] - a[0], dy = b[1] - a[1], length2 = dx * dx + dy * dy;
        if (dx * (y - a[1]) - dy * (x - a[0]) < 0) inside = false;
        const double t =
            length2 > 0 ? std::clamp(((x - a[0]) * dx + (y - a[1]) * dy) / length2, 0.0, 1.0) : 0.0;
        nearest = std::min(nearest, std::hypot(x - a[0] - t * dx, y - a[1] - t * dy));
    }
    return inside ? 0 : nearest;
}

}  // namespace slabwright
