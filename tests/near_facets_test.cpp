// NearFacets against points sampled on facets and ways: nothing that meets is left out, and little is kept
// that does not.
#include "kernels/access/near_facets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "tests/support/seed.h"

using namespace slabwright;

namespace {

using P = std::array<double, 3>;

/// The least distance from a way's points and what is above them to a facet's points not higher than `top`:
/// of a cylinder the horizontal one, of what is higher than the way. Sampled, so it is too great by up to the
/// greatest gap between samples.
double sampled_distance(const std::array<P, 3>& v, const P& a, const P& b, bool ball, double top, int steps) {
    double best2 = 1e300;
    for (int i = 0; i <= steps; ++i)
        for (int j = 0; i + j <= steps; ++j) {
            const double s = static_cast<double>(i) / steps, t = static_cast<double>(j) / steps;
            P q;
            for (std::size_t k = 0; k < 3; ++k)
                q[k] = v[0][k] + s * (v[1][k] - v[0][k]) + t * (v[2][k] - v[0][k]);
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
        const double radius = between(0.5, 7), at_least = trial % 3 == 0 ? 0.0 : between(0, 0.01),
                     reach = radius - at_least, up = ball ? radius : at_least;
        const P corner{between(-300, 300), between(-300, 300), between(-20, 20)};
        P low, high;
        for (std::size_t k = 0; k < 3; ++k)
            low[k] = corner[k], high[k] = corner[k] + (trial % 5 == 0 && k == 2 ? 0.0 : between(0, 4));
        const double top = high[2] + between(-1, 2 * radius);
        // Facets of all sizes around the box, slivers and points among them, in two lots.
        std::vector<std::array<P, 3>> all;
        std::vector<std::size_t> of;  // which facet is the near ones' k-th
        NearFacets near;
        near.place(low, high, reach, ball, top, up);
        std::vector<unsigned char> keep;
        const std::array<std::size_t, 2> sizes{FacetRows::kMost, 37};
        std::array<FacetRows, 2> lots;
        for (const std::size_t lot : sizes) {
            FacetRows& rows = lots[all.empty() ? 0 : 1];
            const std::size_t first = all.size();
            for (std::size_t i = 0; i < lot; ++i) {
                const double size = std::pow(10, between(-2, 0.7));
                P middle;
                for (std::size_t k = 0; k < 3; ++k)
                    middle[k] =
                        between(low[k] - 1.5 * radius, high[k] + 1.5 * radius) + (k == 2 ? radius / 2 : 0);
                std::array<P, 3> v;
                for (P& p : v)
                    for (std::size_t k = 0; k < 3; ++k)
                        p[k] = static_cast<float>(middle[k] + between(-size, size));
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
            for (std::size_t k = 0; k < 3; ++k)
                a[k] = between(low[k], high[k]), b[k] = way == 3 ? a[k] : between(low[k], high[k]);
            if (way == 2) b[2] = a[2];
            const double lift = ball ? radius : depth, lowest = std::min(a[2], b[2]), asked = radius - depth;
            const NearWay asking{{a[0], a[1], a[2] + lift},
                                 {b[0], b[1], b[2] + lift},
                                 asked,
                                 lowest + (ball ? radius - asked : depth),
                                 0};
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
                    EXPECT_TRUE(by_one[i]) << "seed " << seed << " trial " << trial << " way " << way
                                           << " facet " << i << " at " << d << " of " << asked;
                    EXPECT_TRUE(by_two[i]) << "seed " << seed << " trial " << trial << " way " << way
                                           << " facet " << i << " at " << d << " of " << asked;
                    // It is kept down to a reach that is just enough.
                    if (met % 8 == 0) {
                        NearWay just = asking;
                        just.reach = d + 1e-9;
                        if (ball) just.above = lowest + radius - just.reach;
                        near.near(just, true, twice_just);
                        bool found = false;
                        for_each_kept(twice_just, [&](std::size_t k) { found = found || of[k] == i; });
                        EXPECT_TRUE(found) << "seed " << seed << " trial " << trial << " way " << way
                                           << " facet " << i << " at " << d;
                    }
                } else {
                    EXPECT_LE(by_two[i], by_one[i]);
                    far += by_one[i], far_closely += by_two[i];
                }
                kept += by_one[i], kept_closely += by_two[i];
            }
            // Added for the way, those are kept that are kept when it is asked for later.
            NearFacets only;
            only.place(low, high, reach, ball, top, up);
            std::vector<std::size_t> added, wanted;
            for (std::size_t i = 0; i < lots.size(); ++i) {
                only.add(lots[i], sizes[i], asking, way % 2 == 0, keep);
                for_each_kept(keep, [&](std::size_t k) { added.push_back(i * FacetRows::kMost + k); });
            }
            for_each_kept(way % 2 == 0 ? twice : once, [&](std::size_t k) { wanted.push_back(of[k]); });
            EXPECT_EQ(added, wanted) << "seed " << seed << " trial " << trial << " way " << way;
        }
    }
    std::printf("met %zu, kept %zu and %zu closely, of those %zu and %zu far\n", met, kept, kept_closely, far,
                far_closely);
    EXPECT_GT(met, 10000u);
    EXPECT_LT(far_closely, kept_closely / 5);
}

TEST(NearFacets, EightsKeepAllThatIsAroundAWay) {
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    auto between = [&](double low, double high) { return low + (high - low) * unit(random); };
    std::size_t met = 0, kept = 0, all = 0;
    for (int trial = 0; trial < 600; ++trial) {
        const bool ball = trial % 2 == 0;
        const double radius = between(0.5, 7), length = trial % 3 == 0 ? 0.0 : between(0, 8);
        const P a{between(-600, 600), between(-600, 600), between(-20, 20)};
        P b = a;
        for (double& v : b) v += between(-length, length);
        if (trial % 5 == 0) b[2] = a[2];
        if (trial % 7 == 0) b[0] = a[0], b[1] = a[1];
        const double lowest = std::min(a[2], b[2]), top = lowest + between(-radius, 2 * radius),
                     margin = 1e-5 * (620 + radius);
        const NearWay way{a, b, radius, ball ? lowest - radius : lowest, 0};
        const WayAround around(way, ball, lowest, top, radius + margin);
        std::array<EightFacets, ManyEights::kMost> eights;
        std::array<std::array<P, 3>, 8 * ManyEights::kMost> facets;
        ManyEights many;
        const std::size_t count = 1 + static_cast<std::size_t>(trial) % ManyEights::kMost;
        for (std::size_t i = 0; i < 8 * count; ++i) {
            const double size = std::pow(10, between(-2, 0.7)), along = unit(random);
            for (P& p : facets[i])
                p = {a[0] + along * (b[0] - a[0]), a[1] + along * (b[1] - a[1]),
                     a[2] + along * (b[2] - a[2])};
            const P off{between(-1.5, 1.5) * radius, between(-1.5, 1.5) * radius,
                        between(-1.5, 1.5) * radius};
            for (P& p : facets[i])
                for (std::size_t k = 0; k < 3; ++k)
                    p[k] = static_cast<float>(p[k] + off[k] + between(-size, size));
            if (i % 16 == 0) facets[i][2] = facets[i][1];
            EightFacets& e = eights[i / 8];
            const std::size_t k = i % 8;
            auto single = [&](std::size_t p, std::size_t axis) {
                return static_cast<float>(facets[i][p][axis]);
            };
            e.x0[k] = single(0, 0), e.y0[k] = single(0, 1), e.z0[k] = single(0, 2);
            e.x1[k] = single(1, 0), e.y1[k] = single(1, 1), e.z1[k] = single(1, 2);
            e.x2[k] = single(2, 0), e.y2[k] = single(2, 1), e.z2[k] = single(2, 2);
        }
        // Facets that there are none of.
        constexpr float none = std::numeric_limits<float>::quiet_NaN();
        EightFacets& last = eights[count - 1];
        for (auto* row :
             {&last.x0, &last.y0, &last.z0, &last.x1, &last.y1, &last.z1, &last.x2, &last.y2, &last.z2})
            (*row)[7] = none;
        for (std::size_t i = 0; i < count; ++i) many.eights[many.count++] = &eights[i];
        std::array<unsigned, ManyEights::kMost> keep;
        facets_around(many, around, keep);
        for (std::size_t i = 0; i < count; ++i) {
            std::vector<std::size_t> bits;
            for_each_bit(keep[i], [&](std::size_t k) { bits.push_back(k); });
            EXPECT_TRUE(std::is_sorted(bits.begin(), bits.end()));
            kept += bits.size(), all += 8;
            for (std::size_t k = 0; k < 8; ++k) {
                const bool is_kept = std::find(bits.begin(), bits.end(), k) != bits.end();
                if (i + 1 == count && k == 7) {
                    EXPECT_FALSE(is_kept);
                    continue;
                }
                const double d = sampled_distance(facets[8 * i + k], a, b, ball, top, 12);
                met += d < radius;
                if (d < radius) {
                    EXPECT_TRUE(is_kept) << "seed " << seed << " trial " << trial << " facet " << 8 * i + k
                                         << " at " << d << " of " << radius;
                }
            }
        }
    }
    std::printf("met %zu, kept %zu of %zu\n", met, kept, all);
    EXPECT_GT(met, 2500u);
    EXPECT_LT(kept, met + met / 3);
}

// Level ways, straight and along circles of all sizes: down to a reach that is just enough, a facet is kept.
TEST(NearFacets, LevelWaysKeepAllThatIsNearAndLittleElse) {
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    auto between = [&](double low, double high) { return low + (high - low) * unit(random); };
    std::size_t met = 0, kept = 0, far = 0, all = 0;
    for (int trial = 0; trial < 800; ++trial) {
        const double reach = between(0.5, 7);
        const bool arc = trial % 2 == 0;
        constexpr int kSteps = 60;
        std::vector<P> way;
        P centre{between(-600, 600), between(-600, 600), between(-20, 20)};
        const double radius = std::pow(10, between(-1, 3)), start = between(-4, 4),
                     turn = std::min(6.3, between(0, 8) / radius);
        if (arc) {
            for (int i = 0; i <= kSteps; ++i) {
                const double at = start + turn * i / kSteps;
                way.push_back(
                    {centre[0] + radius * std::cos(at), centre[1] + radius * std::sin(at), centre[2]});
            }
        } else {
            const double length = trial % 6 == 1 ? 0.0 : between(0, 8);
            for (int i = 0; i <= kSteps; ++i)
                way.push_back({centre[0] + length * std::cos(start) * i / kSteps,
                               centre[1] + length * std::sin(start) * i / kSteps, centre[2]});
        }
        const double top = centre[2] + between(-reach / 2, 2 * reach);
        auto within = [&](double limit) {
            if (!arc) return LevelWay(way.front(), way.back(), top, limit);
            const double middle = start + turn * unit(random), tx = -std::sin(middle), ty = std::cos(middle);
            const P about{centre[0] + radius * std::cos(middle), centre[1] + radius * std::sin(middle),
                          centre[2]};
            double before = 0, after = 0, bow = 0;
            for (const P& p : way) {
                const double x = p[0] - about[0], y = p[1] - about[1], along = x * tx + y * ty;
                before = std::max(before, -along), after = std::max(after, along),
                bow = std::max(bow, y * tx - x * ty);
            }
            return LevelWay(centre[0], centre[1], radius, about, before, after, bow, top, limit);
        };
        EightFacets e;
        std::array<std::array<P, 3>, 8> facets;
        for (std::size_t i = 0; i < 8; ++i) {
            const double size = std::pow(10, between(-2, trial % 4 < 2 ? 0 : 1));
            const P& from = way[static_cast<std::size_t>(unit(random) * kSteps)];
            // About as far away as the reach is, on any side but above.
            const double side = between(0, 6.3), steep = between(-1.6, 0.3),
                         distance = reach * between(0.85, 1.15);
            const P middle{from[0] + distance * std::cos(steep) * std::cos(side),
                           from[1] + distance * std::cos(steep) * std::sin(side),
                           from[2] + distance * std::sin(steep)};
            for (P& p : facets[i])
                for (std::size_t k = 0; k < 3; ++k)
                    p[k] = static_cast<float>(middle[k] + between(-size, size));
            if (i == 5) facets[i][2] = facets[i][1];
            auto single = [&](std::size_t p, std::size_t axis) {
                return static_cast<float>(facets[i][p][axis]);
            };
            e.x0[i] = single(0, 0), e.y0[i] = single(0, 1), e.z0[i] = single(0, 2);
            e.x1[i] = single(1, 0), e.y1[i] = single(1, 1), e.z1[i] = single(1, 2);
            e.x2[i] = single(2, 0), e.y2[i] = single(2, 1), e.z2[i] = single(2, 2);
        }
        constexpr float none = std::numeric_limits<float>::quiet_NaN();
        for (auto* row : {&e.x0, &e.y0, &e.z0, &e.x1, &e.y1, &e.z1, &e.x2, &e.y2, &e.z2}) (*row)[7] = none;
        ManyEights many;
        many.eights[many.count++] = &e;
        std::array<unsigned, ManyEights::kMost> keep;
        facets_along(many, within(reach), keep);
        EXPECT_EQ(keep[0] >> 7, 0U);
        for (std::size_t i = 0; i < 7; ++i) {
            double d = 1e300;
            for (const P& p : way) d = std::min(d, sampled_distance(facets[i], p, p, true, top, 12));
            const bool is_kept = (keep[0] >> i & 1) != 0;
            kept += is_kept, ++all;
            if (d < reach) {
                ++met;
                EXPECT_TRUE(is_kept) << "seed " << seed << " trial " << trial << " facet " << i << " at " << d
                                     << " of " << reach;
            } else far += is_kept && d > 1.02 * reach;
            if (d > 1e100) continue;
            std::array<unsigned, ManyEights::kMost> just;
            facets_along(many, within(d + 1e-9), just);
            EXPECT_TRUE((just[0] >> i & 1) != 0)
                << "seed " << seed << " trial " << trial << " facet " << i << " at " << d;
        }
    }
    std::printf("met %zu, kept %zu of %zu, of those %zu far\n", met, kept, all, far);
    EXPECT_GT(met, 1000U);
    EXPECT_LT(far, kept / 10);
}
