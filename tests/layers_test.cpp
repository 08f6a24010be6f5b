#include "engine/layers/layers.h"

#include "engine/layers/combined.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <ostream>
#include <random>

#include "kernels/errors.h"
#include "tests/support/seed.h"

namespace slabwright {

void PrintTo(const LayerCost& c, std::ostream* out) {
    *out << "type II " << c.broken_type2 << ", type I " << c.broken_type1 << ", thin " << c.thin_layers
         << ", glue " << c.exposed_glue << ", type III " << c.broken_type3 << ", layers " << c.layers
         << ", wood " << c.wood << ", -Q " << c.minus_q;
}

namespace {

Feature feature(FeatureType type, double low, double high, double area) {
    Feature f;
    f.type = type;
    f.z_low = low;
    f.z_high = high;
    f.area = area;
    return f;
}
Feature level(FeatureType type, double z, double area = 100) { return feature(type, z, z, area); }

LayerRequest request(double height, std::vector<Feature> features) {
    LayerRequest r;
    r.height = height;
    r.max_layer = 18.5;
    r.min_layer = 2;
    r.min_material = 5;
    r.slab_thicknesses = {19};
    r.facing_allowance = 0.5;
    r.features = std::move(features);
    r.section_area = [height](double z) { return 1000 * (1.5 - z / height); };
    return r;
}

std::vector<double> tops(const LayerPlacement& p) {
    std::vector<double> z;
    for (const Boundary& b : p.boundaries) z.push_back(b.z);
    return z;
}

bool has(const LayerPlacement& p, const std::string& code) {
    return std::any_of(p.diagnostics.begin(), p.diagnostics.end(),
                       [&](const Diagnostic& d) { return d.code == code; });
}

// What every placement must hold, whatever the features.
void expect_placement(const LayerRequest& r, const LayerPlacement& p) {
    ASSERT_FALSE(p.boundaries.empty());
    EXPECT_EQ(p.boundaries.back().z, r.height);
    double below = 0;
    for (const Boundary& b : p.boundaries) {
        EXPECT_GT(b.z, below);
        EXPECT_LE(b.z - below, r.max_layer + kSameHeight * 1.001);
        EXPECT_GE(b.slab_thickness + kSameHeight * 1.001, b.z - below + r.facing_allowance);
        EXPECT_FALSE(b.reason.empty());
        below = b.z;
    }
    EXPECT_TRUE(p.cost == layer_cost(r, tops(p)));
    EXPECT_EQ(p.cost.layers, static_cast<int>(p.boundaries.size()));
    EXPECT_EQ(p.cost.broken_type2, 0);
    EXPECT_EQ(has(p, "layers.type2"), p.cost.broken_type2 > 0);
    EXPECT_EQ(has(p, "layers.type1"), p.cost.broken_type1 > 0);
    EXPECT_EQ(has(p, "layers.type3"), p.cost.broken_type3 > 0);
    EXPECT_EQ(has(p, "layers.thin"), p.cost.thin_layers > 0);
}

TEST(Layers, PrintedAvoidsMeetsAndMoves) {
    // Up to 18.5 a peak at 20 forbids (15, 20); from 15 on a down-facing flat at 30; from 30 a slope from 45
    // to 60 holds 48.5.
    const LayerRequest r = request(70, {level(FeatureType::peak, 20, 0), level(FeatureType::down_flat, 30),
                                        feature(FeatureType::shallow, 45, 60, 400)});
    const LayerPlacement p = place_layers_printed(r);
    EXPECT_EQ(tops(p), (std::vector<double>{15, 30, 45, 63.5, 70}));
    expect_placement(r, p);
    EXPECT_EQ(p.boundaries[0].reason, "5 mm below the peak at 20 mm");
    EXPECT_EQ(p.boundaries[1].reason, "at the down-facing flat at 30 mm");
    EXPECT_EQ(p.boundaries[2].reason, "at the lower end of the shallow slope from 45 to 60 mm");
    EXPECT_EQ(p.boundaries[3].reason, "as high as a layer may be (18.5 mm)");
    EXPECT_EQ(p.boundaries[4].reason, "top of the pattern");
    EXPECT_TRUE(p.diagnostics.empty());
}

TEST(Layers, PrintedKeepsToAShallowRangeWhereMovingWouldNotEnd) {
    // A tall dome: shallow from 2 mm on. Print moves to 2, then to 2 again, and never ends.
    const LayerRequest r = request(100, {feature(FeatureType::shallow, 2, 100, 5000)});
    const LayerPlacement p = place_layers_printed(r);
    EXPECT_EQ(tops(p), (std::vector<double>{18.5, 37, 55.5, 74, 92.5, 100}));
    expect_placement(r, p);
    ASSERT_EQ(p.diagnostics.size(), 5u);
    EXPECT_EQ(p.diagnostics[0].code, "layers.type3");
    EXPECT_NE(p.diagnostics[0].message.find("from 2 to 100 mm"), std::string::npos)
        << p.diagnostics[0].message;
}

TEST(Layers, ARegionTallerThanALayerIsCrossedByFewestBoundariesThenLargestQ) {
    // Flats every 4 mm from 10 to 50 forbid (5, 50). From 5 on, two boundaries inside reach 55 (5 + 18.5
    // + 18.5 + 18.5 > 55).
    std::vector<Feature> features;
    for (int z = 10; z <= 50; z += 4) features.push_back(level(FeatureType::up_flat, z));
    LayerRequest r = request(55, features);
    r.section_area = nullptr;  // Q is DT alone: every candidate lies 1 mm under a flat, but some lie at one
    const LayerPlacement p = place_layers_printed(r);
    expect_placement(r, p);
    ASSERT_EQ(p.boundaries.size(), 4u);
    EXPECT_EQ(p.boundaries[0].z, 5);
    // Brute force over all pairs of candidates.
    double best = -1;
    std::vector<double> candidates;
    for (double z = 9; z < 50; z += 4) candidates.push_back(z);
    auto q = [&](double z) {
        double above = std::numeric_limits<double>::infinity();
        for (const Feature& f : features)
            if (f.z_low > z + 1e-6) above = std::min(above, f.z_low - z);
        return r.alpha * above / kInch;
    };
    for (const double a : candidates)
        for (const double b : candidates)
            if (a < b && a - 5 <= 18.5 && b - a <= 18.5 && 55 - b <= 18.5) best = std::max(best, q(a) + q(b));
    EXPECT_NEAR(q(p.boundaries[1].z) + q(p.boundaries[2].z), best, 1e-5);
    EXPECT_TRUE(has(p, "layers.type1"));
}

// Where no boundary is due soon after such a region, boundaries lead to its upper end, each 5 mm under a
// flat, so that no more layers than need be lead on to the top.
TEST(Layers, ARegionTallerThanALayerIsCrossedToItsEndWhereTheTopIsFar) {
    for (const double height : {95.0, 110.0, 120.0, 131.0}) {
        std::vector<Feature> features;
        for (int z = 10; z <= 50; z += 4) features.push_back(level(FeatureType::up_flat, z));
        const LayerPlacement p = place_layers_printed(request(height, features));
        std::size_t inside = 0;
        double below = 0;
        for (const Boundary& b : p.boundaries) {
            EXPECT_LE(b.z - below, 18.5 + 1e-6) << height;
            below = b.z;
            if (b.z > 49.9) continue;
            ++inside;
            EXPECT_NEAR(std::remainder(b.z - 5, 4), 0, 1e-6) << b.z << " of " << height;
        }
        EXPECT_GE(inside, 3U) << "5 and two more: from 31.5 mm on a layer comes out of the region";
        // The fewest: from 5 by way of an end e of the region as many layers as it takes to the top.
        std::size_t fewest = 1000;
        for (double e = 33; e < 50; e += 4) {
            const auto steps = [](double way, double step) {
                return static_cast<std::size_t>(std::ceil(way / step - 1e-9));
            };
            fewest = std::min(fewest, 1 + steps(e - 5, 16) + steps(height - e, 18.5));
        }
        EXPECT_EQ(p.boundaries.size(), fewest) << height;
    }
}

TEST(Layers, PrintedTallRegionsMatchBruteForce) {
    const unsigned seed = test::seed();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    for (int round = 0; round < 200; ++round) {
        // One merged region from near the base to the top, few enough candidates for brute force.
        std::vector<Feature> features;
        double z = 6;
        std::uniform_real_distribution<double> gap(1.0, 4.9);
        while (z < 48) {
            features.push_back(level(FeatureType::peak, z));
            z += gap(random);
        }
        const double height = features.back().z_low + 0.5;
        LayerRequest r = request(height, features);
        r.section_area = [](double h) { return 2000 + 1500 * std::sin(h); };
        const LayerPlacement p = place_layers_printed(r);
        const double start = features.front().z_low - r.min_material;
        std::vector<double> candidates;
        for (const Feature& f : features)
            if (f.z_low - r.min_material > start + 1e-6) candidates.push_back(f.z_low - r.min_material);
        auto q = [&](double c) {
            double above = height - c;
            for (const Feature& f : features)
                if (f.z_low > c + kSameHeight) above = std::min(above, f.z_low - c);
            return r.alpha * above / kInch + r.beta * r.section_area(c) / (kInch * kInch);
        };
        std::size_t fewest = 99;
        double largest = 0;
        std::function<void(double, std::size_t, std::size_t, double)> walk =
            [&](double at, std::size_t from, std::size_t count, double sum) {
                if (height - at <= r.max_layer + kSameHeight &&
                    (count < fewest || (count == fewest && sum > largest))) {
                    fewest = count;
                    largest = sum;
                }
                if (count >= fewest) return;
                for (std::size_t i = from;
                     i < candidates.size() && candidates[i] - at <= r.max_layer + kSameHeight; ++i)
                    walk(candidates[i], i + 1, count + 1, sum + q(candidates[i]));
            };
        walk(start, 0, 0, 0);
        ASSERT_EQ(p.boundaries.size(), fewest + 2) << "round " << round;
        double sum = 0;
        for (std::size_t i = 1; i + 1 < p.boundaries.size(); ++i) sum += q(p.boundaries[i].z);
        ASSERT_NEAR(sum, largest, 1e-4) << "round " << round;
    }
}

// Peaks just above, and a flat that looks down between, the heights of whole slabs: the control meets none.
TEST(Layers, UniformTakesNoNoticeOfThePattern) {
    const LayerRequest r = request(50, {level(FeatureType::peak, 20), level(FeatureType::down_flat, 30)});
    const LayerPlacement uniform = place_layers(LayerStrategy::uniform, r);
    EXPECT_EQ(tops(uniform), (std::vector<double>{18.5, 37, 50}));
    EXPECT_TRUE(has(uniform, "layers.type1"));
    EXPECT_TRUE(has(uniform, "layers.type2"));
    EXPECT_EQ(place_layers(LayerStrategy::printed, r).cost.broken_type2, 0);
    EXPECT_LT(place_layers(LayerStrategy::optimal, r).cost, uniform.cost);
    EXPECT_EQ(tops(place_layers(LayerStrategy::uniform, request(37, {}))), (std::vector<double>{18.5, 37}));
}

TEST(Layers, TypeTwoSplitsARegion) {
    const LayerRequest r = request(30, {level(FeatureType::peak, 20), level(FeatureType::down_flat, 17)});
    const LayerPlacement p = place_layers_printed(r);
    EXPECT_EQ(tops(p), (std::vector<double>{17, 30}));
    EXPECT_EQ(p.cost.broken_type1, 100);
    EXPECT_TRUE(has(p, "layers.type1"));
}

// A foot .02 mm over the lowest point stands on the board, and flats a tenth apart share a boundary, where a
// sheet as thin as that may stay under them.
TEST(Layers, NoLayerIsAsThinAsTheWoodThatMayStayUnderAFlat) {
    LayerRequest r = request(30, {level(FeatureType::down_flat, 0.02), level(FeatureType::down_flat, 0.2),
                                  level(FeatureType::down_flat, 15), level(FeatureType::down_flat, 15.1),
                                  level(FeatureType::down_flat, 15.4)});
    const auto tops = [](const LayerPlacement& placement) {
        std::vector<double> heights;
        for (const Boundary& b : placement.boundaries) heights.push_back(b.z);
        return heights;
    };
    const auto has = [](const std::vector<double>& heights, double z) {
        return std::any_of(heights.begin(), heights.end(), [&](double h) { return std::abs(h - z) < 1e-6; });
    };
    EXPECT_TRUE(has(tops(place_layers_optimal(r)), 0.02));
    r.filled_underside = 0.25;
    for (const LayerPlacement& placement : {place_layers_printed(r), place_layers_optimal(r)}) {
        const std::vector<double> heights = tops(placement);
        EXPECT_GT(heights.front(), 0.25);
        EXPECT_TRUE(has(heights, 15));
        EXPECT_FALSE(has(heights, 15.1));
        EXPECT_TRUE(has(heights, 15.4)) << "what would stay under it matters";
        EXPECT_EQ(placement.cost.broken_type2, 0);
    }
}

// A casting has down-facing flats that differ by what its drawing was rounded to: one boundary, at the
// lowest, makes them all, and no layer is thinner than a cutter could tell.
TEST(Layers, FlatsOfNextToOneHeightAreMadeByOneBoundary) {
    const LayerRequest r =
        request(30, {level(FeatureType::down_flat, 0.00066), level(FeatureType::down_flat, 0.0008),
                     level(FeatureType::down_flat, 15.0002729), level(FeatureType::down_flat, 15.0005038)});
    for (const LayerPlacement& placement : {place_layers_printed(r), place_layers_optimal(r)}) {
        double below = 0;
        bool made = false;
        for (const Boundary& b : placement.boundaries) {
            EXPECT_GT(b.z - below, 0.01);
            made = made || std::abs(b.z - 15.0002729) < 1e-6;
            below = b.z;
        }
        EXPECT_TRUE(made);
        EXPECT_EQ(placement.cost.broken_type2, 0);
    }
}

TEST(Layers, CostCountsEachBreach) {
    LayerRequest r =
        request(40, {level(FeatureType::up_flat, 20, 300), level(FeatureType::peak, 21, 0),
                     level(FeatureType::down_flat, 30, 70), feature(FeatureType::shallow, 10, 18, 50),
                     level(FeatureType::saddle, 19, 40)});
    const LayerCost c = layer_cost(r, {17, 35.5, 40});
    EXPECT_EQ(c.broken_type2, 70);
    EXPECT_EQ(c.broken_type1, 301);  // a peak weighs a square millimetre
    EXPECT_EQ(c.exposed_glue, 300);
    EXPECT_EQ(c.broken_type3, 50);
    EXPECT_EQ(c.thin_layers, 0);
    EXPECT_EQ(c.layers, 3);
    EXPECT_EQ(c.wood, 57);
    // Both ends of the glue's range count, of the others' none; a boundary at a flat's own height shows its
    // glue.
    EXPECT_EQ(layer_cost(r, {15, 30, 40}).exposed_glue, 300);
    EXPECT_EQ(layer_cost(r, {14.99, 30, 40}).exposed_glue, 0);
    EXPECT_EQ(layer_cost(r, {15, 30, 40}).broken_type1, 0);
    EXPECT_EQ(layer_cost(r, {15, 20, 30, 40}).exposed_glue, 600);
    // Of the two slabs that 20 mm need the joint at 19 lies under both flat and peak, the boundary under the
    // peak.
    EXPECT_EQ(layer_cost(r, {20, 30, 40}).broken_type1, 301 + 1);
    EXPECT_EQ(layer_cost(r, {10, 18, 30, 40}).broken_type3, 0);
    EXPECT_EQ(layer_cost(r, {10, 18, 30, 40}).broken_type2, 0);
    EXPECT_EQ(layer_cost(r, {10, 11.5, 30, 40}).thin_layers, 1);
    r.saddles_constrain = true;
    EXPECT_EQ(layer_cost(r, {17, 35.5, 40}).broken_type1, 341);
    // The top is no joint.
    EXPECT_EQ(layer_cost(request(10, {level(FeatureType::up_flat, 10)}), {10}).exposed_glue, 0);
}

TEST(Layers, TheThinnestSlabThatHoldsTheLayer) {
    LayerRequest r = request(30, {level(FeatureType::down_flat, 6)});
    r.slab_thicknesses = {19, 6.5, 12};
    LayerPlacement p = place_layers_printed(r);
    EXPECT_EQ(tops(p), (std::vector<double>{6, 24.5, 30}));
    EXPECT_EQ(p.boundaries[0].slab_thickness, 6.5);
    EXPECT_EQ(p.boundaries[1].slab_thickness, 19);
    EXPECT_EQ(p.boundaries[2].slab_thickness, 6.5);
    r.slab_thicknesses = {9};  // two must be bonded into one, and the plan says so
    p = place_layers_printed(r);
    EXPECT_EQ(p.boundaries[1].slab_thickness, 27);
    EXPECT_TRUE(has(p, "layers.bonded"));
    EXPECT_EQ(place_layers_optimal(r).cost.wood, layer_cost(r, tops(place_layers_optimal(r))).wood);
}

TEST(Layers, RequestsWithoutAnAnswerAreUsageErrors) {
    const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
    auto expect_error = [](const LayerRequest& r) {
        for (auto place : {place_layers_printed, place_layers_optimal}) {
            try {
                (void)place(r);
                ADD_FAILURE() << "no error";
            } catch (const Error& e) {
                EXPECT_EQ(e.kind(), ErrorKind::usage);
                EXPECT_EQ(e.code(), "layers.request");
            }
        }
    };
    for (double LayerRequest::*key :
         {&LayerRequest::height, &LayerRequest::max_layer, &LayerRequest::min_material,
          &LayerRequest::min_layer, &LayerRequest::facing_allowance})
        for (const double bad : {-1.0, nan, inf}) {
            LayerRequest r = request(30, {});
            r.*key = bad;
            expect_error(r);
        }
    LayerRequest r = request(30, {});
    r.max_layer = 0;
    expect_error(r);
    r.max_layer = 1e-5;
    expect_error(r);
    r = request(30, {});
    r.slab_thicknesses = {0};
    expect_error(r);
    r = request(30, {level(FeatureType::peak, nan)});
    expect_error(r);
}

TEST(Layers, OddRequestsEnd) {
    std::vector<Feature> features;
    for (int i = 1; i < 40; ++i)
        features.push_back(level(i % 2 ? FeatureType::peak : FeatureType::up_flat, 1.7 * i));
    for (const double material : {0.0, 5.0, 18.5, 40.0, 500.0})
        for (const double tallest : {0.3, 5.0, 18.5, 200.0}) {
            LayerRequest r = request(66, features);
            r.min_material = material;
            r.max_layer = tallest;
            r.slab_thicknesses = {tallest + 0.5};
            const LayerPlacement printed = place_layers_printed(r), optimal = place_layers_optimal(r);
            expect_placement(r, printed);
            expect_placement(r, optimal);
            EXPECT_LE(optimal.cost, printed.cost);
        }
}

TEST(Layers, TallDomesAndReliefsEnd) {
    // Nested shallow ranges, as every relief has.
    std::vector<Feature> features;
    std::mt19937 random(5);
    std::uniform_real_distribution<double> height(0, 200), size(0.1, 60);
    for (int i = 0; i < 3000; ++i) {
        const double low = height(random);
        features.push_back(feature(FeatureType::shallow, low, std::min(200.0, low + size(random)), 10));
    }
    features.push_back(feature(FeatureType::shallow, 0, 200, 1));
    const LayerRequest r = request(200, features);
    expect_placement(r, place_layers_printed(r));
    expect_placement(r, place_layers_optimal(r));
}

LayerRequest random_request(std::mt19937& random) {
    auto real = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    auto pick = [&](std::initializer_list<double> of) {
        return *(of.begin() + static_cast<std::ptrdiff_t>(random() % of.size()));
    };
    const double height = pick({5, 18.5, 38.1, real(1, 20), real(20, 150)});
    // Half the sets lie on a coarse grid, so that heights coincide, touch and split one another.
    const double grid = pick({0, 0, 0.5, 2.54});
    auto z = [&](double low, double high) {
        const double v = real(low, high);
        return grid > 0 ? std::clamp(std::round(v / grid) * grid, 0.0, height) : v;
    };
    std::vector<Feature> features;
    for (std::size_t n = random() % 30; n > 0; --n) {
        const auto type = static_cast<FeatureType>(random() % 7);
        const double low = z(0, height), area = pick({0, 1, real(0, 500)});
        features.push_back(feature(
            type, low, type == FeatureType::shallow || type == FeatureType::undercut ? z(low, height) : low,
            area));
    }
    LayerRequest r = request(height, features);
    r.max_layer = pick({18.5, 17.78, real(2, 60), 5});
    r.min_material = pick({0, 5.08, real(0, 10), real(0, 40)});
    r.min_layer = pick({0, 2, real(0, 10)});
    r.facing_allowance = pick({0, 0.5});
    r.slab_thicknesses = {r.max_layer + r.facing_allowance};
    if (random() % 2) r.slab_thicknesses.push_back(r.max_layer * 0.6);
    if (random() % 3 == 0) r.slab_thicknesses.push_back(r.max_layer * 0.25);
    r.saddles_constrain = random() % 2;
    const double phase = real(0, 6);
    r.section_area = [=](double h) { return 500 + 400 * std::sin(h / 7 + phase); };
    return r;
}

TEST(Layers, ThousandRandomSetsOptimalIsNeverWorseAndBothHold) {
    const unsigned seed = test::seed();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    int better = 0;
    for (int round = 0; round < 1000; ++round) {
        const LayerRequest r = random_request(random);
        const LayerPlacement printed = place_layers_printed(r), optimal = place_layers_optimal(r);
        expect_placement(r, printed);
        expect_placement(r, optimal);
        ASSERT_LE(optimal.cost, printed.cost) << "round " << round;
        better += optimal.cost < printed.cost;
        if (HasFailure()) FAIL() << "round " << round;
    }
    EXPECT_GT(better, 100);
}

// The dynamic program against every subset of a few heights that are among its candidates.
TEST(Layers, OptimalMatchesBruteForceOverFeatureHeights) {
    const unsigned seed = test::seed();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    int compared = 0;
    for (int round = 0; round < 300; ++round) {
        LayerRequest r = random_request(random);
        if (r.features.size() > 4) r.features.resize(4);
        if (r.height > 50 || r.max_layer < 4) continue;
        std::vector<double> heights;
        auto add = [&](double z) {
            if (z > 0.01 && z < r.height - 0.01) heights.push_back(z);
        };
        for (const Feature& f : r.features) {
            const bool type1 = f.type == FeatureType::peak || f.type == FeatureType::valley ||
                               f.type == FeatureType::up_flat;
            if (type1 || f.type == FeatureType::down_flat) add(f.z_low);
            if (f.type == FeatureType::shallow && f.z_high - f.z_low > 0.01) {
                add(f.z_low);
                add(f.z_high);
            }
            if (type1) add(f.z_low - r.min_material);
        }
        for (double z = r.max_layer; z < r.height - 0.01; z += r.max_layer) heights.push_back(z);
        std::sort(heights.begin(), heights.end());
        heights.erase(
            std::unique(heights.begin(), heights.end(), [](double a, double b) { return b - a < 0.01; }),
            heights.end());
        if (heights.size() > 11) continue;
        ++compared;
        const LayerPlacement optimal = place_layers_optimal(r);
        for (unsigned subset = 0; subset < (1u << heights.size()); ++subset) {
            std::vector<double> z;
            for (std::size_t i = 0; i < heights.size(); ++i)
                if (subset >> i & 1u) z.push_back(heights[i]);
            z.push_back(r.height);
            double below = 0;
            bool fits = true;
            for (const double t : z) {
                fits = fits && t - below <= r.max_layer;
                below = t;
            }
            if (fits) {
                LayerCost cost = layer_cost(r, z);
                cost.minus_q +=
                    1e-6;  // full layers piled up here are rounded once more than the program's own
                ASSERT_LE(optimal.cost, cost) << "round " << round << " subset " << subset;
            }
        }
    }
    EXPECT_GT(compared, 50);
}

// Slabs bonded into one have joints between them, which count as boundaries do: by hand here.
TEST(Layers, JointsBetweenBondedSlabsCount) {
    std::mt19937 random(test::seed());
    const auto uniform = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    int broken = 0, spared = 0, thin = 0;
    for (int round = 0; round < 200; ++round) {
        SCOPED_TRACE(round);
        LayerRequest r = request(uniform(30, 70), {});
        r.max_layer = 45;
        r.min_layer = 3;
        const int count = 1 + static_cast<int>(uniform(0, 4));
        for (int i = 0; i < count; ++i)
            r.features.push_back(level(uniform(0, 1) < 0.5 ? FeatureType::peak : FeatureType::up_flat,
                                       uniform(6, r.height), std::round(uniform(10, 500))));
        const LayerPlacement optimal = place_layers_optimal(r);
        const auto weight = [&](double z) {
            double sum = 0;
            for (const Feature& f : r.features)
                if (f.z_low > z + 2e-4 && f.z_low < z + r.min_material - 2e-4 && f.z_low <= r.height)
                    sum += f.area;
            return sum;
        };
        const auto by_hand = [&](const std::vector<double>& z) {
            std::pair<double, int> found;
            double bottom = 0;
            for (std::size_t i = 0; i < z.size(); ++i) {
                if (i + 1 < z.size()) found.first += weight(z[i]);
                const int slabs = static_cast<int>(std::ceil((z[i] - bottom + 0.5 - 1e-4) / 19));
                double last = bottom;
                for (int k = 1; k < slabs; ++k)
                    if (bottom + 19 * k < z[i] - 1e-4) found.first += weight(last = bottom + 19 * k);
                if (z[i] - last < 3 - 1e-4) ++found.second;
                bottom = z[i];
            }
            return found;
        };
        const auto [type1, thin_layers] = by_hand(tops(optimal));
        EXPECT_NEAR(optimal.cost.broken_type1, type1, 1e-6);
        EXPECT_EQ(optimal.cost.thin_layers, thin_layers);
        EXPECT_EQ(has(optimal, "layers.type1") || has(optimal, "joint.thin") || has(optimal, "layers.thin"),
                  type1 > 0 || thin_layers > 0);
        // Whatever else is tried among such heights breaks as much.
        std::vector<double> heights;
        for (const Feature& f : r.features)
            for (int k = 0; k < 3; ++k) heights.push_back(f.z_low - 5 - 19 * k);
        for (const double z : {18.5, 19.0, 37.5, 38.0, 45.0}) heights.push_back(z);
        std::erase_if(heights, [&](double z) { return z < 0.1 || z > r.height - 0.1; });
        std::sort(heights.begin(), heights.end());
        for (unsigned subset = 0; subset < (1u << std::min<std::size_t>(heights.size(), 10)); ++subset) {
            std::vector<double> z;
            double below = 0;
            bool fits = true;
            for (std::size_t i = 0; i < heights.size(); ++i)
                if (i < 10 && (subset >> i & 1u) != 0) z.push_back(heights[i]);
            z.push_back(r.height);
            for (const double t : z) {
                fits = fits && t - below <= r.max_layer && t - below > 0.1;
                below = t;
            }
            if (!fits) continue;
            const auto other = by_hand(z);
            const LayerCost cost = layer_cost(r, z);
            EXPECT_NEAR(cost.broken_type1, other.first, 1e-6);
            EXPECT_EQ(cost.thin_layers, other.second);
            ASSERT_LE(std::make_pair(optimal.cost.broken_type1, optimal.cost.thin_layers),
                      std::make_pair(cost.broken_type1, cost.thin_layers));
        }
        broken += type1 > 0 ? 1 : 0;
        thin += thin_layers > 0 ? 1 : 0;
        // A stack of slabs from the bottom up, as it was planned before, is spared where it breaks something.
        if (type1 == 0 && optimal.cost.layers > 1) ++spared;
    }
    std::printf("%d broken, %d thin, %d in several layers without\n", broken, thin, spared);
    EXPECT_GT(spared, 10);
}

TEST(Layers, AFlatJustOverAnInnerJointIsSaid) {
    LayerRequest r = request(30, {level(FeatureType::up_flat, 19.5, 700)});
    r.max_layer = 40;
    const LayerPlacement stacked = placement_of(r, {30});
    ASSERT_TRUE(has(stacked, "joint.thin"));
    EXPECT_EQ(stacked.cost.broken_type1, 700);
    for (const Diagnostic& d : stacked.diagnostics) {
        if (d.code == "joint.thin") {
            EXPECT_EQ(d.message,
                      "the joint between slabs at 19 mm leaves less than 5 mm of material: it is 0.5 mm "
                      "below the up-facing flat at 19.5 mm");
        }
    }
    const LayerPlacement better = place_layers_optimal(r);
    EXPECT_EQ(better.cost.broken_type1, 0);
    EXPECT_FALSE(has(better, "joint.thin"));
    // The last slab of a stack that is faced down to a veneer.
    r.features.clear();
    EXPECT_EQ(layer_cost(r, {19.4, 30}).thin_layers, 1);
    EXPECT_TRUE(has(placement_of(r, {19.4, 30}), "joint.thin"));
    EXPECT_EQ(place_layers_optimal(r).cost.thin_layers, 0);
}

TEST(Layers, FiveThousandFeaturesAreQuick) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> z(0, 400), area(0, 1000);
    std::vector<Feature> features;
    for (int i = 0; i < 5000; ++i) {
        const double low = z(random);
        const FeatureType type = i % 3 == 0   ? FeatureType::shallow
                                 : i % 3 == 1 ? FeatureType::peak
                                              : FeatureType::up_flat;
        features.push_back(
            feature(type, low, type == FeatureType::shallow ? std::min(400.0, low + 1) : low, area(random)));
    }
    const LayerRequest r = request(400, features);
    const auto start = std::chrono::steady_clock::now();
    const LayerPlacement optimal = place_layers_optimal(r);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    expect_placement(r, optimal);
    EXPECT_LT(seconds, 20);  // well under a second when optimised; the bound leaves room for sanitizers
    EXPECT_LE(optimal.cost, place_layers_printed(r).cost);
}

}  // namespace
}  // namespace slabwright
