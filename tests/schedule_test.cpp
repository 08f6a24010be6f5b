// The machine's steps, their order and the totals; where glue goes and how hard the press may press.
#include "engine/schedule/schedule.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <set>

using namespace slabwright;

namespace {

void add_rectangle(Loops& loops, double x0, double y0, double x1, double y1, bool hole = false) {
    std::vector<Point2> points{{to_units(x0), to_units(y0)},
                               {to_units(x1), to_units(y0)},
                               {to_units(x1), to_units(y1)},
                               {to_units(x0), to_units(y1)}};
    if (hole) std::reverse(points.begin(), points.end());
    loops.points.insert(loops.points.end(), points.begin(), points.end());
    loops.close_loop();
}

Operation operation(OperationKind kind, int tool, double minutes) {
    Operation op;
    op.kind = kind;
    op.tool = tool;
    op.minutes = minutes;
    op.cutting_mm = 100 * minutes;
    op.rapid_mm = 10 * minutes;
    return op;
}

Plan plan_of_layers(int count) {
    Plan plan;
    plan.stock_min = {0, 0};
    plan.stock_max = {200, 100};
    plan.totals.part_volume_mm3 = 1234;
    for (int i = 1; i <= count; ++i) {
        Layer layer;
        layer.index = i;
        layer.z_bottom = 18 * (i - 1);
        layer.z_top = 18 * i;
        layer.slab_thickness = 19;
        layer.glue_area_mm2 = 5000;
        layer.operations = {operation(OperationKind::face, 1, 1.5), operation(OperationKind::rough, 2, 4),
                            operation(OperationKind::finish, 3, 6), operation(OperationKind::finish, 3, 2)};
        plan.layers.push_back(layer);
    }
    return plan;
}

bool has(const std::vector<Diagnostic>& diagnostics, const std::string& code) {
    return std::any_of(diagnostics.begin(), diagnostics.end(),
                       [&](const Diagnostic& d) { return d.code == code; });
}

double number(const SequenceStep& step, const std::string& key) {
    for (const auto& [k, v] : step.numbers)
        if (k == key) return v;
    ADD_FAILURE() << step.action << " has no " << key;
    return NAN;
}

}  // namespace

TEST(Schedule, ProgramNamesSortInTheOrderOfExecution) {
    Plan plan = plan_of_layers(1203);
    plan.layers[4].operations.assign(120, operation(OperationKind::drill, 12, 0.1));
    plan.layers[4].operations[50].kind = OperationKind::corner;
    schedule(plan);
    EXPECT_EQ(plan.layers[2].operations[1].file, "L0003_002_rough_T2.ngc");
    std::vector<std::string> names;
    for (const Layer& layer : plan.layers)
        for (const Operation& op : layer.operations) names.push_back(op.file);
    EXPECT_TRUE(std::is_sorted(names.begin(), names.end()));
    EXPECT_EQ(std::set<std::string>(names.begin(), names.end()).size(), names.size());

    Plan small = plan_of_layers(3);
    name_programs(small);
    EXPECT_EQ(small.layers[2].operations[1].file, "L003_02_rough_T2.ngc");
}

TEST(Schedule, StepsNeedOnlyEarlierStepsAndAllLeadToTheUnloading) {
    Plan plan = plan_of_layers(3);
    schedule(plan);
    ASSERT_FALSE(plan.sequence.empty());
    std::set<int> done, needed;
    for (const SequenceStep& step : plan.sequence) {
        for (const int need : step.needs) {
            EXPECT_TRUE(done.count(need)) << step.id << " " << step.action << " needs " << need;
            needed.insert(need);
        }
        EXPECT_TRUE(done.insert(step.id).second);
    }
    EXPECT_EQ(plan.sequence.back().action, "unload");
    for (const SequenceStep& step : plan.sequence)
        EXPECT_TRUE(step.action == "unload" || needed.count(step.id))
            << "nothing waits for step " << step.id << " " << step.action;
}

TEST(Schedule, EachLayerGoesThroughTheMachineInOrder) {
    Plan plan = plan_of_layers(2);
    schedule(plan);
    std::vector<std::string> actions;
    for (const SequenceStep& step : plan.sequence)
        if (step.layer == 2) actions.push_back(step.action);
    const std::vector<std::string> expected{"take_slab", "clamp",       "glue",        "place", "press",
                                            "table",     "touch_off",   "tool_change", "face",  "tool_change",
                                            "mill",      "tool_change", "mill",        "mill",  "unload"};
    EXPECT_EQ(actions, expected);
    // The next slab may be fetched while this layer is milled, but glue waits for the last program.
    std::map<int, const SequenceStep*> by_id;
    for (const SequenceStep& step : plan.sequence) by_id[step.id] = &step;
    for (const SequenceStep& step : plan.sequence) {
        if (step.layer != 2) continue;
        if (step.action == "take_slab") {
            EXPECT_EQ(by_id[step.needs[0]]->action, "place");
        }
        if (step.action == "glue") {
            EXPECT_EQ(by_id[step.needs[0]]->action, "mill");
            EXPECT_EQ(by_id[step.needs[0]]->layer, 1);
        }
    }
}

TEST(Schedule, TotalsAddUp) {
    Plan plan = plan_of_layers(3);
    schedule(plan);
    const Totals& t = plan.totals;
    EXPECT_EQ(t.layers, 3);
    EXPECT_EQ(t.operations, 12);
    EXPECT_EQ(t.tool_changes, 9);
    EXPECT_NEAR(t.cutting_minutes, 3 * 13.5, 1e-9);
    EXPECT_NEAR(t.cutting_mm, 3 * 1350, 1e-9);
    EXPECT_NEAR(t.rapid_mm, 3 * 135, 1e-9);
    EXPECT_NEAR(t.bonding_minutes, 3 * (60 + 60 * 0.005 + 30) / 60, 1e-9);
    EXPECT_NEAR(t.tool_change_minutes, 9 * 15 / 60.0, 1e-9);
    EXPECT_NEAR(t.table_minutes, 2 * 18 / 600.0, 1e-9);
    EXPECT_NEAR(t.build_minutes,
                t.cutting_minutes + t.bonding_minutes + t.tool_change_minutes + t.table_minutes, 1e-9);
    EXPECT_NEAR(t.stock_volume_mm3, 3 * 19 * 200 * 100, 1e-6);
    EXPECT_NEAR(t.stack_mass_kg, 4 * 19 * 200 * 100 * 1e-9 * 750, 1e-9);
    EXPECT_EQ(t.part_volume_mm3, 1234);
    double seconds = 0;
    for (const SequenceStep& step : plan.sequence) seconds += step.seconds;
    EXPECT_NEAR(seconds / 60, t.build_minutes, 1e-9) << "the steps take as long as the build";
}

TEST(Schedule, ToolIsChangedOnlyWhenTheNextProgramHasAnother) {
    Plan plan = plan_of_layers(2);
    for (Layer& layer : plan.layers)
        layer.operations = {operation(OperationKind::rough, 2, 1), operation(OperationKind::finish, 2, 1)};
    schedule(plan);
    EXPECT_EQ(plan.totals.tool_changes, 1);
}

TEST(Schedule, ATableThatMovesSinksInEitherFrame) {
    Plan plan = plan_of_layers(2);
    const auto heights = [&] {
        schedule(plan);
        std::vector<std::pair<double, double>> out;
        double table = 0;
        for (const SequenceStep& step : plan.sequence) {
            if (step.action == "table") table = number(step, "table_height_mm");
            if (step.action == "touch_off") out.emplace_back(table, number(step, "slab_top_mm"));
        }
        return out;
    };
    const std::vector<std::pair<double, double>> from_top{{-37, 1}, {-55, 1}};
    EXPECT_EQ(heights(), from_top) << "the default machine's table moves";
    plan.job.machine.frame = Frame::layer_top;
    EXPECT_EQ(heights(), from_top);
    plan.job.machine.frame = Frame::pattern_base;
    EXPECT_EQ(heights(), (std::vector<std::pair<double, double>>{{-19, 19}, {-37, 37}}))
        << "the offset on the control follows it";
    plan.job.machine.table = BuildTable::fixed;
    EXPECT_EQ(heights(), (std::vector<std::pair<double, double>>{{-19, 19}, {-19, 37}}));
    plan.job.machine.frame = Frame::layer_top;
    EXPECT_EQ(heights(), (std::vector<std::pair<double, double>>{{-37, 1}, {-37, 1}}));
}

TEST(Bonding, GlueKeepsItsSetbackAndPressItsPressure) {
    Plan plan = plan_of_layers(1);
    Loops below;
    add_rectangle(below, 20, 10, 180, 90);
    std::vector<Diagnostic> diagnostics;
    bond_layer(plan.layers[0], below, plan, diagnostics);
    EXPECT_NEAR(plan.layers[0].glue_area_mm2, (160 - 6.2) * (80 - 6.2), 1);
    EXPECT_NEAR(plan.layers[0].glue_centroid[0], 100, 1e-3);
    EXPECT_NEAR(plan.layers[0].glue_centroid[1], 50, 1e-3);
    EXPECT_NEAR(plan.layers[0].press_force_n, std::min(17000.0, 0.5 * plan.layers[0].glue_area_mm2), 10);
    EXPECT_TRUE(diagnostics.empty()) << diagnostics[0].message;
    for (const Point2 p : plan.layers[0].glue.points) {
        EXPECT_GE(to_mm(p.x), 23 - 1e-4);
        EXPECT_LE(to_mm(p.x), 177 + 1e-4);
    }
    plan.stock_max = {2000, 1000};  // a joint so large that the press itself is the limit
    Loops wide;
    add_rectangle(wide, 0, 0, 2000, 1000);
    bond_layer(plan.layers[0], wide, plan, diagnostics);
    EXPECT_EQ(plan.layers[0].press_force_n, 17000);
}

// An outline as a section of many facets has it: the glue keeps its distance from it everywhere, with far
// fewer points.
TEST(Bonding, GlueOfAnOutlineOfManyPointsKeepsItsSetback) {
    constexpr int points = 40000;
    Plan plan = plan_of_layers(1);
    Loops below;
    for (int k = 0; k < points; ++k) {
        const double a = 2 * std::numbers::pi * k / points,
                     r = 60 + 8 * std::sin(7 * a) + 0.02 * std::sin(900 * a);
        below.points.push_back({to_units(100 + r * std::cos(a)), to_units(80 + r * std::sin(a))});
    }
    below.close_loop();
    std::vector<Diagnostic> diagnostics;
    bond_layer(plan.layers[0], below, plan, diagnostics);
    const Loops& glue = plan.layers[0].glue;
    ASSERT_EQ(glue.size(), 1U);
    EXPECT_LT(glue.points.size(), 2000U);
    const double setback = plan.job.bonding.edge_setback;
    double farthest = 0;
    for (std::size_t k = 0; k < glue.points.size(); ++k) {
        const Point2 a = glue.points[k], b = glue.points[(k + 1) % glue.points.size()];
        const double dx = to_mm(b.x - a.x), dy = to_mm(b.y - a.y), l2 = dx * dx + dy * dy;
        double nearest = 1e300;
        for (const Point2 p : below.points) {
            const double x = to_mm(p.x - a.x), y = to_mm(p.y - a.y),
                         t = std::clamp((x * dx + y * dy) / l2, 0.0, 1.0);
            nearest = std::min(nearest, std::hypot(x - t * dx, y - t * dy));
        }
        ASSERT_GE(nearest, setback - 1e-3) << "at " << to_mm(a.x) << ' ' << to_mm(a.y);
        farthest = std::max(farthest, nearest);
    }
    EXPECT_LE(farthest, setback + 0.25) << "and no farther from it than that";
}

TEST(Bonding, MomentsAgreeWithBruteForceOnAFrameWithAHole) {
    // Uneven pressure is limited at the joint's edge; the same number from a grid of small squares.
    const unsigned seed = 20260;
    std::mt19937 random(seed);
    RecordProperty("seed", static_cast<int>(seed));
    std::printf("seed %u\n", seed);
    for (int round = 0; round < 20; ++round) {
        const auto pick = [&](int low, int high) {
            return static_cast<double>(std::uniform_int_distribution<int>(low, high)(random));
        };
        const double x0 = pick(0, 40), y0 = pick(0, 30), x1 = pick(150, 200), y1 = pick(70, 100);
        const double hx0 = pick(60, 70), hy0 = pick(40, 45), hx1 = pick(90, 120), hy1 = pick(55, 60);
        Plan plan = plan_of_layers(1);
        plan.job.bonding.edge_setback = 0;
        plan.job.bonding.press_force = 1e7;
        Loops below;
        add_rectangle(below, x0, y0, x1, y1);
        add_rectangle(below, hx0, hy0, hx1, hy1, true);
        std::vector<Diagnostic> diagnostics;
        bond_layer(plan.layers[0], below, plan, diagnostics);
        double a = 0, sx = 0, sy = 0, sxx = 0, syy = 0;
        const double h = 0.5;
        for (double x = x0 + h / 2; x < x1; x += h)
            for (double y = y0 + h / 2; y < y1; y += h) {
                if (x > hx0 && x < hx1 && y > hy0 && y < hy1) continue;
                a += h * h, sx += h * h * x, sy += h * h * y, sxx += h * h * x * x, syy += h * h * y * y;
            }
        const double cx = sx / a, cy = sy / a, ix = sxx - a * cx * cx, iy = syy - a * cy * cy;
        const double rx = std::max(x1 - cx, cx - x0), ry = std::max(y1 - cy, cy - y0);
        const double force =
            a * 0.5 / (1 + std::fabs(100 - cx) * rx * a / ix + std::fabs(50 - cy) * ry * a / iy);
        EXPECT_NEAR(plan.layers[0].glue_area_mm2, a, 1e-6);
        EXPECT_NEAR(plan.layers[0].glue_centroid[0], cx, 1e-6);
        EXPECT_NEAR(plan.layers[0].glue_centroid[1], cy, 1e-6);
        EXPECT_NEAR(plan.layers[0].press_force_n, force, 1e-3 * force);
    }
}

TEST(Bonding, ARibInACornerTipsTheSlab) {
    Plan plan = plan_of_layers(1);
    Loops below;
    add_rectangle(below, 10, 10, 40, 40);
    std::vector<Diagnostic> diagnostics;
    bond_layer(plan.layers[0], below, plan, diagnostics);
    EXPECT_TRUE(has(diagnostics, "schedule.tips"));
    EXPECT_GT(plan.layers[0].press_force_n, 0);
    EXPECT_LT(plan.layers[0].press_force_n, 0.5 * plan.layers[0].glue_area_mm2)
        << "off its centroid the press must be gentler";

    // Two ribs at the slab's ends carry its middle between them.
    Loops two;
    add_rectangle(two, 10, 10, 40, 90);
    add_rectangle(two, 160, 10, 190, 90);
    diagnostics.clear();
    bond_layer(plan.layers[0], two, plan, diagnostics);
    EXPECT_FALSE(has(diagnostics, "schedule.tips"));
}

TEST(Bonding, ThinRibsAndSmallPostsAreReported) {
    Plan plan = plan_of_layers(1);
    Loops below;
    add_rectangle(below, 20, 10, 180, 90);
    add_rectangle(below, 60, 30, 140, 70, true);  // a hole, and in it a rib too thin for glue
    add_rectangle(below, 80, 48, 120, 52);
    std::vector<Diagnostic> diagnostics;
    bond_layer(plan.layers[0], below, plan, diagnostics);
    ASSERT_EQ(diagnostics.size(), 1u);
    EXPECT_EQ(diagnostics[0].code, "schedule.island_without_glue");
    EXPECT_NEAR(diagnostics[0].where->at(0), 100, 1e-3);
    EXPECT_NEAR(diagnostics[0].where->at(1), 50, 1e-3);

    Loops post;
    add_rectangle(post, 95, 45, 105, 55);
    diagnostics.clear();
    bond_layer(plan.layers[0], post, plan, diagnostics);
    EXPECT_TRUE(has(diagnostics, "schedule.weak_joint"));

    Loops thin;
    add_rectangle(thin, 50, 48, 150, 52);
    diagnostics.clear();
    bond_layer(plan.layers[0], thin, plan, diagnostics);
    EXPECT_TRUE(has(diagnostics, "schedule.no_glue"));
    EXPECT_EQ(plan.layers[0].press_force_n, 0);
    diagnostics.clear();
    bond_layer(plan.layers[0], Loops{}, plan, diagnostics);
    EXPECT_TRUE(has(diagnostics, "schedule.no_glue"));
}
