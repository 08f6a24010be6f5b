// The time of many legs told one after the other against the same rules over all of them at once.
#include "engine/schedule/motion_time.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "tests/support/seed.h"

using namespace slabwright;

namespace {

/// Backwards over all legs, then forwards.
double reference_seconds(const std::vector<MotionLeg>& legs, double a, double junction_mm) {
    std::vector<double> entry(legs.size() + 1, 0);
    for (std::size_t i = 1; i < legs.size(); ++i) {
        const auto &u = legs[i - 1].leaving, &v = legs[i].direction;
        const double cosine = std::clamp(u[0] * v[0] + u[1] * v[1] + u[2] * v[2], -1.0, 1.0),
                     half = std::sqrt((1 + cosine) / 2);
        double corner = 1e9;
        if (half < 1 - 1e-12) {
            const double touches = std::min(legs[i - 1].length, legs[i].length) / 2;
            corner = std::sqrt(
                a * std::min(junction_mm * half / (1 - half), touches * half / std::sqrt(1 - half * half)));
        }
        entry[i] = std::min({corner, legs[i - 1].speed, legs[i].speed});
    }
    for (std::size_t i = legs.size(); i-- > 0;)
        entry[i] = std::min(entry[i], std::sqrt(entry[i + 1] * entry[i + 1] + 2 * a * legs[i].length));
    double seconds = 0, v = 0;
    for (std::size_t i = 0; i < legs.size(); ++i) {
        const double length = legs[i].length, out = std::min(entry[i + 1], std::sqrt(v * v + 2 * a * length));
        const double peak = std::min(legs[i].speed, std::sqrt((2 * a * length + v * v + out * out) / 2));
        const double ramps = (2 * peak * peak - v * v - out * out) / (2 * a);
        seconds += (2 * peak - v - out) / a + std::max(0.0, length - ramps) / std::max(peak, 1e-9);
        v = out;
    }
    return seconds;
}

}  // namespace

TEST(Travel, LegByLegIsAllAtOnce) {
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    for (const std::size_t count : {0, 1, 2, 1023, 1024, 1025, 1026, 5000, 60000})
        // From legs on which nobody reaches his speed, in gentle turns, to long ones in sharp turns.
        for (const double size : {0.001, 0.05, 1.0, 30.0}) {
            const double acceleration = 200 + 2000 * unit(random), turn = size < 0.5 ? 0.02 : 1;
            std::vector<MotionLeg> legs;
            double heading = 0;
            Travel travel(acceleration);
            for (std::size_t i = 0; i < count; ++i) {
                heading +=
                    turn * (2 * unit(random) - 1) * (unit(random) < 0.01 ? std::numbers::pi / turn : 1);
                legs.push_back(
                    {size * unit(random), 1 + 150 * unit(random), {std::cos(heading), std::sin(heading), 0}});
                legs.back().leaving = legs.back().direction;
                travel.add(legs.back());
                if (i % 7 == 0) travel.add({0, 1, {0, 0, 1}});  // passed over
            }
            const double expected = reference_seconds(legs, acceleration, kJunction);
            EXPECT_EQ(travel.seconds(), expected) << "seed " << seed << " legs " << count << " of " << size;
            EXPECT_EQ(travel_seconds(legs, acceleration), expected);
            // Begins anew.
            for (const MotionLeg& leg : legs) travel.add(leg);
            EXPECT_EQ(travel.seconds(), expected);
            EXPECT_EQ(travel.seconds(), 0);
        }
}

// However fine the chords of a circle are, they are run no faster than v² = a·r; coarse ones no faster than
// their corners bear.
TEST(Travel, ChordsAreRunNoFasterThanTheirCircle) {
    const double acceleration = 1000, radius = 6, feed = 150, blend = 0.1,
                 bears = std::sqrt(acceleration * radius);
    auto seconds = [&](int chords) {
        std::vector<MotionLeg> legs;
        const int turns = 20;
        for (int k = 0; k < turns * chords; ++k) {
            const double heading = 2 * std::numbers::pi * k / chords;
            legs.push_back({2 * radius * std::sin(std::numbers::pi / chords),
                            feed,
                            {std::cos(heading), std::sin(heading), 0}});
            legs.back().leaving = legs.back().direction;
        }
        return travel_seconds(legs, acceleration, blend) / turns;
    };
    const double circle = 2 * std::numbers::pi * radius / bears;
    for (const int chords : {20, 30, 100, 1000}) {
        EXPECT_GT(seconds(chords), 0.9 * circle) << chords << ": but for what is gained between corners";
        EXPECT_LT(seconds(chords), 1.03 * circle) << chords << ": they leave it by no more than the blend";
    }
    EXPECT_GT(seconds(8), 1.3 * circle) << "they leave it by 0.46 mm";
}
