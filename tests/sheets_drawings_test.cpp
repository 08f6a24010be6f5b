// Drawings of stock sheets, word for word: ways and holes, numbers, what is engraved.
#include "io/write/sheets_drawings.h"

#include <gtest/gtest.h>

#include <cctype>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "io/write/dxf_text.h"

using namespace slabwright;

namespace {

Point2 at(double x, double y) { return {to_units(x), to_units(y)}; }

/// A stock sheet with two pieces: one with a hole and its number written, one with two engraved strokes.
SheetsPlan two_pieces() {
    SheetsPlan plan;
    plan.pieces.resize(2);
    plan.pieces[0].number = 1;
    plan.pieces[0].label = at(20, 25);
    plan.pieces[1].number = 2;
    plan.pieces[1].label = at(70, 25);
    plan.pieces[1].place.shift = at(60, 10);
    Engraving engraving;
    engraving.text = "2";
    engraving.strokes = {{at(1, 2), at(3, 2), at(3, 5)}, {at(4, 4), at(5, 4.5)}};
    plan.pieces[1].engravings = {engraving};
    SheetProgram program;
    program.stock = {100, 50};
    program.pieces = {1, 2};
    const auto way = [](bool is_hole, Point2 pierce, std::vector<Point2> points) {
        SheetWay w;
        w.is_hole = is_hole;
        w.pierce = pierce;
        for (const Point2 p : points) w.points.push_back({p});
        return w;
    };
    program.ways = {way(true, at(15, 15), {at(14, 14), at(16, 14), at(16, 16.5), at(14, 14)}),
                    way(false, at(8, 9), {at(10, 10), at(40, 10), at(40, 40), at(10, 10)})};
    plan.programs = {program};
    return plan;
}

/// The lines of a DXF text by layer: how many points each has.
std::vector<std::pair<std::string, int>> lines_of(const std::string& dxf) {
    std::vector<std::string> words;
    std::size_t from = 0;
    for (std::size_t end; (end = dxf.find('\n', from)) != std::string::npos; from = end + 1) {
        std::string word = dxf.substr(from, end - from);
        while (!word.empty() && std::isspace(static_cast<unsigned char>(word.back())) != 0) word.pop_back();
        word.erase(0, word.find_first_not_of(' '));
        words.push_back(word);
    }
    std::vector<std::pair<std::string, int>> lines;
    std::string kind;
    for (std::size_t i = 0; i + 1 < words.size(); i += 2) {
        if (words[i] == "0") {
            kind = words[i + 1];
            if (kind == "POLYLINE") lines.emplace_back("", 0);
            if (kind == "VERTEX") ++lines.back().second;
        }
        if (words[i] == "8" && kind == "POLYLINE") lines.back().first = words[i + 1];
    }
    return lines;
}

}  // namespace

TEST(SheetsDrawings, SvgHasEveryWayNumberAndStroke) {
    EXPECT_EQ(sheet_svg(two_pieces(), 0),
              "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"100mm\" height=\"50mm\" viewBox=\"0 -50 100 "
              "50\">\n"
              "<rect x=\"0\" y=\"-50\" width=\"100\" height=\"50\" fill=\"#f4ead8\" stroke=\"#000\"/>\n"
              "<g fill=\"none\" stroke-width=\"0.4\">\n"
              "<path class=\"hole\" stroke=\"#06c\" d=\"M15 -15L14 -14L16 -14L16 -16.5L14 -14\"/>\n"
              "<path class=\"cut\" stroke=\"#c00\" d=\"M8 -9L10 -10L40 -10L40 -40L10 -10\"/>\n"
              "<path class=\"engraved\" stroke=\"#060\" d=\"M61 -12L63 -12L63 -15\"/>\n"
              "<path class=\"engraved\" stroke=\"#060\" d=\"M64 -14L65 -14.5\"/>\n"
              "</g>\n<g font-family=\"sans-serif\" font-size=\"8\">\n"
              "<text x=\"20\" y=\"-25\">1</text>\n"
              "</g>\n</svg>\n");
}

TEST(SheetsDrawings, DxfHasEachInItsLayer) {
    using Lines = std::vector<std::pair<std::string, int>>;
    const std::string dxf = sheet_dxf(two_pieces(), 0);
    EXPECT_EQ(lines_of(dxf), (Lines{{"HOLE", 3}, {"CUT", 3}, {"LABEL", 3}, {"LABEL", 2}})) << dxf;
    Loops ring;
    ring.points = {at(0, 0), at(30, 0), at(30, 30), at(0, 30)};
    ring.close_loop();
    for (const Point2 p : {at(10, 10), at(10, 20), at(20, 20)}) ring.points.push_back(p);
    ring.close_loop();
    EXPECT_EQ(lines_of(loops_dxf(ring, "a label")), (Lines{{"CUT", 4}, {"HOLE", 3}}));
    EXPECT_NE(loops_dxf(ring, "a label").find("a label"), std::string::npos);
    EXPECT_NE(loops_dxf({}, "nothing").find("nothing"), std::string::npos);
}

TEST(SheetsDrawings, DxfIsWrittenWordForWord) {
    const std::string_view layers[] = {"CUT", "DOWELS"};
    DxfText text(at(0, -3), at(60, 40.5), layers);
    const Point2 line[] = {at(1, 2), at(-3, 4.5)};
    text.open_line("CUT", line);
    text.circle("DOWELS", at(12, -0.25), 8.5);
    text.label(at(7, 9), "a part", 5);
    EXPECT_EQ(text.take(),
              "0\nSECTION\n2\nHEADER\n9\n$ACADVER\n1\nAC1009\n9\n$INSUNITS\n70\n4\n"
              "9\n$EXTMIN\n10\n0.0\n20\n-3.0\n9\n$EXTMAX\n10\n60.0\n20\n40.5\n0\nENDSEC\n"
              "0\nSECTION\n2\nTABLES\n0\nTABLE\n2\nLAYER\n70\n2\n"
              "0\nLAYER\n2\nCUT\n70\n0\n62\n1\n6\nCONTINUOUS\n"
              "0\nLAYER\n2\nDOWELS\n70\n0\n62\n2\n6\nCONTINUOUS\n0\nENDTAB\n0\nENDSEC\n"
              "0\nSECTION\n2\nENTITIES\n"
              "0\nPOLYLINE\n8\nCUT\n66\n1\n10\n0.0\n20\n0.0\n30\n0.0\n70\n0\n"
              "0\nVERTEX\n8\nCUT\n10\n1.0\n20\n2.0\n30\n0.0\n"
              "0\nVERTEX\n8\nCUT\n10\n-3.0\n20\n4.5\n30\n0.0\n0\nSEQEND\n8\nCUT\n"
              "0\nCIRCLE\n8\nDOWELS\n10\n12.0\n20\n-0.25\n30\n0.0\n40\n4.25\n"
              "0\nTEXT\n8\nLABEL\n10\n7.0\n20\n9.0\n30\n0.0\n40\n5.0\n1\na part\n"
              "0\nENDSEC\n0\nEOF\n");
}
