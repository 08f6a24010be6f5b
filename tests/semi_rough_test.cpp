// Rest machining by a dropped cutter: of what is left it takes all that it can. Semi-roughing by one keeps
// its allowance off the part, its chords are longer for it, and what only the bare cutter enters it clears
// all the same.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

#include "engine/paths/operations/rest.h"
#include "engine/paths/operations/rest_targets.h"
#include "engine/paths/operations/roughing.h"
#include "engine/paths/operations/semi_rough.h"
#include "tests/support/end_mill_job.h"
#include "tests/support/height_field.h"
#include "tests/support/seed.h"

namespace slabwright {
namespace {

constexpr double kTop = 14, kLimit = 1.0;

using Height = std::function<double(double, double)>;
using Reshape = std::function<void(Mesh&)>;

Mesh drawn(Context& context, const Height& height, const Reshape& reshape) {
    Mesh mesh = test::height_field(context, 80, 0.5, height);
    if (reshape) reshape(mesh);
    return mesh;
}

// A layer of a height field over 40 mm, full but for what the roughing cutter takes.
struct Waste {
    Context context;
    Job job = test::end_mill_job();
    Mesh mesh;
    LayerJob layer;
    LayerCut cut;
    Standing standing{{-25, -25}, {25, 25}, kTop};

    Waste(const Height& height, const Reshape& reshape)
        : mesh(drawn(context, height, reshape)),
          cut{context,
              layer,
              job,
              layer_solid(context, mesh.view(), 0, kTop),
              kTop,
              {},
              alpha_map(context, mesh.view(), 0, kTop),
              nullptr,
              {}} {
        layer.mesh = mesh.view();
        layer.job = &job;
        layer.z_bottom = 0;
        layer.z_top = layer.slab_thickness = kTop;
        layer.stock_min = {-25, -25};
        layer.stock_max = {25, 25};
        layer.tools.rough = tool_of_kind(job, ToolKind::flat);
        layer.tools.finish = tool_of_kind(job, ToolKind::ball);
        cut.standing = &standing;
    }
};

struct Passed {
    double nearest = 1e300;  // by how much a cutter may be wider and has no room at some place, mm, rounded
                             // up to hundredths
    double length = 0;       // mm by feed
    std::size_t moves = 0;   // by feed
    double most_left = 0;    // mm along the normal, within 1 mm of the plane x = 0
};

Passed semi_roughed(const Height& height, ToolKind kind, double allowance, const Reshape& reshape = {}) {
    Waste w(height, reshape);
    Tool tool = w.layer.tools.finish;
    tool.kind = kind;
    LayerStock stock(w.cut.context, w.cut.layer, w.cut.solid, 0.2);
    stock.cut(w.cut.context, rough_layer(w.cut).back(), w.layer.tools.rough);
    const Operation op =
        cut_rest(w.cut, stock, tool, {OperationKind::semi_rough, "waste", kLimit, true, 0, allowance});
    EXPECT_FALSE(op.moves.empty());
    Passed passed;
    const double r = tool.diameter / 2;
    std::vector<DropIndex> wider;
    const auto wide = kind == ToolKind::ball ? ball_cutter : flat_cutter;
    for (int k = -2; k <= 10; ++k) wider.emplace_back(w.cut.solid, wide(r + 0.01 * k));
    for (std::size_t i = 1; i < op.moves.size(); ++i) {
        const Move &a = op.moves[i - 1], &b = op.moves[i];
        if (b.feed == 0) continue;
        const double l = std::hypot(to_mm(b.x - a.x), to_mm(b.y - a.y), to_mm(b.z - a.z));
        passed.length += l;
        ++passed.moves;
        const int parts = 1 + static_cast<int>(l / 0.1);
        for (int k = 0; k <= parts; ++k) {
            const double t = static_cast<double>(k) / parts, x = to_mm(a.x) + t * to_mm(b.x - a.x),
                         y = to_mm(a.y) + t * to_mm(b.y - a.y), z = to_mm(a.z) + t * to_mm(b.z - a.z);
            for (std::size_t d = 0; d < wider.size(); ++d) {
                const double more = 0.01 * (static_cast<double>(d) - 2);
                if (more > passed.nearest) break;
                if (wider[d].stands_over(x, y, z - (kind == ToolKind::ball ? more : 0)))
                    passed.nearest = more;
            }
        }
    }
    for (int j = 0; j < stock.grid().ny; ++j)
        for (int i = 0; i < stock.grid().nx; ++i)
            if (std::abs(stock.grid().x(i)) < 1 && std::abs(stock.grid().y(j)) < 12)
                passed.most_left =
                    std::max(passed.most_left, static_cast<double>(stock.left(stock.grid().index(i, j))));
    return passed;
}

// A groove of 11 mm with a floor that rises and falls, too narrow for the roughing cutter of 12.7 mm.
double wavy_groove(double x, double y) {
    return std::abs(x) < 5.5 && std::abs(y) < 17 ? 4 + 1.5 * std::sin(y / 3) + 0.02 * x * x : kTop;
}

TEST(SemiRough, KeepsOffThePartAndHasLongerChords) {
    for (const ToolKind kind : {ToolKind::ball, ToolKind::flat}) {
        const Passed bare = semi_roughed(wavy_groove, kind, 0), kept = semi_roughed(wavy_groove, kind, 0.1);
        EXPECT_LE(bare.nearest, 0) << "the bare cutter touches";
        EXPECT_GE(bare.nearest, -0.01) << "within the gouge tolerance";
        EXPECT_GT(kept.nearest, 0) << "the other does not anywhere";
        EXPECT_LT(bare.most_left, kLimit);
        EXPECT_LT(kept.most_left, kLimit);
        // A ball's rings are level, and leave what is no reason to go anywhere; a raster follows the floor.
        if (kind == ToolKind::flat) {
            EXPECT_LT(kept.most_left, bare.most_left + 0.2) << "cusps and the allowance";
        }
        EXPECT_LT(kept.moves, 0.5 * static_cast<double>(bare.moves));
        EXPECT_GT(kept.length / static_cast<double>(kept.moves),
                  1.2 * bare.length / static_cast<double>(bare.moves));
    }
}

// A slot that is wider than the cutter by less than twice the allowance is cleared to its floor, and no worse
// than without.
TEST(SemiRough, ClearsWhatOnlyTheBareCutterEnters) {
    for (const double wider : {0.04, 0.1, 0.18, 0.3}) {
        const double half = 6.35 / 2 + wider / 2;
        auto slot = [&](double x, double y) { return std::abs(x) < 10 && std::abs(y) < 17 ? 5.0 : kTop; };
        // The field's facets are half a millimetre wide: it is drawn together so that the slot has upright
        // walls where they should be.
        auto narrow = [&](Mesh& mesh) {
            for (Vec3f& v : mesh.vertices)
                if (std::abs(v.x) <= 10)
                    v.x *= static_cast<float>((half + (std::abs(v.x) < 10 ? 0 : 0.01)) /
                                              (std::abs(v.x) < 10 ? 9.5 : 10));
        };
        for (const double allowance : {0.0, 0.1}) {
            const Passed passed = semi_roughed(slot, ToolKind::ball, allowance, narrow);
            EXPECT_LT(passed.most_left, kLimit) << wider << " wider, allowance " << allowance;
            EXPECT_GE(passed.nearest, -0.01);
        }
    }
}

// Of the cells on which more than the limit is left, those that the cutter could still lower, from whatever
// place: dropped a tenth of a millimetre apart, by brute force.
std::size_t could_be_lowered(const Waste& w, const LayerStock& stock, const Tool& tool, double limit,
                             double worth) {
    const bool ball = tool.kind == ToolKind::ball;
    const double r = tool.diameter / 2;
    const DropIndex index(w.cut.solid, ball ? ball_cutter(r) : flat_cutter(r));
    const CellGrid& grid = stock.grid();
    constexpr int n = 480;
    std::vector<float> tips;
    for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i)
            tips.push_back(static_cast<float>(index.drop(0.1 * i - 24, 0.1 * j - 24).tip_z));
    std::size_t count = 0;
    for (int j = 0; j < grid.ny; ++j)
        for (int i = 0; i < grid.nx; ++i) {
            const std::size_t c = grid.index(i, j);
            const double x = grid.x(i), y = grid.y(j);
            if (stock.left(c) <= limit || std::abs(x) > 17 || std::abs(y) > 17) continue;
            double lowest = 1e300;
            for (int v = static_cast<int>((y + 24 - r) / 0.1); v <= static_cast<int>((y + 24 + r) / 0.1) + 1;
                 ++v)
                for (int u = static_cast<int>((x + 24 - r) / 0.1);
                     u <= static_cast<int>((x + 24 + r) / 0.1) + 1; ++u) {
                    const double d2 =
                        (0.1 * u - 24 - x) * (0.1 * u - 24 - x) + (0.1 * v - 24 - y) * (0.1 * v - 24 - y);
                    if (d2 >= r * r) continue;
                    lowest = std::min(
                        lowest, static_cast<double>(
                                    tips[static_cast<std::size_t>(v) * n + static_cast<std::size_t>(u)]) +
                                    (ball ? r - std::sqrt(r * r - d2) : 0));
                }
            const double z = std::max(lowest, static_cast<double>(stock.surface(c)));
            count += (stock.height(c) - z) * stock.nz(c) > worth;
        }
    return count;
}

double way_of(const Operation& op) {
    double way = 0;
    for (std::size_t k = 1; k < op.moves.size(); ++k) {
        const Move &a = op.moves[k - 1], &b = op.moves[k];
        if (b.feed > 0) way += std::hypot(to_mm(b.x - a.x), to_mm(b.y - a.y), to_mm(b.z - a.z));
    }
    return way;
}

TEST(RestMachining, LeavesWhatItsCutterCannotTake) {
    // Creases between bumps, steep and flat; a wall that winds over a floor that rises.
    auto bumps = [](double x, double y) {
        return 6 + 2.5 * std::abs(std::sin(x / 4)) * std::abs(std::cos(y / 5 + x / 9)) + 0.05 * y;
    };
    auto wall = [](double x, double y) { return 4 + 0.08 * x + (y > 6 * std::sin(x / 5) ? 6 + 0.1 * y : 0); };
    std::size_t kinds = 0;
    constexpr std::array<double, 4> most{4700, 7500, 4800, 5300};  // mm by feed
    for (const Height& height : {Height(bumps), Height(wall)})
        for (const ToolKind kind : {ToolKind::ball, ToolKind::flat}) {
            Waste w(height, {});
            Tool tool = w.layer.tools.finish;
            tool.kind = kind;
            LayerStock stock(w.cut.context, w.cut.layer, w.cut.solid, 0.2);
            stock.cut(w.cut.context, rough_layer(w.cut).back(), w.layer.tools.rough);
            constexpr double limit = 0.06, worth = 0.05;  // mm; a place is visited for .05 at most
            const std::size_t before = could_be_lowered(w, stock, tool, limit, worth);
            const Operation op = cut_rest(w.cut, stock, tool, {OperationKind::corner, "rest", limit, false});
            const std::size_t after = could_be_lowered(w, stock, tool, limit, worth);
            EXPECT_GT(before, 2000U) << kinds;
            EXPECT_LT(after, before / 100) << kinds << " of " << before;
            // Going on to where all is within the limit takes 1.2 to 2 times this way.
            EXPECT_LT(way_of(op), most[kinds]) << kinds;
            ++kinds;
        }
}

/// Moves by which a flat end mill clears the feet of a groove that is turned.
double moves_along_groove(double degrees) {
    const double c = std::cos(degrees * std::numbers::pi / 180),
                 s = std::sin(degrees * std::numbers::pi / 180);
    Waste w([&](double x, double y) { return 4 + std::clamp(1.6 * (std::abs(c * y - s * x) - 4), 0.0, 8.0); },
            {});
    Tool flat = w.layer.tools.finish;
    flat.kind = ToolKind::flat;
    LayerStock stock(w.cut.context, w.cut.layer, w.cut.solid, 0.2);
    stock.cut(w.cut.context, rough_layer(w.cut).back(), w.layer.tools.rough);
    (void)cut_rest(w.cut, stock, w.layer.tools.finish, {OperationKind::finish, "what is left", 0.07, false});
    const Operation op = cut_rest(w.cut, stock, flat, {OperationKind::corner, "corners", 0.07, false});
    return static_cast<double>(op.moves.size());
}

TEST(RestMachining, ClearsGroovesAlongThem) {
    const double along_x = moves_along_groove(0);
    EXPECT_GT(along_x, 100);
    // The other diagonal is across those of the mesh.
    for (const double degrees : {45.0, 90.0})
        EXPECT_LT(moves_along_groove(degrees), 1.7 * along_x) << degrees;
}

// A pocket with a fillet of 2.5 mm along its feet, and a slot with upright walls.
double filleted_or_slot(double x, double /*y*/) {
    if (x > 0) return x > 5 && x < 14 ? 4 : 10;
    const double wall = 8 - std::abs(x + 10), into = 2.5 - std::clamp(wall, 0.0, 2.5);
    return wall < 0 ? 10 : 4 + 2.5 - std::sqrt(2.5 * 2.5 - into * into);
}

// Where a ball follows, a flat end mill takes the feet of upright walls, as many as otherwise, and no slope.
TEST(RestMachining, AFlatLeavesSlopesToTheBallThatFollows) {
    std::array<double, 2> in_fillets{}, in_slot{};  // mm by feed
    std::array<std::size_t, 2> left_in_slot{};      // cells over the limit
    for (const bool on_slopes : {false, true}) {
        Waste w(filleted_or_slot, {});
        Tool flat = w.layer.tools.finish;
        flat.kind = ToolKind::flat;
        LayerStock stock(w.cut.context, w.cut.layer, w.cut.solid, 0.2);
        stock.cut(w.cut.context, rough_layer(w.cut).back(), w.layer.tools.rough);
        constexpr double limit = 0.06;
        (void)cut_rest(w.cut, stock, w.layer.tools.finish, {OperationKind::finish, "ball", limit, false});
        const Operation op = cut_rest(
            w.cut, stock, flat,
            {.kind = OperationKind::corner, .purpose = "corners", .limit = limit, .on_slopes = on_slopes});
        for (std::size_t i = 1; i < op.moves.size(); ++i) {
            const Move &a = op.moves[i - 1], &b = op.moves[i];
            if (b.feed > 0)
                (b.x < 0 ? in_fillets : in_slot)[on_slopes ? 1 : 0] +=
                    std::hypot(to_mm(b.x - a.x), to_mm(b.y - a.y), to_mm(b.z - a.z));
        }
        const CellGrid& grid = stock.grid();
        for (int j = 0; j < grid.ny; ++j)
            for (int i = 0; i < grid.nx; ++i)
                left_in_slot[on_slopes ? 1 : 0] += grid.x(i) > 5.6 && grid.x(i) < 13.4 &&
                                                   std::abs(grid.y(j)) < 19 &&
                                                   stock.left(grid.index(i, j)) > limit;
    }
    EXPECT_GT(in_fillets[1], 500);
    EXPECT_LT(in_fillets[0], 0.3 * in_fillets[1]);
    EXPECT_GT(in_slot[0], 50);
    EXPECT_EQ(left_in_slot[0], left_in_slot[1]);
}

// Of the cells that a pass is for, those near a place are the same whether the others were forgotten or are
// passed over.
TEST(RestMachining, ForgetsOnlyWhatIsDone) {
    const auto bumps = [](double x, double y) {
        return 6 + 2.5 * std::abs(std::sin(x / 4)) * std::abs(std::cos(y / 5 + x / 9));
    };
    Waste w(bumps, {});
    LayerStock stock(w.cut.context, w.cut.layer, w.cut.solid, 0.2);
    stock.cut(w.cut.context, rough_layer(w.cut).back(), w.layer.tools.rough);
    const RestPass pass{.limit = 0.06};
    RestTargets all(w.context, stock, pass, 1, nullptr, 3), some(w.context, stock, pass, 1, nullptr, 3);
    std::mt19937_64 random(test::seed());
    std::uniform_real_distribution<double> place(-22, 22), height(0, 12);
    std::size_t met = 0, forgotten = 0;
    for (int turn = 0; turn < 20; ++turn) {
        for (int k = 0; k < 10; ++k)
            stock.cut_at({CutterEnd::Form::flat, 3, 0}, place(random), place(random), 6);
        some.forget(pass.limit);
        for (int k = 0; k < 20; ++k) {
            const double x = place(random), y = place(random), above = height(random);
            const auto near = [&](const RestTargets& targets) {
                std::vector<std::array<int, 2>> cells;
                (void)targets.any_near(x, y, 3, above, [&](int i, int j) {
                    const std::size_t c = stock.grid().index(i, j);
                    if (stock.height(c) <= above) return false;
                    if (static_cast<double>(stock.left(c)) > pass.limit) cells.push_back({i, j});
                    else if (&targets == &all) ++forgotten;
                    else ADD_FAILURE() << "cell " << i << ' ' << j << " is done";
                    return false;
                });
                return cells;
            };
            const auto cells = near(all);
            EXPECT_EQ(near(some), cells);
            met += cells.size();
        }
    }
    EXPECT_GT(met, 10000U);
    EXPECT_GT(forgotten, 1000U);
}

TEST(RestMachining, FollowsChannelsAsFarAsTheyAreWideEnough) {
    // A channel of 12 mm with a cove along its walls, which lean by 3 degrees: a flat end mill of 12.1 mm
    // fits a millimetre over its floor, off all lines; and in one that narrows, as far as that goes.
    constexpr double width = 12, floor = 4, top = floor + 1.6, limit = 0.06, worth = 0.05;  // mm
    const auto along_y = [](double x, double /*y*/) { return std::abs(x) <= width / 2 ? floor : kTop; };
    const auto along_x = [](double /*x*/, double y) { return std::abs(y) <= width / 2 ? floor : kTop; };
    const Reshape aside = [](Mesh& mesh) {
        for (Vec3f& v : mesh.vertices) v.x += 0.217F;
    };
    const Reshape narrowing = [](Mesh& mesh) {
        for (Vec3f& v : mesh.vertices)
            v.y = (std::abs(v.y) < width / 2 + 1 ? v.y * (1 + 0.03F * v.x) : v.y) + 0.68F;
    };
    for (const bool narrows : {false, true}) {
        Waste w(narrows ? Height(along_x) : Height(along_y), narrows ? narrowing : aside);
        Tool tool = w.layer.tools.rough;
        tool.diameter = width + 0.1;
        LayerStock stock(w.cut.context, w.cut.layer, w.cut.solid, 0.2);
        for (const auto& [radius, z] : {std::pair{width / 2 + 1, top}, {width / 2 - 1, floor}}) {
            const CutterEnd end{CutterEnd::Form::flat, radius, 0};
            const std::array<double, 3> from{narrows ? -40 : 0.217, narrows ? 0.68 : -40, z},
                to{narrows ? 40 : 0.217, narrows ? 0.68 : 40, z};
            stock.cut_along(end, from, to);
            w.standing.cut(flat_cutter(radius), from, to);
        }
        const std::size_t before = could_be_lowered(w, stock, tool, limit, worth);
        const Operation op = cut_rest(w.cut, stock, tool, {OperationKind::corner, "rest", limit, false});
        const std::size_t after = could_be_lowered(w, stock, tool, limit, worth);
        EXPECT_GT(before, 500U) << narrows;
        EXPECT_LE(after, narrows ? 8U : 0U) << " of " << before;
    }
}

TEST(RestMachining, DoesNotComeForWhatClingsToAWall) {
    // A plinth whose walls lean by 3 degrees and go on below the layer, where a ball may go too.
    constexpr double base = 7, slope = 0.0524, foot = 10 + slope * kTop, limit = 0.06, stands = 0.165;  // mm
    const auto plinth = [](double x, double /*y*/) {
        return std::clamp(kTop - (std::abs(x) - 10) / slope, -base, kTop);
    };
    const auto deeper = [](Mesh& mesh) {
        for (Vec3f& v : mesh.vertices)
            if (v.z == 0) v.z = -2 * base;
    };
    for (const double beside : {0.009, 0.15}) {  // mm from the foot to the nearest column of cells
        Waste w(plinth, deeper);
        w.layer.floor_below = -base;
        w.job.cutting.rest_pattern = RestPattern::raster;
        LayerStock stock(w.cut.context, w.cut.layer, w.cut.solid, (25 + foot + beside) / 177.5);
        const CutterEnd wide{CutterEnd::Form::flat, 60, 0};
        const auto clear = [&](double x0, double y0, double x1, double y1, double z) {
            stock.cut_along(wide, {x0, y0, z}, {x1, y1, z});
        };
        clear(-80, 80.01, 80, 80.01, 0), clear(-80, -80.01, 80, -80.01, 0);
        for (double z = 0; z < kTop; ++z) {  // along the walls, but for the foot of one
            const double edge = foot - slope * z, other = z > 0 ? edge : foot + beside + 0.01;
            clear(-60 - edge, -80, -60 - edge, 80, z), clear(60 + other, -80, 60 + other, 80, z);
        }
        clear(60 + foot, -80, 60 + foot, 80, stands);
        const auto left = [&] { return stock.area_over(w.context, limit); };
        EXPECT_GT(left(), 39 * stock.grid().cell) << "a column beside the wall";
        const Operation op =
            cut_rest(w.cut, stock, w.layer.tools.finish, {OperationKind::finish, "rest", limit, false});
        EXPECT_EQ(op.moves.empty(), beside < limit);
        EXPECT_EQ(left() > 0, beside < limit);
    }
}

TEST(SemiRough, ReachesWhatStandsFarFromAnyWall) {
    // Beside one corner of the only peg a lump, and two far away, with nothing to cut between them.
    const auto peg = [](double x, double y) {
        return std::abs(x + 15) < 2 && std::abs(y + 15) < 2 ? kTop : 1.0;
    };
    const std::array<std::array<double, 2>, 3> lumps{{{-11, -11}, {3, 6}, {14, 15}}};
    Waste w(peg, {});
    LayerStock stock(w.cut.context, w.cut.layer, w.cut.solid, 0.2);
    const CellGrid& grid = stock.grid();
    const CutterEnd needle{CutterEnd::Form::flat, 0.1, 0};
    for (int j = 0; j < grid.ny; ++j)
        for (int i = 0; i < grid.nx; ++i) {
            const bool in_lump = std::any_of(lumps.begin(), lumps.end(), [&](const auto& l) {
                return std::hypot(grid.x(i) - l[0], grid.y(j) - l[1]) < 1;
            });
            if (!in_lump) stock.cut_at(needle, grid.x(i), grid.y(j), stock.surface(grid.index(i, j)));
        }
    const auto left = [&] { return stock.area_over(w.context, kLimit); };
    EXPECT_GT(left(), 8);
    const Operation op = semi_rough_layer(w.cut, stock, w.layer.tools.finish, {"waste", kLimit, 0, 0.3});
    EXPECT_FALSE(op.moves.empty());
    EXPECT_EQ(left(), 0);
}

// A wall that roughing kept off by less than the limit is as high as it was: it is taken step by step too.
TEST(SemiRough, TakesAThinSheetBesideAWall) {
    Waste w([](double x, double) { return x < 0 ? kTop : 4.0; },
            [](Mesh& mesh) {  // the wall, half a millimetre thick at its foot, is made upright
                for (Vec3f& v : mesh.vertices)
                    if (v.x == 0) v.x = -0.49F;
            });
    w.job.cutting.wall_allowance = 0.8;
    LayerStock stock(w.cut.context, w.cut.layer, w.cut.solid, 0.2);
    stock.cut(w.cut.context, rough_layer(w.cut).back(), w.layer.tools.rough);
    const CellGrid& grid = stock.grid();
    const auto stands = [&] {  // cells of the sheet
        std::size_t count = 0;
        for (int j = 0; j < grid.ny; ++j)
            for (int i = 0; i < grid.nx; ++i)
                if (std::abs(grid.y(j)) < 12 && grid.x(i) > -0.45 && grid.x(i) < 1)
                    count += stock.left(grid.index(i, j)) > kLimit;
        return count;
    };
    EXPECT_GT(stands(), 100U);
    Tool flat = w.layer.tools.finish;
    flat.kind = ToolKind::flat;
    const Operation op = cut_rest(w.cut, stock, flat, {OperationKind::semi_rough, "waste", kLimit, true});
    EXPECT_FALSE(op.moves.empty());
    EXPECT_EQ(stands(), 0U);
}

TEST(SemiRough, TheAllowanceIsAThirdOfRoughings) {
    Job job;
    Tool tool = tool_of_kind(job, ToolKind::ball);
    EXPECT_NEAR(semi_rough_allowance(job, tool, 1.0), 0.1, 1e-12);
    job.cutting.wall_allowance = 3, job.cutting.floor_allowance = 6;
    EXPECT_NEAR(semi_rough_allowance(job, tool, 1.0), 0.2, 1e-12) << "little of what is worth a visit";
    tool.diameter = 1;
    EXPECT_NEAR(semi_rough_allowance(job, tool, 1.0), 0.1, 1e-12) << "and of the cutter";
    job.cutting.floor_allowance = 0.05;
    EXPECT_EQ(semi_rough_allowance(job, tool, 1.0), 0) << "no more than the gouge tolerance";
}

}  // namespace
}  // namespace slabwright
