// Cutters with a core without edges go down where nothing stands under it, or gently: random runs through a
// path builder, whole plans of random pockets and islands, and two castings. What counts is told by the
// proof's own CoreContact, over a stock that the moves cut.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <random>

#include "engine/paths/runs/layer_cut.h"
#include "engine/planner/planner.h"
#include "engine/simulate/core_contact.h"
#include "io/slabwright.h"
#include "tests/support/height_field.h"
#include "tests/support/seed.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

constexpr double kTop = 15;

// Runs moves over a stock; what the core came down on.
CoreContact::Findings contact_of(const std::vector<Move>& moves, const Tool& tool, Stock& stock) {
    CoreContact core(tool, stock.grid());
    const CutterEnd end{tool.kind == ToolKind::ball ? CutterEnd::Form::ball : CutterEnd::Form::flat,
                        tool.diameter / 2, 0};
    for (std::size_t k = 1; k < moves.size(); ++k) {
        const Move &a = moves[k - 1], &b = moves[k];
        std::vector<std::array<double, 2>> places{{to_mm(a.x), to_mm(a.y)}};
        if (b.is_arc()) {
            const ArcShape arc = arc_shape(a, b);
            const int chords = 1 + static_cast<int>(arc.length() / 0.5);
            for (int c = 1; c < chords; ++c) {
                const double turn = arc.start + arc.sweep * c / chords;
                places.push_back({arc.x + arc.radius * std::cos(turn), arc.y + arc.radius * std::sin(turn)});
            }
        }
        places.push_back({to_mm(b.x), to_mm(b.y)});
        for (std::size_t p = 1; p < places.size(); ++p) {
            const ProgramStep from{
                places[p - 1][0], places[p - 1][1], p == 1 ? to_mm(a.z) : to_mm(b.z), 1, 0, true};
            const ProgramStep to{places[p][0],
                                 places[p][1],
                                 to_mm(b.z),
                                 static_cast<double>(b.feed),
                                 static_cast<std::uint32_t>(k),
                                 true};
            if (core.watches() && core.concerns(stock, from, to)) core.follow(stock, from, to);
            stock.cut(end, {from.x, from.y, from.z}, {to.x, to.y, to.z});
        }
    }
    return core.findings();
}

CellGrid grid_over(const std::array<double, 2>& low, const std::array<double, 2>& high, double cell) {
    return {low[0] + cell / 2, low[1] + cell / 2, cell,
            static_cast<int>(std::ceil((high[0] - low[0]) / cell)),
            static_cast<int>(std::ceil((high[1] - low[1]) / cell))};
}

// A box of 40 × 40 × 15 mm in stock of 300 × 300 mm, of which some has been cleared already.
struct Bench {
    static constexpr double kHalf = 150, kBox = 20;
    Context context;
    Mesh mesh;
    LayerJob layer;
    Job job;
    Tool tool;
    LayerCut cut;
    Standing standing{{-kHalf, -kHalf}, {kHalf, kHalf}, kTop};
    Stock stock{grid_over({-kHalf, -kHalf}, {kHalf, kHalf}, 0.5)};
    DropIndex part;
    Operation operation;

    explicit Bench(const Tool& with)
        : mesh(test::height_field(context, 1, 2 * kBox, [](double, double) { return kTop; })),
          layer(),
          tool(with),
          cut{context, layer, job, layer_solid(context, mesh.view(), 0, kTop), kTop, {}, {}, nullptr, {}},
          part(cut.solid, flat_cutter(with.diameter / 2)) {
        layer.mesh = mesh.view();
        layer.job = &job;
        layer.z_top = kTop;
        layer.stock_min = {-kHalf, -kHalf};
        layer.stock_max = {kHalf, kHalf};
        cut.standing = &standing;
        stock.add_slab(0, kTop);
    }
    void slot(double radius, const std::array<double, 3>& from, const std::array<double, 3>& to) {
        standing.cut(flat_cutter(radius), from, to);
        stock.cut({CutterEnd::Form::flat, radius, 0}, from, to);
    }
    [[nodiscard]] bool free(const PathPoint& a, const PathPoint& b) const {
        const double way = std::hypot(to_mm(b.x) - to_mm(a.x), to_mm(b.y) - to_mm(a.y));
        const int steps = 1 + static_cast<int>(way);
        for (int k = 0; k <= steps; ++k) {
            const double t = static_cast<double>(k) / steps;
            if (part.stands_over(to_mm(a.x) + t * (to_mm(b.x) - to_mm(a.x)),
                                 to_mm(a.y) + t * (to_mm(b.y) - to_mm(a.y)), to_mm(std::min(a.z, b.z))))
                return false;
        }
        return true;
    }
};

std::vector<Tool> cored_tools() {
    const Job job;
    std::vector<Tool> tools{tool_of_kind(job, ToolKind::face), tool_of_kind(job, ToolKind::flat)};
    tools.push_back(tools[0]), tools.back().core_diameter = 25;
    tools.push_back(tools[1]), tools.back().core_diameter = 9, tools.back().ramp_deg = 4;
    return tools;
}

// Lines and rings of any size and anywhere, at one height or stepping down on the way.
std::vector<PathPoint> random_run(std::mt19937& random) {
    std::uniform_real_distribution<double> unit(0, 1);
    const double z = 3 + 11 * unit(random), x = 320 * unit(random) - 160, y = 320 * unit(random) - 160;
    std::vector<PathPoint> run;
    const double size = std::exp(std::log(0.3) + std::log(400.0) * unit(random));
    const int kind = static_cast<int>(3 * unit(random));
    if (kind == 0) {
        const int n = 24, sense = unit(random) < 0.5 ? 1 : -1;
        for (int k = 0; k <= n; ++k) {
            const double turn = sense * 2 * std::numbers::pi * (k % n) / n;
            run.push_back({to_units(x + size / 2 * std::cos(turn)), to_units(y + size / 2 * std::sin(turn)),
                           to_units(z)});
        }
        return run;
    }
    double down = z;
    run.push_back({to_units(x), to_units(y), to_units(z)});
    for (int k = 1; k <= 5; ++k) {
        run.push_back({run.back().x + to_units(size * (unit(random) - 0.5)),
                       run.back().y + to_units(size * (unit(random) - 0.5)), to_units(down)});
        if (kind == 2 && unit(random) < 0.4) {
            down = std::max(1.0, down - 3 * unit(random));
            run.push_back({run.back().x, run.back().y, to_units(down)});
        }
    }
    return run;
}

// As places on the surface follow each other in a corner: level, then a little down, again and again, in
// steps that each seem to meet next to nothing.
std::vector<PathPoint> random_stairs(std::mt19937& random) {
    std::uniform_real_distribution<double> unit(0, 1);
    const double step = 0.1 + 0.5 * unit(random), fall = 0.02 + 0.17 * unit(random),
                 turn = 2 * std::numbers::pi * unit(random);
    double x = 320 * unit(random) - 160, y = 320 * unit(random) - 160, z = 6 + 9 * unit(random);
    std::vector<PathPoint> run{{to_units(x), to_units(y), to_units(z)}};
    for (int k = 0; k < 30 && z > 1; ++k) {
        x += step * std::cos(turn), y += step * std::sin(turn);
        run.push_back({to_units(x), to_units(y), to_units(z)});
        z -= fall;
        run.push_back({to_units(x), to_units(y), to_units(z)});
    }
    return run;
}

TEST(Plunge, NoRunIsEnteredOnItsCore) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> unit(0, 1);
    std::size_t left_out = 0, followed = 0, sloping = 0;
    for (int round = 0; round < 24; ++round)
        for (const Tool& tool : cored_tools()) {
            SCOPED_TRACE(tool.name + " core " + std::to_string(core_diameter_of(tool)));
            Bench bench(tool);
            for (int k = 0; k < 12; ++k) {
                const double x = 300 * unit(random) - 150, y = 300 * unit(random) - 150,
                             z = 2 + 12 * unit(random), r = 2 + 30 * unit(random);
                bench.slot(r, {x, y, z}, {x + 80 * (unit(random) - 0.5), y + 80 * (unit(random) - 0.5), z});
            }
            PathBuilder path(bench.operation, tool, 3000, kTop + 10, kTop + 2);
            Surroundings around = bench.cut.around(tool, &bench.part);
            around.from_side = tool.kind == ToolKind::face && round % 2 == 0;
            path.set_surroundings(around);
            for (int k = 0; k < 13; ++k) {
                const std::vector<PathPoint> run =
                    k == 3 && round % 3 == 0 ? random_stairs(random) : random_run(random);
                bool free = true;
                for (std::size_t p = 1; p < run.size() && free; ++p) free = bench.free(run[p - 1], run[p]);
                if (!free) continue;
                path.follow(run);
                ++followed;
            }
            path.finish();
            left_out += bench.cut.no_way_in.size();
            const std::vector<Move>& moves = bench.operation.moves;
            for (std::size_t k = 1; k < moves.size(); ++k)
                sloping += moves[k].z < moves[k - 1].z &&
                           (moves[k].x != moves[k - 1].x || moves[k].y != moves[k - 1].y);
            const CoreContact::Findings found = contact_of(moves, tool, bench.stock);
            EXPECT_EQ(found.cells, 0U)
                << "round " << round << ", " << found.deepest << " mm at x " << found.where[0] << " y "
                << found.where[1] << " z " << found.z << ", move " << found.line << " of " << moves.size();
        }
    EXPECT_GT(followed, 500U);
    EXPECT_LT(left_out, followed / 2) << "most have room for a helix or a ramp";
    EXPECT_GT(sloping, 1000U);
}

// Where a level above found no way in, more stands than a run may cut at once: it comes down in steps, or
// stays away.
TEST(Plunge, NoRunCutsDeeperThanItMay) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> unit(0, 1);
    std::size_t cuts = 0;
    for (int round = 0; round < 30; ++round) {
        const Tool tool = cored_tools()[1];
        Bench bench(tool);
        PathBuilder path(bench.operation, tool, 3000, kTop + 10, kTop + 2);
        Surroundings around = bench.cut.around(tool, &bench.part);
        around.deepest = 3.5;
        path.set_surroundings(around);
        for (int k = 0; k < 4; ++k) {
            // Rings about as wide as the cutter: some have room for a ramp.
            const double x = 60 + 60 * unit(random), y = 200 * unit(random) - 100, r = 0.5 + 8 * unit(random);
            std::vector<PathPoint> ring;
            for (int a = 0; a <= 24; ++a) {
                const double turn = 2 * std::numbers::pi * (a % 24) / 24;
                ring.push_back({to_units(x + r * std::cos(turn)), to_units(y + r * std::sin(turn)),
                                to_units(2 + 2.5 * k)});
            }
            path.follow(ring);
        }
        path.finish();
        const std::vector<Move>& moves = bench.operation.moves;
        for (std::size_t k = 1; k < moves.size(); ++k) {
            const Move &a = moves[k - 1], &b = moves[k];
            const std::array<double, 3> from{to_mm(a.x), to_mm(a.y), to_mm(a.z)},
                to{to_mm(b.x), to_mm(b.y), to_mm(b.z)};
            const CellGrid& grid = bench.stock.grid();
            double deepest = 0;
            sweep(
                grid, {CutterEnd::Form::flat, tool.diameter / 2 - 1.5, 0}, from, to,
                [&](std::size_t cell, double z) { deepest = std::max(deepest, bench.stock.top(cell) - z); });
            EXPECT_LE(deepest, around.deepest + PathBuilder::kBite + 0.05) << round << " move " << k;
            cuts += deepest > 0.5;
            bench.stock.cut({CutterEnd::Form::flat, tool.diameter / 2, 0}, from, to);
        }
    }
    EXPECT_GT(cuts, 500U);
}

// Over a part of a long straight way more stands than may be cut at once: all of it is cut, there in steps.
TEST(Plunge, NoneOfAWayIsLeftOutWhereMoreStandsOverIt) {
    const Tool tool = cored_tools()[1];
    Bench bench(tool);
    const double r = tool.diameter / 2, y = -60, z = 7;
    bench.slot(r + 2, {-160, y, 10}, {0, y, 10});
    bench.slot(r + 2, {60, y, 10}, {160, y, 10});
    PathBuilder path(bench.operation, tool, 3000, kTop + 10, kTop + 2);
    Surroundings around = bench.cut.around(tool, &bench.part);
    around.deepest = 3.5;
    path.set_surroundings(around);
    std::vector<PathPoint> run;
    for (const double x : {-140.0, -90.0, 90.0, 140.0})
        run.push_back({to_units(x), to_units(y), to_units(z)});
    path.follow(run);
    path.finish();
    EXPECT_TRUE(bench.cut.no_way_in.empty());
    const std::vector<Move>& moves = bench.operation.moves;
    for (std::size_t k = 1; k < moves.size(); ++k)
        bench.stock.cut({CutterEnd::Form::flat, r, 0},
                        {to_mm(moves[k - 1].x), to_mm(moves[k - 1].y), to_mm(moves[k - 1].z)},
                        {to_mm(moves[k].x), to_mm(moves[k].y), to_mm(moves[k].z)});
    for (double x = -140; x <= 140; x += 1) {
        const CellGrid& grid = bench.stock.grid();
        const std::size_t cell = grid.index(static_cast<int>(std::lround((x - grid.x(0)) / grid.cell)),
                                            static_cast<int>(std::lround((y - grid.y(0)) / grid.cell)));
        EXPECT_NEAR(bench.stock.top(cell), z, 1e-4) << "x " << x;
    }
}

// A run too short for the core is left out, and said to be; one as long as the core is wide is not.
TEST(Plunge, ARampAsLongAsTheCoreIsWide) {
    for (const double length : {12.0, 30.0, 60.0}) {
        Bench bench(cored_tools()[0]);
        PathBuilder path(bench.operation, bench.tool, 3000, kTop + 10, kTop + 2);
        Surroundings around = bench.cut.around(bench.tool, &bench.part);
        Loops room;  // no wider than the run: no helix
        room.points = {{to_units(-101), to_units(99)},
                       {to_units(-99 + length), to_units(99)},
                       {to_units(-99 + length), to_units(101)},
                       {to_units(-101), to_units(101)}};
        room.close_loop();
        around.room = std::make_shared<const Loops>(room);
        path.set_surroundings(around);
        path.follow(std::vector<PathPoint>{{to_units(-100), to_units(100), to_units(11)},
                                           {to_units(-100 + length), to_units(100), to_units(11)}});
        path.finish();
        EXPECT_EQ(bench.cut.no_way_in.size(), length < 40 ? 1U : 0U) << length;
        EXPECT_EQ(contact_of(bench.operation.moves, bench.tool, bench.stock).cells, 0U) << length;
    }
}

// Where the cutter's middle may be: a rectangle of `length` × `width` (mm) around a place, turned.
std::shared_ptr<const Loops> narrow_room(double x, double y, double turn, double length, double width) {
    Loops room;
    for (const auto& [u, v] : {std::pair{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}}) {
        const double along = u * length, across = v * width;
        room.points.push_back({to_units(x + along * std::cos(turn) - across * std::sin(turn)),
                               to_units(y + along * std::sin(turn) + across * std::cos(turn))});
    }
    room.close_loop();
    return std::make_shared<const Loops>(std::move(room));
}

// A run that begins in a corner of a narrow room and rises at once has neither a helix nor a ramp of its own:
// it is entered where beside it there is room for one.
TEST(Plunge, ANarrowRoomIsEnteredBesideItsRuns) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> unit(0, 1);
    for (int round = 0; round < 60; ++round) {
        const Tool tool = cored_tools()[1];
        Bench bench(tool);
        const double r = tool.diameter / 2, x = 50 + 60 * unit(random), y = 200 * unit(random) - 100,
                     turn = 2 * std::numbers::pi * unit(random), length = (1 + 3 * unit(random)) * r,
                     width = (0.3 + 1.5 * unit(random)) * r, z = 2 + 10 * unit(random);
        SCOPED_TRACE(testing::Message() << "round " << round << ": " << length << " x " << width << " mm");
        Surroundings around = bench.cut.around(tool, &bench.part);
        around.room = narrow_room(x, y, turn, length, width);
        PathBuilder path(bench.operation, tool, 3000, kTop + 10, kTop + 2);
        path.set_surroundings(around);
        const double along = 0.5 * length - 0.1, across = 0.5 * width - 0.1;
        const PathPoint corner{to_units(x + along * std::cos(turn) - across * std::sin(turn)),
                               to_units(y + along * std::sin(turn) + across * std::cos(turn)), to_units(z)};
        path.follow(std::vector<PathPoint>{corner, {corner.x, corner.y, to_units(z + 1)}});
        EXPECT_EQ(path.left_out(), 0U);
        path.finish();
        const std::vector<Move>& moves = bench.operation.moves;
        EXPECT_TRUE(std::any_of(moves.begin(), moves.end(), [&](const Move& m) {
            return m.x == corner.x && m.y == corner.y && m.z == corner.z && m.feed > 0;
        }));
        for (const Move& m : moves)
            EXPECT_TRUE(m.z > to_units(kTop) || path.has_room({m.x, m.y}))
                << "x " << to_mm(m.x) << " y " << to_mm(m.y) << " z " << to_mm(m.z);
        EXPECT_EQ(contact_of(moves, tool, bench.stock).cells, 0U);
    }
}

// A short run in a crack as wide as the cutter, too short for its core, is left out until another comes that
// way from farther off.
TEST(Plunge, WhatWasLeftOutIsFollowedOnceThereIsRoom) {
    const Tool tool = cored_tools()[3];
    const auto at = [](double along) { return PathPoint{to_units(80 + along), to_units(10), to_units(8)}; };
    const std::vector<std::vector<PathPoint>> runs{{at(0), at(0.3)}, {at(2), at(60)}};
    for (const bool both : {false, true}) {
        Bench bench(tool);
        Surroundings around = bench.cut.around(tool, &bench.part);
        around.room = narrow_room(80 + 3, 10, 0, core_diameter_of(tool) - 1, 0.05);
        PathBuilder path(bench.operation, tool, 3000, kTop + 10, kTop + 2);
        path.set_surroundings(around);
        for (const std::vector<PathPoint>& run : std::span(runs).first(both ? 2 : 1)) path.follow(run);
        EXPECT_EQ(path.left_out(), 1U);
        path.follow_left_out(0);
        EXPECT_EQ(path.left_out(), both ? 0U : 1U);
        path.finish();
        EXPECT_EQ(bench.cut.no_way_in.size(), both ? 0U : 1U);
        EXPECT_EQ(contact_of(bench.operation.moves, tool, bench.stock).cells, 0U);
        const std::vector<Move>& moves = bench.operation.moves;
        EXPECT_EQ(both, std::any_of(moves.begin(), moves.end(), [&](const Move& m) {
                      return PathPoint{m.x, m.y, m.z} == runs[0].front() && m.feed > 0;
                  }));
    }
}

void expect_no_core_contact(const Plan& plan) {
    Stock stock(grid_over(plan.stock_min, plan.stock_max, 0.5));
    for (const Layer& layer : plan.layers) {
        stock.add_slab(layer.z_bottom, layer.slab_thickness);
        for (const Operation& op : layer.operations) {
            const Tool& tool = *std::find_if(plan.job.tools.begin(), plan.job.tools.end(),
                                             [&](const Tool& t) { return t.number == op.tool; });
            const CoreContact::Findings found = contact_of(op.moves, tool, stock);
            EXPECT_EQ(found.cells, 0U) << "layer " << layer.index << ", " << op.purpose << ", T" << op.tool
                                       << ": " << found.deepest << " mm at x " << found.where[0] << " y "
                                       << found.where[1] << " z " << found.z << ", move " << found.line;
        }
    }
}

// Pockets and islands with upright walls, anywhere; with both patterns, cores of several widths, and a flask.
TEST(Plunge, NoPlanOfPocketsAndIslandsComesDownOnACore) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> unit(0, 1);
    for (int round = 0; round < 6; ++round) {
        SCOPED_TRACE(round);
        struct Block {
            double x, y, wide, deep, z;
        };
        std::vector<Block> blocks;
        for (int k = 0; k < 10; ++k)
            blocks.push_back({150 * unit(random) - 75, 150 * unit(random) - 75, 4 + 30 * unit(random),
                              4 + 30 * unit(random), 2 + 24 * unit(random)});
        const double ground = round % 2 == 0 ? 3 : 20;
        Context context;
        const Mesh mesh = test::height_field(context, 100, 1.5, [&](double x, double y) {
            double z = ground;
            for (const Block& b : blocks)
                if (std::abs(x - b.x) < b.wide && std::abs(y - b.y) < b.deep) z = b.z;
            return z;
        });
        Job job;
        job.cutting.rough_pattern = round % 3 == 2 ? RoughPattern::zigzag : RoughPattern::contour;
        if (round == 4) job.flask.enabled = true;
        if (round % 2 == 1) job.tools[0].core_diameter = 30, job.tools[1].core_diameter = 7;
        expect_no_core_contact(make_plan(context, mesh, {}, job));
    }
}

// A machine that cannot go beside the stock faces and roughs it all the same.
TEST(Plunge, NorWhereTheMachineDoesNotReachBesideTheStock) {
    Context context;
    const Mesh mesh = test::height_field(context, 100, 1.5, [](double x, double y) {
        return std::abs(x) < 30 && std::abs(y) < 20 ? 14.0 : 6.0;
    });
    for (const RoughPattern pattern : {RoughPattern::contour, RoughPattern::zigzag}) {
        Job job;
        job.cutting.rough_pattern = pattern;
        job.machine.travel_x = job.machine.travel_y = 201;
        const Plan plan = make_plan(context, mesh, {}, job);
        EXPECT_GT(plan.stock_max[1] - plan.stock_min[1], 199);
        EXPECT_EQ(plan.layers[0].operations[0].kind, OperationKind::face);
        expect_no_core_contact(plan);
    }
}

// The castings that showed it: the face mill went straight down into up to 3.7 mm of wood at 17 places.
TEST(Plunge, NoProgramOfTheCastingsComesDownOnACore) {
    const char* corpus = std::getenv("SLABWRIGHT_CORPUS");
    if (corpus == nullptr) {
        std::printf("skipped: SLABWRIGHT_CORPUS is not set\n");
        return;
    }
    for (const char* name : {"casting_cover", "bearing_block"}) {
        SCOPED_TRACE(name);
        Context context;
        Job job;
        job.allow_undercut = true;
        const std::string stl = std::string(corpus) + "/castings/" + name + ".stl";
        const support::TemporaryFolder folder;
        const Plan planned = plan(context, stl, job);
        std::size_t face_roughs = 0;
        for (const Layer& layer : planned.layers)
            for (const Operation& op : layer.operations)
                face_roughs += op.kind == OperationKind::rough && op.tool == 1;
        EXPECT_GT(face_roughs, 2U) << "the face mill still takes the open waste";
        write(context, planned, folder / "out");
        const VerifyResult result = verify(context, folder / "out", stl);
        for (const Diagnostic& d : result.violations) ADD_FAILURE() << d.code << ' ' << d.message;
    }
}

}  // namespace
}  // namespace slabwright
