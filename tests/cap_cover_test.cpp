// Caps on a sphere against dense directions.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "kernels/access/cap_cover.h"
#include "tests/support/seed.h"

using namespace slabwright;

namespace {

Point3 direction(double height, double phi) {
    const double across = std::sqrt(std::max(0.0, 1 - height * height));
    return {across * std::cos(phi), across * std::sin(phi), height};
}

}  // namespace

TEST(CapCover, OneCapLeavesTheRest) {
    CapCover cover;
    cover.begin({{0, 0, -1}, 0});
    const auto up = cover.uncovered({0, 0, 1});
    ASSERT_TRUE(up);
    EXPECT_NEAR((*up)[2], 0, 1e-9);  // a point of the circle
    cover.add({{0, 0, 1}, -1e-6});   // the other half, and a little more
    EXPECT_FALSE(cover.uncovered({0, 0, 1}));
    cover.begin({{1, 0, 0}, -1.5});  // more than the sphere
    EXPECT_FALSE(cover.uncovered({0, 0, 1}));
}

// What is called covered is so in all of many directions, and a corner that is named lies in no cap.
TEST(CapCover, OfRandomCapsAgainstDenseDirections) {
    std::mt19937_64 random(test::seed());
    auto uniform = [&](double a, double b) {
        return a + (b - a) * static_cast<double>(random() % 1'000'003) / 1'000'002;
    };
    std::vector<Point3> dense;
    constexpr int n = 20000;
    for (int i = 0; i < n; ++i)
        dense.push_back(direction(1 - (2 * i + 1.0) / n, i * std::numbers::pi * (3 - std::sqrt(5.0))));
    int covered = 0, open = 0;
    for (int round = 0; round < 300; ++round) {
        std::vector<Cap> caps{{{0, 0, -1}, uniform(-0.3, 0.3)}};
        CapCover cover;
        cover.begin(caps.front());
        const int most = 3 + round % 12;
        for (int k = 0; k < most; ++k) {
            caps.push_back(
                {direction(uniform(-0.5, 1), uniform(0, 2 * std::numbers::pi)), uniform(0.05, 0.9)});
            cover.add(caps.back());
            const auto corner = cover.uncovered(direction(uniform(-1, 1), uniform(0, 6)));
            bool all = true;
            for (const Point3& u : dense) {
                bool in = false;
                for (const Cap& cap : caps) in = in || cap.margin(u) > 0;
                all = all && in;
            }
            if (!corner) {
                EXPECT_TRUE(all) << "round " << round << " caps " << caps.size();
                ++covered;
                break;
            }
            EXPECT_NEAR(std::hypot((*corner)[0], (*corner)[1], (*corner)[2]), 1, 1e-9);
            for (const Cap& cap : caps) EXPECT_LE(cap.margin(*corner), 1e-8) << "round " << round;
            open += !all;
        }
    }
    EXPECT_GT(covered, 60);
    EXPECT_GT(open, 500);
}
