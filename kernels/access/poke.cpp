#include "kernels/access/poke.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace slabwright {

namespace {

constexpr double kBracket = 1e-6;  // mm
constexpr int kHalvings = 60;

// Along the edge from p to q, relative to the axis; `z` is over the tip.
bool edge_pokes(const Point3& p, const Point3& q, const Envelope& e, Point3& at) {
    const double dx = q[0] - p[0], dy = q[1] - p[1], dz = q[2] - p[2];
    const double a = dx * dx + dy * dy, b = p[0] * dx + p[1] * dy,
                 c = p[0] * p[0] + p[1] * p[1] - e.radius * e.radius;
    double from = 0, to = 1;
    if (a > 0) {
        const double root = b * b - a * c;
        if (root < 0) return false;
        from = std::max(0.0, (-b - std::sqrt(root)) / a);
        to = std::min(1.0, (-b + std::sqrt(root)) / a);
        if (!(from <= to)) return false;
    } else if (c > 0) return false;
    auto z = [&](double t) { return p[2] + t * dz; };
    if (std::max(z(from), z(to)) <= e.low) return false;
    auto here = [&](double t) {
        at = {p[0] + t * dx, p[1] + t * dy, z(t)};
        return true;
    };
    auto distance = [&](double t) {
        const double x = p[0] + t * dx, y = p[1] + t * dy;
        return std::min(e.radius, std::sqrt(x * x + y * y));
    };
    // Height over the under side, and its derivative along the edge.
    auto over = [&](double t) { return z(t) - e.height(distance(t)); };
    auto rise = [&](double t) {
        const double d = distance(t), along = b + t * a;
        if (along == 0 || d == 0) return dz;
        return dz - e.slope(d) * along / d;
    };
    for (const double t : {from, to})
        if (over(t) > 0) return here(t);
    for (int i = 0; i < kHalvings; ++i) {
        const double t = (from + to) / 2, h = over(t), g = rise(t);
        if (h > 0) return here(t);
        // A concave function stays under its tangent.
        const double room = std::abs(g) * (to - from) / 2;
        if (h + room <= 0 || room < kBracket) return false;
        (g > 0 ? from : to) = t;
    }
    return false;
}

}  // namespace

bool pokes(const Triangle& triangle, double x, double y, double tip_z, const Envelope& e, Point3& at) {
    if (!(e.radius > 0)) return false;
    Triangle t = triangle;
    for (Point3& p : t) p[0] -= x, p[1] -= y, p[2] -= tip_z;
    if (std::max({t[0][2], t[1][2], t[2][2]}) <= e.low) return false;
    const double r = e.radius;
    if (std::min({t[0][0], t[1][0], t[2][0]}) > r || std::max({t[0][0], t[1][0], t[2][0]}) < -r ||
        std::min({t[0][1], t[1][1], t[2][1]}) > r || std::max({t[0][1], t[1][1], t[2][1]}) < -r)
        return false;
    auto here = [&](const Point3& p) {
        at = {p[0] + x, p[1] + y, p[2] + tip_z};
        return true;
    };
    double highest = 0;
    const Point3* corner = nullptr;
    for (const Point3& p : t) {
        const double d2 = p[0] * p[0] + p[1] * p[1];
        if (d2 > r * r) continue;
        const double over = p[2] - e.height(std::sqrt(d2));
        if (over > highest) highest = over, corner = &p;
    }
    // Over the facet's plane the height is greatest uphill of the axis, where the under side is as steep as
    // the plane.
    const double ux = t[1][0] - t[0][0], uy = t[1][1] - t[0][1], uz = t[1][2] - t[0][2];
    const double vx = t[2][0] - t[0][0], vy = t[2][1] - t[0][1], vz = t[2][2] - t[0][2];
    const double nz = ux * vy - uy * vx;
    if (nz != 0) {
        const double gx = -(uy * vz - uz * vy) / nz, gy = -(uz * vx - ux * vz) / nz,
                     steep = std::sqrt(gx * gx + gy * gy);
        double px = 0, py = 0, d = 0;
        if (steep > 0) {
            const double sine = steep / std::sqrt(1 + steep * steep);
            d = sine <= e.cos_taper ? std::min(r, e.core + e.rounding * sine) : r;
            px = d * gx / steep;
            py = d * gy / steep;
        }
        bool inside = true;
        for (int k = 0; k < 3 && inside; ++k) {
            const Point3 &a = t[k], &b = t[(k + 1) % 3];
            inside = ((b[0] - a[0]) * (py - a[1]) - (b[1] - a[1]) * (px - a[0])) * nz >= 0;
        }
        if (inside) {
            // A facet seen nearly edge-on has a slope of rounding only: no height outside its own range
            // counts.
            const double z =
                std::clamp(t[0][2] + gx * (px - t[0][0]) + gy * (py - t[0][1]),
                           std::min({t[0][2], t[1][2], t[2][2]}), std::max({t[0][2], t[1][2], t[2][2]}));
            if (z > e.height(d)) return here({px, py, z});
        }
    }
    if (corner) return here(*corner);
    Point3 on_edge;
    for (int k = 0; k < 3; ++k)
        if (edge_pokes(t[k], t[(k + 1) % 3], e, on_edge)) return here(on_edge);
    return false;
}

double nearest_over(const Point3& point, const Triangle& t, Point3& at) {
    std::array<Point3, 4> q;  // relative to the point; what is left of the triangle above it
    int n = 0;
    for (int k = 0; k < 3; ++k) {
        const Point3 &a = t[k], &b = t[(k + 1) % 3];
        const double za = a[2] - point[2], zb = b[2] - point[2];
        if (za > 0) q[n++] = {a[0] - point[0], a[1] - point[1], za};
        if ((za > 0) != (zb > 0)) {
            const double s = za / (za - zb);
            q[n++] = {a[0] + s * (b[0] - a[0]) - point[0], a[1] + s * (b[1] - a[1]) - point[1], 0};
        }
    }
    if (n == 0) return std::numeric_limits<double>::infinity();
    double best = std::numeric_limits<double>::infinity();
    int left = 0, right = 0;
    for (int k = 0; k < n; ++k) {
        const Point3 &a = q[k], &b = q[(k + 1) % n];
        const double dx = b[0] - a[0], dy = b[1] - a[1], l = dx * dx + dy * dy;
        const double s = l > 0 ? std::clamp(-(a[0] * dx + a[1] * dy) / l, 0.0, 1.0) : 0;
        const double px = a[0] + s * dx, py = a[1] + s * dy, d = px * px + py * py;
        if (d < best) best = d, at = {px + point[0], py + point[1], a[2] + s * (b[2] - a[2]) + point[2]};
        const double side = a[0] * b[1] - a[1] * b[0];
        left += side > 0;
        right += side < 0;
    }
    // All of it turns one way about the line: the line passes through it.
    if (n >= 3 && (left == n || right == n)) {
        const double ux = t[1][0] - t[0][0], uy = t[1][1] - t[0][1], uz = t[1][2] - t[0][2];
        const double vx = t[2][0] - t[0][0], vy = t[2][1] - t[0][1], vz = t[2][2] - t[0][2];
        const double nz = ux * vy - uy * vx;
        if (nz != 0) {
            const double z = t[0][2] + ((uy * vz - uz * vy) * (t[0][0] - point[0]) +
                                        (uz * vx - ux * vz) * (t[0][1] - point[1])) /
                                           nz;
            at = {point[0], point[1], std::clamp(z, point[2], std::max({t[0][2], t[1][2], t[2][2]}))};
            return 0;
        }
    }
    return std::sqrt(best);
}

}  // namespace slabwright
