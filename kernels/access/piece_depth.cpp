#include "kernels/access/piece_depth.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/access/standing_part.h"

namespace slabwright {

namespace {
constexpr double kInfinity = std::numeric_limits<double>::infinity();
}

Polygon clip_z(const Polygon& in, double z, bool keep_above) {
    Polygon out;
    for (int i = 0; i < in.n; ++i) {
        const Point3 &a = in.p[i], &b = in.p[(i + 1) % in.n];
        const double da = keep_above ? a[2] - z : z - a[2], db = keep_above ? b[2] - z : z - b[2];
        if (da >= 0) out.p[out.n++] = a;
        if ((da < 0) != (db < 0)) {
            Point3 c = between(a, b, da / (da - db));
            c[2] = z;
            out.p[out.n++] = c;
        }
    }
    return out;
}

namespace {

double distance_2d(Vec2d p, Vec2d a, Vec2d b) {
    const double dx = b.x - a.x, dy = b.y - a.y, l = dx * dx + dy * dy;
    const double t = l > 0 ? std::clamp(((p.x - a.x) * dx + (p.y - a.y) * dy) / l, 0.0, 1.0) : 0.0;
    const double ex = p.x - a.x - t * dx, ey = p.y - a.y - t * dy;
    return std::sqrt(ex * ex + ey * ey);
}

double cross_2d(Vec2d a, Vec2d b, Vec2d c) { return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x); }

bool segments_cross(Vec2d a, Vec2d b, Vec2d c, Vec2d d) {
    const double s1 = cross_2d(a, b, c), s2 = cross_2d(a, b, d), s3 = cross_2d(c, d, a),
                 s4 = cross_2d(c, d, b);
    return ((s1 > 0) != (s2 > 0)) && ((s3 > 0) != (s4 > 0));
}

bool contains_2d(const Polygon& poly, Vec2d q) {
    // The box first: on a polygon seen edge-on all signs below are rounding, and could agree far along its
    // line.
    double x0 = kInfinity, x1 = -kInfinity, y0 = kInfinity, y1 = -kInfinity;
    for (int i = 0; i < poly.n; ++i) {
        x0 = std::min(x0, poly.p[i][0]);
        x1 = std::max(x1, poly.p[i][0]);
        y0 = std::min(y0, poly.p[i][1]);
        y1 = std::max(y1, poly.p[i][1]);
    }
    if (q.x < x0 || q.x > x1 || q.y < y0 || q.y > y1) return false;
    int turn = 0;
    for (int i = 0; i < poly.n; ++i) {
        const Point3 &a = poly.p[i], &b = poly.p[(i + 1) % poly.n];
        const double s = cross_2d({a[0], a[1]}, {b[0], b[1]}, q);
        if (s == 0) continue;
        if (turn != 0 && (s > 0) != (turn > 0)) return false;
        turn = s > 0 ? 1 : -1;
    }
    return turn != 0;  // a polygon seen edge-on has no inside; its edges are measured
}

}  // namespace

double distance_2d(const Polygon& poly, Vec2d a, Vec2d b) {
    if (poly.n == 0) return kInfinity;
    // Points exactly on an edge line give s == 0 for one edge only, which contains_2d tolerates: their
    // distance is 0 or is measured against the edges anyway.
    if (poly.n >= 3 && contains_2d(poly, a)) {
        double area = 0;
        for (int i = 1; i + 1 < poly.n; ++i)
            area += cross_2d({poly.p[0][0], poly.p[0][1]}, {poly.p[i][0], poly.p[i][1]},
                             {poly.p[i + 1][0], poly.p[i + 1][1]});
        if (area != 0) return 0;
    }
    const bool moving = a.x != b.x || a.y != b.y;
    double best = kInfinity;
    for (int i = 0; i < poly.n; ++i) {
        const Vec2d c{poly.p[i][0], poly.p[i][1]},
            d{poly.p[(i + 1) % poly.n][0], poly.p[(i + 1) % poly.n][1]};
        best = std::min(best, distance_2d(a, c, d));
        if (moving) {
            if (segments_cross(a, b, c, d)) return 0;
            best = std::min({best, distance_2d(b, c, d), distance_2d(c, a, b)});
        }
    }
    return best;
}

RayDistance ray_distance(const Point3& c, const Triangle& t) {
    const Point3 q = closest_on_triangle(c, t);
    if (q[2] <= c[2]) {
        const Point3 v = minus(c, q);
        return {std::sqrt(dot(v, v)), v};
    }
    Polygon poly;
    poly.n = 3;
    for (int i = 0; i < 3; ++i) poly.p[i] = t[i];
    poly = clip_z(poly, c[2], true);
    if (poly.n == 0) {  // q is above by rounding only
        const Point3 v{c[0] - q[0], c[1] - q[1], 0};
        return {std::sqrt(dot(v, v)), v};
    }
    const Vec2d a{c[0], c[1]};
    if (distance_2d(poly, a, a) == 0) return {0, {0, 0, 0}};
    double best = kInfinity;
    Point3 v{};
    for (int i = 0; i < poly.n; ++i) {
        Point3 s = poly.p[i], e = poly.p[(i + 1) % poly.n], from = c;
        s[2] = e[2] = from[2] = 0;
        const Point3 w = minus(from, closest_on_segment(from, s, e));
        const double d = dot(w, w);
        if (d < best) best = d, v = w;
    }
    return {std::sqrt(best), v};
}

namespace {

// From an edge to a disc about c and all above it.
RayDistance disc_to_edge(const Point3& c, double disc, const Point3& a, const Point3& b) {
    constexpr double bracket = 1e-8;  // mm
    const Point3 e = minus(b, a), from_axis = minus(a, c);
    const auto at = [&](double t) {
        const double x = from_axis[0] + t * e[0], y = from_axis[1] + t * e[1],
                     under = std::max(0.0, -(from_axis[2] + t * e[2])), r = std::sqrt(x * x + y * y),
                     beside = std::max(0.0, r - disc), d = std::sqrt(beside * beside + under * under);
        const double share = r > 0 ? beside / r : 0;
        return RayDistance{d, {-x * share, -y * share, under}};
    };
    RayDistance best = at(0);
    if (const RayDistance end = at(1); end.d < best.d) best = end;
    double low = 0, high = 1;
    for (int i = 0; i < 80; ++i) {
        const double t = (low + high) / 2;
        const RayDistance here = at(t);
        if (here.d < best.d) best = here;
        const double rise = here.d > 0 ? -dot(here.vector, e) / here.d : 0;
        // A convex function stays over its tangent.
        if (std::abs(rise) * (high - low) / 2 < bracket) break;
        (rise > 0 ? high : low) = t;
    }
    return best;
}

RayDistance disc_distance(const Point3& c, double disc, const Triangle& t) {
    const Point3 u = minus(t[1], t[0]), v = minus(t[2], t[0]);
    Point3 n{u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
    const double area2 = std::sqrt(dot(n, n));
    // Of a facet that is upright but for rounding the edges tell all: what is over the disc lies under one.
    constexpr double upright = 1e-9;
    if (area2 > 0 && std::abs(n[2]) > upright * area2) {
        const double sign = n[2] > 0 ? 1 / area2 : -1 / area2;
        for (double& k : n) k *= sign;
        // Of the disc the place at its uphill rim is the nearest to the plane.
        const double across = std::sqrt(n[0] * n[0] + n[1] * n[1]);
        Point3 rim = c;
        if (across > 0) rim[0] -= disc * n[0] / across, rim[1] -= disc * n[1] / across;
        const double s = dot(n, minus(rim, t[0])), off = std::max(0.0, s);
        Point3 foot{rim[0] - off * n[0], rim[1] - off * n[1], rim[2] - off * n[2]};
        if (s < 0) foot[2] -= s / n[2];
        bool left = false, right = false;
        for (std::size_t k = 0; k < 3; ++k) {
            const Point3 e = minus(t[(k + 1) % 3], t[k]), w = minus(foot, t[k]);
            const Point3 cross{e[1] * w[2] - e[2] * w[1], e[2] * w[0] - e[0] * w[2],
                               e[0] * w[1] - e[1] * w[0]};
            const double side = dot(n, cross);
            left |= side > 0, right |= side < 0;
        }
        if (!(left && right)) return {off, {off * n[0], off * n[1], off * n[2]}};
    }
    RayDistance best{kInfinity, {}};
    for (std::size_t k = 0; k < 3; ++k)
        if (const RayDistance d = disc_to_edge(c, disc, t[k], t[(k + 1) % 3]); d.d < best.d) best = d;
    return best;
}

template <class Distance>
Closest least_on_piece(const Point3& a, const Point3& b, double limit, Distance&& distance) {
    const Point3 along = minus(b, a);
    const double length = std::sqrt(dot(along, along));
    struct Sample {
        double t, d, g;
    };
    auto at = [&](double t) {
        const RayDistance r = distance(between(a, b, t));
        return Sample{t, r.d, r.d > 0 ? dot(r.vector, along) / r.d : 0};
    };
    const Sample mid = at(0.5);
    if (mid.d - length / 2 >= limit || mid.g == 0 || length == 0) return {mid.d, 0.5};
    if (mid.d - std::abs(mid.g) / 2 >= limit) return {mid.d, 0.5};
    Sample l = mid, r = mid;
    if (mid.g > 0) {
        l = at(0);
        if (l.g >= 0) return {l.d, 0};
    } else {
        r = at(1);
        if (r.g <= 0) return {r.d, 1};
    }
    for (int i = 0; i < 60; ++i) {
        const Sample& best = l.d <= r.d ? l : r;
        double t = (r.d - l.d + l.g * l.t - r.g * r.t) / (l.g - r.g);
        const double bound = l.d + l.g * (t - l.t);
        if (!(bound < limit) || best.d - bound <= StandingPart::kNumericalError) break;
        // A crossing at an end would not shorten the bracket.
        const double margin = 1e-3 * (r.t - l.t);
        t = std::clamp(t, l.t + margin, r.t - margin);
        const Sample m = at(t);
        if (m.g == 0) return {m.d, m.t};
        (m.g > 0 ? r : l) = m;
    }
    return l.d <= r.d ? Closest{l.d, l.t} : Closest{r.d, r.t};
}

}  // namespace

Closest piece_distance(const Point3& a, const Point3& b, const Triangle& tri, double limit) {
    return least_on_piece(a, b, limit, [&](const Point3& c) { return ray_distance(c, tri); });
}

Closest disc_piece_distance(const Point3& a, const Point3& b, double disc, const Triangle& tri,
                            double limit) {
    return least_on_piece(a, b, limit, [&](const Point3& c) { return disc_distance(c, disc, tri); });
}

Deepest piece_depth(const Point3& a, const Point3& b, const Polygon& tri, double radius, double best) {
    double top = -kInfinity;
    for (int i = 0; i < tri.n; ++i) top = std::max(top, tri.p[i][2]);
    auto reaches = [&](const Point3& s, const Point3& e, double tip, double depth) {
        return distance_2d(clip_z(tri, tip + depth, true), {s[0], s[1]}, {e[0], e[1]}) <= radius - depth;
    };
    // The largest depth reached with the tip at one height, while its axis is anywhere between s and e.
    auto deepest_at = [&](const Point3& s, const Point3& e, double tip, double floor) {
        double low = floor, high = std::min(radius, top - tip);
        if (high <= low) return floor;
        if (reaches(s, e, tip, high)) return high;
        while (high - low > StandingPart::kNumericalError / 4) {
            const double m = (low + high) / 2;
            (reaches(s, e, tip, m) ? low : high) = m;
        }
        return low;
    };
    const double lowest = std::min(a[2], b[2]);
    const double enough = best + StandingPart::kNumericalError;
    if (std::min(radius, top - lowest) <= enough || !reaches(a, b, lowest, enough)) return {best, 0};
    if (a[2] == b[2]) {
        const double depth = deepest_at(a, b, lowest, best);
        if (depth <= best) return {best, 0};
        // The place along the piece: the axis there is nearest to what stands above the cylinder's shrunken
        // floor.
        const Polygon above = clip_z(tri, lowest + depth, true);
        double low = 0, high = 1;
        for (int i = 0; i < 40; ++i) {
            const double m1 = low + (high - low) / 3, m2 = high - (high - low) / 3;
            const Point3 p = between(a, b, m1), q = between(a, b, m2);
            if (distance_2d(above, {p[0], p[1]}, {p[0], p[1]}) <=
                distance_2d(above, {q[0], q[1]}, {q[0], q[1]}))
                high = m2;
            else low = m1;
        }
        return {depth, (low + high) / 2};
    }
    // A ramp or plunge: the depth is concave along the way, so a search by thirds finds its maximum.
    auto depth_at = [&](double t) {
        const Point3 p = between(a, b, t);
        return deepest_at(p, p, p[2], std::min(0.0, best) - 2 * (StandingPart::kPiece + 1));
    };
    double low = 0, high = 1;
    for (int i = 0; i < 50; ++i) {
        const double m1 = low + (high - low) / 3, m2 = high - (high - low) / 3;
        if (depth_at(m1) >= depth_at(m2)) high = m2;
        else low = m1;
    }
    Deepest result{best, 0};
    for (const double t : {0.0, (low + high) / 2, 1.0}) {
        const double d = depth_at(t);
        if (d > result.depth) result = {d, t};
    }
    return result;
}

}  // namespace slabwright
