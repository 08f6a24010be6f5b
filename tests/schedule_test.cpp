// The machine's steps, their order and the totals.
#include "engine/schedule/schedule.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>

#include "tests/support/seed.h"

using namespace slabwright;

namespace {

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
        layer.joints.emplace_back().area_mm2 = 5000;
        layer.operations = {operation(OperationKind::face, 1, 1.5), operation(OperationKind::rough, 2, 4),
                            operation(OperationKind::finish, 3, 6), operation(OperationKind::finish, 3, 2)};
        plan.layers.push_back(layer);
    }
    return plan;
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

// One control may hold the programs of the build and those of its undersides.
TEST(Schedule, NoTwoProgramsOfABuildHaveOneNumber) {
    const unsigned seed = test::seed();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const auto below = [&](unsigned n) { return static_cast<std::size_t>(random() % n); };
    for (int round = 0; round < 60; ++round) {
        Plan plan = plan_of_layers(1 + static_cast<int>(below(round % 3 == 0 ? 90 : 20)));
        plan.job.machine.programs = static_cast<ProgramSpan>(below(3));
        const unsigned most = round % 2 == 0 ? 60 : 20;
        const auto fill = [&](Layer& layer) {
            layer.operations.clear();
            for (std::size_t k = 0; k < 1 + below(most); ++k)
                layer.operations.push_back(
                    operation(OperationKind::finish, 1 + static_cast<int>(below(3)), 1));
        };
        for (Layer& layer : plan.layers) {
            fill(layer);
            if (below(2) == 0) continue;
            Plan under;
            under.job = plan.job;
            under.turned.emplace().layer = layer.index;
            under.layers = {layer};
            fill(under.layers[0]);
            schedule(under);
            plan.undersides.push_back(std::move(under));
        }
        schedule(plan);
        std::map<int, std::string> numbers;
        const auto check = [&](const Plan& of, const std::string& folder) {
            for (const Layer& layer : of.layers)
                for (const Operation& op : layer.operations) {
                    const std::string file = folder + std::string(file_of(op.file));
                    EXPECT_GT(op.number, 0);
                    EXPECT_LE(op.number, 8000) << "from there on layers are faced off again";
                    EXPECT_EQ(numbers.emplace(op.number, file).first->second, file) << "O" << op.number;
                }
        };
        check(plan, "");
        for (const Plan& under : plan.undersides) check(under, underside_folder(under.turned->layer));
    }
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
            EXPECT_EQ(by_id[step.needs[0]]->action, "press")
                << "the handler holds the slab against the table";
        }
        if (step.action == "glue") {
            EXPECT_EQ(by_id[step.needs[0]]->action, "mill");
            EXPECT_EQ(by_id[step.needs[0]]->layer, 1);
        }
    }
}

TEST(Schedule, ATurnedSlabLiesOnTheBoard) {
    Plan under = plan_of_layers(1);
    under.turned.emplace().layer = 1;
    schedule(under);
    std::vector<std::string> actions;
    for (const SequenceStep& step : under.sequence) {
        actions.push_back(step.action);
        if (step.action == "place") {
            EXPECT_EQ(number(step, "z_bottom_mm"), 0);
        }
    }
    EXPECT_EQ(std::count(actions.begin(), actions.end(), "place"), 1);
    EXPECT_EQ(std::count(actions.begin(), actions.end(), "glue"), 0);
}

// Slabs that the machine carries take as long as its axes do.
TEST(Schedule, TheHandlersAxisGivesItsTimes) {
    Plan plan = plan_of_layers(2);
    plan.job.machine.handler_speed = 3000;  // 50 mm/s
    plan.job.machine.handler_travel = 1000;
    plan.job.machine.grip_s = 7;
    plan.job.machine.press_lift = 50;
    plan.job.machine.table_speed = 600;  // 10 mm/s, up and down again
    schedule(plan);
    std::vector<std::pair<std::string, double>> times;
    for (const SequenceStep& step : plan.sequence)
        if (step.action == "take_slab" || step.action == "clamp" || step.action == "place" ||
            step.action == "press")
            times.emplace_back(step.action, step.seconds);
    const std::vector<std::pair<std::string, double>> expected{
        {"take_slab", 0},  {"clamp", 7}, {"place", 20}, {"press", 47},
        {"take_slab", 20}, {"clamp", 7}, {"place", 20}, {"press", 47}};
    EXPECT_EQ(times, expected) << "no glue is stated, so nothing passes the head";
}

TEST(Schedule, TotalsAddUp) {
    Plan plan = plan_of_layers(3);
    plan.job.machine.handler_speed = 0;
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
