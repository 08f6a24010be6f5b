// Arcs fitted to paths, compared with the paths by brute force, read by LinuxCNC's interpreter and by the
// project's own reader.
#include "engine/moves/arcs.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <sstream>

#include "engine/moves/motion_time.h"
#include "engine/planner/planner.h"
#include "io/posts/gcode_reader.h"
#include "io/posts/gcode_writer.h"
#include "io/posts/tool_table.h"
#include "kernels/errors.h"
#include "kernels/mesh/weld.h"
#include "tests/data/models.h"
#include "tests/data/sweep.h"
#include "tests/support/plate_with.h"
#include "tests/support/rs274.h"
#include "tests/support/seed.h"

namespace slabwright {
namespace {

constexpr double pi = std::numbers::pi;
constexpr std::int32_t kMm = 10000;

struct Spot {
    double x = 0, y = 0, z = 0;
};
double away(const Spot& a, const Spot& b) { return std::hypot(a.x - b.x, a.y - b.y, a.z - b.z); }

/// Points along the moves, at most `step` apart, mm.
std::vector<Spot> sampled(const std::vector<Move>& moves, double step) {
    std::vector<Spot> spots;
    for (std::size_t m = 1; m < moves.size(); ++m) {
        const Move &a = moves[m - 1], &b = moves[m];
        const Spot p{to_mm(a.x), to_mm(a.y), to_mm(a.z)}, q{to_mm(b.x), to_mm(b.y), to_mm(b.z)};
        const bool arc = b.is_arc();
        const ArcShape shape = arc ? arc_shape(a, b) : ArcShape{};
        const int n = std::max(1, static_cast<int>(std::ceil((arc ? shape.length() : away(p, q)) / step)));
        for (int k = 0; k <= n; ++k) {
            const double t = static_cast<double>(k) / n, angle = shape.start + t * shape.sweep;
            if (arc)
                spots.push_back({shape.x + shape.radius * std::cos(angle),
                                 shape.y + shape.radius * std::sin(angle), p.z});
            else spots.push_back({p.x + t * (q.x - p.x), p.y + t * (q.y - p.y), p.z + t * (q.z - p.z)});
        }
    }
    return spots;
}

/// The farthest that any of `spots` lies from the straight stretches between `others`, mm.
double farthest(const std::vector<Spot>& spots, const std::vector<Spot>& others) {
    double worst = 0;
    for (const Spot& s : spots) {
        double nearest = 1e300;
        for (std::size_t k = 1; k < others.size(); ++k) {
            const Spot &a = others[k - 1], &b = others[k];
            const double dx = b.x - a.x, dy = b.y - a.y, dz = b.z - a.z, l2 = dx * dx + dy * dy + dz * dz;
            const double t =
                l2 > 0 ? std::clamp(((s.x - a.x) * dx + (s.y - a.y) * dy + (s.z - a.z) * dz) / l2, 0.0, 1.0)
                       : 0.0;
            nearest = std::min(nearest, away(s, {a.x + t * dx, a.y + t * dy, a.z + t * dz}));
        }
        worst = std::max(worst, nearest);
    }
    return worst;
}

int arcs_in(const std::vector<Move>& moves) {
    return static_cast<int>(
        std::count_if(moves.begin(), moves.end(), [](const Move& m) { return m.is_arc(); }));
}

/// A path of one kind; its chords miss the curve by about `sag` mm.
std::vector<Move> random_path(std::mt19937& random, int kind, double sag) {
    const auto pick = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    const double cx = pick(-100, 100), cy = pick(-100, 100), r = std::pow(10, pick(-0.5, 2)),
                 turn = pick(0, 1) < 0.5 ? -1 : 1, begin = pick(0, 2 * pi);
    const double step = std::sqrt(8 * sag / r);
    std::vector<Move> moves;
    auto add = [&](double x, double y, double z) {
        moves.push_back({to_units(x), to_units(y), to_units(z), 3000});
    };
    if (kind == 0) {  // a circle, or nearly two turns of it
        const double sweep = pick(0.5, 12);
        for (double t = 0; t < sweep; t += step * pick(0.4, 1))
            add(cx + r * std::cos(begin + turn * t), cy + r * std::sin(begin + turn * t), 5);
    } else if (kind == 1) {  // a spiral
        for (double t = 0; t < 4; t += step * pick(0.4, 1))
            add(cx + r * (1 + t / 5) * std::cos(begin + turn * t),
                cy + r * (1 + t / 5) * std::sin(begin + turn * t), 5);
    } else if (kind == 2) {  // a rectangle with rounded corners, as a pocket's wall
        const double w = r * pick(0.1, 3);
        const Spot corners[] = {{cx, cy, 5}, {cx + w, cy, 5}, {cx + w, cy + w, 5}, {cx, cy + w, 5}};
        for (int c = 0; c < 4; ++c)
            for (double t = 0; t <= pi / 2; t += step)
                add(corners[c].x + r * std::cos(t + (c - 2) * pi / 2),
                    corners[c].y + r * std::sin(t + (c - 2) * pi / 2), 5);
    } else if (kind == 3) {  // a helix: no arc may be fitted
        for (double t = 0; t < 7; t += step) add(cx + r * std::cos(t), cy + r * std::sin(t), 5 + t);
    } else if (kind == 4) {  // corners everywhere
        for (int k = 0; k < 60; ++k) add(cx + pick(-r, r), cy + pick(-r, r), 5);
    } else {  // noise about the tolerance
        for (double t = 0; t < 5; t += step) {
            const double n = r + pick(-3 * sag, 3 * sag);
            add(cx + n * std::cos(begin + turn * t), cy + n * std::sin(begin + turn * t), 5);
        }
    }
    moves.front().feed = 0;
    return moves;
}

TEST(Arcs, StayWithinTheToleranceBothWays) {
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    const double tolerance = 0.0018;
    int arcs = 0;
    std::size_t before = 0, after = 0;
    for (int round = 0; round < 120; ++round) {
        const std::vector<Move> path = random_path(random, round % 6, 0.0012);
        std::vector<Move> fitted = path;
        fit_arcs(fitted, {.tolerance = tolerance * kUnitsPerMm});
        std::vector<Move> again = path;
        fit_arcs(again, {.tolerance = tolerance * kUnitsPerMm});
        ASSERT_EQ(fitted, again);
        before += path.size(), after += fitted.size();
        arcs += arcs_in(fitted);
        if (round % 6 == 3) {
            EXPECT_EQ(arcs_in(fitted), 0) << "an arc that climbs";
        }
        // Every end is a point of the path, in its order.
        ASSERT_EQ(fitted.front(), path.front());
        ASSERT_EQ(to_mm(fitted.back().x), to_mm(path.back().x));
        std::size_t at = 0;
        for (std::size_t m = 1; m < fitted.size(); ++m) {
            const std::size_t from = at;
            while (at < path.size() && (path[at].x != fitted[m].x || path[at].y != fitted[m].y ||
                                        path[at].z != fitted[m].z || at == from))
                ++at;
            ASSERT_LT(at, path.size());
            ASSERT_EQ(fitted[m].feed, 3000U);
            if (fitted[m].is_arc()) {
                const ArcShape shape = arc_shape(fitted[m - 1], fitted[m]);
                ASSERT_LE(std::abs(shape.sweep), 2.21);
                ASSERT_GE(at - from, 3U);
                const double end = std::hypot(to_mm(fitted[m].x) - shape.x, to_mm(fitted[m].y) - shape.y);
                ASSERT_LE(std::abs(end - shape.radius), 0.0003);
            }
            // Piece against piece: what one move stands for is that part of the path.
            const std::vector<Move> piece(path.begin() + static_cast<std::ptrdiff_t>(from),
                                          path.begin() + static_cast<std::ptrdiff_t>(at) + 1);
            const std::vector<Move> move{fitted[m - 1], fitted[m]};
            const double length = std::max(0.05, motion_time(move, Machine{}).cutting_mm);
            const std::vector<Spot> a = sampled(piece, length / 60), b = sampled(move, length / 400);
            // The arc's own samples miss it by (length/400)²/8r, far below 0.1 µm.
            ASSERT_LE(farthest(a, b), tolerance + 1e-4) << "round " << round << " move " << m;
            ASSERT_LE(farthest(sampled(move, length / 60), sampled(piece, 1e9)), tolerance + 1e-4)
                << "round " << round << " move " << m;
        }
        ASSERT_EQ(at + 1, path.size());
    }
    EXPECT_GT(arcs, 60);
    std::printf("%zu moves became %zu, %d of them arcs\n", before, after, arcs);
}

TEST(Arcs, ACircleBecomesThreeArcs) {
    std::vector<Move> moves;
    for (int k = 0; k <= 360; ++k)
        moves.push_back({to_units(20 * std::cos(k * pi / 180)), to_units(20 * std::sin(-k * pi / 180)), 0,
                         k == 0 ? 0U : 1000U});
    fit_arcs(moves, {.tolerance = 18});
    ASSERT_EQ(moves.size(), 4U);
    for (std::size_t m = 1; m < 4; ++m) {
        const ArcShape shape = arc_shape(moves[m - 1], moves[m]);
        EXPECT_NEAR(shape.radius, 20, 0.001);
        EXPECT_NEAR(shape.x, 0, 0.002);
        EXPECT_NEAR(shape.y, 0, 0.002);
        EXPECT_LT(shape.sweep, 0) << "with the clock";
    }
    EXPECT_EQ(moves[3].x, 200000);
    EXPECT_EQ(moves[3].y, 0);
}

TEST(Arcs, WhereAChordWouldDoThereIsNone) {
    // It rises by 1.5 and by 56 µm over its chord.
    for (const auto& [length, arcs] : {std::pair{0.49, 0}, {3.0, 1}}) {
        std::vector<Move> moves;
        for (int k = 0; k <= 6; ++k) {
            const double turn = length / 20 * (k / 6.0 - 0.5);
            moves.push_back(
                {to_units(20 * std::sin(turn)), to_units(20 * std::cos(turn)), 0, k == 0 ? 0U : 1000U});
        }
        fit_arcs(moves, {.tolerance = 18});
        EXPECT_EQ(moves.size(), 2U) << length;
        EXPECT_EQ(arcs_in(moves), arcs) << length;
    }
}

TEST(Arcs, SwitchedOffOnlyChordsRemain) {
    std::mt19937 random(3);
    std::vector<Move> moves = random_path(random, 0, 0.0012);
    fit_arcs(moves, {.tolerance = 18, .arcs = false});
    EXPECT_EQ(arcs_in(moves), 0);
}

TEST(Arcs, ShapesBeginAndEndWhereTheirMovesDo) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> place(-80, 80), turn(-3.1, 3.1), size(1, 40);
    for (int trial = 0; trial < 500; ++trial) {
        const double x = place(random), y = place(random), radius = size(random), start = turn(random),
                     sweep = turn(random);
        Move from, arc;
        from.x = to_units(x + radius * std::cos(start)), from.y = to_units(y + radius * std::sin(start));
        arc.x = to_units(x + radius * std::cos(start + sweep));
        arc.y = to_units(y + radius * std::sin(start + sweep));
        arc.i = to_units(x) - from.x, arc.j = to_units(y) - from.y;
        const ArcShape shape = arc_shape(from, arc);
        constexpr double near = 1e-3;  // mm
        EXPECT_NEAR(shape.x, x, near);
        EXPECT_NEAR(shape.y, y, near);
        EXPECT_NEAR(shape.radius, radius, near);
        EXPECT_NEAR(shape.sweep, sweep, near);
        EXPECT_NEAR(shape.length(), radius * std::abs(sweep), 2 * near);
        EXPECT_NEAR(shape.x + shape.radius * std::cos(shape.start), to_mm(from.x), near);
        EXPECT_NEAR(shape.y + shape.radius * std::sin(shape.start), to_mm(from.y), near);
    }
}

TEST(Arcs, TheBoxHoldsTheBulge) {
    std::mt19937 random(5);
    std::uniform_int_distribution<std::int32_t> place(-300000, 300000);
    for (int round = 0; round < 500; ++round) {
        const Move from{place(random), place(random), 0, 0};
        Move to{place(random), place(random), 0, 100, place(random), place(random)};
        if (!to.is_arc()) continue;
        const ArcShape shape = arc_shape(from, to);
        std::array<double, 4> seen{1e300, 1e300, -1e300, -1e300};
        for (int k = 0; k <= 4000; ++k) {
            const double a = shape.start + shape.sweep * k / 4000, x = shape.x + shape.radius * std::cos(a),
                         y = shape.y + shape.radius * std::sin(a);
            seen = {std::min(seen[0], x), std::min(seen[1], y), std::max(seen[2], x), std::max(seen[3], y)};
        }
        const std::array<double, 4> box = shape.box();
        for (int k = 0; k < 4; ++k) ASSERT_NEAR(box[k], seen[k], 1e-4);
    }
}

TEST(Arcs, TakeAboutTheTimeOfTheirChords) {
    const Machine machine;
    for (const double r : {10.0, 50.0, 200.0}) {
        std::vector<Move> moves;
        const double step = std::sqrt(8 * 0.0012 / r);
        for (double t = 0; t < 6; t += step)
            moves.push_back(
                {to_units(r * std::cos(t)), to_units(r * std::sin(t)), 0, moves.empty() ? 0U : 5000U});
        std::vector<Move> fitted = moves;
        fit_arcs(fitted, {.tolerance = 18});
        ASSERT_GT(arcs_in(fitted), 0);
        const MotionTime chords = motion_time(moves, machine), arcs = motion_time(fitted, machine);
        EXPECT_NEAR(arcs.cutting_mm, chords.cutting_mm, 1e-3 * chords.cutting_mm);
        // Along an arc half of the acceleration is left for its ends, a quarter for the last.
        EXPECT_NEAR(arcs.minutes, chords.minutes, 0.01 * chords.minutes + 0.17 / 60) << r;
    }
    // A small radius is taken at the speed that the acceleration allows, v² = √¾·a·r; along it half is left.
    const std::vector<Move> half{{10 * kMm, 0, 0, 0}, {-96000, 28000, 0, 9000, -10 * kMm, 0}};
    Machine slow;
    slow.acceleration = 100;
    const double v = std::sqrt(std::sqrt(0.75) * 100 * 10), along = slow.acceleration / 2;
    // …and a quarter at the program's end, so that it never reaches v: two ramps that meet.
    const double length = 10 * (pi - std::asin(0.28)), end = along / 2;
    const double peak = std::min(v, std::sqrt(2 * length / (1 / end + 1 / end)));
    EXPECT_LT(peak, v);
    EXPECT_NEAR(motion_time(half, slow).minutes * 60, 2 * peak / end, 1e-9);
}

// v² = a·r: at 50 mm/s and 500 mm/s² arcs of 5 mm radius are as fast as their chords, at 75 mm/s only those
// from 11.25 mm up.
TEST(Arcs, AreNoneWhereTheyWouldBeRunSlower) {
    for (const auto& [r, feed, fitted] :
         {std::tuple{8.0, 3000U, true}, {8.0, 4500U, false}, {12.0, 4500U, true}, {4.0, 3000U, false}}) {
        std::vector<Move> moves;
        for (double t = 0; t < 6; t += 0.2)
            moves.push_back(
                {to_units(r * std::cos(t)), to_units(r * std::sin(t)), 0, moves.empty() ? 0U : feed});
        std::vector<Move> always = moves;
        fit_arcs(always, {.tolerance = 1000});
        EXPECT_GT(arcs_in(always), 0);
        fit_arcs(moves, {.tolerance = 1000, .acceleration = 500});
        EXPECT_EQ(arcs_in(moves) > 0, fitted) << r << " mm at " << feed;
    }
}

// Along y as along x: a machine whose y axis is the slower one is asked for no arc that this axis cannot run.
TEST(Arcs, OfRoughingAreRunByTheSlowerAxisToo) {
    Context context;
    const Mesh mesh = weld(context, half_sphere());
    constexpr double kFast = 20'000, kSlow = 600;  // mm/s²
    for (const auto& [x, y] : {std::pair{kFast, kSlow}, {kSlow, kFast}, {kFast, kFast}}) {
        Job job;
        job.cutting.engagement = Engagement::nominal;
        job.machine.acceleration = x, job.machine.acceleration_y = y;
        int arcs = 0, hard = 0;
        for (const Layer& layer : make_plan(context, mesh, {}, job).layers)
            for (const Operation& op : layer.operations)
                for (const Move& m : op.moves) {
                    if (op.kind != OperationKind::rough || !m.is_arc()) continue;
                    const double v = m.feed / 60.0;
                    ++arcs;
                    if (v * v / std::hypot(to_mm(m.i), to_mm(m.j)) > 1.001 * kSlow) ++hard;
                }
        EXPECT_EQ(hard > 0, x == y) << hard << " of " << arcs << " arcs ask for more than " << kSlow;
    }
}

Plan plan_with(std::vector<Move> moves) {
    Plan plan;
    plan.input.file = "arcs.stl";
    plan.job.machine.frame = Frame::pattern_base;
    Layer layer;
    layer.index = 1;
    layer.z_top = layer.slab_thickness = 19;
    Operation operation;
    operation.kind = OperationKind::finish;
    operation.purpose = "level contours";
    operation.tool = 3;
    operation.spindle_rpm = 18000;
    operation.clearance_z = 29;
    operation.file = "L001_01_finish_T3.ngc";
    operation.moves = std::move(moves);
    layer.operations.push_back(operation);
    plan.layers.push_back(layer);
    return plan;
}

/// A path of every kind, one after another as a program.
std::vector<Move> program_moves(std::mt19937& random) {
    std::vector<Move> moves;
    for (int kind = 0; kind < 6; ++kind) {
        const std::vector<Move> path = random_path(random, kind, 0.0012);
        moves.push_back({path[0].x, path[0].y, 29 * kMm, 0});
        moves.push_back({path[0].x, path[0].y, path[0].z, 1500});
        moves.insert(moves.end(), path.begin() + 1, path.end());
        moves.push_back({path.back().x, path.back().y, 29 * kMm, 0});
    }
    return moves;
}

// A round post on a plate. What roughing leaves is no finished surface: its arcs may leave the chords that
// they are fitted to by a share of that, or it would have none; what the contours' own chords and these arcs
// take off it stays well under half.
TEST(Arcs, OfRoughingTakeAShareOfWhatItLeaves) {
    constexpr double radius = 30, half = 75;
    auto outline = [](double side, double corner, double chord) {
        return rounded_polygon(
            std::vector<Corner>{
                {-side, -side, corner}, {side, -side, corner}, {side, side, corner}, {-side, side, corner}},
            chord);
    };
    const Outline plate = outline(half, 1, 0.01), post = outline(radius, radius, 0.001);
    Context context;
    const Plan plan = make_plan(context, weld(context, test::plate_with(plate, 3, post, 17)), {}, {});
    ASSERT_EQ(plan.layers.size(), 1U);
    const Tool end_mill = tool_of_kind(plan.job, ToolKind::flat);
    int arcs = 0;
    std::size_t moves = 0;
    double nearest = 1e300;
    for (const Operation& op : plan.layers[0].operations) {
        if (op.kind != OperationKind::rough || op.tool != end_mill.number) continue;
        arcs += arcs_in(op.moves), moves += op.moves.size();
        for (const Spot& s : sampled(op.moves, 0.05))
            if (s.z < 17) nearest = std::min(nearest, std::hypot(s.x, s.y) - radius - end_mill.diameter / 2);
    }
    EXPECT_GT(arcs, 10);
    std::printf("%d arcs in %zu moves; nearest %.4f mm\n", arcs, moves, nearest);
    const double allowance = plan.job.cutting.wall_allowance;
    EXPECT_GT(nearest, allowance * (1 - 0.2 - 1.0 / 15));
    EXPECT_LT(nearest, allowance);
}

TEST(Arcs, TheInterpreterAcceptsThem) {
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    for (int round = 0; round < 10; ++round) {
        std::vector<Move> moves = program_moves(random);
        fit_arcs(moves, {.tolerance = 18});
        const Plan plan = plan_with(moves);
        const std::string text = program_text(plan, plan.layers[0], plan.layers[0].operations[0]);
        const support::CanonProgram canon = support::interpret_rs274(text, tool_table(plan.job));
        ASSERT_EQ(canon.arcs, arcs_in(moves));
        EXPECT_TRUE(canon.ended);
        // ARC_FEED(x end, y end, x centre, y centre, turns with sign, z end, …), in the order of the moves.
        std::vector<std::vector<double>> arcs;
        std::istringstream lines(canon.text);
        for (std::string line; std::getline(lines, line);)
            if (const std::size_t at = line.find("ARC_FEED("); at != std::string::npos)
                arcs.push_back(support::canon_numbers(line.substr(at + 8)));
        std::size_t k = 0;
        for (std::size_t m = 1; m < moves.size(); ++m) {
            if (!moves[m].is_arc()) continue;
            const std::vector<double>& arc = arcs[k++];
            const ArcShape shape = arc_shape(moves[m - 1], moves[m]);
            ASSERT_NEAR(arc.at(0), to_mm(moves[m].x), 1e-4);
            ASSERT_NEAR(arc.at(1), to_mm(moves[m].y), 1e-4);
            ASSERT_NEAR(arc.at(2), shape.x, 1e-4);
            ASSERT_NEAR(arc.at(3), shape.y, 1e-4);
            ASSERT_EQ(arc.at(4), shape.sweep > 0 ? 1 : -1);
        }
    }
}

TEST(Arcs, TheReaderSeesThePath) {
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    const std::vector<Move> path = program_moves(random);
    std::vector<Move> moves = path;
    const double tolerance = 0.0018;
    fit_arcs(moves, {.tolerance = tolerance * kUnitsPerMm});
    ASSERT_GT(arcs_in(moves), 0);
    const Plan plan = plan_with(moves);
    GcodeLimits limits;
    limits.arc_error = 0.0002;
    const Program program =
        read_gcode(program_text(plan, plan.layers[0], plan.layers[0].operations[0]), "arcs.ngc", limits);
    // Move by move: a straight one is one step, an arc several on one line that end where it ends.
    std::size_t step = 0;
    for (std::size_t m = 1; m + 1 < moves.size(); ++m) {
        if (moves[m] == moves[m - 1]) continue;
        const Move &from = moves[m - 1], &to = moves[m];
        if (from.x == to.x && from.y == to.y && from.z == to.z) continue;
        auto reached = [&](const ProgramStep& s) {
            return std::abs(s.x - to_mm(to.x)) < 1e-6 && std::abs(s.y - to_mm(to.y)) < 1e-6 &&
                   std::abs(s.z - to_mm(to.z)) < 1e-6;
        };
        const ArcShape shape = to.is_arc() ? arc_shape(from, to) : ArcShape{};
        Spot before{to_mm(from.x), to_mm(from.y), to_mm(from.z)};
        for (bool done = false; !done; ++step) {
            ASSERT_LT(step, program.steps.size());
            const ProgramStep& s = program.steps[step];
            if (!s.known()) continue;
            if (m == 1 && !reached(s) && !to.is_arc())
                continue;  // on the way to where the program's work starts
            done = reached(s);
            if (!to.is_arc()) {
                ASSERT_TRUE(done);
            } else {
                const double miss =
                    std::abs(std::hypot((s.x + before.x) / 2 - shape.x, (s.y + before.y) / 2 - shape.y) -
                             shape.radius);
                ASSERT_LE(miss, limits.arc_error + 3e-4) << "a chord of the reader's is far from the arc";
                before = {s.x, s.y, s.z};
            }
        }
    }
}

TEST(Arcs, TheWriterRefusesWhatIsNoArc) {
    const std::vector<Move> good{{0, 0, 29 * kMm, 0},
                                 {0, 0, 10 * kMm, 1000},
                                 {kMm, kMm, 10 * kMm, 1000, kMm, 0},
                                 {kMm, kMm, 29 * kMm, 0}};
    auto refused = [](const std::vector<Move>& moves) {
        const Plan plan = plan_with(moves);
        try {
            (void)program_text(plan, plan.layers[0], plan.layers[0].operations[0]);
        } catch (const Error& error) {
            return error.code() == "program.unsafe";
        }
        return false;
    };
    EXPECT_FALSE(refused(good));
    for (const int fault : {0, 1, 2, 3}) {
        std::vector<Move> moves = good;
        Move& arc = moves[2];
        if (fault == 0) arc.z = 9 * kMm;
        if (fault == 1) arc.feed = 0;
        if (fault == 2) arc.x = 2 * kMm, arc.y = 0, moves[3].x = 2 * kMm, moves[3].y = 0;  // half a circle
        if (fault == 3) arc.x = 0, arc.y = 0, moves[3].x = 0, moves[3].y = 0;              // a whole one
        EXPECT_TRUE(refused(moves)) << fault;
    }
}

TEST(Arcs, WordForWord) {
    const Plan plan = plan_with({{0, 0, 29 * kMm, 0},
                                 {0, 0, 10 * kMm, 1000},
                                 {kMm, kMm, 10 * kMm, 1000, 0, kMm},
                                 {2 * kMm, 0, 10 * kMm, 2000, 0, -kMm},
                                 {2 * kMm, -kMm, 10 * kMm, 2000},
                                 {2 * kMm, -kMm, 29 * kMm, 0}});
    const std::string text = program_text(plan, plan.layers[0], plan.layers[0].operations[0]);
    EXPECT_NE(text.find("G91.1\nG0 Z29\nX0 Y0\nG1 Z10 F1000\nG3 X1 Y1 I0 J1\nG2 X2 Y0 I0 J-1 F2000\nG1 "
                        "Y-1\nG0 Z29\nM5\nM2\n"),
              std::string::npos)
        << text;
}

}  // namespace
}  // namespace slabwright
