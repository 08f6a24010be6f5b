// What a cut takes of a level, against the distance from its axis.
#include "engine/sheet_proof/swept.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "tests/support/seed.h"

namespace slabwright {
namespace {

double to_axis(const std::vector<AxisPoint>& axis, double x, double y) {
    double nearest = 1e300;
    for (std::size_t i = 0; i + 1 < axis.size(); ++i) {
        const AxisPoint &a = axis[i], &b = axis[i + 1];
        const double dx = b.x - a.x, dy = b.y - a.y, l2 = dx * dx + dy * dy;
        const double t = l2 > 0 ? std::clamp(((x - a.x) * dx + (y - a.y) * dy) / l2, 0.0, 1.0) : 0;
        nearest = std::min(nearest, std::hypot(x - a.x - t * dx, y - a.y - t * dy));
    }
    return nearest;
}

/// Long and short pieces, gentle and sharp turns, places where the axis stands.
std::vector<AxisPoint> random_axis(std::mt19937& random) {
    std::uniform_real_distribution<double> unit(0, 1);
    std::vector<AxisPoint> axis{{0, 0}};
    double heading = 2 * std::numbers::pi * unit(random), bend = 0;
    for (int i = 0; i < 60; ++i) {
        if (random() % 8 == 0) heading += 2 * std::numbers::pi * unit(random);
        if (random() % 6 == 0) bend = 0.6 * unit(random) - 0.3;
        heading += bend;
        const double step = std::pow(10, 4 * unit(random) - 3.5);  // 0.3 um to 3 mm
        const AxisPoint& last = axis.back();
        axis.push_back(random() % 9 == 0
                           ? last
                           : AxisPoint{last.x + step * std::cos(heading), last.y + step * std::sin(heading)});
    }
    return axis;
}

// A round of eight corners to the half circle reaches cos(pi/16) of its radius at least; units are 0.1 um.
TEST(Swept, HoldsWhatIsNearerThanHalfTheKerfAndNothingFarther) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> unit(-1, 1);
    const double half = 0.5, surely = half * std::cos(std::numbers::pi / 16) - 0.001;
    for (int round = 0; round < 60; ++round) {
        const std::vector<AxisPoint> axis = random_axis(random);
        const Loops taken = swept(axis, 2 * half);
        for (int trial = 0; trial < 2000; ++trial) {
            const AxisPoint& near = axis[random() % axis.size()];
            const double x = near.x + 0.7 * unit(random), y = near.y + 0.7 * unit(random);
            const double away = to_axis(axis, x, y);
            const bool is_taken = winding(taken, unit_point(x, y)) > 0;
            if (away < surely) {
                ASSERT_TRUE(is_taken) << round << ": " << x << ' ' << y << ", " << away;
            }
            if (away > half + 0.002) {
                ASSERT_FALSE(is_taken) << round << ": " << x << ' ' << y << ", " << away;
            }
        }
    }
}

// Along a straight line with many points nothing stays between them, and a leaning jet takes more.
TEST(Swept, IsOneRegionAlongALineAndWiderWhereTheJetLeans) {
    std::vector<AxisPoint> axis;
    for (int i = 0; i <= 500; ++i) axis.push_back({i * 0.123457, i * 0.0456789});
    const double length = std::hypot(axis.back().x, axis.back().y);
    const Loops upright = swept(axis, 1);
    EXPECT_EQ(upright.size(), 1u);
    EXPECT_NEAR(area(upright), length + std::numbers::pi / 4, 0.03);
    for (AxisPoint& p : axis) p.lean_x = -0.0456789 * 4, p.lean_y = 0.123457 * 4;  // square to the line
    const double lean = 4 * std::hypot(0.123457, 0.0456789), wide = std::hypot(1, lean);
    EXPECT_NEAR(area(swept(axis, 1)), length * wide + std::numbers::pi / 4 * wide * wide, 0.05);
    EXPECT_TRUE(swept({}, 1).empty());
}

}  // namespace
}  // namespace slabwright
