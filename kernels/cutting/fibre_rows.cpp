#include "kernels/cutting/fibre_rows.h"

#include <cmath>
#include <limits>

#include "kernels/wide.h"

namespace slabwright {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

// The loops hold no branch that differs from line to line, so that a compiler can do several lines in one step; what does not depend on
// the line is decided outside of them.

SLABWRIGHT_WIDE void prism_rows(const PrismTerms& p, const double* __restrict v, int n, double* __restrict low, double* __restrict high,
                                double* __restrict nz_low, double* __restrict nz_high) {
    alignas(64) double l[kLinesTogether], h[kLinesTogether], k[kLinesTogether];
    const double r = p.r, nu = p.nu;
    for (int i = 0; i < n; ++i) k[i] = p.nv * v[i] + p.c;  // signed distance is nu·u + k
    if (std::abs(nu) < 1e-12) {
        for (int i = 0; i < n; ++i) {
            l[i] = std::abs(k[i]) >= r ? kInfinity : -kInfinity;
            h[i] = kInfinity;
        }
    } else {
        for (int i = 0; i < n; ++i) {
            const double a = (-r - k[i]) / nu, b = (r - k[i]) / nu;
            l[i] = a < b ? a : b;
            h[i] = a < b ? b : a;
        }
    }
    for (int e = 0; e < 3; ++e) {
        const double u = p.edge_u[static_cast<std::size_t>(e)], ev = p.edge_v[static_cast<std::size_t>(e)],
                     ec = p.edge_c[static_cast<std::size_t>(e)];
        if (u > 0) {
            for (int i = 0; i < n; ++i) {
                const double at = -(ev * v[i] + ec) / u;
                l[i] = l[i] < at ? at : l[i];
            }
        } else if (u < 0) {
            for (int i = 0; i < n; ++i) {
                const double at = -(ev * v[i] + ec) / u;
                h[i] = at < h[i] ? at : h[i];
            }
        } else {
            for (int i = 0; i < n; ++i) l[i] = ev * v[i] + ec < 0 ? kInfinity : l[i];
        }
    }
    for (int i = 0; i < n; ++i) {
        const bool met = l[i] < h[i], lower = met && l[i] < low[i], higher = met && h[i] > high[i];
        const double nz_l = (nu * l[i] + k[i]) / r * p.nz, nz_h = (nu * h[i] + k[i]) / r * p.nz;
        low[i] = lower ? l[i] : low[i];
        nz_low[i] = lower ? nz_l : nz_low[i];
        high[i] = higher ? h[i] : high[i];
        nz_high[i] = higher ? nz_h : nz_high[i];
    }
}

SLABWRIGHT_WIDE void capsule_rows(const CapsuleTerms& t, const double* __restrict v, int n, double* __restrict low, double* __restrict high,
                                  double* __restrict nz_low, double* __restrict nz_high) {
    const double r2 = t.r * t.r;
    // The balls around both ends.
    for (int end = 0; end < 2; ++end) {
        const double centre = end == 0 ? t.au : t.bu, cv = end == 0 ? t.av : t.bv, wz = end == 0 ? t.za : t.zb, over = r2 - wz * wz;
        if (over <= 0) continue;
        const double nz = t.nz > -1.5 ? t.nz : wz / t.r;
        for (int i = 0; i < n; ++i) {
            const double wv = v[i] - cv, h2 = over - wv * wv;
            const bool met = h2 > 0;
            const double h = std::sqrt(met ? h2 : 0.0), l = centre - h, u = centre + h;
            const bool lower = met && l < low[i], higher = met && u > high[i];
            low[i] = lower ? l : low[i];
            nz_low[i] = lower ? nz : nz_low[i];
            high[i] = higher ? u : high[i];
            nz_high[i] = higher ? nz : nz_high[i];
        }
    }
    const double du = t.bu - t.au, dv = t.bv - t.av, dz = t.za - t.zb, length2 = du * du + dv * dv + dz * dz;
    if (length2 <= 0) return;
    // Between them: with w = c − a and u = c_U − a_U, |w|² − (w·d)²/|d|² < r² and 0 ≤ w·d ≤ |d|².
    const double qa = 1 - du * du / length2;
    const bool along = qa < 1e-12;  // the segment lies along the lines
    alignas(64) double s[kLinesTogether], l[kLinesTogether], h[kLinesTogether];
    for (int i = 0; i < n; ++i) s[i] = dv * (v[i] - t.av) + dz * t.za;
    if (along) {
        for (int i = 0; i < n; ++i) {
            const double wv = v[i] - t.av, qc = wv * wv + t.za * t.za - s[i] * s[i] / length2 - r2;
            l[i] = qc >= 0 ? kInfinity : -kInfinity;
            h[i] = kInfinity;
        }
    } else {
        for (int i = 0; i < n; ++i) {
            const double wv = v[i] - t.av, qb = du * s[i] / length2, qc = wv * wv + t.za * t.za - s[i] * s[i] / length2 - r2;
            const double discriminant = qb * qb - qa * qc;
            const double root = std::sqrt(discriminant > 0 ? discriminant : 0.0);
            l[i] = discriminant > 0 ? (qb - root) / qa : kInfinity;
            h[i] = (qb + root) / qa;
        }
    }
    if (du > 0) {
        for (int i = 0; i < n; ++i) {
            const double t0 = -s[i] / du, t1 = (length2 - s[i]) / du;
            l[i] = l[i] < t0 ? t0 : l[i];
            h[i] = t1 < h[i] ? t1 : h[i];
        }
    } else if (du < 0) {
        for (int i = 0; i < n; ++i) {
            const double t1 = -s[i] / du, t0 = (length2 - s[i]) / du;
            l[i] = l[i] < t0 ? t0 : l[i];
            h[i] = t1 < h[i] ? t1 : h[i];
        }
    } else {
        for (int i = 0; i < n; ++i) l[i] = s[i] < 0 || s[i] > length2 ? kInfinity : l[i];
    }
    const bool own = !(t.nz > -1.5);
    for (int i = 0; i < n; ++i) {
        const bool met = l[i] < h[i];
        const double from = t.au + l[i], to = t.au + h[i];
        const bool lower = met && from < low[i], higher = met && to > high[i];
        const double nz_l = own ? (t.za - dz * (du * l[i] + s[i]) / length2) / t.r : t.nz;
        const double nz_h = own ? (t.za - dz * (du * h[i] + s[i]) / length2) / t.r : t.nz;
        low[i] = lower ? from : low[i];
        nz_low[i] = lower ? nz_l : nz_low[i];
        high[i] = higher ? to : high[i];
        nz_high[i] = higher ? nz_h : nz_high[i];
    }
}

SLABWRIGHT_WIDE void reach_rows(const double* __restrict v, int first, int last, double v_low, double v_high, double r2, double u_low, double u_high,
                                double* __restrict low, double* __restrict high) {
    for (int i = first; i < last; ++i) {
        const double under = v_low - v[i], over = v[i] - v_high, beside = under > over ? under : over, d = beside > 0 ? beside : 0;
        const double q = r2 - d * d, h = std::sqrt(q > 0 ? q : 0.0);
        low[i] = q > 0 ? u_low - h : kInfinity;
        high[i] = q > 0 ? u_high + h : -kInfinity;
    }
}

SLABWRIGHT_WIDE void tangent_rows(const TangentTerms& t, const double* __restrict v, int first, int last, double* __restrict low,
                                  double* __restrict high) {
    // Near the rim of its reach the tangent is steep, and says nothing.
    const double least = 0.01 * t.r2, z2 = t.r2 - t.z * t.z;
    for (int i = first; i < last; ++i) {
        const double w = v[i] - t.v, q = z2 - w * w;
        const bool near = q > least;
        const double h = std::sqrt(near ? q : 1.0), sv = w / h, sz = t.z / h;
        const double a = sv * t.dv[0] + sz * t.dz[0], b = sv * t.dv[1] + sz * t.dz[1], c = sv * t.dv[2] + sz * t.dz[2];
        const double a_up = a + t.du[0], b_up = b + t.du[1], c_up = c + t.du[2], a_down = a - t.du[0], b_down = b - t.du[1], c_down = c - t.du[2];
        const double ab = a_up > b_up ? a_up : b_up, up = ab > c_up ? ab : c_up, ab_d = a_down > b_down ? a_down : b_down,
                     down = ab_d > c_down ? ab_d : c_down;
        const double to = t.u + h + up, from = t.u - h - down;
        high[i] = near && to < high[i] ? to : high[i];
        low[i] = near && from > low[i] ? from : low[i];
    }
}

}  // namespace slabwright
