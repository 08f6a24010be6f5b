// What a facet is to lines of one direction at one height: the terms of fibre_rows.h, and its parts above and
// in a plane. Internal to fibres: U is the lines' direction, V the other one in the plane.
#pragma once

#include <algorithm>
#include <array>

#include "kernels/cutting/fibre_rows.h"
#include "kernels/cutting/layer_solid.h"

namespace slabwright {

// A segment met by lines in direction U at height zc.
template <int U, int V>
CapsuleTerms capsule(const Vec3d& a, const Vec3d& b, double radius, double zc, double nz = -2) {
    return {a[U], a[V], zc - a[2], b[U], b[V], zc - b[2], radius, nz};
}

template <int U, int V>
PrismTerms prism(const SolidFacet& f, double radius, double zc) {
    const Vec3d& n = f.normal;
    PrismTerms t{n[U],   n[V], n[2], n[2] * (zc - f.p[0][2]) - n[U] * f.p[0][U] - n[V] * f.p[0][V],
                 radius, {},   {},   {}};
    for (std::size_t k = 0; k < 3; ++k) {
        const Vec3d &a = f.p[k], &b = f.p[(k + 1) % 3];
        const Vec3d e{b[0] - a[0], b[1] - a[1], b[2] - a[2]};
        const Vec3d m{n[1] * e[2] - n[2] * e[1], n[2] * e[0] - n[0] * e[2],
                      n[0] * e[1] - n[1] * e[0]};  // inward
        t.edge_u[k] = m[U];
        t.edge_v[k] = m[V];
        t.edge_c[k] = m[2] * (zc - a[2]) - m[U] * a[U] - m[V] * a[V];
    }
    return t;
}

// The part of a facet above z, seen from above, as a convex polygon at height z.
inline int part_above(const SolidFacet& f, double z, std::array<Vec3d, 4>& out) {
    int n = 0;
    for (int k = 0; k < 3; ++k) {
        const Vec3d &a = f.p[k], &b = f.p[(k + 1) % 3];
        const bool a_in = a[2] > z, b_in = b[2] > z;
        if (a_in) out[n++] = {a[0], a[1], z};
        if (a_in != b_in) {
            const Vec3d &low = a_in ? b : a, &high = a_in ? a : b;
            const double t = (z - low[2]) / (high[2] - low[2]);
            out[n++] = {low[0] + t * (high[0] - low[0]), low[1] + t * (high[1] - low[1]), z};
        }
    }
    return n;
}

// The segment in which the plane just above z cuts a facet.
inline bool cut_segment(const SolidFacet& f, double z, std::array<Vec3d, 2>& out) {
    int n = 0;
    for (int k = 0; k < 3 && n < 2; ++k) {
        const Vec3d &a = f.p[k], &b = f.p[(k + 1) % 3];
        const bool a_in = a[2] > z, b_in = b[2] > z;
        if (a_in == b_in) continue;
        const Vec3d &low = a_in ? b : a, &high = a_in ? a : b;
        const double t = (z - low[2]) / (high[2] - low[2]);
        out[n++] = {low[0] + t * (high[0] - low[0]), low[1] + t * (high[1] - low[1]), z};
    }
    return n == 2;
}

// Whether a cutter at this height can touch what lies in [z_min, z_max]: the ball by its lower half, the disc
// by its plane, both by what overhangs them, up to `overhang`.
inline bool may_touch(double z_min, double z_max, double overhang, bool ball, double r, double zc) {
    if (ball && z_max > zc - r && z_min <= zc) return true;
    return overhang > zc || (!ball && z_max > zc && z_min <= zc);
}

}  // namespace slabwright
