// What one element of a solid forbids on many parallel lines at once. Internal to fibres: U is the lines' direction, V the other one in the
// plane, and a line is given by its v.
#pragma once

#include <array>

#include "kernels/cutting/layer_solid.h"

namespace slabwright {

inline constexpr int kLinesTogether = 64;

/// By line the hull of what has been met so far, mm along the line, and the upward part of the normal at both ends. low > high: nothing.
struct HullRows {
    alignas(64) std::array<double, kLinesTogether> low, high, nz_low, nz_high;
};

/// The points within r of a facet's plane that project into the facet: distance nu·u + nv·v + c, within [−r, r]; inside where
/// edge_u·u + edge_v·v + edge_c ≥ 0 for all three edges.
struct PrismTerms {
    double nu, nv, nz, c, r;
    std::array<double, 3> edge_u, edge_v, edge_c;
};
/// Adds the prism to the hulls of lines [0, n) at v.
void prism_rows(const PrismTerms& prism, const double* v, int n, double* low, double* high, double* nz_low, double* nz_high);

/// A segment from (au, av) to (bu, bv) with the ball of radius r around each of its points; za and zb are the line's height over its ends.
struct CapsuleTerms {
    double au, av, za, bu, bv, zb, r;
    double nz = -2;  ///< at all contacts; below −1: the contact's own
};
void capsule_rows(const CapsuleTerms& capsule, const double* v, int n, double* low, double* high, double* nz_low, double* nz_high);

/// How far along lines [first, last) at v what lies in a box may forbid, when r2 is r² less the box's least height over or under them squared:
/// low and high, or low > high where it is out of reach.
void reach_rows(const double* v, int first, int last, double v_low, double v_high, double r2, double u_low, double u_high, double* low, double* high);

/// A facet seen from its middle (u, v) and z under the lines; its corners from there.
struct TangentTerms {
    double u, v, z, r2;
    std::array<double, 3> du, dv, dz;
};
/// Narrows that for a facet and a ball, by the tangent of what one point of it forbids, except where the middle is hardly in reach.
void tangent_rows(const TangentTerms& facet, const double* v, int first, int last, double* low, double* high);

}  // namespace slabwright
