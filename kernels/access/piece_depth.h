// A straight piece of a motion against one facet: how near a ball's centre, or a bull-nose's core, comes to
// what stands below it, and how deep a cylinder goes in. Each is one convex problem. Internal to this folder.
#pragma once

#include <array>

#include "kernels/geometry/triangle.h"

namespace slabwright {

/// A convex polygon of at most five corners: a triangle cut by two horizontal planes.
struct Polygon {
    std::array<Point3, 8> p;
    int n = 0;
};

/// The part of a polygon above or below a height.
[[nodiscard]] Polygon clip_z(const Polygon& polygon, double z, bool keep_above);

/// Horizontal distance between a segment (or a point) and a convex polygon; infinite for an empty one.
[[nodiscard]] double distance_2d(const Polygon& polygon, Vec2d a, Vec2d b);

/// Distance between a point's upward ray and a triangle, and its vector (from triangle to ray), whose z is
/// never negative. Over the triangle both the distance from the point and that from the ray are convex, and
/// they have one gradient where the triangle is not above the point: if the nearest point to the point lies
/// there, it is the nearest to the ray too. Otherwise the nearest to the ray is as high as the point or
/// higher, and is measured horizontally.
struct RayDistance {
    double d;
    Point3 vector;
};
[[nodiscard]] RayDistance ray_distance(const Point3& point, const Triangle& triangle);

/// Calls fn(triangle) for the parts of a facet below z (one or two triangles), none when no corner lies
/// below.
template <class Fn>
void below(const std::array<Vec3f, 3>& facet, double z, Fn&& fn) {
    int under = 0;
    for (const Vec3f& v : facet) under += v.z < z;
    if (under == 0) return;
    if (under == 3 || (facet[0].z <= z && facet[1].z <= z && facet[2].z <= z)) {
        fn(Triangle{to_double(facet[0]), to_double(facet[1]), to_double(facet[2])});
        return;
    }
    Polygon poly;
    poly.n = 3;
    for (int i = 0; i < 3; ++i) poly.p[i] = to_double(facet[i]);
    poly = clip_z(poly, z, false);
    for (int i = 1; i + 1 < poly.n; ++i) fn(Triangle{poly.p[0], poly.p[i], poly.p[i + 1]});
}

/// Least distance over the piece from a to b (ray starts) to a triangle, and where; looks only for less than
/// `limit`. The distance to a convex set is convex along a line: tangents at both ends of a bracket bound it
/// from below, their crossing is the next place to try (Kelley's cutting planes in one dimension).
struct Closest {
    double d;
    double t;
};
[[nodiscard]] Closest piece_distance(const Point3& a, const Point3& b, const Triangle& triangle,
                                     double limit);

/// The same of a level disc with all that is above it, whose middle goes from a to b: a bull-nose of corner c
/// is what is no farther than c from such a disc. Along an edge the distance is convex, and its least is
/// bracketed to 1e-8 mm.
[[nodiscard]] Closest disc_piece_distance(const Point3& a, const Point3& b, double disc,
                                          const Triangle& triangle, double limit);

/// How deep a cylinder comes to stand in a polygon while its tip goes straight from a to b: the largest
/// min(radius − r, z − tip) of the polygon's points, r from the axis, in closed form. {best, 0} where it is
/// not above `best` by more than StandingPart::kNumericalError.
/// @param polygon convex and plane, of the part; @param radius mm
struct Deepest {
    double depth;
    double t;
};
[[nodiscard]] Deepest piece_depth(const Point3& a, const Point3& b, const Polygon& polygon, double radius,
                                  double best);

}  // namespace slabwright
