// What an obstacle forbids a tool that touches a point, against places of the tool.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "kernels/access/obstacles.h"
#include "tests/support/seed.h"

using namespace slabwright;

namespace {

constexpr double kRadius = 3, kTolerance = 0.05, kReach = kRadius + kTolerance,
                 kClear = kRadius - kTolerance / 2;

class Random {
public:
    explicit Random(std::uint64_t seed) : random_(seed) {}
    double uniform(double a, double b) {
        return a + (b - a) * static_cast<double>(random_() % 1'000'003) / 1'000'002;
    }
    Point3 direction(double lowest) {
        const double z = uniform(lowest, 1), phi = uniform(0, 2 * std::numbers::pi),
                     across = std::sqrt(1 - z * z);
        return {across * std::cos(phi), across * std::sin(phi), z};
    }
    Point3 point(double size) { return {uniform(-size, size), uniform(-size, size), uniform(-size, size)}; }

private:
    std::mt19937_64 random_;
};

}  // namespace

// A direction in the cap: from whatever point near p a ball is touched by that lies so, it holds the
// obstacle, or what stands above it. And no cap is smaller than it must be, where it is about p alone.
TEST(Obstacles, OfABallAgainstItsPlaces) {
    Random random(test::seed());
    const Obstacles obstacles(Obstacles::Tool::ball, kRadius, kTolerance);
    int in = 0, out = 0;
    for (int i = 0; i < 200'000; ++i) {
        const Point3 p = random.point(4), shift = random.direction(-1), to = random.direction(0);
        Point3 obstacle = random.point(2.5);
        for (int k = 0; k < 3; ++k) obstacle[k] += p[k];
        const double around = i % 2 ? 0.3 : 0.0, off = around * random.uniform(0, 1);
        Point3 centre, u;
        for (int k = 0; k < 3; ++k) centre[k] = p[k] + off * shift[k] + kReach * to[k];
        const double from = std::hypot(centre[0] - p[0], centre[1] - p[1], centre[2] - p[2]);
        for (int k = 0; k < 3; ++k) u[k] = (centre[k] - p[k]) / from;
        const double margin = obstacles.cap(obstacle, p, u, around).margin(u);
        // What stands on the obstacle's spot reaches up to the ground under it.
        const double above = std::min(0.0, obstacle[2] - centre[2]);
        const double distance = std::hypot(obstacle[0] - centre[0], obstacle[1] - centre[1], above);
        if (margin > 1e-9) {
            EXPECT_LT(distance, kClear + 1e-9) << i;
            ++in;
        } else if (around == 0 && margin < -1e-9) {
            EXPECT_GT(distance, kClear - 1e-9) << i;
            ++out;
        }
    }
    EXPECT_GT(in, 5000);
    EXPECT_GT(out, 5000);
}

TEST(Obstacles, TheStrongestOfThoseUsedLast) {
    Random random(test::seed());
    for (const Obstacles::Tool tool : {Obstacles::Tool::ball, Obstacles::Tool::flat}) {
        Obstacles obstacles(tool, kRadius, kTolerance);
        int found = 0;
        for (int i = 0; i < 20'000; ++i) {
            const Point3 p = random.point(1), u = random.direction(0);
            const double around = tool == Obstacles::Tool::ball ? random.uniform(0, 0.1) : 0;
            double most = CapCover::kInside;
            std::size_t best = Obstacles::kMost;
            for (std::size_t k = 0; k < obstacles.size(); ++k)
                if (const double margin = obstacles.cap(obstacles.point(k), p, u, around).margin(u);
                    margin > most)
                    most = margin, best = k;
            const std::size_t strongest = obstacles.strongest(p, u, around);
            ASSERT_EQ(strongest == Obstacles::kMost, best == Obstacles::kMost);
            if (best < Obstacles::kMost) {
                EXPECT_NEAR(obstacles.cap(obstacles.point(strongest), p, u, around).margin(u), most, 1e-12);
                const Point3 used = obstacles.point(strongest);
                obstacles.use(strongest);
                EXPECT_EQ(obstacles.point(0), used);
                ++found;
            }
            if (i % 10 == 0) {
                const Point3 last =
                    obstacles.size() == Obstacles::kMost ? obstacles.point(Obstacles::kMost - 2) : Point3{};
                const Point3 next = random.point(3);
                obstacles.remember(next);
                EXPECT_EQ(obstacles.point(0), next);
                if (last != Point3{}) {
                    EXPECT_EQ(obstacles.point(Obstacles::kMost - 1), last);
                }
            }
        }
        EXPECT_GT(found, 2000);
    }
}
