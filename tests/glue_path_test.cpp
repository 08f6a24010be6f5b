// The glue head's way against brute force: every row of every joint, point by point.
#include "engine/schedule/glue_path.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "kernels/errors.h"
#include "kernels/polygons/loops.h"
#include "tests/support/seed.h"

using namespace slabwright;

namespace {

Plan stock_of(GlueHead head) {
    Plan plan;
    plan.stock_min = {-30, -17};
    plan.stock_max = {230, 163};
    plan.job.machine.glue_head = head;
    return plan;
}

/// Boxes, and stars with holes, some of them over one another.
Loops random_glue(std::mt19937& random) {
    const auto draw = [&](double low, double high) {
        return std::uniform_real_distribution(low, high)(random);
    };
    Loops drawn;
    for (int k = 0, n = 1 + static_cast<int>(random() % 4); k < n; ++k) {
        const double x = draw(20, 180), y = draw(20, 120), outer = draw(2, 40);
        const int corners = 3 + static_cast<int>(random() % 20);
        for (int c = 0; c < corners; ++c) {
            const double angle = 2 * M_PI * c / corners, r = outer * draw(0.4, 1);
            drawn.points.push_back({to_units(x + r * std::cos(angle)), to_units(y + r * std::sin(angle))});
        }
        drawn.close_loop();
    }
    return unite(drawn, Loops{});
}

double total(const std::vector<GlueRun>& beads) {
    double mm = 0;
    for (const GlueRun& b : beads) mm += std::abs(to_mm(std::int64_t{b.to} - b.from));
    return mm;
}

}  // namespace

TEST(GluePath, BeadsLieOnTheGlueAndLeaveNothingOfItsRows) {
    std::mt19937 random(test::seed());
    for (int round = 0; round < 200; ++round) {
        Plan plan = stock_of(random() % 2 ? GlueHead::slab : GlueHead::stack);
        plan.job.machine.glue_pitch = 1 + static_cast<double>(random() % 9);
        const Loops glue = random_glue(random);
        const std::vector<GlueRun> beads = glue_beads(plan, glue);
        const double pitch = plan.job.machine.glue_pitch;
        double expected = 0;  // in steps of .05 mm along each row
        int ends = 0;
        for (int row = 0; row * pitch < 180; ++row) {
            const std::int32_t y = to_units(-17 + (row + 0.5) * pitch);
            int run = 0;
            for (std::int32_t x = -300'000; x <= 2'300'000; x += 500) {
                const bool inside = winding(glue, {x, y}) > 0;
                if (inside) ++run;
                if (inside || run == 0) continue;
                ends += 2;
                if (run * 0.05 > 1.1) expected += run * 0.05;
                run = 0;
            }
        }
        EXPECT_NEAR(total(beads), expected, 0.06 * ends + 1.2 * ends / 8.0 + 0.1) << round;
        for (const GlueRun& b : beads) {
            const double rows = (to_mm(b.y) + 17) / pitch - 0.5;
            EXPECT_NEAR(rows, std::round(rows), 1e-3);
            const auto [low, high] = std::minmax(b.from, b.to);
            EXPECT_GE(high - low, 1 * kUnitsPerMm);
            for (int k = 1; k < 20; ++k)
                EXPECT_GT(
                    winding(glue, {low + static_cast<std::int32_t>(std::int64_t{high - low} * k / 20), b.y}),
                    0)
                    << round;
        }
    }
}

TEST(GluePath, AHeadUnderTheWayLaysAllRowsInOnePass) {
    Plan plan = stock_of(GlueHead::slab);
    Machine& machine = plan.job.machine;
    machine.handler_travel = 1000, machine.handler_speed = 6000, machine.glue_speed = 3000,
    machine.pump_g_min = 0;
    plan.job.bonding.glue_g_per_m2 = 120;
    Loops glue;  // 100 x 50 mm, ten rows of 5 mm
    for (const auto& [x, y] : {std::pair{0, 3}, {100, 3}, {100, 53}, {0, 53}})
        glue.points.push_back({to_units(x), to_units(y)});
    glue.close_loop();
    const std::vector<GlueRun> beads = glue_beads(plan, glue);
    ASSERT_EQ(beads.size(), 10u);
    for (const GlueRun& b : beads) EXPECT_EQ(b.from, to_units(100)) << "what comes first to the table";
    const GluePass pass = glue_pass(plan, beads);
    EXPECT_NEAR(pass.bead_mm, 1000, 1e-9);
    EXPECT_NEAR(pass.grams, 120 * 0.005, 1e-9) << "the glue of 50 cm2";
    EXPECT_NEAR(pass.pump_g_min, 120 * 0.050 * 3, 1e-9) << "50 mm wide at 3 m/min";
    // The stock's middle is x = 100.
    EXPECT_NEAR(pass.handler_begin, 500, 1e-9);
    EXPECT_NEAR(pass.handler_end, 600, 1e-9);
    EXPECT_NEAR(pass.seconds, 5 + 2, 1e-9);
    machine.pump_g_min = 9;
    const GluePass slow = glue_pass(plan, beads);
    EXPECT_NEAR(slow.speed, 1500, 1e-9) << "half as fast as the pump would have to be";
    EXPECT_NEAR(slow.pump_g_min, 9, 1e-9);
    EXPECT_NEAR(slow.seconds, 5 + 4, 1e-9);
}

TEST(GluePath, AHeadBesideTheSpindleGoesToAndFro) {
    Plan plan = stock_of(GlueHead::stack);
    plan.job.machine.glue_speed = 3000, plan.job.machine.rapid_feed = 12000;
    Loops glue;
    for (const auto& [x, y] : {std::pair{0, 3}, {100, 3}, {100, 53}, {0, 53}})
        glue.points.push_back({to_units(x), to_units(y)});
    glue.close_loop();
    const std::vector<GlueRun> beads = glue_beads(plan, glue);
    ASSERT_EQ(beads.size(), 10u);
    for (std::size_t i = 1; i < beads.size(); ++i) EXPECT_EQ(beads[i].from, beads[i - 1].to);
    const GluePass pass = glue_pass(plan, beads);
    EXPECT_NEAR(pass.seconds, 1000 / 50.0 + 9 * 5 / 200.0, 1e-9);
    EXPECT_NEAR(pass.pump_g_min, 100 * 0.005 * 3, 1e-9);
}

TEST(GluePath, WhatLiesBetweenTheRowsIsTold) {
    Plan plan = stock_of(GlueHead::slab);  // rows at -14.5, -9.5 …
    Layer& layer = plan.layers.emplace_back();
    layer.index = 3;
    Joint& joint = layer.joints.emplace_back();
    const auto bar = [&](double low, double high) {
        for (const auto& [x, y] : {std::pair{0.0, low}, {40.0, low}, {40.0, high}, {0.0, high}})
            joint.glue.points.push_back({to_units(x), to_units(y)});
        joint.glue.close_loop();
    };
    bar(1, 5), bar(12, 20);
    joint.area_mm2 = area(joint.glue);
    EXPECT_NEAR(glue_between_rows(plan, joint.glue), 40 * 4, 1e-9) << "rows at .5, 5.5, 10.5";
    note_missed_glue(plan);
    note_missed_glue(plan);
    ASSERT_EQ(plan.diagnostics.size(), 1u);
    EXPECT_EQ(plan.diagnostics[0].code, "glue.missed");
    plan.job.machine.glue_pitch = 2;
    note_missed_glue(plan);
    EXPECT_TRUE(plan.diagnostics.empty());
}

TEST(GluePath, ASlabThatIsTooLongForTheWayIsRefused) {
    Plan plan = stock_of(GlueHead::slab);
    plan.layers.emplace_back().index = 4;
    plan.job.machine.handler_travel = 260;
    EXPECT_NO_THROW(check_handler(plan));
    plan.job.machine.handler_travel = 259;
    try {
        check_handler(plan);
        FAIL();
    } catch (const Error& e) {
        EXPECT_EQ(e.code(), "machine.handler_travel");
        EXPECT_NE(e.message().find("0.5 mm before all of it"), std::string::npos) << e.message();
        EXPECT_EQ(e.place(), "layer 4");
    }
    plan.job.machine.glue_head = GlueHead::none;
    EXPECT_NO_THROW(check_handler(plan));
}
