// Where layers part whose slabs are milled on both sides, against brute force over all boundaries.
#include "engine/layers/both_sides.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "engine/planner/milled_ways.h"
#include "engine/planner/underside.h"
#include "kernels/errors.h"
#include "kernels/mesh/weld.h"
#include "tests/support/seed.h"
#include "tests/support/tunnels.h"

namespace slabwright {
namespace {

using support::block_with_tunnels;

LayerRequest request(double height, double max_layer, double min_layer) {
    LayerRequest r;
    r.height = height;
    r.max_layer = max_layer;
    r.min_layer = min_layer;
    r.min_material = 1;
    return r;
}

std::vector<double> tops_of(const LayerPlacement& placement) {
    std::vector<double> tops;
    for (const Boundary& b : placement.boundaries) tops.push_back(b.z);
    return tops;
}

TEST(BothSides, ABoundaryForEachTunnel) {
    Context context;
    const auto place = [&](const std::vector<support::Tunnel>& tunnels) {
        const Mesh block = weld(context, block_with_tunnels({0, 0, 0}, {60, 20, 60}, tunnels));
        const AirGaps gaps = air_gaps(context, block.view(), 0.1);
        std::vector<double> tops = tops_of(place_layers_both_sides(request(60, 60, 3), gaps));
        EXPECT_LT(unmade_air(context, gaps, tops, MilledFrom::both_sides).volume_mm3, 1);
        return tops;
    };
    const std::vector<double> one = place({{30, 30, 15}}), two = place({{15, 25, 8}, {45, 35, 8}}),
                              level = place({{15, 25, 8}, {45, 25, 8}});
    ASSERT_EQ(one.size(), 2U);
    EXPECT_NEAR(one[0], 30, 1.5) << "so near the axis only gaps are left that no line meets";
    ASSERT_EQ(two.size(), 3U);
    EXPECT_NEAR(two[0], 25, 1.5);
    EXPECT_NEAR(two[1], 35, 1.5);
    EXPECT_EQ(level.size(), 2U);
}

// Of three tunnels one lies under the range in which a boundary makes the two others: it lies as high as to
// leave 3 mm over the third.
TEST(BothSides, AFloorOverARecessIsAsThickAsItCanBe) {
    AirGaps lines;
    lines.top = 60;
    lines.grid = {0, 0, 1, 1, 300};
    lines.rows.resize(1);
    for (const auto& [low, high] : {std::pair{10.0, 20.0}, {18.0, 30.0}, {5.0, 17.0}})
        for (int k = 0; k < 100; ++k)
            lines.rows[0].push_back({static_cast<std::uint32_t>(lines.rows[0].size()), 0, low, high, true});
    const std::vector<double> tops = tops_of(place_layers_both_sides(request(60, 60, 3), lines));
    ASSERT_EQ(tops.size(), 3U);
    EXPECT_LE(tops[0], 17 + 1e-3);
    EXPECT_GE(tops[1], 20 - 1e-3);
    EXPECT_LE(tops[1], 30 + 1e-3);
}

TEST(BothSides, LayersKeepToTheirThickness) {
    Context context;
    const Mesh block = weld(context, block_with_tunnels({0, 0, 0}, {60, 20, 60}, {{15, 8, 6}, {45, 9, 6}}));
    const AirGaps gaps = air_gaps(context, block.view(), 0.1);
    const std::vector<double> tops = tops_of(place_layers_both_sides(request(60, 18.5, 3), gaps));
    double bottom = 0;
    for (const double z : tops) {
        EXPECT_LE(z - bottom, 18.5 + kSameHeight);
        EXPECT_GE(z - bottom, 3 - kSameHeight) << "8 and 9 mm would make both tunnels, and a layer of 1 mm";
        bottom = z;
    }
    EXPECT_EQ(bottom, 60);
    EXPECT_THROW((void)place_layers_both_sides(request(60, 0, 3), gaps), Error);
    // Only a layer under the least thickness is left here.
    EXPECT_EQ(tops_of(place_layers_both_sides(request(60, 2, 3), AirGaps{})).size(), 30U);
}

// Two slits that only boundaries 0.4 to 0.8 mm apart make.
TEST(BothSides, ALayerIsAsThinAsTheJobLetsIt) {
    Context context;
    AirGaps lines;
    lines.top = 60;
    lines.grid = {0, 0, 1, 1, 200};
    lines.rows.resize(1);
    for (const auto& [low, high] : {std::pair{19.9, 20.1}, {20.5, 20.7}})
        for (int k = 0; k < 100; ++k)
            lines.rows[0].push_back({static_cast<std::uint32_t>(lines.rows[0].size()), 0, low, high, true});
    Job job;
    job.layers.sides = SlabSides::two;
    job.tolerances.undercut = 0.05;
    for (const double least : {0.0, 0.5, 0.9, 3.0}) {
        const std::vector<double> tops =
            tops_of(place_two_sided(context, job, request(60, 60, least), lines, {}));
        const double left = unmade_air(context, lines, tops, MilledFrom::both_sides).volume_mm3;
        if (least < 0.8) {
            ASSERT_EQ(tops.size(), 3U) << least;
            EXPECT_NEAR(tops[1] - tops[0], 0.6, 0.2 + kSameHeight);
            EXPECT_LT(left, 1);
        } else {
            EXPECT_EQ(tops.size(), 2U) << least;
            EXPECT_NEAR(left, 0.2 * 100, 0.1) << "one of them stays filled";
        }
    }
}

/// mm³ that stay, and a price for each layer.
double price(const std::vector<std::array<int, 3>>& gaps, const std::vector<double>& tops, double layer) {
    double sum = layer * static_cast<double>(tops.size());
    for (const auto& [low, high, mm2] : gaps)
        if (std::none_of(tops.begin(), tops.end(),
                         [&, l = low, h = high](double z) { return z >= l - 1e-3 && z <= h + 1e-3; }))
            sum += (high - low) * mm2;
    return sum;
}

// Gaps with whole ends: some best boundaries are whole too, as long as layers may be.
TEST(BothSides, NoBoundariesAreBetter) {
    const unsigned seed = test::seed();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const auto below = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
    constexpr int height = 16;
    for (int round = 0; round < 25; ++round) {
        const int longest = 4 + below(8), layer = 1 + below(30);
        std::vector<std::array<int, 3>> gaps;  // low, high, mm²
        AirGaps lines;
        lines.top = height;
        lines.grid = {0, 0, 1, 1, 100};
        lines.rows.resize(1);
        for (int k = 0; k < 3 + below(8); ++k) {
            const int low = 1 + below(height - 3), high = std::min(height - 1, low + 1 + below(5));
            gaps.push_back({low, high, 1 + below(9)});
            for (int line = 0; line < gaps.back()[2]; ++line)
                lines.rows[0].push_back({static_cast<std::uint32_t>(lines.rows[0].size()), 0,
                                         static_cast<double>(low), static_cast<double>(high), true});
        }
        double best = HUGE_VAL;
        for (unsigned set = 0; set < 1U << (height - 1); ++set) {
            std::vector<double> tops;
            int bottom = 0;
            bool fits = true;
            for (int z = 1; z <= height && fits; ++z) {
                if (z < height && (set >> (z - 1) & 1U) == 0) continue;
                fits = z - bottom <= longest;
                tops.push_back(z);
                bottom = z;
            }
            if (fits) best = std::min(best, price(gaps, tops, layer));
        }
        const LayerPlacement found = place_layers_both_sides(
            request(height, longest, 0), lines,
            {.filled_gap = 0, .step_mm3 = 0.01, .layer_mm3 = static_cast<double>(layer)});
        EXPECT_LE(price(gaps, tops_of(found), layer), best + 0.01 * height) << "round " << round;
    }
}

TEST(MilledWays, ATunnelIsMadeOnEndOrFromBothSides) {
    Context context;
    const Mesh block = weld(context, block_with_tunnels({0, 0, 0}, {60, 40, 60}, {{30, 33, 15}}));
    const std::vector<MilledWay> ways = milled_ways(context, block.view(), Job{});
    ASSERT_EQ(ways.size(), 6U);
    const double tunnel = std::numbers::pi * 225 * 40;
    for (const MilledWay& way : ways) {
        SCOPED_TRACE(way.turn[0] + way.turn[1]);
        const bool upright = way.turn[0] == 90 || way.turn[0] == -90;
        EXPECT_TRUE(way.has_room);
        EXPECT_NEAR(way.size[2], upright ? 40 : 60, 1e-4);
        EXPECT_LT(way.both_sides.air.volume_mm3, 1);
        EXPECT_NEAR(way.above.tops.back(), way.size[2], 1e-4);
        if (upright) {
            EXPECT_LT(way.above.air.volume_mm3, 1);
            continue;
        }
        EXPECT_GT(way.above.air.volume_mm3, 0.2 * tunnel);
        ASSERT_FALSE(way.above.air.pockets.empty());
        // In the block's own places, whatever side is down.
        for (const UnmadePocket& p : way.above.air.pockets) {
            EXPECT_LT(std::hypot(p.at[0] - 30, p.at[2] - 33), 15);
            EXPECT_GT(p.at[1], 0);
            EXPECT_LT(p.at[1], 40);
        }
    }
}

}  // namespace
}  // namespace slabwright
