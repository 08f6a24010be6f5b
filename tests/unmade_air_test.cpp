// What milling from one side or from both leaves filled: against the figures of METHOD.md section 16, against
// cells, and against lines whose solids are known in closed form.
#include "kernels/features/unmade_air.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "kernels/errors.h"
#include "kernels/mesh/facet_roles.h"
#include "kernels/mesh/weld.h"
#include "tests/mesh_shapes.h"
#include "tests/support/seed.h"
#include "tests/support/tunnels.h"

namespace slabwright {
namespace {

using shapes::Facets;
using support::block_with_tunnels;

constexpr double kLong = 20;  // mm of tunnel

Mesh welded(const Facets& facets) {
    Context context({.threads = 1});
    return weld(context, facets);
}

struct Left {
    double above, both;  // mm² of section
};

Left section_left(const Mesh& mesh, const std::vector<double>& tops) {
    Context context;
    const AirGaps gaps = air_gaps(context, mesh.view(), 0.04);
    return {unmade_air(context, gaps, tops, MilledFrom::above).volume_mm3 / kLong,
            unmade_air(context, gaps, tops, MilledFrom::both_sides).volume_mm3 / kLong};
}

TEST(UnmadeAir, OfATunnel) {
    const Mesh block = welded(block_with_tunnels({0, 0, 0}, {50, kLong, 60}, {{25, 30, 15}}));
    const Left one = section_left(block, {60}), halved = section_left(block, {30, 60}),
               under = section_left(block, {20, 60});
    EXPECT_NEAR(one.above, 706.9, 0.2);
    EXPECT_NEAR(one.both, 706.9, 0.2);
    EXPECT_NEAR(halved.above, 353.4, 0.1);
    EXPECT_NEAR(halved.both, 0, 1e-6);
    // Two circular segments that the boundary at 20 mm, 10 mm under the axis, does not meet: what lies beyond
    // the chord's ends.
    const double chord = std::sqrt(15 * 15 - 10 * 10.0);
    const auto half = [](double x) {  // under the circle from the axis to x
        return (x * std::sqrt(225 - x * x) + 225 * std::asin(x / 15)) / 2;
    };
    EXPECT_NEAR(under.both, 4 * (half(15) - half(chord)), 1.6)
        << "a line more or less at each end, 20 mm high";
}

TEST(UnmadeAir, OfTwoTunnelsNeedsTwoBoundaries) {
    const Mesh block = welded(block_with_tunnels({0, 0, 0}, {60, kLong, 60}, {{15, 25, 8}, {45, 35, 8}}));
    for (double z = 18; z < 42; z += 3) EXPECT_GT(section_left(block, {z, 60}).both, 40) << z;
    EXPECT_NEAR(section_left(block, {25, 35, 60}).both, 0, 1e-6);
    EXPECT_NEAR(section_left(block, {25, 35, 60}).above, 201.06, 0.1);
    EXPECT_NEAR(section_left(block, {60}).both, 402.1, 0.2);
}

TEST(UnmadeAir, IsOpenBelowFromBothSidesOnly) {
    // A table: a plate on four legs.
    Facets table = shapes::box({0, 0, 20}, {40, 40, 25});
    for (const float x : {0.0F, 35.0F})
        for (const float y : {0.0F, 35.0F}) shapes::append(table, shapes::box({x, y, 0}, {x + 5, y + 5, 20}));
    Context context;
    const AirGaps gaps = air_gaps(context, welded(table).view(), 0.25);
    const double air = (40 * 40 - 100) * 20.0;
    const std::vector<double> whole{25}, cut{12, 25}, made{20, 25};
    EXPECT_NEAR(unmade_air(context, gaps, whole, MilledFrom::above).volume_mm3, air, 1e-6);
    EXPECT_NEAR(unmade_air(context, gaps, cut, MilledFrom::above).volume_mm3, air * 8 / 20, 1e-6);
    EXPECT_EQ(unmade_air(context, gaps, made, MilledFrom::above).volume_mm3, 0);
    for (const auto& tops : {whole, cut, made})
        EXPECT_EQ(unmade_air(context, gaps, tops, MilledFrom::both_sides).volume_mm3, 0);
}

TEST(UnmadeAir, NamesThePocketsTheLargestFirst) {
    const Mesh block = welded(block_with_tunnels({0, 0, 0}, {90, kLong, 60}, {{15, 20, 6}, {60, 30, 15}}));
    Context context;
    const AirGaps gaps = air_gaps(context, block.view(), 0.1);
    const UnmadeAir air = unmade_air(context, gaps, std::vector<double>{40, 60}, MilledFrom::both_sides);
    ASSERT_EQ(air.pockets.size(), 3U) << "the boundary leaves two corners of the large tunnel and the small";
    EXPECT_NEAR(air.pockets[0].volume_mm3, std::numbers::pi * 36 * kLong, 5);
    EXPECT_NEAR(air.pockets[0].height_mm, 12, 0.01);
    EXPECT_NEAR(air.pockets[0].at[0], 15, 0.2);
    EXPECT_NEAR(air.pockets[0].at[2], 20, 0.01);
    EXPECT_EQ(air.pockets[0].layer, 0U);
    EXPECT_NEAR(air.pockets[1].volume_mm3, 52.4 * kLong, 20);
    EXPECT_NEAR(air.pockets[2].volume_mm3, air.pockets[1].volume_mm3, 20);
    EXPECT_NEAR(air.pockets[1].height_mm, 20, 0.6);
    ASSERT_EQ(air.of_layers.size(), 2U);
    EXPECT_EQ(air.of_layers[1], 0);
    EXPECT_NEAR(air.of_layers[0], air.volume_mm3, 1e-9);
    EXPECT_NEAR(air.height_mm, std::max(air.pockets[1].height_mm, air.pockets[2].height_mm), 1e-9);
    EXPECT_LT(air.error_mm3, 0.02 * air.volume_mm3);
}

TEST(UnmadeAir, LayersMustAscend) {
    Context context;
    const AirGaps gaps = air_gaps(context, welded(shapes::box({0, 0, 0}, {10, 10, 10})).view(), 1);
    for (const std::vector<double>& tops : {std::vector<double>{5, 5}, {5, 4}, {0.0}, {std::nan("")}})
        EXPECT_THROW((void)unmade_air(context, gaps, tops, MilledFrom::above), Error);
    EXPECT_EQ(unmade_air(context, gaps, {}, MilledFrom::above).volume_mm3, 0);
    EXPECT_EQ(air_gaps(context, {}, 1).rows.size(), 0U);
}

constexpr int kCells = 12;
using Cells = std::array<std::array<std::array<bool, kCells>, kCells>, kCells>;  // x, y, z

/// Brute force: an empty cell stays where its layer has solid over it, and under it where both sides are
/// milled. Layers end at whole heights.
double cells_left(const Cells& solid, const std::vector<int>& borders, MilledFrom milled) {
    int left = 0;
    for (std::size_t x = 0; x < kCells; ++x)
        for (std::size_t y = 0; y < kCells; ++y)
            for (std::size_t l = 0; l + 1 < borders.size(); ++l)
                for (int z = borders[l]; z < borders[l + 1]; ++z) {
                    const auto any = [&](int from, int to) {
                        for (int k = from; k < to; ++k)
                            if (solid[x][y][static_cast<std::size_t>(k)]) return true;
                        return false;
                    };
                    if (any(z, z + 1) || !any(z + 1, borders[l + 1])) continue;
                    if (milled == MilledFrom::above || any(borders[l], z)) ++left;
                }
    return left;
}

TEST(UnmadeAir, AgreesWithCellsOfRandomBoxes) {
    const unsigned seed = test::seed();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const auto below = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
    double most_both = 0;
    for (int round = 0; round < 60; ++round) {
        Cells solid{};
        Facets facets;  // of boxes that overlap: the winding number tells
        for (int k = 0; k < 10; ++k) {
            const int x = below(kCells), y = below(kCells), z = k == 0 ? 0 : below(kCells);
            const int to_x = std::min(kCells, x + 1 + below(6)), to_y = std::min(kCells, y + 1 + below(6)),
                      to_z = std::min(kCells, z + 1 + below(3));
            for (int i = x; i < to_x; ++i)
                for (int j = y; j < to_y; ++j)
                    for (int l = z; l < to_z; ++l)
                        solid[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)]
                             [static_cast<std::size_t>(l)] = true;
            const auto corner = [](int a, int b, int c) {
                return Vec3f{static_cast<float>(a), static_cast<float>(b), static_cast<float>(c)};
            };
            shapes::append(facets, shapes::box(corner(x, y, z), corner(to_x, to_y, to_z)));
        }
        Context context;
        Mesh mesh = weld(context, facets);
        mesh.roles = facet_roles(context, mesh.view());
        std::vector<int> borders{0};
        std::vector<double> tops;
        const int top = static_cast<int>(bounds(mesh.view()).max.z);
        for (int z = 1 + below(4); z < top; z += 1 + below(5)) borders.push_back(z), tops.push_back(z);
        borders.push_back(kCells);
        tops.push_back(kCells);
        const AirGaps gaps = air_gaps(context, mesh.view(), 0.5);
        for (const MilledFrom milled : {MilledFrom::above, MilledFrom::both_sides}) {
            const UnmadeAir air = unmade_air(context, gaps, tops, milled);
            EXPECT_NEAR(air.volume_mm3, cells_left(solid, borders, milled), 1e-6) << "round " << round;
            EXPECT_NEAR(air.error_mm3, 0, 1e-6) << "four lines a cell, one of each quarter";
            if (milled == MilledFrom::both_sides) most_both = std::max(most_both, air.volume_mm3);
        }
    }
    EXPECT_GT(most_both, 20) << "some rounds leave air from both sides too";
}

struct Ball {
    double x, y, z, r;
};

Facets sphere(const Ball& ball) {
    constexpr int n = 60;  // from pole to pole
    const auto at = [&](int i, int k) {
        const double u = std::numbers::pi * (i % (2 * n)) / n, w = std::numbers::pi * k / n;
        const double s = k == 0 || k == n ? 0 : std::sin(w);
        return Vec3f{static_cast<float>(ball.x + ball.r * s * std::cos(u)),
                     static_cast<float>(ball.y + ball.r * s * std::sin(u)),
                     static_cast<float>(ball.z - ball.r * std::cos(w))};
    };
    Facets facets;
    for (int i = 0; i < 2 * n; ++i)
        for (int k = 0; k < n; ++k) {
            if (k > 0) facets.push_back({at(i, k), at(i + 1, k), at(i + 1, k + 1)});
            if (k + 1 < n) facets.push_back({at(i, k), at(i + 1, k + 1), at(i, k + 1)});
        }
    return facets;
}

/// A volume by columns is off by less than it says, or hardly more; lines through balls are known.
TEST(UnmadeAir, IsOffByLittleMoreThanItSays) {
    const unsigned seed = test::seed();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    for (int round = 0; round < 6; ++round) {
        Facets facets = shapes::box({0, 0, -5}, {60, 60, 0});
        std::vector<Ball> balls;
        for (int k = 0; k < 8; ++k) {
            balls.push_back({15 + 30 * unit(random), 15 + 30 * unit(random), 10 + 25 * unit(random),
                             4 + 6 * unit(random)});
            shapes::append(facets, sphere(balls.back()));
        }
        Context context;
        const Mesh mesh = weld(context, facets);
        const double top = bounds(mesh.view()).max.z;
        const std::vector<double> tops{11.3, 23.7, std::max(24.0, top)};
        double expected = 0;
        constexpr double cell = 0.05;
        for (double x = cell / 3; x < 60; x += cell)
            for (double y = cell / 3; y < 60; y += cell) {
                std::vector<std::array<double, 2>> solid{{-5, 0}};
                for (const Ball& b : balls) {
                    const double h2 = b.r * b.r - (x - b.x) * (x - b.x) - (y - b.y) * (y - b.y);
                    if (h2 > 0) solid.push_back({b.z - std::sqrt(h2), b.z + std::sqrt(h2)});
                }
                std::sort(solid.begin(), solid.end());
                double reached = solid[0][1];
                for (const auto& [low, high] : solid) {
                    const auto stabs = [begin = reached, end = low](double z) {
                        return z >= begin && z <= end;
                    };
                    if (low > reached && !stabs(tops[0]) && !stabs(tops[1]))
                        expected += (low - reached) * cell * cell;
                    reached = std::max(reached, high);
                }
            }
        const UnmadeAir air =
            unmade_air(context, air_gaps(context, mesh.view(), 0.5), tops, MilledFrom::both_sides);
        EXPECT_NEAR(air.volume_mm3, expected, 2 * air.error_mm3 + 0.005 * expected) << "round " << round;
        EXPECT_LT(air.error_mm3, 0.1 * expected) << "round " << round;
    }
}

TEST(UnmadeAir, IsTheSameOnAnyNumberOfThreads) {
    const Mesh mesh = welded(shapes::torus(90, 60, 25));
    std::vector<UnmadeAir> found;
    for (const int threads : {1, 2, 5}) {
        Context context({.threads = threads});
        const AirGaps gaps = air_gaps(context, mesh.view(), 0.3);
        found.push_back(unmade_air(context, gaps, std::vector<double>{-7, 3, 25}, MilledFrom::above));
    }
    for (const UnmadeAir& air : found) {
        EXPECT_EQ(air.volume_mm3, found[0].volume_mm3);
        EXPECT_EQ(air.error_mm3, found[0].error_mm3);
        ASSERT_EQ(air.pockets.size(), found[0].pockets.size());
        for (std::size_t i = 0; i < air.pockets.size(); ++i) {
            EXPECT_EQ(air.pockets[i].volume_mm3, found[0].pockets[i].volume_mm3);
            EXPECT_EQ(air.pockets[i].at, found[0].pockets[i].at);
        }
    }
    EXPECT_GT(found[0].volume_mm3, 1000);
}

}  // namespace
}  // namespace slabwright
