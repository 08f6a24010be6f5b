// NearFacets against points sampled on facets and ways: nothing that meets is left out, and little is kept that does not.
#include "kernels/access/near_facets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/support/seed.h"

using namespace slabwright;

namespace {

using P = std::array<double, 3>;

/// The least distance from a way's points and what is above them to a facet's points not higher than `top`: of a cylinder the horizontal one, of what is
/// higher than the way. Sampled, so it is too great by up to the greatest gap between samples.
double sampled_distance(const std::array<P, 3>& v, const P& a, const P& b, bool ball, double top, int steps) {
    double best2 = 1e300;
    for (int i = 0; i <= steps; ++i)
        for (int j = 0; i + j <= steps; ++j) {
            const double s = static_cast<double>(i) / steps, t = static_cast<double>(j) / steps;
            P q;
            for (std::size_t k = 0; k < 3; ++k) q[k] = v[0][k] + s * (v[1][k] - v[0][k]) + t * (v[2][k] - v[0][k]);
            if (q[2] >= top) continue;
            for (int n = 0; n <= steps; ++n) {
                const double along = static_cast<double>(n) / steps;
                const double x = a[0] + along * (b[0] - a[0]) - q[0], y = a[1] + along * (b[1] - a[1]) - q[1],
                             z = a[2] + along * (b[2] - a[2]) - q[2];
                if (!ball && z >= 0) continue;
                const double up = ball ? std::max(0.0, z) : 0.0;
                best2 = std::min(best2, x * x + y * y + up * up);
            }
        }
    return std::sqrt(best2);
}

}  // namespace

TEST(NearFacets, KeepsAllThatAWayMeetsAndLittleElse) {
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    auto between = [&](double low, double high) { return low + (high - low) * unit(random); };
    constexpr int kSteps = 12;
    std::size_t met = 0, kept = 0, kept_closely = 0, far = 0, far_closely = 0;
    for (int trial = 0; trial < 300; ++trial) {
        const bool ball = trial % 2 == 0;
        const double radius = between(0.5, 7), at_least = trial % 3 == 0 ? 0.0 : between(0, 0.01), reach = radius - at_least,
                     up = ball ? radius : at_least;
        const P corner{between(-300, 300), between(-300, 300), between(-20, 20)};
        P low, high;
        for (std::size_t k = 0; k < 3; ++k) low[k] = corner[k], high[k] = corner[k] + (trial % 5 == 0 && k == 2 ? 0.0 : between(0, 4));
        const double top = high[2] + between(-1, 2 * radius);
        // Facets of all sizes around the box, slivers and points among them, in two lots.
        std::vector<std::array<P, 3>> all;
        std::vector<std::size_t> of;  // which facet is the near ones' k-th
        NearFacets near;
        near.place(low, high, reach, ball, top, up);
        std::vector<unsigned char> keep;
        for (const std::size_t lot : {std::size_t{FacetRows::kMost}, std::size_t{37}}) {
            FacetRows rows;
            const std::size_t first = all.size();
            for (std::size_t i = 0; i < lot; ++i) {
                const double size = std::pow(10, between(-2, 0.7));
                P middle;
                for (std::size_t k = 0; k < 3; ++k) middle[k] = between(low[k] - 1.5 * radius, high[k] + 1.5 * radius) + (k == 2 ? radius / 2 : 0);
                std::array<P, 3> v;
                for (P& p : v)
                    for (std::size_t k = 0; k < 3; ++k) p[k] = static_cast<float>(middle[k] + between(-size, size));
                if (i % 16 == 0) v[2] = v[1];
                if (i % 16 == 1)
                    for (std::size_t k = 0; k < 3; ++k) v[2][k] = static_cast<float>((v[0][k] + v[1][k]) / 2);
                auto single = [&](std::size_t p, std::size_t k) { return static_cast<float>(v[p][k]); };
                rows.x0[i] = single(0, 0), rows.y0[i] = single(0, 1), rows.z0[i] = single(0, 2);
                rows.x1[i] = single(1, 0), rows.y1[i] = single(1, 1), rows.z1[i] = single(1, 2);
                rows.x2[i] = single(2, 0), rows.y2[i] = single(2, 1), rows.z2[i] = single(2, 2);
                all.push_back(v);
            }
            near.add(rows, lot, keep);
            ASSERT_EQ(keep.size() % 8, 0u);
            for_each_kept(keep, [&](std::size_t k) { of.push_back(first + k); });
        }
        for (int way = 0; way < 4; ++way) {
            P a, b;
            const double depth = at_least + (way % 2 == 0 ? 0 : 0.05);
            for (std::size_t k = 0; k < 3; ++k) a[k] = between(low[k], high[k]), b[k] = way == 3 ? a[k] : between(low[k], high[k]);
            if (way == 2) b[2] = a[2];
            const double lift = ball ? radius : depth, lowest = std::min(a[2], b[2]), asked = radius - depth;
            const NearWay asking{{a[0], a[1], a[2] + lift}, {b[0], b[1], b[2] + lift}, asked, lowest + (ball ? radius - asked : depth), 0};
            std::vector<unsigned char> once, twice, twice_just;
            near.near(asking, false, once);
            near.near(asking, true, twice);
            std::vector<char> by_one(all.size()), by_two(all.size());
            for_each_kept(once, [&](std::size_t k) { by_one[of.at(k)] = 1; });
            for_each_kept(twice, [&](std::size_t k) { by_two[of.at(k)] = 1; });
            for (std::size_t i = 0; i < all.size(); ++i) {
                const double d = sampled_distance(all[i], asking.a, asking.b, ball, top, kSteps);
                if (d < asked) {
                    ++met;
                    EXPECT_TRUE(by_one[i]) << "seed " << seed << " trial " << trial << " way " << way << " facet " << i << " at " << d << " of "
                                           << asked;
                    EXPECT_TRUE(by_two[i]) << "seed " << seed << " trial " << trial << " way " << way << " facet " << i << " at " << d << " of "
                                           << asked;
                    // It is kept down to a reach that is just enough.
                    if (met % 8 == 0) {
                        NearWay just = asking;
                        just.reach = d + 1e-9;
                        if (ball) just.above = lowest + radius - just.reach;
                        near.near(just, true, twice_just);
                        bool found = false;
                        for_each_kept(twice_just, [&](std::size_t k) { found = found || of[k] == i; });
                        EXPECT_TRUE(found) << "seed " << seed << " trial " << trial << " way " << way << " facet " << i << " at " << d;
                    }
                } else {
                    EXPECT_LE(by_two[i], by_one[i]);
                    far += by_one[i], far_closely += by_two[i];
                }
                kept += by_one[i], kept_closely += by_two[i];
            }
            // What is kept of them is judged alike.
            NearFacets fewer;
            fewer.take(near, once);
            std::vector<unsigned char> again;
            fewer.near(asking, true, again);
            std::size_t left = 0, wanted = 0;
            for_each_kept(again, [&](std::size_t) { ++left; });
            for_each_kept(twice, [&](std::size_t) { ++wanted; });
            EXPECT_EQ(left, wanted);
        }
    }
    std::printf("met %zu, kept %zu and %zu closely, of those %zu and %zu far\n", met, kept, kept_closely, far, far_closely);
    EXPECT_GT(met, 10000u);
    EXPECT_LT(far_closely, kept_closely / 5);
}
