#include "kernels/access/triangle.h"

#include <algorithm>
#include <cmath>

namespace slabwright {

namespace {

Point3 sub(const Point3& a, const Point3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
double dot(const Point3& a, const Point3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Point3 cross(const Point3& a, const Point3& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Point3 between(const Point3& a, const Point3& b, double t) {
    return {a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t, a[2] + (b[2] - a[2]) * t};
}

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
    const Point3 d = sub(b, a);
    const double l = dot(d, d);
    return l > 0 ? between(a, b, std::clamp(dot(sub(c, a), d) / l, 0.0, 1.0)) : a;
}

Point3 closest_on_triangle(const Point3& c, const Triangle& t) {
    const Point3 n = cross(sub(t[1], t[0]), sub(t[2], t[0]));
    const double nn = dot(n, n);
    if (nn > 0) {
        bool inside = true;
        for (int i = 0; i < 3 && inside; ++i)
            inside = dot(cross(sub(t[(i + 1) % 3], t[i]), sub(c, t[i])), n) >= 0;
        if (inside) {
            const double h = dot(sub(c, t[0]), n) / nn;
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
    double d = dot(sub(c, best), sub(c, best));
    for (int i = 1; i < 3; ++i) {
        const Point3 q = closest_on_segment(c, t[i], t[(i + 1) % 3]);
        const double e = dot(sub(c, q), sub(c, q));
        if (e < d) d = e, best = q;
    }
    return best;
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
