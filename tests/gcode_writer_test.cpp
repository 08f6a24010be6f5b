// Programs, judged by LinuxCNC's interpreter: it accepts them, and its motions are the engine's moves to the
// last 0.1 µm.
#include "io/posts/gcode_writer.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <random>
#include <regex>
#include <sstream>

#include "io/posts/tool_table.h"
#include "io/slabwright.h"
#include "kernels/errors.h"
#include "tests/support/rs274.h"
#include "tests/support/seed.h"

using namespace slabwright;
using slabwright::support::CanonMotion;
using slabwright::support::CanonProgram;

namespace {

constexpr std::int32_t kMm = 10000;

Plan plan_with(std::vector<Move> moves, double clearance_z, Frame frame = Frame::pattern_base) {
    Plan plan;
    plan.input.file = "pump.stl";
    plan.job.machine.frame = frame;
    Layer layer;
    layer.index = 2;
    layer.z_bottom = 18.5;
    layer.z_top = 37;
    layer.slab_thickness = 19;
    Operation operation;
    operation.kind = OperationKind::rough;
    operation.purpose = "levels";
    operation.tool = 2;
    operation.spindle_rpm = 18000;
    operation.clearance_z = clearance_z;
    operation.moves = std::move(moves);
    operation.file = "L002_02_rough_T2.ngc";
    layer.operations.push_back(operation);
    plan.layers.push_back(layer);
    return plan;
}

std::string text_of(const Plan& plan) {
    return program_text(plan, plan.layers[0], plan.layers[0].operations[0]);
}

/// Random moves that begin and end as a program must; steps from one unit to decimetres, repeats and zero
/// moves included.
std::vector<Move> random_moves(std::mt19937& random, std::size_t count, std::int32_t clearance) {
    const auto pick = [&](int low, int high) {
        return std::uniform_int_distribution<int>(low, high)(random);
    };
    std::vector<Move> moves{{pick(-500000, 500000), pick(-500000, 500000), clearance, 0}};
    Move at = moves[0];
    for (std::size_t i = 0; i < count; ++i) {
        const int scale = static_cast<int>(std::pow(10, pick(0, 6)));
        if (pick(0, 2) != 0) at.x += pick(-scale, scale);
        if (pick(0, 2) != 0) at.y += pick(-scale, scale);
        if (pick(0, 3) == 0) at.z = pick(-30, 40) * kMm + pick(0, 9999);
        at.feed = pick(0, 5) == 0 ? 0 : static_cast<std::uint32_t>(pick(1, 3) * 1500);
        moves.push_back(at);
    }
    at.z = clearance;
    at.feed = 0;
    moves.push_back(at);
    if (moves[moves.size() - 2].z == clearance) moves[moves.size() - 2].feed = 0;
    return moves;
}

/// The engine's moves as the canonical motions must show them between the first and the last: without those
/// that go nowhere. Where the second move is no rapid at clearance height, the tool is first brought over the
/// place of the first.
std::vector<Move> travelled(const std::vector<Move>& moves) {
    std::vector<Move> out;
    if (moves[1].feed != 0 || moves[1].z != moves[0].z) out.push_back(moves[0]);
    for (std::size_t i = 1; i + 1 < moves.size(); ++i)
        if (out.empty() || moves[i].x != out.back().x || moves[i].y != out.back().y ||
            moves[i].z != out.back().z)
            out.push_back(moves[i]);
    return out;
}

}  // namespace

TEST(Gcode, WordForWord) {
    const Plan plan = plan_with({{0, 0, 47 * kMm, 0},
                                 {-12500, 3 * kMm, 47 * kMm, 0},
                                 {-12500, 3 * kMm, 38 * kMm, 0},
                                 {-12500, 3 * kMm, 350001, 1500},
                                 {1, 3 * kMm, 350001, 9000},
                                 {1, -5000, 350001, 9000},
                                 {1, -5000, 47 * kMm, 0}},
                                47);
    EXPECT_EQ(text_of(plan),
              "(Slabwright " + version() +
                  ": L002_02_rough_T2.ngc)\n(pattern pump.stl)\n(layer 2 of 1, z 18.5 to 37 mm from the "
                  "pattern's bottom)\n"
                  "(z = 0 at the pattern's bottom)\n(rough: levels)\n(tool 2: flat end mill 1/2 in, diameter "
                  "12.7 mm)\n(cutting 0 mm, 0 min)\n"
                  "G21 G17 G90 G94 G40 G49 G80\nG8 G97\nG64 P0.02 Q0\nG54\nT2 M6\nG43 H2\nS18000 M3\nG4 P3\n"
                  "G0 Z47\nX-1.25 Y3\nZ38\nG1 Z35.0001 F1500\nX0.0001 F9000\nY-0.5\nG0 Z47\nM5\nM2\n");
}

TEST(Gcode, LayerTopCountsFromTheLayersTop) {
    const Plan plan =
        plan_with({{0, 0, 47 * kMm, 0}, {0, 0, 369999, 600}, {0, 0, 47 * kMm, 0}}, 47, Frame::layer_top);
    const std::string text = text_of(plan);
    EXPECT_NE(text.find("G0 Z10\nX0 Y0\nG1 Z-0.0001 F600\nG0 Z10\nM5\nM2\n"), std::string::npos) << text;
    EXPECT_NE(text.find("(z = 0 at the layer's top)"), std::string::npos);
}

TEST(Gcode, InterpreterMovesWhereTheEngineSaid) {
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    for (int round = 0; round < 20; ++round) {
        const Frame frame = round % 2 == 0 ? Frame::pattern_base : Frame::layer_top;
        const Plan plan = plan_with(random_moves(random, 1000, 50 * kMm), 50, frame);
        const std::string text = text_of(plan);
        const CanonProgram canon = support::interpret_rs274(text, tool_table(plan.job));
        EXPECT_EQ(canon.tool, 2);
        EXPECT_EQ(canon.spindle_rpm, 18000);
        EXPECT_TRUE(canon.clockwise);
        EXPECT_EQ(canon.dwell_s, 3);
        EXPECT_TRUE(canon.ended);
        EXPECT_EQ(canon.arcs, 0);
        EXPECT_NE(canon.text.find("SET_MOTION_CONTROL_MODE(CANON_CONTINUOUS, 0.020000)"), std::string::npos);
        EXPECT_NE(canon.text.find("SET_NAIVECAM_TOLERANCE(0.0000)"), std::string::npos)
            << "every point is passed by, none left out";
        const double origin = frame == Frame::layer_top ? 37 : 0;
        const std::vector<Move>& moves = plan.layers[0].operations[0].moves;
        // First and last motions are Z-only rapids to the clearance height.
        ASSERT_GE(canon.motions.size(), 2u);
        const CanonMotion &first = canon.motions.front(), &last = canon.motions.back();
        EXPECT_TRUE(first.rapid && first.x == 0 && first.y == 0)
            << "the interpreter starts at x 0 y 0 and must not have left it";
        EXPECT_NEAR(first.z, 50 - origin, 1e-9);
        EXPECT_TRUE(last.rapid);
        EXPECT_NEAR(last.z, 50 - origin, 1e-9);
        const std::vector<CanonMotion> between(canon.motions.begin() + 1, canon.motions.end() - 1);
        const std::vector<Move> expected = travelled(moves);
        ASSERT_EQ(between.size(), expected.size());
        for (std::size_t i = 0; i < expected.size(); ++i) {
            const CanonMotion& canonical = between[i];
            const Move& move = expected[i];
            ASSERT_EQ(std::llround(canonical.x * 1e4), move.x) << i;
            ASSERT_EQ(std::llround(canonical.y * 1e4), move.y) << i;
            ASSERT_EQ(std::llround((canonical.z + origin) * 1e4), move.z) << i;
            ASSERT_EQ(canonical.rapid, move.feed == 0) << i;
            ASSERT_EQ(canonical.feed, move.feed) << i;
        }
    }
}

TEST(Gcode, EveryLineIsPlain) {
    std::mt19937 random(7);
    const std::string text = text_of(plan_with(random_moves(random, 5000, 50 * kMm), 50));
    const std::regex motion(
        "(G[01] )?(X-?(0|[1-9][0-9]*)(\\.[0-9]{0,3}[1-9])?)?( ?Y-?(0|[1-9][0-9]*)(\\.[0-9]{0,3}[1-9])?)?( "
        "?Z-?(0|[1-9][0-9]*)(\\.[0-9]{0,3}[1-9])?)?( F[0-9]+)?");
    const std::regex other(
        "\\([^()]*\\)|G21 G17 G90 G94 G40 G49 G80|G8 G97|G64 P0\\.02 Q0|G54|T2 M6|G43 H2|S18000 M3|G4 "
        "P3|M5|M2");
    std::istringstream lines(text);
    std::vector<std::string> motions;
    for (std::string line; std::getline(lines, line);) {
        ASSERT_TRUE(std::regex_match(line, motion) || std::regex_match(line, other)) << line;
        ASSERT_FALSE(line.empty());
        if (std::regex_match(line, motion)) motions.push_back(line);
    }
    EXPECT_EQ(motions.front(), "G0 Z50");
    EXPECT_EQ(motions.back(), "G0 Z50");
}

TEST(Gcode, ExtremeCoordinatesStayExact) {
    const std::int32_t far = 2147480000;
    const Plan plan = plan_with(
        {{far, -far, 50 * kMm, 0}, {far, -far, -far, 9}, {-far, far, -far, 9}, {-far, far, 50 * kMm, 0}}, 50,
        Frame::layer_top);
    EXPECT_NE(text_of(plan).find("X214748 Y-214748\nG1 Z-214785 F9\nX-214748 Y214748\n"), std::string::npos)
        << text_of(plan);
}

TEST(Gcode, UnsafeOperationsAreRefusedBeforeAnythingIsWritten) {
    const std::vector<Move> good{{0, 0, 500000, 0}, {0, 0, 400000, 100}, {0, 0, 500000, 0}};
    const auto refused = [](const Plan& plan) {
        bool wrote = false;
        try {
            write_program(plan, plan.layers[0], plan.layers[0].operations[0],
                          [&](std::string_view) { wrote = true; });
        } catch (const Error& error) {
            EXPECT_FALSE(wrote);
            return error.code() == "program.unsafe" && error.kind() == ErrorKind::no_plan;
        }
        return false;
    };
    EXPECT_FALSE(refused(plan_with(good, 50)));
    EXPECT_TRUE(refused(plan_with({}, 50)));
    EXPECT_TRUE(refused(plan_with(good, 49))) << "does not begin at its clearance height";
    auto moves = good;
    moves.back().x = 1;
    EXPECT_TRUE(refused(plan_with(moves, 50))) << "the last motion is not Z-only";
    moves = good;
    moves.back().feed = 100;
    EXPECT_TRUE(refused(plan_with(moves, 50)));
    moves = good;
    moves.front().feed = 100;
    EXPECT_TRUE(refused(plan_with(moves, 50)));
    Plan plan = plan_with(good, 50);
    plan.layers[0].operations[0].tool = 9;
    EXPECT_TRUE(refused(plan));
    plan = plan_with(good, 50);
    plan.layers[0].operations[0].spindle_rpm = 0;
    EXPECT_TRUE(refused(plan));
}

TEST(Gcode, NamesFromOutsideCannotLeaveTheirComments) {
    EXPECT_EQ(comment_text("a(b)c\nM3 S9\t\"\xC3\xA4\""), "a[b]c M3 S9 \"?\"");
    EXPECT_EQ(comment_text(std::string(1000, 'x')).size(), 200u);
    Plan plan = plan_with({{0, 0, 500000, 0}, {0, 0, 400000, 100}, {0, 0, 500000, 0}}, 50);
    plan.input.file = "a) G0 X999 (b\nG0 X999\n.stl";
    plan.job.tools[1].name = "mill)\nM30\n(; " + std::string(500, 'y');
    const std::vector<CanonMotion> motions = support::run_rs274(text_of(plan), tool_table(plan.job));
    EXPECT_EQ(motions.size(), 4u);
    for (const CanonMotion& motion : motions) EXPECT_EQ(motion.x, 0);
}

TEST(Gcode, JudgeRefusesWhatIsWrong) {
    // A judge that accepts anything would make the tests above worthless.
    const std::string table = tool_table(Job{});
    EXPECT_THROW(support::run_rs274("G21 G90\nG1 X1e2 F100\nM2\n", table), std::runtime_error);
    EXPECT_THROW(support::run_rs274("G21 G90\nG1 X1\nM2\n", table), std::runtime_error)
        << "a feed motion without feed";
    EXPECT_THROW(support::run_rs274("T77 M6\nM2\n", table), std::runtime_error)
        << "a tool that the table lacks";
}

TEST(Gcode, LongProgramsComeInPieces) {
    std::mt19937 random(11);
    const Plan plan = plan_with(random_moves(random, 1000000, 50 * kMm), 50);
    std::size_t pieces = 0, bytes = 0, largest = 0;
    std::string joined;
    const auto begin = std::chrono::steady_clock::now();
    write_program(plan, plan.layers[0], plan.layers[0].operations[0], [&](std::string_view piece) {
        ++pieces;
        bytes += piece.size();
        largest = std::max(largest, piece.size());
        joined += piece;
    });
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    std::printf("%zu bytes in %.3f s, %.0f MB/s\n", bytes, seconds,
                static_cast<double>(bytes) / seconds / 1e6);
    EXPECT_GT(pieces, 10u);
    EXPECT_LT(largest, std::size_t{2} << 20);
    EXPECT_EQ(joined, text_of(plan));
}

TEST(ToolTable, ListsEveryToolOnceByNumber) {
    Job job;
    std::swap(job.tools[0], job.tools[2]);
    EXPECT_EQ(tool_table(job),
              "T1 P1 D50 Z0 ;face mill 50 mm\nT2 P2 D12.7 Z0 ;flat end mill 1/2 in\nT3 P3 D6.35 Z0 ;ball end "
              "mill 1/4 in\n");
}
