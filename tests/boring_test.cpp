// Round holes for which no drill is there, bored on a helix: which, how wide, how deep, and the proof.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <string>

#include "engine/paths/operations/drilling.h"
#include "engine/planner/drill_plan.h"
#include "engine/tools/libraries.h"
#include "io/slabwright.h"
#include "io/write/stl_writer.h"
#include "kernels/mesh/weld.h"
#include "tests/support/drilled_plate.h"
#include "tests/support/files.h"
#include "tests/support/places.h"
#include "tests/support/schema.h"
#include "tests/support/seed.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

using test::LoopAxis;

constexpr double kThrough = 10, kBlind = 11, kFloor = 14, kTop = 30;  // mm: diameters, heights

// Along x: one hole through, one blind with a flat bottom, one of few sides, one too wide for a helix.
Mesh plate_with_holes(Context& context) {
    std::mt19937 random(1);
    test::DrilledPlate plate(60, kTop);
    const std::vector<double> many = test::turn(160, 0.1, 0, random), few = test::turn(12, 0.1, 0, random);
    const auto axis = [&] { return LoopAxis{{plate.next_x() + 25, 30, 0}}; };
    LoopAxis a = axis();
    plate.cell(50, a, {a.ring(many, kThrough / 2, kTop), a.ring(many, kThrough / 2, 0)}, nullptr);
    a = axis();
    const Vec3d floor{a.at[0], 30, kFloor};
    plate.cell(50, a, {a.ring(many, kBlind / 2, kTop), a.ring(many, kBlind / 2, kFloor)}, &floor);
    a = axis();
    plate.cell(50, a, {a.ring(few, 5, kTop), a.ring(few, 5, 0)}, nullptr);
    a = axis();
    plate.cell(50, a, {a.ring(many, 20, kTop), a.ring(many, 20, 0)}, nullptr);
    return weld(context, test::rounded(plate.closed()));
}

Job job_with(bool bores) {
    Job job;
    job.tools = shop_library();
    std::erase_if(job.tools,
                  [](const Tool& tool) { return tool.diameter > 13 && tool.kind == ToolKind::flat; });
    job.cutting.bore_holes = bores;
    return job;
}

TEST(Boring, WhatBoresIsHalfAsWideAndClearOfItsCore) {
    Tool tool;
    tool.diameter = 6;
    EXPECT_TRUE(can_bore(tool, 10));
    EXPECT_FALSE(can_bore(tool, 12.5)) << "a post stays in the middle";
    EXPECT_FALSE(can_bore(tool, 7.5)) << "it stands on its core";
    tool.plunges = true;
    EXPECT_TRUE(can_bore(tool, 7.5));
    EXPECT_FALSE(can_bore(tool, 6.05));
    tool.kind = ToolKind::ball;
    EXPECT_FALSE(can_bore(tool, 10));
}

TEST(Boring, EachHoleIsBoredByTheWidestToolThatCan) {
    std::mt19937 random(test::seed());
    const auto draw = [&](double a, double b) {
        return std::uniform_real_distribution<double>(a, b)(random);
    };
    Context context;
    const Mesh plate = plate_with_holes(context);
    Plan plan;
    plan.job.cutting.bore_holes = true;
    for (const double bottom : {0.0, 18.0}) {
        Layer& layer = plan.layers.emplace_back();
        layer.z_bottom = bottom;
        layer.z_top = bottom == 0 ? 18 : kTop;
    }
    std::size_t bored = 0, left = 0;
    for (int round = 0; round < 60; ++round) {
        plan.job.tools.clear();
        for (int number = 1; number <= 1 + round % 6; ++number) {
            Tool& tool = plan.job.tools.emplace_back();
            tool.number = number;
            tool.kind = random() % 6 == 0 ? ToolKind::ball : ToolKind::flat;
            tool.diameter = tool.shank_diameter = draw(3, 18);
            tool.flute_length = draw(10, 40);
            tool.stickout = 100;
            tool.plunges = random() % 2 == 0;
        }
        const DrillPlan found = plan_drilling(context, plate.view(), plan);
        ASSERT_EQ(found.layers.size(), plan.layers.size());
        for (const auto& [x, diameter, bottom] :
             {std::array{25.0, kThrough, 0.0}, std::array{75.0, kBlind, kFloor}}) {
            const Tool* widest = nullptr;
            for (const Tool& tool : plan.job.tools) {
                const bool reaches = tool.flute_length >= (bottom == 0 ? 18 : 12.0);
                if (can_bore(tool, diameter) && reaches &&
                    (widest == nullptr || tool.diameter > widest->diameter))
                    widest = &tool;
            }
            for (std::size_t i = 0; i < plan.layers.size(); ++i) {
                std::vector<DrilledHole> here;
                for (const DrilledHole& hole : found.layers[i])
                    if (std::abs(hole.x - x) < 1) here.push_back(hole);
                ASSERT_EQ(here.size(), widest != nullptr ? 1U : 0U);
                if (widest == nullptr) continue;
                EXPECT_EQ(here[0].tool, widest->number);
                EXPECT_NEAR(2 * here[0].around + widest->diameter, diameter, 0.01);
                EXPECT_NEAR(here[0].top, plan.layers[i].z_top, 1e-4);
                EXPECT_NEAR(here[0].tip, std::max(plan.layers[i].z_bottom, bottom), 1e-4);
            }
            ++(widest != nullptr ? bored : left);
        }
    }
    EXPECT_GT(bored, 20U);
    EXPECT_GT(left, 20U);
}

TEST(Boring, RoundHolesWithoutADrillAreBoredAndProven) {
    Context context;
    const support::TemporaryFolder folder;
    const std::string stl = folder / "plate.stl";
    write_stl(stl, plate_with_holes(context));
    double minutes[2] = {};
    for (const bool bores : {false, true}) {
        const Plan made = plan(context, stl, job_with(bores));
        minutes[bores] = made.totals.cutting_minutes;
        std::size_t layers = 0;
        for (const Layer& layer : made.layers)
            for (const Operation& op : layer.operations) {
                if (op.purpose != "bored holes") continue;
                ++layers;
                double widest[2] = {}, lowest[2] = {1e9, 1e9};
                const auto tool = std::find_if(made.job.tools.begin(), made.job.tools.end(),
                                               [&](const Tool& t) { return t.number == op.tool; });
                ASSERT_NE(tool, made.job.tools.end());
                for (const Move& move : op.moves) {
                    if (move.feed == 0) continue;
                    const std::size_t hole = to_mm(move.x) < 50 ? 0 : 1;
                    EXPECT_LT(to_mm(move.x), 100) << "neither the one of few sides nor the wide one";
                    widest[hole] = std::max(
                        widest[hole], std::hypot(to_mm(move.x) - (hole == 0 ? 25 : 75), to_mm(move.y) - 30));
                    lowest[hole] = std::min(lowest[hole], to_mm(move.z));
                }
                // As wide as the circle, as deep as the layer or the floor.
                EXPECT_NEAR(2 * widest[0] + tool->diameter, kThrough, 0.01);
                EXPECT_NEAR(lowest[0], layer.z_bottom, 2e-4);
                if (layer.z_top <= kFloor) continue;
                EXPECT_NEAR(2 * widest[1] + tool->diameter, kBlind, 0.01);
                EXPECT_NEAR(lowest[1], std::max(layer.z_bottom, kFloor), 2e-4);
            }
        EXPECT_EQ(layers, bores ? made.layers.size() : 0);
        EXPECT_EQ(std::count_if(made.diagnostics.begin(), made.diagnostics.end(),
                                [](const Diagnostic& d) { return d.code == "hole.bored"; }),
                  bores ? 2 : 0);
        const std::string out = folder / (bores ? "bored" : "milled");
        write(context, made, out);
        EXPECT_EQ(support::schema_complaint(support::slurp(out + "/plan.json"),
                                            support::checkout("io/plan.schema.json")),
                  "");
        for (const Diagnostic& v : verify(context, out, stl, {}, 1).violations)
            ADD_FAILURE() << v.code << ' ' << v.message;
    }
    std::printf("milled %.2f min, bored %.2f min\n", minutes[0], minutes[1]);
}

}  // namespace
}  // namespace slabwright
