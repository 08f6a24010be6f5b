// The thinnest material that bears the cutters (LUO 6.3, 6.5.2), and what layers make of it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>

#include "engine/forces/cuts.h"
#include "engine/forces/min_material.h"
#include "engine/layers/layers.h"
#include "engine/planner/planner.h"
#include "engine/tools/tools.h"
#include "kernels/forces/deflection.h"
#include "tests/support/height_field.h"
#include "tests/support/seed.h"

namespace slabwright {
namespace {

// The cutter of LUO 6.5.2 and nothing else: a strip .5 in wide is that of a cutter of 1 in; 3 mm deep, .635
// mm a tooth.
Job specimen() {
    Job job;
    job.material.transform = CoefficientTransform::printed;
    job.bonding.edge_setback = 0;
    Tool cutter = job.tools[1];
    cutter.diameter = cutter.shank_diameter = kInch;
    cutter.max_rpm = 4000;
    cutter.max_feed = 0.635 * 2 * 4000;
    cutter.stepdown_min = 1;
    cutter.stepdown_max = 3;
    job.tools = {cutter};
    return job;
}

TEST(LeastMaterial, LuoSpecimensOf12BreakAndOf13Hold) {
    const double least = least_material(specimen(), 2 * kInch) / kInch;
    std::printf("LUO 6.5.2: specimens hold from %.4f in on (published .124, with 3 mm for .12 in)\n", least);
    EXPECT_GT(least, 0.12);
    EXPECT_LT(least, 0.13);
    EXPECT_NEAR(least, 0.124, 0.0015);
}

// Of the wood that hangs over, the last level of roughing meets a sliver: where nothing hangs over, or what
// does would not bear a step anyway, any step will do.
TEST(LeastMaterial, LastStepsAreShallowWhereThatSavesTheWood) {
    const Job job = specimen();
    const Tool& tool = job.tools[0];
    EXPECT_EQ(rough_steps(job, tool, 0, 18).last_count, 0);
    EXPECT_EQ(rough_steps(job, tool, 0, 18).deepest, 0);
    const RoughSteps near = rough_steps(job, tool, 30, 18), steps = rough_steps(job, tool, 100, 18);
    EXPECT_EQ(near.last_count, 0) << "3 mm of wood bear a step of 3 mm";
    EXPECT_NEAR(near.deepest, 3, 1e-9);
    EXPECT_GT(steps.last_count, 0);
    EXPECT_LT(steps.last, least_slab(tool));
    EXPECT_EQ(rough_steps(job, tool, 30, 0.9).last_count, 0) << "a layer of .9 mm bears no step of 3 mm";
    EXPECT_GT(rough_steps(job, tool, 1000, least_material(job, 500) + 0.01).last_count, 0);
    EXPECT_EQ(rough_steps(job, tool, 30000, 18).last_count, 0);
}

// The thinnest slab that bears a cut of `deep` so far out: least_material of a tool that goes no deeper.
double bears(Job job, double deep, double overhang_mm) {
    job.tools[0].stepdown_max = deep;
    return least_material(job, overhang_mm);
}

// Cutters that may go deeper than a slab is thick: of all ways to divide a layer into even levels over one or
// two shallow ones, the one with the fewest levels that the wood bears.
TEST(LeastMaterial, StepsAreAsDeepAsTheWoodBears) {
    std::mt19937 random(test::seed());
    const auto between = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    int shallow[3] = {}, none = 0, limited = 0;
    for (int k = 0; k < 1000; ++k) {
        Job job = specimen();
        Tool& tool = job.tools[0];
        tool.diameter = tool.shank_diameter = between(6, 26);
        tool.stepdown_min = between(0.5, 3);
        tool.stepdown_max = std::min(between(0.3, 2) * tool.diameter, tool.flute_length);
        if (tool.stepdown_max < tool.stepdown_min) continue;
        const double overhang = between(5, 300), layer = between(8, 36), least = tool.stepdown_min;
        const RoughSteps steps = rough_steps(job, tool, overhang, layer);
        EXPECT_NEAR(steps.last, 0.9 * least, 1e-9);
        const auto holds = [&](double deep, int count) {
            return count == 2 ? bears(job, deep, overhang * 2 / 3) <= layer
                              : bears(job, deep, overhang * 3 / 4) <= count * steps.last + deep;
        };
        int fewest = 1000, count_then = -1;
        for (const int count : {2, 1, 0})
            for (int even = 1; even < 80; ++even) {
                const double deep = (layer - count * steps.last) / even;
                if (deep < least || deep > tool.stepdown_max) continue;
                if (holds(deep, count)) {
                    if (even + count < fewest) fewest = even + count, count_then = count;
                } else {
                    ++limited;
                }
            }
        if (count_then < 0) {
            EXPECT_NEAR(steps.deepest, std::min(tool.stepdown_max, 1.5 * least), 1e-9);
            ++none;
            continue;
        }
        EXPECT_EQ(steps.last_count, count_then);
        EXPECT_NEAR(steps.deepest, (layer - count_then * steps.last) / (fewest - count_then), 1e-9);
        ++shallow[count_then];
    }
    std::printf("no shallow level %d times, one %d times, two %d times, none bears %d times\n", shallow[0],
                shallow[1], shallow[2], none);
    for (const int times : shallow) EXPECT_GT(times, 20);
    EXPECT_GT(none, 5);
    EXPECT_GT(limited, 100);
}

TEST(LeastMaterial, GrowsWithOverhangAndForceAndFallsWithStrength) {
    Job job = specimen();
    double before = 0;
    for (const double b : {0.0, 1.0, 10.0, 50.0, 200.0}) {
        const double least = least_material(job, b);
        EXPECT_GT(least, before);
        before = least;
    }
    const double usual = least_material(job, 50);
    Job strong = job;
    strong.material.strength_mpa *= 2;
    EXPECT_LT(least_material(strong, 50), usual);
    Job hasty = job;
    hasty.tools[0].max_feed *= 2;
    EXPECT_GT(least_material(hasty, 50), usual);
    // Any slab at least as thick bears the cut, one a little thinner does not: asked of the strip itself, at
    // the depth cut in it.
    for (const double b : {2.0, 20.0, 50.0}) {
        const double least = least_material(job, b);
        for (const double share : {0.97, 1.001, 1.5}) {
            const double t = share * least, depth = std::min(t, job.tools[0].stepdown_max);
            const SegmentForces f = closed_form_forces(hardest_cut(job, job.tools[0], depth));
            EXPECT_EQ(overhang_holds({f.peak_x_n, f.peak_y_n, f.peak_z_n, b, depth / 2,
                                      job.tools[0].diameter / 2, job.material.strength_mpa},
                                     t),
                      share > 1)
                << b << ' ' << share;
        }
    }
}

Mesh box(Context& context, double x, double y, double z) {
    Mesh mesh = test::height_field(context, 1, 1.0, [](double, double) { return 1.0; });
    for (Vec3f& v : mesh.vertices)
        v = {static_cast<float>((v.x + 0.5) * x), static_cast<float>((v.y + 0.5) * y),
             static_cast<float>(v.z * z)};
    return mesh;
}

TEST(SlabOverhangTest, OfABoxIsTheDistanceToTheSlabsCorner) {
    Context context;
    const Mesh mesh = box(context, 80, 50, 30);
    Plan plan;
    plan.stock_min = {-20, -40};
    plan.stock_max = {95, 60};
    const SlabOverhang overhang = slab_overhang(context, mesh.view(), plan);
    ASSERT_FALSE(overhang.overhangs.empty());
    const double exact = std::hypot(20, 40) + plan.job.bonding.edge_setback, cell = 115.0 / 256;
    for (const double b : overhang.overhangs) {
        EXPECT_GE(b, exact);
        EXPECT_LE(b, exact + 3 * cell);
    }
}

TEST(SlabOverhangTest, AFlaskCarriesTheSlab) {
    Context context;
    const Mesh mesh = box(context, 80, 50, 30);
    Plan plan;
    plan.stock_min = {-60, -60};
    plan.stock_max = {140, 110};
    const double without = slab_overhang(context, mesh.view(), plan).overhangs.front();
    plan.job.flask.enabled = true;
    const SlabOverhang with = slab_overhang(context, mesh.view(), plan);
    // Nowhere in the gap is it further than half the gap to pattern or flask, but for corners and what the
    // draft adds.
    EXPECT_LT(with.overhangs.front(), 0.3 * without);
    EXPECT_GE(with.overhangs.front(), plan.job.flask.gap / 2 + plan.job.bonding.edge_setback);
    EXPECT_LE(with.overhangs.front(), plan.job.flask.gap / 2 * 1.2 + plan.job.bonding.edge_setback + 2);
}

LayerRequest two_flats() {
    LayerRequest r;
    r.height = 40;
    r.max_layer = 18;
    r.min_layer = 3;
    r.min_material = 5;
    r.facing_allowance = 0.5;
    r.slab_thicknesses = {19};
    for (const double z : {12.0, 21.0, 33.0}) {
        Feature f;
        f.type = FeatureType::up_flat;
        f.z_low = f.z_high = z;
        f.area = 100;
        r.features.push_back(f);
    }
    return r;
}

TEST(LeastMaterial, LayersWithAConstantAsAFunctionAreTheSame) {
    LayerRequest constant = two_flats(), function = two_flats();
    function.min_material = 0;
    function.min_material_at = [](double) { return 5.0; };
    for (const auto place : {place_layers_printed, place_layers_optimal}) {
        const LayerPlacement a = place(constant), b = place(function);
        ASSERT_EQ(a.boundaries.size(), b.boundaries.size());
        for (std::size_t i = 0; i < a.boundaries.size(); ++i) EXPECT_EQ(a.boundaries[i].z, b.boundaries[i].z);
        EXPECT_EQ(a.cost, b.cost);
    }
}

TEST(LeastMaterial, BoundariesKeepWhatTheirHeightAsksFor) {
    LayerRequest r = two_flats();
    r.min_material_at = [](double z) { return 3 + 0.1 * z; };
    for (const auto place : {place_layers_printed, place_layers_optimal}) {
        const LayerPlacement p = place(r);
        EXPECT_EQ(p.cost.broken_type1, 0);
        for (std::size_t i = 0; i + 1 < p.boundaries.size(); ++i)
            for (const Feature& f : r.features)
                if (f.z_low > p.boundaries[i].z + 1e-3) {
                    EXPECT_GE(f.z_low - p.boundaries[i].z, r.min_material_at(p.boundaries[i].z) - 1e-3);
                }
    }
}

TEST(LeastMaterial, AComputedThicknessPlans) {
    Context context;
    Mesh mesh = test::height_field(context, 12, 10.0, [](double x, double y) {
        return std::max(std::abs(x), std::abs(y)) < 35 ? 24.0 : 12.0;
    });
    Job job;
    job.material.min_thickness = 0;
    const Plan plan = make_plan(context, mesh, {}, job);
    const auto least = min_material(context, mesh.view(), plan);
    ASSERT_GT(plan.layers.size(), 1U);
    for (std::size_t i = 0; i + 1 < plan.layers.size(); ++i) {
        const double z = plan.layers[i].z_top, need = least(z);
        EXPECT_GT(need, 0.5);
        for (const Feature& f : plan.features)
            if (f.type == FeatureType::up_flat && f.z_low > z + 1e-3) {
                EXPECT_GE(f.z_low - z, need - 1e-3);
            }
    }
}

TEST(LeastMaterial, ASlabThatHangsOverTooFarIsReported) {
    Context context;
    // A post of 12 mm on a base of 120 mm: the slabs around the post reach 85 mm past it.
    const Mesh mesh = test::height_field(context, 20, 6.0, [](double x, double y) {
        return std::max(std::abs(x), std::abs(y)) < 7 ? 60.0 : 8.0;
    });
    Job job;
    job.material.min_thickness = 0;
    const auto reported = [&] {
        const Plan plan = make_plan(context, mesh, {}, job);
        return std::any_of(plan.diagnostics.begin(), plan.diagnostics.end(),
                           [](const Diagnostic& d) { return d.code == "layers.overhang"; });
    };
    EXPECT_TRUE(reported());
    job.material.strength_mpa = 1000;
    EXPECT_FALSE(reported());
}

}  // namespace
}  // namespace slabwright
