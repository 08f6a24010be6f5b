#include "kernels/geometry/triangle.h"

#include <algorithm>
#include <cmath>

namespace slabwright {

namespace {

/// Which side of the line through two corners of a facet a point lies on. Both facets of an edge evaluate it
/// from the same end, so that they cannot both claim or both miss a point.
double side(const Vec3f& a, const Vec3f& b, double x, double y) {
    const bool swap = b.x < a.x || (b.x == a.x && (b.y < a.y || (b.y == a.y && b.z < a.z)));
    const Vec3f &p = swap ? b : a, &q = swap ? a : b;
    const double s =
        (static_cast<double>(q.x) - p.x) * (y - p.y) - (static_cast<double>(q.y) - p.y) * (x - p.x);
    return swap ? -s : s;
}

}  // namespace

Point3 closest_on_segment(const Point3& c, const Point3& a, const Point3& b) {
    const Point3 d = minus(b, a);
    const double l = dot(d, d);
    return l > 0 ? between(a, b, std::clamp(dot(minus(c, a), d) / l, 0.0, 1.0)) : a;
}

Point3 closest_on_triangle(const Point3& c, const Triangle& t) {
    const Point3 n = cross(minus(t[1], t[0]), minus(t[2], t[0]));
    const double nn = dot(n, n);
    if (nn > 0) {
        bool inside = true;
        for (int i = 0; i < 3 && inside; ++i)
            inside = dot(cross(minus(t[(i + 1) % 3], t[i]), minus(c, t[i])), n) >= 0;
        if (inside) {
            const double h = dot(minus(c, t[0]), n) / nn;
            const Point3 q{c[0] - h * n[0], c[1] - h * n[1], c[2] - h * n[2]};
            // The signs of a sliver may be rounding: a foot outside the triangle's box is none.
            bool in_box = true;
            for (int k = 0; k < 3; ++k)
                in_box = in_box && q[k] >= std::min({t[0][k], t[1][k], t[2][k]}) - 1e-6 &&
                         q[k] <= std::max({t[0][k], t[1][k], t[2][k]}) + 1e-6;
            if (in_box) return q;
        }
    }
    Point3 best = closest_on_segment(c, t[0], t[1]);
    double d = dot(minus(c, best), minus(c, best));
    for (int i = 1; i < 3; ++i) {
        const Point3 q = closest_on_segment(c, t[i], t[(i + 1) % 3]);
        const double e = dot(minus(c, q), minus(c, q));
        if (e < d) d = e, best = q;
    }
    return best;
}

double squared_distance(const Point3& p, const Triangle& t, Point3& q) {
    const Point3 ab = minus(t[1], t[0]), ac = minus(t[2], t[0]), ap = minus(p, t[0]);
    auto from = [&](double v, double w) {
        q = {t[0][0] + v * ab[0] + w * ac[0], t[0][1] + v * ab[1] + w * ac[1],
             t[0][2] + v * ab[2] + w * ac[2]};
        return squared_distance(p, q);
    };
    // Of an edge without length both ends are as far along: no share of it is asked for.
    const double d1 = dot(ab, ap), d2 = dot(ac, ap);
    if (d1 <= 0 && d2 <= 0) return from(0, 0);
    const Point3 bp = minus(p, t[1]);
    const double d3 = dot(ab, bp), d4 = dot(ac, bp);
    if (d3 >= 0 && d4 <= d3) return from(1, 0);
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0 && d1 > d3) return from(d1 / (d1 - d3), 0);
    const Point3 cp = minus(p, t[2]);
    const double d5 = dot(ab, cp), d6 = dot(ac, cp);
    if (d6 >= 0 && d5 <= d6) return from(0, 1);
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0 && d2 > d6) return from(0, d2 / (d2 - d6));
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0 && d4 >= d3 && d5 >= d6 && (d4 > d3 || d5 > d6)) {
        const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return from(1 - w, w);
    }
    const double all = va + vb + vc;
    if (!(all > 0)) {  // a triangle without area
        q = closest_on_triangle(p, t);
        return squared_distance(p, q);
    }
    return from(vb / all, vc / all);
}

// A point on the line counts as left of it where the edge rises, in both of its facets alike.
int facet_winding(const std::array<Vec3f, 3>& f, double x, double y) {
    int w = 0;
    for (int i = 0; i < 3; ++i) {
        const Vec3f &a = f[i], &b = f[(i + 1) % 3];
        const bool up = a.y <= y && y < b.y, down = b.y <= y && y < a.y;
        if (!up && !down) continue;
        const double s = up ? side(a, b, x, y) : -side(a, b, x, y);
        if (s >= 0) w += up ? 1 : -1;
    }
    return w;
}

double facet_height(const std::array<Vec3f, 3>& f, double x, double y) {
    const double ax = f[0].x, ay = f[0].y, az = f[0].z;
    const double ux = f[1].x - ax, uy = f[1].y - ay, uz = f[1].z - az, vx = f[2].x - ax, vy = f[2].y - ay,
                 vz = f[2].z - az;
    const double det = ux * vy - uy * vx;
    const double low = std::min({f[0].z, f[1].z, f[2].z}), high = std::max({f[0].z, f[1].z, f[2].z});
    if (det == 0) return high;
    const double s = ((x - ax) * vy - (y - ay) * vx) / det, t = (ux * (y - ay) - uy * (x - ax)) / det;
    return std::clamp(az + s * uz + t * vz, low, high);
}

}  // namespace slabwright
