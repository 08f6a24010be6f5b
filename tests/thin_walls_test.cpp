// Thin walls are finished level by level, around them and so from both sides, where a floor's cutter would
// load them up to their tops.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "engine/planner/planner.h"
#include "engine/tools/libraries.h"
#include "kernels/mesh/weld.h"
#include "tests/mesh_shapes.h"
#include "tests/support/height_field.h"

using namespace slabwright;

namespace {

/// Four walls on a plate, 15 mm high.
Plan plan_of(double thick, double strength_mpa) {
    shapes::Facets facets = shapes::box({0, 0, 0}, {100, 110, 3});
    for (int k = 0; k < 4; ++k) {
        const auto y = static_cast<float>(15 + 24 * k);
        shapes::append(facets, shapes::box({20, y, 2}, {80, y + static_cast<float>(thick), 18}));
    }
    Context context;
    Job job;
    job.material.strength_mpa = strength_mpa;
    job.bonding.accept_weak = true;  // it is about the wood
    return make_plan(context, weld(context, facets), {}, job);
}

/// Of the layer of the walls.
double minutes(const Plan& plan) {
    double sum = 0;
    for (const Operation& op : plan.layers.back().operations) sum += op.minutes;
    return sum;
}

std::vector<std::string> finishing(const Plan& plan) {
    std::vector<std::string> purposes;
    for (const Operation& op : plan.layers.back().operations)
        if (op.purpose == "floors" || op.purpose == "vertical walls") purposes.push_back(op.purpose);
    return purposes;
}

/// What was planned for a layer of waves for a wide ball and one steep ridge, 1 mm wide at its crest.
std::vector<ToolSet> sets_of(double strength_mpa) {
    Context context;
    const Mesh mesh = test::height_field(context, 120, 0.5, [](double x, double y) {
        if (y > -6) return 9 + 4 * std::cos(x / 12) * std::cos((y + 6) / 12);
        if (std::abs(x) > 22) return 3.0;
        const double off = std::abs(y + 18);
        return off < 0.5 ? 16.0 : std::max(3.0, 16 - 13 * (off - 0.5) / 0.5);
    });
    Job job;
    job.tools = shop_library();
    // At steps as deep as the wall is high a wall that breaks under all cutters is given up sooner.
    for (Tool& tool : job.tools)
        for (const Tool& luo : luo_library())
            if (tool.kind == ToolKind::flat && luo.kind == tool.kind && luo.diameter == tool.diameter)
                tool.stepdown_max = luo.stepdown_max;
    job.slabs.thicknesses = {19};
    job.material.strength_mpa = strength_mpa;
    job.bonding.accept_weak = true;
    return make_plan(context, mesh, {}, job).layers.front().selection->sets;
}
std::size_t planned_whole(const std::vector<ToolSet>& sets) {
    return static_cast<std::size_t>(
        std::count_if(sets.begin(), sets.end(), [](const ToolSet& s) { return s.left_mm2.has_value(); }));
}
const ToolSet* named(const std::vector<ToolSet>& sets, const char* name) {
    const auto at = std::find_if(sets.begin(), sets.end(), [&](const ToolSet& s) { return s.name == name; });
    return at == sets.end() ? nullptr : &*at;
}

}  // namespace

TEST(ThinWalls, AreFinishedBeforeTheFloorsThatWouldLoadThem) {
    const std::vector<std::string> floors_first{"floors", "vertical walls"},
        walls_first{"vertical walls", "floors"};
    const Plan strong = plan_of(1, 1000);
    EXPECT_EQ(finishing(strong), floors_first) << "what bears it is made the quickest way";
    EXPECT_EQ(finishing(plan_of(3, 27)), floors_first);
    const Plan thin = plan_of(1, 27);
    EXPECT_EQ(finishing(thin), walls_first);
    for (const Diagnostic& d : thin.diagnostics) EXPECT_NE(d.code, "wall.weak") << d.message;
    // Of walls that bear it, what the floors' cutter has taken beside it is not gone along again; thin ones
    // take little longer than strong ones that are gone along whole.
    constexpr double strong_and_whole = 4.32;  // min, of either thickness
    EXPECT_LT(minutes(strong), 0.9 * strong_and_whole);
    EXPECT_LT(minutes(thin), 1.15 * strong_and_whole);
    EXPECT_LT(minutes(plan_of(0.8, 27)), 1.15 * strong_and_whole);
}

// Where thin walls break under the first set, the one that pushes least is asked; under which they break too,
// no other is.
TEST(ThinWalls, WhatNothingSavesIsNotPlannedWithEverySet) {
    EXPECT_EQ(named(sets_of(27), "gentlest"), nullptr) << "wood that bears it";
    const std::vector<ToolSet> saved = sets_of(4);
    ASSERT_NE(named(saved, "gentlest"), nullptr);
    EXPECT_EQ(named(saved, "gentlest")->reason.find("would bear"), std::string::npos);
    EXPECT_NE(named(saved, "foreseen")->reason.find("would bear"), std::string::npos);
    EXPECT_GT(planned_whole(saved), 2);
    const std::vector<ToolSet> lost = sets_of(0.5);
    ASSERT_NE(named(lost, "gentlest"), nullptr);
    EXPECT_NE(named(lost, "gentlest")->reason.find("would bear"), std::string::npos);
    EXPECT_EQ(planned_whole(lost), 2);
}
