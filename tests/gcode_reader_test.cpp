// The reader against the language as LinuxCNC documents it, and against everything that it must refuse.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "io/posts/gcode_reader.h"
#include "kernels/errors.h"

using namespace slabwright;

namespace {

const std::string kBlend = " G64 P0.02 Q0";
const std::string kHead = "(a comment)\nG21 G17 G90 G94 G40 G49 G80\nG54 G8 G97 G91.1" + kBlend +
                          "\nT3 M6\nG43 H3\nS18000 M3\nG4 P3\n";

Program read(const std::string& body, const GcodeLimits& limits = {}) {
    return read_gcode(kHead + body + "M5\nM2\n", "nc/test.ngc", limits);
}

/// The error's code and place.
std::string refusal(const std::string& text) {
    try {
        (void)read_gcode(text, "nc/x.ngc");
    } catch (const Error& e) {
        EXPECT_EQ(e.kind(), ErrorKind::verification);
        return e.code() + " " + e.place();
    }
    return "accepted";
}
std::string refused_body(const std::string& body) { return refusal(kHead + body + "M5\nM2\n"); }

}  // namespace

TEST(GcodeReader, ReadsWhatTheWriterEmits) {
    const Program p = read("G0 Z30\nX10 Y-2.5\nZ1\nG1 Z-0.5 F1500\nX20.1234 F5000\nY4\nG0 Z30\n");
    EXPECT_EQ(p.tool, 3);
    EXPECT_EQ(p.spindle_rpm, 18000);
    EXPECT_EQ(p.dwell_s, 3);
    ASSERT_EQ(p.steps.size(), 7u);
    EXPECT_FALSE(p.steps[0].known());
    EXPECT_TRUE(std::isnan(p.steps[0].x));
    EXPECT_EQ(p.steps[0].z, 30);
    EXPECT_TRUE(p.steps[1].known() && p.steps[1].rapid());
    EXPECT_EQ(p.steps[3].feed, 1500);
    EXPECT_EQ(p.steps[3].z, -0.5);
    EXPECT_EQ(p.steps[4].x, 20.1234);
    EXPECT_EQ(p.steps[5].feed, 5000);
    EXPECT_EQ(p.steps[5].line, 13u);
    EXPECT_TRUE(p.steps[5].spindle);
    EXPECT_TRUE(p.steps[6].rapid());
}

TEST(GcodeReader, SpindleAndUnits) {
    const Program off = read("G0 Z30 X0 Y0\nM5\nG1 X5 F100\n");
    EXPECT_FALSE(off.steps.back().spindle);
    const Program slow = read("S0\nG0 X0 Y0 Z1\nG1 X1 F10\n");
    EXPECT_FALSE(slow.steps.back().spindle) << "a spindle at S0 does not turn";
    const Program inches = read("G20\nG0 X1 Y1 Z1\nG1 X2 F10\nG21\nX1\n");
    EXPECT_DOUBLE_EQ(inches.steps[1].x, 50.8);
    EXPECT_DOUBLE_EQ(inches.steps[1].feed, 254);
    EXPECT_DOUBLE_EQ(inches.steps[2].x, 1);
    const Program incremental = read("G0 X1 Y1 Z1\nG91\nG1 X2 Z-0.5 F10\nX2\nG90\nX0\n");
    EXPECT_DOUBLE_EQ(incremental.steps[2].x, 5);
    EXPECT_DOUBLE_EQ(incremental.steps[2].z, 0.5);
    EXPECT_DOUBLE_EQ(incremental.steps[3].x, 0);
    const Program small = read_gcode(
        "%\n" + kHead + "n10 g0 x 1.5 y-2 (lower case and blanks) z+3 ; the rest\nm30\n\n(end)\n%\n", "x");
    EXPECT_EQ(small.steps.at(0).x, 1.5);
    EXPECT_EQ(small.steps.at(0).z, 3);
}

TEST(GcodeReader, HowFarCornersMayBeRounded) {
    std::string bare = kHead;
    bare.erase(bare.find(kBlend), kBlend.size());
    const auto blends = [&](const std::string& body) {
        const Program p = read_gcode(bare + body + "G0 X0 Y0 Z1\nG1 X1 F10\nM5\nM2\n", "nc/test.ngc");
        return std::pair{p.blend, p.strays};
    };
    EXPECT_EQ(refusal(bare + "G0 X0 Y0 Z1\nM2\n"), "gcode.unset nc/x.ngc:8");
    EXPECT_EQ(refused_body("G64\n"), "gcode.path_mode nc/x.ngc:8") << "LinuxCNC then strays without limit";
    EXPECT_EQ(refused_body("G64 P0\n"), "gcode.path_mode nc/x.ngc:8") << "no limit either";
    EXPECT_EQ(refused_body("G64 Q0.03\n"), "gcode.path_mode nc/x.ngc:8");
    EXPECT_EQ(blends("G64 P0.1 Q0\n"), std::pair(0.1, 0.1));
    EXPECT_EQ(blends("G64 P0.1\n"), std::pair(0.1, 0.2))
        << "points within P of a straight way are left out too";
    EXPECT_EQ(blends("G64 P0.1 Q0.03\n"), std::pair(0.1, 0.1 + 0.03));
    EXPECT_EQ(blends("G20\nG64 P0.01 Q0\nG21\n"), std::pair(0.254, 0.254));
    EXPECT_EQ(blends("G64 P0.1 Q0\nG64 P0.05 Q0\n"), std::pair(0.05, 0.1));
    EXPECT_EQ(blends("G64 P0.1 Q0\nG61\n"), std::pair(0.0, 0.1));
    EXPECT_EQ(blends("G61.1\n"), std::pair(0.0, 0.0));
    EXPECT_EQ(refused_body("G64 P-1\n"), "gcode.number nc/x.ngc:8");
    EXPECT_EQ(refused_body("G64 P1 Q-1\n"), "gcode.number nc/x.ngc:8");
    EXPECT_EQ(refused_body("G61 Q0.1\n"), "gcode.unused_word nc/x.ngc:8");
    EXPECT_EQ(refused_body("G61 P0.1\n"), "gcode.unused_word nc/x.ngc:8");
}

TEST(GcodeReader, CornersAreRoundedAsBeforeUntilAnOperationSaysOtherwise) {
    std::string text = kHead;
    text.replace(text.find(kBlend), kBlend.size(), " G64 P0.1 Q0.03");
    const std::string cut = "G0 X0 Y0 Z1\nG1 X1 F10\n";
    const std::vector<Program> read = read_operations(
        text + cut + "M5\nT4 M6\nG43 H4\nS9000 M3\n" + cut + "S8000 M3\nG64 P0.05 Q0\n" + cut + "M5\nM2\n",
        "nc/test.ngc", dialect_of(Post::linuxcnc));
    ASSERT_EQ(read.size(), 3u);
    for (const std::size_t k : {0U, 1U}) {
        EXPECT_EQ(read[k].tool, k == 0 ? 3 : 4);
        EXPECT_EQ(read[k].blend, 0.1);
        EXPECT_EQ(read[k].strays, 0.1 + 0.03);
        EXPECT_EQ(read[k].strays_line, 3u);
    }
    EXPECT_EQ(read[2].blend, 0.05);
    EXPECT_EQ(read[2].strays, 0.05);
    EXPECT_EQ(read[2].strays_line, 17u);
}

TEST(GcodeReader, ArcsStayWithinTheirTolerance) {
    struct Case {
        std::string text;
        double cx, cy, r, sweep, end_z;
    };
    constexpr double pi = std::numbers::pi;
    for (const Case& c :
         {Case{"G3 X0 Y10 I-10 J0\n", 0, 0, 10, pi / 2, 0},
          Case{"G2 X0 Y10 I-10 J0\n", 0, 0, 10, -3 * pi / 2, 0},
          Case{"G3 X10 Y0 I-10\n", 0, 0, 10, 2 * pi, 0}, Case{"G2 X10 Y0 I-10 Z-3\n", 0, 0, 10, -2 * pi, -3},
          Case{"G3 X0 Y10 R10\n", 0, 0, 10, pi / 2, 0}, Case{"G3 X0 Y10 R-10\n", 10, 10, 10, 3 * pi / 2, 0},
          Case{"G2 X0 Y10 R10\n", 10, 10, 10, -pi / 2, 0},
          Case{"G90.1 G3 X0 Y10 I0 J0\n", 0, 0, 10, pi / 2, 0}}) {
        const Program p = read("G0 X10 Y0 Z0\nF1000\n" + c.text);
        double length = 0;
        ASSERT_GT(p.steps.size(), 3u) << c.text;
        for (std::size_t i = 1; i < p.steps.size(); ++i) {
            const ProgramStep &a = p.steps[i - 1], &b = p.steps[i];
            EXPECT_NEAR(std::hypot(b.x - c.cx, b.y - c.cy), c.r, 1e-9) << c.text;
            // The chord's middle lies inside the circle by at most the tolerance.
            EXPECT_NEAR(std::hypot((a.x + b.x) / 2 - c.cx, (a.y + b.y) / 2 - c.cy), c.r - 0.00005, 0.000051)
                << c.text;
            const double turn = (a.x - c.cx) * (b.y - c.cy) - (a.y - c.cy) * (b.x - c.cx);
            EXPECT_GT(turn * c.sweep, 0) << c.text;
            length += std::hypot(b.x - a.x, b.y - a.y);
        }
        EXPECT_NEAR(length, c.r * std::abs(c.sweep), 0.01) << c.text;
        EXPECT_EQ(p.steps.back().z, c.end_z);
        EXPECT_GT(p.arc_error, 0);
        EXPECT_LE(p.arc_error, 1e-4);
        ASSERT_EQ(p.arcs.size(), c.end_z == 0 ? 1u : 0u) << "a helix is no level arc";
        if (p.arcs.empty()) continue;
        const ProgramArc& a = p.arcs[0];
        EXPECT_EQ(a.begin, 1u);
        EXPECT_EQ(a.end, p.steps.size());
        EXPECT_NEAR(a.arc.x, c.cx, 1e-9);
        EXPECT_NEAR(a.arc.y, c.cy, 1e-9);
        EXPECT_NEAR(a.arc.radius, c.r, 1e-9);
        EXPECT_NEAR(a.arc.turn, c.sweep, 1e-9);
        EXPECT_EQ(p.chord_error, p.arc_error);
        EXPECT_EQ(p.close_steps(), p.steps.size());
        // Few chords of it will do where the arc itself is at hand; as many as before are still known.
        const Program few = read("G0 X10 Y0 Z0\nF1000\n" + c.text, {.level_arc_error = 0.01});
        ASSERT_EQ(few.arcs.size(), 1u);
        EXPECT_LT(few.steps.size(), p.steps.size() / 5);
        EXPECT_GT(few.chord_error, 0.005);
        EXPECT_LE(few.chord_error, 0.01);
        EXPECT_EQ(few.arc_error, p.arc_error);
        EXPECT_EQ(few.close_steps(), p.steps.size());
        for (std::size_t k = 0; k < p.steps.size(); ++k) {
            const auto [x, y] =
                few.arcs[0].at(static_cast<double>(k) / static_cast<double>(p.steps.size() - 1));
            EXPECT_NEAR(x, p.steps[k].x, 1e-9);
            EXPECT_NEAR(y, p.steps[k].y, 1e-9);
        }
    }
    const Program helix = read("G0 X10 Y0 Z0\nF1000\nG2 X10 Y0 I-10 Z-3\n", {.level_arc_error = 0.01});
    EXPECT_LE(helix.chord_error, 1e-4) << "nobody takes a helix itself";
    // Other planes: XZ is G18 with I and K, YZ is G19 with J and K; seen from +y, G3 turns from z towards x.
    const Program xz = read("G0 X10 Y0 Z0\nF100\nG18 G3 X0 Z-10 I-10 K0\n");
    for (const ProgramStep& s : xz.steps) EXPECT_NEAR(std::hypot(s.x, s.z), 10, 1e-9);
    EXPECT_LT(xz.steps[xz.steps.size() / 2].z, 0);
    const Program yz = read("G0 X0 Y10 Z0\nF100\nG19 G3 Y0 Z10 J-10 K0\n");
    for (const ProgramStep& s : yz.steps) EXPECT_NEAR(std::hypot(s.y, s.z), 10, 1e-9);
    EXPECT_GT(yz.steps[yz.steps.size() / 2].z, 0);
}

TEST(GcodeReader, RefusesWithFileAndLine) {
    EXPECT_EQ(refused_body("G1 X1e3 F100\n"), "gcode.unknown_word nc/x.ngc:8");
    EXPECT_EQ(refused_body("G0 Z1\nG77\n"), "gcode.unknown_word nc/x.ngc:9");
    EXPECT_EQ(refused_body("G53 G0 Z0\n"), "gcode.unknown_word nc/x.ngc:8");
    EXPECT_EQ(refused_body("G92 X0\n"), "gcode.unknown_word nc/x.ngc:8");
    EXPECT_EQ(refused_body("G10 L2 P1 X0\n"), "gcode.unknown_word nc/x.ngc:8");
    EXPECT_EQ(refused_body("A90\n"), "gcode.unknown_word nc/x.ngc:8");
    EXPECT_EQ(refused_body("M98 P100\n"), "gcode.unknown_word nc/x.ngc:8");
    EXPECT_EQ(refused_body("#1=5\n"), "gcode.unknown_word nc/x.ngc:8");
    EXPECT_EQ(refused_body("G0 X#1\n"), "gcode.number nc/x.ngc:8");
    EXPECT_EQ(refused_body("G0 X1.2.3\n"), "gcode.number nc/x.ngc:8");
    EXPECT_EQ(refused_body("G0 X\n"), "gcode.number nc/x.ngc:8");
    EXPECT_EQ(refused_body("G0 X1 X2\n"), "gcode.twice nc/x.ngc:8");
    EXPECT_EQ(refused_body("G0 G1 X1\n"), "gcode.twice nc/x.ngc:8");
    EXPECT_EQ(refused_body("(not closed\n"), "gcode.comment nc/x.ngc:8");
    EXPECT_EQ(refused_body("G0 X0 Y0 Z0\nG1 X1\n"), "gcode.feed nc/x.ngc:9");
    EXPECT_EQ(refused_body("G1 Z1 F100\n"), "gcode.unknown_place nc/x.ngc:8");
    EXPECT_EQ(refused_body("G0 Z1\nG1 X1 Y1 F100\n"), "gcode.unknown_place nc/x.ngc:9");
    EXPECT_EQ(refused_body("G91 G0 Z1\n"), "gcode.unknown_place nc/x.ngc:8");
    EXPECT_EQ(refused_body("G80\nX1\n"), "gcode.motion nc/x.ngc:9");
    EXPECT_EQ(refused_body("M4\n"), "gcode.spindle nc/x.ngc:8");
    EXPECT_EQ(refused_body("T2 M6\n"), "gcode.tool nc/x.ngc:8");
    EXPECT_EQ(refused_body("G43 H2\n"), "gcode.offset nc/x.ngc:8");
    EXPECT_EQ(refused_body("G55\n"), "gcode.offset nc/x.ngc:8");
    EXPECT_EQ(refused_body("G0 X1 Y1 Z1 I5\n"), "gcode.unused_word nc/x.ngc:8");
    EXPECT_EQ(refused_body("G0 X0 Y0 Z0\nG2 X1 Y1 F100\n"), "gcode.arc nc/x.ngc:9");
    EXPECT_EQ(refused_body("G0 X0 Y0 Z0\nG2 X5 Y0 I1 F100\n"), "gcode.arc nc/x.ngc:9");
    EXPECT_EQ(refused_body("G0 X0 Y0 Z0\nG2 X5 Y0 R1 F100\n"), "gcode.arc nc/x.ngc:9");
    EXPECT_EQ(refused_body("G0 X300000\n"), "gcode.number nc/x.ngc:8");
    EXPECT_EQ(refusal("G21\nM6\nM2\n"), "gcode.tool nc/x.ngc:2");
    EXPECT_EQ(refusal(kHead + "G0 Z5\n").substr(0, 12), "gcode.no_end");
    EXPECT_EQ(refusal("").substr(0, 12), "gcode.no_end");
}

// The machine may have been left in any state: what decides where a motion goes must be stated before it.
TEST(GcodeReader, NothingIsTakenForGrantedOfWhatRanBefore) {
    const std::string motion = "G0 Z5\nX0 Y0\nG1 X1 F100\nG3 X2 Y1 I0 J1\nG0 Z5\nM5\nM2\n";
    EXPECT_EQ(refusal(kHead + motion), "accepted");
    for (const auto& [word, found] : {std::pair{"G21", "gcode.unset nc/x.ngc:3"},
                                      {"G17", "gcode.unset nc/x.ngc:8"},
                                      {"G90 ", "gcode.unset nc/x.ngc:8"},
                                      {"G94", "gcode.unset nc/x.ngc:8"},
                                      {"G40", "gcode.unset nc/x.ngc:8"},
                                      {"G54", "gcode.unset nc/x.ngc:8"},
                                      {"G8 ", "gcode.unset nc/x.ngc:8"},
                                      {"G97", "gcode.unset nc/x.ngc:8"},
                                      {"G91.1", "gcode.unset nc/x.ngc:11"},
                                      {"G64 P0.02 Q0", "gcode.unset nc/x.ngc:8"},
                                      {"G43 H3", "gcode.offset nc/x.ngc:8"},
                                      {"T3", "gcode.tool nc/x.ngc:4"},
                                      {"M6", "gcode.offset nc/x.ngc:5"},
                                      {" P0.02", "gcode.path_mode nc/x.ngc:3"},
                                      {" F100", "gcode.feed nc/x.ngc:10"},
                                      // These do not matter: G43 and G0 state anew what they would.
                                      {"G49", "accepted"},
                                      {"G80", "accepted"}}) {
        std::string text = kHead + motion;
        text.erase(text.find(word), std::string(word).size());
        EXPECT_EQ(refusal(text), found) << "without " << word;
    }
    // Speed and spindle are the simulation's matter: the steps say whether it turns.
    std::string silent = kHead + motion;
    silent.erase(silent.find("S18000 M3"), 9);
    EXPECT_FALSE(read_gcode(silent, "x").steps[2].spindle);
}

TEST(GcodeReader, NothingThatDecidesAMotionIsTakenBack) {
    const std::string cut = "G0 Z5\nX0 Y0\nG1 X1 F100\n", rest = "X2\n";
    const auto within = [&](const std::string& line) { return refused_body(cut + line + "\n" + rest); };
    EXPECT_EQ(within("G43"), "accepted") << "the length of the tool in the spindle";
    EXPECT_EQ(within("G49"), "gcode.offset nc/x.ngc:12");
    EXPECT_EQ(within("T3 M6"), "gcode.tool nc/x.ngc:11");
    EXPECT_EQ(within("T4"), "gcode.tool nc/x.ngc:11");
    EXPECT_EQ(within("G43 H0"), "gcode.offset nc/x.ngc:11");
    EXPECT_EQ(within("G43 H5"), "gcode.offset nc/x.ngc:11");
    EXPECT_EQ(within("G43.2 H3"), "gcode.unknown_word nc/x.ngc:11");
    EXPECT_EQ(within("G64 P0"), "gcode.path_mode nc/x.ngc:11");
    EXPECT_EQ(within("%"), "gcode.percent nc/x.ngc:11");
    EXPECT_EQ(within("M2"), "gcode.after_end nc/x.ngc:12");
    EXPECT_EQ(within("G0 F"), "gcode.number nc/x.ngc:11");
    for (const char* stop : {"M0", "M1", "M60"}) EXPECT_EQ(within(stop), "gcode.pause nc/x.ngc:11") << stop;
    for (const char* wet : {"M7", "M8"}) EXPECT_EQ(within(wet), "gcode.coolant nc/x.ngc:11") << wet;
    EXPECT_EQ(within("M9"), "accepted");
    EXPECT_EQ(within("G4 P-1"), "gcode.dwell nc/x.ngc:11");
    EXPECT_EQ(within("G4"), "gcode.dwell nc/x.ngc:11");
    EXPECT_EQ(within("G4 P1 X5"), "gcode.dwell nc/x.ngc:11");
    EXPECT_EQ(within("G4 G64 P1"), "gcode.dwell nc/x.ngc:11");
    for (const char* foreign : {"G7",
                                "G10 L2 P1 X0",
                                "G28",
                                "G30",
                                "G33 K1",
                                "G38.2 Z-5",
                                "G41 D3",
                                "G42 D3",
                                "G52 X1",
                                "G53 G0 Z0",
                                "G73 X1",
                                "G76",
                                "G81 X1 Z-5 R2",
                                "G89",
                                "G92 X0",
                                "G92.1",
                                "G93",
                                "G95",
                                "G96 D3000 S100",
                                "G98",
                                "M19",
                                "M49",
                                "M61 Q3",
                                "M62 P1",
                                "M66",
                                "M100",
                                "M199 P1",
                                "/G0 Z-5",
                                "O100 call",
                                "#1=5",
                                "A90",
                                "U1",
                                "E1",
                                "D3",
                                "L1",
                                "$1"})
        EXPECT_EQ(within(foreign), "gcode.unknown_word nc/x.ngc:11") << foreign;
    EXPECT_EQ(within("G20"), "gcode.left_in_force nc/x.ngc:14") << "inches to the end";
    EXPECT_EQ(within("G91"), "gcode.left_in_force nc/x.ngc:14");
    EXPECT_EQ(within("G20\nX0.1\nG21"), "accepted");
}

TEST(GcodeReader, LinesAsLinuxcncTakesThem) {
    EXPECT_EQ(refused_body("G0" + std::string(248, ' ') + "Z5\n"), "accepted") << "252 characters";
    EXPECT_EQ(refused_body("G0" + std::string(249, ' ') + "Z5\n"), "gcode.line_length nc/x.ngc:8");
    EXPECT_EQ(refused_body("(" + std::string(300, 'x') + ")\n"), "gcode.line_length nc/x.ngc:8");
    EXPECT_EQ(refused_body(std::string("G0 Z5\0 Z-5\n", 12)), "gcode.character nc/x.ngc:8");
    EXPECT_EQ(refused_body("(\xC3\xA4)\n"), "gcode.character nc/x.ngc:8");
    EXPECT_EQ(refused_body("G0 Z5\rX2\n"), "gcode.character nc/x.ngc:8");
    EXPECT_EQ(refused_body("G0 Z5\r\n"), "accepted");
    EXPECT_EQ(refused_body("G0 Z5 N7\n"), "gcode.unknown_word nc/x.ngc:8");
    EXPECT_EQ(refused_body("N7 N8 G0 Z5\n"), "gcode.unknown_word nc/x.ngc:8");
    EXPECT_EQ(refused_body("N-7 G0 Z5\n"), "gcode.number nc/x.ngc:8");
    for (const char* active : {"(MSG, put the clamp on)", "(msg,x)", "( DEBUG, #1)", "(PRINT,x)", "(LOG,x)",
                               "(LOGOPEN,/etc/passwd)", "(LOGAPPEND,x)", "(LOGCLOSE)", "(PROBEOPEN x.txt)",
                               "(PROBECLOSE)", "(AXIS,stop)", "(py,import os)", ";py,import os"})
        EXPECT_EQ(refused_body(std::string(active) + "\n"), "gcode.comment nc/x.ngc:8") << active;
    for (const char* plain : {"(tool 2: mill, long)", "(pattern a, b.stl)", "; x", "()", "(12, 13)"})
        EXPECT_EQ(refused_body(std::string(plain) + "\n"), "accepted") << plain;
    for (const char* twice :
         {"G17 G18", "G90 G91", "G20 G21", "M3 M5", "G64 P1 G61", "G54 G54", "G43 H3 G49"})
        EXPECT_EQ(refused_body(std::string(twice) + "\n"), "gcode.twice nc/x.ngc:8") << twice;
    EXPECT_EQ(refusal("(c)\n%\n" + kHead + "M2\n"), "gcode.percent nc/x.ngc:2");
    EXPECT_EQ(refusal("%\n%\n" + kHead + "M2\n"), "gcode.percent nc/x.ngc:2");
    EXPECT_EQ(refusal(kHead + "M2\n%\nG0 Z5\n"), "gcode.after_end nc/x.ngc:10");
    // F counts in the unit before the line's own; P and coordinates in the line's.
    const Program p = read("G0 Z1 X0 Y0\nG20 F10 G1 X1\nG21 X0\n");
    EXPECT_EQ(p.steps[1].feed, 10);
    EXPECT_EQ(p.steps[1].x, 25.4);
}

TEST(GcodeReader, TellsHowTheSpindleTurnsWhereItFeeds) {
    const Program p = read("G0 X0 Y0 Z5\nG1 X1 F100\nS9000\nX2\nM5\nG0 Z9\nM3\nG4 P0.5\nG4 P7\nG1 X3\n");
    EXPECT_EQ(p.fastest_spindle.value, 18000);
    EXPECT_EQ(p.fastest_spindle.line, 9u);
    EXPECT_EQ(p.slowest_spindle.value, 0) << "it stands while the cutter leaves the work";
    EXPECT_EQ(p.slowest_spindle.line, 13u);
    EXPECT_EQ(read("G0 X0 Y0 Z5\nG1 X1 F100\nS9000\nX2\nG0 Z9\n").slowest_spindle.value, 9000);
    EXPECT_EQ(p.shortest_spin_up.value, 0) << "none after the change of speed";
    EXPECT_EQ(p.shortest_spin_up.line, 11u);
    EXPECT_EQ(p.longest_dwell.value, 7);
    EXPECT_EQ(p.longest_dwell.line, 16u);
    EXPECT_EQ(p.dwell_s, 10.5);
    EXPECT_EQ(read("G0 X0 Y0 Z5\nG1 X1 F100\n").shortest_spin_up.value, 3);
    EXPECT_EQ(read("G0 X0 Y0 Z5\nM5\nG1 X1 F100\n").slowest_spindle.value, 0);
}
