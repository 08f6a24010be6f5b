// Pieces that come loose: against flood filling after every move, hand-made moves, and a plan over an open
// cavity.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <queue>
#include <random>
#include <tuple>

#include "engine/planner/planner.h"
#include "engine/stock/layer_stock.h"
#include "engine/stock/loose.h"
#include "io/slabwright.h"
#include "kernels/mesh/weld.h"
#include "kernels/stock/sweep.h"
#include "tests/data/sweep.h"
#include "tests/support/places.h"
#include "tests/support/plate_with.h"
#include "tests/support/seed.h"

namespace slabwright {
namespace {

Loops rectangle(double x0, double y0, double x1, double y1) {
    Loops loops;
    loops.points = {{to_units(x0), to_units(y0)},
                    {to_units(x1), to_units(y0)},
                    {to_units(x1), to_units(y1)},
                    {to_units(x0), to_units(y1)}};
    loops.close_loop();
    return loops;
}

Move to(double x, double y, double z) { return {to_units(x), to_units(y), to_units(z), 1000}; }

// A frame of 60 mm around a cavity of 40: its cover hangs on the frame's inner edge.
struct Cover {
    HeldSlab slab;
    Tool tool;
    Operation op;
    Cover() {
        slab.min = {0, 0}, slab.max = {60, 60};
        slab.z_bottom = 10, slab.z_top = 20;
        slab.kept = subtract(rectangle(0, 0, 60, 60), rectangle(10, 10, 50, 50));
        tool.number = 1, tool.kind = ToolKind::flat, tool.diameter = 8;
        op.kind = OperationKind::rough;
        op.tool = 1;
    }
    void ring(double inset, double z) {
        op.moves.push_back({to_units(inset), to_units(inset), to_units(30), 0});
        op.moves.push_back(to(inset, inset, z));
        for (const auto& [x, y] :
             {std::pair{60 - inset, inset}, {60 - inset, 60 - inset}, {inset, 60 - inset}, {inset, inset}})
            op.moves.push_back(to(x, y, z));
        op.moves.push_back({to_units(inset), to_units(inset), to_units(30), 0});
    }
    std::vector<LoosePiece> run() {
        Context context;
        return loose_pieces(context, slab, {&op, 1}, {&tool, 1}, kChip, 0.5);
    }
};

TEST(Loose, CutAlongItsBorderFirstACoverFalls) {
    Cover cover;
    for (const double inset : {29.0, 26.0, 20.0, 14.0}) cover.ring(inset, 13);
    cover.ring(14, 10);
    cover.ring(20, 10);
    cover.ring(26, 10);
    const auto pieces = cover.run();
    ASSERT_EQ(pieces.size(), 1U);
    EXPECT_NEAR(pieces[0].area_mm2, 24 * 24, 20);
    EXPECT_NEAR(pieces[0].thickness_mm, 3, 1e-9);
    EXPECT_NEAR(pieces[0].x, 30, 0.5);
    EXPECT_NEAR(pieces[0].y, 30, 0.5);
    EXPECT_EQ(pieces[0].operation, 0U);
    EXPECT_EQ(pieces[0].move, 33U) << "the last side of the fifth ring";
}

TEST(Loose, FromTheMiddleOutwardsNothingFalls) {
    Cover cover;
    cover.ring(14, 13);
    for (const double inset : {29.0, 26.0, 20.0, 14.0}) cover.ring(inset, 10);
    EXPECT_TRUE(cover.run().empty());
}

TEST(Loose, WhatStandsGluedInTheMiddleHolds) {
    Cover cover;
    const Loops frame = cover.slab.kept;
    cover.slab.kept = unite(frame, rectangle(25, 25, 35, 35));
    cover.ring(14, 10);
    EXPECT_TRUE(cover.run().empty());
    cover.slab.kept = frame;
    const auto pieces = cover.run();
    ASSERT_EQ(pieces.size(), 1U);
    EXPECT_NEAR(pieces[0].thickness_mm, 10, 1e-9) << "nothing ever cut it";
}

// Every piece that is cut off, found by filling from what holds, move after move.
TEST(Loose, AgreesWithFillingAfterEveryMove) {
    const std::uint32_t seed = test::seed();
    std::mt19937 random(seed);
    auto at = [&] { return static_cast<double>(random() % 401) / 10; };
    std::size_t seen = 0;
    for (int round = 0; round < 60; ++round) {
        HeldSlab slab;
        slab.max = {40, 40};
        slab.z_top = 5;
        for (int k = 0; k < 3; ++k) {
            const double x = at() + 0.03, y = at() + 0.03;  // no edge through the middle of a cell
            slab.kept = unite(slab.kept, rectangle(x, y, x + 4, y + 4));
        }
        const double gx = at() + 0.03, gy = at() + 0.03;
        slab.kept = unite(slab.kept, rectangle(gx, gy, gx + 6, gy + 6));
        Tool tool;
        tool.number = 1, tool.diameter = 3.0137;  // no border through the middle of a cell either
        Operation op;
        op.kind = OperationKind::rough, op.tool = 1;
        for (int k = 0; k < 40; ++k) {
            Move m = to(at(), at(), random() % 3 == 0 ? static_cast<double>(random() % 5) : 0);
            if (k == 0 || random() % 6 == 0) m.feed = 0;
            op.moves.push_back(m);
        }
        Context context;
        const auto found = loose_pieces(context, slab, {&op, 1}, {&tool, 1}, 0.5, 1);

        const CellGrid grid{0.5, 0.5, 1, 40, 40};
        std::vector<char> there(grid.count(), 1), was_loose(grid.count(), 0);
        std::vector<double> height(grid.count(), 5);
        double top = 0;  // of the piece that was filled last
        auto loose_now = [&] {
            std::vector<char> held(grid.count(), 0);
            std::queue<std::size_t> open;
            for (int j = 0; j < 40; ++j)
                for (int i = 0; i < 40; ++i) {
                    const Point2 p{to_units(grid.x(i)), to_units(grid.y(j))};
                    const std::size_t c = grid.index(i, j);
                    if (there[c] && winding(slab.kept, p) > 0) held[c] = 1, open.push(c);
                }
            auto spread = [&](std::queue<std::size_t>& queue, std::vector<char>& mark) {
                std::size_t count = 0;
                top = 0;
                while (!queue.empty()) {
                    const std::size_t c = queue.front();
                    queue.pop();
                    ++count;
                    top = std::max(top, height[c]);
                    const auto i = static_cast<int>(c % 40), j = static_cast<int>(c / 40);
                    for (const auto& [x, y] : {std::pair{i - 1, j}, {i + 1, j}, {i, j - 1}, {i, j + 1}}) {
                        if (x < 0 || y < 0 || x > 39 || y > 39) continue;
                        const std::size_t n = grid.index(x, y);
                        if (there[n] && !mark[n]) mark[n] = 1, queue.push(n);
                    }
                }
                return count;
            };
            spread(open, held);
            std::vector<std::pair<std::size_t, double>> fresh;
            std::vector<char> mark = held;
            for (std::size_t c = 0; c < grid.count(); ++c) {
                if (!there[c] || mark[c]) continue;
                const bool known = was_loose[c];
                std::queue<std::size_t> queue;
                queue.push(c), mark[c] = 1;
                const std::size_t count = spread(queue, mark);
                if (!known) fresh.emplace_back(count, top);
            }
            for (std::size_t c = 0; c < grid.count(); ++c) was_loose[c] = there[c] && !held[c];
            return fresh;
        };
        (void)loose_now();
        std::vector<std::tuple<std::size_t, std::size_t, double>> expected, got;  // move, cells, height
        for (std::size_t i = 1; i < op.moves.size(); ++i) {
            const Move &a = op.moves[i - 1], &b = op.moves[i];
            if (b.feed == 0) continue;
            sweep(grid, cutter_end(tool), {to_mm(a.x), to_mm(a.y), to_mm(a.z)},
                  {to_mm(b.x), to_mm(b.y), to_mm(b.z)}, [&](std::size_t c, double z) {
                      height[c] = std::min(height[c], z);
                      if (z <= 0.01) there[c] = 0;
                  });
            for (const auto& [count, high] : loose_now()) expected.emplace_back(i, count, high);
        }
        for (const LoosePiece& p : found)
            got.emplace_back(p.move, static_cast<std::size_t>(std::lround(p.area_mm2)), p.thickness_mm);
        std::sort(expected.begin(), expected.end());
        std::sort(got.begin(), got.end());
        ASSERT_EQ(got.size(), expected.size()) << "round " << round;
        for (std::size_t k = 0; k < got.size(); ++k) {
            EXPECT_EQ(std::get<0>(got[k]), std::get<0>(expected[k])) << "round " << round;
            EXPECT_EQ(std::get<1>(got[k]), std::get<1>(expected[k])) << "round " << round;
            EXPECT_NEAR(std::get<2>(got[k]), std::get<2>(expected[k]), 1e-5) << "round " << round;
        }
        seen += got.size();
    }
    EXPECT_GT(seen, 20U) << "the moves cut nothing off";
}

// A box of two layers with a cavity that is open upwards through both: the second slab covers the first one's
// part of it.
TEST(Loose, ACoverOverACavityIsCutFromTheMiddle) {
    std::vector<Facet> facets;
    auto outline = [](double half_x, double half_y) {
        const std::vector<Corner> corners{
            {-half_x, -half_y, 10}, {half_x, -half_y, 10}, {half_x, half_y, 10}, {-half_x, half_y, 10}};
        return rounded_polygon(corners, 0.01);
    };
    const Outline outside = outline(60, 50), inside = outline(45, 35);
    const Ring bottom = ring(outside, {0, 0}), top = ring(outside, {0, 34}), rim = ring(inside, {0, 34}),
               floor = ring(inside, {0, 5});
    flat(facets, bottom, {}, false);
    strip(facets, bottom, top);
    flat(facets, top, {rim}, true);
    strip(facets, rim, floor);
    flat(facets, floor, {}, true);
    for (const bool flask : {false, true}) {
        Context context;
        const Mesh mesh = weld(context, facets);
        Job job;
        job.flask.enabled = flask;
        const Plan plan = make_plan(context, mesh, {}, job);
        ASSERT_EQ(plan.layers.size(), 2U);
        for (const Diagnostic& d : plan.diagnostics) EXPECT_NE(d.code, "waste.loose") << d.message;
    }
}

// Posts on a plate, two layers high: what lies between them in the second layer hangs over the first one's
// pockets, and the face mill clears it in rings, not all of which have another a step farther off beside them
// all the way round. Begun at the nearest point, rings of five of these patterns cut wedges off.
TEST(Loose, AFaceMillsRingsCloseBesideWhatIsClear) {
    auto outline = [](double x, double y, double half, double radius) {
        const std::vector<Corner> corners{{x - half, y - half, radius},
                                          {x + half, y - half, radius},
                                          {x + half, y + half, radius},
                                          {x - half, y + half, radius}};
        return rounded_polygon(corners, 0.01);
    };
    for (const unsigned seed : {8U, 25U, 27U, 31U, 38U, 41U}) {
        std::mt19937 random(seed);
        auto among = [&](double low, double high) {
            return low + (high - low) * static_cast<double>(random() % 1000) / 1000;
        };
        constexpr double half = 190;
        const Outline plate = outline(0, 0, half, 10);
        const Ring bottom = ring(plate, {0, 0}), edge = ring(plate, {0, 5});
        std::vector<Facet> facets;
        std::vector<Ring> feet;
        flat(facets, bottom, {}, false);
        strip(facets, bottom, edge);
        std::vector<std::array<double, 3>> posts;
        for (int k = 0; k < 60 && posts.size() < 9; ++k) {
            const double r = among(15, 30), x = among(-half + r + 5, half - r - 5),
                         y = among(-half + r + 5, half - r - 5);
            auto too_near = [&](const std::array<double, 3>& p) {
                return std::hypot(p[0] - x, p[1] - y) < (p[2] + r) * 1.2 + 20;
            };
            if (std::any_of(posts.begin(), posts.end(), too_near)) continue;
            posts.push_back({x, y, r});
            const Outline post = outline(x, y, r, 0.9 * r);
            feet.push_back(ring(post, {0, 5}));
            const Ring top = ring(post, {0, 34});
            strip(facets, feet.back(), top);
            flat(facets, top, {}, true);
        }
        flat(facets, edge, feet, true);
        Context context;
        const Plan plan = make_plan(context, weld(context, facets), {}, {});
        ASSERT_EQ(plan.layers.size(), 2U);
        const std::vector<Operation>& operations = plan.layers[1].operations;
        EXPECT_TRUE(std::any_of(operations.begin(), operations.end(),
                                [](const Operation& op) { return op.purpose == "open waste"; }));
        // And where a run begins in stock, the place beside it is gone to at once.
        for (const Operation& op : operations)
            for (std::size_t k = 2; op.kind == OperationKind::rough && k < op.moves.size(); ++k) {
                const Move &a = op.moves[k - 2], &b = op.moves[k - 1], &c = op.moves[k];
                const bool down = b.feed > 0 && a.x == b.x && a.y == b.y && b.z < a.z,
                           up = c.feed == 0 && b.x == c.x && b.y == c.y && c.z > b.z;
                EXPECT_FALSE(down && up) << op.purpose << ": down for nothing at " << to_mm(b.x) << " "
                                         << to_mm(b.y) << " " << to_mm(b.z);
            }
        for (const Diagnostic& d : plan.diagnostics)
            EXPECT_NE(d.code, "waste.loose") << seed << ": " << d.message;
    }
}

Outline plan_view(double x0, double y0, double x1, double y1) {
    const std::vector<Corner> corners{{x0, y0, 3}, {x1, y0, 3}, {x1, y1, 3}, {x0, y1, 3}};
    return rounded_polygon(corners, 0.01);
}

// A table on two walls, between which a cone hangs down to 6 mm over the board: in layer 1 it stands by
// itself, on wood that stays filled down to the board and is glued to it.
TEST(Loose, WhatStaysFilledUnderAnOverhangIsGlued) {
    std::vector<Facet> facets;
    const Outline table = plan_view(0, 0, 200, 100);
    const Ring under = ring(table, {0, 30}), over = ring(table, {0, 40});
    std::vector<Ring> hanging;
    for (const double x : {8.0, 172.0}) {
        const Outline wall = plan_view(x, 10, x + 20, 90);
        const Ring foot = ring(wall, {0, 0});
        hanging.push_back(ring(wall, {0, 30}));
        flat(facets, foot, {}, false);
        strip(facets, foot, hanging.back());
    }
    const Ring rim = ring(circle(100, 50, 40, 0.05), {0, 30});
    hanging.push_back(rim);
    fan(facets, Ring(rim.rbegin(), rim.rend()), {100, 50, 6});
    flat(facets, under, hanging, false);
    strip(facets, under, over);
    flat(facets, over, {}, true);
    Context context;
    Job job;
    job.allow_undercut = true;
    const Plan plan = make_plan(context, weld(context, facets), {}, job);
    const Layer& first = plan.layers.front();
    const double radius = 40.0 / 24 * (first.z_top - 6);  // of the cone where the layer ends
    ASSERT_GT(radius, 5);
    EXPECT_NEAR(first.joints.front().standing_mm2, 2 * 20 * 80 + std::numbers::pi * radius * radius, 30);
    for (const Diagnostic& d : plan.diagnostics) EXPECT_NE(d.code, "waste.loose") << d.message;
}

// The flat that a boundary lies on is rough in its fourth decimal, as a mended mesh is. No glue is put on it,
// and what roughing left over it would lie there by itself.
TEST(Loose, WhatLiesOnTheBoundarysFlatIsRoughedAway) {
    const std::uint32_t seed = test::seed();
    std::mt19937 random(seed);
    for (int round = 0; round < 3; ++round) {
        const double x = static_cast<double>(random() % 100) - 100,
                     y = static_cast<double>(random() % 100) - 50;
        const Outline plate = plan_view(-150, -100, 150, 100), post = plan_view(x, y, x + 30, y + 30);
        Context context;
        Mesh mesh = weld(context, test::plate_with(plate, 15, post, 30));
        for (Vec3f& v : mesh.vertices)
            if (v.z == 15) v.z += static_cast<float>(random() % 9) * 1e-4F;
        const Plan plan = make_plan(context, mesh, {}, {});
        ASSERT_EQ(plan.layers.size(), 2U);
        for (const Operation& op : plan.layers[1].operations) EXPECT_NE(op.purpose, "floors") << seed;
        for (const Diagnostic& d : plan.diagnostics)
            EXPECT_NE(d.code, "waste.loose") << seed << ": " << d.message;
    }
}

// Between boss and dome of the pump cover the finishing ball cuts off .8 mm of 29 mm²: the extraction's.
TEST(Loose, AFilmIsANote) {
    Context context;
    const Plan made = plan(context, support::checkout("tests/data/pump-cover.stl"), default_job());
    std::size_t films = 0;
    for (const Diagnostic& d : made.diagnostics) {
        if (d.code != "waste.loose") continue;
        ++films;
        EXPECT_EQ(d.severity, Severity::note) << d.message;
    }
    EXPECT_GT(films, 0U);
}

}  // namespace
}  // namespace slabwright
