// LUO tables 4.1 and 4.2, on the sample part built from table 4.1's design heights (METHOD.md sections 3 and
// 4).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/layers/layers.h"
#include "kernels/features/features.h"
#include "kernels/features/section_areas.h"
#include "kernels/mesh/weld.h"
#include "tests/data/luo_layer_sample.h"

namespace slabwright {
namespace {

constexpr double kChord = 0.001;      // in, the table's STL
constexpr double kResolution = 0.01;  // in, of halving

class LuoLayers : public testing::Test {
protected:
    Context context;
    Mesh mesh = weld(context, luo_layer_sample());

    FeatureSet features(Finder finder) {
        FeatureOptions options;
        options.finder = finder;
        options.chordal_deviation_mm = kChord * kInch;
        options.halving_coarse_mm = 0.1 * kInch;
        options.halving_resolution_mm = kResolution * kInch;
        return find_features(context, mesh.view(), options);
    }

    // Distinct heights in inches of all features of a type.
    static std::vector<double> heights(const FeatureSet& set, FeatureType type) {
        std::vector<double> z;
        for (const Feature& f : set.features)
            if (f.type == type && (z.empty() || f.z_low / kInch - z.back() > 1e-4))
                z.push_back(f.z_low / kInch);
        return z;
    }
    static void expect_heights(const std::vector<double>& found, const std::vector<double>& design,
                               double within) {
        ASSERT_EQ(found.size(), design.size());
        for (std::size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], design[i], within);
    }

    // Table 4.2's conditions: slabs of .70 in, no facing allowance, MTmin .20 in.
    LayerRequest request(std::vector<Feature> found) {
        LayerRequest r;
        r.height = 1.5 * kInch;
        r.max_layer = 0.7 * kInch;
        r.min_layer = 0.04 * kInch;
        r.min_material = 0.2 * kInch;
        r.slab_thicknesses = {0.7 * kInch};
        r.features = std::move(found);
        r.section_area = SectionAreas(context, mesh.view());
        return r;
    }
    // The features with the heights that LUO's program detected (table 4.1, middle column).
    std::vector<Feature> detected() {
        std::vector<Feature> found = features(Finder::exact).features;
        for (Feature& f : found) {
            auto moved = [&](double design_low, double design_high, double low, double high) {
                if (std::abs(f.z_low / kInch - design_low) > 1e-4 ||
                    std::abs(f.z_high / kInch - design_high) > 1e-4)
                    return;
                f.z_low = low * kInch;
                f.z_high = high * kInch;
            };
            if (f.type == FeatureType::shallow) {
                moved(.624, .650, .638, .650);
                moved(.516, .523, .520, .533);
                moved(.652, .744, .660, .744);
            } else {
                moved(.650, .650, .653, .653);
                moved(.805, .805, .803, .803);
                moved(.755, .755, .756, .756);
            }
        }
        return found;
    }
    static std::vector<double> tops(const LayerPlacement& placement) {
        std::vector<double> z;
        for (const Boundary& b : placement.boundaries) z.push_back(b.z / kInch);
        return z;
    }
};

TEST_F(LuoLayers, Table41ExactScanFindsEveryDesignHeight) {
    const FeatureSet set = features(Finder::exact);
    expect_heights(heights(set, FeatureType::up_flat), {.300, .700, 1.000, 1.180, 1.500}, kChord);
    expect_heights(heights(set, FeatureType::down_flat), {1.200}, kChord);
    expect_heights(heights(set, FeatureType::peak), {.650, .805}, kChord);
    expect_heights(heights(set, FeatureType::valley), {.755}, kChord);
    EXPECT_TRUE(heights(set, FeatureType::undercut).empty());
}

TEST_F(LuoLayers, Table41ShallowRangesAreThoseOfTheFacets) {
    const FeatureSet set = features(Finder::exact);
    std::vector<std::pair<double, double>> ranges;
    for (const Feature& f : set.features)
        if (f.type == FeatureType::shallow) ranges.emplace_back(f.z_low / kInch, f.z_high / kInch);
    const std::vector<std::pair<double, double>> design = {{.516, .523}, {.624, .650}, {.652, .744}};
    ASSERT_EQ(ranges.size(), design.size());
    for (std::size_t i = 0; i < design.size(); ++i) {
        EXPECT_NEAR(ranges[i].first, design[i].first, 1e-6);
        EXPECT_NEAR(ranges[i].second, design[i].second, 1e-6);
    }
}

TEST_F(LuoLayers, Table41HalvingIsWithinItsResolution) {
    const FeatureSet set = features(Finder::halving);
    expect_heights(heights(set, FeatureType::peak), {.650, .805}, kResolution / 2);
    expect_heights(heights(set, FeatureType::valley), {.755}, kResolution / 2);
    for (const Feature& f : set.features) {
        if (f.type == FeatureType::peak || f.type == FeatureType::valley) {
            EXPECT_EQ(f.found_by, FoundBy::halving);
        }
    }
    EXPECT_TRUE(features(Finder::both).disagreements.empty());
}

TEST_F(LuoLayers, Table42FromTheDetectedHeights) {
    const LayerRequest r = request(detected());
    const LayerPlacement placement = place_layers_printed(r);
    const std::vector<double> z = tops(placement);
    ASSERT_EQ(z.size(), 4u);
    EXPECT_NEAR(z[0], .453, 1e-6);
    EXPECT_NEAR(z[1], .500, 1e-6);  // flat .700 − MTmin: nearest to 1.200 − LTmax, largest DT and A
    EXPECT_NEAR(z[2], 1.200, 1e-6);
    EXPECT_NEAR(z[3], 1.500, 1e-6);
    EXPECT_EQ(placement.cost.broken_type2, 0);
    EXPECT_NE(placement.boundaries[0].reason.find("5.08 mm below the peak at 16.586 mm"), std::string::npos)
        << placement.boundaries[0].reason;
    EXPECT_NE(placement.boundaries[2].reason.find("down-facing flat at 30.48 mm"), std::string::npos)
        << placement.boundaries[2].reason;
    for (const Boundary& b : placement.boundaries) EXPECT_DOUBLE_EQ(b.slab_thickness, 0.7 * kInch);
}

// Print puts the second boundary at .556. The candidate .500 reaches the flat at 1.200 with a layer of
// exactly .70 in, which is LTmax; in single precision, which print's program seems to have used, that layer
// is too tall.
TEST_F(LuoLayers, Table42SecondBoundaryOfPrintFollowsFromSinglePrecision) {
    const float type2 = 1.2f, boundary = 0.5f, tallest = 0.7f;
    EXPECT_GT(type2 - boundary, tallest);
    EXPECT_NEAR(type2 - boundary, tallest, 1e-6);

    // Refuse it in the same way: a tallest layer eight millionths of an inch shorter gives print's boundary,
    // the next best Q.
    LayerRequest r = request(detected());
    r.max_layer = 0.7 * kInch - 2 * kSameHeight;
    const std::vector<double> z = tops(place_layers_printed(r));
    ASSERT_EQ(z.size(), 4u);
    EXPECT_NEAR(z[0], .453, 1e-6);
    EXPECT_NEAR(z[1], .556, 1e-6);
    EXPECT_NEAR(z[2], 1.200, 1e-6);
    EXPECT_NEAR(z[3], 1.500, 1e-6);
}

TEST_F(LuoLayers, Table42FromTheStlItself) {
    const std::vector<double> z = tops(place_layers_printed(request(features(Finder::exact).features)));
    ASSERT_EQ(z.size(), 4u);
    EXPECT_NEAR(z[0], .450, 1e-5);
    EXPECT_NEAR(z[1], .500, 1e-5);
    EXPECT_NEAR(z[2], 1.200, 1e-5);
    EXPECT_NEAR(z[3], 1.500, 1e-5);
}

TEST_F(LuoLayers, OptimalIsNoWorseThanPrint) {
    for (const LayerRequest& r : {request(detected()), request(features(Finder::exact).features)}) {
        const LayerPlacement printed = place_layers_printed(r), optimal = place_layers_optimal(r);
        EXPECT_LE(optimal.cost, printed.cost);
        EXPECT_EQ(optimal.cost.broken_type2, 0);
        EXPECT_LE(optimal.boundaries.size(), printed.boundaries.size());
    }
}

TEST_F(LuoLayers, WithPrintsLayersNothingStaysUnmade) {
    const std::vector<double> print = {.453 * kInch, .556 * kInch, 1.2 * kInch, 1.5 * kInch},
                              whole = {1.5 * kInch};
    EXPECT_TRUE(measure_undercuts(context, mesh.view(), print).empty());
    const auto unmade = measure_undercuts(context, mesh.view(), whole);
    ASSERT_EQ(unmade.size(), 1u);
    EXPECT_EQ(unmade[0].type, FeatureType::down_flat);
    EXPECT_NEAR(unmade[0].height_mm, .5 * kInch, 1e-3);  // down to the flat at .700
    EXPECT_NEAR(unmade[0].area_mm2, .4 * 2.0 * kInch * kInch, 0.1);
}

}  // namespace
}  // namespace slabwright
