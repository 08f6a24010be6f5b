// Narrow cavities of plates whose slots, holes and wedges are known.
#include "kernels/features/cavities.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <random>

#include "kernels/errors.h"
#include "kernels/mesh/weld.h"
#include "tests/support/drilled_plate.h"
#include "tests/support/seed.h"

namespace slabwright {
namespace {

using test::LoopAxis;
constexpr double kPi = std::numbers::pi;

/// A slot in plan: corners of a rectangle about the axis, `long_` along a direction, with points on its
/// sides.
test::Loop rectangle(const LoopAxis& axis, double long_, double wide, double turn, double z) {
    constexpr int pieces = 8;
    test::Loop loop;
    const double u = long_ / 2, v = wide / 2;
    const double corners[5][2] = {{-u, -v}, {u, -v}, {u, v}, {-u, v}, {-u, -v}};
    for (int side = 0; side < 4; ++side)
        for (int i = 0; i < pieces; ++i) {
            const double t = static_cast<double>(i) / pieces;
            const double x = corners[side][0] + t * (corners[side + 1][0] - corners[side][0]),
                         y = corners[side][1] + t * (corners[side + 1][1] - corners[side][1]);
            loop.push_back({axis.at[0] + x * std::cos(turn) - y * std::sin(turn),
                            axis.at[1] + x * std::sin(turn) + y * std::cos(turn), z});
        }
    return loop;
}

Mesh turned_mesh(Context& context, const test::PlateFacets& facets, double turn, double x, double y) {
    test::PlateFacets placed = facets;
    for (auto& facet : placed)
        for (Vec3d& p : facet)
            p = {x + p[0] * std::cos(turn) - p[1] * std::sin(turn),
                 y + p[0] * std::sin(turn) + p[1] * std::cos(turn), p[2]};
    return weld(context, test::rounded(placed));
}

std::vector<NarrowCavity> cavities_of(Context& context, const Mesh& mesh, const std::vector<double>& tops,
                                      const CavityOptions& options = {}) {
    const FeatureSet features = find_features(context, mesh.view());
    return find_cavities(context, mesh.view(), tops, features.features, options);
}

struct MadeSlot {
    double width, depth, length;
    Vec3d middle;
};

TEST(Cavities, SlotsAreMeasuredExactlyWhereverTheyLie) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> any(0, 1);
    constexpr double height = 65, breadth = 90;
    for (int round = 0; round < 6; ++round) {
        test::DrilledPlate plate(breadth, height);
        std::vector<MadeSlot> made;
        for (int i = 0; i < 10; ++i) {
            const double width = 3 + 9 * any(random), depth = 10 + 50 * any(random);
            const double length = width + 5 + 50 * any(random), cell = 90;
            const LoopAxis axis{{plate.next_x() + cell / 2, breadth / 2, 0}};
            const double turn = 2 * kPi * any(random);
            const Vec3d apex{axis.at[0], axis.at[1], height - depth};
            plate.cell(cell, axis,
                       {rectangle(axis, length, width, turn, height),
                        rectangle(axis, length, width, turn, height - depth)},
                       &apex);
            made.push_back({width, depth, length, apex});
        }
        const double turn = 2 * kPi * any(random), x = 50 * any(random), y = 50 * any(random);
        Context context({.threads = 1 + round % 2});
        const Mesh mesh = turned_mesh(context, plate.closed(), turn, x, y);
        const auto found = cavities_of(context, mesh, {20, 40, height}, {.least_ratio = 0.5});
        ASSERT_EQ(found.size(), made.size());
        for (const MadeSlot& slot : made) {
            const Vec3d at{x + slot.middle[0] * std::cos(turn) - slot.middle[1] * std::sin(turn),
                           y + slot.middle[0] * std::sin(turn) + slot.middle[1] * std::cos(turn),
                           slot.middle[2]};
            const auto it = std::min_element(found.begin(), found.end(), [&](const auto& a, const auto& b) {
                return length(minus(a.at, at)) < length(minus(b.at, at));
            });
            EXPECT_LT(length(minus(it->at, at)), 3);
            EXPECT_NEAR(it->width_mm, slot.width, 1e-3) << slot.depth << " deep";
            EXPECT_NEAR(it->widest_mm, slot.width, 1e-3);
            EXPECT_NEAR(it->depth_mm(), slot.depth, 1e-5) << slot.width << " wide";
            EXPECT_NEAR(it->length_mm, slot.length - slot.width, 2e-3);
            EXPECT_NEAR(it->area_mm2(),
                        (slot.length - slot.width) * slot.width + kPi / 4 * slot.width * slot.width, 0.05);
            EXPECT_EQ(it->area_under(slot.width), 0);
            EXPECT_DOUBLE_EQ(it->area_under(slot.width + 0.01), it->area_mm2());
            const CavityInLayer& lowest = it->layers.front();
            const double floor = height - slot.depth;
            EXPECT_EQ(lowest.layer, floor < 20 ? 0U : floor < 40 ? 1U : 2U);
            EXPECT_NEAR(lowest.reach_mm(), (floor < 20 ? 20 : floor < 40 ? 40 : height) - floor, 1e-5);
        }
    }
}

// Slots of two widths one in the other are two cavities; holes are round ones; a slot with leaning walls is
// one all the way down, as wide as at its floor.
TEST(Cavities, StepsAreDividedAndLeaningWallsAreNot) {
    Context context;
    test::DrilledPlate plate(60, 30);
    const LoopAxis stepped{{30, 30, 0}}, hole{{80, 30, 0}}, leaning{{130, 30, 0}};
    const Vec3d deep{30, 30, 4}, floor{130, 30, 10};
    plate.cell(60, stepped,
               {rectangle(stepped, 40, 10, 0.3, 30), rectangle(stepped, 40, 10, 0.3, 16),
                rectangle(stepped, 20, 4, 0.3, 16), rectangle(stepped, 20, 4, 0.3, 4)},
               &deep);
    std::mt19937 random(1);
    const std::vector<double> angles = test::turn(64, 0.1, 0, random);
    plate.cell(40, hole, {hole.ring(angles, 2.5, 30), hole.ring(angles, 2.5, 0)}, nullptr);
    plate.cell(60, leaning, {rectangle(leaning, 44, 8, 1.1, 30), rectangle(leaning, 42, 6, 1.1, 10)}, &floor);
    const Mesh mesh = weld(context, test::rounded(plate.closed()));
    const auto found = cavities_of(context, mesh, {30});
    ASSERT_EQ(found.size(), 4U);
    const auto near = [&](double x, double width) {
        return *std::min_element(found.begin(), found.end(), [&](const auto& a, const auto& b) {
            return std::abs(a.at[0] - x) + std::abs(a.width_mm - width) <
                   std::abs(b.at[0] - x) + std::abs(b.width_mm - width);
        });
    };
    const NarrowCavity lower = near(30, 4), upper = near(30, 10), round = near(80, 5), draft = near(130, 6);
    EXPECT_NEAR(lower.width_mm, 4, 1e-3);
    EXPECT_NEAR(lower.depth_mm(), 12, 1e-5);
    EXPECT_NEAR(upper.width_mm, 10, 1e-3);
    EXPECT_NEAR(upper.depth_mm(), 14, 1e-5);
    EXPECT_EQ(lower.layers.front().layer_top_mm, 30) << "the tool comes from the layer's top";
    EXPECT_NEAR(lower.layers.front().reach_mm(), 26, 1e-5);
    EXPECT_NEAR(round.width_mm, 5, 5 * (1 - std::cos(kPi / 64)) + 1e-3) << "within the chords";
    EXPECT_NEAR(round.depth_mm(), 30, 1e-5);
    EXPECT_LT(round.length_mm, 0.5);
    EXPECT_NEAR(draft.width_mm, 6, 1e-3);
    EXPECT_NEAR(draft.widest_mm, 8, 1e-3);
    EXPECT_NEAR(draft.depth_mm(), 20, 1e-5);
}

TEST(Cavities, TheyDoNotDependOnThreads) {
    test::DrilledPlate plate(60, 30);
    for (int i = 0; i < 4; ++i) {
        const LoopAxis axis{{plate.next_x() + 30, 30, 0}};
        const Vec3d floor{axis.at[0], 30, 4.0 + i};
        plate.cell(60, axis,
                   {rectangle(axis, 40, 8, 0.4 * i, 30), rectangle(axis, 38, 6 - i, 0.4 * i, 4.0 + i)},
                   &floor);
    }
    const auto of = [&](int threads) {
        Context context({.threads = threads});
        const Mesh mesh = weld(context, test::rounded(plate.closed()));
        return cavities_of(context, mesh, {15, 30});
    };
    const auto one = of(1), four = of(4);
    ASSERT_EQ(one.size(), 4U);
    ASSERT_EQ(four.size(), 4U);
    for (std::size_t i = 0; i < 4; ++i) {
        EXPECT_EQ(one[i].at, four[i].at);
        EXPECT_EQ(one[i].width_mm, four[i].width_mm);
        EXPECT_EQ(one[i].area_mm2(), four[i].area_mm2());
        EXPECT_EQ(one[i].length_mm, four[i].length_mm);
        ASSERT_EQ(one[i].layers.size(), 2U);
        EXPECT_EQ(one[i].layers[1].low_mm, 15) << "where the upper layer begins";
    }
}

TEST(Cavities, WhatIsWideOrShallowIsNone) {
    Context context;
    test::DrilledPlate plate(60, 30);
    const LoopAxis wide{{30, 30, 0}}, shallow{{90, 30, 0}};
    const Vec3d floor{30, 30, 4}, high{90, 30, 27};
    plate.cell(60, wide, {rectangle(wide, 40, 20, 0, 30), rectangle(wide, 40, 20, 0, 4)}, &floor);
    plate.cell(60, shallow, {rectangle(shallow, 40, 5, 0, 30), rectangle(shallow, 40, 5, 0, 27)}, &high);
    const Mesh mesh = weld(context, test::rounded(plate.closed()));
    EXPECT_TRUE(cavities_of(context, mesh, {30}).empty());
    EXPECT_EQ(cavities_of(context, mesh, {30}, {.most_width_mm = 25}).size(), 1U);
    EXPECT_EQ(cavities_of(context, mesh, {30}, {.least_ratio = 0.5}).size(), 1U);
    EXPECT_THROW((void)cavities_of(context, mesh, {30}, {.most_width_mm = 0.1}), Error);
    EXPECT_THROW((void)cavities_of(context, mesh, {30}, {.step_mm = 0}), Error);
    EXPECT_TRUE(cavities_of(context, {}, {30}).empty());
    EXPECT_TRUE(cavities_of(context, mesh, {}).empty());
}

}  // namespace
}  // namespace slabwright
