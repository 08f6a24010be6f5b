// Limits that feeds and passes keep: a ball's bending, the spindle's torque and power, nominal cuts.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/forces/bent_cutter.h"
#include "engine/forces/cuts.h"
#include "engine/forces/deep_runs.h"
#include "engine/forces/feeds.h"
#include "engine/forces/op_forces.h"
#include "engine/planner/rating.h"
#include "tests/support/plate.h"

namespace slabwright {
namespace {

using test::at;
using test::plate;

Operation slot(const Plan& plan, OperationKind kind, int tool, double y, double z, std::uint32_t feed) {
    Operation op;
    op.kind = kind;
    op.purpose = "slot";
    op.tool = tool;
    op.spindle_rpm = plan.job.tools[static_cast<std::size_t>(tool) - 1].max_rpm;
    op.moves = {at(-10, y, 30, 0), at(-10, y, z, 0), at(130, y, z, feed), at(130, y, 30, 0)};
    return op;
}

std::vector<Diagnostic> rated(Plan& plan, std::vector<Operation> operations) {
    Context context;
    std::vector<Diagnostic> found;
    plan.layers[0].operations = std::move(operations);
    rate_layer(context, plan.layers[0], plan, found);
    std::erase_if(found, [](const Diagnostic& d) { return d.severity != Severity::warning; });
    return found;
}

// A ball of the default library, in full wood as deep as its radius: whatever its lowest pass is raised by,
// the last one touches the wall as high. Thinner shells bend it less.
TEST(Limits, ABallTakesThinShells) {
    for (const double deep : {2.6, 3.1, 3.6}) {
        Plan plan = plate();
        const std::vector<Diagnostic> found =
            rated(plan, {slot(plan, OperationKind::finish, 3, 40, 18 - deep, 5000)});
        const Operation& op = plan.layers[0].operations[0];
        EXPECT_TRUE(found.empty()) << deep << " " << found[0].message;
        EXPECT_LE(op.wall_error_mm, bending_limit(op, plan.job)) << deep;
        EXPECT_GT(op.wall_error_mm, 0);
    }
}

// Where cuts are taken as nominal, a cutter that bends by over a hundredth more than it may is told.
TEST(Limits, ANominalCutThatBendsTooFarIsTold) {
    Plan plan = plate();
    plan.job.cutting.engagement = Engagement::nominal;
    plan.job.cutting.wall_allowance = plan.job.cutting.floor_allowance = 0;
    for (const auto& [kind, code] : {std::pair{OperationKind::finish, "cut.deflection"},
                                     std::pair{OperationKind::rough, "rough.deflection"}}) {
        Operation op = slot(plan, kind, 2, 40, 15, 5000);
        op.stepdown = 3;
        const auto told = [&](double allowed) {
            plan.job.tolerances.cusp = allowed;
            EXPECT_EQ(bending_limit(op, plan.job), allowed);
            std::vector<Diagnostic> found;
            rate(plan.job, plan.layers[0], op, found);
            return found;
        };
        EXPECT_TRUE(told(1).empty());
        const double bends = op.deflection_mm;
        ASSERT_GT(bends, 0);
        for (const double share : {0.1, 0.99, 1.0, 1.009})
            EXPECT_TRUE(told(bends / share).empty()) << code << " " << share;
        for (const double share : {1.011, 2.0, 10.0}) {
            const std::vector<Diagnostic> found = told(bends / share);
            ASSERT_EQ(found.size(), 1U) << code << " " << share;
            EXPECT_EQ(found[0].code, code);
            EXPECT_EQ(found[0].severity, Severity::warning);
        }
        EXPECT_EQ(op.deflection_mm, bends);
    }
}

// Passes as thin as such a ball needs would be many times the way: it is told instead.
TEST(Limits, ASlenderBallDoesNotTakeHours) {
    Plan plan = plate();
    plan.job.tools[2].stickout = 90;
    Operation slots = slot(plan, OperationKind::finish, 3, 10, 14, 5000);
    for (double y = 22; y < 80; y += 12) {
        const Operation next = slot(plan, OperationKind::finish, 3, y, 14, 5000);
        slots.moves.insert(slots.moves.end(), next.moves.begin(), next.moves.end());
    }
    const auto way = [](const Operation& op) {
        double sum = 0;
        for (std::size_t k = 1; k < op.moves.size(); ++k)
            if (op.moves[k].feed != 0)
                sum += std::hypot(to_mm(op.moves[k].x - op.moves[k - 1].x),
                                  to_mm(op.moves[k].y - op.moves[k - 1].y));
        return sum;
    };
    const double before = way(slots);
    const std::vector<Diagnostic> found = rated(plan, {slots});
    EXPECT_LE(way(plan.layers[0].operations[0]), 1.1 * (3 * before + 3000));
    ASSERT_EQ(found.size(), 1U);
    EXPECT_EQ(found[0].code, "cut.deflection");
}

TEST(Limits, AToolThatBendsInThreeProgramsIsToldOnce) {
    Plan plan = plate();
    plan.job.tools[2].stickout = 150;
    const std::vector<Diagnostic> found = rated(plan, {slot(plan, OperationKind::finish, 3, 20, 15, 5000),
                                                       slot(plan, OperationKind::finish, 3, 40, 14, 5000),
                                                       slot(plan, OperationKind::finish, 3, 60, 15, 5000)});
    ASSERT_EQ(found.size(), 1U);
    EXPECT_EQ(found[0].code, "cut.deflection");
    EXPECT_NE(found[0].message.find("in 3 of its programs"), std::string::npos) << found[0].message;
    EXPECT_NE(found[0].message.find("T3"), std::string::npos);
    ASSERT_TRUE(found[0].where);
}

TEST(Limits, TorqueAndPowerOfTheSpindle) {
    Plan plan = plate();
    const auto rough = [&] { return slot(plan, OperationKind::rough, 2, 40, 14.5, 9000); };
    EXPECT_TRUE(rated(plan, {rough()}).empty());
    const Operation free = plan.layers[0].operations[0];
    // As the force model says of the slot, up to the class of depth.
    const CutSegment cut = slot_cut(plan.job, plan.job.tools[1], 3.5);
    const SegmentForces f = stated_forces(cut);
    EXPECT_NEAR(free.peak_torque_nmm, f.peak_torque_nmm, 0.02 * f.peak_torque_nmm);
    EXPECT_NEAR(free.peak_power_w, f.mean_power_w, 0.02 * f.mean_power_w);

    for (const double share : {0.8, 0.5, 0.25}) {
        plan.job.machine.spindle_torque_nm = share * free.peak_torque_nmm / 1000;
        plan.job.machine.spindle_power_w = 0;
        EXPECT_TRUE(rated(plan, {rough()}).empty()) << share;
        EXPECT_LE(plan.layers[0].operations[0].peak_torque_nmm, share * free.peak_torque_nmm) << share;
        plan.job.machine.spindle_torque_nm = 0;
        plan.job.machine.spindle_power_w = share * free.peak_power_w;
        EXPECT_TRUE(rated(plan, {rough()}).empty()) << share;
        EXPECT_LE(plan.layers[0].operations[0].peak_power_w, share * free.peak_power_w) << share;
    }
    // What no feed and no pass takes down is told, each with its own code.
    plan.job.machine.spindle_torque_nm = 0.0002 * free.peak_torque_nmm / 1000;
    plan.job.machine.spindle_power_w = 0.0002 * free.peak_power_w;
    const std::vector<Diagnostic> found = rated(plan, {rough()});
    ASSERT_EQ(found.size(), 2U);
    EXPECT_EQ(found[0].code, "cut.power");
    EXPECT_EQ(found[1].code, "cut.torque");
}

TEST(Limits, NominalCutsSlowDownToo) {
    Plan plan = plate();
    const Tool& flat = plan.job.tools[1];
    Operation op = slot(plan, OperationKind::rough, 2, 40, 15, 9000);
    op.stepdown = 3;
    rate_operation(op, flat, plan.job);
    const double torque = op.peak_torque_nmm;
    EXPECT_GT(torque, 0);
    EXPECT_GT(op.peak_power_w, 0);
    EXPECT_FALSE(slow_down(op, flat, plan.job));
    EXPECT_EQ(op.moves[2].feed, 9000U);
    plan.job.machine.spindle_torque_nm = 0.7 * torque / 1000;
    EXPECT_TRUE(slow_down(op, flat, plan.job));
    EXPECT_LT(op.moves[2].feed, 9000U);
    EXPECT_GT(op.moves[2].feed, 1125U);
    rate_operation(op, flat, plan.job);
    EXPECT_LE(op.peak_torque_nmm, 0.7 * torque);
    // Nothing helps: no slower than the least share.
    plan.job.machine.spindle_torque_nm = 1e-6;
    EXPECT_TRUE(slow_down(op, flat, plan.job));
    EXPECT_GE(op.moves[2].feed, 300U);
}

// Passes divide the deepest of a run's cuts, wherever in it that is; where its cuts are divided in two ways,
// the hardest says how.
TEST(DeepRuns, AreAsDeepAsTheDeepestOfTheirCuts) {
    Operation op;
    op.moves = {at(0, 0, 30, 0), at(10, 0, 10, 3000), at(20, 0, 10, 3000)};
    const auto runs_of = [&](ToolKind kind, float first_depth, float second_depth, double first_load) {
        Tool tool = plate().job.tools[1];
        tool.kind = kind, tool.diameter = 8;
        std::vector<SeenStretch> seen(2);
        for (std::uint32_t k = 0; k < 2; ++k) {
            seen[k].first = seen[k].last = k + 1;
            seen[k].cuts = true;
            seen[k].length = 10;
            seen[k].feed = 3000;
        }
        seen[0].depth = first_depth, seen[1].depth = second_depth;
        const PassQuestions ask{
            [&](const SeenStretch& s, int) { return CutLoad{.cutter = s.first == 1 ? first_load : 2}; },
            [](const SeenStretch&, int) { return 1.0; }};
        return deep_runs(seen, op, tool, 1, ask);
    };
    EXPECT_EQ(runs_of(ToolKind::flat, 4, 6, 3), (std::vector<DeepRun>{{1, 2, 6, 4, PassShares::equal}}));
    EXPECT_EQ(runs_of(ToolKind::flat, 6, 4, 1.5), (std::vector<DeepRun>{{1, 2, 6, 3, PassShares::equal}}));
    // A ball cuts with its side from 6 mm on, and below that leaves a shell of .35 in the second round.
    EXPECT_EQ(runs_of(ToolKind::ball, 4, 7, 3),
              (std::vector<DeepRun>{{1, 2, 4 * 0.35, 4, PassShares::growing}}));
    EXPECT_EQ(runs_of(ToolKind::ball, 4, 7, 1.5), (std::vector<DeepRun>{{1, 2, 7, 3, PassShares::equal}}));
}

}  // namespace
}  // namespace slabwright
