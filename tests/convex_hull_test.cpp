// The convex hull against what a hull is: closed, convex, with all points within.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <random>

#include "kernels/geometry/vectors.h"
#include "kernels/mesh/convex_hull.h"
#include "tests/support/seed.h"

namespace slabwright {
namespace {

struct Measured {
    double volume = 0, area = 0;
};

/// Checks a hull and measures it.
Measured check(const std::vector<Vec3f>& points, const std::vector<Index3>& hull, double tolerance) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    Measured m;
    for (const Index3& f : hull) {
        const Vec3d a = to_double(points[f[0]]), b = to_double(points[f[1]]), c = to_double(points[f[2]]);
        const Vec3d n = cross(minus(b, a), minus(c, a));
        m.area += length(n) / 2;
        m.volume += dot(a, cross(b, c)) / 6;
        for (std::size_t k = 0; k < 3; ++k) {
            ++edges[{f[k], f[(k + 1) % 3]}];
            --edges[{f[(k + 1) % 3], f[k]}];
        }
        if (length(n) < 1e-3) continue;  // between points of one plane: its direction says nothing
        for (const Vec3f& p : points)
            EXPECT_LE(dot(n, minus(to_double(p), a)) / length(n), tolerance * (1 + 1e-6) + 1e-4);
    }
    for (const auto& [edge, uses] : edges) EXPECT_EQ(uses, 0) << "open at an edge";
    return m;
}

TEST(ConvexHull, OfRandomPoints) {
    std::mt19937 random(test::seed());
    for (int round = 0; round < 30; ++round) {
        const double size = std::pow(10, std::uniform_real_distribution<double>(0, 3)(random));
        std::normal_distribution<double> place(0, size);
        std::vector<Vec3f> points(4 + random() % 400);
        for (Vec3f& p : points)
            p = {static_cast<float>(place(random)), static_cast<float>(place(random)),
                 static_cast<float>(place(random))};
        const double tolerance = round % 2 == 0 ? 1e-6 * size : 1e-2 * size;
        const std::vector<Index3> hull = convex_hull(points, tolerance);
        ASSERT_GE(hull.size(), 4U);
        EXPECT_GT(check(points, hull, tolerance).volume, 0);
    }
}

// Flat, round and full of points that lie in one plane: what parts are.
TEST(ConvexHull, OfABlockFullOfPointsAndOfACylinder) {
    std::mt19937 random(test::seed());
    std::vector<Vec3f> block;
    for (int i = 0; i <= 20; ++i)
        for (int j = 0; j <= 10; ++j)
            for (int k = 0; k <= 5; ++k)
                block.push_back({10.0F * static_cast<float>(i), 10.0F * static_cast<float>(j),
                                 10.0F * static_cast<float>(k)});
    std::shuffle(block.begin(), block.end(), random);
    const Measured m = check(block, convex_hull(block, 1e-3), 1e-3);
    EXPECT_NEAR(m.volume, 200.0 * 100 * 50, 10);
    EXPECT_NEAR(m.area, 2 * (200.0 * 100 + 200 * 50 + 100 * 50), 10);

    std::vector<Vec3f> cylinder;
    constexpr int n = 64;
    for (int k = 0; k < n; ++k)
        for (const float z : {0.0F, 25.0F, 80.0F}) {
            const double a = 2 * std::numbers::pi * k / n;
            cylinder.push_back(
                {static_cast<float>(30 * std::cos(a)), static_cast<float>(30 * std::sin(a)), z});
        }
    EXPECT_NEAR(check(cylinder, convex_hull(cylinder, 1e-3), 1e-3).volume,
                80 * 0.5 * n * 900 * std::sin(2 * std::numbers::pi / n), 20);
}

TEST(ConvexHull, OfWhatHasNone) {
    EXPECT_TRUE(convex_hull({}, 1e-3).empty());
    const std::vector<Vec3f> flat{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0.5F, 0.2F, 0}};
    EXPECT_TRUE(convex_hull(flat, 1e-3).empty());
    const std::vector<Vec3f> one(7, Vec3f{3, 3, 3});
    EXPECT_TRUE(convex_hull(one, 1e-3).empty());
}

}  // namespace
}  // namespace slabwright
