// All places of a plan move with its frame, each by as much, and nothing else does.
#include "engine/planner/local_frame.h"

#include <gtest/gtest.h>

using namespace slabwright;

namespace {

constexpr std::array<double, 2> kBy{100.5, -40.25};  // mm

using Place = std::array<double, 2>;

Loops triangle(double x, double y) {
    Loops loops;
    loops.points = {
        {to_units(x), to_units(y)}, {to_units(x + 1), to_units(y)}, {to_units(x), to_units(y + 2)}};
    loops.close_loop();
    return loops;
}

/// A plan that has one of all that has a place, `at` from where it counts.
Plan plan_at(const Place& at, WorkZero zero) {
    const auto x = [&](double v) { return v + at[0]; };
    const auto y = [&](double v) { return v + at[1]; };
    Plan plan;
    plan.job.machine.zero = zero;
    plan.stock_min = {x(-5), y(-6)};
    plan.stock_max = {x(50), y(60)};
    plan.flask = Flask{triangle(x(1), y(2)), {triangle(x(3), y(4)), triangle(x(5), y(6))}, 7, 8, 9};
    plan.supports = {{.layer = 1, .x = x(3), .y = y(4), .width = 5, .z_low = 6, .z_high = 7}};
    plan.features.resize(1);
    plan.features[0].x = x(8);
    plan.features[0].y = y(9);
    Layer layer;
    Operation operation;
    for (const double v : {0.0, 10.0, 20.0}) {
        Move move;
        move.x = to_units(x(v));
        move.y = to_units(y(2 * v));
        move.z = to_units(3 * v);
        operation.moves.push_back(move);
    }
    operation.peak_at = {x(1), y(2), 3};
    layer.operations = {operation, operation};
    layer.operations[1].peak_at.reset();
    layer.blank = Blank{{x(-1), y(-2)}, {x(11), y(12)}};
    layer.dowels = {{.x = x(4), .y = y(5), .diameter = 6, .below = 7, .above = 8}};
    Joint joint;
    joint.z = 2;
    joint.centroid = {x(6), y(7)};
    joint.glue = triangle(x(7), y(8));
    joint.beads = {{to_units(y(1)), to_units(x(2)), to_units(x(3))}};
    layer.joints = {joint};
    plan.layers = {layer};
    const bool of_model = zero == WorkZero::model;
    const Place edge = of_model ? at : Place{0, 0};
    plan.sequence.resize(1);
    plan.sequence[0].numbers = {{"x_mm", x(1)},
                                {"y_mm", y(2)},
                                {"slab_left_mm", 3 + edge[0]},
                                {"slab_front_mm", 4 + edge[1]},
                                {"touch_x_mm", 5 + edge[0]},
                                {"touch_y_mm", 6 + edge[1]},
                                {"slab_top_mm", 7}};
    plan.probes = {{1, 2, "probe.ngc", {8 + edge[0], 9 + edge[1], 10}}};
    plan.diagnostics = {{Severity::warning, "code", "text", std::array<double, 3>{x(1), y(2), 3}},
                        {Severity::warning, "code", "text", std::nullopt}};
    return plan;
}

void expect_same(const Plan& a, const Plan& b) {
    EXPECT_EQ(a.stock_min, b.stock_min);
    EXPECT_EQ(a.stock_max, b.stock_max);
    EXPECT_EQ(a.flask->outer.points, b.flask->outer.points);
    ASSERT_EQ(a.flask->inner.size(), b.flask->inner.size());
    for (std::size_t i = 0; i < a.flask->inner.size(); ++i)
        EXPECT_EQ(a.flask->inner[i].points, b.flask->inner[i].points);
    EXPECT_EQ(a.supports, b.supports);
    EXPECT_EQ(a.features[0].x, b.features[0].x);
    EXPECT_EQ(a.features[0].y, b.features[0].y);
    for (std::size_t o = 0; o < 2; ++o) {
        const Operation &m = a.layers[0].operations[o], &n = b.layers[0].operations[o];
        for (std::size_t i = 0; i < m.moves.size(); ++i) {
            EXPECT_EQ(m.moves[i].x, n.moves[i].x);
            EXPECT_EQ(m.moves[i].y, n.moves[i].y);
            EXPECT_EQ(m.moves[i].z, n.moves[i].z);
        }
        EXPECT_EQ(m.peak_at, n.peak_at);
    }
    EXPECT_EQ(a.layers[0].blank, b.layers[0].blank);
    EXPECT_EQ(a.layers[0].dowels, b.layers[0].dowels);
    const Joint &j = a.layers[0].joints[0], &k = b.layers[0].joints[0];
    EXPECT_EQ(j.z, k.z);
    EXPECT_EQ(j.centroid, k.centroid);
    EXPECT_EQ(j.glue.points, k.glue.points);
    EXPECT_EQ(j.beads, k.beads);
    EXPECT_EQ(a.sequence[0].numbers, b.sequence[0].numbers);
    EXPECT_EQ(a.probes[0].touches, b.probes[0].touches);
    EXPECT_EQ(a.diagnostics[0].where, b.diagnostics[0].where);
    EXPECT_EQ(a.diagnostics[1].where, b.diagnostics[1].where);
}

}  // namespace

TEST(LocalFrame, EveryPlaceMovesWithIt) {
    for (const WorkZero zero : {WorkZero::model, WorkZero::corner, WorkZero::centre, WorkZero::pin}) {
        Plan plan = plan_at({0, 0}, zero);
        leave_local_frame(plan, kBy);
        expect_same(plan, plan_at(kBy, zero));
    }
}

TEST(LocalFrame, BeginsAtASixteenthUnderThePattern) {
    const Box3 box{{17.23F, -3.01F, 5}, {30, 40, 50}};
    const std::array<double, 2> origin = local_origin(box);
    EXPECT_EQ(origin, (std::array<double, 2>{17.1875, -3.0625}));
    Context context;
    Mesh mesh;
    mesh.vertices = {{17.25F, -3, 5}, {30, 40, 50}, {18, 0, 6}};
    const BulkVector<Vec3f> local = in_local_frame(context, mesh.view(), origin);
    ASSERT_EQ(local.size(), 3U);
    EXPECT_EQ(local[0], (Vec3f{0.0625F, 0.0625F, 5}));
    EXPECT_EQ(local[1], (Vec3f{12.8125F, 43.0625F, 50}));
}
