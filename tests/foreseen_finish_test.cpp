// What a ball has to do on a layer's slopes, and which ball is chosen by it.
#include "engine/tool_choice/foreseen_finish.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "engine/planner/planner.h"
#include "engine/tools/libraries.h"
#include "kernels/cutting/cusp.h"
#include "tests/support/height_field.h"

namespace slabwright {
namespace {

constexpr double kHalf = 40;  // mm, of the fields' sides

struct OneLayer {
    Context context;
    Job job;
    Mesh mesh;
    LayerJob layer;

    template <class Height>
    explicit OneLayer(Height&& height, double step = 1, int threads = 0)
        : context({.threads = threads}),
          mesh(test::height_field(context, static_cast<int>(2 * kHalf / step), step, height)) {
        job.tools = shop_library();
        layer.mesh = mesh.view();
        layer.job = &job;
        layer.z_top = 18;
        layer.slab_thickness = 19;
        layer.floor_below = -5;
        layer.stock_min = {-kHalf - 20, -kHalf - 20};
        layer.stock_max = {kHalf + 20, kHalf + 20};
    }
    [[nodiscard]] const Tool& ball(double diameter) const {
        return *std::find_if(job.tools.begin(), job.tools.end(), [&](const Tool& t) {
            return t.kind == ToolKind::ball && std::abs(t.diameter - diameter) < 1e-6;
        });
    }
    [[nodiscard]] FinishWork work(double diameter) {
        const LayerSolid solid = layer_solid(context, layer.mesh, layer.floor_below, layer.z_top);
        return finish_work(context, layer, solid, ball(diameter));
    }
};

// A roof: two planes that meet in a ridge along y.
TEST(FinishWork, OfAPlaneItIsItsAreaOverTheStep) {
    for (const double degrees : {20.0, 60.0}) {
        const double alpha = degrees * std::numbers::pi / 180;
        OneLayer one([&](double x, double) { return 17.5 - std::tan(alpha) * std::min(std::abs(x), 9.0); });
        const double area = 2 * 9.0 / std::cos(alpha) * 2 * kHalf;
        for (const double diameter : {0.25 * kInch, 0.5 * kInch}) {
            const FinishWork work = one.work(diameter);
            const Tool& ball = one.ball(diameter);
            const double cusp = one.job.tolerances.cusp, r = diameter / 2;
            if (degrees > 45) {
                const double down = std::min(ball.stepdown_max, ball_level_stepdown(r, alpha, cusp));
                EXPECT_NEAR(work.contours_mm, area * std::sin(alpha) / down, 0.02 * work.contours_mm);
                EXPECT_EQ(work.lines_mm, 0);
            } else {
                EXPECT_NEAR(work.lines_mm, area / raster_stepover(r, cusp, 0), 0.02 * work.lines_mm);
                EXPECT_EQ(work.contours_mm, 0);
            }
        }
    }
}

// In a groove of two planes at slope α a ball touches both at r·tan α from its bottom, along the slope; up to
// the cusp it may pass by a little less.
TEST(FinishWork, InAGrooveItLeavesWhatTheBallDoesNotTouch) {
    const double alpha = 50 * std::numbers::pi / 180;
    OneLayer one([&](double x, double) { return 3 + std::tan(alpha) * std::min(std::abs(x), 11.0); }, 0.5);
    const double cusp = one.job.tolerances.cusp;
    for (const double diameter : {0.125 * kInch, 0.25 * kInch, 0.5 * kInch}) {
        const double r = diameter / 2;
        const auto left = [&](double over) {
            // At a distance s < r·tan α along the slope from the bottom the ball that would touch there has
            // its middle (r·tan α − s)·sin 2α in the other plane.
            const double s = r * std::tan(alpha) - over / std::sin(2 * alpha);
            return 2 * 2 * kHalf * std::max(0.0, s);
        };
        const double found = one.work(diameter).left_mm2;
        EXPECT_LE(found, 1.03 * left(0)) << diameter;
        EXPECT_GE(found, 0.97 * left(2 * cusp)) << diameter;
    }
}

TEST(FinishWork, IsTheSameOnAnyNumberOfThreads) {
    const auto waves = [](double x, double y) { return 9 + 6 * std::cos(x / 5) * std::cos(y / 7); };
    OneLayer one(waves);
    const FinishWork some = one.work(6.35);
    EXPECT_GT(some.contours_mm + some.lines_mm, 100);
    for (const int threads : {1, 4}) {
        OneLayer again(waves, 1, threads);
        const FinishWork same = again.work(6.35);
        EXPECT_EQ(same.contours_mm, some.contours_mm);
        EXPECT_EQ(same.lines_mm, some.lines_mm);
        EXPECT_EQ(same.left_mm2, some.left_mm2);
    }
}

// Gentle waves are for the widest ball; narrow grooves in them, of which it leaves much, for a narrower one.
TEST(ForeseenFinish, TheWidestBallThatLeavesLittleIsBest) {
    OneLayer gentle([](double x, double y) { return 12 + 3 * std::cos(x / 12) * std::cos(y / 12); });
    OneLayer grooved([](double x, double) { return 12 + 3 * std::cos(x / 0.9); }, 0.25);
    const Tool quarter = gentle.ball(0.25 * kInch);
    const ForeseenFinish wide(gentle.context, gentle.layer, quarter);
    EXPECT_DOUBLE_EQ(wide.ranked().front().diameter, 0.5 * kInch);
    const ForeseenFinish narrow(grooved.context, grooved.layer, quarter);
    EXPECT_DOUBLE_EQ(narrow.ranked().front().diameter, 0.125 * kInch);
    for (const Tool& tool : gentle.job.tools) {
        ASSERT_EQ(wide.minutes(tool.number).has_value(), tool.kind == ToolKind::ball);
        if (tool.kind != ToolKind::ball) continue;
        EXPECT_LE(*wide.minutes(wide.ranked().front().number), *wide.minutes(tool.number));
    }
    // Nothing to finish: whichever was preferred.
    OneLayer level([](double, double) { return 12.0; });
    EXPECT_EQ(ForeseenFinish(level.context, level.layer, quarter).ranked().front().number, quarter.number);

    // Once planned: with the widest ball none should be faster; with the narrowest a wider one.
    const LayerPace pace{5, 6, 9, 9.2};
    EXPECT_FALSE(wide.better_than(gentle.ball(0.5 * kInch), pace));
    const std::optional<Tool> better = wide.better_than(gentle.ball(0.125 * kInch), pace);
    ASSERT_TRUE(better);
    EXPECT_DOUBLE_EQ(better->diameter, 0.5 * kInch);
    const int widest = better->number;
    EXPECT_FALSE(wide.better_than(gentle.ball(0.125 * kInch), pace, 0.1)) << "not by so much";
    const std::optional<Tool> next = wide.better_than(gentle.ball(0.125 * kInch), pace, 1, {&widest, 1});
    ASSERT_TRUE(next);
    EXPECT_EQ(next->number, quarter.number);
    // Where nearly all the time goes into what is left the widest is not it.
    EXPECT_FALSE(narrow.better_than(grooved.ball(0.125 * kInch), pace));
    Tool other = quarter;
    other.number = 99;
    EXPECT_FALSE(wide.better_than(other, pace)) << "no ball of the job's";
}

TEST(ForeseenFinish, NotWithABallThatItsEdgesAloneBend) {
    Job job;
    for (const char* name : {"shop", "metric", "forms"}) {
        job.tools = *named_library(name);
        EXPECT_TRUE(finish_is_foreseeable(job)) << name;
    }
    job.tools = luo_library();
    EXPECT_FALSE(finish_is_foreseeable(job)) << "1/8 in, of steel, 40 mm long";
    std::erase_if(job.tools, [](const Tool& t) { return t.kind == ToolKind::ball && t.diameter < 4; });
    EXPECT_TRUE(finish_is_foreseeable(job));
}

// Of random fields: what is foreseen takes hardly longer than the best of all sets, and fewer sets are
// planned whole.
TEST(ForeseenFinish, HardlySlowerThanTheBestOfAll) {
    double foreseen = 0, best = 0;
    std::size_t whole_foreseen = 0, whole_all = 0;
    for (const unsigned seed : {1U, 2U, 3U, 4U}) {
        std::mt19937 random(seed);
        const auto draw = [&](double low, double high) {
            return std::uniform_real_distribution<double>(low, high)(random);
        };
        const double wave = draw(3, 12), high = draw(2, 5), slot = draw(2, 9), at = draw(-15, 15);
        Context context;
        const Mesh mesh =
            test::height_field(context, static_cast<int>(2 * kHalf), 1, [&](double x, double y) {
                if (std::abs(y - at) < slot && std::abs(x) < 25) return 5.0;
                return 11 + high * std::cos(x / wave) * std::cos(y / wave);
            });
        Job job;
        job.tools = shop_library();
        job.slabs.thicknesses = {19};
        for (const bool foresee : {true, false}) {
            job.selection.foresee = foresee;
            const Plan plan = make_plan(context, mesh, {}, job);
            (foresee ? foreseen : best) += plan.totals.cutting_minutes + plan.totals.tool_change_minutes;
            for (const Layer& layer : plan.layers) {
                ASSERT_TRUE(layer.selection);
                const std::vector<ToolSet>& sets = layer.selection->sets;
                EXPECT_EQ(std::count_if(sets.begin(), sets.end(), [](const ToolSet& s) { return s.chosen; }),
                          1);
                for (const ToolSet& set : sets) {
                    EXPECT_FALSE(set.reason.empty());
                    EXPECT_FALSE(set.tools.empty());
                    if (set.left_mm2) ++(foresee ? whole_foreseen : whole_all);
                }
            }
        }
    }
    EXPECT_LT(foreseen, 1.05 * best);
    EXPECT_LT(2 * whole_foreseen, whole_all);
}

}  // namespace
}  // namespace slabwright
