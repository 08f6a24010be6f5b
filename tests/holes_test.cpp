#include "kernels/features/holes.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <numbers>
#include <random>

#include "kernels/errors.h"
#include "kernels/mesh/weld.h"
#include "tests/support/closed_mesh.h"
#include "tests/support/drilled_plate.h"
#include "tests/support/seed.h"

namespace slabwright {
namespace {

using test::LoopAxis;
constexpr double kPi = std::numbers::pi;

// A rotation, as three rows.
using Turn = std::array<Vec3d, 3>;
Vec3d turned(const Turn& t, const Vec3d& p) { return {dot(t[0], p), dot(t[1], p), dot(t[2], p)}; }
Turn random_turn(std::mt19937& random) {
    std::normal_distribution<double> normal;
    Vec3d a{normal(random), normal(random), normal(random)},
        b{normal(random), normal(random), normal(random)};
    a = scaled(1 / length(a), a);
    b = plus(b, a, -dot(a, b));
    b = scaled(1 / length(b), b);
    return {a, b, cross(a, b)};
}

Mesh mesh_of(Context& context, const test::PlateFacets& facets, const Turn& turn) {
    std::vector<std::array<Vec3f, 3>> corners;
    for (const auto& facet : facets) {
        std::array<Vec3f, 3> rounded;
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3d p = turned(turn, facet[k]);
            rounded[k] = {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])};
        }
        corners.push_back(rounded);
    }
    return weld(context, corners);
}

constexpr Turn kAsItIs{Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}};

// What a hole was made as.
struct Made {
    HoleKind kind{};
    HoleBottom bottom{};
    Vec3d middle{}, axis{};  // of the narrowest cylinder's mouth
    double diameter = 0, widest = 0;
    int sides = 0;
    int form = 0;  // the case in drill()
};

// A plate, with what was made into it.
struct Made_plate {
    test::DrilledPlate plate;
    std::vector<Made> holes;
};

// One hole of random size and form in a cell of its own.
void drill(Made_plate& to, double height, double breadth, std::mt19937& random) {
    const auto draw = [&](double a, double b) {
        return std::uniform_real_distribution<double>(a, b)(random);
    };
    const auto pick = [&](int a, int b) { return std::uniform_int_distribution<int>(a, b)(random); };
    // Small ones as often as large ones, few sides as often as many.
    const double diameter = 3 * std::pow(80.0 / 3, draw(0, 1)), r = diameter / 2;
    const int n = static_cast<int>(std::round(8 * std::pow(25, draw(0, 1))));
    const double jitter = n >= 16 && pick(0, 1) == 1 ? 0.3 : 0;
    Made made{HoleKind::plain, HoleBottom::open, {}, {}, diameter, diameter, n};
    const int form = pick(0, 6);
    const double wide = form == 3 || form == 4 || form == 5 ? r * draw(1.3, 1.6) : r;
    const double width = 2 * wide + draw(0.5, 12);
    const double x = to.plate.next_x() + width / 2, y = breadth / 2;
    LoopAxis axis{{x, y, 0}};
    const std::vector<double> angles = test::turn(n, draw(0, 1), jitter, random);
    // Every third wall of 12 sides or more has other corners below than above.
    const std::vector<double> lower =
        n >= 12 && pick(0, 2) == 0 ? test::turn(n + pick(0, 3), draw(0, 1), 0, random) : angles;
    std::vector<test::Loop> loops;
    const double depth = height * draw(0.4, 0.8);
    Vec3d apex{x, y, height - depth};
    const Vec3d* end = nullptr;
    switch (form) {
        case 0:  // through
            loops = {axis.ring(angles, r, height), axis.ring(lower, r, 0)};
            break;
        case 1:  // blind and flat
            loops = {axis.ring(angles, r, height), axis.ring(lower, r, height - depth)};
            end = &apex;
            made.bottom = HoleBottom::flat;
            break;
        case 2:  // blind, as a drill of 118° leaves it
            loops = {axis.ring(angles, r, height), axis.ring(angles, r, height - depth / 2)};
            apex[2] = height - depth / 2 - std::min(0.6009 * r, 0.45 * height);
            end = &apex;
            made.bottom = HoleBottom::cone;
            break;
        case 3:  // counterbored
            loops = {axis.ring(angles, wide, height), axis.ring(angles, wide, height - depth),
                     axis.ring(lower, r, height - depth), axis.ring(lower, r, 0)};
            made.kind = HoleKind::counterbored;
            break;
        case 4:  // countersunk
            loops = {axis.ring(angles, wide, height), axis.ring(angles, r, height - (wide - r)),
                     axis.ring(angles, r, 0)};
            made.kind = HoleKind::countersunk;
            break;
        case 5:  // three diameters, blind
            loops = {axis.ring(angles, wide, height),
                     axis.ring(angles, wide, height * 0.8),
                     axis.ring(angles, 0.85 * wide + 0.15 * r, height * 0.8),
                     axis.ring(angles, 0.85 * wide + 0.15 * r, height * 0.5),
                     axis.ring(angles, r, height * 0.5),
                     axis.ring(angles, r, height * 0.1)};
            apex[2] = height * 0.1;
            end = &apex;
            made.kind = HoleKind::stepped;
            made.bottom = HoleBottom::flat;
            break;
        default: {  // through and slanted, across y, where there is room
            const double slant = std::min(0.6, (breadth / 2 - 1.2 * r) / height);
            axis = LoopAxis::along({x, y - slant * height / 2, 0}, {0, slant, 1});
            loops = {axis.ring_at_z(angles, r, height), axis.ring_at_z(angles, r, 0)};
        }
    }
    made.widest = 2 * wide;
    made.middle = axis.at;
    made.axis = axis.out;
    to.plate.cell(width, axis, loops, end);
    made.form = form;
    to.holes.push_back(made);
}

// Cells with what is no hole: boss, dome, bowl, slot, pocket with round corners, taper, boss in a pocket,
// hexagon.
void leave_undrilled(test::DrilledPlate& plate, double height, double breadth, std::mt19937& random) {
    const int n = std::uniform_int_distribution<int>(12, 90)(random);
    const std::vector<double> all = test::turn(n, 0.1, 0, random), six = test::turn(6, 0.1, 0, random);
    const auto cell = [&](const std::function<std::vector<test::Loop>(const LoopAxis&)>& loops_of,
                          double up) {
        const LoopAxis axis{{plate.next_x() + 20, breadth / 2, 0}};
        const Vec3d apex = plus(axis.at, axis.out, up);
        plate.cell(40, axis, loops_of(axis), &apex);
    };
    cell(
        [&](const LoopAxis& a) -> std::vector<test::Loop> {
            return {a.ring(all, 10, height), a.ring(all, 10, height + 12)};
        },
        height + 12);
    for (const double way : {1.0, -1.0})  // a dome and a bowl
        cell(
            [&](const LoopAxis& a) {
                std::vector<test::Loop> loops;
                for (double t = 0; t < 85; t += 4.5)
                    loops.push_back(
                        a.ring(all, 9 * std::cos(t * kPi / 180), height + way * 9 * std::sin(t * kPi / 180)));
                return loops;
            },
            height + way * 9);
    const auto pocket = [&](double half_x, double half_y, double corner) {
        return [=](const LoopAxis& a) {
            std::vector<test::Loop> loops(2);
            for (int i = 0; i < 2; ++i)
                for (int k = 0; k < 4 * 8; ++k) {
                    const double angle = kPi / 2 * (k / 8) + kPi / 2 * (k % 8) / 7;
                    const double sx = k / 8 == 0 || k / 8 == 3 ? 1 : -1, sy = k / 8 < 2 ? 1 : -1;
                    if (half_x == corner && k % 8 == 7 && k / 8 % 2 == 0) continue;
                    if (half_x == corner && k % 8 == 0 && k / 8 % 2 == 1 && half_y == corner) continue;
                    loops[static_cast<std::size_t>(i)].push_back(
                        {a.at[0] + sx * (half_x - corner) + corner * std::cos(angle),
                         a.at[1] + sy * (half_y - corner) + corner * std::sin(angle),
                         i == 0 ? height : height / 2});
                }
            return loops;
        };
    };
    cell(pocket(6, 13, 6), height / 2);
    cell(pocket(10, 14, 4), height / 2);
    cell(
        [&](const LoopAxis& a) -> std::vector<test::Loop> {  // a draft of 4°
            return {a.ring(all, 10, height), a.ring(all, 10 - 0.07 * height / 2, height / 2)};
        },
        height / 2);
    cell(
        [&](const LoopAxis& a) -> std::vector<test::Loop> {
            return {a.ring(all, 14, height), a.ring(all, 14, height / 2), a.ring(all, 6, height / 2),
                    a.ring(all, 6, height)};
        },
        height);
    cell(
        [&](const LoopAxis& a) -> std::vector<test::Loop> {
            return {a.ring(six, 10, height), a.ring(six, 10, height / 3)};
        },
        height / 3);
}

void expect_found(const Made& made, const std::vector<RoundHole>& found, const Turn& turn) {
    const Vec3d axis = turned(turn, made.axis), middle = turned(turn, made.middle);
    int matches = 0;
    for (const RoundHole& hole : found) {
        const Vec3d d = minus(hole.mouth, middle);
        if (length(plus(d, axis, -dot(d, axis))) > 0.3 * made.diameter) continue;
        ++matches;
        EXPECT_LT(std::asin(std::min(1.0, length(cross(hole.into, axis)))) * 180 / kPi, 0.1);
        const double chord = made.diameter / 2 * (1 - std::cos(kPi / made.sides));
        EXPECT_NEAR(hole.diameter_mm, made.diameter, std::max(2 * chord, 1e-3));
        EXPECT_NEAR(hole.diameter_mm, made.diameter, 2e-3);
        EXPECT_EQ(name(hole.kind), name(made.kind));
        EXPECT_EQ(name(hole.bottom), name(made.bottom));
        EXPECT_NEAR(hole.steps.front().diameter_mm, made.widest, 2e-3);
        if (made.bottom != HoleBottom::open) {
            EXPECT_LT(dot(hole.into, axis), 0);
        }
    }
    EXPECT_EQ(matches, 1);
}

TEST(Holes, SixtyAtAnyAxisAreFoundAndNothingElse) {
    std::mt19937 random(test::seed());
    Context context;
    std::size_t holes = 0;
    for (int i = 0; i < 20; ++i) {
        const double height = std::uniform_real_distribution<double>(12, 60)(random), breadth = 150;
        Made_plate made{test::DrilledPlate(breadth, height), {}};
        for (int k = 0; k < 3; ++k) drill(made, height, breadth, random);
        leave_undrilled(made.plate, height, breadth, random);
        const Turn turn = i == 0 ? kAsItIs : random_turn(random);
        const Mesh mesh = mesh_of(context, made.plate.closed(), turn);
        ASSERT_TRUE(test::closed(mesh.view()));
        const std::vector<RoundHole> found = find_holes(context, mesh.view());
        for (std::size_t h = 0; h < made.holes.size(); ++h) {
            SCOPED_TRACE(fmt::format("plate {} hole {}: form {} d {} sides {} height {}", i, h,
                                     made.holes[h].form, made.holes[h].diameter, made.holes[h].sides,
                                     height));
            expect_found(made.holes[h], found, turn);
        }
        EXPECT_EQ(found.size(), made.holes.size()) << "plate " << i;
        holes += made.holes.size();
    }
    EXPECT_EQ(holes, 60u);
}

}  // namespace
}  // namespace slabwright
