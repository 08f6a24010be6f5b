// Programs of stock sheets as they are read back: two short ones by hand, and what the reader refuses in
// them.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "io/posts/sheet_reader.h"
#include "kernels/errors.h"

namespace slabwright {
namespace {

const std::string kRouter =
    "(stock 300 x 200 thickness 6 kerf 6 router)\n"
    "(piece 1 from 0 to 6 turn 90 at 10 20)\n"
    "(dowel of piece 1 at 30 40 diameter 8)\n"
    "(engraver tool 2 width 1 depth 0.5)\n"
    "G21 G17 G90 G94 G40 G49 G80\n"
    "G64 P0.005\n"
    "G54\n"
    "T2 M6\n"
    "G43 H2\n"
    "M3 S18000\n"
    "G4 P3\n"
    "(engraving of piece 1 12)\n"
    "G0 Z5\n"
    "G0 X20 Y20\n"
    "G1 Z-0.5 F800\n"
    "X25\n"
    "G0 Z5\n"
    "M5\n"
    "T1 M6\n"
    "G43 H1\n"
    "M3 S12000\n"
    "G4 P3\n"
    "(cut of piece 1 loop 0 pass 0 outline)\n"
    "G0 Z5\n"
    "G0 X10 Y10\n"
    "G1 Z-3 F800\n"
    "X50 F3000\n"
    "X10\n"
    "Z-6\n"
    "X50\n"
    "X10\n"
    "G0 Z5\n"
    "M2\n";

const std::string kJet =
    "(stock 300 x 200 thickness 6 kerf 0.8 jet)\n"
    "(piece 1 from 0 to 6 turn 0 at 0 0)\n"
    "(head on M62 P0 off M63 P0)\n"
    "(engraver feed 4000 width 1 depth 0.5)\n"
    "(taper 1)\n"
    "G21 G17 G90 G94 G40 G49 G80\n"
    "G64 P0.005\n"
    "G54\n"
    "(engraving of piece 1 1)\n"
    "G0 Z5\n"
    "G0 X20 Y20\n"
    "G0 Z0\n"
    "M62 P0\n"
    "G1 X25 F4000\n"
    "M63 P0\n"
    "(cut of piece 1 loop 0 pass 0 outline)\n"
    "G0 Z5\n"
    "G0 X10 Y10\n"
    "G0 Z0\n"
    "M62 P0\n"
    "G4 P0\n"
    "G1 X50 A10 C90 F1000\n"
    "M63 P0\n"
    "M2\n";

/// The code of what is refused in a program after one change; "" where nothing is.
std::string refused(std::string text, const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    if (at != std::string::npos) text.replace(at, from.size(), to);
    try {
        (void)read_sheet_program(text, "sheet_1.ngc");
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::verification);
        EXPECT_EQ(error.place().rfind("sheet_1.ngc:", 0), 0U) << error.place();
        return error.code();
    }
    return "";
}

TEST(SheetReader, ReadsWhatProgramsSay) {
    const ReadSheetProgram router = read_sheet_program(kRouter, "a"), jet = read_sheet_program(kJet, "b");
    EXPECT_TRUE(router.is_routed);
    EXPECT_EQ(router.length, 300);
    EXPECT_EQ(router.width, 200);
    EXPECT_EQ(router.kerf, 6);
    ASSERT_EQ(router.pieces.size(), 1U);
    EXPECT_EQ(router.pieces[0].turn, 90);
    EXPECT_EQ(router.pieces[0].holes.size(), 1U);
    ASSERT_EQ(router.ways.size(), 1U);
    EXPECT_EQ(router.ways[0].deepest, 6);
    EXPECT_EQ(router.ways[0].points.size(), 3U) << "of its last depth alone";
    ASSERT_EQ(router.engravings.size(), 1U);
    EXPECT_EQ(router.engravings[0].deepest, 0.5);
    EXPECT_FALSE(jet.is_routed);
    ASSERT_EQ(jet.ways.size(), 1U);
    ASSERT_EQ(jet.ways[0].points.size(), 2U);
    EXPECT_EQ(jet.ways[0].points[1].a, 10);
    ASSERT_EQ(jet.engravings.size(), 1U);
    EXPECT_EQ(jet.engravings[0].deepest, 0.5) << "as deep as the engraver";
}

TEST(SheetReader, RefusesWhatRoutersCannotMean) {
    struct Change {
        std::string from, to, code;
    };
    for (const Change& c : std::vector<Change>{
             {"kerf 6 router)", "kerf 6 router", "gcode.comment"},
             {"G21", "(stock 300 x 200 thickness 6 kerf 6 router)\nG21", "gcode.twice"},
             {"thickness 6", "thickness 0", "gcode.number"},
             {"turn 90", "turn 45", "gcode.number"},
             {"piece 1 from", "piece 1.5 from", "gcode.number"},
             {"diameter 8", "diameter 0", "gcode.comment"},
             {"dowel of piece 1", "dowel of piece 2", "gcode.comment"},
             {"G21", "(engraver tool 2 width 1 depth 0.5)\nG21", "gcode.twice"},
             {"engraver tool", "engraver power", "gcode.engraver"},
             {"width 1 depth", "width 0 depth", "gcode.number"},
             {"(engraver", "(engraved", "gcode.engraver"},
             {"G21", "(taper 1)\nG21", "gcode.taper"},
             {"G21", "(pivot 100)\nG21", "gcode.pivot"},
             {"G21", "(head on M3 off M5)\nG21", "gcode.switch"},
             {"outline)", "border)", "gcode.comment"},
             {"(stock", "G21\n(stock", "gcode.no_stock"},
             {"(cut of", "(cat of", "gcode.tool"},
             {"T2 M6", "M6", "gcode.tool"},
             {"H2", "H1", "gcode.tool_length"},
             {"G43 H2\n", "", "gcode.tool_length"},
             {"M3 S12000\n", "", "gcode.spindle"},
             {"F800", "F0", "gcode.feed"},
             {" F800", "", "gcode.feed"},
             {"Z-6", "X30 Z-6", "gcode.plunge"},
             {"G0 Z5\nM2", "G0 X0 Z5\nM2", "gcode.rapid"},
             {"G0 Z5\nM2", "T2 M6\nM2", "gcode.tool"},
             {"G0 Z5\nM2", "M2", "gcode.left_on"},
             {"G0 Z5\nM2", "M5\nG0 Z5\nM2", "gcode.spindle"},
             {"G0 Z5\nG0 X20 Y20", "G0 X20 Y20 Z5", "gcode.start"},
             {"G0 Z5\nG0 X20 Y20\n", "G0 Z5\n", "gcode.start"},
             {"G0 Z5\nG0 X20 Y20\n", "G0 X20 Y20\n", "gcode.start"},
             {"G0 Z5\nG0 X10 Y10\n", "G0 X10 Y10\n", "gcode.start"},
             {"G0 Z5\nG0 X10 Y10\n", "", "gcode.start"},
             {"X50", "X50 A1", "gcode.head"},
             {"X50", "X50 B1", "gcode.unknown_word"},
             {"M5", "M4", "gcode.unknown_word"},
             {"T1 M6\nG43 H1", "G43 H2", "gcode.tool"},

             {"X50 F3000", "G49\nX50 F3000", "gcode.tool_length"},
             {"M3 S12000", "M3 S0", "gcode.spindle"},
             {" S18000", "", "gcode.spindle"},
             {"G17 ", "", "gcode.unset"},
             {"G21 ", "", "gcode.unset"},
             {"G90 ", "", "gcode.unset"},
             {"G94 ", "", "gcode.unset"},
             {"G40 ", "", "gcode.unset"},
             {"G64 P0.005\n", "", "gcode.unset"},
             {"G54\n", "", "gcode.unset"},
             {"G0 Z5", "Z5", "gcode.unset"},
             {"X50 F3000", "G80\nX50 F3000", "gcode.unset"},
             {"M5\n", "", "gcode.spindle"},
             {"G4 P3\n", "", "gcode.spin_up"},
             {"G4 P3\n", "G4 P0.003\n", "gcode.spin_up"},
             {"G1 Z-0.5 F800\n", "G1 F800\n", "gcode.air"},
             {"X50 F3000\nX10\n", "X50 F3000\nX51\nX10\n", "gcode.depths"},
             {"X50 F3000\nX10\n", "X51 F3000\nX10\n", "gcode.depths"},
             {"Z-6\nX50\nX10\n", "Z-6\nX50\nX50 Y11\nX10 Y10\n", "gcode.depths"},
             {"G64 P0.005", "G64", "gcode.path_mode"},
             {"G64 P0.005", "G64 P0.5", "gcode.path_mode"},
             {"X50 F3000", "G64 P1\nX50 F3000", "gcode.path_mode"},
             {"M3 S18000", "M3 S18000\nG4", "gcode.dwell"},
             {"X50", "X50 P1", "gcode.unused_word"},
             {"X50", "X50 H1", "gcode.unused_word"},
             {"X50", "X50 X60", "gcode.twice"},
             {"X50", "G0 G1 X50", "gcode.twice"},
             {"T2 M6", "T2 M6 M3", "gcode.twice"},
             {"X50", "(a) X50 (b)", "gcode.comment"},
             {"X50", "(LOGOPEN,a.txt)\nX50", "gcode.comment"},
             {"X50", "(PROBEOPEN a.txt)\nX50", "gcode.comment"},
             {"X50 F", "(" + std::string(300, 'a') + ")\nX50 F", "gcode.line_length"},
             {"X50", std::string("X50\0 Z-9", 8), "gcode.character"},
             {"M2\n", "M2\nX0\n", "gcode.after_end"},
             {"M2\n", "", "gcode.no_end"},
         })
        EXPECT_EQ(refused(kRouter, c.from, c.to), c.code) << c.from << " -> " << c.to;
    EXPECT_EQ(refused(kRouter, "\n", "\r\n"), "");
}

TEST(SheetReader, RefusesWhatJetsCannotMean) {
    struct Change {
        std::string from, to, code;
    };
    for (const Change& c : std::vector<Change>{
             {"(taper 1)", "(taper 11)", "gcode.taper"},
             {"G54\n", "G54\n(taper 1)\n", "gcode.taper"},
             {"(taper 1)", "(pivot -1)", "gcode.pivot"},
             {"off M63 P0)", "off M62 P0)", "gcode.switch"},
             {"on M62 P0 off", "on M62 P0 of", "gcode.switch"},
             {"feed 4000", "tool 2", "gcode.engraver"},
             {"F4000", "F3000", "gcode.feed"},
             {"X25 ", "X25 A5 ", "gcode.head"},
             {"A10", "A85", "gcode.head"},
             {"A10", "A-1", "gcode.head"},
             {"A10", "Z1", "gcode.height"},
             {"G1 X50", "G0 X50", "gcode.rapid"},
             {"G54\n", "G54\nT1 M6\n", "gcode.unknown_word"},
             {"M63 P0\nM2", "M62 P0\nM2", "gcode.switch"},
             {"M63 P0\nM2", "M2", "gcode.left_on"},
             {"F1000", "F1000 G93\nX10", "gcode.feed"},
             {"(cut of", "(cat of", "gcode.head"},
             {"G49 ", "", "gcode.unset"},
             {"G0 X20 Y20\n", "", "gcode.start"},
             {"G0 Z5\nG0 X20 Y20\nG0 Z0\n", "", "gcode.start"},
             {"G0 Z0\n", "", "gcode.height"},
             {"G0 Z5\nG0 X10", "G0 X10", "gcode.rapid"},
             {"G4 P0\n", "", "gcode.dwell"},
             {"G1 X50", "S0\nG1 X50", "gcode.power"},
             {"M63 P0\nM2", "M63 P1\nM2", "gcode.unknown_word"},
         })
        EXPECT_EQ(refused(kJet, c.from, c.to), c.code) << c.from << " -> " << c.to;
    const std::string laser = "(engraver power 20 width 1 depth 0.5)";
    const auto with_power = [&](const char* engraves, const char* cuts) {
        std::string text = kJet;
        text.replace(text.find("(engraver"), text.find(")\n(taper") - text.find("(engraver") + 1, laser);
        text.replace(text.find("G1 X25"), 2, std::string(engraves) + "\nG1");
        return refused(text, "G1 X50", std::string(cuts) + "\nG1 X50");
    };
    EXPECT_EQ(with_power("S20", "S100"), "");
    EXPECT_EQ(with_power("S30", "S100"), "gcode.power") << "engraved at another power";
    EXPECT_EQ(with_power("S20", "S20"), "gcode.power") << "cut at the engraver's";
}

}  // namespace
}  // namespace slabwright
