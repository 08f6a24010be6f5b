// Straight cuts through a sheet: none enters the part, and print's rule beside them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>

#include "engine/sheets/majorant.h"
#include "tests/support/seed.h"

namespace slabwright {
namespace {

using Profile = std::vector<ProfilePoint>;

Profile sampled(double height, int n, const std::function<double(double)>& r) {
    Profile profile;
    for (int i = 0; i <= n; ++i) profile.push_back({height * i / n, r(height * i / n)});
    return profile;
}

double at(const StraightCut& cut, const Profile& profile, double z) {
    return cut.bottom +
           (cut.top - cut.bottom) * (z - profile.front().z) / (profile.back().z - profile.front().z);
}

/// How deep the deepest cut enters the part, along r.
double gouge(const Profile& profile, const std::vector<StraightCut>& cuts) {
    double deepest = -std::numeric_limits<double>::infinity();
    for (const StraightCut& cut : cuts)
        for (const ProfilePoint& p : profile) deepest = std::max(deepest, p.r - at(cut, profile, p.z));
    return deepest;
}

Profile random_profile(std::mt19937& random) {
    std::uniform_real_distribution<double> unit(-1, 1);
    const int n = 2 + static_cast<int>(random() % 60);
    Profile profile;
    double z = 0, r = 10 * unit(random), slope = unit(random);
    for (int i = 0; i < n; ++i) {
        profile.push_back({z, r});
        z += 0.05 + 0.5 * std::abs(unit(random));
        if (random() % 8 == 0) slope = 2 * unit(random);
        slope += 0.3 * unit(random);
        r += slope * 0.3 + (random() % 10 == 0 ? 2 * unit(random) : 0);
    }
    return profile;
}

TEST(Majorant, IsTheLeastConcaveFunctionOverTheProfile) {
    std::mt19937 random(test::seed());
    for (int round = 0; round < 500; ++round) {
        const Profile profile = random_profile(random);
        const Profile majorant = concave_majorant(profile);
        for (const ProfilePoint& p : profile) {
            // Brute force: the highest chord over p.
            double highest = p.r;
            for (const ProfilePoint& a : profile)
                for (const ProfilePoint& b : profile)
                    if (a.z < p.z && b.z > p.z)
                        highest = std::max(highest, a.r + (b.r - a.r) * (p.z - a.z) / (b.z - a.z));
            ASSERT_NEAR(majorant_at(majorant, p.z), highest, 1e-9 * (1 + std::abs(highest)));
        }
    }
}

TEST(Majorant, CutsNeverEnterAndLeaveNoMoreThanAsked) {
    std::mt19937 random(test::seed());
    for (int round = 0; round < 500; ++round) {
        const Profile profile = random_profile(random);
        const Profile majorant = concave_majorant(profile);
        const double leave = 0.02 + 0.2 * std::uniform_real_distribution<double>(0, 1)(random);
        const std::vector<StraightCut> cuts = cuts_along(majorant, leave);
        ASSERT_FALSE(cuts.empty());
        ASSERT_LT(gouge(profile, cuts), 1e-7) << round;
        // Between the cuts' own crossings too: the farthest place of their lower envelope.
        const double height = profile.back().z;
        for (int i = 0; i <= 400; ++i) {
            const double z = height * i / 400;
            double r = std::numeric_limits<double>::infinity();
            for (const StraightCut& cut : cuts) r = std::min(r, at(cut, profile, z));
            double away = std::numeric_limits<double>::infinity();
            for (std::size_t k = 0; k + 1 < majorant.size(); ++k) {
                const double dz = majorant[k + 1].z - majorant[k].z, dr = majorant[k + 1].r - majorant[k].r;
                const double t = std::clamp(
                    ((z - majorant[k].z) * dz + (r - majorant[k].r) * dr) / (dz * dz + dr * dr), 0.0, 1.0);
                away = std::min(away, std::hypot(z - majorant[k].z - t * dz, r - majorant[k].r - t * dr));
            }
            ASSERT_LT(away, leave * (1 + 1e-6) + 1e-7) << round << " at " << z;
        }
        for (const double z : {0.0, height / 3, height}) {
            const StraightCut cut = supporting_cut(majorant, z, 1e9);
            ASSERT_LT(gouge(profile, {cut}), 1e-7);
            ASSERT_NEAR(at(cut, profile, z), majorant_at(majorant, z), 1e-7);
            const StraightCut limited = supporting_cut(majorant, z, 0.5);
            ASSERT_LT(gouge(profile, {limited}), 1e-7);
            ASSERT_LE(std::abs(limited.top - limited.bottom), 0.5 * height + 1e-9);
        }
    }
}

// ⌈Δφ / (2 acos(ρ / (ρ + e)))⌉ cuts along a convex arc.
TEST(Majorant, ConvexArcTakesAsManyCutsAsTheFormulaSays) {
    for (const double radius : {8.0, 10.0, 40.0})
        for (const double leave : {0.01, 0.05, 0.2}) {
            const double height = 6;
            const Profile profile =
                sampled(height, 240, [&](double z) { return std::sqrt(radius * radius - z * z); });
            const double turn = std::asin(height / radius);
            const double exact = turn / (2 * std::acos(radius / (radius + leave)));
            const double n = static_cast<double>(cuts_along(concave_majorant(profile), leave).size());
            // At the ends a cut may leave `leave` square to the arc's end, which is a little more than to the
            // arc.
            EXPECT_LE(n, std::ceil(exact - 1e-9)) << radius << ' ' << leave;
            EXPECT_GE(n + 0.5, exact) << radius << ' ' << leave;
        }
}

// A hemisphere's sheet: n cuts leave ρ (1 / cos(Δφ / 2n) − 1) at their corners. A cone's leaves nothing.
TEST(Majorant, HemisphereAndConeLeaveTheClosedForm) {
    const double radius = 30, low = 6, high = 12;
    const Profile ball = sampled(
        high - low, 400, [&](double z) { return std::sqrt(radius * radius - (low + z) * (low + z)); });
    const auto cuts = cuts_along(concave_majorant(ball), 0.02);
    const double turn = std::asin(high / radius) - std::asin(low / radius);
    const double closed = radius * (1 / std::cos(turn / 2 / static_cast<double>(cuts.size())) - 1);
    double left = 0;
    for (int i = 0; i <= 4000; ++i) {
        const double z = (high - low) * i / 4000;
        double r = std::numeric_limits<double>::infinity();
        for (const StraightCut& cut : cuts) r = std::min(r, at(cut, ball, z));
        left = std::max(left, std::hypot(r, low + z) - radius);
    }
    EXPECT_GT(cuts.size(), 1u);
    EXPECT_NEAR(left, closed, 0.06 * closed + 1e-4);
    const Profile cone = sampled(6, 400, [](double z) { return 40 - 0.8 * z; });
    EXPECT_LT(left_over(cone, cuts_along(concave_majorant(cone), 0.02)), 1e-6);
}

TEST(Majorant, ConcaveArcIsCutOnceAndLeavesItsSagitta) {
    const double radius = 10, height = 6;
    const Profile profile = sampled(height, 600, [&](double z) {
        return -std::sqrt(radius * radius - (z - height / 2) * (z - height / 2));
    });
    const auto cuts = cuts_along(concave_majorant(profile), 1e-4);
    ASSERT_EQ(cuts.size(), 1u);
    const double must = radius - std::sqrt(radius * radius - height * height / 4);
    EXPECT_NEAR(must, 0.461, 5e-4);
    EXPECT_NEAR(left_over(profile, cuts), must, 2e-4);
}

TEST(Majorant, ThereAreAThousandCutsAtMost) {
    // Every one of its edges would be a cut.
    const Profile profile = sampled(10, 1002, [](double z) { return std::sqrt(400 - z * z); });
    EXPECT_EQ(cuts_along(concave_majorant(profile), 1e-9).size(), 1000U);
}

TEST(Majorant, StraightWallIsCutOnce) {
    for (const double slope : {0.0, 0.7, -1.3}) {
        const auto cuts =
            cuts_along(concave_majorant(sampled(6, 16, [&](double z) { return 3 + slope * z; })), 0.1);
        ASSERT_EQ(cuts.size(), 1u);
        EXPECT_NEAR(cuts[0].bottom, 3, 1e-6);
        EXPECT_NEAR(cuts[0].top, 3 + 6 * slope, 1e-6);
    }
}

/// FDFF's rule (L740–768): the unsigned angles of the tangents with z at bottom and top are compared. Convex:
/// a cut along the tangent at each thin section. Otherwise: one cut through bottom and top.
/// @param as_convex what to do where the angles are equal
std::vector<StraightCut> printed_cuts(const Profile& profile, bool as_convex) {
    const auto slope = [&](std::size_t i) {
        return (profile[i + 1].r - profile[i].r) / (profile[i + 1].z - profile[i].z);
    };
    const std::size_t last = profile.size() - 2;
    const double theta = std::atan(std::abs(slope(0))), beta = std::atan(std::abs(slope(last)));
    const double z0 = profile.front().z, z1 = profile.back().z;
    if (theta > beta + 1e-9 || (as_convex && theta > beta - 1e-9)) {
        std::vector<StraightCut> cuts;
        for (std::size_t i = 0; i <= last; ++i)
            cuts.push_back({profile[i + 1].r + slope(i) * (z0 - profile[i + 1].z),
                            profile[i + 1].r + slope(i) * (z1 - profile[i + 1].z)});
        return cuts;
    }
    return {{profile.front().r, profile.back().r}};
}

// A concave undercut of R 10 in 6 mm, in 16 thin sections, and an S of r = 10 + 1.5 sin(2πz/6).
TEST(Majorant, PrintedRuleCutsIntoThePartAndThisDoesNot) {
    const Profile undercut = sampled(6, 16, [](double z) { return 10 - std::sqrt(100 - (6 - z) * (6 - z)); });
    const Profile s =
        sampled(6, 256, [](double z) { return 10 + 1.5 * std::sin(2 * std::numbers::pi * z / 6); });
    // Print calls it convex, and its first cut, along the topmost section, goes through the whole sheet.
    const double in_undercut = gouge(undercut, {printed_cuts(undercut, true).back()});
    const double in_s = gouge(s, printed_cuts(s, true)), in_s_once = gouge(s, printed_cuts(s, false));
    std::printf("  print's rule cuts in by %.2f mm (undercut), %.1f mm (S; as one cut %.2f mm)\n",
                in_undercut, in_s, in_s_once);
    EXPECT_NEAR(in_undercut, 1.89, 0.005);
    EXPECT_NEAR(in_s, 9.4, 0.05);
    EXPECT_NEAR(in_s_once, 1.5, 0.01);
    for (const Profile& profile : {undercut, s}) {
        const auto cuts = cuts_along(concave_majorant(profile), 0.05);
        EXPECT_LT(gouge(profile, cuts), 1e-9);
    }
}

}  // namespace
}  // namespace slabwright
