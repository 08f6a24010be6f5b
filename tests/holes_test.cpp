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
    test::PlateFacets placed = facets;
    for (auto& facet : placed)
        for (Vec3d& p : facet) p = turned(turn, p);
    return weld(context, test::rounded(placed));
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
struct MadePlate {
    test::DrilledPlate plate;
    std::vector<Made> holes;
};

// One hole of random size and form in a cell of its own.
void drill(MadePlate& to, double height, double breadth, std::mt19937& random) {
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
    const double wide = form >= 3 && form <= 5 ? std::min(r * draw(1.3, 1.6), r + height / 2) : r;
    const double width = 2 * wide + draw(0.5, 12);
    const double x = to.plate.next_x() + width / 2, y = breadth / 2;
    LoopAxis axis{{x, y, 0}};
    const std::vector<double> angles = test::turn(n, draw(0, 1), jitter, random);
    // Every third wall of 16 sides or more has other corners below than above.
    const std::vector<double> lower =
        n >= 16 && pick(0, 2) == 0 ? test::turn(n + pick(0, 3), draw(0, 1), 0, random) : angles;
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
        MadePlate made{test::DrilledPlate(breadth, height), {}};
        for (int k = 0; k < 3; ++k) drill(made, height, breadth, random);
        leave_undrilled(made.plate, height, breadth, random);
        const Turn turn = i == 0 ? kAsItIs : random_turn(random);
        auto facets = made.plate.closed();
        if (i % 2 != 0) std::shuffle(facets.begin(), facets.end(), random);  // files have them in any order
        const Mesh mesh = mesh_of(context, facets, turn);
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

// A bore of eight sides, and a hole that comes from the block's side through one of them into the bore.
TEST(Holes, OneThatIsCutByTheMouthOfAnotherIsWhole) {
    std::mt19937 random(test::seed());
    Context context;
    const double half = 60, height = 50, radius = 40, small = 7;
    const LoopAxis bore{{0, 0, 0}};
    const std::vector<double> eight = test::turn(8, kPi / 8, 0, random);
    const test::Loop above = bore.ring(eight, radius, height), below = bore.ring(eight, radius, 0);
    const auto outline = [&](double z) {
        return test::Loop{{-half, -half, z}, {half, -half, z}, {half, half, z}, {-half, half, z}};
    };
    test::PlateFacets facets;
    const test::Loop top = outline(height), bottom = outline(0);
    test::strip(facets, bore, top, above);
    test::strip(facets, bore, below, bottom);
    for (std::size_t k = 0; k < 3; ++k)
        test::quad(facets, bottom[k == 0 ? 0 : k + 1], bottom[k == 0 ? 1 : (k + 2) % 4],
                   top[k == 0 ? 1 : (k + 2) % 4], top[k == 0 ? 0 : k + 1]);
    // The corners lie at odd multiples of 22.5°, so that the last side, between the last and the first, looks
    // along x.
    for (std::size_t k = 0; k < 7; ++k) test::quad(facets, above[k], above[k + 1], below[k + 1], below[k]);
    const double wall = radius * std::cos(kPi / 8);
    const LoopAxis cross_hole = LoopAxis::along({wall, 0, height / 2}, {-1, 0, 0});
    const std::vector<double> angles = test::turn(30, 0.02, 0, random);
    const test::Loop inner = cross_hole.ring(angles, small, 0);
    const test::Loop outer = cross_hole.ring(angles, small, wall - half);
    test::strip(facets, cross_hole, {above[7], above[0], below[0], below[7]}, inner);
    test::strip(facets, cross_hole, inner, outer);
    test::strip(facets, cross_hole, outer, {bottom[1], bottom[2], top[2], top[1]});
    for (int i = 0; i < 5; ++i) {
        const Turn turn = i == 0 ? kAsItIs : random_turn(random);
        const Mesh mesh = mesh_of(context, facets, turn);
        ASSERT_TRUE(test::closed(mesh.view()));
        const std::vector<RoundHole> found = find_holes(context, mesh.view());
        ASSERT_EQ(found.size(), 2u);
        const RoundHole &wide = found[0].diameter_mm > 20 ? found[0] : found[1],
                        &narrow = found[0].diameter_mm > 20 ? found[1] : found[0];
        EXPECT_NEAR(wide.diameter_mm, 2 * radius, 1e-3);
        EXPECT_NEAR(wide.depth_mm, height, 1e-3);
        EXPECT_NEAR(narrow.diameter_mm, 2 * small, 1e-3);
        EXPECT_NEAR(narrow.depth_mm, half - wall, 1e-3);
        EXPECT_NEAR(std::abs(dot(narrow.into, turned(turn, {1, 0, 0}))), 1, 1e-6);
        EXPECT_EQ(narrow.bottom, HoleBottom::open);
    }
}

TEST(Holes, SayWhereTheirMouthAndStepsAre) {
    std::mt19937 random(test::seed());
    Context context;
    test::DrilledPlate plate(40, 30);
    const std::vector<double> angles = test::turn(40, 0, 0, random);
    const LoopAxis axis{{20, 20, 0}};
    const Vec3d tip{20, 20, 10 - 0.6009 * 3};
    plate.cell(40, axis,
               {axis.ring(angles, 8, 30), axis.ring(angles, 8, 25), axis.ring(angles, 3, 25),
                axis.ring(angles, 3, 10)},
               &tip);
    const std::vector<RoundHole> found =
        find_holes(context, mesh_of(context, plate.closed(), kAsItIs).view());
    ASSERT_EQ(found.size(), 1u);
    const RoundHole& hole = found[0];
    EXPECT_EQ(hole.kind, HoleKind::counterbored);
    EXPECT_EQ(hole.bottom, HoleBottom::cone);
    EXPECT_NEAR(length(minus(hole.mouth, {20, 20, 30})), 0, 1e-4);
    EXPECT_NEAR(length(minus(hole.into, {0, 0, -1})), 0, 1e-6);
    ASSERT_EQ(hole.steps.size(), 3u);
    const double expected[3][4] = {{0, 5, 16, 16}, {5, 20, 6, 6}, {20, 20 + 0.6009 * 3, 6, 0}};
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(hole.steps[i].from_mm, expected[i][0], 1e-4) << i;
        EXPECT_NEAR(hole.steps[i].to_mm, expected[i][1], 1e-4) << i;
        EXPECT_NEAR(hole.steps[i].diameter_mm, expected[i][2], 1e-4) << i;
        EXPECT_NEAR(hole.steps[i].end_diameter_mm, expected[i][3], 1e-4) << i;
    }
    // Both walls, the shelf and the tip: 2·40 facets each, the tip 40.
    EXPECT_EQ(hole.facets.size(), 280u);
    EXPECT_NEAR(hole.chord_mm, 8 * (1 - std::cos(kPi / 40)), 1e-4);
    // A drill of 6 mm makes the lower wall and the tip, a plain hole that begins at the shelf.
    const std::optional<RoundHole> drilled = narrowest_part(hole);
    ASSERT_TRUE(drilled);
    EXPECT_EQ(drilled->kind, HoleKind::plain);
    EXPECT_EQ(drilled->bottom, HoleBottom::cone);
    EXPECT_NEAR(length(minus(drilled->mouth, {20, 20, 25})), 0, 1e-4);
    EXPECT_NEAR(drilled->depth_mm, 15 + 0.6009 * 3, 1e-4);
    EXPECT_NEAR(drilled->diameter_mm, 6, 1e-4);
    EXPECT_NEAR(drilled->chord_mm, 3 * (1 - std::cos(kPi / 40)), 1e-4);
    EXPECT_EQ(drilled->facets.size(), 120u);
    ASSERT_EQ(drilled->steps.size(), 2u);
    EXPECT_NEAR(drilled->steps[0].from_mm, 0, 1e-9);
    EXPECT_NEAR(drilled->steps[0].to_mm, 15, 1e-4);
    EXPECT_NEAR(drilled->steps[1].to_mm, 15 + 0.6009 * 3, 1e-4);
}

TEST(Holes, AreListedFrom1To150Millimetres) {
    std::mt19937 random(test::seed());
    Context context;
    test::DrilledPlate plate(170, 30);
    const std::vector<double> angles = test::turn(160, 0, 0, random);
    for (const double diameter : {0.98, 1.02, 149.5, 150.5}) {
        const LoopAxis axis{{plate.next_x() + 85, 85, 0}};
        plate.cell(170, axis, {axis.ring(angles, diameter / 2, 30), axis.ring(angles, diameter / 2, 0)},
                   nullptr);
    }
    const std::vector<RoundHole> found =
        find_holes(context, mesh_of(context, plate.closed(), kAsItIs).view());
    ASSERT_EQ(found.size(), 2u);
    EXPECT_NEAR(found[0].diameter_mm, 1.02, 2e-3);
    EXPECT_NEAR(found[1].diameter_mm, 149.5, 2e-3);
}

TEST(Holes, RefuseDiametersOutOfOrder) {
    Context context;
    for (const HoleOptions& options :
         {HoleOptions{0, 10, 0}, HoleOptions{5, 5, 0}, HoleOptions{1, HUGE_VAL, 0}, HoleOptions{1, 9, -1}}) {
        try {
            (void)find_holes(context, MeshView{}, options);
            ADD_FAILURE();
        } catch (const Error& error) {
            EXPECT_EQ(error.code(), "holes.options");
        }
    }
    EXPECT_TRUE(find_holes(context, MeshView{}).empty());
}

// Counted by hand in sections: the cover's flange has 8 and its dome 1, the mould's plate 3, all with a
// shelf; the housing has 17 in its foot, 10 blind ones in each of two pads and 1 that is askew.
TEST(HolesCorpus, AsManyAsOneCounts) {
    const char* corpus = std::getenv("SLABWRIGHT_CORPUS");
    if (corpus == nullptr) GTEST_SKIP() << "SLABWRIGHT_CORPUS is not set";
    struct Counted {
        const char* file;
        std::size_t upright, askew;
        HoleKind kind;
    };
    for (const Counted& part : {Counted{"casting_cover.stl", 9, 0, HoleKind::plain},
                                Counted{"mold_cavity_ktool.stl", 3, 0, HoleKind::counterbored},
                                Counted{"machine_housing_TR12J.stl", 17, 21, HoleKind::plain}}) {
        SCOPED_TRACE(part.file);
        std::ifstream in(std::filesystem::path(corpus) / "castings" / part.file, std::ios::binary);
        const std::string bytes((std::istreambuf_iterator<char>(in)), {});
        ASSERT_GT(bytes.size(), 84u);
        std::uint32_t count = 0;
        std::memcpy(&count, &bytes[80], 4);
        ASSERT_EQ(bytes.size(), 84 + std::size_t{50} * count);
        std::vector<std::array<Vec3f, 3>> corners(count);
        for (std::uint32_t i = 0; i < count; ++i)
            std::memcpy(&corners[i], &bytes[84 + std::size_t{50} * i + 12], 36);
        Context context;
        const Mesh mesh = weld(context, corners);
        std::size_t upright = 0, askew = 0;
        for (const RoundHole& hole : find_holes(context, mesh.view())) {
            ++(hole.into[2] < -0.99999 ? upright : askew);
            EXPECT_EQ(hole.kind, part.kind);
        }
        EXPECT_EQ(upright, part.upright);
        EXPECT_EQ(askew, part.askew);
    }
}

}  // namespace
}  // namespace slabwright
