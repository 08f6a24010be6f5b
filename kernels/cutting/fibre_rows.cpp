#include "kernels/cutting/fibre_rows.h"

#include <cmath>
#include <cstring>
#include <limits>

#include "kernels/geometry/wide.h"

namespace slabwright {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// How far along n lines at v what lies in a box may forbid: low and high, or low > high where it is out of
// reach.
[[gnu::always_inline]] inline void reach(const BoxTerms& b, const double* __restrict v, int n,
                                         double* __restrict low, double* __restrict high) {
    const double u_low = b.u_low, u_high = b.u_high;
    for (int i = 0; i < n; ++i) {
        const double under = b.v_low - v[i], over = v[i] - b.v_high, beside = under > over ? under : over,
                     d = beside > 0 ? beside : 0;
        const double q = b.r2 - d * d,
                     h = std::sqrt(std::abs(q));  // a choice under the root would keep the compiler from
                                                  // doing several lines at once
        low[i] = q > 0 ? u_low - h : kInfinity;
        high[i] = q > 0 ? u_high + h : -kInfinity;
    }
}

[[gnu::always_inline]] inline std::int64_t out(const CoverRows& cover, const double* __restrict low,
                                               const double* __restrict high, int first, int n,
                                               std::int64_t* __restrict state) {
    const double *__restrict const from = cover.low.data() + first, *__restrict const to = cover.high.data() + first,
                 *__restrict const next = cover.next.data() + first;
    std::int64_t any = 0;
    for (int i = 0; i < n; ++i) {
        const bool within = (from[i] <= low[i]) & (high[i] <= to[i]), nothing = low[i] >= high[i],
                   here = (from[i] <= low[i]) & (low[i] < next[i]);
        const std::int64_t beyond = here ? kReachesOut : kLooksElsewhere, s = within | nothing ? 0 : beyond;
        state[i] = s;
        any |= s;
    }
    return any;
}

// Near the rim of its reach the tangent is steep, and says nothing: what is left of r² there at least, as a
// share.
constexpr double kTangentLeast = 0.01;

constexpr float kTouchMargin = 1e-4F;  // mm
constexpr double kOnPlane = 1 - 1e-6;  // of r: nearer to a plane is not at r

}  // namespace

// The loops hold no branch that differs from line to line, so that a compiler can do several lines in one
// step; what does not depend on the line is decided outside of them.

namespace {

template <bool marked>
[[gnu::always_inline]] inline void prism_on(const PrismTerms& p, const double* __restrict v, int lines,
                                            double* __restrict low, double* __restrict high,
                                            double* __restrict nz_low, double* __restrict nz_high) {
    alignas(64) double l[kLinesTogether], h[kLinesTogether], k[kLinesTogether];
    const int n = lines / kLinesStep * kLinesStep;
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
        const bool met = l[i] < h[i], lower = met & (l[i] < low[i]), higher = met & (h[i] > high[i]);
        const double share_l = (nu * l[i] + k[i]) / r, share_h = (nu * h[i] + k[i]) / r;
        const double mark_l = marked & (std::abs(share_l) < kOnPlane) ? kWithin : 0.0,
                     mark_h = marked & (std::abs(share_h) < kOnPlane) ? kWithin : 0.0;
        const double nz_l = share_l * p.nz + mark_l, nz_h = share_h * p.nz + mark_h;
        low[i] = lower ? l[i] : low[i];
        nz_low[i] = lower ? nz_l : nz_low[i];
        high[i] = higher ? h[i] : high[i];
        nz_high[i] = higher ? nz_h : nz_high[i];
    }
}

}  // namespace

SLABWRIGHT_WIDE void prism_rows(const PrismTerms& p, const double* v, int lines, double* low, double* high,
                                double* nz_low, double* nz_high) {
    prism_on<false>(p, v, lines, low, high, nz_low, nz_high);
}
SLABWRIGHT_WIDE void marked_prism_rows(const PrismTerms& p, const double* v, int lines, double* low,
                                       double* high, double* nz_low, double* nz_high) {
    prism_on<true>(p, v, lines, low, high, nz_low, nz_high);
}

namespace {

// The balls around the first ends.
[[gnu::always_inline]] inline void ends_on(const CapsuleTerms& t, int ends, const double* __restrict v,
                                           int lines, double* __restrict low, double* __restrict high,
                                           double* __restrict nz_low, double* __restrict nz_high) {
    const double r2 = t.r * t.r;
    const int n = lines / kLinesStep * kLinesStep;
    for (int end = 0; end < ends; ++end) {
        const double centre = end == 0 ? t.au : t.bu, cv = end == 0 ? t.av : t.bv,
                     wz = end == 0 ? t.za : t.zb, over = r2 - wz * wz;
        if (over <= 0) continue;
        const double nz = t.nz > -1.5 ? t.nz : wz / t.r;
        for (int i = 0; i < n; ++i) {
            const double wv = v[i] - cv, h2 = over - wv * wv;
            const bool met = h2 > 0;
            const double h = std::sqrt(std::abs(h2)), l = centre - h, u = centre + h;
            const bool lower = met & (l < low[i]), higher = met & (u > high[i]);
            low[i] = lower ? l : low[i];
            nz_low[i] = lower ? nz : nz_low[i];
            high[i] = higher ? u : high[i];
            nz_high[i] = higher ? nz : nz_high[i];
        }
    }
}

// What is between them.
[[gnu::always_inline]] inline void cylinder_on(const CapsuleTerms& t, const double* __restrict v, int lines,
                                               double* __restrict low, double* __restrict high,
                                               double* __restrict nz_low, double* __restrict nz_high) {
    const double r2 = t.r * t.r;
    const int n = lines / kLinesStep * kLinesStep;
    const double du = t.bu - t.au, dv = t.bv - t.av, dz = t.za - t.zb, length2 = du * du + dv * dv + dz * dz;
    if (length2 <= 0) return;
    // With w = c − a and u = c_U − a_U, |w|² − (w·d)²/|d|² < r² and 0 ≤ w·d ≤ |d|².
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
            const double wv = v[i] - t.av, qb = du * s[i] / length2,
                         qc = wv * wv + t.za * t.za - s[i] * s[i] / length2 - r2;
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
        const bool lower = met & (from < low[i]), higher = met & (to > high[i]);
        const double nz_l = own ? (t.za - dz * (du * l[i] + s[i]) / length2) / t.r : t.nz;
        const double nz_h = own ? (t.za - dz * (du * h[i] + s[i]) / length2) / t.r : t.nz;
        low[i] = lower ? from : low[i];
        nz_low[i] = lower ? nz_l : nz_low[i];
        high[i] = higher ? to : high[i];
        nz_high[i] = higher ? nz_h : nz_high[i];
    }
}

}  // namespace

SLABWRIGHT_WIDE void capsule_rows(const CapsuleTerms& t, const double* v, int lines, double* low,
                                  double* high, double* nz_low, double* nz_high) {
    ends_on(t, 2, v, lines, low, high, nz_low, nz_high);
    cylinder_on(t, v, lines, low, high, nz_low, nz_high);
}
SLABWRIGHT_WIDE void cylinder_rows(const CapsuleTerms& t, const double* v, int lines, double* low,
                                   double* high, double* nz_low, double* nz_high) {
    cylinder_on(t, v, lines, low, high, nz_low, nz_high);
}
SLABWRIGHT_WIDE void end_rows(const CapsuleTerms& t, const double* v, int lines, double* low, double* high,
                              double* nz_low, double* nz_high) {
    ends_on(t, 1, v, lines, low, high, nz_low, nz_high);
}

SLABWRIGHT_WIDE std::int64_t cover_rows(const CoverRows& cover, const double* low, const double* high,
                                        int first, int last, std::int64_t* state) {
    return out(cover, low + first, high + first, first, (last - first) / kLinesStep * kLinesStep,
               state + first);
}

SLABWRIGHT_WIDE std::int64_t box_out_rows(const BoxTerms& b, const CoverRows& cover, const double* v,
                                          int first, int last, double* low, double* high,
                                          std::int64_t* state) {
    const int n = (last - first) / kLinesStep * kLinesStep;
    reach(b, v + first, n, low + first, high + first);
    return out(cover, low + first, high + first, first, n, state + first);
}

// Nothing farther than r over or under the lines keeps a ball away, and a tall wall's other parts would make
// it seem to reach farther.
void facet_terms(const SolidFacet& f, std::size_t u, double r, double zc, BoxTerms& box, TangentTerms& t) {
    const std::size_t v = 1 - u;
    const double bottom = zc - r, top = zc + r, dz = std::max({0.0, f.z_min - zc, zc - f.z_max}),
                 touched = std::clamp(zc - r * f.normal[2], f.z_min, f.z_max);
    box = {kInfinity, -kInfinity, kInfinity, -kInfinity, r * r - dz * dz};
    t.v_low = kInfinity, t.v_high = -kInfinity, t.across = r * f.normal[v], t.z = zc - touched, t.r2 = r * r;
    std::size_t n = 0;
    const auto add = [&](double pu, double pv, double z) {
        t.u[n] = pu, t.v[n] = pv, t.dz[n] = z - touched;
        box.u_low = std::min(box.u_low, pu), box.u_high = std::max(box.u_high, pu);
        box.v_low = std::min(box.v_low, pv), box.v_high = std::max(box.v_high, pv);
        ++n;
    };
    const bool whole = f.z_min >= bottom && f.z_max <= top;
    for (std::size_t k = 0; k < 3; ++k) {
        const Vec3d &a = f.p[k], &b = f.p[k == 2 ? 0 : k + 1];
        const double low = std::min(a[2], b[2]), high = std::max(a[2], b[2]);
        if (low <= touched && touched <= high) {
            const double at = low < high ? a[v] + (touched - a[2]) / (b[2] - a[2]) * (b[v] - a[v]) : a[v];
            t.v_low = std::min(t.v_low, at), t.v_high = std::max(t.v_high, at);
        }
        if (whole || (a[2] >= bottom && a[2] <= top)) add(a[u], a[v], a[2]);
        if (whole) continue;
        for (const double z : {bottom, top})
            if (low < z && z < high) {
                const double s = (z - a[2]) / (b[2] - a[2]);
                add(a[u] + s * (b[u] - a[u]), a[v] + s * (b[v] - a[v]), z);
            }
    }
    t.corners = whole ? 3 : TangentTerms::kMostCorners;
    for (; n < t.corners; ++n) t.u[n] = t.u[0], t.v[n] = t.v[0], t.dz[n] = t.dz[0];
}

namespace {

template <std::size_t corners>
[[gnu::always_inline]] inline void narrow(const TangentTerms& t, const double* __restrict v, int n,
                                          double* __restrict low, double* __restrict high) {
    const double least = kTangentLeast * t.r2, z2 = t.r2 - t.z * t.z;
    for (int i = 0; i < n; ++i) {
        const double touched = v[i] - t.across, at_least = touched < t.v_low ? t.v_low : touched,
                     from_v = at_least < t.v_high ? at_least : t.v_high;
        const double w = v[i] - from_v, q = z2 - w * w;
        const bool near = q > least;
        const double h = std::sqrt(near ? q : 1.0), inverse = 1 / h, sv = w * inverse, sz = t.z * inverse;
        double up = -kInfinity, down = kInfinity;
        for (std::size_t k = 0; k < corners; ++k) {
            const double a = sv * (t.v[k] - from_v) + sz * t.dz[k], to = t.u[k] + a, from = t.u[k] - a;
            up = to > up ? to : up;
            down = from < down ? from : down;
        }
        const double to = up + h, from = down - h;
        high[i] = near & (to < high[i]) ? to : high[i];
        low[i] = near & (from > low[i]) ? from : low[i];
    }
}

}  // namespace

// From a point p the ball's centre is kept away up to p_u + √(r² − (v − p_v)² − (zc − p_z)²) on the line at
// v, a concave function of p, so no more than what its tangent at any point gives at one of the corners.
SLABWRIGHT_WIDE std::int64_t facet_out_rows(const BoxTerms& b, const TangentTerms& t, const CoverRows& cover,
                                            const double* __restrict v, int first, int last,
                                            double* __restrict low, double* __restrict high,
                                            std::int64_t* __restrict state) {
    const int n = (last - first) / kLinesStep * kLinesStep;
    v += first, low += first, high += first;
    reach(b, v, n, low, high);
    if (t.corners == 3) narrow<3>(t, v, n, low, high);
    else narrow<TangentTerms::kMostCorners>(t, v, n, low, high);
    return out(cover, low, high, first, n, state + first);
}

// The tangent's slope is (w, z) / h, and (h, w, z) is as long as r; what the disc reaches along that goes by
// its part along the axis.
SLABWRIGHT_WIDE std::int64_t disc_out_rows(const BoxTerms& b, const DiscTerms& t, const CoverRows& cover,
                                           const double* __restrict v, int first, int last,
                                           double* __restrict low, double* __restrict high,
                                           std::int64_t* __restrict state) {
    const double least = kTangentLeast * t.r2, z2 = t.r2 - t.z * t.z, az = t.axis_z * t.z;
    const int n = (last - first) / kLinesStep * kLinesStep;
    v += first, low += first, high += first;
    reach(b, v, n, low, high);
    for (int i = 0; i < n; ++i) {
        const double w = v[i] - t.v, q = z2 - w * w;
        const bool near = q > least;
        const double h = std::sqrt(near ? q : 1.0), across = t.axis_v * w + az,
                     on_high = across + t.axis_u * h, on_low = across - t.axis_u * h;
        const double high2 = t.r2 - on_high * on_high, low2 = t.r2 - on_low * on_low, inverse = 1 / h;
        const double up = (std::abs(on_high) * t.thickness + std::sqrt(high2 > 0 ? high2 : 0.0) * t.radius) *
                          inverse,
                     down = (std::abs(on_low) * t.thickness + std::sqrt(low2 > 0 ? low2 : 0.0) * t.radius) *
                            inverse;
        const double to = t.u + h + up, from = t.u - h - down;
        high[i] = near & (to < high[i]) ? to : high[i];
        low[i] = near & (from > low[i]) ? from : low[i];
    }
    return out(cover, low, high, first, n, state + first);
}

// In floats, about the group's middle. What they round is less than a few of their last digits of r and of
// the facets' sizes, times ten where a tangent is steep; a distance across is taken as so much less, and what
// is said as so much wider.
SLABWRIGHT_WIDE void group_out_rows(const GroupCorners& g, const FacetGroup& group, std::size_t u_axis,
                                    double radius, double zc, const CoverRows& cover, const double* v,
                                    int first, int last, const std::int64_t* state, GroupRows& rows) {
    constexpr std::size_t n = GroupRows::kFacets;
    constexpr auto inf = std::numeric_limits<float>::infinity();
    using Each = std::array<float, n>;
    const std::size_t v_axis = 1 - u_axis;
    const double mu = group.middle[u_axis], mv = group.middle[v_axis];
    const auto r = static_cast<float>(radius), z = static_cast<float>(zc - group.middle[2]), r2 = r * r;
    const float wider = 3e-5F * (r + group.radius + group.thickness),
                least = static_cast<float>(kTangentLeast) * r2, more = r2 * 1e-5F;
    const auto &ua = g.p[0][u_axis], &ub = g.p[1][u_axis], &uc = g.p[2][u_axis];
    const auto &va = g.p[0][v_axis], &vb = g.p[1][v_axis], &vc = g.p[2][v_axis];
    alignas(32) Each u_low, u_high, v_low, v_high, box2, t_low, t_high, across, tz, tz2, da, db, dc;
    for (std::size_t i = 0; i < n; ++i) {
        const auto min = [](float a, float b) { return a < b ? a : b; };
        const auto max = [](float a, float b) { return a > b ? a : b; };
        const float za = g.p[0][2][i], zb = g.p[1][2][i], zd = g.p[2][2][i], low = min(za, min(zb, zd)),
                    high = max(za, max(zb, zd));
        const float at = z - r * g.normal[2][i], at_least = at > low ? at : low,
                    touched = at_least < high ? at_least : high;
        const bool level = (g.nz[i] < 0) & (high + wider > z),
                   active = level | ((high + wider > z - r) & (low - wider <= z));
        u_low[i] = min(ua[i], min(ub[i], uc[i])), u_high[i] = max(ua[i], max(ub[i], uc[i]));
        v_low[i] = min(va[i], min(vb[i], vc[i])), v_high[i] = max(va[i], max(vb[i], vc[i]));
        const float dz = max(0.0F, max(low - z, z - high)), over2 = level ? 0.0F : dz * dz;
        box2[i] = active ? r2 - over2 + more : -1.0F;
        // Where the facet's height is `touched`, at one of two edges at least.
        float from = inf, to = -inf;
        const auto edge = [&](float a, float b, float wa, float wb) {
            const float d = b - a, s = (touched - a) / (d == 0 ? 1.0F : d), cut = wa + s * (wb - wa);
            const bool meets = (min(a, b) <= touched) & (touched <= max(a, b));
            from = meets & (cut < from) ? cut : from;
            to = meets & (cut > to) ? cut : to;
        };
        edge(za, zb, va[i], vb[i]);
        edge(zb, zd, vb[i], vc[i]);
        edge(zd, za, vc[i], va[i]);
        t_low[i] = from, t_high[i] = to;
        across[i] = r * g.normal[v_axis][i];
        tz[i] = z - touched;
        tz2[i] = active & !level ? r2 - tz[i] * tz[i] : -1.0F;
        da[i] = za - touched, db[i] = zb - touched, dc[i] = zd - touched;
    }
    alignas(32) std::array<std::int32_t, n> from_line, to_line;
    from_line.fill(last), to_line.fill(first);
    for (int l = first; l < last; ++l) {
        if (state[l] == 0) {
            rows.low[static_cast<std::size_t>(l)].fill(inf),
                rows.high[static_cast<std::size_t>(l)].fill(-inf);
            continue;
        }
        const auto at = static_cast<float>(v[l] - mv), covered_from = static_cast<float>(cover.low[l] - mu),
                   covered_to = static_cast<float>(cover.high[l] - mu);
        float *const row_low = rows.low[static_cast<std::size_t>(l)].data(),
                     *const row_high = rows.high[static_cast<std::size_t>(l)].data();
        for (std::size_t i = 0; i < n; ++i) {
            const float under = v_low[i] - at, over = at - v_high[i], off = under > over ? under : over,
                        d = off > 0 ? off : 0;
            const float reach2 = box2[i] - d * d, reach = std::sqrt(std::abs(reach2));
            const float box_low = reach2 > 0 ? u_low[i] - reach : inf,
                        box_high = reach2 > 0 ? u_high[i] + reach : -inf;
            const float touched = at - across[i], at_least = touched < t_low[i] ? t_low[i] : touched,
                        from = at_least < t_high[i] ? at_least : t_high[i];
            const float w = at - from, q = tz2[i] - w * w;
            const bool near = q > least;
            const float h = std::sqrt(near ? q : 1.0F), inverse = 1 / h, sv = w * inverse,
                        sz = tz[i] * inverse;
            const float a = sv * (va[i] - from) + sz * da[i], b = sv * (vb[i] - from) + sz * db[i],
                        c = sv * (vc[i] - from) + sz * dc[i];
            float up = ua[i] + a, down = ua[i] - a;
            up = ub[i] + b > up ? ub[i] + b : up, down = ub[i] - b < down ? ub[i] - b : down;
            up = uc[i] + c > up ? uc[i] + c : up, down = uc[i] - c < down ? uc[i] - c : down;
            const float high = (near & (up + h < box_high) ? up + h : box_high) + wider,
                        low = (near & (down - h > box_low) ? down - h : box_low) - wider;
            row_low[i] = low, row_high[i] = high;
            const bool out = (low < high) & ((low < covered_from) | (high > covered_to));
            from_line[i] = out & (l < from_line[i]) ? l : from_line[i];
            to_line[i] = out ? l + 1 : to_line[i];
        }
    }
    rows.first = from_line, rows.last = to_line;
}

namespace {

constexpr int kLanes = static_cast<int>(GroupRows::kFacets);

// (Vectors are handed on by reference: how one is passed by value depends on the instruction set.)
template <class T, class Vector>
[[gnu::always_inline]] inline void load(const GroupCorners::Each<T>& from, Vector& v) {
    std::memcpy(&v, from.data(), sizeof v);
}
[[gnu::always_inline]] inline void load_small(const GroupCorners::Each<std::int8_t>& from, Floats8& v) {
    Chars8 small;
    std::memcpy(&small, from.data(), sizeof small);
    v = __builtin_convertvector(small, Floats8);
}
[[gnu::always_inline]] inline void lower(Floats8& a, const Floats8& b) { a = b < a ? b : a; }
[[gnu::always_inline]] inline void raise(Floats8& a, const Floats8& b) { a = b > a ? b : a; }
[[gnu::always_inline]] inline void stretch(Floats8& from, Floats8& to, const Ints8& meets,
                                           const Floats8& at) {
    from = (meets & (at < from)) ? at : from;
    to = (meets & (at > to)) ? at : to;
}

}  // namespace

// A ball touches with the normal d at its centre less r·d: a facet with its own, an edge with one between
// those beside it, a corner with one between those around it, and each on the part that is as high as that.
// `wider` is more than what floats round, of the heights and of where an edge crosses one of them.
SLABWRIGHT_WIDE void group_touched(const GroupCorners& g, const FacetGroup& group, std::size_t v,
                                   double radius, double zc, GroupTouched& touched) {
    const Floats8 none{}, one = none + 1.0F, inf = none + std::numeric_limits<float>::infinity();
    const auto r = static_cast<float>(radius), z = static_cast<float>(zc - group.middle[2]),
               step = r * static_cast<float>(SolidFacet::kTurn);
    const float wider = kTouchMargin + 1e-6F * (r + std::abs(z) + group.radius + group.thickness);
    Floats8 nz, nv;
    Ints8 edges;
    load(g.normal[2], nz), load(g.normal[v], nv), load(g.edges, edges);
    const auto store = [](const Floats8& low, const Floats8& high, GroupTouched::Range& range) {
        std::memcpy(range.low.data(), &low, sizeof low), std::memcpy(range.high.data(), &high, sizeof high);
    };
    Floats8 all_low = inf, all_high = -inf;
    // Of each corner the normals, and where a ball touches it; of each edge what it is wide for each mm that
    // it is high.
    std::array<Floats8, 3> pz, pv, wide, least, most;
    for (std::size_t c = 0; c < 3; ++c) {
        load(g.p[c][2], pz[c]), load(g.p[c][v], pv[c]);
        Floats8 down, up, left, right;
        load_small(g.corner.low[c][2], down), load_small(g.corner.high[c][2], up);
        load_small(g.corner.low[c][v], left), load_small(g.corner.high[c][v], right);
        const Ints8 meets =
            ((edges & (8 << c)) != 0) & (pz[c] >= z - step * up - wider) & (pz[c] <= z - step * down + wider);
        const Floats8 low = meets ? pv[c] + step * left - wider : inf,
                      high = meets ? pv[c] + step * right + wider : -inf;
        store(low, high, touched.end[c]);
        lower(all_low, low), raise(all_high, high);
    }
    for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t next = k == 2 ? 0 : k + 1;
        const Floats8 rise = pz[next] - pz[k];
        wide[k] = (pv[next] - pv[k]) / (rise == 0 ? one : rise);
        least[k] = most[k] = pz[k];
        lower(least[k], pz[next]), raise(most[k], pz[next]);
    }
    // Where an edge crosses a height.
    const auto cross = [&](Floats8& low, Floats8& high, std::size_t k, const Floats8& height) {
        stretch(low, high, (least[k] <= height) & (height <= most[k]), pv[k] + (height - pz[k]) * wide[k]);
    };
    const Floats8 at = z - r * nz, under = at - wider, over = at + wider;
    Floats8 low = inf, high = -inf;
    for (std::size_t k = 0; k < 3; ++k) {
        stretch(low, high, (pz[k] >= under) & (pz[k] <= over), pv[k]);
        cross(low, high, k, under), cross(low, high, k, over);
    }
    low += r * nv - wider, high += r * nv + wider;
    store(low, high, touched.face);
    lower(all_low, low), raise(all_high, high);
    for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t next = k == 2 ? 0 : k + 1;
        Floats8 down, up, left, right;
        load_small(g.edge.low[k][2], down), load_small(g.edge.high[k][2], up);
        load_small(g.edge.low[k][v], left), load_small(g.edge.high[k][v], right);
        const Floats8 lowest = z - step * up - wider, highest = z - step * down + wider;
        low = inf, high = -inf;
        stretch(low, high, (pz[k] >= lowest) & (pz[k] <= highest), pv[k]);
        stretch(low, high, (pz[next] >= lowest) & (pz[next] <= highest), pv[next]);
        cross(low, high, k, lowest), cross(low, high, k, highest);
        low += step * left - wider, high += step * right + wider;
        const Ints8 tests = (edges & (1 << k)) != 0;
        low = tests ? low : inf, high = tests ? high : -inf;
        store(low, high, touched.edge[k]);
        lower(all_low, low), raise(all_high, high);
    }
    store(all_low, all_high, touched.all);
}

// Seen from above, a disc touches a facet's section in the direction in which that faces, and where it ends
// in one that is near enough.
SLABWRIGHT_WIDE void group_touched_by_disc(const GroupCorners& g, const FacetGroup& group, std::size_t v,
                                           double radius, double zc, GroupTouched::Range& touched) {
    const Floats8 none{}, one = none + 1.0F, inf = none + std::numeric_limits<float>::infinity();
    const auto r = static_cast<float>(radius), z = static_cast<float>(zc - group.middle[2]);
    const float wider = kTouchMargin + 1e-6F * (r + std::abs(z) + group.radius + group.thickness),
                under = z - wider, over = z + wider;
    Floats8 nu, nv, across;
    load(g.normal[1 - v], nu), load(g.normal[v], nv);
    across = nu * nu + nv * nv;
    for (int i = 0; i < kLanes; ++i) across[i] = std::sqrt(across[i]);
    nv /= (across > 0) ? across : one;
    std::array<Floats8, 3> pz, pv, aside;
    for (std::size_t c = 0; c < 3; ++c)
        load(g.p[c][2], pz[c]), load(g.p[c][v], pv[c]), load(g.aside[c], aside[c]);
    Floats8 low = inf, high = -inf;
    const auto add = [&](const Ints8& meets, const Floats8& at, const Floats8& turn) {
        Floats8 least = nv - turn, most = nv + turn;
        raise(least, -one), lower(most, one);
        const Floats8 from = at + r * least, to = at + r * most;
        low = (meets & (from < low)) ? from : low;
        high = (meets & (to > high)) ? to : high;
    };
    for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t next = k == 2 ? 0 : k + 1;
        const Floats8 rise = pz[next] - pz[k], wide = (pv[next] - pv[k]) / (rise == 0 ? one : rise);
        Floats8 least = pz[k], most = pz[k], turn = aside[k];
        lower(least, pz[next]), raise(most, pz[next]), lower(turn, aside[next]);
        add((pz[k] >= under) & (pz[k] <= over), pv[k], aside[k]);
        add((least <= under) & (under <= most), pv[k] + (under - pz[k]) * wide, turn);
        add((least <= over) & (over <= most), pv[k] + (over - pz[k]) * wide, turn);
    }
    low -= wider, high += wider;
    std::memcpy(touched.low.data(), &low, sizeof low), std::memcpy(touched.high.data(), &high, sizeof high);
}

}  // namespace slabwright
