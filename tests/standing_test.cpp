// The bound of what stands against the exact stock, and what it knows about ways that were cut.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "engine/stock/standing.h"
#include "kernels/stock/stock.h"
#include "tests/support/seed.h"

using namespace slabwright;

namespace {

constexpr double kTop = 19;

double cell_bound(const Standing& standing, double x, double y) { return standing.top(1e-9, {x, y}, {x, y}); }

// A cutter of half a millimetre clears no cell of half a millimetre; of those that are made for it, it does.
TEST(Standing, IsAsFineAsTheThinnestCutter) {
    for (const double radius : {0.25, 0.5, 1.0, 3.0}) {
        Standing standing({0, 0}, {20, 20}, 10, radius);
        standing.cut(flat_cutter(radius), {5, 10, 4}, {15, 10, 4});
        for (double x = 5; x < 15; x += 0.3)
            EXPECT_NEAR(standing.top(0.2 * radius, {x, 10}, {x, 10}), 4, 1e-4) << "radius " << radius;
        EXPECT_NEAR(standing.top(0.2 * radius, {10, 10 + 1.3 * radius}, {10, 10 + 1.3 * radius}), 10, 1e-4);
    }
}

}  // namespace

TEST(Standing, IsNeverBelowTheExactStockAnywhere) {
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    const std::array<double, 2> min{-3.3, 1.7}, max{27.4, 24.9};
    std::uniform_real_distribution<double> ux(min[0] - 3, max[0] + 3), uy(min[1] - 3, max[1] + 3), uz(2, 20),
        ur(0.4, 7), step(-2, 2);
    // The points of the exact stock do not fall on the grid of the bound.
    const CellGrid grid{min[0] + 0.003, min[1] + 0.004, 0.0917, static_cast<int>((max[0] - min[0]) / 0.0917),
                        static_cast<int>((max[1] - min[1]) / 0.0917)};
    for (int trial = 0; trial < 6; ++trial) {
        Stock stock(grid);
        stock.add_slab(0, kTop);
        Standing standing(min, max, kTop);
        for (int path = 0; path < 8; ++path) {
            const bool ball = path % 2 == 1;
            const double r = ur(random);
            std::array<double, 3> at{ux(random), uy(random), uz(random)};
            for (int move = 0; move < 20; ++move) {
                std::array<double, 3> to = move == 0 ? std::array{ux(random), uy(random), uz(random)}
                                                     : std::array{at[0] + step(random), at[1] + step(random),
                                                                  std::max(0.1, at[2] + step(random) / 2)};
                if (move % 4 == 1) to[2] = at[2];
                if (move % 6 == 2) to[0] = at[0], to[1] = at[1];
                stock.cut({ball ? CutterEnd::Form::ball : CutterEnd::Form::flat, r, 0}, at, to);
                standing.cut(ball ? ball_cutter(r) : flat_cutter(r), at, to);
                at = to;
            }
        }
        double loose = 0, cut = 0;
        for (int j = 0; j < grid.ny; ++j)
            for (int i = 0; i < grid.nx; ++i) {
                const double exact = stock.top(grid.index(i, j)),
                             bound = cell_bound(standing, grid.x(i), grid.y(j));
                ASSERT_GE(bound, exact) << "trial " << trial << " at " << grid.x(i) << ' ' << grid.y(j);
                if (exact < kTop - 1) cut += 1, loose += bound > exact + 1.5;
            }
        EXPECT_LT(loose, 0.8 * cut) << "the bound says nothing";
        // A way's highest: no exact point within the swept disc is higher.
        for (int query = 0; query < 20; ++query) {
            const double r = ur(random);
            const std::array<double, 2> a{ux(random), uy(random)}, b{ux(random), uy(random)};
            const double top = standing.top(r, a, b);
            sweep(grid, {CutterEnd::Form::flat, r, 0}, {a[0], a[1], 0}, {b[0], b[1], 0},
                  [&](std::size_t c, double) { ASSERT_GE(top, stock.top(c)) << "trial " << trial; });
        }
    }
}

// What a chain of level ways leaves out, because the way before has been there, makes no difference.
TEST(Standing, StandsAsAfterTheSameWaysInAnyOrder) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> place(-5, 65), step(-9, 9);
    for (int trial = 0; trial < 20; ++trial) {
        const std::array<double, 2> min{0, 0}, max{60, 50};
        const CutterShape flat = flat_cutter(trial % 2 == 0 ? 5.0 : 6.35), other = flat_cutter(3);
        struct Way {
            CutterShape cutter;
            std::array<double, 3> from, to;
        };
        std::vector<Way> ways;
        std::array<double, 3> at{place(random), place(random), 15};
        for (int k = 0; k < 60; ++k) {
            std::array<double, 3> to{at[0] + step(random), at[1] + step(random), at[2]};
            if (k % 7 == 3) to[2] -= 0.5;                             // down a ramp
            if (k % 11 == 5) to = {at[0], at[1], at[2]};              // nowhere
            if (k % 13 == 6) at = {place(random), place(random), 9};  // from elsewhere
            ways.push_back({k % 17 == 9 ? other : flat, at, to});
            at = to;
        }
        Standing chained(min, max, kTop), shuffled(min, max, kTop);
        for (const Way& w : ways) chained.cut(w.cutter, w.from, w.to);
        std::shuffle(ways.begin(), ways.end(), random);
        for (const Way& w : ways) shuffled.cut(w.cutter, w.from, w.to);
        for (double y = 0.1; y < 50; y += 0.5)
            for (double x = 0.1; x < 60; x += 0.5)
                ASSERT_EQ(cell_bound(chained, x, y), cell_bound(shuffled, x, y))
                    << "trial " << trial << " at " << x << ' ' << y;
    }
}

TEST(Standing, KnowsWhatWasCleared) {
    Standing standing({0, 0}, {60, 40}, kTop);
    const CutterShape flat = flat_cutter(5);
    EXPECT_NEAR(standing.top(5, {20, 20}, {40, 20}), kTop, 1e-3);
    EXPECT_EQ(standing.top(5, {-20, 20}, {-7, 20}), -std::numeric_limits<double>::infinity());
    for (double y = 0; y <= 40; y += 4) standing.cut(flat, {-6, y, 12}, {30, y, 12});
    EXPECT_NEAR(standing.top(5, {5, 20}, {24, 20}), 12, 1e-3);
    EXPECT_NEAR(standing.top(5, {5, 20}, {34, 20}), kTop, 1e-3);
    // Along the wall that the flat left, 5 mm from it: free for the cutter, whatever the wall's own cells
    // say.
    EXPECT_NEAR(standing.free_tip(flat, {30, 10}, {30, 30}), 12, 1e-3);
    EXPECT_NEAR(standing.top(5, {30, 10}, {30, 30}), kTop, 1e-3);
    EXPECT_NEAR(standing.free_tip(flat, {32, 10}, {32, 30}), kTop, 1e-3);
}

// Straight down a cutter without edges at its middle leaves what stands under that; on a way it takes all
// that its core does not cover all the time.
TEST(Standing, UnderACoreItStaysAsItWas) {
    const CutterShape flat = flat_cutter(10);
    Standing down({0, 0}, {60, 60}, kTop);
    down.cut(flat, {30, 30, 9}, {30, 30, 9}, 6);
    EXPECT_NEAR(cell_bound(down, 30, 30), kTop, 1e-3);
    EXPECT_NEAR(cell_bound(down, 34, 30), kTop, 1e-3);
    for (const double angle : {0.0, 1.0, 2.0, 3.0, 4.0, 5.0})
        EXPECT_NEAR(cell_bound(down, 30 + 8 * std::cos(angle), 30 + 8 * std::sin(angle)), 9, 1e-3) << angle;
    Standing along({0, 0}, {60, 60}, kTop);
    along.cut(flat, {26, 30, 9}, {34, 30, 9}, 6);
    EXPECT_NEAR(cell_bound(along, 30, 30), kTop, 1e-3) << "4 mm from either end";
    EXPECT_NEAR(cell_bound(along, 24, 30), 9, 1e-3) << "2 mm beyond the first";
    EXPECT_NEAR(cell_bound(along, 36, 30), 9, 1e-3);
}

TEST(Standing, BallsAreBoundedByTheirShape) {
    // Where a ball went it may go again, lower by nothing and higher by anything; across it meets the cusp
    // between two passes.
    Standing standing({0, 0}, {60, 40}, kTop);
    const CutterShape ball = ball_cutter(3);
    for (double y = 10; y <= 30; y += 0.8)
        for (double x = 5; x < 55; x += 0.4)
            standing.cut(ball, {x, y, 15 + 0.02 * x}, {x + 0.4, y, 15 + 0.02 * (x + 0.4)});
    EXPECT_NEAR(standing.free_tip(ball, {10, 20}, {10.4, 20}), 15.2, 0.05);
    const double highest = 15 + 0.02 * 43.4;
    EXPECT_LE(standing.top(3, {20, 20}, {40, 20}), highest + 0.2);
    EXPECT_GE(standing.top(3, {20, 20}, {40, 20}), 15 + 0.02 * 43);
}

TEST(Standing, IsBoundedInMemory) {
    EXPECT_LE(Standing::bytes({0, 0}, {5000, 5000}, 0.5), (Standing::kMostCells + 8192) * 4);
    EXPECT_EQ(Standing::bytes({0, 0}, {10, 20}, 3), 20 * 40 * 4);
    EXPECT_EQ(Standing::bytes({0, 0}, {10, 20}, 1), 40 * 80 * 4);
    const Standing big({0, 0}, {5000, 5000}, kTop);
    EXPECT_GT(big.cell(), 3);
}
