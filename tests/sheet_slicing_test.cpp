// Parting a solid into sheets: print's counts, and the dynamic program beside print on random solids.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "engine/sheets/sheet_slicing.h"
#include "kernels/errors.h"
#include "kernels/polygons/border_distance.h"
#include "kernels/slicing/slicing.h"
#include "tests/support/closed_mesh.h"
#include "tests/support/loft.h"
#include "tests/support/seed.h"

namespace slabwright {
namespace {

using support::circle;
using support::loft;
using support::Ring;
using support::turned;

constexpr double kIn = 25.4;

/// FDFF's first example: sheets of .025, .1 and .2 in, .0045 in² and 4 %.
SheetRules print_rules() {
    SheetRules rules;
    rules.thicknesses = {0.025 * kIn, 0.1 * kIn, 0.2 * kIn};
    rules.strategy = SheetStrategy::printed;
    rules.triangle_mm2 = 0.0045 * kIn * kIn;
    rules.area_percent = 4;
    return rules;
}

std::vector<int> counts(const SheetStack& stack, std::size_t thicknesses) {
    std::vector<int> n(thicknesses, 0);
    for (const SheetSpan& span : stack.sheets) ++n[static_cast<std::size_t>(span.stock)];
    return n;
}

void expect_stacked(const SheetStack& stack, const SheetRules& rules) {
    double z = 0;
    for (const SheetSpan& span : stack.sheets) {
        EXPECT_NEAR(span.bottom, z, 1e-3);
        EXPECT_NEAR(span.top - span.bottom, rules.thicknesses[static_cast<std::size_t>(span.stock)], 1e-9);
        z = span.top + rules.bond;
    }
}

// FDFF figure 4.13: a prism of .575 in, then .425 in whose notched corners change its area but no extent.
TEST(SheetSlicing, FdffExample1Has23Sheets) {
    Context context;
    std::vector<Ring> rings;
    const auto notched = [](double z, double c) {
        Ring ring{z * kIn, {}};
        const double in = (1 - c) * kIn, out = kIn;
        for (const auto& p : {std::array{out, -in},
                              {out, in},
                              {in, in},
                              {in, out},
                              {-in, out},
                              {-in, in},
                              {-out, in},
                              {-out, -in},
                              {-in, -in},
                              {-in, -out},
                              {in, -out},
                              {in, -in}})
            ring.points.push_back(p);
        return ring;
    };
    rings.push_back(notched(0, 0.01));
    for (int k = 0; k <= 17; ++k)
        rings.push_back(notched(0.575 + 0.025 * k, std::sqrt(1 - 0.9999 * std::pow(0.95, k))));
    const Mesh mesh = loft(context, rings);
    ASSERT_TRUE(test::closed(mesh.view()));
    const SheetStack stack = stack_of_sheets(context, mesh.view(), print_rules());
    EXPECT_EQ(stack.sheets.size(), 23u);
    EXPECT_EQ(counts(stack, 3), (std::vector<int>{20, 1, 2}));
    EXPECT_EQ(stack.sheets[0].stock, 2);
    EXPECT_EQ(stack.sheets[1].stock, 2);
    EXPECT_EQ(stack.sheets[2].stock, 1);
    EXPECT_NEAR(stack.sheets.back().top, kIn, 1e-3);
    EXPECT_EQ(stack.left_on_top, 0);
    expect_stacked(stack, print_rules());
}

TEST(SheetSlicing, FdffCountsOfSimpleSolids) {
    Context context;
    const auto printed = [&](double height, int rings, const std::function<double(double)>& radius,
                             double area_percent = 4) {
        SheetRules rules = print_rules();
        rules.area_percent = area_percent;
        const Mesh mesh =
            turned(context, height * kIn, rings, 96, [&](double z) { return kIn * radius(z / kIn); });
        return counts(stack_of_sheets(context, mesh.view(), rules), 3);
    };
    EXPECT_EQ(printed(1, 1, [](double) { return 1.0; }), (std::vector<int>{0, 0, 5}));
    EXPECT_EQ(printed(0.175, 1, [](double) { return 1.0; }), (std::vector<int>{3, 1, 0}));
    EXPECT_EQ(printed(1, 40, [](double z) { return 1 - z; }), (std::vector<int>{40, 0, 0}));
    const auto sphere = [](double z) { return std::sqrt(std::max(0.0, 1 - z * z)); };
    EXPECT_EQ(printed(1, 40, sphere), (std::vector<int>{32, 0, 1}));
    const std::vector<int> by_triangles = printed(1, 40, sphere, 1e9);
    EXPECT_EQ(by_triangles[0] + by_triangles[1] + by_triangles[2], 21);
}

// The form of FDFF table 4.1: layers of one thickness beside layers of several.
TEST(SheetSlicing, AdaptiveSavesSheetsBesideUniform) {
    Context context;
    const Mesh mesh = loft(context, {circle(0, 40, 48), circle(30 * 0.635, 40, 48),
                                     circle(38 * 0.635, 30, 48), circle(67 * 0.635, 30, 48)});
    SheetRules rules = print_rules();
    const SheetStack adaptive = stack_of_sheets(context, mesh.view(), rules);
    rules.strategy = SheetStrategy::uniform;
    const SheetStack uniform = stack_of_sheets(context, mesh.view(), rules);
    rules.strategy = SheetStrategy::optimal;
    const SheetStack optimal = stack_of_sheets(context, mesh.view(), rules);
    std::printf("  uniform %zu sheets, stair %.0f mm3; printed %zu, %.0f; optimal %zu, %.0f\n",
                uniform.sheets.size(), uniform.stair_mm3, adaptive.sheets.size(), adaptive.stair_mm3,
                optimal.sheets.size(), optimal.stair_mm3);
    EXPECT_EQ(uniform.sheets.size(), 67u);
    EXPECT_LT(adaptive.sheets.size(), 25u);
    EXPECT_LE(optimal.sheets.size(), adaptive.sheets.size());
    EXPECT_LE(optimal.stair_mm3, adaptive.stair_mm3 + 1e-6);
}

// 3 + 3 + 3 + 5 makes 14; the thickest that fit in 9 and in what is left of it make 13.
TEST(SheetSlicing, GreedyFittingLeavesWhatTheProgramCovers) {
    Context context;
    const Mesh mesh = turned(context, 14, 1, 24, [](double) { return 20.0; });
    SheetRules rules;
    rules.thicknesses = {3, 5, 10};
    rules.strategy = SheetStrategy::printed;
    EXPECT_NEAR(stack_of_sheets(context, mesh.view(), rules).left_on_top, 1, 1e-5);
    rules.strategy = SheetStrategy::optimal;
    const SheetStack stack = stack_of_sheets(context, mesh.view(), rules);
    EXPECT_EQ(stack.left_on_top, 0);
    EXPECT_EQ(counts(stack, 3), (std::vector<int>{3, 1, 0}));
}

// However small an outline is, it is told from others by what it overlaps.
TEST(SheetSlicing, AThinPinTakesTheThickestSheets) {
    Context context;
    const Mesh pin = loft(context, {circle(0, 0.4, 48), circle(0.2 * kIn, 0.4, 48)});
    EXPECT_EQ(counts(stack_of_sheets(context, pin.view(), print_rules()), 3), (std::vector<int>{0, 0, 1}));
}

TEST(SheetSlicing, BondLiesBetweenSheets) {
    Context context;
    const Mesh mesh = turned(context, 4 * 6 + 3 * 0.2, 1, 24, [](double) { return 20.0; });
    for (const SheetStrategy strategy :
         {SheetStrategy::uniform, SheetStrategy::printed, SheetStrategy::optimal}) {
        SheetRules rules;
        rules.thicknesses = {6};
        rules.bond = 0.2;
        rules.strategy = strategy;
        const SheetStack stack = stack_of_sheets(context, mesh.view(), rules);
        EXPECT_EQ(stack.sheets.size(), 4u);
        EXPECT_LT(stack.left_on_top, 1e-3);
        expect_stacked(stack, rules);
    }
}

/// Polygons that grow, shrink, shift and turn: what extents and areas see, and what they do not.
Mesh random_solid(Context& context, std::mt19937& random, int steps, double step) {
    std::uniform_real_distribution<double> unit(0, 1);
    const int n = 5 + static_cast<int>(random() % 4);
    std::vector<double> radii;
    for (int i = 0; i < n; ++i) radii.push_back(15 + 15 * unit(random));
    std::vector<Ring> rings;
    double x = 0, y = 0, turn = 0, size = 1;
    const auto put = [&](double z) {
        Ring ring{z, {}};
        for (int i = 0; i < n; ++i) {
            const double a = 2 * std::numbers::pi * i / n + turn,
                         r = size * radii[static_cast<std::size_t>(i)];
            ring.points.push_back({x + r * std::cos(a), y + r * std::sin(a)});
        }
        rings.push_back(ring);
    };
    put(0);
    int at = 0;
    while (at < steps) {
        at = std::min(steps, at + 1 + static_cast<int>(random() % 4));
        switch (random() % 4) {
            case 0:
                break;
            case 1:
                x += 2 * unit(random) - 1, y += 2 * unit(random) - 1;
                break;
            case 2:
                turn += 0.2 * unit(random) - 0.1;
                break;
            default:
                size *= 0.9 + 0.2 * unit(random);
        }
        put(at * step);
    }
    return loft(context, rings);
}

TEST(SheetSlicing, OptimalHasNeverMoreSheetsOrErrorThanPrinted) {
    Context context;
    std::mt19937 random(test::seed());
    double printed_sheets = 0, optimal_sheets = 0, printed_stair = 0, optimal_stair = 0;
    for (int round = 0; round < 500; ++round) {
        const Mesh mesh = random_solid(context, random, 5 + static_cast<int>(random() % 8), 3);
        SheetRules rules;
        rules.thicknesses = {3, 6, 9};
        rules.triangle_mm2 = 3;
        rules.area_percent = 4;
        rules.strategy = SheetStrategy::printed;
        const SheetStack printed = stack_of_sheets(context, mesh.view(), rules);
        rules.strategy = SheetStrategy::optimal;
        const SheetStack optimal = stack_of_sheets(context, mesh.view(), rules);
        expect_stacked(printed, rules);
        expect_stacked(optimal, rules);
        ASSERT_LE(optimal.left_on_top, printed.left_on_top + 1e-6) << round;
        ASSERT_LE(optimal.sheets.size(), printed.sheets.size()) << round;
        ASSERT_LE(optimal.stair_mm3, printed.stair_mm3 * (1 + 1e-6) + 1e-3) << round;
        printed_sheets += static_cast<double>(printed.sheets.size());
        optimal_sheets += static_cast<double>(optimal.sheets.size());
        printed_stair += printed.stair_mm3;
        optimal_stair += optimal.stair_mm3;
    }
    std::printf("  500 solids: printed %.0f sheets, %.0f cm3 of stair; optimal %.0f sheets, %.0f cm3\n",
                printed_sheets, printed_stair / 1000, optimal_sheets, optimal_stair / 1000);
    EXPECT_LT(optimal_sheets, printed_sheets);
}

// Against brute force: every stack of the same height.
TEST(SheetSlicing, OptimalIsTheBestOfAllStacks) {
    Context context;
    std::mt19937 random(test::seed());
    for (int round = 0; round < 20; ++round) {
        const Mesh mesh = random_solid(context, random, 6, 3);
        SheetRules rules;
        rules.thicknesses = {3, 6, 9};
        rules.strategy = SheetStrategy::printed;
        rules.triangle_mm2 = 3;
        const SheetStack printed = stack_of_sheets(context, mesh.view(), rules);
        rules.strategy = SheetStrategy::optimal;
        const SheetStack optimal = stack_of_sheets(context, mesh.view(), rules);
        std::vector<SheetSpan> all;
        for (int h = 0; h < 6; ++h)
            for (int stock = 0; stock < 3 && h + stock < 6; ++stock)
                all.push_back({3.0 * h, 3.0 * (h + stock + 1), stock});
        const std::vector<SheetStair> stairs = stairs_of(context, mesh.view(), all, rules.side, false);
        std::size_t fewest = 100;
        double least = 0;
        for (int code = 0; code < 729; ++code) {
            std::vector<SheetSpan> spans;
            double z = 0;
            for (int rest = code; z < 18 - 1e-6; rest /= 3) {
                const int stock = rest % 3;
                spans.push_back({z, z + 3 * (stock + 1), stock});
                z += 3 * (stock + 1);
            }
            if (z > 18 + 1e-6 || spans.size() > fewest) continue;
            double error = 0;
            for (const SheetSpan& span : spans)
                for (std::size_t i = 0; i < all.size(); ++i)
                    if (all[i].bottom == span.bottom && all[i].stock == span.stock)
                        error += stairs[i].volume_mm3;
            if (error > printed.stair_mm3 * (1 + 1e-9) + 1e-6) continue;
            if (spans.size() < fewest || error < least) fewest = spans.size(), least = error;
        }
        EXPECT_EQ(optimal.sheets.size(), fewest);
        EXPECT_NEAR(optimal.stair_mm3, least, 1e-6 * least + 1e-6);
    }
}

// A step so small that sheets reach across it, and sheets that meet there where they are told to.
TEST(SheetSlicing, JointsAreKeptWhereAStackMeetsThem) {
    Context context;
    const Mesh mesh =
        loft(context, {circle(0, 40, 48), circle(9, 40, 48), circle(9, 39.9, 48), circle(36, 39.9, 48)});
    const auto stack_with = [&](std::vector<double> thicknesses, std::vector<double> joints) {
        SheetRules rules;
        rules.thicknesses = std::move(thicknesses);
        rules.joints = std::move(joints);
        const SheetStack stack = stack_of_sheets(context, mesh.view(), rules);
        expect_stacked(stack, rules);
        return stack;
    };
    const auto meet_at = [](const SheetStack& stack, double z) {
        return std::any_of(stack.sheets.begin(), stack.sheets.end(),
                           [&](const SheetSpan& span) { return std::abs(span.top - z) < 1e-6; });
    };
    const SheetStack free = stack_with({9, 18}, {});
    EXPECT_EQ(free.sheets.size(), 2u);
    EXPECT_FALSE(meet_at(free, 9));
    const SheetStack kept = stack_with({9, 18}, {9});
    EXPECT_EQ(kept.sheets.size(), 3u);
    EXPECT_TRUE(meet_at(kept, 9));
    EXPECT_TRUE(kept.missed.empty());
    EXPECT_LT(kept.stair_mm3, free.stair_mm3);
    // No sum of the thicknesses is 10: all is as without it, and told.
    const SheetStack missed = stack_with({9, 18}, {10});
    EXPECT_EQ(missed.sheets.size(), 2u);
    EXPECT_EQ(missed.missed, std::vector<double>{10});
    EXPECT_TRUE(meet_at(stack_with({8, 16, 20}, {8}), 8));
    EXPECT_TRUE(meet_at(stack_with({8, 16, 20}, {28}), 28));
    const SheetStack first = stack_with({16, 20}, {20, 16});
    EXPECT_TRUE(meet_at(first, 20));
    EXPECT_EQ(first.missed, std::vector<double>{16});
    EXPECT_EQ(stack_with({16, 20}, {16, 20}).missed, std::vector<double>{20});
    // A stack that meets 24 ends at 32.
    const SheetStack high = stack_with({16, 20, 24}, {24});
    EXPECT_EQ(high.left_on_top, 0);
    EXPECT_EQ(high.missed, std::vector<double>{24});
}

// The stair of a cone and of a sphere in closed form, each side of it.
TEST(SheetSlicing, StairIsTheClosedForm) {
    Context context;
    constexpr int n = 720;
    const double polygon = n / 2.0 * std::sin(2 * std::numbers::pi / n);  // area of one of radius 1
    const Mesh cone = turned(context, 30, 1, n, [](double z) { return 40 - z; });
    const std::vector<SheetSpan> spans{{6, 12, 0}};
    const double part = polygon * 6 * (34.0 * 34 + 34 * 28 + 28 * 28) / 3;
    const auto outside = stairs_of(context, cone.view(), spans, StairSide::outside)[0];
    EXPECT_NEAR(outside.volume_mm3, polygon * 34 * 34 * 6 - part, 2);
    EXPECT_NEAR(outside.inset, 6 - 6.0 / 2 / kStairSamples, 0.01);
    const auto inside = stairs_of(context, cone.view(), spans, StairSide::inside)[0];
    const double least = 28 + 6.0 / 2 / kStairSamples;
    EXPECT_NEAR(inside.volume_mm3, part - polygon * least * least * 6, 25);
    const auto middle = stairs_of(context, cone.view(), spans, StairSide::middle)[0];
    EXPECT_LT(middle.volume_mm3, 0.55 * outside.volume_mm3);
    EXPECT_LT(middle.inset, 3.01);
    // A bulge between the samples counts: the outline holds the equator wherever that is.
    const Mesh ball = turned(context, 40, 400, 90, [](double z) {
        return std::max(0.05, std::sqrt(std::max(0.0, 400 - (z - 20) * (z - 20))));
    });
    const auto about = stairs_of(context, ball.view(), {{17.3, 23.3, 0}}, StairSide::outside)[0];
    EXPECT_NEAR(area(about.outline), 90 / 2.0 * std::sin(2 * std::numbers::pi / 90) * 400, 0.1);
}

TEST(SheetSlicing, RefusesWhatMakesNoStack) {
    Context context;
    const Mesh mesh = turned(context, 10, 1, 24, [](double) { return 20.0; });
    const auto code = [&](const SheetRules& rules) -> std::string {
        try {
            (void)stack_of_sheets(context, mesh.view(), rules);
        } catch (const Error& error) {
            return error.code();
        }
        return "";
    };
    SheetRules rules;
    EXPECT_EQ(code(rules), "sheets.rules");
    rules.thicknesses = {6, 3};
    EXPECT_EQ(code(rules), "sheets.rules");
    rules.thicknesses = {0, 3};
    EXPECT_EQ(code(rules), "sheets.rules");
    rules.thicknesses = {3};
    rules.joints = {-1};
    EXPECT_EQ(code(rules), "sheets.rules");
    rules.joints.clear();
    rules.thicknesses = {12};
    EXPECT_EQ(code(rules), "sheets.too_low");
    rules.thicknesses = {0.0017, 0.0019};
    EXPECT_EQ(code(rules), "sheets.heights");
}

TEST(SheetSlicing, SameOnAnyNumberOfThreads) {
    std::vector<SheetSpan> first;
    for (const int threads : {1, 2, 4}) {
        Context context({.threads = threads});
        std::mt19937 random(5);
        const Mesh mesh = random_solid(context, random, 20, 3);
        SheetRules rules;
        rules.thicknesses = {3, 6, 9};
        const SheetStack stack = stack_of_sheets(context, mesh.view(), rules);
        if (threads == 1) first = stack.sheets;
        ASSERT_EQ(stack.sheets.size(), first.size());
        for (std::size_t i = 0; i < first.size(); ++i) EXPECT_EQ(stack.sheets[i].top, first[i].top);
    }
}

// The grid finds the edge that brute force finds.
TEST(BorderDistance, IsThatOfTheNearestEdge) {
    std::mt19937 random(test::seed());
    std::uniform_int_distribution<int> near(-400000, 400000);
    for (int round = 0; round < 40; ++round) {
        Loops loops;
        const int count = 1 + static_cast<int>(random() % 3);
        for (int l = 0; l < count; ++l) {
            const int n = 3 + static_cast<int>(random() % 40);
            for (int i = 0; i < n; ++i) loops.points.push_back({near(random) / (1 + round), near(random)});
            loops.close_loop();
        }
        const BorderDistance distance(loops);
        for (int trial = 0; trial < 100; ++trial) {
            const Point2 p{2 * near(random), 2 * near(random)};
            double nearest = 1e300;
            for (std::size_t i = 0; i < loops.size(); ++i) {
                const auto loop = loops.loop(i);
                for (std::size_t k = 0; k < loop.size(); ++k) {
                    const Point2 a = loop[k], b = loop[(k + 1) % loop.size()];
                    const double dx = double(b.x) - a.x, dy = double(b.y) - a.y;
                    const double l2 = dx * dx + dy * dy;
                    const double t =
                        l2 > 0
                            ? std::clamp(((double(p.x) - a.x) * dx + (double(p.y) - a.y) * dy) / l2, 0.0, 1.0)
                            : 0;
                    nearest = std::min(nearest, std::hypot(p.x - a.x - t * dx, p.y - a.y - t * dy));
                }
            }
            nearest /= kUnitsPerMm;
            ASSERT_NEAR(distance(p), nearest, 1e-9);
            const double most = 2 * nearest * double(random()) / 4294967296.0;
            const double within = distance.nearest_within(p, most).distance;
            ASSERT_TRUE(nearest <= most ? within == distance(p) : within > most);
        }
    }
    EXPECT_TRUE(std::isinf(BorderDistance(Loops{})({0, 0})));
}

}  // namespace
}  // namespace slabwright
