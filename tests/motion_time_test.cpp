// The time of many legs told one after the other against the same rules over all of them at once.
#include "engine/moves/motion_time.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "engine/moves/feed_lengths.h"
#include "tests/support/seed.h"

using namespace slabwright;

namespace {

struct Stretch {
    double length, speed, acceleration, entry;
};

/// Three axes that do the same.
AxisLimits alike(double acceleration) {
    return {{1000, 1000, 1000}, {acceleration, acceleration, acceleration}};
}

/// All stretches of level, straight legs as Travel documents them, then backwards over all of them, then
/// forwards.
double reference_seconds(std::vector<MotionLeg> legs, const AxisLimits& axes, double junction_mm) {
    const double dt = 0.001, share = std::sqrt(0.75);
    const double a = std::min(axes.acceleration[0], axes.acceleration[1]);
    const auto along = [&](double v, double r) {
        return a * std::sqrt(std::max(0.0, 1 - std::pow(v * v / (r * a), 2)));
    };
    const auto straight = [](const std::array<double, 3>& most, const MotionLeg& leg) {
        return std::min(most[0] / std::abs(leg.direction[0]), most[1] / std::abs(leg.direction[1]));
    };
    for (MotionLeg& leg : legs)
        leg.speed = std::min({leg.speed, leg.length / (1.02 * dt), straight(axes.speed, leg)});
    std::vector<Stretch> all;
    double taken = 0, entry = 0;
    for (std::size_t i = 0; i < legs.size(); ++i) {
        const MotionLeg& leg = legs[i];
        const double own = straight(axes.acceleration, leg);
        if (i + 1 == legs.size()) {
            all.push_back({std::max(0.0, leg.length - taken), leg.speed, own / 2, entry});
            break;
        }
        const MotionLeg& next = legs[i + 1];
        double cosine = 0, step = 0, speed = 0, setback = 0, arc = 0, arc_acceleration = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            cosine += leg.leaving[k] * next.direction[k];
            step = std::max(step, std::abs(next.direction[k] - leg.leaving[k]) / axes.acceleration[k]);
        }
        cosine = std::clamp(cosine, -1.0, 1.0);
        if (leg.rapid == next.rapid) {
            const double slower = std::min(leg.speed, next.speed),
                         kink = step * (slower / dt + std::max(own, straight(axes.acceleration, next)));
            const double c = std::sqrt((1 + cosine) / 2), s = std::sqrt((1 - cosine) / 2);
            if (kink <= 0.1) speed = slower;
            else if (c > std::sin(std::numbers::pi / 180)) speed = slower * 0.1 / kink;
            if (kink > 0.1 && c > std::sin(std::numbers::pi / 180)) {
                const double d = std::min({leg.length / 2, next.length / 2, s * junction_mm / (1 - c)});
                const double widest = d * c / s, turn = 2 * std::asin(s);
                const double v = std::min({std::max(leg.speed, next.speed), std::sqrt(share * a * widest),
                                           axes.speed[0], axes.speed[1]});
                const double ramp = std::min(v, std::sqrt(a * d)) / (a / 2) * v;
                const double r = std::max(v * v / (share * a), std::min(ramp / turn, widest));
                if (const double w = std::min(v, r * turn / (1.02 * dt)); w > speed) {
                    speed = w;
                    setback = r * s / c;
                    arc = r * turn;
                    arc_acceleration = along(w, r);
                }
            }
        }
        const double left = std::max(0.0, leg.length - taken - setback);
        const bool consumed = arc > 0 && left < 4 * dt * speed;
        if (!consumed) all.push_back({left, leg.speed, own, entry});
        if (arc > 0)
            all.push_back({arc + (consumed ? left : 0), speed, arc_acceleration,
                           std::min({speed, leg.speed, consumed ? entry : leg.speed})});
        entry = arc > 0 ? std::min(speed, next.speed) : std::min({speed, leg.speed, next.speed});
        taken = setback;
    }
    const std::size_t n = all.size();
    std::vector<double> at(n + 1, 0);
    for (std::size_t i = n; i-- > 0;)
        at[i] = std::min(all[i].entry,
                         std::sqrt(at[i + 1] * at[i + 1] + 2 * all[i].acceleration * all[i].length));
    for (std::size_t i = 0; i + 50 <= n; ++i) {
        double square = 0;
        for (std::size_t k = i; k < i + 50; ++k) square += 2 * all[k].acceleration * all[k].length;
        at[i] = std::min(at[i], std::sqrt(square));
    }
    double seconds = 0, v = 0;
    for (std::size_t i = 0; i < n; ++i) {
        const auto [length, speed, acceleration, first] = all[i];
        const double out = std::min(at[i + 1], std::sqrt(v * v + 2 * acceleration * length));
        const double peak = std::max(
            {v, out, std::min(speed, std::sqrt((2 * acceleration * length + v * v + out * out) / 2))});
        const double ramps =
            acceleration > 0 ? (2 * peak * peak - v * v - out * out) / (2 * acceleration) : 0;
        if (acceleration > 0) seconds += (2 * peak - v - out) / acceleration;
        seconds += std::max(0.0, length - ramps) / std::max(peak, 1e-9);
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
            const double turn = size < 0.5 ? 0.02 : 1;
            const auto draw = [&](double least, double more) { return least + more * unit(random); };
            const AxisLimits axes{{draw(50, 150), draw(50, 150), 1},
                                  {draw(200, 2000), draw(200, 2000), draw(20, 2000)}};
            std::vector<MotionLeg> legs;
            double heading = 0;
            Travel travel(axes);
            for (std::size_t i = 0; i < count; ++i) {
                heading +=
                    turn * (2 * unit(random) - 1) * (unit(random) < 0.01 ? std::numbers::pi / turn : 1);
                legs.push_back(
                    {size * unit(random), 1 + 150 * unit(random), {std::cos(heading), std::sin(heading), 0}});
                legs.back().leaving = legs.back().direction;
                travel.add(legs.back());
                if (i % 7 == 0) travel.add({0, 1, {0, 0, 1}});  // passed over
            }
            const double expected = reference_seconds(legs, axes, kJunction);
            EXPECT_NEAR(travel.seconds(), expected, 1e-9 * expected)
                << "seed " << seed << " legs " << count << " of " << size;
            EXPECT_NEAR(travel_seconds(legs, axes), expected, 1e-9 * expected);
            // Begins anew.
            for (const MotionLeg& leg : legs) travel.add(leg);
            EXPECT_NEAR(travel.seconds(), expected, 1e-9 * expected);
            EXPECT_EQ(travel.seconds(), 0);
        }
}

// However fine the chords of a circle are, they are run no faster than v² = a·r; coarse ones no faster than
// their corners bear.
TEST(Travel, ChordsAreRunNoFasterThanTheirCircle) {
    const double acceleration = 1000, radius = 6, feed = 150, blend = 0.1,
                 bears = std::sqrt(std::sqrt(0.75) * acceleration * radius);
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
        return travel_seconds(legs, alike(acceleration), blend) / turns;
    };
    const double circle = 2 * std::numbers::pi * radius / bears;
    for (const int chords : {20, 30, 100}) {
        EXPECT_GT(seconds(chords), 0.9 * circle) << chords << ": but for what is gained between corners";
        EXPECT_LT(seconds(chords), 1.03 * circle) << chords << ": they leave it by no more than the blend";
    }
    EXPECT_GT(seconds(1000), 1.05 * circle) << "50 of them are too short to stop on";
    EXPECT_GT(seconds(8), 1.3 * circle) << "they leave it by 0.46 mm";
}

// A level arc turns through both axes: the slower one is no faster on it than it is.
TEST(FeedLength, OfAStraightMoveStandsInItsMiddle) {
    const FeedLength way = straight_length(1200, {1, 2, 4}, {4, 2, 8});
    EXPECT_EQ(way.feed, 1200);
    EXPECT_DOUBLE_EQ(way.mm, 5);
    for (const auto& [k, middle] : {std::pair{0, 2.5}, {1, 2.0}, {2, 6.0}})
        EXPECT_DOUBLE_EQ(way.moment[static_cast<std::size_t>(k)], 5 * middle) << k;
}

TEST(Travel, AnArcIsRunNoFasterThanItsSlowerAxis) {
    for (const std::size_t slow : {0U, 1U}) {
        AxisLimits axes = alike(1000);
        axes.speed[slow] = 50;
        MotionLeg leg{1000, 200, {1, 0, 0}};
        leg.leaving = {1, 0, 0};
        leg.radius = 1000;
        const double seconds = travel_seconds(std::array{leg}, axes);
        EXPECT_GT(seconds, 1000 / 50.0) << slow;
        EXPECT_LT(seconds, 1000 / 50.0 + 0.2) << slow << ": but for its ramps";
    }
}
