// Links, entries and leads around a box: down where it is free, over it where it is not, on a ramp into
// stock, on an arc to a wall.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "engine/moves/motion_time.h"
#include "engine/paths/runs/layer_cut.h"
#include "engine/paths/runs/leads.h"
#include "engine/paths/runs/plan_view.h"
#include "engine/paths/runs/rings.h"
#include "engine/paths/runs/zigzag.h"
#include "tests/support/height_field.h"
#include "tests/support/seed.h"

using namespace slabwright;

namespace {

constexpr double kTop = 15, kLink = 17, kClearance = 25;

// A box of 20 × 20 × 15 mm in the middle of stock of 80 × 80 mm, a cutter of 10 mm and what stands.
struct Bench {
    Context context;
    Mesh mesh;
    LayerJob layer;
    Job job;
    Tool tool = tool_of_kind(job, ToolKind::flat);
    LayerCut cut;
    Standing standing{{-30, -30}, {50, 50}, kTop};
    DropIndex part;
    Operation operation;

    static Mesh box(Context& context) {
        Mesh mesh = test::height_field(context, 1, 1.0, [](double, double) { return 1.0; });
        for (Vec3f& v : mesh.vertices)
            v = {(v.x + 0.5F) * 20, (v.y + 0.5F) * 20, v.z * static_cast<float>(kTop)};
        return mesh;
    }
    Bench()
        : mesh(box(context)),
          layer(),
          cut{context, layer, job, layer_solid(context, mesh.view(), 0, kTop), kTop, {}, {}, nullptr, {}},
          part(cut.solid, flat_cutter(5)) {
        tool.diameter = 10;
        layer.mesh = mesh.view();
        layer.job = &job;
        layer.z_top = kTop;
        layer.stock_min = {-30, -30};
        layer.stock_max = {50, 50};
        cut.standing = &standing;
    }
    // Everything at least 5 mm from the box, down to z.
    void clear(double z) {
        const CutterShape cutter = flat_cutter(5);
        for (double y = -30; y <= 50; y += 2)
            for (double x = -30; x <= 50; x += 2)
                if (part.drop(x, y).tip_z <= z) standing.cut(cutter, {x, y, z}, {x, y, z});
        for (double s = -5; s < 25; s += 0.5)
            for (const auto& [x, y] : {std::pair{s, -5.0}, {s, 25.0}, {-5.0, s}, {25.0, s}})
                standing.cut(cutter, {x, y, z}, {x, y, z});
    }
    PathBuilder builder() {
        PathBuilder path(operation, tool, 3000, kClearance, kLink);
        path.set_surroundings(cut.around(tool, &part));
        return path;
    }
    [[nodiscard]] double highest(std::size_t from, std::size_t to) const {
        std::int32_t z = INT32_MIN;
        for (std::size_t k = from; k < to; ++k) z = std::max(z, operation.moves[k].z);
        return to_mm(z);
    }
};

std::vector<PathPoint> line(double x0, double y0, double x1, double y1, double z) {
    return {{to_units(x0), to_units(y0), to_units(z)}, {to_units(x1), to_units(y1), to_units(z)}};
}

// Whatever is thinned, a ring lies a step from the one before it, and the first on the forbidden region's
// border.
TEST(Rings, KeepTheirStep) {
    const Bench bench;
    for (const auto& [waves, blend] :
         {std::pair{0.0, kJunction}, {5.0, kJunction}, {9.0, kJunction}, {5.0, 0.1}, {9.0, 0.1}}) {
        // A free place with a wavy border in the middle of what is forbidden.
        Loops hollow, forbidden;
        for (int k = 720; k-- > 0;) {
            const double turn = 2 * std::numbers::pi * k / 720, r = 28 + 2 * std::sin(waves * turn);
            hollow.points.push_back({to_units(10 + r * std::cos(turn)), to_units(10 + r * std::sin(turn))});
        }
        hollow.close_loop();
        forbidden.points = {{to_units(-29), to_units(-29)},
                            {to_units(49), to_units(-29)},
                            {to_units(49), to_units(49)},
                            {to_units(-29), to_units(49)}};
        forbidden.close_loop();
        forbidden.points.insert(forbidden.points.end(), hollow.points.begin(), hollow.points.end());
        forbidden.close_loop();
        const RingPlan plan = plan_rings(bench.cut, bench.tool, simplify(forbidden), 5, blend, true);
        const double most = ring_step(bench.tool) + ring_tolerance(bench.tool) + 0.04;
        auto away = [](const PathPoint& p, std::span<const PathPoint> line) {
            double nearest = 1e300;
            for (std::size_t k = 1; k < line.size(); ++k) {
                const double ax = line[k - 1].x, ay = line[k - 1].y, dx = line[k].x - ax, dy = line[k].y - ay,
                             l2 = dx * dx + dy * dy;
                const double t = l2 > 0 ? std::clamp(((p.x - ax) * dx + (p.y - ay) * dy) / l2, 0.0, 1.0) : 0;
                nearest = std::min(nearest, std::hypot(p.x - ax - t * dx, p.y - ay - t * dy));
            }
            return nearest / kUnitsPerMm;
        };
        std::vector<std::vector<PathPoint>> rings;  // the border, and the closed rings from it
        rings.emplace_back();
        for (const Point2 p : hollow.points) rings[0].push_back({p.x, p.y, 0});
        rings[0].push_back(rings[0].front());
        for (const RingPlan::Piece& piece : plan.pieces)
            if (piece.closed && rings.size() < 5 && piece.ring + 1 == rings.size() &&
                piece.box[0] > to_units(-25))
                rings.push_back(piece.points);
        ASSERT_EQ(rings.size(), 5U) << waves;
        for (const PathPoint& p : rings[1]) EXPECT_LE(away(p, rings[0]), 0.0201);
        for (std::size_t k = 2; k < rings.size(); ++k)
            for (const PathPoint& p : rings[k]) EXPECT_LE(away(p, rings[k - 1]), most) << "ring " << k;
    }
}

// What is of use ends where the machine's travel does: no ring goes along there.
TEST(Rings, DoNotGoAlongTheEndOfTheTravel) {
    for (const bool along_x : {true, false}) {
        Bench bench;
        (along_x ? bench.job.machine.travel_x : bench.job.machine.travel_y) = 84;
        const Loops forbidden = rectangle(-5, -5, 25, 25);
        const RingPlan plan = plan_rings(bench.cut, bench.tool, forbidden, 5, kJunction, true);
        ASSERT_FALSE(plan.pieces.empty());
        for (const RingPlan::Piece& piece : plan.pieces)
            for (std::size_t k = 1; k < piece.points.size(); ++k) {
                const PathPoint &a = piece.points[k - 1], &b = piece.points[k];
                const double u = to_mm(along_x ? a.x : a.y), v = to_mm(along_x ? b.x : b.y);
                EXPECT_FALSE(std::min(u, v) > 51.9 || std::max(u, v) < -31.9) << u << " to " << v;
            }
    }
}

// Where the strips before them end it is not known how much room there is around the cutter: the first ring
// is gone to by a way that is free, around the box's corner or over it.
TEST(Rings, TheFirstIsGoneToByAWayThatIsFree) {
    Bench bench;
    bench.clear(5);
    PathBuilder path = bench.builder();
    RingPlan plan;
    plan.radius = 5;
    plan.step = 9;
    plan.z = to_units(5);
    plan.strips = {line(25.1, 40, 25.1, 19, 5)};
    RingPlan::Piece ring;
    for (const auto& [x, y] : {std::pair{19.0, 25.1}, {10.0, 25.1}, {10.0, 32.0}, {19.0, 32.0}, {19.0, 25.1}})
        ring.points.push_back({to_units(x), to_units(y), plan.z});
    ring.box = {10 * kUnitsPerMm, 25.1 * kUnitsPerMm, 19 * kUnitsPerMm, 32 * kUnitsPerMm};
    ring.closed = true;
    plan.pieces = {ring};
    clear_from_afar(path, bench.cut, plan);
    const std::vector<Move>& moves = bench.operation.moves;
    for (const PathPoint& p : ring.points)
        EXPECT_TRUE(std::any_of(moves.begin(), moves.end(),
                                [&](const Move& m) { return m.x == p.x && m.y == p.y && m.z == p.z; }));
    for (std::size_t k = 1; k < moves.size(); ++k)
        for (int part = 0; part <= 100; ++part) {
            const double t = part / 100.0, x = to_mm(moves[k - 1].x) * (1 - t) + to_mm(moves[k].x) * t,
                         y = to_mm(moves[k - 1].y) * (1 - t) + to_mm(moves[k].y) * t,
                         z = to_mm(moves[k - 1].z) * (1 - t) + to_mm(moves[k].z) * t;
            ASSERT_LE(bench.part.drop(x, y).tip_z, z + 1e-3) << "move " << k << " at " << x << ", " << y;
        }
}

TEST(PlanView, NearALineIsWhatLiesWithinReachOfItsSegments) {
    const std::vector<PathPoint> line{{0, 0, 0}, {300, 400, 0}, {300, 400, 0}, {300, 1000, 0}};
    // 50 from the middle of the first segment, square to it: a fifth of (4, -3).
    const PathPoint beside{190, 170, 0};
    EXPECT_FALSE(near_line(beside, line, 50));
    EXPECT_TRUE(near_line(beside, line, 50.01));
    // Beyond the ends only these are near.
    EXPECT_FALSE(near_line({-30, -40, 0}, line, 50));
    EXPECT_TRUE(near_line({-30, -40, 0}, line, 50.01));
    EXPECT_FALSE(near_line({300, 1050, 0}, line, 50));
    EXPECT_TRUE(near_line({300, 1050, 0}, line, 50.01));
}

// Longer chords where the machine does not slow down for them: within the tolerance, fewer, and no slower.
TEST(Thinning, LosesNoTimeByLongerChords) {
    std::mt19937 random(test::seed());
    Machine machine;
    for (int round = 0; round < 20; ++round) {
        const double a = 20 + static_cast<double>(random() % 200), b = 3 + static_cast<double>(random() % 20),
                     fine = 0.02 * kUnitsPerMm, loose = 0.1 * kUnitsPerMm,
                     wave = static_cast<double>(random() % 10);
        std::vector<PathPoint> line;
        for (int k = 0; k <= 4000; ++k) {
            const double t = 0.0015 * k, x = a * std::cos(t) + b * std::sin(wave * t),
                         y = a * std::sin(t) + (k / 1000 % 2 ? 2 : 0);
            line.push_back({to_units(x), to_units(y), 0});
        }
        const double feed = 9000;
        const auto finely = simplify(line, fine),
                   coarsely = simplify(line, fine, loose, fast_turn(machine, feed));
        auto seconds = [&](const std::vector<PathPoint>& points) {
            std::vector<MotionLeg> legs;
            for (std::size_t k = 1; k < points.size(); ++k) {
                const double dx = to_mm(std::int64_t{points[k].x} - points[k - 1].x),
                             dy = to_mm(std::int64_t{points[k].y} - points[k - 1].y), l = std::hypot(dx, dy);
                legs.push_back({l, feed / 60, {dx / l, dy / l, 0}});
                legs.back().leaving = legs.back().direction;
            }
            return travel_seconds(legs, axis_limits(machine));
        };
        EXPECT_LT(coarsely.size(), finely.size());
        EXPECT_LT(seconds(coarsely), 1.01 * seconds(finely)) << a << ' ' << b << ' ' << wave;
        for (const PathPoint& p : line) {
            double nearest = 1e300;
            for (std::size_t k = 1; k < coarsely.size(); ++k) {
                const double ax = coarsely[k - 1].x, ay = coarsely[k - 1].y, dx = coarsely[k].x - ax,
                             dy = coarsely[k].y - ay;
                const double t =
                    std::clamp(((p.x - ax) * dx + (p.y - ay) * dy) / (dx * dx + dy * dy), 0.0, 1.0);
                nearest = std::min(nearest, std::hypot(p.x - ax - t * dx, p.y - ay - t * dy));
            }
            ASSERT_LE(nearest, fine + loose + 1);
        }
    }
}

}  // namespace

TEST(Links, StayDownWhereTheWayIsFree) {
    Bench bench;
    bench.clear(5);
    PathBuilder path = bench.builder();
    path.follow(line(0, -6, 10, -6, 5));
    const std::size_t before = bench.operation.moves.size();
    path.follow(line(18, -8, 25, -8, 5));
    for (std::size_t k = before; k < bench.operation.moves.size(); ++k) {
        EXPECT_EQ(bench.operation.moves[k].z, to_units(5));
        EXPECT_GT(bench.operation.moves[k].feed, 0U);
    }
}

TEST(Links, LiftJustOverThePartAndNotOverStockThatIsGone) {
    Bench bench;
    bench.clear(5);
    PathBuilder path = bench.builder();
    path.follow(line(0, -8, 10, -8, 5));
    std::size_t before = bench.operation.moves.size();
    path.follow(line(10, 28, 0, 28, 5));  // the box stands between
    EXPECT_NEAR(bench.highest(before, bench.operation.moves.size()), kTop + PathBuilder::kOver, 0.01);
    before = bench.operation.moves.size();
    path.follow(line(45, 45, 40, 45, 5));  // farther than it stays down, but nothing on the way
    EXPECT_LE(bench.highest(before, bench.operation.moves.size()), 5 + PathBuilder::kOver + 0.01);
    EXPECT_TRUE(path.finish());
    EXPECT_EQ(bench.operation.moves.back().z, to_units(kClearance));
}

TEST(Links, RapidsStayOverTheBottomOfTheLayer) {
    for (const double bottom : {0.0, 3.0})
        for (const double deep : {0.0, 1.0}) {
            Bench bench;
            bench.layer.z_bottom = bottom;
            PathBuilder path = bench.builder();
            // Beside the stock, where nothing stands, and farther apart than it stays down.
            path.follow(line(-40, -15, -36, -15, bottom - deep));
            path.follow(line(-36, 35, -40, 35, bottom - deep));
            double lowest = 1e300, lowest_cut = 1e300;
            for (const Move& move : bench.operation.moves)
                if (move.feed == 0) lowest = std::min(lowest, to_mm(move.z));
                else lowest_cut = std::min(lowest_cut, to_mm(move.z));
            EXPECT_NEAR(lowest_cut, bottom - deep, 1e-9);
            EXPECT_NEAR(lowest, bottom + PathBuilder::kStop, 1e-9);
        }
}

TEST(Links, DoNotCrossStockThatStands) {
    Bench bench;  // nothing has been cleared
    PathBuilder path = bench.builder();
    path.follow(line(-40, -15, -36, -15, 5));
    const std::size_t before = bench.operation.moves.size();
    path.follow(line(-36, -20, -40, -20, 5));  // beside the stock all the way
    EXPECT_LE(bench.highest(before, bench.operation.moves.size()), 5 + PathBuilder::kOver + 0.01);
    const std::size_t then = bench.operation.moves.size();
    path.follow(line(-10, -20, 10, -20, 12));
    EXPECT_GE(bench.highest(then, bench.operation.moves.size()), kTop + PathBuilder::kStop - 0.01);
}

TEST(Links, StockIsEnteredOnARamp) {
    Bench bench;
    PathBuilder path = bench.builder();
    path.follow(line(-20, -15, 10, -15, 12));
    double vertical = 0, steepest = 0;
    for (std::size_t k = 1; k < bench.operation.moves.size(); ++k) {
        const Move &a = bench.operation.moves[k - 1], &b = bench.operation.moves[k];
        const double run = to_mm(1) *
                           std::hypot(static_cast<double>(b.x) - a.x, static_cast<double>(b.y) - a.y),
                     fall = to_mm(std::int64_t{a.z} - b.z);
        if (b.feed == 0) continue;
        if (run == 0 && to_mm(b.z) < kTop) vertical += std::max(0.0, fall);
        if (run > 0) steepest = std::max(steepest, fall / run);
    }
    EXPECT_EQ(vertical, 0) << "plunged into the stock";
    EXPECT_LE(steepest, std::tan(bench.job.cutting.ramp_deg * std::numbers::pi / 180) + 1e-3);
    EXPECT_GT(steepest, 0.01);
    EXPECT_EQ(bench.operation.moves.back().z, to_units(12));
}

TEST(Links, AHelixLeadsIntoStockOnTheFreeSideOnly) {
    // On the left of this run there is room, on the right stands the box.
    Bench bench;
    PathBuilder path = bench.builder();
    path.follow(line(-6, -5, -6, 25, 8));
    double left = 1e9, right = -1e9, turned = 0;
    std::size_t entry = 0;
    for (std::size_t k = 1; k < bench.operation.moves.size(); ++k) {
        const Move &a = bench.operation.moves[k - 1], &b = bench.operation.moves[k];
        if (b.feed == 0 || (a.x == b.x && a.y == b.y)) continue;
        left = std::min(left, to_mm(b.x)), right = std::max(right, to_mm(b.x));
        turned += b.x != a.x ? std::hypot(to_mm(b.x) - to_mm(a.x), to_mm(b.y) - to_mm(a.y)) : 0;
        if (b.z > to_units(8)) {
            ++entry;
            EXPECT_LE(bench.part.drop(to_mm(b.x), to_mm(b.y)).tip_z, 8);
            EXPECT_LE(to_mm(std::int64_t{a.z} - b.z),
                      std::tan(bench.job.cutting.ramp_deg * std::numbers::pi / 180) *
                              std::hypot(to_mm(b.x) - to_mm(a.x), to_mm(b.y) - to_mm(a.y)) +
                          1e-3);
        }
    }
    EXPECT_GT(entry, 24U) << "no helix";
    EXPECT_NEAR(left, -6 - 2 * 0.9 * 5, 0.01);
    EXPECT_NEAR(right, -6, 1e-3);
    EXPECT_GT(turned, 2 * std::numbers::pi * 0.9 * 5 * 0.9);
    EXPECT_EQ(path.left_out(), 0U);
}

// A ball that keeps an allowance asks a wider one, whose tip lies lower by what it is wider.
// Of a face mill that does not plunge nearly all is its middle, but nothing beyond its rim.
TEST(Links, AFaceMillGoesStraightDownWhereItHasCut) {
    Bench bench;
    bench.tool = tool_of_kind(bench.job, ToolKind::face);
    bench.tool.diameter = 20;
    PathBuilder path = bench.builder();
    const Point2 at{to_units(-15), to_units(-15)};
    EXPECT_NEAR(path.standing_middle(at), kTop, 1e-3);
    bench.standing.cut(flat_cutter(10), {-15, -15, 5}, {-15, -15, 5});
    EXPECT_NEAR(path.standing_middle(at), 5, 1e-3);
}

// Two stretches of neighbouring lines that have one place in common are one way.
TEST(Links, AZigzagGoesOnWhereStretchesMeetInOnePlace) {
    Bench bench;
    PathBuilder path = bench.builder();
    const std::vector<std::int32_t> lines{to_units(-20), to_units(-15)};
    zigzag(path, bench.cut, bench.tool, lines, {{{-10, 10}}, {{10, 30}}}, 14,
           [](std::span<const std::int32_t> at) {
               Fibres free;
               free.starts.assign(at.size() + 1, 0);
               return free;
           });
    EXPECT_TRUE(path.finish());
    std::size_t first = 0, last = 0;
    for (std::size_t k = 0; k < bench.operation.moves.size(); ++k)
        if (bench.operation.moves[k].z == to_units(14)) last = k, first = first == 0 ? k : first;
    ASSERT_GT(last, first);
    EXPECT_NEAR(bench.highest(first, last), 14, 1e-9);
}

TEST(Links, ABallKeepsItsAllowanceOverWhatLiesFlat) {
    constexpr double kAllowance = 0.3;
    for (const double over : {0.2, 0.25, 0.35}) {
        Bench bench;
        bench.tool.kind = ToolKind::ball;
        const DropIndex wider(bench.cut.solid, ball_cutter(5 + kAllowance));
        PathBuilder path(bench.operation, bench.tool, 3000, kClearance, kLink);
        path.set_surroundings(bench.cut.around(bench.tool, &wider));
        path.follow(line(-9, 10, -8, 10, kTop + over));
        const std::size_t before = bench.operation.moves.size();
        path.follow(line(28, 11, 29, 12, kTop + over));
        const double highest = bench.highest(before, bench.operation.moves.size());
        if (over > kAllowance) EXPECT_EQ(highest, kTop + over);
        else EXPECT_GT(highest, kTop + kAllowance) << over;
    }
}

TEST(Links, ARunWithoutRoomIsLeftByAToolThatDoesNotPlunge) {
    for (const bool plunges : {false, true}) {
        Bench bench;
        bench.tool.plunges = plunges;
        // A room no wider than the cutter's middle may move: no circle, and a run of half a millimetre is no
        // ramp.
        Surroundings around = bench.cut.around(bench.tool, &bench.part);
        Loops room;
        room.points = {{to_units(-20.5), to_units(-20.5)},
                       {to_units(-19), to_units(-20.5)},
                       {to_units(-19), to_units(-19)},
                       {to_units(-20.5), to_units(-19)}};
        room.close_loop();
        around.room = std::make_shared<const Loops>(room);
        PathBuilder path(bench.operation, bench.tool, 3000, kClearance, kLink);
        path.set_surroundings(around);
        path.follow(line(-20, -20, -19.5, -20, 10));
        EXPECT_EQ(path.finish(), plunges) << "nothing moves for a run that is left out";
        if (plunges) {
            double lowest = 1e9;
            for (const Move& m : bench.operation.moves) lowest = std::min(lowest, to_mm(m.z));
            EXPECT_EQ(lowest, 10);
            EXPECT_TRUE(bench.cut.no_way_in.empty());
        } else {
            ASSERT_EQ(bench.cut.no_way_in.size(), 1U);
            EXPECT_EQ(bench.cut.no_way_in[0][2], 10);
        }
    }
}

TEST(Links, APlaceWithoutRoomForARampIsEnteredFromWhereItIsCleared) {
    Bench bench;
    bench.tool.plunges = false;
    bench.standing.cut(flat_cutter(5), {-30, -20, 10}, {-20, -20, 10});
    PathBuilder path = bench.builder();
    path.follow(std::vector<PathPoint>{{to_units(-17), to_units(-20), to_units(10)}});
    EXPECT_EQ(path.left_out(), 0U);
    ASSERT_GE(bench.operation.moves.size(), 3U);
    const Move &last = bench.operation.moves.back(),
               &beside = bench.operation.moves[bench.operation.moves.size() - 2];
    EXPECT_EQ(last.x, to_units(-17));
    EXPECT_EQ(last.z, to_units(10));
    // Down where the slot is, and straight across from there.
    EXPECT_EQ(beside.z, to_units(10));
    EXPECT_LE(to_mm(beside.x), -18);
    for (std::size_t k = 0; k + 1 < bench.operation.moves.size(); ++k)
        EXPECT_TRUE(to_mm(bench.operation.moves[k].z) >= kTop || to_mm(bench.operation.moves[k].x) <= -18)
            << k;
}

TEST(Leads, AreTangentFreeAndOverlapClosedRuns) {
    Bench bench;
    bench.clear(5);
    PathBuilder path = bench.builder();
    // Around the box with it on the right: clockwise seen from above is with the solid on the right.
    std::vector<PathPoint> ring;
    for (const auto& [x, y] : {std::pair{-5.0, 5.0},
                               {-5.0, 20.0},
                               {0.0, 25.0},
                               {20.0, 25.0},
                               {25.0, 20.0},
                               {25.0, 0.0},
                               {20.0, -5.0},
                               {0.0, -5.0},
                               {-5.0, 0.0},
                               {-5.0, 5.0}})
        ring.push_back({to_units(x), to_units(y), to_units(5)});
    const std::vector<PathPoint> bare = ring;
    ASSERT_TRUE(add_leads(path, bench.cut, bench.part, 0.4, ring));
    EXPECT_EQ(ring.front(),
              (PathPoint{to_units(-7), to_units(3), to_units(5)}));  // 2 mm before and 2 mm off the wall
    EXPECT_EQ(ring.back(),
              (PathPoint{to_units(-7), to_units(8), to_units(5)}));  // 1 mm of overlap, then off again
    const auto start = std::find(ring.begin(), ring.end(), bare.front());
    ASSERT_NE(start, ring.end());
    // The arc comes in nearly along the run, and every place of it is free.
    const PathPoint& last = *(start - 1);
    EXPECT_LT(
        std::abs(std::atan2(static_cast<double>(start->x) - last.x, static_cast<double>(start->y) - last.y)),
        0.12);
    for (const PathPoint& p : ring)
        EXPECT_LE(bench.part.drop(to_mm(p.x), to_mm(p.y)).tip_z, p.x < to_units(-5.001) ? 5 : kTop);
    EXPECT_EQ(std::count(ring.begin(), ring.end(), PathPoint{to_units(-5), to_units(6), to_units(5)}), 1)
        << "no overlap";
    // The other way round the box is on the left, and there is no room for an arc.
    std::vector<PathPoint> wrong(bare.rbegin(), bare.rend());
    EXPECT_FALSE(add_leads(path, bench.cut, bench.part, 0.4, wrong));
    // Unless it is known to be there: then the arcs are on the right.
    std::vector<PathPoint> reversed(bare.rbegin(), bare.rend());
    ASSERT_TRUE(add_leads(path, bench.cut, bench.part, 0.4, reversed, PartSide::left));
    EXPECT_EQ(reversed.front(), (PathPoint{to_units(-7), to_units(7), to_units(5)}));
    EXPECT_EQ(reversed.back(), (PathPoint{to_units(-7), to_units(2), to_units(5)}));
}
