// The build on the machine: table, programs' zero, spindle and feed chamber stay within their travels at
// every step, or the plan is refused with layer, height and limit.
#include "engine/schedule/heights.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "engine/schedule/schedule.h"
#include "kernels/errors.h"
#include "tests/support/seed.h"

using namespace slabwright;

namespace {

Operation operation(OperationKind kind, int tool, double low, double high) {
    Operation op;
    op.kind = kind;
    op.tool = tool;
    op.clearance_z = high;
    op.moves = {{0, 0, to_units(high), 0}, {0, 0, to_units(low), 1000}, {0, 0, to_units(high), 0}};
    return op;
}

/// A layer that the default tools cut with overrun below and clearance above.
Layer layer_at(int index, double bottom, double height, double slab, int slabs, const Job& job) {
    Layer layer;
    layer.index = index;
    layer.z_bottom = bottom;
    layer.z_top = bottom + height;
    layer.slab_thickness = slab * slabs;
    layer.slabs = slabs;
    layer.joints.resize(static_cast<std::size_t>(slabs));
    const double clear = bottom + slab * slabs + job.machine.clearance;
    layer.operations = {operation(OperationKind::face, 1, layer.z_top, clear),
                        operation(OperationKind::rough, 2, bottom, clear),
                        operation(OperationKind::finish, 3, bottom - 3, clear)};
    return layer;
}

Plan tower(double height, const Job& job) {
    Plan plan;
    plan.job = job;
    plan.stock_min = {0, 0};
    plan.stock_max = {200, 100};
    for (int i = 0; 18.5 * i < height; ++i)
        plan.layers.push_back(layer_at(i + 1, 18.5 * i, std::min(18.5, height - 18.5 * i), 19, 1, job));
    return plan;
}

std::string refusal_of(const Plan& plan) {
    try {
        check_chambers(plan);
        check_spindle(plan);
    } catch (const Error& e) {
        EXPECT_EQ(e.kind(), ErrorKind::no_plan);
        EXPECT_FALSE(e.remedy().empty());
        EXPECT_NE(e.place().find("layer "), std::string::npos);
        return e.code();
    }
    return {};
}

double number(const SequenceStep& step, const std::string& key) {
    for (const auto& [k, v] : step.numbers)
        if (k == key) return v;
    ADD_FAILURE() << step.action << " has no " << key;
    return NAN;
}

double stickout(const Job& job, int tool) {
    for (const Tool& t : job.tools)
        if (t.number == tool) return t.stickout;
    return NAN;
}

/// What the machine's axes do when the sequence is walked from its first step to its last.
struct Walked {
    double spindle_low = INFINITY, spindle_high = -INFINITY;  // holder's nose
    double deepest = 0;                                       // table under the plane of the layers' tops
    double feed_height = 0, feed_mass = 0;                    // most at a time
    int by_hand = 0;                                          // slabs taken from an empty chamber
    double handler_low = 0, handler_high = 0;                 // from the feed chamber's middle
    double pump = 0;                                          // g/min at most
};

Walked walk(const Plan& plan) {
    Walked w;
    double offset = 0;
    int in_feed = 0;
    std::map<int, double> tops;
    for (const Layer& layer : plan.layers) tops[layer.index] = layer.z_top;
    for (const SequenceStep& step : plan.sequence) {
        for (const auto& [key, value] : step.numbers) {
            if (key == "pump_g_min") w.pump = std::max(w.pump, value);
            if (key != "handler_mm") continue;
            w.handler_low = std::min(w.handler_low, value);
            w.handler_high = std::max(w.handler_high, value);
        }
        if (step.action == "load_feed") {
            EXPECT_EQ(in_feed, 0) << "the chamber is loaded when it is empty";
            in_feed = static_cast<int>(number(step, "slabs"));
            w.feed_height = std::max(w.feed_height, number(step, "height_mm"));
            w.feed_mass = std::max(w.feed_mass, number(step, "mass_kg"));
        } else if (step.action == "take_slab") {
            if (in_feed == 0) ++w.by_hand;
            else --in_feed;
        } else if (step.action == "table") {
            offset = number(step, "work_offset_z_mm");
            const double origin = frame_of(plan.job.machine) == Frame::layer_top ? tops[step.layer] : 0;
            const double table = number(step, "table_height_mm");
            // The programs' zero, the board and the table say where the pattern's bottom is: they agree.
            EXPECT_NEAR(offset - origin, table + plan.job.machine.base_board_thickness, 1e-9);
            w.deepest = std::max(w.deepest, tops[step.layer] + offset - origin - table);
        } else if (step.action == "face" || step.action == "mill") {
            const double up = offset + stickout(plan.job, static_cast<int>(number(step, "tool")));
            w.spindle_low = std::min(w.spindle_low, up + number(step, "z_low_mm"));
            w.spindle_high = std::max(w.spindle_high, up + number(step, "z_high_mm"));
        }
    }
    EXPECT_EQ(in_feed, 0);
    // Where the handler stands as each bead begins and ends over the head.
    const double head = handler_way(plan.job.machine) / 2,
                 middle = (plan.stock_min[0] + plan.stock_max[0]) / 2;
    if (glue_head_of(plan.job.machine) == GlueHead::slab)
        for (const Layer& layer : plan.layers)
            for (const Joint& joint : layer.joints)
                for (const GlueRun& bead : joint.beads)
                    for (const std::int32_t x : {bead.from, bead.to}) {
                        w.handler_low = std::min(w.handler_low, head + middle - to_mm(x));
                        w.handler_high = std::max(w.handler_high, head + middle - to_mm(x));
                    }
    return w;
}

}  // namespace

TEST(Heights, ATallPatternNeedsTheTravelOfOneLayerWhereTheTableMoves) {
    for (const Frame frame : {Frame::automatic, Frame::pattern_base, Frame::layer_top}) {
        Job job;
        job.machine.frame = frame;
        Plan plan = tower(300, job);
        EXPECT_EQ(refusal_of(plan), "");
        schedule(plan);
        const Walked w = walk(plan);
        EXPECT_LE(w.spindle_high - w.spindle_low, 70) << "a layer, its clearance and the tools' differences";
        EXPECT_NEAR(w.deepest, 319, 1e-9);
        EXPECT_NEAR(plan.totals.table_minutes, (300 - 18.5) / job.machine.table_speed, 1e-9);
        EXPECT_EQ(w.by_hand, 0);
    }
}

TEST(Heights, TheDefaultFrameSuitsTheTable) {
    Job job;
    EXPECT_EQ(frame_of(job.machine), Frame::layer_top);
    job.machine.table = BuildTable::fixed;
    EXPECT_EQ(frame_of(job.machine), Frame::pattern_base);
    job.machine.frame = Frame::layer_top;
    EXPECT_EQ(frame_of(job.machine), Frame::layer_top);
}

TEST(Heights, AFixedTableNeedsTheTravelOfTheWholeBuild) {
    for (const Frame frame : {Frame::automatic, Frame::layer_top}) {
        Job job;
        job.machine.frame = frame;
        job.machine.table = BuildTable::fixed;
        EXPECT_EQ(refusal_of(tower(100, job)), "");
        EXPECT_EQ(refusal_of(tower(300, job)), "machine.travel_z");
        job.machine.travel_z = 350;
        EXPECT_EQ(refusal_of(tower(300, job)), "");
        Plan plan = tower(300, job);
        schedule(plan);
        EXPECT_EQ(plan.totals.table_minutes, 0);
        for (const SequenceStep& step : plan.sequence)
            if (step.action == "table") {
                EXPECT_EQ(number(step, "table_height_mm"), frame == Frame::layer_top ? -37.5 : -19);
            }
    }
}

TEST(Heights, ToolsOfUnlikeLengthTakeTravelOfTheirOwn) {
    Job job;
    job.machine.travel_z = 60;
    EXPECT_EQ(refusal_of(tower(100, job)), "");
    job.tools[0].stickout = 100;  // the face mill's holder goes as much higher
    EXPECT_EQ(refusal_of(tower(100, job)), "machine.travel_z");
}

TEST(Heights, TheChamberHoldsBoardAndStack) {
    const Job job;
    EXPECT_EQ(refusal_of(tower(1181, job)), "");
    EXPECT_EQ(refusal_of(tower(1181.1, job)), "machine.build_height");
}

TEST(Heights, TheFeedChamberIsFilledAgainWhenItIsEmpty) {
    Job job;
    job.machine.feed_height = 60;
    Plan plan = tower(150, job);  // nine slabs
    schedule(plan);
    EXPECT_EQ(feed_loads(plan), (std::vector<int>{3, 3, 3}));
    EXPECT_EQ(walk(plan).feed_height, 57);
    job.machine.feed_height = 1200;
    job.machine.feed_mass_kg = 0.6;  // a slab weighs .285 kg
    EXPECT_EQ(feed_loads(tower(150, job)), (std::vector<int>{2, 2, 2, 2, 1}));
    job.machine.feed_mass_kg = 0.2;
    EXPECT_EQ(refusal_of(tower(150, job)), "machine.feed_mass");
    job.machine.feed_height = 18;
    EXPECT_EQ(refusal_of(tower(150, job)), "machine.feed_height");
    job.machine.feed_height = 0;
    Plan by_hand = tower(150, job);
    EXPECT_EQ(refusal_of(by_hand), "");
    schedule(by_hand);
    EXPECT_EQ(walk(by_hand).by_hand, 9);
}

// Random machines, slabs, tools and layers: what is not refused stays within every travel at every step, and
// what is refused would not.
TEST(Heights, EveryAxisStaysWithinItsTravelOrThePlanIsRefused) {
    std::mt19937 random(test::seed());
    const auto pick = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    std::map<std::string, int> seen;
    for (int round = 0; round < 2000; ++round) {
        Job job;
        job.machine.table = random() % 2 ? BuildTable::moving : BuildTable::fixed;
        job.machine.frame = static_cast<Frame>(random() % 3);
        job.machine.travel_z = pick(40, 300);
        job.machine.build_height = pick(60, 500);
        job.machine.base_board_thickness = pick(0, 40);
        job.machine.feed_height = random() % 4 == 0 ? 0 : pick(20, 400);
        job.machine.feed_mass_kg = pick(0.3, 20);
        job.machine.clearance = pick(1, 20);
        job.machine.handler_travel = pick(120, 400);
        job.machine.pump_g_min = pick(1, 60);
        job.machine.glue_head = random() % 4 == 0 ? GlueHead::stack : GlueHead::automatic;
        for (Tool& tool : job.tools) tool.stickout = pick(30, 90);
        Plan plan;
        plan.job = job;
        plan.stock_min = {0, 0};
        plan.stock_max = {200, 100};
        double bottom = 0;
        for (int i = 1, n = 1 + static_cast<int>(random() % 12); i <= n; ++i) {
            const double slab = pick(6, 30);
            const int slabs = random() % 5 == 0 ? 2 : 1;
            const double height = slab * slabs - pick(0.1, 5);
            plan.layers.push_back(layer_at(i, bottom, height, slab, slabs, job));
            for (int k = 0; k < slabs; ++k) {
                Joint& joint = plan.layers.back().joints.at(static_cast<std::size_t>(k));
                const std::int32_t left = to_units(pick(0, 80)), right = to_units(pick(100, 200));
                joint.glue.points = {{left, 100}, {right, 100}, {right, 900'000}, {left, 900'000}};
                joint.glue.close_loop();
            }
            bottom += height;
        }
        const std::string refused = refusal_of(plan);
        ++seen[refused];
        if (refused == "machine.feed_height" || refused == "machine.feed_mass") {
            EXPECT_TRUE(std::any_of(plan.layers.begin(), plan.layers.end(), [&](const Layer& l) {
                const double slab = l.slab_thickness / l.slabs;
                return slab > job.machine.feed_height || slab * 200 * 100 * 750e-9 > job.machine.feed_mass_kg;
            })) << round;
            continue;
        }
        if (refused == "machine.handler_travel") {
            EXPECT_EQ(glue_head_of(job.machine), GlueHead::slab);
            EXPECT_LT(job.machine.handler_travel, 200);
            continue;
        }
        if (!refused.empty()) plan.job.machine.feed_height = 0;  // so that it can be scheduled at all
        schedule(plan);
        const Walked w = walk(plan);
        const double spindle = w.spindle_high - w.spindle_low;
        if (refused == "machine.travel_z") {
            EXPECT_GT(spindle, job.machine.travel_z) << round;
        } else if (refused == "machine.build_height") {
            EXPECT_EQ(job.machine.table, BuildTable::moving);
            EXPECT_GT(w.deepest, job.machine.build_height) << round;
        } else {
            ASSERT_EQ(refused, "");
            EXPECT_LE(spindle, job.machine.travel_z + 1e-3) << round;
            if (job.machine.table == BuildTable::moving) {
                EXPECT_LE(w.deepest, job.machine.build_height + 1e-3) << round;
            }
            EXPECT_LE(w.feed_height, job.machine.feed_height + 1e-3) << round;
            EXPECT_LE(w.feed_mass, job.machine.feed_mass_kg + 1e-9) << round;
            EXPECT_GE(w.handler_low, 0) << round;
            EXPECT_LE(w.handler_high, job.machine.handler_travel + 1e-9) << round;
            EXPECT_LE(w.pump, job.machine.pump_g_min + 1e-9) << round;
            if (has_handler(job.machine)) {
                EXPECT_NEAR(w.handler_high, job.machine.handler_travel, 1e-9) << "over the table";
            }
            if (glue_head_of(job.machine) != GlueHead::none) {
                EXPECT_GT(w.pump, 0) << round;
            }
        }
    }
    for (const auto& [code, count] : seen)
        std::printf("%s: %d\n", code.empty() ? "planned" : code.c_str(), count);
    EXPECT_GE(seen[""], 100);
    EXPECT_GE(seen["machine.travel_z"], 100);
    EXPECT_GE(seen["machine.build_height"], 100);
    EXPECT_GE(seen["machine.handler_travel"], 50);
}
