// The feed that follows from what a roughing cutter meets: straight passes, slots, corners, and the bound
// that the cap promises.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "engine/stock/engagement.h"
#include "kernels/stock/stock.h"
#include "tests/support/seed.h"

using namespace slabwright;

namespace {

constexpr double kTop = 19, kDepth = 3, kDiameter = 12;
constexpr std::uint32_t kFeed = 6000;
const EngagementCap kCap{0.7, kDiameter, kDepth};

Move to(double x, double y, double z, std::uint32_t feed = kFeed) {
    return {to_units(x), to_units(y), to_units(z), feed};
}
EngagedStock slab() { return {{0, 0}, {100, 80}, kTop, kDiameter / 2}; }

std::uint32_t slowest(const std::vector<Move>& moves) {
    std::uint32_t least = UINT32_MAX;
    for (const Move& m : moves)
        if (m.feed > 0) least = std::min(least, m.feed);
    return least;
}

Context& context() {
    static Context shared;
    return shared;
}

}  // namespace

TEST(Engagement, VolumeIsThatOfTheSlot) {
    EngagedStock stock = slab();
    const double taken = stock.cut({20, 40, kTop - kDepth}, {80, 40, kTop - kDepth});
    const double exact = kDepth * (60 * kDiameter + std::numbers::pi * kDiameter * kDiameter / 4);
    EXPECT_NEAR(taken, exact, 0.01 * exact);
    EXPECT_EQ(stock.cut({20, 40, kTop - kDepth}, {80, 40, kTop - kDepth}), 0) << "it is gone";
}

// What is told by parts of a way is what ways of that length take one after the other.
TEST(Engagement, PartsOfAWayTakeWhatTheyTakeOneByOne) {
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> ux(-8, 108), uy(-8, 88), uz(kTop - 9, kTop + 1), share(0, 1);
    EngagedStock whole = slab(), pieces = slab();
    std::array<double, 3> at{20, 20, kTop - kDepth};
    std::size_t met = 0;
    for (int trial = 0; trial < 200; ++trial) {
        const std::array<double, 3> to{at[0] + 0.3 * (ux(random) - at[0]), at[1] + 0.3 * (uy(random) - at[1]),
                                       share(random) < 0.8 ? at[2] : uz(random)};
        std::vector<double> volumes(1 + static_cast<std::size_t>(9 * share(random)));
        whole.cut(at, to, volumes);
        std::array<double, 3> from = at;
        for (std::size_t k = 1; k <= volumes.size(); ++k) {
            std::array<double, 3> next = to;
            const double t = static_cast<double>(k) / static_cast<double>(volumes.size());
            if (k < volumes.size())
                for (std::size_t a = 0; a < 3; ++a) next[a] = at[a] + t * (to[a] - at[a]);
            const double volume = pieces.cut(from, next);
            // A cell of a quarter of a square millimetre whose centre lies on an edge goes to either part.
            EXPECT_NEAR(volumes[k - 1], volume, 0.26 * 9 + 1e-9)
                << "seed " << seed << ", trial " << trial << ", part " << k;
            met += volume > 3;
            from = next;
        }
        at = to;
    }
    EXPECT_GT(met, 50U);
}

// Against the sweep that the simulator uses, over chains of level and sloping moves.
TEST(Engagement, TakesWhatTheExactSweepTakes) {
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> ux(-8, 108), uy(-8, 88), uz(kTop - 9, kTop + 1), share(0, 1);
    EngagedStock stock = slab();
    const double cell = kDiameter / 2 / 12;  // as the header says
    Stock exact({cell / 2, cell / 2, cell, static_cast<int>(std::lround(100 / cell)),
                 static_cast<int>(std::lround(80 / cell))});
    exact.add_slab(0, kTop);
    std::array<double, 3> at{ux(random), uy(random), kTop};
    for (int k = 0; k < 400; ++k) {
        if (share(random) < 0.1) at = {ux(random), uy(random), uz(random)};
        const double near = share(random) < 0.5 ? 0.05 : 1;  // short ways and long ones
        const std::array<double, 3> to{at[0] + near * (ux(random) - at[0]),
                                       at[1] + near * (uy(random) - at[1]),
                                       share(random) < 0.7 ? at[2] : uz(random)};
        const double removed =
            exact.cut({CutterEnd::Form::flat, kDiameter / 2, 0}, at, to).removed * cell * cell;
        ASSERT_NEAR(stock.cut(at, to), removed, 1e-3 * removed + 0.01) << "move " << k;
        at = to;
    }
}

TEST(Engagement, ASlotIsSlowedAndAHalfPassIsNot) {
    const double z = kTop - kDepth;
    EngagedStock stock = slab();
    std::vector<Move> slot{to(-10, 40, z, 0), to(110, 40, z)};
    EXPECT_GT(cap_engagement(context(), slot, stock, kCap), 90);
    // In the middle of the slab the whole breadth is met: 0.7 of the feed, rounded down to a twentieth, and
    // what cells add to a breadth.
    EXPECT_GE(slowest(slot), 0.6 * kFeed);
    EXPECT_LE(slowest(slot), 0.7 * kFeed);
    EXPECT_EQ(slot[1].feed, kFeed) << "outside the slab";
    EXPECT_EQ(slot.back().x, to_units(110));
    EXPECT_EQ(slot.back().feed, kFeed) << "outside the slab";
    // Beside the slot, half of the cutter in stock: as fast as it was.
    std::vector<Move> half{to(-10, 46, z, 0), to(110, 46, z)};
    const std::vector<Move> before = half;
    EXPECT_EQ(cap_engagement(context(), half, stock, kCap), 0);
    EXPECT_EQ(half, before);
    // A slot half as deep as the cap is meant for is no heavier than half a breadth.
    std::vector<Move> shallow{to(-10, 10, kTop - kDepth / 2, 0), to(110, 10, kTop - kDepth / 2)};
    EXPECT_EQ(cap_engagement(context(), shallow, stock, kCap), 0);
}

TEST(Engagement, ACornerIsSlowedWhereTheCutterTurnsIntoIt) {
    const double z = kTop - kDepth;
    EngagedStock stock = slab();
    // A pass of 0.45 of the diameter along the south and the east of a pocket that has been cleared to within
    // that of its walls.
    stock.cut({10, 30, z}, {60, 30, z});
    stock.cut({60, 30, z}, {60, 70, z});
    for (double x = 10; x < 60; x += 5) stock.cut({x, 30, z}, {x, 70, z});
    const double step = 0.45 * kDiameter;
    std::vector<Move> pass{to(10, 30, z), to(10, 30 - step, z), to(60 + step, 30 - step, z),
                           to(60 + step, 70, z)};
    stock.cut({10, 30 - step, z}, {10, 30 - step, z});
    cap_engagement(context(), pass, stock, kCap);
    double slowed = 0, last_slow_x = 0;
    for (std::size_t k = 2; k < pass.size(); ++k)
        if (pass[k].feed < kFeed) {
            slowed +=
                std::hypot(to_mm(pass[k].x) - to_mm(pass[k - 1].x), to_mm(pass[k].y) - to_mm(pass[k - 1].y));
            last_slow_x = to_mm(pass[k].x);
        }
    EXPECT_GT(slowed, 1);
    EXPECT_LT(slowed, 2 * kDiameter) << "only near the corner";
    EXPECT_NEAR(last_slow_x, 60 + step, kDiameter);
}

// Whatever the way: neither its shape nor its volume changes, and no stretch takes more in a minute than the
// cap allows.
TEST(Engagement, NoStretchCutsFasterThanTheCapAllows) {
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> ux(-8, 108), uy(-8, 88), uz(kTop - kDepth, kTop + 1);
    for (int round = 0; round < 20; ++round) {
        std::vector<Move> way{to(ux(random), uy(random), kTop + 5, 0)};
        for (int k = 0; k < 30; ++k) {
            if (k % 7 == 0)
                way.push_back({to_units(ux(random)), to_units(uy(random)), to_units(kTop + 5), 0});
            way.push_back(to(ux(random), uy(random), uz(random)));
        }
        std::vector<Move> capped = way;
        EngagedStock stock = slab();
        const double slowed = cap_engagement(context(), capped, stock, kCap);
        // The ways are the same: every corner is still there, and what lies between is on the straight line.
        std::size_t next = 0;
        double slow = 0;
        EngagedStock again = slab(), whole = slab();
        double taken = 0, exact = 0;
        for (std::size_t k = 0; k < capped.size(); ++k) {
            const Move& m = capped[k];
            ASSERT_LT(next, way.size());
            const bool corner = m.x == way[next].x && m.y == way[next].y && m.z == way[next].z;
            if (k > 0 && m.feed > 0) {
                const Move& from = capped[k - 1];
                const std::array<double, 3> a{to_mm(from.x), to_mm(from.y), to_mm(from.z)},
                    b{to_mm(m.x), to_mm(m.y), to_mm(m.z)};
                const double run = std::hypot(b[0] - a[0], b[1] - a[1]), volume = again.cut(a, b);
                taken += volume;
                if (m.feed < kFeed) slow += run;
                // Windows are a quarter of a radius; a stretch of one feed is one or more whole windows, or a
                // move's end.
                if (run > kDiameter) {
                    EXPECT_LE(volume / run * m.feed, 1.25 * kCap.share * kDiameter * kDepth * kFeed)
                        << "move " << k;
                }
            }
            if (corner) {
                EXPECT_EQ(m.feed == 0, way[next].feed == 0);
                if (next > 0 && way[next].feed > 0) {
                    const Move &p = way[next - 1], &q = way[next];
                    exact +=
                        whole.cut({to_mm(p.x), to_mm(p.y), to_mm(p.z)}, {to_mm(q.x), to_mm(q.y), to_mm(q.z)});
                }
                ++next;
            }
        }
        EXPECT_EQ(next, way.size());
        EXPECT_NEAR(slow, slowed, 1e-3);
        EXPECT_NEAR(taken, exact, 1e-3 * exact + 1);
    }
}
