// In which order runs are cut, and how a cutter goes from one to the next: levels from the top only where
// they lie beside each other, flats in one hop or on one slope, no more over a slope than they may.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <random>
#include <utility>
#include <vector>

#include "engine/paths/operations/rest.h"
#include "engine/paths/runs/chains.h"
#include "engine/paths/runs/level_runs.h"
#include "engine/stock/layer_stock.h"
#include "tests/support/height_field.h"
#include "tests/support/seed.h"

using namespace slabwright;

namespace {

constexpr double kTop = 15, kOver = 0.0025;

// Hills on 20 x 20 mm.
struct Hills {
    Context context;
    Mesh mesh;
    Job job;
    LayerJob layer;
    LayerCut cut;

    explicit Hills(const std::function<double(double, double)>& height)
        : mesh(test::height_field(context, 40, 0.5, height)),
          layer(),
          cut{context, layer, job, layer_solid(context, mesh.view(), 0, kTop), kTop, {}, {}, nullptr, {}} {
        layer.mesh = mesh.view();
        layer.job = &job;
        layer.z_top = kTop;
        layer.slab_thickness = kTop;
        layer.stock_min = {-15, -15};
        layer.stock_max = {15, 15};
    }
    [[nodiscard]] Tool flat(double diameter) const {
        Tool tool = tool_of_kind(job, ToolKind::flat);
        tool.diameter = diameter;
        return tool;
    }
};

double waves(double x, double y) { return 4 + 1.5 * std::sin(x / 2.3) + 1.5 * std::cos(y / 3.1); }

// The least distance of two lines seen from above, mm.
double apart(const std::vector<PathPoint>& a, const std::vector<PathPoint>& b) {
    double least = 1e300;
    const auto places = [](const std::vector<PathPoint>& line) {
        std::vector<std::array<double, 2>> all;
        for (std::size_t k = 1; k < line.size(); ++k)
            for (int s = 0; s <= 12; ++s)
                all.push_back({to_mm(line[k - 1].x) + s * to_mm(line[k].x - line[k - 1].x) / 12,
                               to_mm(line[k - 1].y) + s * to_mm(line[k].y - line[k - 1].y) / 12});
        return all;
    };
    const auto there = places(b);
    for (const auto& p : places(a))
        for (const auto& q : there) least = std::min(least, std::hypot(p[0] - q[0], p[1] - q[1]));
    return least;
}

// The middle of a flat cutter along moves that feed, every .02 mm.
template <class Visit>
void along(const std::vector<PathPoint>& line, const Visit& visit) {
    for (std::size_t k = 1; k < line.size(); ++k) {
        const PathPoint &a = line[k - 1], &b = line[k];
        const double l = std::hypot(to_mm(b.x - a.x), to_mm(b.y - a.y), to_mm(b.z - a.z));
        const int n = 1 + static_cast<int>(l / 0.02);
        for (int s = 0; s <= n; ++s) {
            const double t = static_cast<double>(s) / n;
            visit(to_mm(a.x) + t * to_mm(b.x - a.x), to_mm(a.y) + t * to_mm(b.y - a.y),
                  to_mm(a.z) + t * to_mm(b.z - a.z));
        }
    }
}

}  // namespace

TEST(LevelOrder, NothingIsCutUnderWhatStillStandsBesideIt) {
    std::mt19937 random(test::seed());
    const Hills hills([](double, double) { return 1.0; });
    const Tool tool = hills.flat(6);
    const DropIndex part(hills.cut.solid, flat_cutter(3));
    std::uniform_real_distribution<double> at(-200, 200), by(-9, 9);
    for (int round = 0; round < 6; ++round) {
        std::vector<std::vector<LevelRun>> levels(8);
        std::vector<std::pair<std::size_t, std::vector<PathPoint>>> all;
        for (std::size_t l = 0; l < levels.size(); ++l)
            for (int k = 0; k < 40; ++k) {
                const double x = at(random), y = at(random) / 8;
                const std::int32_t z = to_units(12 - static_cast<double>(l));
                LevelRun run;
                run.points = {{to_units(x), to_units(y), z},
                              {to_units(x + by(random)), to_units(y + by(random)), z}};
                all.push_back({l, run.points});
                levels[l].push_back(std::move(run));
            }
        Operation op;
        PathBuilder path(op, tool, 3000, kTop + 10, kTop + 2);
        cut_levels(path, hills.cut, tool, part, levels, false,
                   round % 2 == 0 ? LevelWays::climbing : LevelWays::either);
        path.finish();
        std::vector<std::size_t> cut_at;
        for (const auto& each : all) {
            const PathPoint& start = each.second.front();
            const auto found = std::find_if(op.moves.begin(), op.moves.end(), [&](const Move& m) {
                return m.x == start.x && m.y == start.y && m.z == start.z;
            });
            ASSERT_NE(found, op.moves.end());
            cut_at.push_back(static_cast<std::size_t>(found - op.moves.begin()));
        }
        int beside = 0, before = 0;
        for (std::size_t a = 0; a < all.size(); ++a)
            for (std::size_t b = 0; b < all.size(); ++b) {
                if (all[a].first >= all[b].first) continue;
                before += cut_at[b] < cut_at[a];
                if (apart(all[a].second, all[b].second) > tool.diameter) continue;
                ++beside;
                ASSERT_LT(cut_at[a], cut_at[b]) << "levels " << all[a].first << ' ' << all[b].first;
            }
        EXPECT_GT(beside, 100);
        EXPECT_GT(before, 1000) << "far from each other they wait for nothing";
    }
}

// Two pits joined by a long groove at their top: each is cut down to its floor before the other.
TEST(LevelOrder, PitsAreCutOneAfterTheOther) {
    const Hills hills([](double, double) { return 1.0; });
    const Tool tool = hills.flat(6);
    const DropIndex part(hills.cut.solid, flat_cutter(3));
    std::vector<std::vector<LevelRun>> levels(10);
    for (std::size_t l = 0; l < levels.size(); ++l) {
        const std::int32_t z = to_units(12 - static_cast<double>(l));
        const auto add = [&](double x0, double x1) {
            LevelRun run;
            run.points = {{to_units(x0), 0, z}, {to_units(x1), 0, z}};
            levels[l].push_back(run);
        };
        if (l == 0) add(-100, 100);
        else add(-100, -90), add(90, 100);
    }
    Operation op;
    PathBuilder path(op, tool, 3000, kTop + 10, kTop + 2);
    cut_levels(path, hills.cut, tool, part, levels, false, LevelWays::climbing);
    path.finish();
    int crossings = 0;
    for (std::size_t k = 1; k < op.moves.size(); ++k)
        crossings += (op.moves[k - 1].x < 0) != (op.moves[k].x < 0);
    EXPECT_EQ(crossings, 2) << "the groove, and back to the other pit";
}

// A slope that is cut climbing is gone back over after each level; to and fro the next level begins where the
// last has ended. Whichever way, each run is cut once, from end to end.
TEST(LevelOrder, OpenRunsOfASlopeAreCutToAndFroWhereTheyNeedNotClimb) {
    const Hills hills([](double, double) { return 1.0; });
    const Tool tool = hills.flat(6);
    const DropIndex part(hills.cut.solid, flat_cutter(3));
    for (const LevelWays ways : {LevelWays::climbing, LevelWays::either}) {
        std::vector<std::vector<LevelRun>> levels(10);
        for (std::size_t l = 0; l < levels.size(); ++l) {
            const std::int32_t y = to_units(-1 + 0.2 * static_cast<double>(l)),
                               z = to_units(12 - static_cast<double>(l));
            levels[l].push_back({{{to_units(-50), y, z}, {0, y, z}, {to_units(50), y, z}}, false});
        }
        Operation op;
        PathBuilder path(op, tool, 3000, kTop + 10, kTop + 2);
        cut_levels(path, hills.cut, tool, part, levels, false, ways);
        path.finish();
        double over = 0, cut = 0, backwards = 0;
        bool has_cut = false;
        for (std::size_t k = 1; k < op.moves.size(); ++k) {
            const Move &a = op.moves[k - 1], &b = op.moves[k];
            const double way = std::hypot(to_mm(b.x - a.x), to_mm(b.y - a.y));
            if (b.feed == 0) over += has_cut ? way : 0;
            else if (a.z == b.z) cut += way, has_cut = true, backwards += b.x < a.x ? way : 0;
        }
        EXPECT_NEAR(cut, 1000, 1e-6);
        if (ways == LevelWays::climbing) {
            EXPECT_GT(over, 900);
            EXPECT_EQ(backwards, 0);
        } else {
            EXPECT_LT(over, 5);
            EXPECT_NEAR(backwards, 500, 1e-6) << "every other run";
        }
    }
}

TEST(Chains, AFlatGoesToTheNextRunOnOneSlopeOrInOneHop) {
    std::mt19937 random(test::seed());
    const Hills hills(waves);
    const DropIndex part(hills.cut.solid, flat_cutter(1.5));
    const Slide slide{.part = &part, .ball = false, .chord = 0.2, .top = kTop, .hops = true};
    std::uniform_real_distribution<double> at(-7, 7), by(-2, 2);
    int slopes = 0, hops = 0;
    for (int round = 0; round < 300; ++round) {
        std::vector<std::vector<PathPoint>> runs(2);
        double x = at(random), y = at(random);
        for (std::vector<PathPoint>& run : runs) {
            run.push_back({to_units(x), to_units(y), to_units(part.drop(x, y).tip_z) + 1});
            x += by(random), y += by(random);
        }
        const auto chains = chained(runs, slide);
        ASSERT_EQ(chains.size(), 1U);
        ASSERT_EQ(chains[0].front(), runs[0].front());
        ASSERT_EQ(chains[0].back(), runs[1].front());
        EXPECT_LE(chains[0].size(), 4U);
        (chains[0].size() == 2 ? slopes : hops) += 1;
        along(chains[0], [&](double px, double py, double pz) {
            ASSERT_GE(pz, part.drop(px, py).tip_z - kOver - 1e-3) << "round " << round;
        });
    }
    EXPECT_GT(slopes, 20);
    EXPECT_GT(hops, 20);
}

TEST(Chains, ABallGoesToTheNextRunOnTheSurfaceOrInOneHop) {
    std::mt19937 random(test::seed());
    const Hills hills([](double x, double y) { return 2 * waves(x, y) - 1; });
    constexpr double chord = 0.2, radius = 1.5, cuts = chord * chord / (8 * radius);
    const DropIndex part(hills.cut.solid, ball_cutter(radius));
    const Slide slide{.part = &part, .chord = chord, .top = kTop, .hops = true};
    std::uniform_real_distribution<double> at(-7, 7), by(-2, 2);
    int along_surface = 0, hops = 0;
    for (int round = 0; round < 300; ++round) {
        std::vector<std::vector<PathPoint>> runs(2);
        double x = at(random), y = at(random);
        for (std::vector<PathPoint>& run : runs) {
            run.push_back({to_units(x), to_units(y), to_units(part.drop(x, y).tip_z) + 1});
            x += by(random), y += by(random);
        }
        const auto chains = chained(runs, slide);
        ASSERT_EQ(chains.size(), 1U);
        const std::vector<PathPoint>& way = chains[0];
        int upright = 0;
        for (std::size_t k = 1; k < way.size(); ++k)
            upright += way[k - 1].x == way[k].x && way[k - 1].y == way[k].y;
        EXPECT_LE(upright, 2);
        EXPECT_TRUE(upright == 0 || way.size() <= 4) << way.size();
        (upright > 0 ? hops : along_surface) += 1;
        along(way, [&](double px, double py, double pz) {
            ASSERT_GE(pz, part.drop(px, py).tip_z - cuts - 1e-3) << "round " << round;
        });
    }
    EXPECT_GT(along_surface, 20);
    EXPECT_GT(hops, 20);
}

// A slope's places are too far apart for a safe chord where it is steep; the way between them is the slope,
// no stairs over it.
TEST(Chains, ABallFollowsSteepSlopesBetweenItsPlaces) {
    constexpr double chord = 0.2, radius = 1.5, cuts = chord * chord / (8 * radius);
    const std::function<double(double, double)> plane = [](double x, double y) { return 7 + x - 0.3 * y; },
                                                hills = [](double x, double y) {
                                                    return 2 * waves(x, y) - 1;
                                                };
    for (const auto& height : {plane, hills}) {
        const Hills of(height);
        const DropIndex part(of.cut.solid, ball_cutter(radius));
        const Slide slide{.part = &part, .chord = chord, .top = 2 * kTop};
        int upright = 0, places = 0;
        for (double y = -4; y <= 4; y += 0.7) {
            std::vector<PathPoint> line;
            for (double x = -5; x <= 5; x += 0.19, ++places)
                append_free(line, {to_units(x), to_units(y), to_units(part.drop(x, y).tip_z) + 1}, slide);
            for (std::size_t k = 1; k < line.size(); ++k)
                upright += line[k - 1].x == line[k].x && line[k - 1].y == line[k].y;
            along(line, [&](double px, double py, double pz) {
                ASSERT_GE(pz, part.drop(px, py).tip_z - cuts - 1e-3);
            });
        }
        EXPECT_GT(places, 600);
        EXPECT_LT(upright, places / 20);
    }
}

// Ways a little over bent slopes are longer than those that keep to them, and stairs are few.
TEST(RestWays, AFlatGoesStraightALittleOverSlopes) {
    Hills hills(waves);
    hills.layer.tools.rough = hills.flat(12);
    const Tool tool = hills.flat(3);
    LayerStock stock(hills.context, hills.layer, hills.cut.solid, 0.25);
    for (double y = -9; y <= 9; y += 0.25)  // the wood stands .4 mm over the hills
        for (double x = -9; x <= 9; x += 0.25)
            stock.cut_at(cutter_end(hills.flat(0.5)), x, y, waves(x, y) + 0.4);
    const Operation op =
        cut_rest(hills.cut, stock, tool, {OperationKind::corner, "corners", 0.06, false, 0, 0});
    ASSERT_GT(op.moves.size(), 100U);
    const DropIndex part(hills.cut.solid, flat_cutter(1.5));
    double length = 0, stairs = 0;
    for (std::size_t k = 1; k < op.moves.size(); ++k) {
        const Move &a = op.moves[k - 1], &b = op.moves[k];
        if (b.feed == 0 || b.is_arc() || std::hypot(to_mm(b.x), to_mm(b.y)) > 8) continue;
        const double far = std::hypot(to_mm(b.x - a.x), to_mm(b.y - a.y));
        length += far;
        const double mx = to_mm(a.x) / 2 + to_mm(b.x) / 2, my = to_mm(a.y) / 2 + to_mm(b.y) / 2,
                     mz = to_mm(a.z) / 2 + to_mm(b.z) / 2;
        ASSERT_GE(mz, part.drop(mx, my).tip_z - hills.job.tolerances.gouge) << mx << ' ' << my;
        if (a.z == b.z && far < 0.5) stairs += far;
    }
    EXPECT_LT(stairs, 0.1 * length);
    EXPECT_GT(length / static_cast<double>(op.moves.size()), 0.15) << "mm a move; .11 without going over";
}
