// Deep cuts push hard, and bend what stands free by a whole step over its joint: layers of small pieces are
// cut in shallow steps, others as deep as their tools go.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/planner/planner.h"
#include "engine/tools/libraries.h"
#include "engine/tools/tools.h"
#include "kernels/mesh/weld.h"
#include "tests/mesh_shapes.h"

using namespace slabwright;

namespace {

/// A plate, and in the layer over it five ribs so wide, or one block as large as all.
Plan plan_of(bool ribs, float wide) {
    const float joint = 15, top = 31;
    shapes::Facets facets = shapes::box({0, 0, 0}, {140, 160, joint});
    if (ribs)
        for (int k = 0; k < 5; ++k) {
            const auto y = static_cast<float>(15 + 30 * k);
            shapes::append(facets, shapes::box({50, y, 0}, {90, y + wide, top}));
        }
    else shapes::append(facets, shapes::box({50, 15, 0}, {90, 15 + 120 + wide, top}));
    Context context;
    Job job;
    job.tools = shop_library();
    job.bonding.edge_setback = 1;
    return make_plan(context, weld(context, facets), {}, job);
}

double deepest(const Plan& plan) {
    double most = 0;
    for (const Operation& op : plan.layers.back().operations)
        if (op.kind == OperationKind::rough && op.purpose != "open waste") most = std::max(most, op.stepdown);
    return most;
}

double shallow_at_most() {
    double most = 0;
    for (const Tool& tool : shop_library())
        if (tool.kind == ToolKind::flat) most = std::max(most, shallow_step(tool));
    return most;
}

bool tells(const Plan& plan, const char* code) {
    return std::any_of(plan.diagnostics.begin(), plan.diagnostics.end(),
                       [&](const Diagnostic& d) { return d.code == code; });
}

}  // namespace

TEST(GentleCuts, WhatDeepCutsWouldBreakOffIsCutInShallowSteps) {
    const Plan block = plan_of(false, 6);
    ASSERT_EQ(block.layers.size(), 2u);
    EXPECT_GT(deepest(block), shallow_at_most());
    const Plan ribs = plan_of(true, 6);  // it is no refusal either
    ASSERT_EQ(ribs.layers.size(), 2u);
    EXPECT_GT(deepest(ribs), 1);
    EXPECT_LE(deepest(ribs), shallow_at_most() + 1e-9);
    EXPECT_FALSE(tells(ribs, "joint.weak"));
    EXPECT_GT(deepest(plan_of(true, 16)), shallow_at_most()) << "these bear it";
}
