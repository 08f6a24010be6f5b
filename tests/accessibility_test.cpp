// Accessibility against closed forms, and against brute force over dense places of the tool on random small parts.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

#include "kernels/access/accessibility.h"
#include "kernels/errors.h"
#include "kernels/mesh/weld.h"
#include "tests/mesh_shapes.h"

using namespace slabwright;

namespace {

using Profile = ToolShape::Profile;

ToolShape flat(double radius) { return {.profile = Profile::flat, .radius = radius}; }
ToolShape ball(double radius) { return {.profile = Profile::ball, .radius = radius}; }
ToolShape bull_nose(double radius, double corner) { return {.profile = Profile::bull_nose, .radius = radius, .corner_radius = corner}; }
ToolShape tapered_ball(double radius, double tip, double degrees) {
    return {.profile = Profile::tapered_ball, .radius = radius, .corner_radius = tip, .taper_rad = degrees * std::numbers::pi / 180};
}

/// Columns of square cells with upright walls between them.
Mesh blocks(Context& context, int n, double cell, const std::function<double(int, int)>& height) {
    shapes::Facets facets;
    auto quad = [&](Vec3f a, Vec3f b, Vec3f c, Vec3f d) {
        facets.push_back({a, b, c});
        facets.push_back({a, c, d});
    };
    auto at = [&](int i, int j, double z) { return Vec3f{static_cast<float>(i * cell), static_cast<float>(j * cell), static_cast<float>(z)}; };
    auto h = [&](int i, int j) { return i < 0 || j < 0 || i >= n || j >= n ? 0.0 : height(i, j); };
    for (int i = 0; i <= n; ++i)
        for (int j = 0; j <= n; ++j) {
            if (i < n && j < n) {
                const double z = h(i, j);
                quad(at(i, j, z), at(i + 1, j, z), at(i + 1, j + 1, z), at(i, j + 1, z));
                quad(at(i, j, 0), at(i, j + 1, 0), at(i + 1, j + 1, 0), at(i + 1, j, 0));
            }
            // The wall between this cell and the one before it in x, and the same in y; facing the lower of the two.
            const double west = h(i - 1, j), here = h(i, j), south = h(i, j - 1);
            if (j < n && west < here) quad(at(i, j + 1, west), at(i, j, west), at(i, j, here), at(i, j + 1, here));
            if (j < n && west > here) quad(at(i, j, here), at(i, j + 1, here), at(i, j + 1, west), at(i, j, west));
            if (i < n && south < here) quad(at(i, j, south), at(i + 1, j, south), at(i + 1, j, here), at(i, j, here));
            if (i < n && south > here) quad(at(i + 1, j, here), at(i, j, here), at(i, j, south), at(i + 1, j, south));
        }
    return weld(context, facets);
}

}  // namespace

TEST(ToolShape, RefusesWhatCannotBe) {
    EXPECT_THROW(check_tool_shape(flat(0)), Error);
    EXPECT_THROW(check_tool_shape(flat(-1)), Error);
    EXPECT_THROW(check_tool_shape(bull_nose(3, 4)), Error);
    EXPECT_THROW(check_tool_shape(tapered_ball(3, 1, 90)), Error);
    EXPECT_THROW(check_tool_shape(tapered_ball(1, 3, 5)), Error);
    ToolShape stubby = ball(3);
    stubby.flute_length = 2;
    EXPECT_THROW(check_tool_shape(stubby), Error);
    EXPECT_NO_THROW(check_tool_shape(bull_nose(3, 3)));
}

// A block in the open: all of its walls, by any tool that is upright somewhere.
TEST(Accessibility, OfABlockIsWhole) {
    Context context;
    const Mesh mesh = weld(context, shapes::box({0, 0, 0}, {20, 10, 12}));
    const AccessScene scene(context, mesh.view());
    for (const ToolShape& tool : {flat(3), ball(3), bull_nose(3, 1)}) {
        const Accessibility a = scene.accessible(context, 0, 12, tool);
        EXPECT_NEAR(a.area, 60 * (12 - 0.002), 0.01);
        EXPECT_DOUBLE_EQ(a.ratio(), 1);
        EXPECT_EQ(a.undercut, 0);
        EXPECT_EQ(a.undecided, 0u);
    }
}

// A slot: a flat end mill enters it if it is not wider by more than the tolerance on either side.
TEST(Accessibility, OfASlotByWidth) {
    Context context;
    // 5 × 5 cells of 4 mm, the middle row sunk to 6 of 10 mm.
    const Mesh mesh = blocks(context, 5, 4, [](int, int j) { return j == 2 ? 6 : 10; });
    const AccessScene scene(context, mesh.view());
    const double outside = 4 * 20 * 10 - 2 * 16, slot = 20 * 4 + 2 * 20 * 4;
    for (const double radius : {1.5, 2.0, 2.005}) {
        const Accessibility a = scene.accessible(context, 0, 10, flat(radius));
        EXPECT_NEAR(a.area, outside + slot, 0.5);
        EXPECT_DOUBLE_EQ(a.ratio(), 1) << radius;
    }
    // A wider one meets the two corners of the slot's mouth first, and reaches in between by its bulge there.
    const double radius = 2.5, bulge = radius - std::sqrt(radius * radius - 4), half = std::asin(2 / radius);
    const double segment = radius * radius * (half - std::sin(half) * std::cos(half));
    const Accessibility wide = scene.accessible(context, 0, 10, flat(radius));
    EXPECT_NEAR(wide.reached, outside + 2 * segment, wide.uncertain + 0.05 * bulge * slot / 20) << segment;
    EXPECT_LE(wide.uncertain, 0.02 * wide.area);
}
