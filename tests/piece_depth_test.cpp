// Distances of a level disc, with all that is above it, to facets shorter than a millimetre, against dense
// points on them; depths of a cylinder on its way in polygons, against a search along it.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "kernels/access/piece_depth.h"
#include "tests/support/seed.h"

using namespace slabwright;

namespace {

double to_disc(const Point3& c, double disc, const Point3& p) {
    const double beside = std::max(0.0, std::hypot(p[0] - c[0], p[1] - c[1]) - disc),
                 under = std::max(0.0, c[2] - p[2]);
    return std::hypot(beside, under);
}

struct Way {
    Point3 from, to;
    double radius;
};

// With the tip at one place: by halves, whether what stands over the floor at a depth is as near to the axis.
double depth_at(const Point3& tip, double radius, const Polygon& polygon) {
    double low = -100, high = radius;
    while (high - low > 1e-10) {
        const double depth = (low + high) / 2;
        const Polygon above = clip_z(polygon, tip[2] + depth, true);
        (distance_2d(above, {tip[0], tip[1]}, {tip[0], tip[1]}) <= radius - depth ? low : high) = depth;
    }
    return low;
}

// The depth is concave along the way: by thirds.
double searched_depth(const Way& way, const Polygon& polygon) {
    double low = 0, high = 1;
    const auto at = [&](double t) { return depth_at(between(way.from, way.to, t), way.radius, polygon); };
    while (high - low > 1e-9) {
        const double third = (high - low) / 3;
        if (at(low + third) >= at(high - third)) high -= third;
        else low += third;
    }
    return std::max({at(0), at(low), at(1)});
}

Polygon polygon_of(const Triangle& t) {
    Polygon polygon;
    polygon.n = 3;
    for (std::size_t k = 0; k < 3; ++k) polygon.p[k] = t[k];
    return polygon;
}

}  // namespace

TEST(PieceDepth, IsThatOfTheDeepestPointAnywhereOnTheWay) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> at(-4, 4), by(-3, 3), size(0.3, 5);
    std::uniform_int_distribution<int> kind(0, 5);
    int inside = 0;
    for (int round = 0; round < 300; ++round) {
        Way way{{at(random), at(random), at(random)}, {}, size(random)};
        way.to = {way.from[0] + by(random), way.from[1] + by(random), way.from[2] + by(random)};
        Triangle t;
        const Point3 middle{at(random), at(random), at(random)};
        for (Point3& p : t) p = {middle[0] + by(random), middle[1] + by(random), middle[2] + by(random)};
        switch (kind(random)) {
            case 0:
                way.to[2] = way.from[2];
                break;  // level
            case 1:
                way.to[0] = way.from[0], way.to[1] = way.from[1];
                break;  // plunge
            case 2:
                t[2][0] = t[0][0], t[2][1] = t[0][1];
                break;  // upright
            case 3:
                t[1][2] = t[2][2] = t[0][2];
                break;  // a level facet
            case 4:
                t[1] = between(t[0], between(way.from, way.to, 0.5), 0.3);
                break;  // towards the way
            default:
                break;
        }
        const double searched = searched_depth(way, polygon_of(t));
        const Deepest found = piece_depth(way.from, way.to, polygon_of(t), way.radius, -1e3);
        ASSERT_NEAR(found.depth, searched, 1e-6) << "round " << round;
        // The place that it names is as deep.
        const Point3 tip = between(way.from, way.to, found.t);
        ASSERT_NEAR(depth_at(tip, way.radius, polygon_of(t)), found.depth, 1e-6) << "round " << round;
        const double more = found.depth + 2 * 1e-7;
        ASSERT_EQ(piece_depth(way.from, way.to, polygon_of(t), way.radius, more).depth, more);
        inside += found.depth > 0;
    }
    EXPECT_GT(inside, 50);
}

TEST(PieceDepth, OfAPolygonIsTheGreatestOfItsTriangles) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> at(-4, 4);
    for (int round = 0; round < 2000; ++round) {
        const auto point = [&] { return Point3{at(random), at(random), at(random)}; };
        const Point3 a = point(), b = point();
        Polygon whole = clip_z(polygon_of({point(), point(), point()}), 2, false);
        whole = clip_z(whole, -2, true);
        if (whole.n < 4) continue;
        double deepest = -1e3;
        for (int i = 1; i + 1 < whole.n; ++i)
            deepest = piece_depth(a, b,
                                  polygon_of({whole.p[0], whole.p[static_cast<std::size_t>(i)],
                                              whole.p[static_cast<std::size_t>(i) + 1]}),
                                  3, deepest)
                          .depth;
        ASSERT_NEAR(piece_depth(a, b, whole, 3, -1e3).depth, deepest, 2e-7) << "round " << round;
    }
}

TEST(DiscDistance, ToSmallFacetsIsThatToTheirNearestPoint) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> at(-4, 4), by(-0.5, 0.5);
    for (int round = 0; round < 400; ++round) {
        const Point3 c{at(random), at(random), at(random)};
        const double disc = 2;
        Triangle t;
        const Point3 middle{at(random), at(random), at(random)};
        for (Point3& p : t) p = {middle[0] + by(random), middle[1] + by(random), middle[2] + by(random)};
        double nearest = 1e300;
        constexpr int n = 120;
        for (int i = 0; i <= n; ++i)
            for (int j = 0; i + j <= n; ++j) {
                Point3 p{};
                for (std::size_t k = 0; k < 3; ++k)
                    p[k] = (i * t[0][k] + j * t[1][k] + (n - i - j) * t[2][k]) / n;
                nearest = std::min(nearest, to_disc(c, disc, p));
            }
        const double found = disc_piece_distance(c, c, disc, t, 1e9).d;
        ASSERT_LE(found, nearest + 1e-6) << "round " << round;
        ASSERT_GE(found, nearest - 0.01) << "round " << round;
    }
}
