// Walls and pins that stand: their feet against closed formulas and against brute force.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "engine/schedule/standing_walls.h"
#include "kernels/geometry/vectors.h"
#include "tests/support/seed.h"

namespace slabwright {
namespace {

Loops polygon(const std::vector<std::array<double, 2>>& points) {
    Loops loops;
    for (const auto& p : points) loops.points.push_back({to_units(p[0]), to_units(p[1])});
    loops.close_loop();
    return simplify(loops);
}

Loops rectangle(double length, double thick, double angle, double x = 0, double y = 0) {
    const double c = std::cos(angle), s = std::sin(angle);
    std::vector<std::array<double, 2>> points;
    for (const auto& [u, v] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}})
        points.push_back(
            {x + u * length / 2 * c - v * thick / 2 * s, y + u * length / 2 * s + v * thick / 2 * c});
    return polygon(points);
}

Loops disc(double d) {
    std::vector<std::array<double, 2>> points;
    for (int i = 0; i < 256; ++i)
        points.push_back({20 + d / 2 * std::cos(i * std::numbers::pi / 128),
                          d / 2 * std::sin(i * std::numbers::pi / 128)});
    return polygon(points);
}

TEST(StandingWalls, AShortWallBearsByTheClosedFormula) {
    for (const double t : {0.5, 1.0, 2.0})
        for (const double b : {10.0, 15.0})
            for (const double h : {10.0, 40.0}) {
                if (b > 1.9 * h) continue;
                const double expected = 6 * 12 * h / (b * t * t);
                EXPECT_NEAR(wall_foot(rectangle(b, t, 0.3)).stress_mpa(12, h), expected, 0.03 * expected);
            }
}

TEST(StandingWalls, APinBearsByTheClosedFormula) {
    for (const double d : {2.0, 5.0, 9.0})
        for (const double h : {10.0, 60.0}) {
            const double expected = 32 * 12 * h / (std::numbers::pi * d * d * d);
            EXPECT_NEAR(wall_foot(disc(d)).stress_mpa(12, h), expected, 0.01 * expected);
        }
}

// A long one as a strip of twice its height, whatever its length.
TEST(StandingWalls, ALongWallBearsAsAPlate) {
    for (const double length : {100.0, 300.0}) {
        const double expected = 0.51 * 6 * 12 / (2 * 2);
        EXPECT_NEAR(wall_foot(rectangle(length, 2, 0)).stress_mpa(12, 15), expected, 0.03 * expected);
    }
}

// Second moments by cells.
void moments_by_cells(double b, double t, double& across, double& along) {
    const int n = 100;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
            const double u = b * ((i + 0.5) / n - 0.5), v = t * ((j + 0.5) / n - 0.5), cell = b * t / n / n;
            across += v * v * cell;
            along += u * u * cell;
        }
}

// The weakest modulus of any wall against cells and all directions of the force.
TEST(StandingWalls, RandomFeetAgainstBruteForce) {
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> size(2, 8), any(0, 3);
    for (int trial = 0; trial < 30; ++trial) {
        const double b = size(random), t = size(random) / 2, angle = any(random);
        const Loops foot = rectangle(b, t, angle, any(random), any(random));
        double across_mm4 = 0, along_mm4 = 0;
        moments_by_cells(b, t, across_mm4, along_mm4);
        // The stress of a unit moment in every direction at every corner, as that of two about the wall's
        // axes.
        double most = 0;
        for (int a = 0; a < 3600; ++a) {
            const double across = std::abs(std::cos(a * std::numbers::pi / 1800)),
                         along = std::abs(std::sin(a * std::numbers::pi / 1800));
            most = std::max(most, across * t / 2 / across_mm4 + along * b / 2 / along_mm4);
        }
        const double least = 1 / most;
        EXPECT_NEAR(wall_foot(foot).weakest_mm3, least, 0.01 * least) << "seed " << seed;
    }
}

TEST(StandingWalls, ThinPartsAreWallsAndPinsButNoCorners) {
    std::vector<double> contact;
    // A block with a rib, and a pin beside it.
    const Loops block = rectangle(60, 60, 0), rib = rectangle(30, 3, 0, 45, 0);
    const std::vector<Loops> none = thin_parts(block, contact);
    EXPECT_TRUE(none.empty()) << none.size();
    const std::vector<Loops> both = thin_parts(unite(unite(block, rib), rectangle(4, 4, 0, 45, 25)), contact);
    ASSERT_EQ(both.size(), 2U);
    EXPECT_TRUE((contact[0] > 0) != (contact[1] > 0));
    for (std::size_t i = 0; i < 2; ++i) {
        const WallFoot foot = wall_foot(both[i]);
        EXPECT_NEAR(foot.thickness_mm, contact[i] > 0 ? 3 : 4, 0.1);
        EXPECT_NEAR(foot.length_mm, contact[i] > 0 ? 30 : 4, 1);
        if (contact[i] > 0) {
            EXPECT_NEAR(contact[i], 3, 1);
        }
    }
}

// A block with a free wall beside it, through two layers: told where it is thin, with the whole height, and
// not where it is thick, low, or only a ridge.
TEST(StandingWalls, ToldWhereTheyBreakThroughTheLayersBelow) {
    const auto told = [](double thick, double force, bool ridge) {
        Plan plan;
        const Loops wall = rectangle(40, thick, 0, 0, 60), block = rectangle(60, 60, 0),
                    all = unite(block, wall);
        std::vector<std::vector<JointWood>> wood(2);
        for (int l = 0; l < 2; ++l) {
            Layer& layer = plan.layers.emplace_back();
            layer.index = l + 1;
            layer.z_bottom = 15.0 * l;
            layer.z_top = 15.0 * (l + 1);
            Operation op;
            op.kind = OperationKind::finish;
            op.tool = 3;
            op.stepdown = 3;
            op.spindle_rpm = 18000;
            op.peak_force_n = force;
            op.moves = {{0, 0, 0, 0}, {to_units(10), 0, 0, 5000}};
            layer.operations = {op};
            JointWood& joint = wood[static_cast<std::size_t>(l)].emplace_back();
            joint.z = layer.z_bottom;
            joint.above = joint.below = joint.both = all;
            for (Loops& higher : joint.higher) higher = ridge && l == 1 ? block : all;
        }
        Context context;
        return weak_walls(plan, standing_feet(context, plan, wood));
    };
    const std::vector<Diagnostic> thin = told(1, 10, false);
    ASSERT_EQ(thin.size(), 2U);
    EXPECT_EQ(thin[0].code, "wall.weak");
    EXPECT_NE(thin[0].message.find("layer 1: a wall or pin 1.0 mm thick stands 15.0 mm high"),
              std::string::npos)
        << thin[0].message;
    // The second layer's top is as high as three quarters of it are known to stand over the first one's foot.
    EXPECT_NE(thin[1].message.find("stands 26.2 mm high"), std::string::npos) << thin[1].message;
    ASSERT_TRUE(thin[1].where);
    EXPECT_NEAR((*thin[1].where)[1], 60, 0.1);
    EXPECT_NEAR((*thin[1].where)[2], 0, 1e-9);
    EXPECT_TRUE(told(6, 10, false).empty());
    EXPECT_TRUE(told(1, 0.5, false).empty());
    EXPECT_EQ(told(1, 10, true).size(), 1U) << "a ridge is thin, but not tall";
}

// A wall that hangs over its slab stands on nothing of the layer below, whatever thin part that has
// elsewhere.
TEST(StandingWalls, AreNotFollowedToWhatStandsElsewhere) {
    Plan plan;
    const Loops block = rectangle(60, 60, 0), low = unite(block, rectangle(40, 1, 0, 0, -60)),
                high = unite(block, rectangle(40, 1, 0, 0, 60));
    std::vector<std::vector<JointWood>> wood(2);
    for (std::size_t l = 0; l < 2; ++l) {
        Layer& layer = plan.layers.emplace_back();
        layer.z_bottom = 15.0 * static_cast<double>(l);
        layer.z_top = layer.z_bottom + 15;
        JointWood& joint = wood[l].emplace_back();
        joint.z = layer.z_bottom;
        joint.above = l == 0 ? low : high;
        joint.below = l == 0 ? block : low;
        joint.both = block;
        for (Loops& higher : joint.higher) higher = joint.above;
    }
    Context context;
    const std::vector<std::vector<StandingFoot>> feet = standing_feet(context, plan, wood);
    ASSERT_EQ(feet.size(), 2U);
    for (std::size_t l = 0; l < 2; ++l) {
        EXPECT_FALSE(feet[l].empty());
        for (const StandingFoot& foot : feet[l]) EXPECT_NEAR(foot.middle[1], l == 0 ? -60 : 60, 0.1) << l;
    }
}

}  // namespace
}  // namespace slabwright
