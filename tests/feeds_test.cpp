// What stands before a cutter, and the feeds and forces that follow from it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <set>
#include <tuple>

#include "engine/forces/cuts.h"
#include "engine/forces/feeds.h"
#include "engine/forces/min_material.h"
#include "engine/forces/split_cuts.h"
#include "engine/planner/planner.h"
#include "engine/stock/cut_stretches.h"
#include "kernels/forces/deflection.h"
#include "tests/support/height_field.h"
#include "tests/support/plate.h"
#include "tests/support/seed.h"

namespace slabwright {
namespace {

using test::at;
using test::plate;

Operation line(const Plan& plan, OperationKind kind, int tool, std::vector<Move> moves) {
    Operation op;
    op.kind = kind;
    op.purpose = "line";
    op.tool = tool;
    op.spindle_rpm = plan.job.tools[static_cast<std::size_t>(tool) - 1].max_rpm;
    op.moves = std::move(moves);
    return op;
}

std::vector<CutStretch> stretches(StandingSlab& slab, const Operation& op, const Tool& tool) {
    std::vector<CutStretch> all;
    slab.run(op, tool, [&](const CutStretch& s) { all.push_back(s); });
    return all;
}

TEST(OpCuts, SlotThenHalfThenAir) {
    Plan plan = plate();
    const Tool& flat = plan.job.tools[1];
    StandingSlab slab(plan.stock_min, plan.stock_max, 0, 18, 0.25);
    const double r = flat.diameter / 2;
    const auto pass = [&](double y, double z) {
        return line(plan, OperationKind::rough, 2,
                    {at(-10, y, 30, 0), at(-10, y, z, 0), at(130, y, z, 5000), at(130, y, 30, 0)});
    };
    int checked = 0;
    for (const CutStretch& s : stretches(slab, pass(40, 15), flat)) {
        if (s.at[0] < 10 || s.at[0] > 110) continue;
        EXPECT_NEAR(s.width, 2 * r, 0.3);
        EXPECT_NEAR(s.high - s.low, 3, 1e-5);
        ++checked;
    }
    EXPECT_GT(checked, 10);
    // The next pass half a diameter to the left meets half the width, on its left.
    for (const CutStretch& s : stretches(slab, pass(40 + r, 15), flat)) {
        if (s.at[0] < 10 || s.at[0] > 110) continue;
        EXPECT_NEAR(s.width, r, 0.3);
        EXPECT_TRUE(s.left);
    }
    for (const CutStretch& s : stretches(slab, pass(40, 15), flat)) EXPECT_FALSE(s.cuts());
    // And one to the right, on its right; deeper, everything again.
    for (const CutStretch& s : stretches(slab, pass(40 - r / 2, 15), flat))
        if (s.at[0] > 10 && s.at[0] < 110) {
            EXPECT_NEAR(s.width, r / 2, 0.3);
            EXPECT_FALSE(s.left);
        }
    for (const CutStretch& s : stretches(slab, pass(40, 13), flat))
        if (s.at[0] > 10 && s.at[0] < 110) {
            EXPECT_NEAR(s.high - s.low, 2, 1e-5);
        }
}

// Volumes add up: what the stretches tell is what is gone, for any path that does not end in the wood.
TEST(OpCuts, StretchesHoldWhatWasTakenAway) {
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> x(8, 112), y(8, 72), z(6, 17);
    Plan plan = plate();
    for (const int tool : {2, 3}) {
        const Tool& cutter = plan.job.tools[static_cast<std::size_t>(tool) - 1];
        StandingSlab slab(plan.stock_min, plan.stock_max, 0, 18, 0.2);
        std::vector<Move> moves{at(10, 10, 30, 0), at(10, 10, 19, 0)};
        for (int i = 0; i < 40; ++i) moves.push_back(at(x(random), y(random), z(random), 4000));
        const Operation op = line(plan, OperationKind::rough, tool, moves);
        double told = 0;
        for (const CutStretch& s : stretches(slab, op, cutter))
            if (s.cuts() && s.width < cutter.diameter) told += s.width * (s.high - s.low) * s.length;
        EXPECT_GT(told, 100);
        // Run again, nothing is left to take.
        for (const CutStretch& s : stretches(slab, op, cutter)) EXPECT_FALSE(s.cuts());
    }
}

// Of some moves alone: the very stretches that all of them tell there, with what else was cut before, near
// and far.
TEST(OpCuts, PartsTellWhatTheWholeTells) {
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> x(-5, 125), y(-5, 85), z(10, 17), step(-6, 6);
    Plan plan = plate();
    std::size_t compared = 0;
    for (int round = 0; round < 20; ++round) {
        const int tool = 2 + round % 2;
        const Tool& cutter = plan.job.tools[static_cast<std::size_t>(tool) - 1];
        std::vector<Move> moves{at(10, 10, 30, 0)};
        for (int cut = 0; cut < 25; ++cut) {
            double px = x(random), py = y(random), pz = z(random);
            moves.push_back(at(px, py, 30, 0));
            moves.push_back(at(px, py, pz, 1500));
            for (int k = 0; k < 30; ++k) {
                px += step(random), py += step(random);
                if (k % 10 == 9)
                    moves.push_back(at(px = x(random), py = y(random), pz, 4000));  // told in many parts
                moves.push_back(at(px, py, pz, k % 7 == 6 ? 3000 : 4000));
            }
            moves.push_back(at(px, py, 30, 0));
        }
        const Operation op = line(plan, OperationKind::rough, tool, moves);
        StandingSlab slab(plan.stock_min, plan.stock_max, 0, 18, 0.25);
        const StandingSlab before = slab;
        const std::vector<CutStretch> whole = stretches(slab, op, cutter);
        // Parts from the begin of a stretch to the end of another; no stretch is half within one.
        std::vector<MoveRange> parts;
        for (std::size_t i = 5; i + 10 < whole.size(); i += 3 + random() % (whole.size() / 4)) {
            MoveRange part{whole[i].first, whole[i + random() % 6].last};
            for (const CutStretch& s : whole)
                if (s.first <= part.last) part.last = std::max(part.last, s.last);
            if (whole[i - 1].last < part.first && (parts.empty() || parts.back().last < part.first))
                parts.push_back(part);
        }
        ASSERT_FALSE(parts.empty());
        StandingSlab again = before;
        std::vector<CutStretch> told;
        again.run_parts(op, cutter, parts, [&](const CutStretch& s) { told.push_back(s); });
        std::size_t next = 0;
        for (const CutStretch& s : whole) {
            if (std::none_of(parts.begin(), parts.end(),
                             [&](const MoveRange& p) { return s.first >= p.first && s.last <= p.last; }))
                continue;
            ASSERT_LT(next, told.size()) << "seed " << seed;
            const CutStretch& t = told[next++];
            EXPECT_EQ(std::tie(s.first, s.last, s.length, s.low, s.high, s.width, s.left, s.at),
                      std::tie(t.first, t.last, t.length, t.low, t.high, t.width, t.left, t.at))
                << "seed " << seed << " moves " << s.first << " to " << s.last;
            compared += s.cuts();
        }
        EXPECT_EQ(next, told.size());
    }
    EXPECT_GT(compared, 100U);
}

TEST(Feeds, AStiffCutterKeepsItsFeedAndAnElasticOneSlowsDown) {
    Plan plan = plate();
    plan.job.cutting.adapt_stepdown = false;
    const auto slot = [&](double y) {
        return line(plan, OperationKind::rough, 2,
                    {at(-10, y, 30, 0), at(-10, y, 14.2, 0), at(130, y, 14.2, 9000), at(130, y, 30, 0)});
    };
    Context context;
    std::vector<Diagnostic> diagnostics;
    plan.layers[0].operations = {slot(40)};
    rate_layer(context, plan.layers[0], plan, diagnostics);
    const Operation stiff = plan.layers[0].operations[0];
    EXPECT_TRUE(diagnostics.empty());
    EXPECT_EQ(stiff.moves[2].feed, 9000U);
    // As the kernel says for the slot, up to the class of depth.
    const CutForce exact = peak_force(slot_cut(plan.job, plan.job.tools[1], 3.8));
    EXPECT_GE(stiff.peak_force_n, exact.peak_resultant_n * 0.98);
    EXPECT_LE(stiff.peak_force_n, exact.peak_resultant_n * 1.12);
    ASSERT_TRUE(stiff.peak_at);
    EXPECT_NEAR((*stiff.peak_at)[1], 40, 1e-6);

    Job& job = plan.job;
    job.cutting.wall_allowance = job.cutting.floor_allowance = 0.06;
    job.tolerances.cusp = 0.01;
    job.tools[1].flute_length = job.tools[1].stickout = 118;
    plan.layers[0].operations = {slot(40)};
    rate_layer(context, plan.layers[0], plan, diagnostics);
    const Operation elastic = plan.layers[0].operations[0];
    ASSERT_EQ(diagnostics.size(), 1U);
    EXPECT_EQ(diagnostics[0].code, "feed.lowered");
    ASSERT_TRUE(diagnostics[0].where);
    EXPECT_LT(elastic.moves[2].feed, 9000U);
    EXPECT_LE(elastic.wall_error_mm, bending_limit(elastic, job));
    EXPECT_LT(elastic.peak_force_n, stiff.peak_force_n);

    // Off by the switch; then it bends too far, and is reported as that.
    diagnostics.clear();
    job.cutting.adapt_feed = false;
    plan.layers[0].operations = {slot(40)};
    rate_layer(context, plan.layers[0], plan, diagnostics);
    EXPECT_EQ(plan.layers[0].operations[0].moves[2].feed, 9000U);
    ASSERT_EQ(diagnostics.size(), 1U);
    EXPECT_EQ(diagnostics[0].code, "cut.deflection");

    // Too elastic for any feed.
    diagnostics.clear();
    job.cutting.adapt_feed = true;
    job.tools[1].stickout = 300;
    plan.layers[0].operations = {slot(40)};
    rate_layer(context, plan.layers[0], plan, diagnostics);
    ASSERT_EQ(diagnostics.size(), 2U);
    EXPECT_EQ(diagnostics[1].code, "cut.deflection");
    EXPECT_GE(plan.layers[0].operations[0].moves[2].feed, 9000U / 8);
}

TEST(Feeds, ThinChipsAndAirGoFasterAndThickOnesDoNot) {
    Plan plan = plate();
    Context context;
    std::vector<Diagnostic> diagnostics;
    const double r = plan.job.tools[1].diameter / 2;
    // A slot by roughing, then .3 mm off its wall by finishing, and a slot by finishing.
    plan.layers[0].operations = {
        line(plan, OperationKind::rough, 2,
             {at(-10, 30, 30, 0), at(-10, 30, 15, 0), at(130, 30, 15, 9000), at(130, 30, 30, 0)}),
        line(plan, OperationKind::finish, 2,
             {at(-10, 30.3, 30, 0), at(-10, 30.3, 15, 0), at(130, 30.3, 15, 5000), at(130, 30.3, 30, 0),
              at(-10, 30 + 3 * r, 30, 0), at(-10, 30 + 3 * r, 15, 0), at(130, 30 + 3 * r, 15, 5000),
              at(130, 30 + 3 * r, 30, 0)})};
    rate_layer(context, plan.layers[0], plan, diagnostics);
    const Operation& finish = plan.layers[0].operations[1];
    EXPECT_GT(finish.moves[2].feed, 5000U);
    EXPECT_LE(finish.moves[2].feed, 9000U);
    EXPECT_EQ(finish.moves[6].feed, 5000U);
    EXPECT_EQ(finish.moves[4].feed, 0U);
    for (const Operation& op : plan.layers[0].operations)
        EXPECT_LE(op.wall_error_mm, bending_limit(op, plan.job));
}

// Between rapids, a way too short to go faster keeps the feeds that were planned, each of its own.
TEST(Feeds, AShortWayBetweenRapidsGoesAsPlanned) {
    Plan plan = plate();
    Context context;
    std::vector<Diagnostic> diagnostics;
    plan.layers[0].operations = {line(plan, OperationKind::finish, 2,
                                      {at(-60, 40, 30, 0), at(-60, 40, 15, 0), at(-52, 40, 15, 3000),
                                       at(-44, 40, 15, 9000), at(-44, 40, 30, 0)})};
    rate_layer(context, plan.layers[0], plan, diagnostics);
    const std::vector<Move>& moves = plan.layers[0].operations[0].moves;
    ASSERT_EQ(moves.size(), 5U);
    EXPECT_EQ(moves[2].feed, 3000U);
    EXPECT_EQ(moves[3].feed, 9000U);
}

// Over random programs: no feed over tool and machine, few different ones, rapids and plunges as they were,
// the limit kept wherever the feed is above the floor, and the same bytes on any number of threads.
TEST(Feeds, RandomPrograms) {
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> x(-5, 125), y(-5, 85), z(4, 18), stickout(35, 120);
    for (int trial = 0; trial < 12; ++trial) {
        Plan plan = plate();
        plan.job.cutting.adapt_stepdown = false;
        for (Tool& t : plan.job.tools) t.stickout = stickout(random);
        std::vector<Operation> operations;
        for (int i = 0; i < 4; ++i) {
            const int tool = 2 + static_cast<int>(random() % 2);
            std::vector<Move> moves{at(0, 0, 30, 0)};
            for (int k = 0; k < 60; ++k) {
                const auto last = moves.back();
                switch (random() % 6) {
                    case 0:
                        moves.push_back({last.x, last.y, to_units(30), 0});
                        moves.push_back(at(x(random), y(random), 30, 0));
                        break;
                    case 1:
                        moves.push_back({last.x, last.y, to_units(z(random)), 1500});
                        break;
                    default:
                        moves.push_back(
                            at(x(random), y(random), last.z == to_units(30) ? 30 : to_mm(last.z), 5000));
                }
            }
            operations.push_back(line(plan,
                                      i == 0   ? OperationKind::rough
                                      : i == 1 ? OperationKind::semi_rough
                                               : OperationKind::finish,
                                      tool, moves));
        }
        plan.layers[0].operations = operations;
        Context one({.threads = 1}), two({.threads = 2});
        std::vector<Diagnostic> d1, d2;
        Layer other = plan.layers[0];
        rate_layer(one, plan.layers[0], plan, d1);
        rate_layer(two, other, plan, d2);
        EXPECT_EQ(d1, d2);
        for (std::size_t o = 0; o < operations.size(); ++o) {
            const Operation &before = operations[o], &after = plan.layers[0].operations[o];
            EXPECT_EQ(after.moves, other.operations[o].moves);
            EXPECT_EQ(after.peak_force_n, other.operations[o].peak_force_n);
            ASSERT_EQ(before.moves.size(), after.moves.size());
            std::set<std::uint32_t> feeds;
            double slowest = 1e9;
            for (std::size_t k = 1; k < before.moves.size(); ++k) {
                const Move &a = before.moves[k], &b = after.moves[k];
                EXPECT_EQ(std::tie(a.x, a.y, a.z), std::tie(b.x, b.y, b.z));
                const bool plunge = a.x == before.moves[k - 1].x && a.y == before.moves[k - 1].y;
                if (a.feed == 0 || plunge) {
                    EXPECT_EQ(a.feed, b.feed);
                } else {
                    EXPECT_GE(b.feed, 5000U / 8);
                    EXPECT_LE(b.feed, after.kind == OperationKind::rough ? 5000U : 9000U);
                    feeds.insert(b.feed);
                    slowest = std::min<double>(slowest, b.feed);
                }
            }
            EXPECT_LE(feeds.size(), static_cast<std::size_t>(kFeedSteps) + 1);
            // Too far only where the feed went as low as it may.
            if (after.wall_error_mm > bending_limit(after, plan.job)) {
                EXPECT_LE(slowest, 5000.0 / 8 + 9000.0 / kFeedSteps);
            }
        }
    }
}

// A slot too deep for an elastic cutter at any feed: in several passes it bends as far as it may, and leaves
// what it would have left.
TEST(Feeds, WhatIsTooDeepIsCutInPasses) {
    Plan plan = plate();
    Job& job = plan.job;
    job.cutting.wall_allowance = job.cutting.floor_allowance = 0.06;
    job.tolerances.cusp = 0.01;
    job.tools[1].stickout = 200;
    const Operation slot = line(plan, OperationKind::rough, 2,
                                {at(-10, 40, 30, 0), at(-10, 40, 13, 0), at(60, 40, 13, 9000),
                                 at(130, 40, 13, 9000), at(130, 40, 30, 0)});
    plan.layers[0].operations = {slot};
    Context context;
    std::vector<Diagnostic> diagnostics;
    rate_layer(context, plan.layers[0], plan, diagnostics);
    const Operation& op = plan.layers[0].operations[0];
    ASSERT_FALSE(diagnostics.empty());
    EXPECT_EQ(diagnostics[0].code, "stepdown.lowered");
    EXPECT_TRUE(diagnostics[0].where);
    for (const Diagnostic& d : diagnostics) EXPECT_NE(d.code, "cut.deflection") << d.message;
    EXPECT_GT(op.moves.size(), slot.moves.size());
    EXPECT_LE(op.wall_error_mm, bending_limit(op, job));
    EXPECT_GT(op.peak_force_n, 0);
    ASSERT_TRUE(op.peak_move);
    EXPECT_LT(*op.peak_move, op.moves.size());
    for (const Move& m : op.moves) EXPECT_GE(m.z, to_units(13));
    StandingSlab before(plan.stock_min, plan.stock_max, 0, 18, 0.25), after = before;
    (void)stretches(before, slot, job.tools[1]);
    (void)stretches(after, op, job.tools[1]);
    for (const CutStretch& s : stretches(after, slot, job.tools[1])) EXPECT_FALSE(s.cuts());
    for (const CutStretch& s : stretches(before, op, job.tools[1])) EXPECT_FALSE(s.cuts());
    // A cutter's strength is a limit as its bending is.
    job.cutting.wall_allowance = job.cutting.floor_allowance = 2;
    job.tools[1].strength_mpa = 12;
    plan.layers[0].operations = {slot};
    diagnostics.clear();
    rate_layer(context, plan.layers[0], plan, diagnostics);
    ASSERT_FALSE(diagnostics.empty());
    EXPECT_EQ(diagnostics[0].code, "stepdown.lowered");
    job.cutting.adapt_stepdown = job.cutting.adapt_feed = false;
    plan.layers[0].operations = {slot};
    diagnostics.clear();
    rate_layer(context, plan.layers[0], plan, diagnostics);
    ASSERT_EQ(diagnostics.size(), 1U);
    EXPECT_EQ(diagnostics[0].code, "cut.strength");
}

TEST(Feeds, RunsSplitOverArcsComeBackOnTheSameWay) {
    std::vector<Move> moves{at(0, 0, 30, 0), at(0, 0, 10, 1500), at(20, 0, 10, 5000)};
    Move arc = at(30, 10, 10, 4000);  // a quarter round (20, 10), against the clock
    arc.j = to_units(10);
    moves.push_back(arc);
    moves.push_back(at(30, 30, 10, 5000));
    moves.push_back(at(30, 30, 30, 0));
    const Passes run = passes_of({2, 4, 4, 3});
    const std::vector<Move> split = split_runs(moves, {&run, 1}, 1500, false).moves;
    ASSERT_EQ(split.size(), moves.size() + 2 * (1 + 3 + 3) + 1);
    EXPECT_EQ(split[2].z, to_units(10 + 4 * 2 / 3.0));
    for (std::size_t k = 1; k < split.size(); ++k) {
        const Move &a = split[k - 1], &b = split[k];
        if (!b.is_arc()) continue;
        const ArcShape shape = arc_shape(a, b);
        EXPECT_NEAR(shape.x, 20, 1e-4);
        EXPECT_NEAR(shape.y, 10, 1e-4);
        EXPECT_NEAR(shape.length(), 10 * std::numbers::pi / 2, 1e-3);
        EXPECT_EQ(a.z, b.z);
    }
    // From its beginning, at 10, the run itself.
    EXPECT_TRUE(std::equal(moves.begin() + 2, moves.end(), split.end() - 4));
}

// Whatever the way: passes lie straight above it, the way itself is the last, and between passes the cutter
// goes back only where it must.
TEST(Feeds, PassesGoThereAndBackOrRoundAndRound) {
    std::mt19937 random(test::seed());
    const auto any = [&](int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); };
    for (int trial = 0; trial < 200; ++trial) {
        const bool closed = any(0, 1) == 1, sloped = any(0, 3) == 0, by_turns = any(0, 1) == 1;
        const int length = any(2, 6), count = any(1, 5);
        std::vector<Move> moves{at(0, 0, 30, 0), at(0, 0, 10, 1500)};
        for (int k = 1; k <= length; ++k)
            moves.push_back(at(closed && k == length ? 0 : 10 * k,
                               any(1, 9) * (closed && k == length ? 0 : 1),
                               sloped && !(closed && k == length) ? 10 + 0.1 * k : 10, 4000));
        moves.push_back(at(90, 90, 30, 0));
        Passes run{2, static_cast<std::uint32_t>(length + 1), {}};
        for (int k = count; k > 0; --k) run.up.push_back(to_units(0.5 * k));
        const SplitMoves split = split_runs(moves, {&run, 1}, 1500, by_turns);
        ASSERT_EQ(split.runs.size(), 1U);
        ASSERT_EQ(split.runs[0].passes.size(), run.up.size());
        const bool turns = by_turns && !sloped;
        const auto n = static_cast<std::size_t>(length), passes = run.up.size();
        const std::size_t back = closed ? 0 : turns ? passes % 2 : passes;
        EXPECT_EQ(split.moves.size(), moves.size() + passes * (1 + n) + back * n + 1);
        EXPECT_EQ(split.runs[0].all.first, 2U);
        EXPECT_EQ(split.runs[0].all.last + 2, split.moves.size());
        EXPECT_TRUE(std::equal(moves.begin() + 2, moves.end(), split.moves.end() - static_cast<int>(n) - 1));
        for (std::size_t p = 0; p < passes; ++p) {
            const MoveRange& pass = split.runs[0].passes[p];
            ASSERT_EQ(pass.last - pass.first + 1, n);
            // Its corners, in either sense, begin included.
            std::vector<Move> corners(split.moves.begin() + pass.first - 1,
                                      split.moves.begin() + pass.last + 1);
            if (!closed && turns && p % 2 == 1) std::reverse(corners.begin(), corners.end());
            for (std::size_t k = 0; k <= n; ++k) {
                EXPECT_EQ(corners[k].x, moves[k + 1].x);
                EXPECT_EQ(corners[k].y, moves[k + 1].y);
                EXPECT_EQ(corners[k].z, moves[k + 1].z + run.up[p]);
            }
        }
        // Sideways nothing goes but along the way.
        for (std::size_t k = 2; k < split.moves.size() - 1; ++k) {
            const Move &a = split.moves[k - 1], &b = split.moves[k];
            if (a.x == b.x && a.y == b.y) continue;
            const auto corner = [&](const Move& m) {
                for (std::size_t c = 1; c <= n + 1; ++c)
                    if (moves[c].x == m.x && moves[c].y == m.y) return static_cast<int>(c);
                return -1;
            };
            const int apart = std::abs(corner(a) - corner(b));
            EXPECT_TRUE(apart == 1 || (closed && apart == length - 1))
                << "from " << corner(a) << " to " << corner(b);
        }
    }
}

// Straight down beside what is cleared: where a strip is met on the way, at the plunge's feed, else as fast
// as planned; whether feeds are adapted or not.
TEST(Feeds, WhatIsMetStraightDownIsPlungedInto) {
    for (const bool adapt : {true, false}) {
        Plan plan = plate();
        plan.job.cutting.adapt_feed = adapt;
        const Tool& flat = plan.job.tools[1];
        const double r = flat.diameter / 2;
        std::vector<Move> moves{at(-20, 40, 30, 0), at(-20, 40, 12, 0), at(60, 40, 12, 9000),
                                at(60, 40, 30, 0)};
        std::vector<std::pair<std::size_t, bool>> down;  // moves, and whether they meet something
        for (const double beside : {0.0, 0.9, -0.9, r}) {
            moves.push_back(at(30 + beside, 40 + beside, 19, 0));
            down.emplace_back(moves.size(), beside != 0);
            moves.push_back(at(30 + beside, 40 + beside, 12, 9000));
            moves.push_back(at(30 + beside, 40 + beside, 30, 0));
        }
        plan.layers[0].operations = {line(plan, OperationKind::rough, 2, moves)};
        std::vector<Diagnostic> diagnostics;
        Context context;
        (void)adapt_layer(context, plan.layers[0], plan, {}, diagnostics);
        const std::vector<Move>& after = plan.layers[0].operations[0].moves;
        std::size_t found = 0;
        for (std::size_t k = 1; k < after.size(); ++k)
            for (const auto& [before, meets] : down)
                if (after[k].feed > 0 && after[k].z < after[k - 1].z && after[k].x == moves[before].x &&
                    after[k].y == moves[before].y) {
                    EXPECT_EQ(after[k].feed, meets ? static_cast<std::uint32_t>(flat.plunge_feed) : 9000U)
                        << "at x " << to_mm(after[k].x) << (adapt ? ", adapted" : "");
                    ++found;
                }
        EXPECT_EQ(found, down.size());
    }
}

// Wood that hangs over: cut where it stands on something it needs nothing; far out, a web thinner than
// section 9 asks for is reported.
TEST(Feeds, WoodThatHangsOverTooFarIsReported) {
    Plan plan = plate();
    plan.job.cutting.adapt_feed = plan.job.cutting.adapt_stepdown = false;
    OverhangMap map;
    map.low = {0, 0}, map.cell = 1, map.nx = 120, map.ny = 80, map.mm.assign(120 * 80, 0);
    Context context;
    const auto codes = [&](double bottom) {
        plan.layers[0].operations = {
            line(plan, OperationKind::rough, 2,
                 {at(-10, 40, 30, 0), at(-10, 40, bottom + 3, 0), at(130, 40, bottom + 3, 9000),
                  at(130, 40, bottom + 3, 0), at(130, 40, 30, 0), at(-10, 40, 30, 0), at(-10, 40, bottom, 0),
                  at(130, 40, bottom, 9000), at(130, 40, 30, 0)})};
        std::vector<Diagnostic> diagnostics;
        (void)adapt_layer(context, plan.layers[0], plan, {&map, nullptr}, diagnostics);
        std::vector<std::string> found;
        for (const Diagnostic& d : diagnostics) found.push_back(d.code);
        return found;
    };
    EXPECT_TRUE(codes(0).empty());
    std::fill(map.mm.begin(), map.mm.end(), 10.0F);
    EXPECT_TRUE(codes(0).empty());
    std::fill(map.mm.begin(), map.mm.end(), 100.0F);
    EXPECT_EQ(codes(0), std::vector<std::string>{"cut.overhang"});
    EXPECT_GT(least_material(plan.job, 100), 3.0);  // as the layer planner has it
    EXPECT_TRUE(codes(10).empty());                 // ten millimetres under the cut carry it
}

// What a pass leaves of a slab that is thinner than any step is no slab that could break, also under a tool
// whose range of steps begins at nothing.
TEST(Feeds, SliversAreNoSlab) {
    for (const double least : {0.0, 2.0}) {
        Plan plan = plate();
        plan.job.cutting.adapt_feed = plan.job.cutting.adapt_stepdown = false;
        plan.job.tools[1].stepdown_min = least;
        OverhangMap map;
        map.low = {0, 0}, map.cell = 1, map.nx = 120, map.ny = 80, map.mm.assign(120 * 80, 100.0F);
        Context context;
        for (const double sliver : {0.0, 0.004, 0.3, 3.0}) {
            const auto slot = [&](double z) {
                return line(
                    plan, OperationKind::rough, 2,
                    {at(-10, 40, 30, 0), at(-10, 40, z, 0), at(130, 40, z, 9000), at(130, 40, 30, 0)});
            };
            plan.layers[0].operations = {slot(sliver), slot(-1)};
            plan.layers[0].operations[1].purpose = "through";
            std::vector<Diagnostic> diagnostics;
            (void)adapt_layer(context, plan.layers[0], plan, {&map, nullptr}, diagnostics);
            const auto breaks =
                std::count_if(diagnostics.begin(), diagnostics.end(), [](const Diagnostic& d) {
                    return d.code == "cut.overhang" && d.message.find("through") != std::string::npos;
                });
            EXPECT_EQ(breaks, sliver > 2 ? 1 : 0)
                << sliver << " mm under a tool of at least " << least << " mm";
            for (const Diagnostic& d : diagnostics)
                EXPECT_EQ(d.message.find("nan"), std::string::npos) << d.message;
        }
    }
}

// Wood is cut in several passes where they save it, and only there: farther out, where it breaks all the
// same, the way stays as it was.
TEST(Feeds, PassesForWoodThatTheySave) {
    Plan plan = plate();
    plan.job.cutting.adapt_feed = false;
    OverhangMap map;
    map.low = {0, 0}, map.cell = 1, map.nx = 120, map.ny = 80;
    const Operation slot =
        line(plan, OperationKind::rough, 2,
             {at(-10, 40, 30, 0), at(-10, 40, 4, 0), at(130, 40, 4, 9000), at(130, 40, 30, 0)});
    Context context;
    int saved = 0, lost = 0, held = 0;
    for (int beyond = 0; beyond <= 400; beyond += 10) {
        map.mm.assign(120 * 80, static_cast<float>(beyond));
        plan.layers[0].z_top = plan.layers[0].slab_thickness = 12;
        plan.layers[0].operations = {slot};
        std::vector<Diagnostic> diagnostics;
        (void)adapt_layer(context, plan.layers[0], plan, {&map, nullptr}, diagnostics);
        const auto has = [&](const char* code) {
            return std::any_of(diagnostics.begin(), diagnostics.end(),
                               [&](const Diagnostic& d) { return d.code == code; });
        };
        const bool split = plan.layers[0].operations[0].moves.size() > slot.moves.size();
        EXPECT_EQ(split, has("stepdown.lowered")) << beyond;
        EXPECT_FALSE(split && has("cut.overhang")) << beyond;
        (split ? saved : has("cut.overhang") ? lost : held) += 1;
    }
    EXPECT_GT(held, 0);
    EXPECT_GT(saved, 0);
    EXPECT_GT(lost, 0);
}

// In a whole plan: the paths stay as they are, the build takes no longer, and nominal engagement leaves feeds
// and places alone.
TEST(Feeds, OfAWholePlan) {
    Context context;
    const Mesh mesh = test::height_field(context, 12, 5.0, [](double x, double y) {
        return std::max(std::abs(x), std::abs(y)) < 16 ? 14.0 : 6.0;
    });
    Job job;
    const Plan adapted = make_plan(context, mesh, {}, job);
    job.cutting.adapt_feed = false;
    const Plan planned = make_plan(context, mesh, {}, job);
    job.cutting.engagement = Engagement::nominal;
    const Plan nominal = make_plan(context, mesh, {}, job);
    ASSERT_EQ(adapted.layers.size(), planned.layers.size());
    int faster = 0;
    for (std::size_t l = 0; l < planned.layers.size(); ++l) {
        ASSERT_EQ(adapted.layers[l].operations.size(), planned.layers[l].operations.size());
        for (std::size_t o = 0; o < planned.layers[l].operations.size(); ++o) {
            const Operation &a = adapted.layers[l].operations[o], &p = planned.layers[l].operations[o],
                            &n = nominal.layers[l].operations[o];
            EXPECT_EQ(p.moves, n.moves);
            EXPECT_GT(n.peak_force_n, 0);
            EXPECT_FALSE(n.peak_at);
            EXPECT_EQ(p.peak_at.has_value(), p.peak_force_n > 0);
            EXPECT_LE(p.wall_error_mm, p.deflection_mm);
            ASSERT_EQ(a.moves.size(), p.moves.size());
            for (std::size_t k = 0; k < p.moves.size(); ++k) {
                Move as_planned = a.moves[k];
                faster += as_planned.feed > p.moves[k].feed;
                as_planned.feed = p.moves[k].feed;
                EXPECT_EQ(as_planned, p.moves[k]);
                EXPECT_EQ(a.moves[k].feed == 0, p.moves[k].feed == 0);
            }
        }
    }
    EXPECT_GT(faster, 0);
    EXPECT_LT(adapted.totals.build_minutes, planned.totals.build_minutes);
    EXPECT_EQ(planned.totals.build_minutes, nominal.totals.build_minutes);
}

TEST(Feeds, AnOperationMayBendItsCutterByWhatItLeaves) {
    const Job job;  // allowances of 0.3 mm, a cusp of 0.05
    Operation op;
    op.kind = OperationKind::rough;
    EXPECT_DOUBLE_EQ(bending_limit(op, job), 0.3 - rough_fit(job.cutting));
    op.blend = 0.1;
    EXPECT_DOUBLE_EQ(bending_limit(op, job), 0.3 - (0.1 - kJunction) - 0.02);
    op.kind = OperationKind::semi_rough;
    EXPECT_DOUBLE_EQ(bending_limit(op, job), job.tolerances.cusp)
        << "one that leaves nothing bends as little as a finish pass";
    op.spare = 0.1;
    EXPECT_DOUBLE_EQ(bending_limit(op, job), 0.1);
    op.kind = OperationKind::finish;
    EXPECT_DOUBLE_EQ(bending_limit(op, job), job.tolerances.cusp);
}

// A ball that takes a layer off a high wall cuts with its side, high over its tip: passes that are raised by
// thinner and thinner shells would leave the highest of them all of that.
TEST(Feeds, PassesForACutHighOverTheTip) {
    Plan plan = plate();
    plan.job.tools[2].flute_length = plan.job.tools[2].stickout = 46;
    const Tool &flat = plan.job.tools[1], &ball = plan.job.tools[2];
    Context context;
    int passes = 0, over = 0;
    for (double width = 0.2; width < 1.7; width += 0.1)
        for (const double tip : {1.0, 4.0, 8.0}) {
            // A step at y = 40, which the flat leaves.
            std::vector<Move> clear{at(-20, 20, 30, 0)};
            for (double y = 0; y < 40 - flat.diameter / 2; y += 3) {
                clear.push_back(at(-20, y, 30, 0));
                clear.push_back(at(-20, y, tip, 0));
                clear.push_back(at(140, y, tip, 3000));
                clear.push_back(at(140, y, 30, 0));
            }
            const double along = 40 - flat.diameter / 2, beside = 40 - ball.diameter / 2 + width;
            for (const Move& m : {at(-20, along, 30, 0), at(-20, along, tip, 0), at(140, along, tip, 3000),
                                  at(140, along, 30, 0)})
                clear.push_back(m);
            Operation finish = line(plan, OperationKind::finish, 3,
                                    {at(-20, beside, 30, 0), at(-20, beside, tip, 0),
                                     at(140, beside, tip, 4000), at(140, beside, 30, 0)});
            plan.layers[0].operations = {line(plan, OperationKind::rough, 2, clear), finish};
            std::vector<Diagnostic> diagnostics;
            (void)adapt_layer(context, plan.layers[0], plan, {}, diagnostics);
            StandingSlab slab(plan.stock_min, plan.stock_max, 0, 18,
                              StandingSlab::cell_for(plan.job, plan.stock_min, plan.stock_max));
            (void)stretches(slab, plan.layers[0].operations[0], flat);
            const Operation& op = plan.layers[0].operations[1];
            passes += op.moves.size() > finish.moves.size() ? 1 : 0;
            double worst = 0;
            for (const CutStretch& s : stretches(slab, op, ball)) {
                if (!s.cuts()) continue;
                const SegmentForces f = reference_forces(cut_of(s, ball, plan.job, op.moves[s.last].feed));
                worst = std::max(worst, cutter_deflection(f.peak_y_n, ball.stickout, ball.diameter));
            }
            EXPECT_LE(worst, 1.12 * bending_limit(op, plan.job)) << width << " mm wide, from " << tip;
            over += worst > 1.02 * bending_limit(op, plan.job) ? 1 : 0;
        }
    EXPECT_GT(passes, 5);
    EXPECT_LE(over, 8) << "of 45";  // by shells alone 21
}

}  // namespace
}  // namespace slabwright
