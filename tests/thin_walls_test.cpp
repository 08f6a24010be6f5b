// Thin walls are finished level by level, around them and so from both sides, where a floor's cutter would
// load them up to their tops.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "engine/planner/planner.h"
#include "kernels/mesh/weld.h"
#include "tests/mesh_shapes.h"

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
