// Feeds that thin walls and pins bear: the map against brute force, and the forces that are left against the
// closed formula of a foot.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "engine/forces/feeds.h"
#include "engine/forces/wall_map.h"
#include "engine/schedule/standing_walls.h"
#include "engine/stock/cut_stretches.h"
#include "tests/support/plate.h"
#include "tests/support/seed.h"

namespace slabwright {
namespace {

using test::at;
using test::plate;

struct Block {
    double x, y, length, thick;  // of its middle, along x, along y

    [[nodiscard]] std::shared_ptr<const Loops> outline() const {
        Loops loops;
        for (const auto& [u, v] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}})
            loops.points.push_back({to_units(x + u * length / 2), to_units(y + v * thick / 2)});
        loops.close_loop();
        return std::make_shared<const Loops>(simplify(loops));
    }
    [[nodiscard]] double distance(double px, double py) const {
        return std::hypot(std::max(0.0, std::abs(px - x) - length / 2),
                          std::max(0.0, std::abs(py - y) - thick / 2));
    }
};

StandingFoot foot_of(const Block& block, double z, double top, bool in_layer) {
    StandingFoot foot;
    foot.outline = block.outline();
    foot.foot = wall_foot(*foot.outline);
    foot.z = z, foot.top = top, foot.in_layer = in_layer;
    foot.middle = {block.x, block.y};
    return foot;
}

// Every wall that the cutter meets is found, none that is far, and the weakest decides.
TEST(WallMap, TheWeakestWallBesideTheCutter) {
    std::mt19937 random(test::seed());
    const auto any = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    constexpr double kStrength = 27, kWidest = 12.7;
    int met = 0;
    for (int trial = 0; trial < 40; ++trial) {
        std::vector<Block> blocks;
        std::vector<StandingFoot> feet;
        for (int k = 0; k < 5; ++k) {
            blocks.push_back({any(0, 120), any(0, 80), any(2, 50), any(0.8, 6)});
            feet.push_back(foot_of(blocks.back(), 0, any(5, 18), true));
        }
        const WallMap map(feet, kStrength, kWidest, 0.8);
        for (int q = 0; q < 200; ++q) {
            const double radius = any(1, kWidest), low = any(0, 17), x = any(0, 120), y = any(0, 80);
            const WallPush push{x, y, low, low + any(0.1, 1), radius, OperationKind::finish};
            const double height = (push.low + push.high) / 2;
            double most = kUnbounded, least = kUnbounded;  // by walls that must count, and that may
            for (std::size_t k = 0; k < blocks.size(); ++k) {
                if (low >= feet[k].top) continue;
                const double force = kStrength / feet[k].foot.stress_mpa(1, height);
                const double away = blocks[k].distance(x, y),
                             cell = (std::max(blocks[k].length, blocks[k].thick) + 3 * kWidest) / 256;
                if (away <= radius) most = std::min(most, force);
                if (away <= 1.5 * radius + 4 * cell) least = std::min(least, force);
            }
            const WallBears bears = map.bears(push);
            EXPECT_LE(bears.force_n, most * (1 + 1e-9));
            EXPECT_GE(bears.force_n, least * (1 - 1e-9));
            if (most < kUnbounded) ++met;
        }
    }
    EXPECT_GT(met, 500);
}

TEST(WallMap, RoughingPushesAStepOverItsLevelAndFacingAtNoWall) {
    const std::vector<StandingFoot> feet{foot_of({60, 40, 40, 2}, 0, 15, true)};
    const WallMap map(feet, 27, 10, 0.5);
    WallPush push{60, 44, 6, 9, 5, OperationKind::rough};
    EXPECT_NEAR(map.bears(push).height_mm, 3, 1e-9);
    EXPECT_NEAR(map.bears(push).force_n, 27 / feet[0].foot.thicker_by(0.5).stress_mpa(1, 3), 1e-9);
    push.kind = OperationKind::finish;
    EXPECT_NEAR(map.bears(push).height_mm, 7.5, 1e-9);
    push.kind = OperationKind::face;
    EXPECT_EQ(map.bears(push).foot, nullptr);
    std::vector<StandingFoot> below = feet;
    below[0].in_layer = false;
    push.kind = OperationKind::rough;
    EXPECT_NEAR(WallMap(below, 27, 10, 0.5).bears(push).height_mm, 7.5, 1e-9);
}

// Around a pin: a flat end mill leaves so much wood, then a ball takes it level by level.
std::vector<Operation> around(const Plan& plan, const Block& pin, double bottom, double left) {
    const auto ring = [&](std::vector<Move>& moves, double off, double z, std::uint32_t feed) {
        const double u = pin.length / 2 + off, v = pin.thick / 2 + off;
        moves.push_back(at(pin.x - u, pin.y - v, 30, 0));
        moves.push_back(at(pin.x - u, pin.y - v, z, 800));
        for (const auto& [a, b] : {std::pair{1, -1}, {1, 1}, {-1, 1}, {-1, -1}})
            moves.push_back(at(pin.x + a * u, pin.y + b * v, z, feed));
        moves.push_back(at(pin.x - u, pin.y - v, 30, 0));
    };
    const Tool &flat = plan.job.tools[1], &ball = plan.job.tools[2];
    Operation rough, finish;
    rough.kind = OperationKind::rough, rough.tool = flat.number, rough.purpose = "rough";
    finish.kind = OperationKind::finish, finish.tool = ball.number, finish.purpose = "walls";
    rough.stepdown = 3, finish.stepdown = 2;
    rough.spindle_rpm = flat.max_rpm, finish.spindle_rpm = ball.max_rpm;
    for (double z = 15; z > bottom - 0.1; z -= 3)
        ring(rough.moves, flat.diameter / 2 + left, z, static_cast<std::uint32_t>(flat.max_feed));
    for (double z = 16; z > bottom - 0.1; z -= 2) ring(finish.moves, ball.diameter / 2, z, 4000);
    return {rough, finish};
}

// The stress that the moves put on the pin's foot, by what stands and the force model alone.
double worst_stress(const Plan& plan, const std::vector<Operation>& operations, const Block& pin,
                    double bottom, double left) {
    StandingSlab slab(plan.stock_min, plan.stock_max, 0, 18,
                      StandingSlab::cell_for(plan.job, plan.stock_min, plan.stock_max));
    double worst = 0;
    for (const Operation& op : operations) {
        const Tool& tool = plan.job.tools[static_cast<std::size_t>(op.tool) - 1];
        slab.run(op, tool, [&](const CutStretch& s) {
            if (!s.cuts() || pin.distance(s.at[0], s.at[1]) > tool.diameter / 2) return;
            double feed = 0;
            for (std::uint32_t k = s.first; k <= s.last; ++k)
                feed = std::max(feed, static_cast<double>(op.moves[k].feed));
            const double force = reference_forces(cut_of(s, tool, plan.job, feed)).peak_in_plane_n;
            const bool rough = op.kind == OperationKind::rough;
            // A square of side t bends least across its corner: t³ / 6√2.
            const double side = pin.thick + (rough ? 2 * left : 0),
                         height = rough ? s.high - s.low : s.at[2] + (s.low + s.high) / 2 - bottom;
            worst = std::max(worst, force * height * 6 * std::numbers::sqrt2 / (side * side * side));
        });
    }
    return worst;
}

TEST(WallFeeds, PinsBearWhatIsLeftOfTheForces) {
    std::mt19937 random(test::seed());
    const auto any = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    int saved = 0;
    for (int trial = 0; trial < 40; ++trial) {
        Plan plan = plate();
        plan.job.material.strength_mpa = 27;
        const double left = plan.job.cutting.wall_allowance, bottom = std::round(any(2, 8));
        const double side = any(1, 4);
        const Block pin{any(45, 75), any(30, 50), side, side};
        const std::vector<StandingFoot> feet{foot_of(pin, bottom, 18, true)};
        const WallMap walls(feet, plan.job.material.strength_mpa, widest_beside_walls(plan.job), left);
        Context context;
        const auto run = [&](const WallMap* map, std::vector<Diagnostic>& told) {
            plan.layers[0].operations = around(plan, pin, bottom, left);
            (void)adapt_layer(context, plan.layers[0], plan, {nullptr, map}, told);
            return worst_stress(plan, plan.layers[0].operations, pin, bottom, left);
        };
        std::vector<Diagnostic> unasked, told;
        const double before = run(nullptr, unasked), after = run(&walls, told);
        const bool breaks =
            std::any_of(told.begin(), told.end(), [](const Diagnostic& d) { return d.code == "wall.weak"; });
        SCOPED_TRACE(testing::Message() << "seed " << test::seed() << ", side " << side << ", bottom "
                                        << bottom << ": " << before << " MPa before");
        if (breaks) continue;
        EXPECT_LE(after, 1.02 * 27);
        if (before > 1.1 * 27) ++saved;
    }
    EXPECT_GE(saved, 3);
}

double seconds(const Plan& plan) {
    double sum = 0;
    for (const Operation& op : plan.layers[0].operations)
        for (std::size_t k = 1; k < op.moves.size(); ++k) {
            const Move &a = op.moves[k - 1], &b = op.moves[k];
            if (b.feed > 0)
                sum += 60 * std::hypot(to_mm(b.x - a.x), to_mm(b.y - a.y), to_mm(b.z - a.z)) / b.feed;
        }
    return sum;
}

bool is_told(const std::vector<Diagnostic>& told, const char* what) {
    return std::any_of(told.begin(), told.end(),
                       [&](const Diagnostic& d) { return d.message.find(what) != std::string::npos; });
}

// Wood just strong enough to bear a low feed: several passes at higher feeds are faster, where there is depth
// to divide, and never slower.
TEST(WallFeeds, PassesAreFasterThanALowFeed) {
    std::mt19937 random(test::seed());
    const auto any = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    int faster = 0;
    for (int trial = 0; trial < 12; ++trial) {
        Plan plan = plate();
        const double left = plan.job.cutting.wall_allowance, bottom = std::round(any(2, 8)), side = any(2, 5);
        const Block pin{any(45, 75), any(30, 50), side * any(1, 8), side};
        const std::vector<StandingFoot> feet{foot_of(pin, -any(0, 60), 18, false)};
        Context context;
        bool holds = false;
        const auto run = [&](bool stepdown, double strength) {
            plan.job.material.strength_mpa = strength;
            plan.job.cutting.adapt_stepdown = stepdown;
            plan.layers[0].operations = around(plan, pin, bottom, left);
            plan.layers[0].operations.pop_back();  // the flat end mill's alone
            const WallMap walls(feet, strength, widest_beside_walls(plan.job), left);
            std::vector<Diagnostic> told;
            (void)adapt_layer(context, plan.layers[0], plan, {nullptr, &walls}, told);
            holds = !is_told(told, "at its foot");
            return seconds(plan);
        };
        double breaks = 0.1, enough = 1000;  // at any feed; at some
        for (int k = 0; k < 30; ++k) {
            const double middle = std::sqrt(breaks * enough);
            run(false, middle);
            (holds ? enough : breaks) = middle;
        }
        const double slow = run(false, 1.03 * enough), fast = run(true, 1.03 * enough);
        EXPECT_TRUE(holds);
        EXPECT_LE(fast, slow) << "seed " << test::seed() << ", side " << side << ", bottom " << bottom;
        if (fast < 0.8 * slow) ++faster;
    }
    EXPECT_GE(faster, 8);
}

// A ball's shells beside a weak wall, in many rounds of passes: hardly any goes where an earlier round has
// taken everything away.
TEST(WallFeeds, NoPassGoesWhereNothingStands) {
    std::size_t passes = 0, idle = 0;
    for (const double strength : {4.0, 6.0, 8.0, 12.0, 16.0}) {
        Plan plan = plate();
        plan.job.material.strength_mpa = strength;
        const Block pin{60, 40, 12, 2};
        const std::vector<StandingFoot> feet{foot_of(pin, 2, 18, true)};
        const WallMap walls(feet, strength, widest_beside_walls(plan.job), 0);
        plan.layers[0].operations = around(plan, pin, 2, plan.job.cutting.wall_allowance);
        Context context;
        std::vector<Diagnostic> told;
        (void)adapt_layer(context, plan.layers[0], plan, {nullptr, &walls}, told);
        StandingSlab slab(plan.stock_min, plan.stock_max, 0, 18,
                          StandingSlab::cell_for(plan.job, plan.stock_min, plan.stock_max));
        for (const Operation& op : plan.layers[0].operations) {
            std::vector<char> cuts(op.moves.size(), 0);
            slab.run(op, plan.job.tools[static_cast<std::size_t>(op.tool) - 1], [&](const CutStretch& s) {
                for (std::uint32_t k = s.first; k <= s.last; ++k)
                    if (s.cuts()) cuts[k] = 1;
            });
            if (op.kind != OperationKind::finish) continue;
            for (std::size_t k = 1; k < op.moves.size(); ++k) {
                const Move &a = op.moves[k - 1], &b = op.moves[k];
                if (b.feed == 0 || a.z != b.z || (a.x == b.x && a.y == b.y)) continue;
                ++passes;
                idle += cuts[k] == 0 ? 1 : 0;
            }
        }
    }
    EXPECT_GT(passes, 200U);
    EXPECT_LE(12 * idle, passes) << idle << " idle ways of " << passes;  // one in six otherwise
}

// A needle breaks at any feed and in any passes: it is cut as planned, and told.
TEST(WallFeeds, WhatNothingSavesIsCutAsPlanned) {
    Plan plan = plate();
    plan.job.material.strength_mpa = 27;
    const Block needle{60, 40, 0.3, 0.3};
    const std::vector<StandingFoot> feet{foot_of(needle, 2, 18, true)};
    const WallMap walls(feet, plan.job.material.strength_mpa, widest_beside_walls(plan.job), 0);
    Context context;
    const auto run = [&](const WallMap* map, std::vector<Diagnostic>& told) {
        plan.layers[0].operations = around(plan, needle, 2, plan.job.cutting.wall_allowance);
        (void)adapt_layer(context, plan.layers[0], plan, {nullptr, map}, told);
        return plan.layers[0].operations;
    };
    std::vector<Diagnostic> unasked, told;
    const std::vector<Operation> planned = run(nullptr, unasked), beside = run(&walls, told);
    EXPECT_TRUE(is_told(told, "no feed or passes would save it"));
    EXPECT_FALSE(is_told(unasked, "would save it"));
    ASSERT_EQ(planned.size(), beside.size());
    for (std::size_t k = 0; k < planned.size(); ++k) EXPECT_EQ(planned[k].moves, beside[k].moves);
}

}  // namespace
}  // namespace slabwright
