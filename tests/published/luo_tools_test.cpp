// LUO 5.6: the tools of the sample part, layer by layer. Print's drawing is lost; the part is built from what
// the text says of it (see tests/data/luo_tool_sample.cpp), so that what LUO chooses follows from LUO's
// rules.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "engine/planner/planner.h"
#include "engine/tool_choice/reach_ratio.h"
#include "engine/tool_choice/select.h"
#include "kernels/cutting/cusp.h"
#include "kernels/mesh/mesh.h"
#include "kernels/mesh/weld.h"
#include "tests/data/models.h"
#include "tests/published/luo_sample.h"

namespace slabwright {
namespace {

// Where AR comes from: print's own tables 5.5 and 5.6, or their rule applied to this part.
enum class Source { tables, printed };

class LuoSample : public testing::Test {
protected:
    Context context;
    Mesh mesh = weld(context, luo_tool_sample());
    Job job = luo_job();
    std::vector<Feature> features = find_features(context, mesh.view(), feature_options(job)).features;

    // AR of LUO's tables; all tools have 100 % in the first layer.
    [[nodiscard]] static ReachRatio tables(double z_bottom_in) {
        return [z_bottom_in](const Tool& tool) {
            const double d = tool.diameter / kInch;
            if (z_bottom_in == 0) return 1.0;
            if (z_bottom_in < 1) return d > 0.9 ? 0.8829 : d > 0.6 ? 0.9618 : d > 0.4 ? 0.9700 : 0.9782;
            return d > 0.9 ? 0.9212 : d > 0.6 ? 0.9536 : d > 0.4 ? 0.9617 : d > 0.2 ? 0.9699 : 0.9958;
        };
    }

    /// The choice by the shares that `ratio` gives, or by those that print's rule gives for this part.
    ToolChoice choose(double z_bottom_in, double z_top_in, const ReachRatio& ratio) {
        const LayerJob layer = luo_layer(mesh, job, features, z_bottom_in, z_top_in);
        ToolChoice choice =
            select_tools(context, layer, ratio ? ratio : reach_ratio(context, layer, nullptr));
        for (const ToolCandidate& c : choice.record.candidates)
            std::printf("%-10s %-4s T%-2d AR %.4f AS %6.1f mm2 stepdown %.4f in %6.2f min: %s\n",
                        c.purpose.c_str(), c.chosen ? "yes" : "no", c.tool, c.accessibility.value_or(NAN),
                        c.semi_rough_mm2.value_or(NAN), c.stepdown.value_or(NAN) / kInch,
                        c.minutes.value_or(NAN), c.reason.c_str());
        return choice;
    }
};

class LuoTools : public LuoSample, public testing::WithParamInterface<Source> {
protected:
    ToolChoice choose(double z_bottom_in, double z_top_in) {
        return LuoSample::choose(z_bottom_in, z_top_in,
                                 GetParam() == Source::tables ? tables(z_bottom_in) : ReachRatio{});
    }
};

TEST_P(LuoTools, FirstLayerOneFlatEndMill) {
    const ToolChoice choice = choose(0, 0.75);
    EXPECT_TRUE(choice.record.vertical);
    EXPECT_NEAR(choice.tools.rough.diameter, 1.0 * kInch, 1e-9);
    EXPECT_NEAR(choice.tools.rough.stepdown_max, 0.25 * kInch, 1e-9);
    EXPECT_TRUE(choice.tools.semi_rough.empty());
    EXPECT_EQ(choice.record.candidates.size(), 1U) << "the largest reaches everything";
    EXPECT_GT(choice.record.candidates[0].accessibility.value_or(0), 0.999);
}

TEST_P(LuoTools, SecondLayer) {
    const ToolChoice choice = choose(0.75, 1.5);
    EXPECT_FALSE(choice.record.vertical);
    EXPECT_NEAR(choice.record.least_slope_deg, 87, 0.02);
    EXPECT_NEAR(choice.tools.finish.diameter, 0.25 * kInch, 1e-9);
    EXPECT_NEAR(choice.tools.rough.diameter, 0.5 * kInch, 1e-9);
    EXPECT_NEAR(choice.tools.rough.stepdown_max, 0.15 * kInch, 1e-9);
    EXPECT_TRUE(choice.tools.semi_rough.empty());
    EXPECT_NEAR(choice.record.finish_stepdown_printed, 0.0445 * kInch, 0.0001 * kInch);
    EXPECT_NEAR(choice.record.finish_stepdown, 0.06362 * kInch, 0.0001 * kInch)
        << "the same cusp, by the true limit";
    EXPECT_NEAR(choice.record.rough_stepdown, 0.191 * kInch, 0.001 * kInch);
}

TEST_P(LuoTools, ThirdLayer) {
    const ToolChoice choice = choose(1.5, 2.0);
    EXPECT_NEAR(choice.record.least_slope_deg, 87, 0.02);
    EXPECT_NEAR(choice.tools.finish.diameter, 0.125 * kInch, 1e-9);
    ASSERT_EQ(choice.tools.semi_rough.size(), 1U);
    EXPECT_NEAR(choice.tools.semi_rough[0].diameter, 0.125 * kInch, 1e-9);
    EXPECT_NEAR(choice.tools.semi_rough[0].stepdown_max, 0.0625 * kInch, 1e-9);
    EXPECT_NEAR(choice.tools.rough.diameter, 0.5 * kInch, 1e-9);
    EXPECT_NEAR(choice.tools.rough.stepdown_max, 0.15 * kInch, 1e-9);
    EXPECT_NEAR(choice.record.rough_stepdown, 0.191 * kInch, 0.001 * kInch);
}

// Print's shares go in above, so that its choices come out as long as the rule is print's: the first size,
// from the largest down, that reaches 97.5 %. Shares a little over and under it show that the rule is what
// decides.
TEST_F(LuoSample, TheFirstSizeOverTheThresholdIsTaken) {
    const auto finish_with = [&](double changed_in, double share) {
        const ReachRatio printed = tables(0.75);
        const ToolChoice choice = choose(0.75, 1.5, [&](const Tool& tool) {
            return std::abs(tool.diameter - changed_in * kInch) < 1e-9 ? share : printed(tool);
        });
        int asked = 0;
        for (const ToolCandidate& c : choice.record.candidates) {
            if (c.purpose != "finish") continue;
            ++asked;
            const bool last = c.tool == choice.tools.finish.number;
            EXPECT_EQ(c.chosen, last) << "T" << c.tool;
            EXPECT_EQ(c.accessibility.value_or(0) >= 0.975, c.chosen) << "T" << c.tool;
        }
        return std::pair{choice.tools.finish.diameter / kInch, asked};
    };
    const auto expect = [&](double changed_in, double share, double diameter_in, int asked) {
        const auto [diameter, sizes] = finish_with(changed_in, share);
        EXPECT_NEAR(diameter, diameter_in, 1e-9) << changed_in << " in at " << share;
        EXPECT_EQ(sizes, asked) << changed_in << " in at " << share;
    };
    expect(0.75, 0.9751, 0.75, 2);
    expect(0.75, 0.975, 0.75, 2);
    expect(0.75, 0.9749, 0.25, 4);
    expect(0.5, 0.9751, 0.5, 3);
    expect(0.25, 0.9749, 0.125, 5);
}

INSTANTIATE_TEST_SUITE_P(Accessibility, LuoTools, testing::Values(Source::tables, Source::printed),
                         [](const auto& source) {
                             return source.param == Source::printed ? "printed" : "tables";
                         });

}  // namespace
}  // namespace slabwright
