// StandingPart and ClosestPoint against closed forms and against brute force over every facet.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <functional>
#include <map>
#include <random>
#include <span>

#include "kernels/access/closest_point.h"
#include "kernels/access/standing_part.h"
#include "kernels/mesh/weld.h"
#include "tests/support/seed.h"

using namespace slabwright;

namespace {

CutterShape cutter(bool ball, double radius) { return {radius, ball ? radius : 0, 0}; }

void facet(Mesh& m, Point3 a, Point3 b, Point3 c) {
    for (const Point3& p : {a, b, c}) {
        m.vertices.push_back({static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])});
    }
    const auto n = static_cast<std::uint32_t>(m.vertices.size());
    m.facets.push_back({n - 3, n - 2, n - 1});
}
void quad(Mesh& m, Point3 a, Point3 b, Point3 c, Point3 d) {
    facet(m, a, b, c);
    facet(m, a, c, d);
}
void box(Mesh& m, Point3 l, Point3 h) {
    quad(m, {l[0], l[1], l[2]}, {l[0], h[1], l[2]}, {h[0], h[1], l[2]}, {h[0], l[1], l[2]});
    quad(m, {l[0], l[1], h[2]}, {h[0], l[1], h[2]}, {h[0], h[1], h[2]}, {l[0], h[1], h[2]});
    quad(m, {l[0], l[1], l[2]}, {h[0], l[1], l[2]}, {h[0], l[1], h[2]}, {l[0], l[1], h[2]});
    quad(m, {h[0], h[1], l[2]}, {l[0], h[1], l[2]}, {l[0], h[1], h[2]}, {h[0], h[1], h[2]});
    quad(m, {l[0], h[1], l[2]}, {l[0], l[1], l[2]}, {l[0], l[1], h[2]}, {l[0], h[1], h[2]});
    quad(m, {h[0], l[1], l[2]}, {h[0], h[1], l[2]}, {h[0], h[1], h[2]}, {h[0], l[1], h[2]});
}

/// A closed block whose top is height(x, y) over [0, n]², on a grid of 1 mm, with its bottom at 0.
Mesh relief(int n, const std::function<double(double, double)>& height) {
    Mesh m;
    auto p = [&](int i, int j) {
        return Point3{static_cast<double>(i), static_cast<double>(j), height(i, j)};
    };
    auto o = [&](int i, int j) { return Point3{static_cast<double>(i), static_cast<double>(j), 0}; };
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
            quad(m, p(i, j), p(i + 1, j), p(i + 1, j + 1), p(i, j + 1));
            quad(m, o(i, j), o(i, j + 1), o(i + 1, j + 1), o(i + 1, j));
        }
    for (int i = 0; i < n; ++i) {
        quad(m, o(i, 0), o(i + 1, 0), p(i + 1, 0), p(i, 0));
        quad(m, o(i + 1, n), o(i, n), p(i, n), p(i + 1, n));
        quad(m, o(0, i + 1), o(0, i), p(0, i), p(0, i + 1));
        quad(m, o(n, i), o(n, i + 1), p(n, i + 1), p(n, i));
    }
    return m;
}

/// Points of the part's surface below z_top, as dense as `step`, its cap included (from covered()).
std::vector<Point3> surface_points(const Mesh& m, double z_top, double step) {
    std::vector<Point3> points;
    for (const Index3& f : m.facets) {
        auto v = [&](int k) { return Point3{m.vertices[f[k]].x, m.vertices[f[k]].y, m.vertices[f[k]].z}; };
        const Point3 a = v(0), b = v(1), c = v(2);
        auto length = [](Point3 p, Point3 q) { return std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]); };
        const int n =
            static_cast<int>(std::ceil(std::max({length(a, b), length(b, c), length(c, a)}) / step));
        for (int i = 0; i <= n; ++i)
            for (int j = 0; i + j <= n; ++j) {
                const double s = static_cast<double>(i) / n, t = static_cast<double>(j) / n;
                const Point3 q{a[0] + s * (b[0] - a[0]) + t * (c[0] - a[0]),
                               a[1] + s * (b[1] - a[1]) + t * (c[1] - a[1]),
                               a[2] + s * (b[2] - a[2]) + t * (c[2] - a[2])};
                if (q[2] <= z_top) points.push_back(q);
            }
    }
    return points;
}

double bumpy(double x, double y) {
    return 6 + 2.5 * std::sin(x * 0.9) * std::cos(y * 0.7) + std::sin(2.1 * x + y);
}

}  // namespace

TEST(StandingPart, BallOnBoxInClosedForm) {
    Context context;
    Mesh m;
    box(m, {0, 0, 0}, {20, 20, 10});
    const StandingPart part(context, m.view());
    const double R = 3, e = 2e-6;
    // Beside the wall x = 20, well below the top: only the shank and the ball's equator count.
    EXPECT_EQ(part.ball(10, {23.0, 5, 2}, {23.0, 15, 2}, R, 1e-5).depth, 0);
    EXPECT_NEAR(part.ball(10, {22.95, 5, 2}, {22.95, 15, 2}, R, 0).depth, 0.05, e);
    EXPECT_NEAR(part.ball(10, {22.95, 5, -8}, {22.95, 15, -8}, R, 0).depth, 0.05, e);
    // Above the top edge, along it and across it.
    const double h = 10 - StandingPart::kSheet;
    EXPECT_NEAR(part.ball(10, {22, 5, 7.5}, {22, 15, 7.5}, R, 0).depth, R - std::hypot(2, 7.5 + R - h), e);
    // On the top: the cap counts, from any side, and a motion that dips in the middle is caught between its
    // ends.
    EXPECT_NEAR(part.ball(10, {5, 5, 9.9}, {15, 5, 9.9}, R, 0).depth, 0.1 - StandingPart::kSheet, e);
    EXPECT_EQ(part.ball(10, {5, 5, 10}, {15, 5, 10}, R, 1e-5).depth, 0);
    // Across the corner: deepest where the way is nearest to it.
    const Penetration p = part.ball(10, {20, 22.9, 1}, {22.9, 20, 1}, R, 0);
    EXPECT_NEAR(p.depth, R - 2.9 / std::sqrt(2.0), e);
    EXPECT_NEAR(p.tip[0], 21.45, 1e-3);
    EXPECT_NEAR(p.tip[1], 21.45, 1e-3);
    // A lower layer's view of the same box: nothing above 4 stands.
    EXPECT_EQ(part.ball(4, {-5, 10, 4}, {25, 10, 4}, R, 1e-5).depth, 0);
    EXPECT_NEAR(part.ball(4, {-5, 10, 3.5}, {25, 10, 3.5}, R, 0).depth, 0.5 - StandingPart::kSheet, 2e-3);
    // From above through the top: the axis itself inside the part.
    EXPECT_NEAR(part.ball(10, {10, 10, 12}, {10, 10, 2}, R, 0).depth, R, e);
}

TEST(StandingPart, CylinderOnBoxInClosedForm) {
    Context context;
    Mesh m;
    box(m, {0, 0, 0}, {20, 20, 10});
    const StandingPart part(context, m.view());
    const double R = 5, e = 2e-6, s = StandingPart::kSheet;
    EXPECT_EQ(part.cylinder(10, {25, 0, 3}, {25, 20, 3}, R, 1e-5).depth, 0);
    EXPECT_NEAR(part.cylinder(10, {24.98, 0, 3}, {24.98, 20, 3}, R, 0).depth, 0.02, e);
    EXPECT_NEAR(part.cylinder(10, {22, 0, 9.7}, {22, 20, 9.7}, R, 0).depth, 0.3 - s,
                e);  // the floor is nearer than the wall
    EXPECT_NEAR(part.cylinder(10, {10, 10, 9.7}, {11, 10, 9.7}, R, 0).depth, 0.3 - s, e);  // all over the cap
    EXPECT_NEAR(part.cylinder(10, {24, 10, 12}, {24, 10, 2}, R, 0).depth, 1,
                e);  // plunge beside: the wall is nearer
    EXPECT_NEAR(part.cylinder(10, {24, 10, 12}, {24, 10, 9.5}, R, 0).depth, 0.5 - s, e);
    // Down a ramp past the top edge: depth grows until the wall limits it; the end is the deepest.
    EXPECT_NEAR(part.cylinder(10, {24.9, 0, 12}, {24.9, 20, 9.95}, R, 0).depth, 0.05 - s, e);
    EXPECT_EQ(part.cylinder(10, {-20, -20, 10}, {40, 40, 10}, 25, 1e-5).depth,
              0);  // a face mill over the top
}

TEST(StandingPart, OverhangCountsLikeItsShadowAndOnlyUpToTheTop) {
    Context context;
    Mesh m;
    box(m, {0, 0, 0}, {10, 10, 5});
    box(m, {0, 0, 5}, {30, 10, 10});  // overhangs the first, from z = 5
    const StandingPart part(context, m.view());
    // In the lower layer the space beside the first box is free, although the overhang begins exactly at its
    // top.
    EXPECT_EQ(part.ball(5, {20, -5, 1}, {20, 15, 1}, 3, 1e-5).depth, 0);
    EXPECT_EQ(part.cylinder(5, {20, -5, 1}, {20, 15, 1}, 3, 1e-5).depth, 0);
    EXPECT_FALSE(part.covered(20, 5, 4.999));
    EXPECT_TRUE(part.covered(5, 5, 4.999));
    // In the upper layer the cutter's shank would meet it.
    EXPECT_NEAR(part.ball(10, {20, -5, 1}, {20, 15, 1}, 3, 0).depth, 3, 1e-6);
    EXPECT_NEAR(part.envelope(20, 5, 10, -1), 10, 0);
    EXPECT_NEAR(part.envelope(20, 5, 5, -1), -1, 0);
    EXPECT_NEAR(part.envelope(20, 5, 7, -1), 7, 0);
}

TEST(StandingPart, AgreesWithBruteForceOnARelief) {
    Context context;
    const Mesh m = relief(12, bumpy);
    const StandingPart part(context, m.view());
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> u(-2, 14), uz(1, 9), d(-0.7, 0.7), ur(0.3, 3);
    const double step = 0.025;
    for (const double z_top : {100.0, 6.5}) {
        const auto points = surface_points(m, z_top - StandingPart::kSheet, step);
        for (int trial = 0; trial < 40; ++trial) {
            const Point3 a{u(random), u(random), uz(random)};
            const Point3 b{a[0] + d(random), a[1] + d(random), trial % 3 == 0 ? a[2] : a[2] + d(random)};
            const double R = ur(random);
            double ball = 0, cylinder = 0;
            const int samples = 24;
            std::vector<Point3> near;
            for (const Point3& q : points)
                if (std::hypot(q[0] - a[0], q[1] - a[1]) < R + 1) near.push_back(q);
            for (int i = 0; i <= samples; ++i) {
                const double t = static_cast<double>(i) / samples;
                const Point3 p{a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])};
                double near2 = R * R;
                for (const Point3& q : near) {
                    const double x = q[0] - p[0], y = q[1] - p[1], r2 = x * x + y * y;
                    if (r2 >= R * R) continue;
                    const double z = std::max(0.0, p[2] + R - q[2]);
                    near2 = std::min(near2, r2 + z * z);
                    if (q[2] > p[2]) cylinder = std::max(cylinder, std::min(R - std::sqrt(r2), q[2] - p[2]));
                }
                ball = std::max(ball, R - std::sqrt(near2));
                if (part.covered(p[0], p[1], z_top - StandingPart::kSheet)) {
                    ball = std::max(ball, R - std::max(0.0, p[2] + R - z_top));
                    cylinder = std::max(cylinder, std::min(R, z_top - p[2]));
                }
            }
            // Brute force samples, so it can only miss: by half a step of the way and of the surface.
            const double miss = step * 0.6 + std::hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]) / samples / 2 +
                                2 * StandingPart::kSheet;
            const double gb = part.ball(z_top, a, b, R, 0).depth, gc = part.cylinder(z_top, a, b, R, 0).depth;
            EXPECT_GE(gb, ball - 2 * StandingPart::kSheet) << "trial " << trial << " R " << R;
            EXPECT_LE(gb, ball + miss) << "trial " << trial << " R " << R;
            EXPECT_GE(gc, cylinder - 2 * StandingPart::kSheet) << "trial " << trial << " R " << R;
            EXPECT_LE(gc, cylinder + miss) << "trial " << trial << " R " << R;
            // A floor that is asked for changes nothing above it.
            if (gb > 0.1) {
                EXPECT_NEAR(part.ball(z_top, a, b, R, 0.1).depth, gb, 1e-6);
            }
            if (gc > 0.1) {
                EXPECT_NEAR(part.cylinder(z_top, a, b, R, 0.1).depth, gc, 1e-6);
            }
        }
    }
}

TEST(StandingPart, RowsOfMotionsAgreeWithOneAfterTheOther) {
    Context context;
    const Mesh m = relief(24, bumpy);
    const StandingPart part(context, m.view());
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> u(-2, 26), uz(2, 9), d(-1.2, 1.2), ur(0.3, 4), unit(0, 1);
    std::size_t deep = 0, free = 0;
    for (const double z_top : {100.0, 6.5})
        for (int trial = 0; trial < 60; ++trial) {
            // A chain with short steps, level and steep ones, standing ones, and now and then a jump.
            std::vector<StandingPart::Motion> motions;
            Point3 at{u(random), u(random), uz(random)};
            for (int i = 0; i < 40; ++i) {
                Point3 to = at;
                const double kind = unit(random);
                if (kind < 0.05) to = {u(random), u(random), uz(random)};
                else if (kind < 0.1) to[2] += 4 * d(random);
                else if (kind < 0.95)
                    to = {at[0] + d(random), at[1] + d(random), kind < 0.5 ? at[2] : at[2] + 0.3 * d(random)};
                motions.push_back({at, to});
                at = kind < 0.9 ? to : Point3{u(random), u(random), uz(random)};
            }
            const double R = ur(random), tolerance = 0.2 + 3 * unit(random),
                         ignore = trial % 2 == 0 ? 1e-5 : 0.0;
            for (const bool ball : {true, false}) {
                double most = 0;
                std::vector<double> depths;
                for (const auto& [from, to] : motions) {
                    const Penetration p = ball ? part.ball(z_top, from, to, R, ignore)
                                               : part.cylinder(z_top, from, to, R, ignore);
                    depths.push_back(p.depth);
                    most = std::max(most, p.depth);
                }
                const StandingPart::Found found =
                    part.deepest(cutter(ball, R), z_top, motions, ignore, tolerance);
                EXPECT_NEAR(found.most.depth, most, 1e-6) << "seed " << seed << " trial " << trial;
                EXPECT_EQ(found.most.found, most > 0);
                if (most > 0) {
                    EXPECT_NEAR(depths[found.motion], most, 1e-6);
                }
                for (std::size_t i = 0; i < motions.size(); ++i) {
                    if (std::abs(depths[i] - tolerance) < 1e-6) continue;
                    const bool listed = std::binary_search(found.beyond.begin(), found.beyond.end(),
                                                           static_cast<std::uint32_t>(i));
                    EXPECT_EQ(listed, depths[i] > tolerance) << "motion " << i << " depth " << depths[i];
                    ++(listed ? deep : free);
                }
            }
        }
    EXPECT_GT(deep, 1000u);
    EXPECT_GT(free, 1000u);
}

// The first motions of a chain of short ones run under the part's top sheet, far deeper than the tolerance:
// the others are found all the same.
TEST(StandingPart, ShortMotionsAfterOneInsideThePartAreFound) {
    Context context;
    const Mesh m = relief(24, bumpy);
    const StandingPart part(context, m.view());
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> u(2, 22), uz(2, 6), turn(-0.1, 0.1), ur(0.5, 4), unit(0, 1);
    constexpr double z_top = 6.5, tolerance = 0.02;
    std::size_t deep = 0;
    for (int trial = 0; trial < 300; ++trial) {
        std::vector<StandingPart::Motion> motions;
        Point3 at{u(random), u(random), uz(random)};
        double heading = 6.3 * unit(random);
        for (int i = 0; i < 40; ++i) {
            heading += turn(random);
            const Point3 to{at[0] + 0.12 * std::cos(heading), at[1] + 0.12 * std::sin(heading), at[2]};
            motions.push_back({at, to});
            at = to;
        }
        const double R = ur(random);
        for (const bool ball : {true, false}) {
            const StandingPart::Found found = part.deepest(cutter(ball, R), z_top, motions, 0, tolerance);
            for (std::size_t i = 0; i < motions.size(); ++i) {
                const auto& [from, to] = motions[i];
                const double depth = ball ? part.ball(z_top, from, to, R, 0).depth
                                          : part.cylinder(z_top, from, to, R, 0).depth;
                if (std::abs(depth - tolerance) < 1e-6) continue;
                ASSERT_EQ(std::binary_search(found.beyond.begin(), found.beyond.end(),
                                             static_cast<std::uint32_t>(i)),
                          depth > tolerance)
                    << "trial " << trial << " motion " << i << " depth " << depth;
                deep += depth > tolerance;
            }
        }
    }
    EXPECT_GT(deep, 1000U);
}

/// Bumps, and draws of ways over them.
class BumpyPart : public testing::Test {
protected:
    double unit() { return std::uniform_real_distribution<double>(0, 1)(random); }
    double between(double low, double high) { return low + (high - low) * unit(); }

    Context context;
    const Mesh mesh = relief(24, bumpy);
    const StandingPart part{context, mesh.view()};
    const unsigned seed = test::seed();
    std::mt19937 random{seed};
};

// Rows as programs have them: arcs of short chords, rings and zigzags of long motions, far from the part,
// beside it and just within it.
TEST_F(BumpyPart, LongRowsAgreeWithSingleQuestionsDownToTheDeepestHair) {
    std::size_t just = 0, free = 0, deep = 0;
    for (int trial = 0; trial < 100; ++trial) {
        const double z_top = trial % 4 == 0 ? 6.5 : 100.0, radius = between(0.4, 4);
        const bool is_ball = trial % 2 == 0;
        std::vector<StandingPart::Motion> motions;
        Point3 at{between(-12, 36), between(-12, 36), between(4, 9)};
        auto go = [&](const Point3& to) {
            motions.push_back({at, to});
            at = to;
        };
        const double climb = trial % 3 == 0 ? between(-0.01, 0.01) : 0,
                     stair = trial % 3 == 1 ? between(0, 0.6) : 0;
        while (motions.size() < 300) {
            const double kind = unit();
            if (kind < 0.6) {  // an arc
                const double bend = std::pow(10, between(0, 1.7)) * (unit() < 0.5 ? -1 : 1),
                             chord = between(0.05, 0.4);
                double heading = between(0, 6.3);
                for (int n = static_cast<int>(between(5, 120)); n > 0; --n, heading += chord / bend)
                    go({at[0] + chord * std::cos(heading), at[1] + chord * std::sin(heading),
                        at[2] + climb + (n % 2 == 0 ? stair : -stair)});
            } else if (kind < 0.8) {  // rows and rings
                for (int n = static_cast<int>(between(3, 20)); n > 0; --n) {
                    go({at[0] + (at[0] > 12 ? -1 : 1) * between(1, 20), at[1], at[2]});
                    go({at[0], at[1] + between(-2, 2), at[2]});
                }
            } else if (kind < 0.9) {  // up, over the part and down
                go({at[0], at[1], at[2] + between(0, 12)});
                go({between(-12, 36), between(-12, 36), at[2]});
                go({at[0], at[1], between(4, 9)});
            } else {
                at = {between(-12, 36), between(-12, 36), between(4, 9)};
            }
        }
        auto deepest_of = [&](double r, double lift) {
            double most = 0;
            std::vector<double> depths;
            for (StandingPart::Motion way : motions) {
                way.from[2] += lift, way.to[2] += lift;
                depths.push_back((is_ball ? part.ball(z_top, way.from, way.to, r, 0)
                                          : part.cylinder(z_top, way.from, way.to, r, 0))
                                     .depth);
                most = std::max(most, depths.back());
            }
            return std::pair(most, depths);
        };
        const auto [full, all] = deepest_of(radius, 0);
        // A cutter as much smaller, its centre or floor as much less deep, is in the part so much less: what
        // is deepest then is less than a hair.
        for (const double left : {-1.0, 4e-6, 2e-4, -1e-5}) {
            const double less = left == -1.0 ? 0 : full - left;
            if (less < 0 || less >= radius) continue;
            std::vector<StandingPart::Motion> raised = motions;
            for (auto& [from, to] : raised) from[2] += less, to[2] += less;
            const auto [most, depths] = deepest_of(radius - less, less);
            const double tolerance = left == -1.0 ? 0.3 : std::max(left / 2, 0.0);
            const StandingPart::Found found =
                part.deepest(cutter(is_ball, radius - less), z_top, raised, 0, tolerance);
            EXPECT_NEAR(found.most.depth, most, 3e-7)
                << "seed " << seed << " trial " << trial << " left " << left;
            if (most > 1e-6) {
                ASSERT_TRUE(found.most.found) << "seed " << seed << " trial " << trial << " left " << left;
                EXPECT_NEAR(depths[found.motion], most, 3e-7);
                just += left > 0;
            } else free += left < 0;
            for (std::size_t i = 0; i < motions.size(); ++i) {
                if (std::abs(depths[i] - tolerance) < 1e-6) continue;
                const bool listed = std::binary_search(found.beyond.begin(), found.beyond.end(),
                                                       static_cast<std::uint32_t>(i));
                ASSERT_EQ(listed, depths[i] > tolerance)
                    << "seed " << seed << " trial " << trial << " motion " << i << " depth " << depths[i];
                deep += listed;
            }
        }
    }
    EXPECT_GT(just, 40U);
    EXPECT_GT(free, 20U);
    EXPECT_GT(deep, 2000U);
}

// Rows that are checked together, in whichever order, find what one row of all finds: of equal depths the
// first.
TEST(StandingPart, RowsThatKnowOfOneAnotherFindTheGreatestDepth) {
    Context context;
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    const Mesh m = relief(40, bumpy);
    const StandingPart part(context, m.view());
    int met = 0;
    for (int trial = 0; trial < 40; ++trial) {
        const double radius = 0.5 + 2 * unit(random);
        std::vector<StandingPart::Motion> motions;
        Point3 at{40 * unit(random), 40 * unit(random), 7};
        for (int i = 0; i < 400; ++i) {
            const Point3 to{at[0] + 2 * unit(random) - 1, at[1] + 2 * unit(random) - 1,
                            5.5 + 2.5 * unit(random)};
            motions.push_back({at, to});
            at = to;
        }
        for (std::size_t i = 0; i < 200; ++i) motions[i + 200] = motions[i];  // every depth twice
        const double tolerance = trial % 3 == 0 ? 0.05 : 10;
        const StandingPart::Found all = part.deepest(cutter(true, radius), 100, motions, 1e-5, tolerance);
        if (!all.most.found) {  // a way off the relief
            for (const auto& [from, to] : motions)
                ASSERT_LT(part.ball(100, from, to, radius, 0).depth, 2e-5)
                    << "seed " << seed << " trial " << trial;
            continue;
        }
        ++met;
        std::vector<std::size_t> order{0, 1, 2, 3, 4, 5, 6, 7};
        std::shuffle(order.begin(), order.end(), random);
        std::array<StandingPart::Found, 8> found;
        std::atomic<double> known = 0;
        for (const std::size_t row : order)
            found[row] = part.deepest(cutter(true, radius), 100, std::span(motions).subspan(50 * row, 50),
                                      1e-5, tolerance, &known);
        Penetration most;
        std::size_t motion = 0, beyond = 0, beyond_alone = 0;
        for (std::size_t row = 0; row < found.size(); ++row) {
            if (found[row].most.depth > most.depth)
                most = found[row].most, motion = 50 * row + found[row].motion;
            if (tolerance < 1) {
                beyond += found[row].beyond.size();
                beyond_alone += part.deepest(cutter(true, radius), 100,
                                             std::span(motions).subspan(50 * row, 50), 1e-5, tolerance)
                                    .beyond.size();
            }
        }
        EXPECT_EQ(most.depth, all.most.depth) << "seed " << seed << " trial " << trial;
        EXPECT_EQ(most.tip, all.most.tip) << "seed " << seed << " trial " << trial;
        EXPECT_EQ(motion, all.motion) << "seed " << seed << " trial " << trial;
        EXPECT_EQ(known, most.depth);
        EXPECT_EQ(beyond, beyond_alone);
        EXPECT_EQ(beyond, all.beyond.size());
    }
    EXPECT_GT(met, 30);
}

// Chords of circles, of which it is told that they are: what is found is the same, down to the last digit but
// for the top sheet, under which many motions are as deep as one another.
TEST_F(BumpyPart, ChordsOfCirclesAgreeWithSingleQuestions) {
    std::size_t just = 0, deep = 0, shallow = 0;
    for (int trial = 0; trial < 300; ++trial) {
        const double z_top = trial % 4 == 0 ? 6.5 : 100.0, R = between(0.4, 4);
        std::vector<StandingPart::Motion> motions;
        std::vector<StandingPart::Chords> chords;
        Point3 at{between(-3, 27), between(-3, 27), between(3, 9)};
        for (int arc = 0; arc < 6; ++arc) {
            // Sometimes a line first; then an arc whose chords miss it by up to some micrometres.
            if (unit() < 0.5) {
                const Point3 to{at[0] + between(-2, 2), at[1] + between(-2, 2),
                                unit() < 0.5 ? at[2] : between(3, 9)};
                motions.push_back({at, to});
                at = to;
            }
            const double radius = std::pow(10, between(-1, 2)), start = between(-4, 4),
                         step = 2 * std::sqrt(2 * 0.0005 / radius);
            const double x = at[0] - radius * std::cos(start), y = at[1] - radius * std::sin(start),
                         way = unit() < 0.5 ? -step : step;
            const std::size_t first = motions.size(),
                              count = static_cast<std::size_t>(between(1, std::min(60.0, 6.2 / step)));
            for (std::size_t i = 1; i <= count; ++i) {
                const double angle = start + way * static_cast<double>(i),
                             off = trial % 3 == 0 ? between(-0.001, 0.001) : 0;
                const Point3 to{x + (radius + off) * std::cos(angle), y + (radius + off) * std::sin(angle),
                                at[2]};
                motions.push_back({at, to});
                at = to;
            }
            chords.push_back({first, motions.size(), x, y, radius});
        }
        // Raised until it is just within or just beside the part, mostly.
        if (trial % 5 != 0)
            for (int round = 0; round < 4; ++round) {
                double most = 0;
                for (const auto& [from, to] : motions)
                    most = std::max(most, part.ball(z_top, from, to, R, 0).depth);
                for (auto& [from, to] : motions) from[2] += most - 0.003, to[2] += most - 0.003;
            }
        const double tolerance = trial % 2 == 0 ? 0.01 : 10;
        const StandingPart::Found alone = part.deepest(cutter(true, R), z_top, motions, 1e-5, tolerance);
        const StandingPart::Found found =
            part.deepest(cutter(true, R), z_top, motions, 1e-5, tolerance, nullptr, chords);
        if (z_top == 100.0) {
            EXPECT_EQ(found.most.depth, alone.most.depth) << "seed " << seed << " trial " << trial;
            EXPECT_EQ(found.motion, alone.motion) << "seed " << seed << " trial " << trial;
            EXPECT_EQ(found.most.tip, alone.most.tip) << "seed " << seed << " trial " << trial;
        }
        EXPECT_EQ(found.beyond, alone.beyond) << "seed " << seed << " trial " << trial;
        double most = 0;
        for (std::size_t i = 0; i < motions.size(); ++i) {
            const double depth = part.ball(z_top, motions[i].from, motions[i].to, R, 1e-5).depth;
            most = std::max(most, depth);
            if (std::abs(depth - tolerance) < 1e-6) continue;
            EXPECT_EQ(
                std::binary_search(found.beyond.begin(), found.beyond.end(), static_cast<std::uint32_t>(i)),
                depth > tolerance)
                << "seed " << seed << " trial " << trial << " motion " << i << " depth " << depth;
            ++(depth > tolerance ? deep : shallow);
        }
        EXPECT_NEAR(found.most.depth, most, 1e-6) << "seed " << seed << " trial " << trial;
        just += most > 0 && most < 0.01;
    }
    EXPECT_GT(just, 20U);
    EXPECT_GT(deep, 500U);
    EXPECT_GT(shallow, 5000U);
}

// A motion that comes down from high above the part's outline meets nothing but the top sheet.
TEST(StandingPart, RowsThatComeDownWithinTheOutlineMeetTheTop) {
    Context context;
    const Mesh m = relief(60, [](double, double) { return 10.0; });
    const StandingPart part(context, m.view());
    for (const bool ball : {true, false}) {
        std::vector<StandingPart::Motion> motions{{{-3, 30, 60}, {30, 30, 9.5}}};
        for (int i = 0; i < 40; ++i) motions.push_back({motions.back().to, {30, 30 + 0.2 * i, 9.5}});
        motions.push_back({motions.back().to, {80, 30, 60}});
        for (const std::size_t count : {std::size_t{1}, std::size_t{2}, motions.size()}) {
            const StandingPart::Found found =
                part.deepest(cutter(ball, 2), 10, std::span(motions).first(count), 1e-5, 0.01);
            EXPECT_NEAR(found.most.depth, 0.5 - StandingPart::kSheet, 1e-6);
            EXPECT_EQ(found.beyond.size(), count);
        }
    }
}

TEST(StandingPart, EnvelopeByPointsAndByGrid) {
    Context context;
    const Mesh m = relief(12, bumpy);
    const StandingPart part(context, m.view());
    const int nx = 37, ny = 29;
    std::vector<float> grid(static_cast<std::size_t>(nx) * ny);
    RisingEnvelope rising(part, -1, -0.5, 0.5, nx, ny);
    for (const double z_top : {2.0, 6.5, 6.5, 7.25, 100.0}) {
        rising.at(z_top, -1, grid.data());
        int capped = 0, open = 0;
        for (int j = 0; j < ny; ++j)
            for (int i = 0; i < nx; ++i) {
                const double x = -1 + 0.5 * i, y = -0.5 + 0.5 * j;
                const float g = grid[static_cast<std::size_t>(j) * nx + i];
                EXPECT_NEAR(g, part.envelope(x, y, z_top, -1), 1e-6);
                EXPECT_EQ(g == static_cast<float>(z_top), part.covered(x, y, z_top - StandingPart::kSheet));
                const Point3 over{x, y, z_top + 0.4};
                EXPECT_EQ(part.from_shadow(over, z_top, 1, g == static_cast<float>(z_top)).distance,
                          part.from_shadow(over, z_top, 1).distance);
                if (x < 0 || y < 0 || x > 12 || y > 12) {
                    EXPECT_EQ(g, -1);
                    ++open;
                }
                if (x == std::floor(x) && y == std::floor(y) && x > 0 && y > 0 && x < 12 && y < 12) {
                    EXPECT_NEAR(g, std::min(z_top, bumpy(x, y)), 2e-3);
                    capped += g == static_cast<float>(z_top);
                }
            }
        EXPECT_GT(open, 0);
        if (z_top < 10) {
            EXPECT_GT(capped, 0);
        }
        std::vector<float> alone(grid.size());
        RisingEnvelope(part, -1, -0.5, 0.5, nx, ny).at(z_top, -1, alone.data());
        EXPECT_EQ(grid, alone);
    }
}

// Air under part between two planes, against the boxes themselves.
TEST(StandingPart, CoveredAirOfStackedBoxes) {
    Context context;
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    std::uniform_int_distribution<int> place(0, 9), size(1, 6);
    for (int round = 0; round < 20; ++round) {
        Mesh solid;
        std::vector<std::array<int, 6>> boxes;
        for (int b = 0; b < 6; ++b) {
            const std::array<int, 3> low{place(random), place(random), place(random)};
            const std::array<int, 3> high{low[0] + size(random), low[1] + size(random),
                                          low[2] + size(random)};
            boxes.push_back({low[0], low[1], low[2], high[0], high[1], high[2]});
            box(solid, {1.0 * low[0], 1.0 * low[1], 1.0 * low[2]},
                {1.0 * high[0], 1.0 * high[1], 1.0 * high[2]});
        }
        const StandingPart part(context, solid.view());
        const int n = 16;
        std::vector<float> heights(n * n), air(n * n);
        RisingEnvelope rising(part, 0.5, 0.5, 1, n, n);
        double bottom = 0;
        for (const double top : {3.5, 7.25, 9.5, 16.0}) {
            rising.at(top, -1, heights.data());
            rising.covered_air(bottom, air.data());
            for (int j = 0; j < n; ++j)
                for (int i = 0; i < n; ++i) {
                    const auto solid_at = [&](double z) {
                        return std::any_of(boxes.begin(), boxes.end(), [&](const auto& b) {
                            return b[0] <= i && i < b[3] && b[1] <= j && j < b[4] && b[2] < z && z < b[5];
                        });
                    };
                    double expected = 0;
                    bool under = false;
                    constexpr double step = 0.05;
                    for (double z = top - step / 2; z > bottom; z -= step) {
                        if (solid_at(z)) under = true;
                        else if (under) expected += step;
                    }
                    ASSERT_NEAR(air[static_cast<std::size_t>(j * n + i)], expected, 2e-3)
                        << "seed " << seed << " round " << round << " top " << top << " at " << i << ' ' << j;
                }
            bottom = top;
        }
    }
}

// Whether the facets are known to close, or share no vertices, or do not close.
TEST(StandingPart, EnvelopeByGridOfFacetsThatDoNotClose) {
    Context context;
    Mesh closed;
    std::map<std::array<float, 3>, std::uint32_t> known;
    const Mesh same = relief(12, bumpy);  // whose facets share no vertices
    for (const Index3& f : same.facets) {
        Index3 g{};
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3f& v = same.vertices[f[k]];
            const auto [at, added] =
                known.try_emplace({v.x, v.y, v.z}, static_cast<std::uint32_t>(closed.vertices.size()));
            if (added) closed.vertices.push_back(v);
            g[k] = at->second;
        }
        closed.facets.push_back(g);
    }
    auto apart = [&](auto&& keep) {
        Mesh m;
        for (std::size_t f = 0; f < closed.facets.size(); ++f) {
            if (!keep(f)) continue;
            const auto first = static_cast<std::uint32_t>(m.vertices.size());
            for (const std::uint32_t v : closed.facets[f]) m.vertices.push_back(closed.vertices[v]);
            m.facets.push_back({first, first + 1, first + 2});
        }
        return m;
    };
    const Mesh open = apart([](std::size_t f) { return f % 7 != 3; });
    Mesh torn = closed;
    torn.facets.erase(torn.facets.begin() + 50);
    pair_edges(context, torn);
    const int nx = 53, ny = 41;
    const auto grid_of = [&](const Mesh& m, const StandingPart& part, double z_top) {
        std::vector<float> grid(static_cast<std::size_t>(nx) * ny);
        RisingEnvelope rising(part, -1, -0.5, 0.3, nx, ny);
        if (z_top > 3) rising.at(3, -1, grid.data());
        rising.at(z_top, -1, grid.data());
        for (int j = 0; j < ny; ++j)
            for (int i = 0; i < nx; ++i)
                EXPECT_NEAR(grid[static_cast<std::size_t>(j) * nx + i],
                            part.envelope(-1 + 0.3 * i, -0.5 + 0.3 * j, z_top, -1), 1e-6)
                    << m.facets.size();
        return grid;
    };
    const StandingPart of_closed(context, closed.view()), of_same(context, same.view()),
        of_open(context, open.view()), of_torn(context, torn.view());
    for (const double z_top : {2.0, 6.5, 100.0}) {
        EXPECT_EQ(grid_of(closed, of_closed, z_top), grid_of(same, of_same, z_top));
        grid_of(open, of_open, z_top);
        grid_of(torn, of_torn, z_top);
    }
}

// How far points are from facets, from the shadow and, horizontally, from what stands higher, against samples
// of the surface, which can only be farther, and by no more than half of their step.
TEST(StandingPart, DistancesAgreeWithBruteForceOnARelief) {
    Context context;
    const Mesh m = relief(8, bumpy);
    const StandingPart part(context, m.view());
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> u(-3, 11), uz(-1, 12);
    constexpr double step = 0.08, miss = 0.6 * step + 2 * StandingPart::kSheet, limit = 2.5;
    const auto away = [](const Point3& p, const Point3& q) {
        return std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]);
    };
    for (const double z_top : {100.0, 6.5}) {
        const std::vector<Point3> all = surface_points(m, 100, step);
        std::vector<Point3> cap;
        for (double x = 0; z_top < 10 && x <= 8; x += step)
            for (double y = 0; y <= 8; y += step)
                if (part.covered(x, y, z_top - StandingPart::kSheet)) cap.push_back({x, y, z_top});
        for (int trial = 0; trial < 80; ++trial) {
            const Point3 p{u(random), u(random), uz(random)};
            double facets = limit, shadow = limit, beside = limit;
            for (const Point3& q : all) {
                facets = std::min(facets, away(p, q));
                if (q[2] > z_top) continue;
                shadow = std::min(shadow, away(p, {q[0], q[1], std::min(p[2], q[2])}));
                if (q[2] > p[2] + 1e-9) beside = std::min(beside, std::hypot(p[0] - q[0], p[1] - q[1]));
            }
            for (const Point3& q : cap) {
                shadow = std::min(shadow, away(p, {q[0], q[1], std::min(p[2], q[2])}));
                if (p[2] < z_top) beside = std::min(beside, std::hypot(p[0] - q[0], p[1] - q[1]));
            }
            const double from_facets = part.from_facets(p, limit);
            EXPECT_LE(from_facets, facets + 1e-9) << trial;
            EXPECT_GE(from_facets, facets - miss) << trial;
            // Of what is near enough any facet will do.
            EXPECT_LE(part.from_facets(p, limit, 1), std::max(1.0, from_facets) + 1e-9) << trial;
            EXPECT_GE(part.from_facets(p, limit, 1), from_facets - 1e-9) << trial;
            const StandingPart::Clearance over = part.from_shadow(p, z_top, limit);
            EXPECT_LE(over.distance, shadow + 2 * StandingPart::kSheet) << trial;
            EXPECT_GE(over.distance, shadow - miss) << trial;
            if (over.distance > 0 && over.distance < limit) {
                EXPECT_NEAR(std::hypot(over.away[0], over.away[1], over.away[2]), over.distance, 1e-6)
                    << trial;
            }
            const StandingPart::Clearance aside = part.beside(p, z_top, limit);
            EXPECT_LE(aside.distance, beside + 2 * StandingPart::kSheet) << trial;
            // Where a slope ends at the height asked for, samples that stand higher begin a step farther off.
            EXPECT_GE(aside.distance, beside - 4 * miss) << trial;
        }
    }
}

TEST(StandingPart, DistanceFromShadow) {
    Context context;
    Mesh m;
    box(m, {0, 0, 0}, {10, 10, 5});
    box(m, {0, 0, 5}, {30, 10, 10});
    const StandingPart part(context, m.view());
    EXPECT_NEAR(part.from_shadow({5, 5, 12}, 10, 50).distance, 2 + StandingPart::kSheet, 1e-6);
    EXPECT_NEAR(part.from_shadow({33, 5, 14}, 10, 50).distance, 5, 2e-3);
    EXPECT_NEAR(part.from_shadow({20, 5, 2}, 10, 50).distance, 0, 0);  // under the overhang is shadow
    EXPECT_NEAR(part.from_shadow({20, 5, 2}, 5, 50).distance, 10, 1e-6);
    EXPECT_NEAR(part.from_shadow({20, 5, 2}, 5, 4).distance, 4, 0);
    const auto away = part.from_shadow({33, 5, 14}, 10, 50).away;
    EXPECT_NEAR(away[0], 3, 1e-6);
    EXPECT_NEAR(away[2], 4, 2e-3);
    // Beside: only what stands higher than the point counts.
    EXPECT_NEAR(part.beside({20, 5, 2}, 5, 50).distance, 10, 1e-6);
    EXPECT_NEAR(part.beside({20, 5, 6}, 10, 50).distance, 0, 0);
    EXPECT_NEAR(part.beside({34, 5, 6}, 10, 50).distance, 4, 1e-6);
    EXPECT_NEAR(part.beside({34, 5, 10}, 10, 50).distance, 50, 0);
    EXPECT_NEAR(part.beside({34, 5, 2}, 5, 50).distance, 24, 1e-6);
}

// The nearest of many facets is the nearest of what each alone is; all face down, so that nothing is covered.
TEST(StandingPart, NearestOfManyFacets) {
    Context context;
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> place(0, 40), size(-3, 3), level(-1, 42);
    for (const std::size_t count : {1U, 7U, 8U, 65U, 300U}) {
        Mesh all;
        std::vector<StandingPart> each;
        for (std::size_t i = 0; i < count; ++i) {
            const Point3 a{place(random), place(random), place(random)};
            const auto beside = [&] {
                return Point3{a[0] + size(random), a[1] + size(random), a[2] + size(random)};
            };
            Point3 b = beside(), c = beside();
            if ((b[0] - a[0]) * (c[1] - a[1]) > (b[1] - a[1]) * (c[0] - a[0])) std::swap(b, c);
            Mesh one;
            facet(all, a, b, c), facet(one, a, b, c);
            each.emplace_back(context, one.view());
        }
        const StandingPart part(context, all.view());
        for (int i = 0; i < 300; ++i) {
            const Point3 p{level(random), level(random), level(random)};
            const double top = level(random), limit = i % 3 == 0 ? 4 : 100;
            double facets = limit, shadow = limit, aside = limit;
            for (const StandingPart& one : each) {
                facets = std::min(facets, one.from_facets(p, limit));
                shadow = std::min(shadow, one.from_shadow(p, top, limit).distance);
                aside = std::min(aside, one.beside(p, top, limit).distance);
            }
            ASSERT_NEAR(part.from_facets(p, limit), facets, 1e-9);
            const double enough = i % 4, found = part.from_facets(p, limit, enough);
            const double nearest = part.from_facets(p, limit);
            ASSERT_TRUE(facets > enough ? found == nearest : found >= nearest && found <= enough)
                << found << " " << nearest << " " << enough;
            ASSERT_NEAR(part.from_shadow(p, top, limit).distance, shadow, 1e-9);
            ASSERT_NEAR(part.beside(p, top, limit).distance, aside, 1e-9);
        }
    }
}

TEST(ClosestPoint, AgreesWithBruteForce) {
    Context context;
    const Mesh m = relief(12, bumpy);
    const ClosestPoint closest(context, m.view());
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> u(-3, 15), uz(-2, 12);
    const auto points = surface_points(m, 1e9, 0.05);
    std::vector<Point3> queries;
    for (int i = 0; i < 300; ++i) queries.push_back({u(random), u(random), uz(random)});
    const auto hits = closest.query(context, queries, 100);
    ASSERT_EQ(hits.size(), queries.size());
    for (std::size_t i = 0; i < queries.size(); ++i) {
        const Point3& q = queries[i];
        double best = 1e9;
        for (const Point3& p : points)
            best = std::min(best, std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]));
        ASSERT_NE(hits[i].facet, kNoFacet);
        EXPECT_LE(std::abs(hits[i].distance), best + 1e-6);
        EXPECT_GE(std::abs(hits[i].distance), best - 0.05);
        const Point3& c = hits[i].point;
        EXPECT_NEAR(std::hypot(c[0] - q[0], c[1] - q[1], c[2] - q[2]), std::abs(hits[i].distance), 1e-9);
        const bool column = q[0] > 0 && q[1] > 0 && q[0] < 12 && q[1] < 12;
        if (!column || q[2] < 0 || q[2] > 10) {
            EXPECT_GE(hits[i].distance, 0);
        }
        if (column && q[2] > 0.01 && q[2] < 2.4) {
            EXPECT_LT(hits[i].distance, 0);
        }
        // One at a time gives the same, and so does one thread.
        const auto one = closest.query(q, 100);
        EXPECT_EQ(one.distance, hits[i].distance);
        EXPECT_EQ(one.facet, hits[i].facet);
    }
    Context serial({.threads = 1});
    const auto again = closest.query(serial, queries, 100);
    for (std::size_t i = 0; i < hits.size(); ++i) {
        EXPECT_EQ(hits[i].distance, again[i].distance);
        EXPECT_EQ(hits[i].facet, again[i].facet);
    }
}

TEST(ClosestPoint, RadiusSignAndTies) {
    Context context;
    Mesh m;
    box(m, {1000, 1000, 0}, {1020, 1020, 10});
    const ClosestPoint closest(context, m.view());
    EXPECT_EQ(closest.query({1010, 1010, 15}, 4.9).facet, kNoFacet);
    EXPECT_NEAR(closest.query({1010, 1010, 15}, 5.1).distance, 5, 1e-9);
    EXPECT_NEAR(closest.query({1010, 1010, 15}, 5).distance, 5, 1e-9);
    EXPECT_NEAR(closest.query({1010, 1003, 5}, 50).distance, -3, 1e-9);
    EXPECT_NEAR(closest.query({1010, 1010, 5}, 50).distance, -5, 1e-9);
    // The diagonal of a face belongs to two facets: the lower index answers. The column above an edge or a
    // corner is either inside or outside, never half.
    EXPECT_EQ(closest.query({1010, 1010, 12}, 50).facet, 2u);
    EXPECT_EQ(closest.winding({1010, 1010, 5}), 1);
    EXPECT_EQ(closest.winding({1010, 1010, 11}), 0);
    EXPECT_EQ(closest.winding({1010, 1010, -1}), 0);
    EXPECT_EQ(closest.winding({999, 1010, 5}), 0);
    const int edge = closest.winding({1020, 1010, 5});
    EXPECT_TRUE(edge == 0 || edge == 1);
}
