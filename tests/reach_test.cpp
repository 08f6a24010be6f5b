// Whether a tool reaches a point, against trying all of its places densely on random small parts, and in
// closed form.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>
#include <vector>

#include "engine/simulate/reach.h"
#include "io/write/report_reach.h"
#include "kernels/mesh/mesh.h"
#include "tests/support/seed.h"

using namespace slabwright;

namespace {

struct Solid {
    Mesh mesh;
    void triangle(const Point3& a, const Point3& b, const Point3& c) {
        const auto n = static_cast<std::uint32_t>(mesh.vertices.size());
        for (const auto* p : {&a, &b, &c})
            mesh.vertices.push_back(
                {static_cast<float>((*p)[0]), static_cast<float>((*p)[1]), static_cast<float>((*p)[2])});
        mesh.facets.push_back({n, n + 1, n + 2});
    }
    /// Between two convex outlines of as many corners, counter-clockwise, at z = low and high.
    void prism(const std::vector<std::array<double, 2>>& bottom,
               const std::vector<std::array<double, 2>>& top, double low, double high) {
        const std::size_t n = bottom.size();
        auto b = [&](std::size_t i) { return Point3{bottom[i % n][0], bottom[i % n][1], low}; };
        auto t = [&](std::size_t i) { return Point3{top[i % n][0], top[i % n][1], high}; };
        for (std::size_t i = 0; i < n; ++i) {
            triangle(b(i), b(i + 1), t(i + 1));
            triangle(b(i), t(i + 1), t(i));
            if (i >= 1 && i + 1 < n) triangle(b(0), b(i + 1), b(i)), triangle(t(0), t(i), t(i + 1));
        }
    }
    void box(const Point3& l, const Point3& h) {
        const std::vector<std::array<double, 2>> outline{
            {l[0], l[1]}, {h[0], l[1]}, {h[0], h[1]}, {l[0], h[1]}};
        prism(outline, outline, l[2], h[2]);
    }
};

Tool tool(ToolKind kind, double diameter) {
    Tool t;
    t.kind = kind;
    t.diameter = t.shank_diameter = diameter;
    t.flute_length = 30, t.holder_diameter = 30, t.stickout = 40;
    return t;
}

/// The greatest margin, mm, with which a tool covers a point over places at most `spacing` apart: how far it
/// stays clear of the part. Negative: it is so deep in the part at best. Places between the tried ones can be
/// better by half the spacing.
double best_margin(const StandingPart& part, const Tool& t, const Point3& p, double z_bottom, double z_top,
                   double spacing) {
    const double R = t.diameter / 2, thicker = 1;
    double best = -1e9;
    auto attempt = [&](const Point3& tip) {
        // How deep the tool made thicker by 1 mm would be in the part tells its distance from it too.
        const Point3 lower{tip[0], tip[1], tip[2] - (t.kind == ToolKind::ball ? thicker : 0)};
        double depth = 0;
        if (t.kind == ToolKind::ball) depth = part.ball(z_top, lower, lower, R + thicker, 0).depth;
        else depth = R + thicker - part.beside({tip[0], tip[1], tip[2] + 1e-3}, z_top, R + thicker).distance;
        best = std::max(best, thicker - depth);
    };
    const double floor = t.kind == ToolKind::ball ? z_bottom - R : z_bottom;
    if (t.kind == ToolKind::ball) {
        const int nu = static_cast<int>(std::ceil(R * std::numbers::pi / 2 / (spacing * 0.7)));
        for (int i = 0; i <= nu; ++i) {
            const double u = std::numbers::pi / 2 * i / nu;
            const int nv = std::max(
                1, static_cast<int>(std::ceil(2 * std::numbers::pi * R * std::sin(u) / (spacing * 0.7))));
            for (int k = 0; k < nv; ++k) {
                const double v = 2 * std::numbers::pi * k / nv;
                const Point3 tip{p[0] + R * std::sin(u) * std::cos(v), p[1] + R * std::sin(u) * std::sin(v),
                                 p[2] + R * std::cos(u) - R};
                if (tip[2] >= floor) attempt(tip);
            }
        }
    } else if (p[2] >= floor) {
        const int n = static_cast<int>(std::ceil(R / (spacing * 0.7)));
        for (int j = -n; j <= n; ++j)
            for (int i = -n; i <= n; ++i)
                if (i * i + j * j <= n * n) attempt({p[0] + R * i / n, p[1] + R * j / n, p[2]});
        for (int k = 0; k < 8 * n; ++k)
            attempt({p[0] + R * std::cos(std::numbers::pi * k / (4 * n)),
                     p[1] + R * std::sin(std::numbers::pi * k / (4 * n)), p[2]});
    }
    return best;
}

}  // namespace

TEST(Reach, AgreesWithTryingAllPlaces) {
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    auto uniform = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(random); };
    constexpr double spacing = 0.12, z_top = 6;
    int yes = 0, no = 0, close = 0;
    for (int trial = 0; trial < 16; ++trial) {
        Solid solid;
        const double floor = uniform(0, 1);
        if (trial % 3 != 0) solid.box({-2, -2, -1}, {12, 12, floor});
        for (int k = 0; k < 7; ++k) {
            std::vector<std::array<double, 2>> bottom, top;
            const int n = 3 + k % 4;
            const double x = uniform(0, 10), y = uniform(0, 10), r = uniform(0.5, 3),
                         s = r * uniform(0.3, 1.1), turn = uniform(0, 6);
            for (int i = 0; i < n; ++i) {
                const double a = turn + 2 * std::numbers::pi * i / n;
                bottom.push_back({x + r * std::cos(a), y + r * std::sin(a)});
                top.push_back({x + s * std::cos(a), y + s * std::sin(a)});
            }
            solid.prism(bottom, top, uniform(-0.5, 2), uniform(2.5, 9));
        }
        Context context;
        const StandingPart part(context, solid.mesh.view());
        const Tool t = tool(trial % 2 == 0 ? ToolKind::ball : ToolKind::flat, uniform(1.5, 3));
        Reach reach(part, {t}, 0, z_top, -1e9);
        Point3 p{};
        for (int k = 0; k < 60; ++k) {
            // Some alone, some as the neighbours they are in use.
            if (k % 4 == 0) p = {uniform(0, 10), uniform(0, 10), uniform(0, 5)};
            else
                p = {p[0] + uniform(-0.3, 0.3), p[1] + uniform(-0.3, 0.3),
                     std::clamp(p[2] + uniform(-0.3, 0.3), 0.0, 6.0)};
            const double margin = best_margin(part, t, p, 0, z_top, spacing);
            const bool found = reach.reachable(p);
            // The search must find what is there by more than its resolution, and the spacing bounds what
            // trying can miss.
            if (margin > Reach::kResolution) {
                EXPECT_TRUE(found) << "trial " << trial << ": reached by " << margin;
                ++yes;
            } else if (margin < -spacing / 2 - 2 * Reach::kTouch) {
                EXPECT_FALSE(found) << "trial " << trial << ": out of reach by " << -margin - spacing / 2;
                ++no;
            } else ++close;
        }
    }
    EXPECT_GT(yes, 50);
    EXPECT_GT(no, 50);
    std::printf("%d reached, %d not, %d too close to tell\n", yes, no, close);
}

// A ball in an upright corner with a floor: reaches to (√3 − 1)·R from it along the diagonal, to (√2 − 1)·R
// from an edge, no farther.
TEST(Reach, CornersInClosedForm) {
    Solid solid;
    solid.box({-5, -5, -1}, {30, 30, 1});
    solid.box({-5, -5, 0}, {0, 30, 20});
    solid.box({-5, -5, 0}, {30, 0, 20});
    Context context;
    const StandingPart part(context, solid.mesh.view());
    const double R = 3;
    const Tool ball = tool(ToolKind::ball, 2 * R), flat = tool(ToolKind::flat, 2 * R);
    Reach balls(part, {ball}, 0, 20, -1e9), flats(part, {flat}, 0, 20, -1e9);
    for (const double delta : {-0.01, 0.01}) {
        const bool expected = delta > 0;
        const double d = (std::sqrt(3.0) - 1) * R + delta, e = (std::sqrt(2.0) - 1) * R + delta,
                     h = std::sqrt(0.5);
        EXPECT_EQ(balls.reachable({d / std::sqrt(3.0), d / std::sqrt(3.0), 1 + d / std::sqrt(3.0)}),
                  expected);
        EXPECT_EQ(balls.reachable({e * h, 12, 1 + e * h}), expected) << "along the floor";
        EXPECT_EQ(balls.reachable({e * h, e * h, 9}), expected) << "along the upright edge";
        EXPECT_EQ(flats.reachable({e * h, e * h, 1}), expected);
    }
    EXPECT_TRUE(flats.reachable({0, 12, 1})) << "touches wall and floor";
    EXPECT_FALSE(flats.reachable({5, 5, 0.99})) << "under the floor";
}

// A slot as wide as the tool has one place across: halving does not hit it, settling must.
TEST(Reach, SlotsAsWideAsTheTool) {
    for (const double narrower : {0.0, 0.002, 0.02}) {
        Solid solid;
        const double a = 0.4, c = std::cos(a), s = std::sin(a), w = 3 - narrower / 2;
        auto turned = [&](double x, double y) { return std::array<double, 2>{c * x - s * y, s * x + c * y}; };
        for (const double side : {-1.0, 1.0}) {
            const double y0 = side < 0 ? -20 : w, y1 = side < 0 ? -w : 20;
            const std::vector<std::array<double, 2>> outline{turned(-20, y0), turned(20, y0), turned(20, y1),
                                                             turned(-20, y1)};
            solid.prism(outline, outline, 0, 10);
        }
        Context context;
        const StandingPart part(context, solid.mesh.view());
        for (const ToolKind kind : {ToolKind::flat, ToolKind::ball}) {
            Reach reach(part, {tool(kind, 6)}, 0, 10, -1e9);
            for (const double y : {0.0, 1.3, 2.2}) {
                const auto at = turned(0.7, y);
                EXPECT_EQ(reach.reachable({at[0], at[1], 4}), narrower == 0)
                    << (kind == ToolKind::ball ? "ball " : "flat ") << narrower << " " << y;
            }
        }
    }
}

TEST(Reach, HolderFloorAndBoard) {
    Solid solid;
    solid.box({0, 0, 0}, {10, 50, 60});
    Context context;
    const StandingPart part(context, solid.mesh.view());
    Tool t = tool(ToolKind::ball, 6);
    Reach tall(part, {t}, 0, 60, -1e9);
    EXPECT_FALSE(tall.reachable({11, 25, 5})) << "the holder stands 15 mm off the axis at z 45";
    EXPECT_TRUE(tall.reachable({11, 25, 20.77}));  // with the tip at 20.77 − 3 + √(9 − 4)
    EXPECT_FALSE(tall.reachable({11, 25, 20.75}));
    EXPECT_TRUE(tall.reachable({22.5, 25, 5})) << "from 15 mm beside the wall";
    t.stickout = 100;
    Reach slender(part, {t}, 0, 60, -1e9);
    EXPECT_TRUE(slender.reachable({11, 25, 5}));
    // Against the wall at the bottom the ball passes it by its radius; a board that may not be cut forbids
    // that.
    EXPECT_TRUE(slender.reachable({10, 25, 0}));
    Reach on_board(part, {t}, 0, 60, 0);
    EXPECT_FALSE(on_board.reachable({10, 25, 0}));
    EXPECT_TRUE(on_board.reachable({10, 25, 3}));
    Reach flat(part, {tool(ToolKind::flat, 6)}, 2, 42, -1e9);
    EXPECT_FALSE(flat.reachable({15, 25, 1.9})) << "flat end mills stop at the layer's bottom";
    EXPECT_TRUE(flat.reachable({15, 25, 2}));
}

// Small facets anywhere about walls with a wide pocket and a slot too narrow for any tool between them.
TEST(ReachMap, EveryFacetIsAskedAtItsMiddle) {
    Solid solid;
    solid.box({0, 0, 0}, {60, 40, 10});
    for (const auto& [from, to] : {std::array{0.0, 5.0}, {20, 30}, {32, 60}})
        solid.box({from, 0, 5}, {to, 40, 30});
    Context context;
    const StandingPart part(context, solid.mesh.view());
    SimulationInput input;
    input.layers.push_back({0, 30, 31});
    input.tools = {tool(ToolKind::flat, 8), tool(ToolKind::ball, 6)};
    constexpr double board = 1;
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> unit(0, 1);
    const auto near = [&](const Point3& p) {
        return Point3{p[0] + unit(random), p[1] + unit(random), p[2] + unit(random)};
    };
    Solid picture;
    for (int i = 0; i < 150; ++i) {
        const Point3 at{64 * unit(random) - 2, 38 * unit(random) + 1, 28 * unit(random) + 3};
        picture.triangle(near(at), near(at), near(at));
    }
    const ReachMap map = reach_map(context, part, input, board, picture.mesh.view());
    ASSERT_EQ(map.codes.size(), picture.mesh.facets.size());
    Reach reach(part, input.tools, 0, 30, -board);
    std::array<int, 3> count{};
    for (std::size_t f = 0; f < map.codes.size(); ++f) {
        std::array<Point3, 3> p;
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3f& v = picture.mesh.vertices[picture.mesh.facets[f][k]];
            p[k] = {v.x, v.y, v.z};
        }
        const auto along = [&](std::size_t corner, std::size_t k) { return p[corner][k] - p[0][k]; };
        Point3 normal{};
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t u = (k + 1) % 3, v = (k + 2) % 3;
            normal[k] = along(1, u) * along(2, v) - along(1, v) * along(2, u);
        }
        const double length = std::hypot(normal[0], normal[1], normal[2]);
        Point3 over{};
        for (std::size_t k = 0; k < 3; ++k)
            over[k] = (p[0][k] + p[1][k] + p[2][k]) / 3 + kReachDistance * normal[k] / length;
        const int expected = normal[2] < 0 ? 0 : reach.reachable(over) ? 1 : 2;
        EXPECT_EQ(map.codes[f], expected) << "at " << over[0] << ' ' << over[1] << ' ' << over[2];
        ++count.at(static_cast<std::size_t>(expected));
    }
    for (const int of : count) EXPECT_GT(of, 10);
}
