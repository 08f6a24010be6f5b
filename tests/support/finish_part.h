// A part of the kind that FINISH's benchmark was: surfaces of different types, sharp edges of which none runs
// along an axis for long, holes in different directions.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <random>
#include <vector>

#include "tests/support/drilled_plate.h"

namespace slabwright::test {

/// Cells of 80 x 80 mm beside each other on a plate of 14 mm: a wavy dome on a star, a dish with a rim of
/// three waves, a pyramid of six sides that stands aslant; then four holes: 6 mm through and upright, 8 mm
/// blind with a drill's cone, 6 mm at 15° and 8 mm at 30° from the upright.
inline std::vector<std::array<Vec3f, 3>> finish_part() {
    constexpr double kPi = std::numbers::pi, kBreadth = 80, kPlate = 14;
    constexpr int kAround = 180, kRings = 30;
    std::mt19937 random(1);
    DrilledPlate plate(kBreadth, kPlate);
    const auto middle = [&](double width) { return LoopAxis{{plate.next_x() + width / 2, kBreadth / 2, 0}}; };
    // From the outline r(angle) down to the middle by rings of one shape, at the height over each of their
    // points.
    const auto outline = [&](const LoopAxis& axis, double share, auto radius, auto height) {
        Loop loop;
        for (int k = 0; k < kAround; ++k) {
            const double a = 2 * kPi * (k + 0.3) / kAround, r = share * radius(a);
            const double x = r * std::cos(a), y = r * std::sin(a);
            loop.push_back({axis.at[0] + x, axis.at[1] + y, height(x, y)});
        }
        return loop;
    };
    const auto freeform = [&](auto radius, auto height) {
        const LoopAxis axis = middle(80);
        std::vector<Loop> loops{outline(axis, 1, radius, [&](double, double) { return kPlate; })};
        for (int ring = 0; ring < kRings; ++ring)
            loops.push_back(outline(axis, 1 - static_cast<double>(ring) / kRings, radius, height));
        const Vec3d apex{axis.at[0], axis.at[1], height(0, 0)};
        plate.cell(80, axis, loops, &apex);
    };
    freeform([](double a) { return 29 + 3.5 * std::cos(5 * a + 0.4); },
             [](double x, double y) {
                 return 29 - 0.008 * (x * x + y * y) + 1.2 * std::sin(x / 7) * std::cos(y / 9);
             });
    freeform([](double a) { return 30 + 2.5 * std::cos(3 * a); },
             [](double x, double y) { return 4.5 + 0.004 * (x * x + y * y) + 0.8 * std::sin((x + y) / 11); });
    {
        const LoopAxis axis = middle(80);
        const std::vector<double> six = turn(6, 0.3, 0, random);
        const Vec3d apex{axis.at[0] + 5, axis.at[1] - 3, 34};
        plate.cell(80, axis, {axis.ring(six, 30, kPlate)}, &apex);
    }
    const std::vector<double> round = turn(120, 0.1, 0, random);
    LoopAxis axis = middle(30);
    plate.cell(30, axis, {axis.ring(round, 3, kPlate), axis.ring(round, 3, 0)}, nullptr);
    axis = middle(30);
    const Vec3d point{axis.at[0], axis.at[1], 6 - 4 / std::tan(59 * kPi / 180)};
    plate.cell(30, axis, {axis.ring(round, 4, kPlate), axis.ring(round, 4, 6)}, &point);
    for (const auto& [radius, tilt, towards] : {std::array{3.0, 15.0, 40.0}, {4.0, 30.0, 100.0}}) {
        const double t = tilt * kPi / 180, w = towards * kPi / 180;
        const Vec3d out{std::sin(t) * std::cos(w), std::sin(t) * std::sin(w), std::cos(t)};
        axis = LoopAxis::along({plate.next_x() + 15, kBreadth / 2, kPlate / 2}, out);
        plate.cell(30, axis, {axis.ring_at_z(round, radius, kPlate), axis.ring_at_z(round, radius, 0)},
                   nullptr);
    }
    return rounded(plate.closed());
}

}  // namespace slabwright::test
