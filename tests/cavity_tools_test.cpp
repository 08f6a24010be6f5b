// Which tool a narrow cavity is told to want.
#include "engine/tool_choice/cavity_tools.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/catalogue.h"
#include "engine/planner/planner.h"
#include "engine/tools/libraries.h"
#include "kernels/forces/deflection.h"
#include "kernels/mesh/weld.h"
#include "tests/support/drilled_plate.h"

namespace slabwright {
namespace {

/// A slot of one width all along, in layers that end at the given heights.
NarrowCavity slot(double width, double length, double low, double high, const std::vector<double>& tops) {
    NarrowCavity c;
    c.at = {10, 20, low};
    c.width_mm = c.widest_mm = width;
    c.low_mm = low, c.high_mm = high;
    c.length_mm = length;
    c.levels = {{low, {{width, width * length}}}, {high, {{width, width * length}}}};
    double bottom = 0;
    for (std::size_t l = 0; l < tops.size(); ++l) {
        if (tops[l] > low && bottom < high)
            c.layers.push_back({l, tops[l], std::max(low, bottom), std::min(high, tops[l])});
        bottom = tops[l];
    }
    return c;
}

CavityAdvice advice(const Job& job, const NarrowCavity& cavity) {
    const std::vector<NarrowCavity> one{cavity};
    return advise_on_cavities(job, one).front();
}

TEST(CavityTools, TheWidestThatEntersIsTaken) {
    Job job;
    job.tools = *named_library("metric");
    const CavityAdvice wide = advice(job, slot(7, 40, 2, 15, {15}));
    ASSERT_TRUE(wide.tool);
    EXPECT_DOUBLE_EQ(wide.tool->diameter_mm, 6);
    EXPECT_EQ(wide.tool->left_mm2, 0);
    EXPECT_FALSE(wide.missing);
    EXPECT_FALSE(wide.boundary_mm);
    EXPECT_DOUBLE_EQ(wide.reach_mm, 13);
    EXPECT_DOUBLE_EQ(wide.stickout_mm, 13 + job.cutting.holder_clearance);
    const CavityAdvice exact = advice(job, slot(3, 40, 2, 15, {15}));
    ASSERT_TRUE(exact.tool);
    EXPECT_DOUBLE_EQ(exact.tool->diameter_mm, 3) << "as wide as the slot";
    // The step is what its edges bend it by the cusp at.
    const double edges = std::hypot(job.material.kte, job.material.kfe);
    EXPECT_NEAR(cutter_deflection(edges * exact.tool->step_mm, exact.tool->stickout_mm, 3, 550e3),
                job.tolerances.cusp, 1e-9);
}

TEST(CavityTools, WhatNoToolEntersNamesTheMissingOne) {
    const Job job;  // its thinnest is 1/4 in
    const CavityAdvice found = advice(job, slot(4.4, 40, 2, 18, {18}));
    EXPECT_FALSE(found.tool);
    ASSERT_TRUE(found.missing);
    EXPECT_DOUBLE_EQ(found.missing->diameter_mm, 4) << "the thickest that enters";
    EXPECT_GE(found.missing->flute_length_mm, 16 + job.cutting.holder_clearance);
    EXPECT_LE(found.missing->flute_length_mm, 6 * 4);
    EXPECT_EQ(found.missing->left_mm2, 0);
    EXPECT_FALSE(found.boundary_mm);
}

TEST(CavityTools, WhatALibrarysToolMostlyReachesNamesOneForTheRest) {
    const Job job;
    NarrowCavity cavity = slot(6.4, 40, 2, 18, {18});
    for (CavityLevel& level : cavity.levels) level.widths.insert(level.widths.begin(), {2.6, 20});
    const CavityAdvice found = advice(job, cavity);
    ASSERT_TRUE(found.tool);
    EXPECT_NEAR(found.tool->left_mm2, 20, 1e-9);
    ASSERT_TRUE(found.missing);
    EXPECT_DOUBLE_EQ(found.missing->diameter_mm, 2.5);
}

TEST(CavityTools, TooDeepForAnyToolAsksForABoundary) {
    Job job;
    job.tools = *named_library("metric");
    // In one layer of 60 mm: the 3 mm tool is in the library, and too short.
    const CavityAdvice deep = advice(job, slot(3.2, 40, 5, 60, {60}));
    ASSERT_TRUE(deep.boundary_mm);
    double longest = 0;
    for (const Tool& tool : job.tools)
        if (is_end_mill(tool.kind) && tool.diameter <= 3.2)
            longest = std::max(longest, max_layer_of(job, tool));
    EXPECT_NEAR(*deep.boundary_mm, 5 + longest, 1e-9);
    EXPECT_FALSE(deep.missing);
    // With that boundary the same tool does it all.
    const CavityAdvice divided = advice(job, slot(3.2, 40, 5, *deep.boundary_mm, {*deep.boundary_mm}));
    ASSERT_TRUE(divided.tool);
    EXPECT_EQ(divided.tool->left_mm2, 0);
    EXPECT_FALSE(divided.boundary_mm);
    // Narrower than the library: twelve diameters are the longest there are.
    const CavityAdvice thin = advice(job, slot(2, 40, 5, 60, {60}));
    ASSERT_TRUE(thin.missing);
    EXPECT_DOUBLE_EQ(thin.missing->flute_length_mm, 24);
    ASSERT_TRUE(thin.boundary_mm);
    EXPECT_NEAR(*thin.boundary_mm, 5 + 24 - job.cutting.holder_clearance, 1e-9);
}

TEST(CavityTools, AToolThatCanBeHadGoesBeforeABoundary) {
    const Job job;
    NarrowCavity cavity = slot(2.5, 40, 2, 19.5, {19.5});  // 100 mm², and a tip that only 1.5 mm enters
    for (CavityLevel& level : cavity.levels) level.widths.insert(level.widths.begin(), {1.5, 30});
    const CavityAdvice found = advice(job, cavity);
    ASSERT_TRUE(found.missing);
    EXPECT_DOUBLE_EQ(found.missing->diameter_mm, 2.5) << "1.5 mm tools have 18 mm of flutes at most";
    EXPECT_NEAR(found.missing->left_mm2, 30, 1e-9);
    EXPECT_FALSE(found.boundary_mm);
}

TEST(CavityTools, TheDeepestLayerDecides) {
    Job job;
    job.tools = *named_library("metric");
    const CavityAdvice found = advice(job, slot(4, 40, 5, 50, {18, 36, 50}));
    EXPECT_EQ(found.layer, 1U);
    EXPECT_DOUBLE_EQ(found.reach_mm, 18);
    EXPECT_TRUE(found.tool);
    EXPECT_FALSE(found.boundary_mm);
}

// What is told of a slot is what a plan does: the tool that is told cuts it, and nothing as thin cuts
// elsewhere.
TEST(CavityTools, ThePlanCutsTheSlotWithTheToolThatIsTold) {
    Context context({.threads = 2});
    test::DrilledPlate plate(60, 15);
    const test::LoopAxis axis{{45, 30, 0}};
    const auto ring = [](double z) {
        test::Loop loop;
        for (const double x : {-20.0, -10.0, 0.0, 10.0, 20.0}) loop.push_back({45 + x, 30 - 1.7, z});
        for (const double x : {20.0, 10.0, 0.0, -10.0, -20.0}) loop.push_back({45 + x, 30 + 1.7, z});
        return loop;
    };
    const Vec3d floor{45, 30, 3};
    plate.cell(90, axis, {ring(15), ring(3)}, &floor);
    const Mesh mesh = weld(context, test::rounded(plate.closed()));
    Job job;
    job.tools = *named_library("metric");
    const FeatureSet features = find_features(context, mesh.view());
    const Plan plan = make_plan(context, mesh, {}, job);
    std::vector<double> tops;
    for (const Layer& layer : plan.layers) tops.push_back(layer.z_top);
    const auto found = advise_on_cavities(job, find_cavities(context, mesh.view(), tops, features.features));
    ASSERT_EQ(found.size(), 1U);
    EXPECT_NEAR(found[0].cavity.width_mm, 3.4, 1e-3);
    ASSERT_TRUE(found[0].tool);
    EXPECT_DOUBLE_EQ(found[0].tool->diameter_mm, 3);
    bool cut = false;
    for (const Layer& layer : plan.layers)
        for (const Operation& op : layer.operations) {
            const auto tool = std::find_if(job.tools.begin(), job.tools.end(),
                                           [&](const Tool& t) { return t.number == op.tool; });
            if (tool->diameter > found[0].tool->diameter_mm) continue;
            cut |= op.tool == found[0].tool->number;
            for (const Move& m : op.moves) {
                if (m.feed == 0) continue;
                EXPECT_LT(std::abs(to_mm(m.x) - 45), 21) << op.purpose;
                EXPECT_LT(std::abs(to_mm(m.y) - 30), 3) << op.purpose;
            }
        }
    EXPECT_TRUE(cut);
}

TEST(Catalogue, FlutesAreTheShortestThatSuffice) {
    EXPECT_EQ(catalogue_flutes(4, 12), 12);
    EXPECT_EQ(catalogue_flutes(4, 12.1), 16);
    EXPECT_EQ(catalogue_flutes(4, 48), 48);
    EXPECT_EQ(catalogue_flutes(4, 48.1), std::nullopt);
    EXPECT_EQ(longest_catalogue_flutes(4), 48);
    EXPECT_EQ(catalogue_sizes(true).front().words, "1/2 in");
    EXPECT_EQ(catalogue_sizes(false).back().diameter_mm, 1);
}

}  // namespace
}  // namespace slabwright
