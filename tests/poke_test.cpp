// Facets that reach into tools, and what is nearest beside an upright line, against points strewn over the
// facet.
#include "kernels/access/poke.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "tests/support/seed.h"

using namespace slabwright;

namespace {

double norm(const Point3& v) { return std::sqrt(dot(v, v)); }

/// Calls fn for points of a triangle, its corners and edges among them.
template <class Fn>
void strew(const Triangle& t, Fn&& fn) {
    constexpr int n = 40;
    for (int i = 0; i <= n; ++i)
        for (int j = 0; i + j <= n; ++j) {
            const double a = static_cast<double>(i) / n, b = static_cast<double>(j) / n, c = 1 - a - b;
            Point3 p;
            for (std::size_t k = 0; k < 3; ++k) p[k] = c * t[0][k] + a * t[1][k] + b * t[2][k];
            fn(p);
        }
}

/// Random triangles: slivers, upright and level ones, and some with a corner on the axis among them.
Triangle draw(std::mt19937& random, int trial, const Point3& about) {
    std::uniform_real_distribution<double> u(-4, 4), hair(-1e-3, 1e-3);
    Triangle t;
    for (Point3& p : t)
        for (std::size_t k = 0; k < 3; ++k) p[k] = about[k] + u(random) + (k == 2 ? 1.5 : 0);
    if (trial % 5 == 0) t[2] = {t[0][0] + hair(random), t[0][1] + hair(random), t[2][2]};
    if (trial % 7 == 0) t[1][2] = t[2][2] = t[0][2];
    if (trial % 11 == 0) t[0] = {about[0], about[1], t[0][2]};
    return t;
}

}  // namespace

TEST(Poke, FacetsReachIntoToolsWhereTheirPointsDo) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> place(-50, 50);
    const ToolShape tools[] = {
        {.cutter = flat_cutter(2)},
        {.cutter = ball_cutter(2.5)},
        {.cutter = {3, 1, 0}},
        {.cutter = {2.5, 1, 0.3}},
        {.cutter = flat_cutter(1), .flute_length = 2, .shank_radius = 2},
    };
    constexpr double rounding = 2e-6;
    int poke = 0, miss = 0;
    for (int trial = 0; trial < 3000; ++trial) {
        const std::vector<Envelope> parts = envelopes(tools[trial % 5]);
        const Envelope& e = parts.back();
        const Point3 tip{place(random), place(random), place(random)};
        const Triangle t = draw(random, trial, tip);
        double most = -std::numeric_limits<double>::infinity();
        const auto over = [&](const Point3& p) {
            const double d = std::hypot(p[0] - tip[0], p[1] - tip[1]);
            return p[2] - tip[2] - e.height(std::min(d, d < e.radius + rounding ? e.radius : d));
        };
        strew(t, [&](const Point3& p) { most = std::max(most, over(p)); });
        Point3 at{};
        if (pokes(t, tip[0], tip[1], tip[2], e, at)) {
            ++poke;
            EXPECT_LT(norm(minus(at, closest_on_triangle(at, t))), rounding) << trial;
            EXPECT_GT(over(at), -rounding) << trial;
        } else {
            ++miss;
            EXPECT_LT(most, rounding) << trial;
        }
    }
    EXPECT_GT(poke, 500);
    EXPECT_GT(miss, 500);
}

TEST(Poke, NearestOverIsTheNearestOfWhatStandsHigher) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> place(-50, 50);
    int through = 0, beside = 0, none = 0;
    for (int trial = 0; trial < 3000; ++trial) {
        const Point3 point{place(random), place(random), place(random)};
        const Triangle t = draw(random, trial, point);
        double least = std::numeric_limits<double>::infinity();
        const auto off = [&](const Point3& p) { return std::hypot(p[0] - point[0], p[1] - point[1]); };
        strew(t, [&](const Point3& p) {
            if (p[2] > point[2] + 1e-9) least = std::min(least, off(p));
        });
        Point3 at{};
        const double distance = nearest_over(point, t, at);
        EXPECT_LE(distance, least + 1e-9) << trial;
        if (std::isinf(distance)) {
            ++none;
            continue;
        }
        EXPECT_LT(norm(minus(at, closest_on_triangle(at, t))), 1e-6) << trial;
        EXPECT_GE(at[2], point[2] - 1e-9) << trial;
        EXPECT_NEAR(off(at), distance, 1e-9) << trial;
        ++(distance == 0 ? through : beside);
    }
    EXPECT_GT(through, 100);
    EXPECT_GT(beside, 500);
    EXPECT_GT(none, 50);
}
