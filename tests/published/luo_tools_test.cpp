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

class LuoTools : public testing::TestWithParam<Source> {
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

    ToolChoice choose(double z_bottom_in, double z_top_in) {
        const LayerJob layer = luo_layer(mesh, job, features, z_bottom_in, z_top_in);
        ToolChoice choice = select_tools(
            context, layer,
            GetParam() == Source::tables ? tables(z_bottom_in) : reach_ratio(context, layer, nullptr));
        for (const ToolCandidate& c : choice.record.candidates)
            std::printf("%-10s %-4s T%-2d AR %.4f AS %6.1f mm2 stepdown %.4f in %6.2f min: %s\n",
                        c.purpose.c_str(), c.chosen ? "yes" : "no", c.tool, c.accessibility.value_or(NAN),
                        c.semi_rough_mm2.value_or(NAN), c.stepdown.value_or(NAN) / kInch,
                        c.minutes.value_or(NAN), c.reason.c_str());
        return choice;
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
    EXPECT_NEAR(choice.record.finish_stepdown, 0.0639 * kInch, 0.0005 * kInch)
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

INSTANTIATE_TEST_SUITE_P(Accessibility, LuoTools, testing::Values(Source::tables, Source::printed),
                         [](const auto& source) {
                             return source.param == Source::printed ? "printed" : "tables";
                         });

}  // namespace
}  // namespace slabwright
