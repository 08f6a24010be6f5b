// The narrow part of a medial axis against shapes whose axis is known, and against distances to the border.
#include "kernels/polygons/medial_axis.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "kernels/polygons/border_distance.h"
#include "kernels/polygons/plane_edges.h"
#include "tests/support/seed.h"

namespace slabwright {
namespace {

constexpr double kPi = std::numbers::pi;

struct Place {
    double turn = 0, x = 0, y = 0;
    [[nodiscard]] Point2 of(double u, double v) const {
        return {to_units(x + u * std::cos(turn) - v * std::sin(turn)),
                to_units(y + u * std::sin(turn) + v * std::cos(turn))};
    }
};

/// A square of 200 mm about the origin.
Loops plate() {
    Loops loops;
    for (const auto& [x, y] : {std::pair{-100, -100}, {100, -100}, {100, 100}, {-100, 100}})
        loops.points.push_back({to_units(x), to_units(y)});
    loops.close_loop();
    return loops;
}

void cut_out(Loops& solid, const std::vector<Point2>& counter_clockwise) {
    solid.points.insert(solid.points.end(), counter_clockwise.rbegin(), counter_clockwise.rend());
    solid.close_loop();
}

double axis_length(const MedialAxis& axis) {
    double sum = 0;
    for (const MedialLink& l : axis.links)
        sum += std::hypot(axis.points[l.from].x - axis.points[l.to].x,
                          axis.points[l.from].y - axis.points[l.to].y);
    return sum;
}

TEST(MedialAxis, ASlotHasItsWidthAllAlong) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> any(0, 1);
    for (int round = 0; round < 200; ++round) {
        const double width = 3 + 9 * any(random), long_ = width + 1 + 60 * any(random);
        const Place at{2 * kPi * any(random), 40 * any(random) - 20, 40 * any(random) - 20};
        const double u = long_ / 2, v = width / 2;
        Loops solid = plate();
        cut_out(solid, {at.of(-u, -v), at.of(u, -v), at.of(u, v), at.of(-u, v)});
        const MedialAxis axis = narrow_axis(solid);
        ASSERT_FALSE(axis.links.empty()) << width << " x " << long_;
        for (const MedialPoint& p : axis.points) EXPECT_NEAR(2 * p.clearance, width, 5e-4);
        EXPECT_NEAR(axis_length(axis), long_ - width, 1e-3);
    }
}

TEST(MedialAxis, ARoundHoleHasAMiddleAndAWideOneNone) {
    for (const int sides : {8, 9, 31, 64, 200})
        for (const double radius : {0.5, 3.0, 6.3, 7.0}) {
            Loops solid = plate();
            std::vector<Point2> circle;
            for (int i = 0; i < sides; ++i) {
                const double a = 2 * kPi * i / sides + 0.3;
                circle.push_back({to_units(5 + radius * std::cos(a)), to_units(7 + radius * std::sin(a))});
            }
            cut_out(solid, circle);
            const MedialAxis axis = narrow_axis(solid);
            SCOPED_TRACE(sides);
            if (radius * std::cos(kPi / sides) > 6.35) {
                EXPECT_TRUE(axis.points.empty());
                continue;
            }
            ASSERT_FALSE(axis.points.empty());
            const auto widest = std::max_element(
                axis.points.begin(), axis.points.end(),
                [](const MedialPoint& a, const MedialPoint& b) { return a.clearance < b.clearance; });
            EXPECT_NEAR(widest->clearance, radius * std::cos(kPi / sides), 3e-4);
            EXPECT_NEAR(widest->x, 5, 2e-3);
            EXPECT_NEAR(widest->y, 7, 2e-3);
            EXPECT_LT(axis_length(axis), 0.1 * radius);
        }
}

TEST(MedialAxis, CornersOfAWidePocketAreNoneAndAPinchIs) {
    Loops solid = plate();
    cut_out(solid, {{to_units(-40), to_units(-30)},
                    {to_units(40), to_units(-30)},
                    {to_units(40), to_units(30)},
                    {to_units(-40), to_units(30)}});
    EXPECT_TRUE(narrow_axis(solid).points.empty());
    // Two posts in it, whose corners come within 4 mm of each other.
    for (const double side : {-1.0, 1.0}) {
        for (const auto& [x, y] : {std::pair{2.0, 0.0}, {12.0, -8.0}, {22.0, 0.0}, {12.0, 8.0}})
            solid.points.push_back({to_units(side * x), to_units(side * y)});
        solid.close_loop();
    }
    const MedialAxis axis = narrow_axis(solid);
    double least = 100;
    for (const MedialPoint& p : axis.points) least = std::min(least, p.clearance);
    EXPECT_NEAR(least, 2, 1e-4);
}

TEST(MedialAxis, NothingLiesWithinTheSolid) {
    const Loops bar = [] {
        Loops loops;
        for (const auto& [x, y] : {std::pair{0, 0}, {50, 0}, {50, 4}, {0, 4}})
            loops.points.push_back({to_units(x), to_units(y)});
        loops.close_loop();
        return loops;
    }();
    EXPECT_TRUE(narrow_axis(bar).points.empty());
    EXPECT_TRUE(narrow_axis({}).points.empty());
}

// Random heaps of rectangles, many of which touch: every point lies in the air, as far from the border as it
// says. Where they are not united the diagram ends all the same.
TEST(MedialAxis, ClearancesAreDistancesToTheBorder) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> any(0, 1);
    for (int round = 0; round < 60; ++round) {
        Loops solid;
        for (int i = 0; i < 40; ++i) {
            const Place at{round % 3 == 0 ? 0 : 2 * kPi * any(random), std::round(60 * any(random)),
                           std::round(60 * any(random))};
            const double u = std::round(1 + 5 * any(random)), v = std::round(1 + 5 * any(random));
            for (const auto& [a, b] : {std::pair{-u, -v}, {u, -v}, {u, v}, {-u, v}})
                solid.points.push_back(at.of(a, b));
            solid.close_loop();
        }
        EXPECT_FALSE(narrow_axis(solid).points.empty());
        solid = simplify(solid);
        const BorderDistance distance(solid);
        const MedialAxis axis = narrow_axis(solid);
        EXPECT_FALSE(axis.points.empty());
        for (const MedialPoint& p : axis.points) {
            const Point2 place{to_units(p.x), to_units(p.y)};
            EXPECT_NEAR(distance(place), p.clearance, 4e-4);
            if (p.clearance > 0.01) {
                EXPECT_EQ(winding(solid, place), 0);
            }
        }
        for (const MedialLink& l : axis.links)
            EXPECT_LE(std::hypot(axis.points[l.from].x - axis.points[l.to].x,
                                 axis.points[l.from].y - axis.points[l.to].y),
                      1.001);
    }
}

// The length of the axis whose ends both are narrower than a limit.
double narrow_length(const MedialAxis& axis, double most_clearance) {
    double sum = 0;
    for (const MedialLink& l : axis.links) {
        const MedialPoint &a = axis.points[l.from], &b = axis.points[l.to];
        if (std::max(a.clearance, b.clearance) <= most_clearance) sum += std::hypot(a.x - b.x, a.y - b.y);
    }
    return sum;
}

// What faces nothing near by is left out of the diagram. Where the limit is wide nothing is, and the narrow
// part of that axis is the same.
TEST(MedialAxis, WhatIsLeftOutChangesNothing) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> any(0, 1);
    for (int round = 0; round < 60; ++round) {
        Loops solid;
        for (int i = 0; i < 30; ++i) {
            const Place at{2 * kPi * any(random), 150 * any(random), 150 * any(random)};
            const int sides = 3 + static_cast<int>(60 * any(random) * any(random));
            const double r = 1 + 12 * any(random), slim = 0.2 + 0.8 * any(random);
            for (int k = 0; k < sides; ++k)
                solid.points.push_back(
                    at.of(r * std::cos(2 * kPi * k / sides), slim * r * std::sin(2 * kPi * k / sides)));
            solid.close_loop();
        }
        solid = simplify(solid);
        if (round % 2 == 1) {  // holes instead of posts
            std::reverse(solid.points.begin(), solid.points.end());
            Loops plate_with_holes;
            for (const auto& [x, y] : {std::pair{-50, -50}, {200, -50}, {200, 200}, {-50, 200}})
                plate_with_holes.points.push_back({to_units(x), to_units(y)});
            plate_with_holes.close_loop();
            for (std::size_t l = solid.size(); l-- > 0;) {
                const auto end = static_cast<std::uint32_t>(solid.points.size());
                for (std::uint32_t i = end - solid.starts[l + 1]; i < end - solid.starts[l]; ++i)
                    plate_with_holes.points.push_back(solid.points[i]);
                plate_with_holes.close_loop();
            }
            solid = std::move(plate_with_holes);
        }
        constexpr double most = 2;  // mm
        const MedialAxis narrow = narrow_axis(solid, {.most_clearance_mm = most, .step_mm = 0.05}),
                         wide = narrow_axis(solid, {.most_clearance_mm = 300, .step_mm = 0.05});
        EXPECT_NEAR(narrow_length(narrow, most), narrow_length(wide, most),
                    0.01 * narrow_length(wide, most) + 0.3)
            << "round " << round;
        EXPECT_GT(narrow_length(wide, 300), narrow_length(narrow, most));
        const BorderDistance distance(solid);
        for (const MedialPoint& p : narrow.points)
            EXPECT_NEAR(distance({to_units(p.x), to_units(p.y)}), p.clearance, 4e-4);
    }
}

TEST(PlaneEdges, MeetInTheirEndsOnly) {
    Loops loops;
    const auto add = [&](std::initializer_list<Point2> points) {
        loops.points.insert(loops.points.end(), points);
        loops.close_loop();
    };
    add({{0, 0}, {100, 0}, {100, 100}, {0, 100}});
    add({{50, 50}, {150, 50}, {150, 150}, {50, 150}});  // crosses the first
    add({{-50, 0}, {0, 0}, {0, 50}, {-50, 50}});        // runs back along half of its side
    const std::vector<PlaneEdge> edges = edges_meeting_in_ends(loops);
    const auto has = [&](Point2 a, Point2 b) {
        return std::count(edges.begin(), edges.end(), PlaneEdge{a, b});
    };
    EXPECT_EQ(has({100, 0}, {100, 50}), 1);
    EXPECT_EQ(has({100, 50}, {100, 100}), 1);
    EXPECT_EQ(has({50, 50}, {100, 50}), 1);
    EXPECT_EQ(has({0, 100}, {0, 50}), 1);
    EXPECT_EQ(has({0, 0}, {0, 50}), 0) << "solid on both sides";
    EXPECT_EQ(has({0, 50}, {0, 0}), 0);
    EXPECT_EQ(edges.size(), 4U + 4U + 4U + 4U + 1U - 2U);
}

}  // namespace
}  // namespace slabwright
