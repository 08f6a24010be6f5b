// LUO 6.5.3, tables 6.2 and 6.3: the map of finish tools over the tool sample and the layers that follow from it, published and computed.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "engine/layers/tool_map.h"
#include "engine/tools/tools.h"
#include "kernels/mesh/weld.h"
#include "tests/data/models.h"

namespace slabwright {
namespace {

TEST(LuoCombined, Table63FromTheSample) {
    Context context;
    const Mesh mesh = weld(context, luo_tool_sample());
    Job job;
    job.tools = luo_library();
    const FeatureSet found = find_features(context, mesh.view(), feature_options(job));
    const ToolMap map = tool_map(context, mesh.view(), job, found.features);
    ASSERT_EQ(map.tools.size(), 5U);
    const double table62[] = {0.125, 0.25, 0.5, 0.75, 1.0};
    for (std::size_t t = 0; t < 5; ++t) EXPECT_NEAR(map.tools[t].diameter, table62[t] * kInch, 1e-9);

    // The lengths of 6.5.3; .5 and .75 in, which print does not name, between those of their neighbours.
    const std::vector<double> lengths{0.57 * kInch, 3.4 * kInch, 5 * kInch, 6.5 * kInch, 8 * kInch};
    const std::vector<ToolSlice> layers = join_slices(map.slices, lengths, job.layers.min_layer);
    std::printf("LUO table 6.3                 published              computed\n");
    const double tops[] = {0.75, 1.70, 2.00}, tools[] = {1.0, 0.25, 0.125};
    for (std::size_t i = 0; i < std::max<std::size_t>(3, layers.size()); ++i) {
        std::printf("  layer %zu   ", i + 1);
        if (i < 3) std::printf("to %.2f in, %5.3f in   ", tops[i], tools[i]);
        if (i < layers.size()) std::printf("to %.3f in, %5.3f in", layers[i].z_high / kInch, map.tools[layers[i].tool].diameter / kInch);
        std::printf("\n");
    }
    ASSERT_EQ(layers.size(), 3U);
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(layers[i].z_high, tops[i] * kInch, 0.01) << i;
        EXPECT_NEAR(map.tools[layers[i].tool].diameter, tools[i] * kInch, 1e-9) << i;
    }
    std::printf("  the 10 minutes saved: print gives no times, and its sample's drawing is lost; see the corpus figures in bench/RESULTS.md\n");
}

}  // namespace
}  // namespace slabwright
