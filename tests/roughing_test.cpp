// Roughing in rings: deep levels first, terraces over slopes and floors after them, rectangles where what
// stays is far apart. What it leaves is found by cutting its own moves out of a field of cells, one by one.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "engine/paths/operations/open_waste.h"
#include "engine/paths/operations/roughing.h"
#include "engine/paths/runs/layer_cut.h"
#include "tests/support/height_field.h"

namespace slabwright {
namespace {

constexpr double kTop = 16, kCell = 0.5;

struct Roughed {
    Context context;
    Job job;
    Mesh mesh;
    LayerJob layer;
    std::array<double, 2> low, high;
    LayerCut cut;
    Standing standing;
    std::vector<Operation> all;
    Operation op;  // the end mill's
    int nx = 0, ny = 0;
    std::vector<double> height;  // what is left, by cells
    double deepest_cut = 0;      // mm over a tip
    double met_head_on = 0;      // mm that stood under a face mill's middle where it went straight down

    // A height field of 120 by 120 cells around the origin in a stock.
    Roughed(const std::function<double(double, double)>& surface, std::array<double, 2> stock_low,
            std::array<double, 2> stock_high, double last_steps, double pitch = 0.5, bool open_waste = false)
        : mesh(test::height_field(context, 120, pitch, surface)),
          low(stock_low),
          high(stock_high),
          cut{context,
              layer,
              job,
              layer_solid(context, mesh.view(), 0, kTop),
              kTop,
              {},
              alpha_map(context, mesh.view(), 0, kTop),
              nullptr,
              {}},
          standing(low, high, kTop) {
        job.cutting.open_waste = open_waste;
        layer.mesh = mesh.view();
        layer.job = &job;
        layer.z_top = layer.slab_thickness = kTop;
        layer.stock_min = low, layer.stock_max = high;
        layer.rough_steps = {last_steps, last_steps > 0 ? 2 : 0, 0};
        layer.tools.rough = tool_of_kind(job, ToolKind::flat);
        layer.tools.finish = tool_of_kind(job, ToolKind::ball);
        cut.standing = &standing;
    }
    void rough() {
        all = rough_layer(cut);
        op = all.back();
        nx = static_cast<int>((high[0] - low[0]) / kCell), ny = static_cast<int>((high[1] - low[1]) / kCell);
        height.assign(static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny), kTop);
        for (const Operation& one : all) replay(one);
    }
    [[nodiscard]] double radius_of(const Operation& one) const {
        return std::find_if(job.tools.begin(), job.tools.end(),
                            [&](const Tool& t) { return t.number == one.tool; })
                   ->diameter /
               2;
    }
    void replay(const Operation& one) {
        const double r = radius_of(one);
        for (std::size_t k = 1; k < one.moves.size(); ++k) {
            const Move &a = one.moves[k - 1], &b = one.moves[k];
            const double ax = to_mm(a.x), ay = to_mm(a.y), bx = to_mm(b.x), by = to_mm(b.y),
                         z = to_mm(l2_of(a, b) > 0 ? std::max(a.z, b.z) : b.z);
            if (z >= kTop) continue;
            const double dx = bx - ax, dy = by - ay, l2 = dx * dx + dy * dy;
            for (int j = std::max(0, cell(std::min(ay, by) - r, 1));
                 j <= std::min(ny - 1, cell(std::max(ay, by) + r, 1)); ++j)
                for (int i = std::max(0, cell(std::min(ax, bx) - r, 0));
                     i <= std::min(nx - 1, cell(std::max(ax, bx) + r, 0)); ++i) {
                    const double t =
                        l2 > 0 ? std::clamp(((x(i) - ax) * dx + (y(j) - ay) * dy) / l2, 0.0, 1.0) : 0;
                    const double off = std::hypot(x(i) - ax - t * dx, y(j) - ay - t * dy);
                    if (off > r) continue;
                    if (&one != &all.back() && l2 == 0 && off < PathBuilder::kMiddle * r)
                        met_head_on = std::max(met_head_on, at(i, j) - z);
                    deepest_cut = std::max(deepest_cut, at(i, j) - z), at(i, j) = std::min(at(i, j), z);
                }
        }
    }
    static std::int64_t l2_of(const Move& a, const Move& b) {
        const std::int64_t dx = std::int64_t{b.x} - a.x, dy = std::int64_t{b.y} - a.y;
        return dx * dx + dy * dy;
    }
    [[nodiscard]] int cell(double v, int axis) const {
        return static_cast<int>(std::floor((v - low[static_cast<std::size_t>(axis)]) / kCell));
    }
    [[nodiscard]] double x(int i) const { return low[0] + (i + 0.5) * kCell; }
    [[nodiscard]] double y(int j) const { return low[1] + (j + 0.5) * kCell; }
    double& at(int i, int j) {
        return height[static_cast<std::size_t>(j) * static_cast<std::size_t>(nx) +
                      static_cast<std::size_t>(i)];
    }
    // How low the roughing cutter may get over a place at all, with its allowance.
    [[nodiscard]] double least(int i, int j) const {
        const double r = layer.tools.rough.diameter / 2;
        const DropIndex& part = cut.drops(flat_cutter(r + job.cutting.wall_allowance));
        double lowest = kTop;
        for (double v = -r; v <= r; v += r / 8)
            for (double u = -r; u <= r; u += r / 8)
                if (std::hypot(u, v) <= r) lowest = std::min(lowest, part.drop(x(i) + u, y(j) + v).tip_z);
        return std::max(0.0, lowest);
    }
    [[nodiscard]] double way(bool by_feed) const {
        double sum = 0;
        for (std::size_t k = 1; k < op.moves.size(); ++k)
            if ((op.moves[k].feed > 0) == by_feed && op.moves[k].z < to_units(kTop))
                sum += std::hypot(to_mm(op.moves[k].x - op.moves[k - 1].x),
                                  to_mm(op.moves[k].y - op.moves[k - 1].y));
        return sum;
    }
};

// On the west a slope of 45°, on the south one of 65°, on the east a wall with the draft of 2°, on the north
// a wall and a ledge before it.
double hill(double x, double y) {
    const double west = 12 + (x + 12), south = 12 + std::tan(65 * std::numbers::pi / 180) * (y + 12),
                 east = 12 + (12 - x) / std::tan(2 * std::numbers::pi / 180);
    return std::clamp(std::min({west, south, east, y > 12 ? 5.3 : 99.0, y > 24 ? 0.5 : 99.0}), 0.5, 14.5);
}

TEST(Roughing, LeavesStepsOnSlopesAndAllowancesOnFloors) {
    for (const double last_steps : {0.0, 2.2}) {
        Roughed r(hill, {-45, -45}, {45, 45}, last_steps);
        r.cut.floors = {14.5, double{5.3F}, 0.5};
        r.rough();
        ASSERT_FALSE(r.op.moves.empty());
        const Tool& tool = r.layer.tools.rough;
        EXPECT_LE(r.op.stepdown, tool.stepdown_max + 1e-9);
        EXPECT_LE(r.deepest_cut, r.op.stepdown + 1e-3) << "what a level clears is clear";
        double worst = 0, on_ledge = 0, on_slope = 0, deepest = 1e300;
        for (int j = 0; j < r.ny; j += 2)
            for (int i = 0; i < r.nx; i += 2) {
                const double least = r.least(i, j), left = r.at(i, j) - least, x = r.x(i), y = r.y(j);
                deepest = std::min(deepest,
                                   r.at(i, j) - (std::max(std::abs(x), std::abs(y)) < 29.5 ? hill(x, y) : 0));
                worst = std::max(worst, left);
                if (std::abs(x) < 10 && y > 15 && y < 21) on_ledge = std::max(on_ledge, left);
                if (least < kTop - 4 && ((std::abs(y) < 9 && x < -13) || (std::abs(x) < 9 && y < -13)))
                    on_slope = std::max(on_slope, left);
            }
        EXPECT_GE(deepest, -1e-6) << "nothing of the part is cut";
        EXPECT_LE(worst, tool.stepdown_max + r.job.cutting.floor_allowance + 0.05) << "no place is left out";
        EXPECT_LE(on_ledge, r.job.cutting.floor_allowance + 0.05);
        EXPECT_LE(on_slope, tool.stepdown_min + r.job.cutting.floor_allowance + 0.1)
            << "terraces, where a whole level leaves more";
        EXPECT_GT(on_slope, 1);
    }
}

TEST(Roughing, LevelsGoAsDeepAsTheToolMayAndTerracesOnlyWhereTheyCut) {
    Roughed r(hill, {-45, -45}, {45, 45}, 0);
    r.cut.floors = {14.5, double{5.3F}, 0.5};
    r.rough();
    const Tool& tool = r.layer.tools.rough;
    const double levels = std::ceil(kTop / tool.stepdown_max), step = 0.45 * tool.diameter, area = 90 * 90;
    EXPECT_LT(r.way(true), 1.25 * levels * area / step);
    // The levels that clear everything.
    std::vector<double> at_level;
    for (std::size_t k = 1; k < r.op.moves.size(); ++k) at_level.push_back(to_mm(r.op.moves[k].z));
    for (int k = 1; k < levels; ++k)
        EXPECT_TRUE(std::any_of(at_level.begin(), at_level.end(), [&](double z) {
            return std::abs(z - (kTop - kTop * k / levels)) < 1e-3;
        })) << k;
}

TEST(Roughing, LevelsGoNoDeeperThanTheWoodBears) {
    constexpr double kDeepest = 2.1;
    Roughed r(hill, {-45, -45}, {45, 45}, 1);
    r.layer.rough_steps.deepest = kDeepest;
    ASSERT_GT(r.layer.tools.rough.stepdown_max, kDeepest);
    r.rough();
    EXPECT_LE(r.op.stepdown, kDeepest + 1e-9);
    EXPECT_LE(r.deepest_cut, kDeepest + 1e-3);
}

// One small thing in the corner of a wide stock: rectangles leave only what is next to it to rings, and
// nothing is left.
TEST(Roughing, GoesRoundWhereWhatStaysIsFarApart) {
    const auto boss = [](double x, double y) { return std::max(std::abs(x), std::abs(y)) < 14 ? 14.5 : 0.5; };
    Roughed r(boss, {-45, -45}, {455, 355}, 0);
    r.rough();
    const double levels = std::ceil(kTop / r.layer.tools.rough.stepdown_max);
    for (int j = 0; j < r.ny; ++j)
        for (int i = 0; i < r.nx; ++i)
            if (std::max(std::abs(r.x(i)), std::abs(r.y(j))) > 31) {
                ASSERT_LE(r.at(i, j), 1e-6) << r.x(i) << " " << r.y(j);
            }
    EXPECT_LE(r.deepest_cut, r.op.stepdown + 1e-3) << "nothing was left by a level above";
    // Of all levels but the last the ways back are short.
    EXPECT_LT(r.way(false), 1.6 / levels * r.way(true));
    EXPECT_GT(r.way(true), levels * 500 * 400 / (0.5 * r.layer.tools.rough.diameter));
}

// Two posts with a gap between them that no face mill passes, and a wall around a pocket that one would fit
// into but cannot come to.
double posts_and_pocket(double x, double y) {
    const bool first = std::abs(x + 70) < 30 && std::abs(y - 60) < 30,
               second = std::abs(x - 30) < 30 && std::abs(y - 60) < 30;
    const double from_middle = std::hypot(x - 50, y + 55);
    return first || second || (from_middle > 40 && from_middle < 52) ? 14.5 : 0.5;
}

TEST(Roughing, FaceMillTakesWhatLiesOpenAndTheEndMillTheRest) {
    for (const double last_steps : {0.0, 2.2}) {
        const std::array<double, 2> low{-160, -150}, high{150, 140};
        Roughed alone(posts_and_pocket, low, high, last_steps, 2),
            both(posts_and_pocket, low, high, last_steps, 2, true);
        alone.rough(), both.rough();
        ASSERT_EQ(alone.all.size(), 1u);
        ASSERT_EQ(both.all.size(), 2u);
        const Operation& face = both.all.front();
        EXPECT_EQ(face.kind, OperationKind::rough);
        const double r = both.radius_of(face);
        EXPECT_EQ(r, 25);
        EXPECT_TRUE(both.cut.no_way_in.empty());
        EXPECT_LE(both.met_head_on, PathBuilder::kScrape)
            << "it goes down beside the stock, or where it has been";
        EXPECT_LE(both.deepest_cut, std::max(face.stepdown, both.op.stepdown) + 1e-3)
            << "what is left to the end mill is known to it";
        // It keeps farther off than the end mill, and stays out of the pocket.
        const DropIndex& part = both.cut.drops(flat_cutter(r + both.job.cutting.wall_allowance + 0.9));
        for (std::size_t k = 1; k < face.moves.size(); ++k) {
            const Move &a = face.moves[k - 1], &b = face.moves[k];
            if (b.feed == 0) continue;
            if (const double way = std::hypot(to_mm(b.x - a.x), to_mm(b.y - a.y)); way > 0 && b.z < a.z) {
                EXPECT_LT(to_mm(b.z), both.op.stepdown) << "helices and ramps lead to the last level only";
                EXPECT_LE(to_mm(a.z - b.z), 1.01 * way * std::tan(2 * std::numbers::pi / 180) + 1e-3);
            }
            for (int s = 0; s <= 20; ++s) {
                const double t = s / 20.0, x = to_mm(a.x) + t * to_mm(b.x - a.x),
                             y = to_mm(a.y) + t * to_mm(b.y - a.y), z = to_mm(a.z) + t * to_mm(b.z - a.z);
                ASSERT_FALSE(part.stands_over(x, y, z)) << x << " " << y << " " << z;
                if (z < kTop) {
                    ASSERT_GT(std::hypot(x - 50, y + 55), 45) << "in the pocket";
                }
            }
        }
        // No more is left than by the end mill alone, nor less.
        double more = 0, less = 0;
        for (int j = 0; j < both.ny; ++j)
            for (int i = 0; i < both.nx; ++i) {
                if (both.at(i, j) > alone.at(i, j) + 0.01) more += kCell * kCell;
                if (both.at(i, j) < alone.at(i, j) - 0.01) less += kCell * kCell;
            }
        std::printf("both leave more than the end mill alone on %.2f mm2, less on %.2f\n", more, less);
        EXPECT_LE(more, 1);
        EXPECT_LE(less, 1);
        EXPECT_LT(both.way(true), 0.45 * alone.way(true)) << "the end mill's";
    }
}

// A level with a run that the face mill has no way into is left to the end mill, and so are those below it;
// those above it stay the face mill's.
TEST(Roughing, ALevelWithoutAWayInIsTheEndMills) {
    Roughed r(posts_and_pocket, {-160, -150}, {150, 140}, 2.2, 2, true);
    const auto level = [](double depth, double from, double to, double y) {
        const std::int32_t z = to_units(kTop - depth);
        RingPlan::Piece piece;
        piece.points = {{to_units(from), to_units(y), z}, {to_units(to), to_units(y), z}};
        OpenLevel open;
        open.whole = true, open.above = kTop - depth + 4, open.saved = 5;
        open.rings.z = z, open.rings.radius = 25, open.rings.step = 5, open.rings.from_open = true;
        open.rings.pieces = {piece};
        return open;
    };
    // From beside the stock; three millimetres in the midst of it; from beside it again.
    std::vector<OpenLevel> levels{level(4, -200, 0, -120), level(8, 0, 3, -10), level(12, -200, 0, -120)};
    const Operation op = clear_open_waste(r.cut, r.job.tools[0], levels, nullptr);
    ASSERT_FALSE(op.moves.empty());
    std::int32_t lowest = INT32_MAX;
    for (const Move& m : op.moves) lowest = std::min(lowest, m.z);
    EXPECT_EQ(lowest, to_units(kTop - 4));
    EXPECT_FALSE(levels[0].rings.pieces.empty());
    EXPECT_TRUE(levels[1].rings.pieces.empty());
    EXPECT_TRUE(levels[2].rings.pieces.empty());
    EXPECT_TRUE(r.cut.no_way_in.empty()) << "the end mill takes it: nothing is left out";
    EXPECT_NEAR(r.standing.top(5, {-50, -120}, {-50, -120}), kTop - 4, 1e-3);
    EXPECT_NEAR(r.standing.top(1, {1, -10}, {1, -10}), kTop, 1e-3);
}

// Strips that end beside the stock at both ends are cut to and fro: no way back over what has been cut.
TEST(Roughing, OpenRingsOfTheFaceMillGoEitherWay) {
    Roughed r(posts_and_pocket, {-160, -150}, {150, 140}, 2.2, 2, true);
    const std::int32_t z = to_units(kTop - 4);
    OpenLevel open;
    open.whole = true, open.above = kTop, open.saved = 5;
    open.rings.z = z, open.rings.radius = 25, open.rings.step = 25, open.rings.from_open = true;
    for (std::size_t k = 0; k < 3; ++k) {
        const std::int32_t y = to_units(-105 - 20 * static_cast<double>(k));
        RingPlan::Piece piece;
        piece.points = {{to_units(-200), y, z}, {to_units(190), y, z}};
        piece.ring = k;
        piece.box = {static_cast<double>(to_units(-200)), static_cast<double>(y),
                     static_cast<double>(to_units(190)), static_cast<double>(y)};
        open.rings.pieces.push_back(piece);
    }
    std::vector<OpenLevel> levels{open};
    const Operation op = clear_open_waste(r.cut, r.job.tools[0], levels, nullptr);
    double cut = 0, backwards = 0, over = 0;
    for (std::size_t k = 1; k < op.moves.size(); ++k) {
        const Move &a = op.moves[k - 1], &b = op.moves[k];
        const double way = std::hypot(to_mm(b.x - a.x), to_mm(b.y - a.y));
        if (b.feed == 0) over += cut > 0 ? way : 0;
        else cut += way, backwards += b.x < a.x ? way : 0;
    }
    EXPECT_GT(cut, 3 * 300);
    EXPECT_LT(std::abs(cut - 2 * backwards), 1.1 * 390) << "one way or the other by turns";
    EXPECT_LT(over, 120);
}

// Passes of .75 mm take longer than the end mill on whole levels, but not on the shallow last ones: over
// these, everything must be gone.
TEST(Roughing, FaceMillTakesNoLevelBelowOneThatItLeaves) {
    Roughed r(posts_and_pocket, {-200, -190}, {190, 180}, 1.5, 2, true);
    r.job.cutting.face_depth = 0.75;
    r.rough();
    double deepest = 0;
    for (const Operation& op : r.all) deepest = std::max(deepest, op.stepdown);
    EXPECT_LE(r.deepest_cut, deepest + 1e-3);
    EXPECT_EQ(r.all.size(), 1u);
}

}  // namespace
}  // namespace slabwright
