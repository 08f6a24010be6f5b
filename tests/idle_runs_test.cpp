// Finishing leaves out what would cut nothing, and nothing else.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "engine/paths/runs/idle_runs.h"
#include "engine/stock/idle_ways.h"
#include "engine/stock/layer_stock.h"
#include "io/slabwright.h"
#include "io/verify.h"
#include "io/write/stl_writer.h"
#include "kernels/mesh/weld.h"
#include "tests/support/height_field.h"
#include "tests/support/seed.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

constexpr double kTop = 14;

// The stock of one layer over a field of random heights, with a roughing through it.
struct Field {
    Context context;
    Job job;
    Mesh mesh;
    LayerJob layer;
    LayerSolid solid;

    explicit Field(std::uint32_t seed) : mesh(test::random_height_field(context, 12, 5, kTop, 0.5, seed)) {
        layer.mesh = mesh.view();
        layer.job = &job;
        layer.z_top = layer.slab_thickness = kTop;
        layer.stock_min = {-40, -40};
        layer.stock_max = {40, 40};
        solid = layer_solid(context, mesh.view(), 0, kTop);
    }
    [[nodiscard]] LayerStock stock(double cell) { return {context, layer, solid, cell}; }
};

// Ways over the surface: along lines, at the height of the surface under the tip and a little over it.
std::vector<StraightPiece> ways_over(const LayerStock& stock, std::mt19937& random, int count) {
    std::uniform_real_distribution place(-38.0, 38.0), length(0.5, 3.0), over(0.0, 0.4);
    std::vector<StraightPiece> ways;
    for (int k = 0; k < count; ++k) {
        const double x = place(random), y = place(random), turn = place(random), l = length(random);
        const auto height = [&](double at_x, double at_y) {
            const CellGrid& grid = stock.grid();
            const int i = std::clamp(static_cast<int>(std::lround((at_x - grid.x0) / grid.cell)), 0,
                                     grid.nx - 1),
                      j = std::clamp(static_cast<int>(std::lround((at_y - grid.y0) / grid.cell)), 0,
                                     grid.ny - 1);
            return static_cast<double>(stock.surface(grid.index(i, j)));
        };
        StraightPiece way{{x, y, 0}, {x + l * std::cos(turn), y + l * std::sin(turn), 0}};
        way.from[2] = height(x, y) + over(random);
        way.to[2] = height(way.to[0], way.to[1]) + over(random);
        ways.push_back(way);
        if (k % 3 == 0) ways.push_back(way);  // again, where little is left
    }
    return ways;
}

// Whether left out or not, what is not called cutting takes nothing off a cell that has more than the limit.
TEST(IdleWays, WhatDoesNotCutLeavesAllThatIsOverTheLimitAsItIs) {
    std::mt19937 random(test::seed());
    for (const CutterShape& cutter : {ball_cutter(3.175), flat_cutter(6.35), CutterShape{6, 1.5, 0}}) {
        Field field(static_cast<std::uint32_t>(random()));
        LayerStock kept = field.stock(0.25);
        const std::vector<StraightPiece> ways = ways_over(kept, random, 700);
        constexpr double limit = 0.05;
        const std::vector<char> cuts = which_cut(field.context, kept, cutter, ways, limit);
        const CutterEnd end = cutter_end(cutter);
        for (std::size_t k = 0; k < ways.size(); ++k)
            if (cuts[k] != 0) kept.cut_along(end, ways[k].from, ways[k].to);
        LayerStock all = kept;
        for (const StraightPiece& way : ways) all.cut_along(end, way.from, way.to);
        std::size_t lowered = 0;
        for (std::size_t c = 0; c < kept.heights().size(); ++c) {
            if (kept.height(c) - all.height(c) < 1e-4F) continue;
            ++lowered;
            ASSERT_LE(kept.left(c), limit) << "cell " << c;
        }
        const auto cutting = static_cast<std::size_t>(std::count(cuts.begin(), cuts.end(), 1));
        EXPECT_GT(cutting, ways.size() / 20);
        EXPECT_GT(ways.size() - cutting, ways.size() / 50);
        EXPECT_GT(lowered, 10U) << "what is left out would have shaved nothing";
    }
}

// A prism along y over a profile of x (rising) and z, which begins and ends on z = 0.
std::vector<std::array<Vec3f, 3>> prism(const std::vector<std::array<double, 2>>& profile, double depth) {
    std::vector<std::array<Vec3f, 3>> facets;
    const auto at = [](const std::array<double, 2>& xz, double y) {
        return Vec3f{static_cast<float>(xz[0]), static_cast<float>(y), static_cast<float>(xz[1])};
    };
    const auto add = [&](Vec3f a, Vec3f b, Vec3f c) {
        if (!(a == b) && !(b == c) && !(a == c)) facets.push_back({a, b, c});
    };
    // The upright side of a column, with a corner wherever another column has one.
    const auto side = [&](const std::array<double, 2>& top) {
        std::vector<std::array<double, 2>> corners{{top[0], 0}};
        for (const std::array<double, 2>& p : profile)
            if (p[0] == top[0] && p[1] > 0 && p[1] <= top[1]) corners.push_back(p);
        std::sort(corners.begin(), corners.end());
        corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
        return corners;
    };
    for (std::size_t k = 0; k + 1 < profile.size(); ++k) {
        const std::array<double, 2>&p = profile[k], &q = profile[k + 1];
        add(at(p, 0), at(q, 0), at(q, depth));
        add(at(p, 0), at(q, depth), at(p, depth));
        if (p[0] == q[0]) continue;
        const std::array<double, 2> under_p{p[0], 0}, under_q{q[0], 0};
        add(at(under_p, 0), at(under_p, depth), at(under_q, depth));
        add(at(under_p, 0), at(under_q, depth), at(under_q, 0));
        const auto left = side(p), right = side(q);
        for (std::size_t i = 0, j = 0; i + 1 < left.size() || j + 1 < right.size();) {
            const bool up_left =
                j + 1 >= right.size() || (i + 1 < left.size() && left[i + 1][1] < right[j + 1][1]);
            const std::array<double, 2>& next = up_left ? left[i + 1] : right[j + 1];
            add(at(left[i], 0), at(right[j], 0), at(next, 0));
            add(at(left[i], depth), at(next, depth), at(right[j], depth));
            ++(up_left ? i : j);
        }
    }
    return facets;
}

// Along a wall that stands between columns of cells' centres, what keeps off it by less than a cell leaves
// something that is not seen: there a way beside the wall counts as one that cuts.
TEST(IdleWays, WhatKeepsOffByLessThanACellHidesWhatItLeaves) {
    Context context;
    Job job;
    const Mesh mesh = weld(context, prism({{0, 0}, {0, 1}, {20, 1}, {20, 14}, {40, 14}, {40, 0}}, 40));
    LayerJob layer;
    layer.mesh = mesh.view();
    layer.job = &job;
    layer.z_top = layer.slab_thickness = kTop;
    layer.stock_min = {-10, -10};
    layer.stock_max = {50, 50};
    const LayerSolid solid = layer_solid(context, mesh.view(), 0, kTop);
    const Tool ball = tool_of_kind(job, ToolKind::ball);
    const double r = ball.diameter / 2;
    for (const double spare : {0.1, 0.3}) {
        LayerStock stock(context, layer, solid, 0.25);
        Operation op;
        op.spare = spare;
        for (const double x : {10.0, 12.0, 14.0, 16.0, 20 - r - spare})
            for (const int y : {5, 35}) op.moves.push_back({to_units(x), to_units(y), to_units(1), 1000});
        (void)stock.cut(context, op, ball);
        EXPECT_EQ(stock.may_hide_remains({19, 19}, {20, 21}), spare < 0.25);
        EXPECT_FALSE(stock.may_hide_remains({-5, -8}, {-4, -7}));
        const std::vector<StraightPiece> ways{{{20 - r, 10, 5}, {20 - r, 30, 5}},     // beside the wall
                                              {{13, 10, 5}, {13, 30, 5}},             // away from it
                                              {{20 - r, -8, 20}, {20 - r, -6, 20}}};  // over all that stands
        const std::vector<char> cuts = which_cut(context, stock, cutter_shape(ball), ways, 0.05);
        EXPECT_EQ(cuts, (std::vector<char>{1, 0, 0})) << spare;
    }
}

// Once around the part, half of it where nothing is left: of a closed run the half that cuts stays, wherever
// the run begins. One that cuts all along stays closed, and one that cuts nowhere goes.
TEST(IdleRuns, OfAClosedRunWhatCutsStays) {
    std::mt19937 random(test::seed());
    Field field(static_cast<std::uint32_t>(random()));
    LayerStock stock = field.stock(0.5);
    const CutterShape cutter = flat_cutter(3);
    const LayerCut cut{field.context, field.layer, field.job, field.solid, kTop, {}, {}, nullptr, &stock};
    const std::vector<std::array<double, 2>> square{{-36, -36}, {-36, 36}, {36, 36}, {36, -36}};
    LevelRun round;
    round.closed = true;
    const std::size_t begin = random() % 4;
    for (std::size_t k = 0; k <= 4; ++k) {
        const std::array<double, 2>& p = square[(begin + k) % 4];
        round.points.push_back({to_units(p[0]), to_units(p[1]), to_units(5)});
    }
    const auto left = [&] {
        std::vector<std::vector<LevelRun>> groups{{round}};
        take_out_idle(cut, cutter, 20, groups);
        return groups.at(0);
    };
    const std::vector<LevelRun> whole = left();
    ASSERT_EQ(whole.size(), 1U);
    EXPECT_TRUE(whole[0].closed);
    EXPECT_EQ(whole[0].points, round.points);

    const auto clear = [&](double x0, double x1) {
        const CutterEnd wide = cutter_end(flat_cutter(6));
        for (const double y : {-36.0, 36.0}) stock.cut_along(wide, {x0, y, 1}, {x1, y, 1});
        const double x = std::abs(x0) > std::abs(x1) ? x0 : x1;
        stock.cut_along(wide, {x, -36, 1}, {x, 36, 1});
    };
    clear(-36, 0);
    const std::vector<LevelRun> half = left();
    ASSERT_EQ(half.size(), 1U);
    EXPECT_FALSE(half[0].closed);
    double length = 0;
    for (std::size_t k = 1; k < half[0].points.size(); ++k) {
        const PathPoint &a = half[0].points[k - 1], &b = half[0].points[k];
        EXPECT_GT(to_mm(std::min(a.x, b.x)), -1);
        length += std::hypot(to_mm(b.x - a.x), to_mm(b.y - a.y));
    }
    EXPECT_GE(length, 2 * (36 - 9) + 72) << "where the wide cutter has not been";
    clear(0, 36);
    EXPECT_TRUE(left().empty());
}

struct Made {
    double finish_mm = 0, missed_mm2 = 0;
    std::vector<std::string> violations;
};
// Plans it by default, and proves it on cells of a twentieth of a millimetre.
Made made(const std::vector<std::array<Vec3f, 3>>& facets) {
    Context context;
    const support::TemporaryFolder folder;
    const std::string stl = folder / "part.stl";
    write_stl(stl, weld(context, facets));
    const Job job;
    const std::shared_ptr<Pattern> pattern = read_pattern(context, stl, job);
    Plan planned = plan(context, *pattern, job);
    (void)write_proven(context, planned, folder / "out", pattern, true);
    Made made;
    for (const Layer& layer : planned.layers)
        for (const Operation& op : layer.operations)
            for (std::size_t k = 1; k < op.moves.size() && op.kind == OperationKind::finish; ++k)
                if (op.moves[k].feed > 0)
                    made.finish_mm += std::hypot(to_mm(op.moves[k].x) - to_mm(op.moves[k - 1].x),
                                                 to_mm(op.moves[k].y) - to_mm(op.moves[k - 1].y));
    VerifyOptions fine;
    fine.pattern = pattern;
    fine.cell = 0.05;
    const Verification proof = verify_folder(context, folder / "out", fine);
    for (const Violation& v : proof.report.violations) made.violations.push_back(v.message);
    for (const LayerFindings& layer : proof.report.layers)
        made.missed_mm2 += static_cast<double>(layer.missed) * fine.cell * fine.cell;
    return made;
}

std::vector<std::array<Vec3f, 3>> ridge(double degrees) {
    const double rise = 12, run = rise / std::tan(degrees * std::numbers::pi / 180);
    return prism({{0, 0},
                  {0, 4},
                  {10, 4},
                  {10 + run, 4 + rise},
                  {14 + run, 4 + rise},
                  {14 + 2 * run, 4},
                  {24 + 2 * run, 4},
                  {24 + 2 * run, 0}},
                 40);
}

// Slopes at the limit between level contours and raster belong to both: one of them makes them.
TEST(IdleRuns, SlopesAtTheLimitAreCutOnce) {
    const Made gentle = made(ridge(40)), at_limit = made(ridge(45.5)), steep = made(ridge(51));
    for (const Made& one : {gentle, at_limit, steep}) {
        EXPECT_TRUE(one.violations.empty()) << one.violations.front();
        EXPECT_LT(one.missed_mm2, 8) << "more than along the ridge's feet";
    }
    EXPECT_LT(at_limit.finish_mm, 1.25 * std::max(gentle.finish_mm, steep.finish_mm))
        << gentle.finish_mm << ' ' << at_limit.finish_mm << ' ' << steep.finish_mm;
}

// A flat end mill that goes along the foot of a slope leaves no stairs there, though they be narrower than a
// cell of the stock.
TEST(IdleRuns, FeetOfSlopesAreCutWithoutStairs) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution between(40.0, 75.0);
    for (int k = 0; k < 6; ++k) {
        const double degrees = between(random);
        std::vector<std::array<Vec3f, 3>> facets = ridge(degrees);
        if (k % 2 == 1)
            for (auto& facet : facets)
                for (Vec3f& v : facet) v = {-v.y, v.x, v.z};
        const Made one = made(facets);
        EXPECT_TRUE(one.violations.empty()) << degrees << ": " << one.violations.front();
        EXPECT_LT(one.missed_mm2, 8) << degrees;
    }
}

// Slots that only the ball enters, wherever their walls lie among the cells: nothing of what its
// semi-roughing keeps off the walls stays there.
TEST(IdleRuns, SlotsBetweenCellsAreAsWideAsTheyAre) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution place(12.0, 14.0), width(7.0, 11.0);
    const double a = place(random), b = a + width(random), c = b + place(random), d = c + width(random);
    const Made one = made(prism({{0, 0},
                                 {0, 14},
                                 {a, 14},
                                 {a, 3},
                                 {b, 3},
                                 {b, 14},
                                 {c, 14},
                                 {c, 5},
                                 {d, 5},
                                 {d, 14},
                                 {d + 12, 14},
                                 {d + 12, 0}},
                                40));
    EXPECT_TRUE(one.violations.empty()) << one.violations.front();
    EXPECT_LT(one.missed_mm2, 1) << "slots from x " << a << " to " << b << " and from " << c << " to " << d;
}

}  // namespace
}  // namespace slabwright
