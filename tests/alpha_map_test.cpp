// The α-map on solids whose slopes are known.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "kernels/errors.h"
#include "kernels/features/alpha_map.h"
#include "kernels/mesh/weld.h"
#include "tests/mesh_shapes.h"

using namespace slabwright;

namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// A square stump: sides at these slopes from level, each over its own height, from the ground up.
Mesh stump(Context& context, const std::vector<std::pair<double, double>>& sides) {
    shapes::Facets facets;
    double half = 50, z = 0;
    auto ring = [](double h, double at) {
        std::array<Vec3f, 4> r;
        constexpr int sign[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
        for (int i = 0; i < 4; ++i)
            r[i] = {static_cast<float>(sign[i][0] * h), static_cast<float>(sign[i][1] * h),
                    static_cast<float>(at)};
        return r;
    };
    auto r = ring(half, z);
    facets.push_back({r[0], r[2], r[1]});
    facets.push_back({r[0], r[3], r[2]});
    for (const auto& [degrees, height] : sides) {
        half -= degrees == 90 ? 0 : height / std::tan(degrees * kDegree);
        z += height;
        const auto next = ring(half, z);
        for (int i = 0; i < 4; ++i) {
            const int k = (i + 1) % 4;
            facets.push_back({r[i], r[k], next[k]});
            facets.push_back({r[i], next[k], next[i]});
        }
        r = next;
    }
    facets.push_back({r[0], r[1], r[2]});
    facets.push_back({r[0], r[2], r[3]});
    return weld(context, facets);
}

}  // namespace

TEST(AlphaMap, FindsSlopesAndBands) {
    Context context;
    const Mesh mesh = stump(context, {{90, 5}, {60.05, 4}, {87.05, 6}});
    const AlphaMap map = alpha_map(context, mesh.view(), 0, 15);
    EXPECT_NEAR(map.least(0, 4.9), 90 * kDegree, 0.1 * kDegree);
    EXPECT_NEAR(map.least(5.1, 8.8), 60 * kDegree, 1e-6);
    EXPECT_NEAR(map.least(9.2, 15), 87 * kDegree, 1e-6);
    EXPECT_NEAR(map.least(0, 15), 60 * kDegree, 1e-6);
    EXPECT_NEAR(map.least(0, 15, 70 * kDegree), 87 * kDegree, 1e-6);
    EXPECT_NEAR(map.least_slope, 60.05 * kDegree, 1e-4);
    EXPECT_FALSE(map.vertical());
    const auto bands = map.bands(0, 0.5 * kDegree);
    ASSERT_EQ(bands.size(), 3u);
    EXPECT_EQ(bands.front().z_low, 0);
    EXPECT_EQ(bands.back().z_high, 15);
    const double expected[3] = {90, 60, 87};
    for (int i = 0; i < 3; ++i) {
        EXPECT_NEAR(bands[i].alpha, expected[i] * kDegree, 0.11 * kDegree);
        if (i > 0) {
            EXPECT_EQ(bands[i].z_low, bands[i - 1].z_high);
        }
    }
    EXPECT_NEAR(bands[1].z_low, 5, 0.11);
    EXPECT_NEAR(bands[2].z_low, 9, 0.11);
    // Bands of less than 5 mm: the middle one goes to the neighbour nearer in α, and keeps the smaller α of
    // the two.
    const auto joined = map.bands(0, 0.5 * kDegree, 5);
    ASSERT_EQ(joined.size(), 2u);
    EXPECT_NEAR(joined[1].alpha, 60 * kDegree, 1e-6);
    EXPECT_NEAR(joined[0].z_high, 5, 0.11);
}

TEST(AlphaMap, KnowsVerticalLayers) {
    Context context;
    const Mesh mesh = stump(context, {{90, 5}, {60, 4}});
    const AlphaMap lower = alpha_map(context, mesh.view(), 0, 5),
                   upper = alpha_map(context, mesh.view(), 5, 9),
                   both = alpha_map(context, mesh.view(), 2, 7);
    EXPECT_TRUE(lower.vertical());
    EXPECT_NEAR(lower.area, 400 * (5 - 0.001), 1e-3);
    EXPECT_FALSE(upper.vertical());
    EXPECT_EQ(upper.vertical_area, 0);
    EXPECT_FALSE(both.vertical());
    EXPECT_NEAR(both.vertical_area, 400 * 3, 1e-3);
    // The sloped side, cut at 7 less a thousandth: two trapezoids' worth of it.
    const double rise = 2 - 0.001, mean = 2 * (50 - rise / 2 / std::tan(60 * kDegree));
    EXPECT_NEAR(both.area - both.vertical_area, 4 * mean * rise / std::sin(60 * kDegree), 1e-2);
    // A layer of nothing but air has no walls, and so no vertical ones.
    EXPECT_FALSE(alpha_map(context, mesh.view(), 10, 20).vertical());
    EXPECT_THROW((void)alpha_map(context, mesh.view(), 5, 5), Error);
}

TEST(AlphaMap, CountsFacetsOfEveryPartOfALargeMesh) {
    // Ever so many level facets, and behind them one at 60.05° just over the ground.
    Mesh mesh;
    const auto back = static_cast<float>(0.05 / std::tan(60.05 * kDegree));
    mesh.vertices = {{0, 0, 5}, {1, 0, 5}, {0, 1, 5}, {0, 0, 0}, {1, 0, 0}, {0, back, 0.05F}};
    mesh.facets.assign(100'000, Index3{0, 1, 2});
    mesh.facets.push_back({3, 4, 5});
    Context context;
    const AlphaMap map = alpha_map(context, mesh.view(), 0, 10);
    ASSERT_EQ(map.slopes[0].size(), 1u);
    EXPECT_NEAR(map.slopes[0][0], 60 * kDegree, 1e-9);
    EXPECT_EQ(std::count_if(map.slopes.begin(), map.slopes.end(), [](const auto& s) { return !s.empty(); }),
              1);
    EXPECT_NEAR(map.area, 0.5 * 0.05 / std::sin(60.05 * kDegree), 1e-6);
}
