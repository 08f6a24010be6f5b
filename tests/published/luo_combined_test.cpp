// LUO 6.5.3: layers and tools together on the sample pattern. The tool map, the lengths and the layers are
// computed from the sample's geometry and from the forces of the job's cutters; run it to see them beside the
// print.
//
// What the print leaves open, and what is put in its place:
//   the part        figure 6.11 is lost in the scan. The text machines the part of 5.6 with the plan of 6.4
//   ("the previous tool size
//                   selection strategy"), so the part is the tool sample, built from what the text says of it
//                   (tests/data/luo_tool_sample.cpp).
//   the slot        table 6.3 has its floor at 1.70 in and .125 in as the largest tool from there to the top:
//   its width is print's only in that. the slices      print does not say how far apart: here .05 in, and at
//   the flats' heights too. AR              97.5 % as in 5.6, by what a disc leaves of a slice (print's rule
//   for corners loses R/ρ of every arc that a tool does reach). "similar" tool  print joins slices of "the
//   same or similar" tool and does not say how similar: here the same. δ = 0.002       without a unit; its
//   lengths are in inches. F               6.5.1's cut is a flat end mill's roughing; the finish tool's is
//   not given, and the three lengths of 6.5.3 share no force
//                   (luo_forces_test). Here it is each ball's own hardest finish cut: what roughing leaves on
//                   a wall, its largest stepdown, its feed.
//   flutes          tools of table 6.2 have no flute length. The library's flutes are longer than a slab
//   (5.6) and shorter than print's 8.0 and 3.4 in,
//                   so the flutes decide how tall a layer of the larger tools may be; .95 in is less than the
//                   .25 in tool's, more than a slab.
#include <gtest/gtest.h>

#include <cstdio>

#include "engine/layers/candidates.h"
#include "engine/layers/tool_map.h"
#include "engine/planner/planner.h"
#include "engine/tools/libraries.h"
#include "kernels/features/section_areas.h"
#include "kernels/mesh/weld.h"
#include "tests/data/models.h"

namespace slabwright {
namespace {

// LUO table 6.3, inches: z from, to, tool.
constexpr double kTable[][3] = {{0, 0.75, 1.0}, {0.75, 1.70, 0.25}, {1.70, 2.00, 0.125}};
constexpr double kNear = 1e-3;  // mm: the sample's vertices lie on a grid of 1/4096 mm

class LuoCombined : public testing::Test {
protected:
    Context context;
    Mesh mesh = weld(context, luo_tool_sample());
    Job job = [] {
        Job luo;
        luo.tools = luo_library();            // table 6.2 is table 5.4's five diameters
        luo.tolerances.cusp = 0.002 * kInch;  // δ
        luo.slabs.thicknesses = {0.75 * kInch};
        luo.slabs.facing_allowance = 0;
        return luo;
    }();
    std::vector<Feature> features = find_features(context, mesh.view(), feature_options(job)).features;
};

TEST_F(LuoCombined, ToolMap) {
    const ToolMap map = tool_map(context, mesh.view(), job, features);
    ASSERT_EQ(map.tools.size(), 5U);
    EXPECT_GT(map.slices.size(), 35U) << "slices of .05 in";
    std::vector<ToolSlice> joined;
    for (const ToolSlice& s : map.slices)
        if (!joined.empty() && joined.back().tool == s.tool) joined.back().z_high = s.z_high;
        else joined.push_back(s);
    std::printf(
        "LUO table 6.3, in: published / computed, and how tall a layer the tool may make (print: 8.0, 3.4, "
        ".57)\n");
    for (const ToolSlice& s : joined)
        std::printf("  %.3f to %.3f: %.3f in, %.2f in\n", s.z_low / kInch, s.z_high / kInch,
                    map.tools[s.tool].diameter / kInch, map.allowed_mm[s.tool] / kInch);
    ASSERT_EQ(joined.size(), 3U);
    for (int i = 0; i < 3; ++i) {
        EXPECT_NEAR(joined[i].z_low, kTable[i][0] * kInch, kNear);
        EXPECT_NEAR(joined[i].z_high, kTable[i][1] * kInch, kNear);
        EXPECT_NEAR(map.tools[joined[i].tool].diameter, kTable[i][2] * kInch, 1e-9);
        // "the layer covers .75 to 1.70 and is within the allowed machining error", and so do the others:
        // none is cut again.
        EXPECT_GT(map.allowed_mm[joined[i].tool], joined[i].z_high - joined[i].z_low);
    }
    EXPECT_GT(joined[1].z_high - joined[1].z_low, job.slabs.thicknesses[0])
        << "which a slab alone would not hold";
}

// The strategy itself: among what `combined` plans are the three layers of table 6.3, the second of two
// slabs.
TEST_F(LuoCombined, Layers) {
    LayerRequest request;
    request.height = bounds(mesh.view()).max.z;
    request.max_layer = max_layer_thickness(job);
    request.min_layer = job.layers.min_layer;
    request.min_material = job.material.min_thickness;
    request.alpha = job.layers.alpha, request.beta = job.layers.beta;
    request.slab_thicknesses = job.slabs.thicknesses;
    request.facing_allowance = job.slabs.facing_allowance;
    request.features = features;
    request.section_area = SectionAreas(context, mesh.view());
    const LayerPlacement* by_tools = nullptr;
    const std::vector<LayerCandidate> candidates = layer_candidates(context, mesh.view(), job, request);
    for (const LayerCandidate& c : candidates) {
        std::printf("%-16s", c.name.c_str());
        for (const Boundary& b : c.placement.boundaries) std::printf(" %.3f", b.z / kInch);
        std::printf(" in\n");
        if (c.name == "layers by tools") by_tools = &c.placement;
    }
    ASSERT_NE(by_tools, nullptr);
    // Print does not look at the joint inside its layer of two slabs, which lies no more than MTmin under the
    // flat at 1.70 in. Ours counts it, cuts that layer once more, and keeps print's tops besides.
    const LayerCost printed =
        layer_cost(request, {kTable[0][1] * kInch, kTable[1][1] * kInch, kTable[2][1] * kInch});
    std::printf("exposed glue: print's layers %.1f mm2, ours %.1f mm2\n", printed.exposed_glue,
                by_tools->cost.exposed_glue);
    EXPECT_GT(printed.exposed_glue, by_tools->cost.exposed_glue + 1);
    ASSERT_EQ(by_tools->boundaries.size(), 4U);
    const double tops[] = {kTable[0][1], 1.30, kTable[1][1], kTable[2][1]};
    const int row_of[] = {0, 1, 1, 2};
    for (int i = 0; i < 4; ++i) {
        EXPECT_NEAR(by_tools->boundaries[i].z, tops[i] * kInch, i == 1 ? 0.0254 : kNear);
        EXPECT_NEAR(by_tools->boundaries[i].slab_thickness, 0.75 * kInch, 1e-9);
        // The tools that print names are long enough for their layer.
        const double low = i == 0 ? 0 : by_tools->boundaries[i - 1].z;
        const Job fitted = with_tools_for(job, by_tools->boundaries[i].z - low);
        for (const ToolKind kind : {ToolKind::ball, ToolKind::flat}) {
            double smallest = 1e300;
            for (const Tool& tool : fitted.tools)
                if (tool.kind == kind) smallest = std::min(smallest, tool.diameter);
            EXPECT_LE(smallest, kTable[row_of[i]][2] * kInch + 1e-9);
        }
    }
    // What is too short stays out of print's second layer.
    const Job fitted = with_tools_for(job, (kTable[1][1] - kTable[0][1]) * kInch);
    for (const Tool& tool : fitted.tools)
        if (tool.kind == ToolKind::ball || tool.kind == ToolKind::flat) {
            EXPECT_GE(tool.diameter, 0.25 * kInch - 1e-9) << "the .125 in tool's flutes do not make .95 in";
        }
}

}  // namespace
}  // namespace slabwright
