// Layers and tools together: the joining of a tool map, against what its rules say, and the strategy
// `combined`.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

#include "engine/layers/candidates.h"
#include "engine/layers/combined.h"
#include "engine/layers/tool_map.h"
#include "engine/planner/planner.h"
#include "kernels/errors.h"
#include "tests/support/height_field.h"
#include "tests/support/seed.h"

namespace slabwright {
namespace {

constexpr double kIn = 25.4;

std::vector<ToolSlice> sliced(const std::vector<ToolSlice>& map, double step) {
    std::vector<ToolSlice> slices;
    for (const ToolSlice& s : map)
        for (double z = s.z_low; z < s.z_high - 1e-9; z += step) {
            const double low = slices.empty() ? s.z_low : slices.back().z_high;
            slices.push_back({low, z + step > s.z_high - 1e-9 ? s.z_high : z + step, s.tool});
        }
    return slices;
}

// LUO tables 6.2 and 6.3 and the lengths of 6.5.3: .125 in .57, .25 in 3.4, 1 in 8.0; .5 and .75 in are not
// named.
TEST(JoinSlices, LuoTable63) {
    const std::vector<double> allowed{0.57 * kIn, 3.4 * kIn, 5 * kIn, 6.5 * kIn, 8 * kIn};
    const std::vector<ToolSlice> map{{0, 0.75 * kIn, 4}, {0.75 * kIn, 1.7 * kIn, 1}, {1.7 * kIn, 2 * kIn, 0}};
    for (const double step : {0.01, 0.05, 0.3})
        EXPECT_EQ(join_slices(sliced(map, step * kIn), allowed, 3), map) << step;
    // A .125 in tool that may be .2 in long needs two layers for its .3 in.
    std::vector<double> shorter = allowed;
    shorter[0] = 0.2 * kIn;
    const std::vector<ToolSlice> cut = join_slices(map, shorter, 3);
    ASSERT_EQ(cut.size(), 4U);
    EXPECT_NEAR(cut[2].z_high, 1.85 * kIn, 1e-12);
    EXPECT_EQ(cut[3].z_high, 2 * kIn);
}

TEST(JoinSlices, ThinLayersJoinTheNearestTool) {
    const std::vector<double> allowed(5, 100);
    // One millimetre of tool 1 between tools 2 and 4 goes to tool 2's layer, which then needs tool 1.
    EXPECT_EQ(join_slices(std::vector<ToolSlice>{{0, 10, 4}, {10, 11, 1}, {11, 20, 2}}, allowed, 3),
              (std::vector<ToolSlice>{{0, 10, 4}, {10, 20, 1}}));
    EXPECT_EQ(join_slices(std::vector<ToolSlice>{{0, 1, 0}, {1, 2, 3}}, allowed, 3),
              (std::vector<ToolSlice>{{0, 2, 0}}));
    EXPECT_TRUE(join_slices({}, allowed, 3).empty());
    EXPECT_THROW((void)join_slices(std::vector<ToolSlice>{{0, 1, 0}, {2, 3, 0}}, allowed, 3), Error);
    EXPECT_THROW((void)join_slices(std::vector<ToolSlice>{{0, 1, 7}}, allowed, 3), Error);
}

// Over random maps: the layers fill the same heights, no tool is larger than the slice allows nor longer than
// it may be, and a layer thinner than the least is the only one or a part of one that its tool's length cut.
TEST(JoinSlices, RandomMaps) {
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> thickness(0.2, 4), length(5, 60);
    for (int trial = 0; trial < 300; ++trial) {
        std::vector<double> allowed(4);
        for (double& a : allowed) a = length(random);
        std::sort(allowed.begin(), allowed.end());
        std::vector<ToolSlice> slices;
        double z = 0;
        for (int i = 0; i < 60; ++i) {
            const double next = z + thickness(random);
            const std::size_t tool = i > 0 && random() % 4 ? slices.back().tool : random() % 4;
            slices.push_back({z, next, tool});
            z = next;
        }
        const std::vector<ToolSlice> layers = join_slices(slices, allowed, 3);
        ASSERT_FALSE(layers.empty());
        EXPECT_EQ(layers.front().z_low, 0);
        EXPECT_EQ(layers.back().z_high, z);
        for (std::size_t i = 0; i < layers.size(); ++i) {
            if (i > 0) {
                EXPECT_EQ(layers[i].z_low, layers[i - 1].z_high);
            }
            EXPECT_LE(layers[i].z_high - layers[i].z_low, allowed[layers[i].tool] + 1e-3);
            for (const ToolSlice& s : slices)
                if (s.z_high > layers[i].z_low + 1e-9 && s.z_low < layers[i].z_high - 1e-9) {
                    EXPECT_LE(layers[i].tool, s.tool);
                }
            const bool cut = (i > 0 && layers[i - 1].tool == layers[i].tool) ||
                             (i + 1 < layers.size() && layers[i + 1].tool == layers[i].tool);
            if (!cut && layers.size() > 1) {
                EXPECT_GE(layers[i].z_high - layers[i].z_low, 3 - 1e-3);
            }
        }
    }
}

TEST(PlaceByTools, KeepsTheToolChangesAndTheLengths) {
    LayerRequest request;
    request.height = 50;
    request.max_layer = 40;
    request.min_layer = 3;
    request.min_material = 5;
    request.slab_thicknesses = {19};
    Feature flat;
    flat.type = FeatureType::up_flat;
    flat.z_low = flat.z_high = 21;
    flat.area = 1000;
    request.features.push_back(flat);
    request.section_area = [](double) { return 1000.0; };
    const std::vector<ToolSlice> layers{{0, 30, 1}, {30, 50, 0}};
    const LayerPlacement placed = place_layers_by_tools(request, layers, std::vector<double>{12, 35});
    std::vector<double> tops;
    for (const Boundary& b : placed.boundaries) tops.push_back(b.z);
    ASSERT_GE(tops.size(), 3U);
    EXPECT_TRUE(std::find(tops.begin(), tops.end(), 30.0) != tops.end());
    EXPECT_EQ(tops.back(), 50);
    double below = 0;
    for (const Boundary& b : placed.boundaries) {
        EXPECT_LE(b.z - below, (b.z <= 30 ? 35 : 12) + kSameHeight);
        EXPECT_GE(b.slab_thickness, b.z - below - kSameHeight);
        EXPECT_FALSE(b.reason.empty());
        below = b.z;
    }
    EXPECT_EQ(placed.cost, layer_cost(request, tops));
    EXPECT_EQ(placed.cost.broken_type1, 0);
    EXPECT_THROW(
        (void)place_layers_by_tools(request, std::vector<ToolSlice>{{0, 30, 1}}, std::vector<double>{12, 35}),
        Error);
}

// Beside `optimal` and `printed` stand what bonded slabs allow, but where that breaks more, or is the same.
TEST(Combined, CandidatesAreOtherAndBreakNoMoreThanOptimal) {
    std::mt19937 random(test::seed());
    Context context;
    Job job;
    for (const std::size_t tool : {std::size_t{1}, std::size_t{2}})
        job.tools[tool].flute_length = 48, job.tools[tool].stickout = 56;
    int more = 0, kept_broken = 0;
    for (int round = 0; round < 40; ++round) {
        const Mesh mesh =
            test::random_height_field(context, 4, 12, 60, 1, static_cast<std::uint32_t>(random()));
        LayerRequest request;
        for (const Vec3f& v : mesh.vertices) request.height = std::max(request.height, double{v.z});
        request.max_layer = 18.5, request.min_layer = 3, request.min_material = 5;
        request.slab_thicknesses = {19};
        request.facing_allowance = 0.5;
        request.section_area = [](double) { return 1000; };
        for (std::size_t n = random() % 7; n-- > 0;) {
            Feature feature;
            feature.type =
                std::array{FeatureType::peak, FeatureType::down_flat, FeatureType::up_flat}[random() % 3];
            feature.z_low = feature.z_high = static_cast<double>(1 + random() % 50);
            feature.area = 100;
            request.features.push_back(feature);
        }
        const std::vector<LayerCandidate> candidates = layer_candidates(context, mesh.view(), job, request);
        ASSERT_GE(candidates.size(), 1U);
        EXPECT_EQ(candidates[0].name, "optimal");
        const auto same = [](const LayerPlacement& a, const LayerPlacement& b) {
            return std::equal(
                a.boundaries.begin(), a.boundaries.end(), b.boundaries.begin(), b.boundaries.end(),
                [](const Boundary& p, const Boundary& q) { return std::abs(p.z - q.z) < kSameHeight; });
        };
        std::vector<LayerPlacement> before{place_layers_optimal(request)};
        const LayerCost usual = before[0].cost;
        const auto expect = [&](const char* name, const LayerPlacement& placement) {
            const LayerCost& cost = placement.cost;
            const bool breaks_more = cost.broken_type2 > usual.broken_type2 ||
                                     cost.broken_type1 > usual.broken_type1 ||
                                     cost.thin_layers > usual.thin_layers;
            const bool is_known = std::any_of(before.begin(), before.end(), [&](const LayerPlacement& other) {
                return same(other, placement);
            });
            const bool wanted = !is_known && (!breaks_more || std::string(name) == "printed");
            const auto found = std::find_if(candidates.begin(), candidates.end(),
                                            [&](const LayerCandidate& c) { return c.name == name; });
            ASSERT_EQ(found != candidates.end(), wanted) << round << ": " << name;
            if (wanted) {
                EXPECT_TRUE(same(found->placement, placement)) << round << ": " << name;
                before.push_back(placement);
            }
            more += !is_known && !wanted ? 1 : 0;
            kept_broken += wanted && cost.broken_type1 + cost.broken_type2 + cost.thin_layers > 0 ? 1 : 0;
        };
        expect("printed", place_layers_printed(request));
        LayerRequest bonded = request;
        bonded.max_layer = max_bonded_layer_thickness(job);
        expect("bonded slabs", place_layers_optimal(bonded));
        const ToolMap map = tool_map(context, mesh.view(), job, request.features);
        bonded.max_layer = max_layer_of_longest(job);
        expect("layers by tools",
               place_layers_by_tools(bonded, join_slices(map.slices, map.allowed_mm, request.min_layer),
                                     map.allowed_mm));
    }
    EXPECT_GT(more, 0) << "left out since they break more";
    EXPECT_GT(kept_broken, 0);
}

// A block with two steps: whatever the other strategies make of it, combined takes no longer, and says what
// it compared.
TEST(Combined, IsNeverSlowerThanTheOtherStrategies) {
    Context context;
    const Mesh mesh = test::height_field(context, 12, 6.0, [](double x, double y) {
        return std::max(std::abs(x), std::abs(y)) < 20 ? 44.0 : 23.0;
    });
    Job job;
    job.tools[1].flute_length = 48, job.tools[1].stickout = 56;
    job.tools[2].flute_length = 48, job.tools[2].stickout = 56;
    double best = 1e300;
    for (const LayerStrategy strategy : {LayerStrategy::printed, LayerStrategy::optimal}) {
        job.layers.strategy = strategy;
        best = std::min(best, make_plan(context, mesh, {}, job).totals.build_minutes);
    }
    job.layers.strategy = LayerStrategy::combined;
    const Plan plan = make_plan(context, mesh, {}, job);
    EXPECT_LE(plan.totals.build_minutes, best);
    EXPECT_EQ(plan.job.layers.strategy, LayerStrategy::combined);
    const auto said = std::count_if(plan.diagnostics.begin(), plan.diagnostics.end(),
                                    [](const Diagnostic& d) { return d.code == "layers.combined"; });
    EXPECT_EQ(said, 1);
    // Every slab of a layer is bonded by itself.
    int slabs = 0;
    double wood = 0;
    for (const Layer& layer : plan.layers) {
        slabs += layer.slabs;
        wood += layer.slab_thickness;
        EXPECT_NEAR(layer.slab_thickness, 19.0 * layer.slabs, 1e-9);
    }
    EXPECT_EQ(slabs, std::count_if(plan.sequence.begin(), plan.sequence.end(),
                                   [](const SequenceStep& s) { return s.action == "press"; }));
    EXPECT_GE(plan.totals.bonding_minutes, slabs * (2 * job.machine.grip_s + job.bonding.press_time_s) / 60);
    std::printf("%d layers of %d slabs, %.1f min; the others at best %.1f\n", plan.totals.layers, slabs,
                plan.totals.build_minutes, best);
}

}  // namespace
}  // namespace slabwright
