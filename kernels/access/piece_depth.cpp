#include "kernels/access/piece_depth.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

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

namespace {

// Seen from a cylinder's tip, what of a polygon it may meet on its way is the polygon, drawn along the way
// backwards: a prism. Of a point w of it the depth is min(R - |w_xy|, w_z), which is concave and rises with
// w_z, so that the prism's faces and edges tell the greatest. On each it has a closed form: where the axis is
// nearest, or where side and floor are equally deep.
class DeepestOfPrism {
public:
    DeepestOfPrism(double radius, double more_than)
        : radius_(radius), more_than_(more_than), deepest_{more_than, 0} {}

    [[nodiscard]] bool found() const { return deepest_.depth > more_than_; }
    [[nodiscard]] Deepest deepest() const { return deepest_; }

    // From w to w + e, of the places t to t + dt of the way.
    void edge(const Point3& w, const Point3& e, double t, double dt) {
        if (std::max(w[2], w[2] + e[2]) <= deepest_.depth) return;
        const double ee = e[0] * e[0] + e[1] * e[1], we = w[0] * e[0] + w[1] * e[1],
                     ww = w[0] * w[0] + w[1] * w[1];
        const double nearest = ee > 0 ? std::clamp(-we / ee, 0.0, 1.0) : 0, reach = radius_ - deepest_.depth;
        if (const Point3 n = along(w, e, nearest); n[0] * n[0] + n[1] * n[1] >= reach * reach) return;
        const auto look = [&](double s) { take(along(w, e, s), t + s * dt); };
        look(nearest), look(0), look(1);
        // (R - w_z)² = |w_xy|² is a quadratic equation.
        const double over = radius_ - w[2], a = ee - e[2] * e[2], b = we + over * e[2], c = ww - over * over;
        const double q = -(b + std::copysign(std::sqrt(std::max(0.0, b * b - a * c)), b));
        for (const double s : {q / a, c / q})
            if (s > 0 && s < 1) look(s);
    }

    // The polygon, off its place by `from`, of the place t of the way.
    void face(const Polygon& polygon, const Point3& from, double t) {
        Point3 normal{};
        const Point3 corner = minus(polygon.p[0], from);
        for (int i = 1; i + 1 < polygon.n; ++i) {
            const Point3 n = cross(minus(polygon.p[i], polygon.p[0]), minus(polygon.p[i + 1], polygon.p[0]));
            for (std::size_t k = 0; k < 3; ++k) normal[k] += n[k];
        }
        const std::optional<Point3> w = deepest_on_plane(corner, normal);
        if (!w || !lies_above(*w)) return;
        bool left = false, right = false;
        for (int i = 0; i < polygon.n; ++i) {
            const Point3 &a = polygon.p[i], &b = polygon.p[(i + 1) % polygon.n];
            const double side =
                (b[0] - a[0]) * ((*w)[1] + from[1] - a[1]) - (b[1] - a[1]) * ((*w)[0] + from[0] - a[0]);
            left |= side > 0, right |= side < 0;
        }
        if (!(left && right)) take(*w, t);
    }

    // What an edge from w to w + e sweeps when it is drawn by `back`, which is the whole way.
    void side(const Point3& w, const Point3& e, const Point3& back) {
        const std::optional<Point3> p = deepest_on_plane(w, cross(e, back));
        if (!p || !lies_above(*p)) return;
        const double x = (*p)[0] - w[0], y = (*p)[1] - w[1], turn = e[0] * back[1] - e[1] * back[0];
        const double s = (x * back[1] - y * back[0]) / turn, t = (e[0] * y - e[1] * x) / turn;
        if (s >= 0 && s <= 1 && t >= 0 && t <= 1) take(*p, t);
    }

private:
    static Point3 along(const Point3& w, const Point3& e, double s) {
        return {w[0] + s * e[0], w[1] + s * e[1], w[2] + s * e[2]};
    }
    [[nodiscard]] bool lies_above(const Point3& w) const { return w[2] > deepest_.depth; }

    // Uphill from the axis, as far from it as the floor is high over the wall's foot. None of a plane that is
    // upright but for rounding: what is over its lower edge is over its upper one.
    [[nodiscard]] std::optional<Point3> deepest_on_plane(const Point3& corner, const Point3& normal) const {
        constexpr double upright = 1e-9;
        if (!(std::abs(normal[2]) > upright * std::sqrt(dot(normal, normal)))) return std::nullopt;
        const double rise_x = -normal[0] / normal[2], rise_y = -normal[1] / normal[2],
                     rise = std::sqrt(rise_x * rise_x + rise_y * rise_y),
                     at_axis = corner[2] - corner[0] * rise_x - corner[1] * rise_y;
        if (at_axis >= radius_ || !(rise > 0)) return Point3{0, 0, at_axis};
        const double off = (radius_ - at_axis) / (1 + rise);
        return Point3{off * rise_x / rise, off * rise_y / rise, at_axis + off * rise};
    }

    void take(const Point3& w, double t) {
        const double depth = std::min(radius_ - std::sqrt(w[0] * w[0] + w[1] * w[1]), w[2]);
        if (depth > deepest_.depth) deepest_ = {depth, t};
    }

    double radius_, more_than_;
    Deepest deepest_;
};

}  // namespace

Deepest piece_depth(const Point3& a, const Point3& b, const Polygon& polygon, double radius, double best) {
    double top = -kInfinity;
    for (int i = 0; i < polygon.n; ++i) top = std::max(top, polygon.p[i][2]);
    const double enough = best + StandingPart::kNumericalError;
    if (std::min(radius, top - std::min(a[2], b[2])) <= enough) return {best, 0};
    DeepestOfPrism prism(radius, enough);
    const Point3 back = minus(a, b);
    const bool moving = a != b;
    for (int i = 0; i < polygon.n; ++i) {
        const Point3 &p = polygon.p[i], e = minus(polygon.p[(i + 1) % polygon.n], p), w = minus(p, a);
        prism.edge(w, e, 0, 0);
        if (!moving) continue;
        prism.edge(minus(p, b), e, 1, 0);
        prism.edge(w, back, 0, 1);
        prism.side(w, e, back);
    }
    if (polygon.n > 2) {
        prism.face(polygon, a, 0);
        if (moving) prism.face(polygon, b, 1);
    }
    return prism.found() ? prism.deepest() : Deepest{best, 0};
}

}  // namespace slabwright
