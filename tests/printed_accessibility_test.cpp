// Accessibility as printed, on polylines computed by hand.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "kernels/access/printed_accessibility.h"
#include "kernels/errors.h"
#include "kernels/mesh/weld.h"
#include "tests/mesh_shapes.h"

using namespace slabwright;

namespace {

void add(Loops& loops, const std::vector<std::pair<double, double>>& corners) {
    for (const auto& [x, y] : corners) loops.points.push_back({to_units(x), to_units(y)});
    loops.close_loop();
}
void block(Loops& loops, double x0, double y0, double x1, double y1) {
    add(loops, {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}});
}
void hole(Loops& loops, double x0, double y0, double x1, double y1) {
    add(loops, {{x0, y0}, {x0, y1}, {x1, y1}, {x1, y0}});
}

}  // namespace

// A square in the open has convex corners only.
TEST(PrintedAccessibility, OfASquareIsWhole) {
    Loops section;
    block(section, 0, 0, 30, 30);
    const PrintedAccessibility a = printed_accessibility(section, 6);
    EXPECT_DOUBLE_EQ(a.all, 120);
    EXPECT_DOUBLE_EQ(a.ratio(), 1);
}

// A square pocket loses R on either side of each of its four corners.
TEST(PrintedAccessibility, OfASquarePocket) {
    Loops section;
    block(section, 0, 0, 60, 60);
    hole(section, 20, 20, 40, 40);
    const PrintedAccessibility a = printed_accessibility(section, 3);
    EXPECT_NEAR(a.all, 240 + 80, 1e-9);
    EXPECT_NEAR(a.corners, 8 * 3, 1e-9);
    EXPECT_NEAR(a.intersecting, 0, 1e-9);
    EXPECT_NEAR(a.ratio(), (320 - 24) / 320.0, 1e-12);
    // A tool as wide as the pocket is all corners, a wider one too.
    for (const double radius : {10.0, 14.0}) {
        const PrintedAccessibility b = printed_accessibility(section, radius);
        EXPECT_NEAR(b.corners, 80, 1e-9);
        EXPECT_NEAR(b.intersecting, 0, 1e-9);
    }
}

// Between two blocks 8 mm apart a tool of 5 mm radius is nowhere in contact with one of them and clear of the
// other, but for the ends: its centre, 5 mm beside one block, is 3 mm beside the other, so 4 mm past the
// other's corner it is clear of it.
TEST(PrintedAccessibility, OfASlot) {
    Loops section;
    block(section, 0, 0, 50, 20);
    block(section, 0, 28, 40, 48);
    const double past = 4;
    const PrintedAccessibility a = printed_accessibility(section, 5, 2, {}, 0);
    EXPECT_NEAR(a.all, 140 + 120, 1e-9);
    EXPECT_NEAR(a.corners, 0, 1e-9);
    // All 40 mm of the upper one; of the lower one 40 mm and 4 more.
    EXPECT_NEAR(a.intersecting, 40 + 40 + past, 1e-6);
    EXPECT_NEAR(a.ratio(), (260 - 2 * (80 + past)) / 260, 1e-9);
    EXPECT_NEAR(printed_accessibility(section, 5, 1, {}, 0).ratio(), (260 - (80 + past)) / 260, 1e-9);
    EXPECT_NEAR(printed_accessibility(section, 3.999).ratio(), 1, 1e-12);
    // A tool so large that its centre is deep in the other block, clear of its edges, is no better for that.
    const PrintedAccessibility b = printed_accessibility(section, 15, 2, {}, 0);
    EXPECT_GE(b.intersecting, 80);
}

// On an arc of radius ρ > R the corner rule loses R/ρ of the length, though a tool reaches all of it
// (METHOD.md section 6).
TEST(PrintedAccessibility, OfARoundedCorner) {
    constexpr double rho = 10, radius = 4;
    constexpr int steps = 90;  // of a quarter
    // A pocket 60 × 60 with rounded corners, walked clockwise.
    std::vector<std::pair<double, double>> walk;
    const std::pair<double, double> centres[4] = {{10, 50}, {50, 50}, {50, 10}, {10, 10}};
    for (int c = 0; c < 4; ++c)
        for (int i = 0; i <= steps; ++i) {
            const double angle =
                std::numbers::pi - c * std::numbers::pi / 2 - i * std::numbers::pi / 2 / steps;
            walk.push_back(
                {centres[c].first + rho * std::cos(angle), centres[c].second + rho * std::sin(angle)});
        }
    Loops section;
    block(section, -20, -20, 80, 80);
    add(section, walk);
    const PrintedAccessibility a = printed_accessibility(section, radius);
    const double arcs = 2 * std::numbers::pi * rho;
    EXPECT_NEAR(a.all, 400 + 160 + arcs, 0.02);
    EXPECT_NEAR(a.corners, arcs * radius / rho, 0.02);
    EXPECT_NEAR(a.intersecting, 0, 1e-9);
    // Rounded off with less than R: the arcs are lost, and of the walls beside them R − ρ on each side, as in
    // a sharp corner.
    const PrintedAccessibility b = printed_accessibility(section, 12);
    EXPECT_NEAR(b.corners + b.intersecting, arcs + 8 * (12 - rho), 0.05);
}

TEST(PrintedAccessibility, OfAnAngleByItsTangent) {
    // A notch of 60° in a block: both sides lose R/tan 30°.
    Loops section;
    const double deep = 20 * std::sqrt(3.0) / 2;
    add(section, {{-40, -40}, {40, -40}, {40, deep}, {10, deep}, {0, 0}, {-10, deep}, {-40, deep}});
    const PrintedAccessibility a = printed_accessibility(section, 2);
    EXPECT_NEAR(a.corners, 2 * 2 / std::tan(std::numbers::pi / 6), 1e-3);
    EXPECT_NEAR(a.intersecting, 0, 1e-9);
}

TEST(PrintedAccessibility, OfALayerWithoutItsUndercuts) {
    Context context;
    // A block, and a frustum beside it that stands on its small end: all of its sides face down.
    shapes::Facets facets = shapes::box({0, 0, 0}, {20, 20, 10});
    auto lean = shapes::box({50, 0, 0}, {70, 20, 10});
    for (auto& facet : lean)
        for (Vec3f& v : facet)
            if (v.z == 0) v.x = v.x < 60 ? 55.0f : 65.0f, v.y = v.y < 10 ? 5.0f : 15.0f;
    shapes::append(facets, lean);
    const Mesh mesh = weld(context, facets);
    const PrintedAccessibility a = printed_accessibility(context, mesh.view(), 0, 10, 3, 2, 4);
    EXPECT_NEAR(a.all, 4 * 80, 1e-6);
    EXPECT_DOUBLE_EQ(a.ratio(), 1);
    EXPECT_THROW((void)printed_accessibility(context, mesh.view(), 0, 10, 0), Error);
}
