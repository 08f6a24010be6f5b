// Which tools a layer gets: the fixed set, what follows it, and the choice between it and others.
#include "engine/tools/tools.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <span>
#include <vector>

#include "engine/cutting_data.h"
#include "engine/planner/planner.h"
#include "engine/tool_choice/select.h"
#include "engine/tools/libraries.h"
#include "kernels/errors.h"
#include "tests/support/height_field.h"

namespace slabwright {
namespace {

TEST(Tools, TheDefaultLibraryLeavesNothingToChoose) {
    const Job job;
    EXPECT_FALSE(selects_tools(job));
    const LayerTools tools = fixed_tools(job);
    EXPECT_EQ(tools.rough.number, 2);
    EXPECT_EQ(tools.finish.number, 3);
    EXPECT_TRUE(tools.semi_rough.empty());
    EXPECT_TRUE(tools.rest.empty());
    Job without = job;
    without.tools.pop_back();
    EXPECT_THROW((void)fixed_tools(without), Error);
}

TEST(Tools, LuosLibrary) {
    Job job;
    job.tools = luo_library();
    EXPECT_NO_THROW(validate(job));
    EXPECT_GE(max_layer_thickness(job), 18.5) << "all of them reach through a 19 mm slab";
    EXPECT_TRUE(selects_tools(job));
    job.selection.mode = SelectionMode::fixed;
    EXPECT_FALSE(selects_tools(job));
    const LayerTools tools = fixed_tools(job);
    EXPECT_DOUBLE_EQ(tools.rough.diameter, 12.7) << "LUO's fixed set, wherever it stands in the library";
    EXPECT_DOUBLE_EQ(tools.finish.diameter, 6.35);
    ASSERT_EQ(tools.rest.size(), 3U);
    EXPECT_EQ(tools.rest[0].kind, ToolKind::flat);
    EXPECT_DOUBLE_EQ(tools.rest[0].diameter, 6.35);
    EXPECT_DOUBLE_EQ(tools.rest[1].diameter, 3.175);
    EXPECT_EQ(tools.rest[1].kind, ToolKind::flat) << "a flat goes before a ball of its size";
    EXPECT_EQ(tools.rest[2].kind, ToolKind::ball);
    const std::optional<LayerTools> wider = with_wider_finish(job, tools);
    ASSERT_TRUE(wider.has_value());
    EXPECT_DOUBLE_EQ(wider->finish.diameter, 12.7);
    EXPECT_EQ(wider->rough.number, tools.rough.number);
    EXPECT_TRUE(std::any_of(wider->rest.begin(), wider->rest.end(), [&](const Tool& t) {
        return t.number == tools.finish.number;
    })) << "where the wider one does not reach";
    LayerTools widest = tools;
    widest.finish = luo_library().back();
    EXPECT_FALSE(with_wider_finish(job, widest).has_value());
}

// The shop's libraries reach through a 19 mm slab as the default set does, so that nobody pays for a small
// tool with layers; and their fixed set is print's, in metric the nearest to it.
TEST(Tools, TheShopsLibraries) {
    for (const std::vector<Tool>& tools : {shop_library(), metric_library()}) {
        Job job;
        job.tools = tools;
        EXPECT_NO_THROW(validate(job));
        EXPECT_DOUBLE_EQ(max_layer_thickness(job), max_layer_thickness(Job{}));
        EXPECT_TRUE(selects_tools(job));
        const LayerTools fixed = fixed_tools(job);
        EXPECT_EQ(fixed.rough.number, 2);
        EXPECT_EQ(fixed.finish.number, 3);
        for (std::size_t i = 0; i < tools.size(); ++i) {
            EXPECT_EQ(tools[i].number, static_cast<int>(i) + 1);
            EXPECT_GT(tools[i].stickout, tools[i].flute_length);
            if (tools[i].shank_diameter > tools[i].diameter) {
                EXPECT_GE(max_layer_of(job, tools[i]), max_layer_thickness(Job{})) << "it would touch walls";
            }
            const bool solid = is_end_mill(tools[i].kind) && tools[i].diameter < 13;
            EXPECT_EQ(tools[i].modulus_gpa, solid ? 550 : 200) << tools[i].name;
        }
        const auto count = [&](ToolKind kind) {
            return std::count_if(tools.begin(), tools.end(), [&](const Tool& t) { return t.kind == kind; });
        };
        EXPECT_EQ(count(ToolKind::face), 1);
        EXPECT_EQ(count(ToolKind::flat), 4);
        EXPECT_EQ(count(ToolKind::ball), 3);
    }
    const std::vector<Tool> shop = shop_library(), luo = luo_library(), fixed = Job{}.tools;
    for (std::size_t i = 0; i < fixed.size(); ++i) {
        EXPECT_EQ(shop[i].name, fixed[i].name);
        EXPECT_EQ(shop[i].stickout, fixed[i].stickout);
    }
    for (const Tool& tool : shop)
        for (const Tool& printed : luo)
            if (tool.kind == printed.kind && std::abs(tool.diameter - printed.diameter) < 1e-9) {
                EXPECT_EQ(tool.stepdown_min, printed.stepdown_min) << tool.name;
                if (tool.diameter < 4 || (tool.kind == ToolKind::ball && tool.diameter < 12)) {
                    EXPECT_EQ(tool.stepdown_max, printed.stepdown_max) << tool.name;
                }
            }
}

// Charts of chip loads in MDF hold one diameter deep; two deep they are a quarter less, three deep a half.
TEST(Tools, FlatsOfTheShopGoAsDeepAsPublishedChipLoadsAllow) {
    int charted = 0;
    for (const std::vector<Tool>& tools : {shop_library(), metric_library()})
        for (const Tool& tool : tools) {
            if (tool.kind != ToolKind::flat) continue;
            const double deep = tool.stepdown_max / tool.diameter,
                         chip = tool.max_feed / (tool.max_rpm * tool.flutes);
            EXPECT_LE(tool.stepdown_max, tool.flute_length);
            const std::span<const CuttingData> lines = lines_of(CuttingChart::mdf);
            const auto line = std::find_if(lines.begin(), lines.end(), [&](const CuttingData& data) {
                return covers(data, tool.kind, tool.diameter, tool.flutes);
            });
            if (line == lines.end()) {
                EXPECT_GT(tool.diameter, 13) << tool.name;
                EXPECT_NEAR(deep, 1, 1e-12) << "wider than all of the chart";
                continue;
            }
            int allowed = 0;
            for (const double share : {1.0, 0.75, 0.5})
                if (share * line->chip_load >= chip) ++allowed;
            if (allowed == 0) EXPECT_LE(deep, 0.5 + 1e-12) << tool.name << ": Luo's";
            else EXPECT_NEAR(deep, std::min(allowed, 2), 1e-12) << tool.name;
            ++charted;
        }
    EXPECT_EQ(charted, 6);
    for (const std::vector<Tool>& tools : {shop_library(), metric_library()})
        for (const Tool& tool : tools)
            if (tool.kind == ToolKind::ball) {
                EXPECT_NEAR(tool.stepdown_max, tool.diameter / 2, 1e-12) << tool.name;
            }
}

TEST(Tools, LevelsAreEvenDownToEveryFloor) {
    const std::vector<double> floors{4, 9.5, 30};
    EXPECT_EQ(even_levels(12, 0, floors, 2),
              (std::vector<double>{10.75, 9.5, 9.5 - 5.5 / 3, 9.5 - 11.0 / 3, 4, 2, 0}));
    EXPECT_EQ(even_levels(12, 0, {}, 20), (std::vector<double>{0}));
    for (const double step : {0.3, 1.0, 3.7}) {
        double z = 12;
        for (const double tip : even_levels(12, 0, floors, step)) {
            EXPECT_LE(z - tip, step + 1e-9);
            z = tip;
        }
        EXPECT_EQ(z, 0);
    }
}

TEST(Tools, ALayerIsNeverSlowerThanWithTheFixedSet) {
    Context context;
    // A block with a pocket of 24 mm, and a channel of 4 mm that only the 1/8 in tools enter.
    const Mesh mesh = test::height_field(context, 40, 2, [](double x, double y) {
        if (std::abs(x) < 13 && std::abs(y) < 13) return 6.0;
        return std::abs(y - 25) < 3 && std::abs(x) < 25 ? 8.0 : 14.0;
    });
    Job job;
    job.tools = luo_library();
    job.slabs.thicknesses = {15};
    const Plan foreseen = make_plan(context, mesh, {}, job);
    job.selection.foresee = false;
    const Plan chosen = make_plan(context, mesh, {}, job);
    job.selection.mode = SelectionMode::fixed;
    const Plan fixed = make_plan(context, mesh, {}, job);
    auto minutes = [](const Plan& plan) {
        return plan.totals.cutting_minutes + plan.totals.tool_change_minutes;
    };
    EXPECT_LE(minutes(chosen), minutes(fixed) + 1e-6);
    EXPECT_LE(minutes(foreseen), minutes(fixed) + 1e-6);
    for (const Layer& layer : chosen.layers) {
        ASSERT_TRUE(layer.selection.has_value());
        const std::vector<ToolSet>& sets = layer.selection->sets;
        ASSERT_GE(sets.size(), 2U);
        EXPECT_EQ(sets.front().name, "fixed") << "the others are measured by it";
        EXPECT_EQ(sets[1].name, "selected");
        EXPECT_EQ(std::count_if(sets.begin(), sets.end(), [](const ToolSet& s) { return s.name == "fixed"; }),
                  1);
        EXPECT_EQ(std::count_if(sets.begin(), sets.end(), [](const ToolSet& s) { return s.chosen; }), 1);
        const auto taken = std::find_if(sets.begin(), sets.end(), [](const ToolSet& s) { return s.chosen; });
        EXPECT_LE(taken->minutes, sets.front().minutes);
        ASSERT_TRUE(sets.front().left_mm2 && taken->left_mm2);
        EXPECT_LE(*taken->left_mm2, 1.1 * *sets.front().left_mm2 + 5);
        for (const ToolSet& other : sets) {
            EXPECT_FALSE(other.reason.empty());
            // Of a set that was given up only the first programs are known.
            if (other.left_mm2 && *other.left_mm2 <= *sets.front().left_mm2) {
                EXPECT_LE(taken->minutes, other.minutes);
            }
        }
        // None is planned twice.
        for (std::size_t s = 0; s < sets.size(); ++s)
            for (std::size_t t = 0; t < s; ++t)
                EXPECT_FALSE(sets[s].tools == sets[t].tools && sets[s].minutes == sets[t].minutes) << s;
        for (const ToolCandidate& c : layer.selection->candidates) EXPECT_FALSE(c.reason.empty());
    }
    for (const Layer& layer : fixed.layers) EXPECT_FALSE(layer.selection.has_value());
}

// A library with a slender ball and a stout one as wide: where the slender one would bend too far at any feed
// and depth, the stout one is taken, though it were slower; and no warning is left.
TEST(Tools, AStifferTwinIsTakenWhereTheCutterWouldBend) {
    Context context;
    const Mesh mesh = test::height_field(context, 30, 1.5, [](double x, double y) {
        return std::abs(x) < 4.5 && std::abs(y) < 20 ? 2.0 : 14.0;
    });
    Job job;
    job.slabs.thicknesses = {15};
    Tool slender = job.tools[2];
    slender.number = 7;
    slender.stickout = 110;
    job.tools.insert(job.tools.begin() + 2, slender);
    const auto bends = [](const Plan& plan) {
        return std::count_if(plan.diagnostics.begin(), plan.diagnostics.end(),
                             [](const Diagnostic& d) { return d.code == "cut.deflection"; });
    };
    job.selection.mode = SelectionMode::fixed;
    EXPECT_GT(bends(make_plan(context, mesh, {}, job)), 0);
    job.selection.mode = SelectionMode::select;
    const Plan plan = make_plan(context, mesh, {}, job);
    EXPECT_EQ(bends(plan), 0);
    for (const Layer& layer : plan.layers)
        for (const Operation& op : layer.operations) EXPECT_NE(op.tool, 7) << op.purpose;
}

TEST(Tools, AStifferTwinHasTheSameWidthAndBendsLess) {
    Job job;
    Tool shorter = job.tools[2], thinner = job.tools[1];
    shorter.number = 7, shorter.stickout -= 8, shorter.stepdown_max -= 0.5;
    thinner.number = 8, thinner.diameter -= 1, thinner.stickout -= 20;
    const LayerTools fixed = fixed_tools(job);
    EXPECT_FALSE(stiffer_tools(job, fixed));
    job.tools.push_back(shorter);
    job.tools.push_back(thinner);
    const std::optional<LayerTools> stiffer = stiffer_tools(job, fixed);
    ASSERT_TRUE(stiffer);
    EXPECT_EQ(stiffer->finish.number, 7);
    EXPECT_EQ(stiffer->finish.stepdown_max, shorter.stepdown_max);
    EXPECT_EQ(stiffer->rough.number, fixed.rough.number);
    // Of carbide, and longer by less than makes up for it.
    Tool carbide = job.tools[2];
    carbide.number = 9, carbide.modulus_gpa = 550;
    carbide.flute_length = carbide.stickout = 1.2 * shorter.stickout;
    job.tools.push_back(carbide);
    EXPECT_LT(tip_bent_by(carbide, 5), tip_bent_by(shorter, 5));
    EXPECT_EQ(stiffer_tools(job, fixed)->finish.number, 9);
    job.tools.back().flute_length = job.tools.back().stickout = 1.5 * shorter.stickout;
    EXPECT_GT(tip_bent_by(job.tools.back(), 5), tip_bent_by(shorter, 5));
    EXPECT_EQ(stiffer_tools(job, fixed)->finish.number, 7);
}

// One narrow place does not decide for the layer: the small tools cut there and nowhere else, and with their
// changes counted the layer takes less time than if they cut all of it.
TEST(Tools, ANarrowSlotIsCutBySmallToolsAlone) {
    Context context;
    // A wide wavy field, of facets so small that the widest ball lies on each, and in it a slot of 4 mm at
    // y = 25 that no tool over 1/8 in enters.
    const Mesh mesh = test::height_field(context, 80, 1, [](double x, double y) {
        return std::abs(y - 25) < 2.5 && std::abs(x) < 16 ? 3.0
                                                          : 10 + 2.5 * std::cos(x / 11) * std::cos(y / 11);
    });
    Job job;
    job.tools = luo_library();
    job.selection.accessibility = AccessRule::exact;
    job.slabs.thicknesses = {15};
    const Plan plan = make_plan(context, mesh, {}, job);
    ASSERT_EQ(plan.layers.size(), 1U);
    const Layer& layer = plan.layers.front();
    constexpr double small = 4;
    auto diameter = [&](int number) {
        return std::find_if(job.tools.begin(), job.tools.end(),
                            [&](const Tool& t) { return t.number == number; })
            ->diameter;
    };
    int in_slot = 0, elsewhere = 0;
    double minutes = 0;
    const Operation* before = nullptr;
    for (const Operation& op : layer.operations) {
        minutes += op.minutes;
        if (before && before->tool != op.tool) minutes += job.machine.tool_change_s / 60;
        before = &op;
        if (diameter(op.tool) > small) {
            ++elsewhere;
            continue;
        }
        ++in_slot;
        EXPECT_NE(op.purpose.find("narrow"), std::string::npos) << op.purpose;
        for (const Move& m : op.moves)
            if (m.feed > 0) {
                EXPECT_LT(std::abs(to_mm(m.y) - 25), 6) << op.purpose;
                EXPECT_LT(std::abs(to_mm(m.x)), 20) << op.purpose;
            }
    }
    EXPECT_GT(in_slot, 0);
    EXPECT_GT(elsewhere, 2);
    // What is told of the set that was chosen: its time with the changes of tool, its tools, and why.
    ASSERT_TRUE(layer.selection);
    const auto& sets = layer.selection->sets;
    const auto chosen = std::find_if(sets.begin(), sets.end(), [](const ToolSet& s) { return s.chosen; });
    ASSERT_NE(chosen, sets.end());
    EXPECT_NEAR(chosen->minutes, minutes, 1e-6);
    EXPECT_EQ(chosen->reason, "takes the least time of those that leave no more");
    EXPECT_TRUE(
        std::any_of(chosen->tools.begin(), chosen->tools.end(), [&](int t) { return diameter(t) < small; }));

    Job only_small = job;
    std::erase_if(only_small.tools, [](const Tool& t) {
        return (t.kind == ToolKind::flat || t.kind == ToolKind::ball) && t.diameter > small;
    });
    ASSERT_EQ(only_small.tools.size(), 3U);
    const Plan everywhere = make_plan(context, mesh, {}, only_small);
    EXPECT_LT(plan.totals.cutting_minutes + plan.totals.tool_change_minutes,
              everywhere.totals.cutting_minutes + everywhere.totals.tool_change_minutes);
    const auto used = [](const Plan& of) {
        std::set<int> tools;
        for (const Operation& op : of.layers.front().operations) tools.insert(op.tool);
        return tools.size();
    };
    EXPECT_GT(used(plan), used(everywhere)) << "though more are loaded";
}

}  // namespace
}  // namespace slabwright
