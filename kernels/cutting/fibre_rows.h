// What one element of a solid forbids on many parallel lines at once. Internal to fibres: U is the lines'
// direction, V the other one in the plane, and a line is given by its v.
#pragma once

#include <array>
#include <cstdint>

#include "kernels/cutting/layer_solid.h"

namespace slabwright {

inline constexpr int kLinesTogether = 64;

/// By line the hull of what has been met so far, mm along the line, and the upward part of the normal at both
/// ends. low > high: nothing.
struct HullRows {
    alignas(64) std::array<double, kLinesTogether> low, high, nz_low, nz_high;
};

/// The points within r of a facet's plane that project into the facet: distance nu·u + nv·v + c, within [−r,
/// r]; inside where edge_u·u + edge_v·v + edge_c ≥ 0 for all three edges.
struct PrismTerms {
    double nu, nv, nz, c, r;
    std::array<double, 3> edge_u, edge_v, edge_c;
};
/// Adds the prism to the hulls of lines [0, n) at v.
void prism_rows(const PrismTerms& prism, const double* v, int n, double* low, double* high, double* nz_low,
                double* nz_high);
/// The same; kWithin is added to an end's nz where it lies nearer to the plane than r, and so is no place
/// where a ball touches the facet from outside.
void marked_prism_rows(const PrismTerms& prism, const double* v, int n, double* low, double* high,
                       double* nz_low, double* nz_high);
inline constexpr double kWithin = 4;

/// A segment from (au, av) to (bu, bv) with the ball of radius r around each of its points; za and zb are the
/// line's height over its ends.
struct CapsuleTerms {
    double au, av, za, bu, bv, zb, r;
    double nz = -2;  ///< at all contacts; below −1: the contact's own
};
void capsule_rows(const CapsuleTerms& capsule, const double* v, int n, double* low, double* high,
                  double* nz_low, double* nz_high);
/// The same of what projects onto the segment alone, and of the ball around its first end alone.
void cylinder_rows(const CapsuleTerms& capsule, const double* v, int n, double* low, double* high,
                   double* nz_low, double* nz_high);
void end_rows(const CapsuleTerms& capsule, const double* v, int n, double* low, double* high, double* nz_low,
              double* nz_high);

/// Lines are met in steps of so many: where lines are numbered from `first`, that and their count are
/// multiples of it, so that no loop has an odd end.
inline constexpr int kLinesStep = 8;

/// A box; r2 is r² less its least height over or under the lines squared.
struct BoxTerms {
    double u_low, u_high, v_low, v_high, r2;
};

/// What of a facet a ball can meet: corners of a convex polygon, dz over the height at which the ball would
/// touch the facet's plane (or that of the facet's that is nearest to it), which is z under the lines. There
/// the facet lies in [v_low, v_high]; `across` is how far beside the line's v the plane is touched.
struct TangentTerms {
    static constexpr std::size_t kMostCorners = 5;
    double v_low, v_high, across, z, r2;
    std::size_t corners;  ///< 3, or kMostCorners, of which some may be the same
    std::array<double, kMostCorners> u, v, dz;
};

/// Both for a facet and lines in direction x (u = 0) or y (1) at height zc.
void facet_terms(const SolidFacet& facet, std::size_t u, double r, double zc, BoxTerms& box,
                 TangentTerms& tangent);

/// A disc seen from its middle (u, v) and z under the lines: its axis, a unit vector, its radius and half its
/// thickness.
struct DiscTerms {
    double u, v, z, r2;
    double axis_u, axis_v, axis_z, radius, thickness;
};
/// Of each line the stretch that is covered and was looked at last, and where the next one begins.
struct CoverRows {
    alignas(64) std::array<double, kLinesTogether> low, high, next;
};
inline constexpr std::int64_t kReachesOut = 1, kLooksElsewhere = 2;
/// For lines [first, last) whether [low, high] reaches out of what is covered: 0 where it does not or is
/// empty, kReachesOut, or kLooksElsewhere where another stretch than the one looked at says so. All of them
/// together are returned.
std::int64_t cover_rows(const CoverRows& cover, const double* low, const double* high, int first, int last,
                        std::int64_t* state);

/// The same for how far what lies in a box may reach (low and high; low > high where it does not reach the
/// line), for a ball narrowed by the tangent of what one point of it forbids, except where that point is
/// hardly in reach.
std::int64_t box_out_rows(const BoxTerms& box, const CoverRows& cover, const double* v, int first, int last,
                          double* low, double* high, std::int64_t* state);
std::int64_t facet_out_rows(const BoxTerms& box, const TangentTerms& facet, const CoverRows& cover,
                            const double* v, int first, int last, double* low, double* high,
                            std::int64_t* state);
std::int64_t disc_out_rows(const BoxTerms& box, const DiscTerms& disc, const CoverRows& cover,
                           const double* v, int first, int last, double* low, double* high,
                           std::int64_t* state);

/// How far the facets of a group may reach on each line, relative to the group's middle and rounded outward
/// (low > high where one does not), and of each facet the lines, from the first to the last, on which that is
/// out of what is covered.
struct GroupRows {
    static constexpr std::size_t kFacets = FacetGroup::kFacets;
    alignas(64) std::array<std::array<float, kFacets>, kLinesTogether> low, high;
    alignas(64) std::array<std::int32_t, kFacets> first, last;
};
/// For those of the lines [first, last) whose `state` is not 0: facet_out_rows() of all of a group's facets
/// that a ball of radius r at height zc can touch, with box_out_rows() for those that overhang it.
void group_out_rows(const GroupCorners& corners, const FacetGroup& group, std::size_t u, double r, double zc,
                    const CoverRows& cover, const double* v, int first, int last, const std::int64_t* state,
                    GroupRows& rows);

/// Of each of a group's facets, and of each of its edges and ends of edges that it is to test, the places
/// across the lines, relative to the group's middle, at which a ball of radius r at height zc can touch it
/// from outside the solid, rounded outward; low > high: it cannot.
struct GroupTouched {
    struct Range {
        alignas(32) GroupCorners::Each<float> low, high;
    };
    Range face, all;  ///< of all: of them together
    std::array<Range, 3> edge, end;
};
void group_touched(const GroupCorners& corners, const FacetGroup& group, std::size_t v, double r, double zc,
                   GroupTouched& touched);
/// The same for a level disc and the section of each facet at its height zc. @pre no facet is counted that
/// faces down
void group_touched_by_disc(const GroupCorners& corners, const FacetGroup& group, std::size_t v, double r,
                           double zc, GroupTouched::Range& touched);

}  // namespace slabwright
