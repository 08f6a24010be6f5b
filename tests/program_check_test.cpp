// A program against what its plan says of it, and the tool table against the plan's tools.
#include "io/posts/program_check.h"

#include <gtest/gtest.h>

#include <random>

#include "engine/moves/motion_time.h"
#include "io/posts/gcode_reader.h"
#include "io/posts/gcode_writer.h"
#include "io/posts/tool_table.h"
#include "io/posts/tool_table_check.h"
#include "kernels/errors.h"
#include "tests/support/seed.h"

using namespace slabwright;

namespace {

Plan plan_of(std::vector<Move> moves, Frame frame) {
    Plan plan;
    plan.job.machine.frame = frame;
    Layer layer;
    layer.index = 1;
    layer.z_top = 18;
    Operation operation;
    operation.kind = OperationKind::rough;
    operation.tool = 2;
    operation.spindle_rpm = 18000;
    operation.clearance_z = 30;
    operation.blend = 0.1;
    operation.moves = std::move(moves);
    layer.operations.push_back(operation);
    plan.layers.push_back(layer);
    return plan;
}

/// Straight and round moves anywhere that begin and end as programs do.
/// @param upright some go along an axis, so that not all words of a line are written
std::vector<Move> random_moves(std::mt19937& random, bool upright) {
    const auto pick = [&](int low, int high) {
        return std::uniform_int_distribution<int>(low, high)(random);
    };
    std::vector<Move> moves{{pick(-900000, 900000), pick(-900000, 900000), 300000, 0}};
    Move at = moves[0];
    for (int i = 0; i < 400; ++i) {
        at.i = at.j = 0;
        at.feed = pick(0, 4) == 0 ? 0 : static_cast<std::uint32_t>(500 * pick(1, 18));
        const int u = pick(1000, 50000), v = pick(1000, 50000);
        if (i > 0 && at.feed > 0 && pick(0, 1) == 0) {  // a quarter turn to the left about (−v, u)
            at.i = -v;
            at.j = u;
            at.x += -v + u;
            at.y += u + v;
        } else {
            const int least = upright ? 0 : 1;
            at.x += (pick(0, 1) == 0 ? -1 : 1) * pick(least, 1) * u;
            at.y += (pick(0, 1) == 0 ? -1 : 1) * pick(least, 1) * v;
            if (pick(0, 2) == 0) at.z = pick(0, 250000);
        }
        moves.push_back(at);
    }
    at.i = at.j = 0;
    at.z = 300000;
    at.feed = 0;
    moves.push_back(at);
    return moves;
}

ProgramPlan planned(const Plan& plan) {
    const Operation& op = plan.layers[0].operations[0];
    return {op.spindle_rpm, op.blend, feed_lengths(op.moves)};
}

std::vector<Violation> check(const Plan& plan, const std::string& text) {
    Program program = read_gcode(text, "a.ngc", {.arc_error = 5e-4, .level_arc_error = 0.01});
    const double up = plan.job.machine.frame == Frame::layer_top ? plan.layers[0].z_top : 0;
    for (ProgramStep& s : program.steps) s.z += up;
    for (ProgramArc& a : program.arcs) a.arc.z += up;
    return check_program(program, planned(plan), &plan.job.tools[1], plan.job.machine);
}

std::string codes(const std::vector<Violation>& found) {
    std::string all;
    for (const Violation& v : found) all += (all.empty() ? "" : " ") + v.code + ":" + std::to_string(v.line);
    return all;
}

std::string table(const std::string& text) {
    const Job job;
    try {
        std::string all;
        for (const Violation& v : check_tool_table(text, "out/tool.tbl", job.tools)) {
            EXPECT_EQ(v.code, "tool.table");
            EXPECT_EQ(v.file, "tool.tbl");
            all += std::to_string(v.line) + " " + v.message + "\n";
        }
        return all;
    } catch (const Error& e) {
        return e.code() + " " + e.place();
    }
}

}  // namespace

TEST(ProgramCheck, WhatWasWrittenIsWhatWasPlanned) {
    std::mt19937 random(test::seed());
    for (int round = 0; round < 50; ++round) {
        const Plan plan =
            plan_of(random_moves(random, true), round % 2 == 0 ? Frame::pattern_base : Frame::layer_top);
        const Operation& op = plan.layers[0].operations[0];
        const std::vector<FeedLength> lengths = feed_lengths(op.moves);
        ASSERT_GT(lengths.size(), 10u);
        double cutting = 0;
        for (std::size_t i = 0; i < lengths.size(); ++i) {
            if (i > 0) {
                EXPECT_LT(lengths[i - 1].feed, lengths[i].feed);
            }
            if (lengths[i].feed > 0) cutting += lengths[i].mm;
        }
        EXPECT_NEAR(cutting, motion_time(op.moves, plan.job.machine).cutting_mm, 1e-6 * cutting);
        const std::string text = program_text(plan, plan.layers[0], op);
        EXPECT_EQ(codes(check(plan, text)), "") << text;
    }
}

TEST(ProgramCheck, AWordThatChangesALengthOrAFeedIsTold) {
    const std::uint32_t seed = test::seed();
    std::mt19937 random(seed);
    const Plan plan = plan_of(random_moves(random, false), Frame::pattern_base);
    const std::string good = program_text(plan, plan.layers[0], plan.layers[0].operations[0]);
    const std::size_t body = good.find("G0 Z");
    int told = 0;
    for (int round = 0; round < 300; ++round) {
        // One digit of a coordinate, a centre or a feed; not the last, 0.1 µm, which moves an arc by less.
        std::string text = good;
        const std::size_t at =
            std::uniform_int_distribution<std::size_t>(body + 4, good.rfind("G0 Z"))(random);
        if (text[at] < '0' || text[at] > '9' || text[at - 1] == 'G' || text[at - 4] == '.') continue;
        text[at] = text[at] == '9' ? '1' : static_cast<char>(text[at] + 1);
        try {
            EXPECT_NE(codes(check(plan, text)), "")
                << "seed " << seed << " at " << at << ": " << good.substr(at - 60, 61) << " … "
                << good.substr(at + 1, 40);
        } catch (const Error& e) {
            EXPECT_EQ(e.code(), "gcode.arc");
        }
        ++told;
    }
    EXPECT_GT(told, 100);
}

TEST(ProgramCheck, NoAxisIsAskedForMoreThanItDoes) {
    Plan plan = plan_of({{0, 0, 300000, 0},
                         {0, 0, 100000, 1500},
                         {300000, 0, 140000, 9000},
                         {500000, 0, 140000, 9000},
                         {500000, 0, 300000, 0}},
                        Frame::pattern_base);
    const std::string text = program_text(plan, plan.layers[0], plan.layers[0].operations[0]);
    const auto found = [&](double x, double y, double z) {
        plan.job.machine.rapid_feed = x, plan.job.machine.rapid_y = y, plan.job.machine.rapid_z = z;
        return codes(check(plan, text));
    };
    EXPECT_EQ(found(9000, 0, 0), "");
    EXPECT_EQ(found(9000, 10, 1500), "");  // 4 mm up over 30: z does 1190
    EXPECT_EQ(found(9000, 0, 1499), "program.axis:18");
    EXPECT_EQ(found(9000, 0, 1189), "program.axis:18");
    EXPECT_EQ(found(8999, 0, 0), "program.axis:20");
}

TEST(ProgramCheck, EachFaultByItsName) {
    const Plan plan =
        plan_of({{0, 0, 300000, 0}, {0, 0, 100000, 1500}, {500000, 0, 100000, 9000}, {500000, 0, 300000, 0}},
                Frame::pattern_base);
    const std::string good = program_text(plan, plan.layers[0], plan.layers[0].operations[0]);
    const auto found = [&](const std::string& from, const std::string& to) {
        std::string text = good;
        text.replace(text.find(from), from.size(), to);
        return codes(check(plan, text));
    };
    EXPECT_EQ(found("", ""), "");
    EXPECT_EQ(found("S18000", "S50"), "program.spindle:18");
    EXPECT_EQ(found("S18000", "S20000"), "program.spindle:18 program.spindle:18");
    EXPECT_EQ(found("F9000", "F9000\nS17000"), "program.spindle:21") << "before the last retract";
    std::string fast = good;
    fast.replace(fast.find("S18000"), 6, "S20000");
    EXPECT_EQ(check(plan, fast)[0].size, 2000) << "over what the machine bears";
    EXPECT_EQ(found("F9000", "F9000\nM5"), "program.spindle:21");
    EXPECT_EQ(found("M5", "S17000\nM5"), "");
    EXPECT_EQ(found("X50 F9000", "S17000\nX50 F9000"), "program.spindle:20 program.spin_up:20");
    EXPECT_EQ(found("G4 P3", "G4 P0.5"), "program.spin_up:18");
    EXPECT_EQ(found("G4 P3", "G4 P3600"), "program.dwell:15");
    EXPECT_EQ(found("F9000", "F9000\nG4 P10"), "program.dwell:20");
    EXPECT_EQ(found("F9000", "F9001"), "program.feed:19 program.lengths:0");
    EXPECT_EQ(found("F1500", "F1600"), "program.lengths:0");
    EXPECT_EQ(found("P0.1 Q0", "P0.2 Q0"), "program.path_mode:10");
    EXPECT_EQ(found("P0.1 Q0", "P0.1"), "program.path_mode:10");
    EXPECT_EQ(found("P0.1 Q0", "P0.02 Q0"), "program.path_mode:10");
    EXPECT_EQ(found("G0 Z30\nX0", "G0 X0 Z30\nX0"), "program.begin:16");
    EXPECT_EQ(found("G0 Z30\nM5", "M5"), "program.end:19 program.lengths:0");
    EXPECT_EQ(found("G0 Z30\nM5", "G0 Z29\nM5"), "program.end:20 program.lengths:20");
    EXPECT_EQ(found("G0 Z30\nM5", "G0 Z30 X60\nM5"), "program.end:20 program.lengths:20");
    EXPECT_EQ(found("G0 Z30\nX0 Y0", "G0 Z30\nX0 Y0\nX9\nX0"), "program.lengths:18");
    // A corner of a staircase pushed along: as long as planned, but not there.
    EXPECT_EQ(found("X50 F9000", "X20 F9000\nY1\nX50"), "program.lengths:19");
    EXPECT_EQ(found("X0 Y0\n", "X1 Y0\n"), "program.lengths:19");
    EXPECT_EQ(codes(check_program(Program{}, {}, nullptr, {})), "program.begin:0");
}

TEST(ToolTable, TheWrittenOnePasses) { EXPECT_EQ(table(tool_table(Job{})), ""); }

TEST(ToolTable, WhateverLinuxcncWouldApplyIsTold) {
    const std::string one = "T1 P1 D50 Z0 ;face\n", three = "T3 P3 D6.35 Z0 ;ball\n";
    const auto two = [&](const std::string& row) { return table(one + row + "\n" + three); };
    EXPECT_EQ(two("T2 P2 D12.7 Z0 ; X50"), "");
    EXPECT_EQ(two("t2 p2 d+12.7 z0 x0 Y0.0 I0 J0 Q0\r"), "");
    EXPECT_EQ(two("T2 P2 D12.7 Z0 X50 Y-30"),
              "2 tool 2 has the offset X50, which shifts its paths\n"
              "2 tool 2 has the offset Y-30, which shifts its paths\n");
    for (const char* word : {"A1", "B1", "C1", "U1", "V1", "W1"})
        EXPECT_NE(two("T2 P2 D12.7 Z0 " + std::string(word)).find("offset"), std::string::npos) << word;
    for (const char* word : {"I10", "J-5", "Q3"})
        EXPECT_NE(two("T2 P2 D12.7 Z0 " + std::string(word)).find("lathe"), std::string::npos) << word;
    EXPECT_EQ(two("T2 P2 D12.7 Z5"), "2 tool 2 has a length; the machine keeps what it measured\n");
    EXPECT_NE(two("T2 P2 D12.8"), "");
    EXPECT_EQ(two("T2 P2 Z0"), "2 tool 2 has the diameter 0 where the plan says 12.7\n");
    EXPECT_EQ(two("T2 P3 D12.7"), "2 tool 2 is said to be in pocket 3; a changer would fetch another\n");
    EXPECT_EQ(two("T2 D12.7"), "2 tool 2 has no pocket (P)\n");
    EXPECT_EQ(two("P2 D12.7"), "2 a row that names no tool\n0 tool 2 of the plan is not in the table\n");
    EXPECT_EQ(two("T2 P2 D12.7\nT2 P2 D12.7"), "3 a second row for tool 2\n");
    EXPECT_EQ(two("T2 P2 D12.7 D12.7"), "2 the word D stands twice in a row\n");
    EXPECT_EQ(two("T2 P2 D12.7 K1"), "2 the word K names nothing in a tool table\n");
    EXPECT_EQ(two("T2 P2 D12.7 \xC3\xA4"), "2 the byte 0xC3\n");
    EXPECT_EQ(two("T7 P7 D12.7"), "2 tool 7 is not in the plan\n0 tool 2 of the plan is not in the table\n");
    EXPECT_EQ(two("T2.5 P2 D12.7"),
              "2 tool 2.5 is not in the plan\n0 tool 2 of the plan is not in the table\n");
    EXPECT_EQ(two(";" + std::string(300, 'x')).substr(0, 22), "2 a row of 301 charact");
    EXPECT_EQ(two("T2 P2 Dten"), "verify.tool_table out/tool.tbl:2");
    EXPECT_EQ(two("T2 P2 D1e1"), "verify.tool_table out/tool.tbl:2");
    EXPECT_EQ(two("T2 P2 D 12.7"), "verify.tool_table out/tool.tbl:2");
    EXPECT_EQ(table(""),
              "0 tool 1 of the plan is not in the table\n0 tool 2 of the plan is not in the table\n"
              "0 tool 3 of the plan is not in the table\n");
}
