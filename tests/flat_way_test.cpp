#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <random>

#include "kernels/cutting/drop.h"
#include "kernels/cutting/flat_way.h"
#include "tests/support/height_field.h"
#include "tests/support/seed.h"

namespace slabwright {
namespace {

// How far the solid stands over a way at most, by drops every 2 µm of it.
double stands_over(const DropIndex& index, const Vec3d& a, const Vec3d& b) {
    const double l = std::hypot(b[0] - a[0], b[1] - a[1]);
    const int steps = std::max(1, static_cast<int>(l / 0.002));
    double most = -std::numeric_limits<double>::infinity();
    MetPoints met;
    for (int k = 0; k <= steps; ++k) {
        const double share = static_cast<double>(k) / steps;
        const Vec3d p = plus(a, minus(b, a), share);
        most = std::max(most, index.drop(p[0], p[1], p[2] - 1, &met).tip_z - p[2]);
    }
    return most;
}

TEST(FlatWay, IsFreeWhereDropsSaySo) {
    Context context;
    std::mt19937_64 random(test::seed());
    std::uniform_real_distribution<double> across(-9, 9), turn(0, 6.28318), far(0.05, 4), up(0, 0.02);
    int free = 0, met = 0;
    for (int part = 0; part < 12; ++part) {
        const Mesh mesh = part < 6 ? test::random_height_field(context, 20, 1.0, 6, part % 2 ? 0.5 : 0.25,
                                                               static_cast<std::uint32_t>(random()))
                                   : test::height_field(context, 40, 0.5, [&](double x, double y) {
                                         return 6 + std::abs(x) * 0.2 * (part - 5) + 0.3 * std::sin(y * part);
                                     });
        const LayerSolid solid = layer_solid(context, mesh.view(), -5, part % 3 == 2 ? 7.5 : 30);
        for (const double radius : {0.6, 1.5, 3.0}) {
            const DropIndex index(solid, flat_cutter(radius));
            for (int k = 0; k < 60; ++k) {
                const double x = across(random), y = across(random), way = turn(random), l = far(random);
                const auto rest = [&](double px, double py) {
                    return Vec3d{px, py, index.drop(px, py, -1).tip_z + up(random)};
                };
                const Vec3d a = rest(x, y), b = rest(x + l * std::cos(way), y + l * std::sin(way));
                if (!std::isfinite(a[2]) || !std::isfinite(b[2])) continue;
                const double stands = stands_over(index, a, b);
                for (const double over : {0.002, 0.05}) {
                    const bool is_free = flat_way_is_free(solid, radius, a, b, over);
                    EXPECT_EQ(is_free, flat_way_is_free(solid, radius, b, a, over));
                    const double slack = 1e-6 + 0.002 * std::abs(b[2] - a[2]) / l;
                    if (is_free) EXPECT_LE(stands, over + 1e-6) << "part " << part << " radius " << radius;
                    else EXPECT_GT(stands, over - slack) << "part " << part << " radius " << radius;
                    ++(is_free ? free : met);
                }
            }
        }
    }
    std::printf("%d free, %d not\n", free, met);
    EXPECT_GT(free, 300);
    EXPECT_GT(met, 300);
}

TEST(FlatWay, OneUpAnEvenSlopeIsFreeAndOneThroughAnEdgeIsNot) {
    Context context;
    const Mesh mesh =
        test::height_field(context, 40, 0.5, [](double x, double) { return 5 + 0.5 * std::max(0.0, x); });
    const LayerSolid solid = layer_solid(context, mesh.view(), -5, 30);
    const DropIndex index(solid, flat_cutter(1));
    const auto at = [&](double x) { return Vec3d{x, 0.3, index.drop(x, 0.3).tip_z}; };
    EXPECT_TRUE(flat_way_is_free(solid, 1, at(0.5), at(6), 1e-5));
    EXPECT_TRUE(flat_way_is_free(solid, 1, at(-6), at(-1), 1e-5));
    EXPECT_TRUE(flat_way_is_free(solid, 1, at(-6), at(6), 1e-5)) << "over a valley";
    // Over a ridge the straight way cuts in.
    const Mesh ridge =
        test::height_field(context, 40, 0.5, [](double x, double) { return 8 - 0.5 * std::abs(x); });
    const LayerSolid roof = layer_solid(context, ridge.view(), -5, 30);
    const DropIndex over(roof, flat_cutter(1));
    const auto on = [&](double x) { return Vec3d{x, 0.3, over.drop(x, 0.3).tip_z}; };
    EXPECT_FALSE(flat_way_is_free(roof, 1, on(-3), on(1.2), 0.01));
    EXPECT_FALSE(flat_way_is_free(roof, 1, on(-3), on(3), 0.01));
}

}  // namespace
}  // namespace slabwright
