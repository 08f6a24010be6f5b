#include "io/write/sheets_drawings.h"

#include <array>
#include <string_view>

#include <fmt/format.h>

#include "io/text/decimal.h"
#include "io/text/json_text.h"
#include "io/write/dxf_text.h"
#include "kernels/polygons/pieces.h"

namespace slabwright {

namespace {

constexpr std::array<std::string_view, 4> kLayers{"CUT", "HOLE", "LABEL", "TAB"};

std::string mm(std::int64_t units) {
    std::string text;
    append_mm(text, units);
    return text;
}

/// The axis' places at the sheet's top, the last not repeated.
std::vector<Point2> loop_of(const SheetWay& way) {
    std::vector<Point2> points;
    for (std::size_t i = 0; i + 1 < way.points.size(); ++i)
        if (points.empty() || points.back() != way.points[i].top) points.push_back(way.points[i].top);
    return points;
}

/// Strokes of what is engraved into a piece, on the stock.
std::vector<std::vector<Point2>> engraved(const SheetPiece& piece) {
    std::vector<std::vector<Point2>> strokes;
    for (const Engraving& engraving : piece.engravings)
        for (std::vector<Point2> stroke : engraving.strokes) {
            for (Point2& p : stroke) p = placed(p, piece.place);
            strokes.push_back(std::move(stroke));
        }
    return strokes;
}

}  // namespace

std::string sheet_dxf(const SheetsPlan& plan, std::size_t index) {
    const SheetProgram& program = plan.programs[index];
    DxfText text({0, 0}, {to_units(program.stock.length), to_units(program.stock.width)}, kLayers);
    for (const SheetWay& way : program.ways) text.loop(way.is_hole ? "HOLE" : "CUT", loop_of(way));
    for (const int number : program.pieces) {
        const SheetPiece& piece = plan.pieces[static_cast<std::size_t>(number) - 1];
        if (piece.engravings.empty()) text.label(piece.label, std::to_string(number));
        for (const std::vector<Point2>& stroke : engraved(piece)) text.open_line("LABEL", stroke);
        const Loops tabs = placed(piece.hold.added, piece.place);
        for (std::size_t l = 0; l < tabs.size(); ++l) text.loop("TAB", tabs.loop(l));
    }
    return text.take();
}

std::string loops_dxf(const Loops& loops, const std::string& label) {
    Box2 box;
    for (const Point2 p : loops.points) box.grow(p);
    if (loops.points.empty()) box.min = box.max = {0, 0};
    DxfText text(box.min, box.max, kLayers);
    for (std::size_t l = 0; l < loops.size(); ++l)
        text.loop(signed_area(loops.loop(l)) < 0 ? "HOLE" : "CUT", loops.loop(l));
    text.label({box.min.x + to_units(5), box.min.y + to_units(5)}, label);
    return text.take();
}

std::string sheet_svg(const SheetsPlan& plan, std::size_t index) {
    const SheetProgram& program = plan.programs[index];
    const std::string length = mm(to_units(program.stock.length)), width = mm(to_units(program.stock.width));
    std::string text = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}mm\" height=\"{1}mm\" viewBox=\"0 -{1} {0} "
        "{1}\">\n"
        "<rect x=\"0\" y=\"-{1}\" width=\"{0}\" height=\"{1}\" fill=\"#f4ead8\" stroke=\"#000\"/>\n"
        "<g fill=\"none\" stroke-width=\"0.4\">\n",
        length, width);
    for (const SheetWay& way : program.ways) {
        text += fmt::format("<path class=\"{}\" stroke=\"{}\" d=\"M{} {}", way.is_hole ? "hole" : "cut",
                            way.is_hole ? "#06c" : "#c00", mm(way.pierce.x), mm(-std::int64_t{way.pierce.y}));
        for (const HeadPoint& p : way.points)
            text += fmt::format("L{} {}", mm(p.top.x), mm(-std::int64_t{p.top.y}));
        text += "\"/>\n";
    }
    for (const int number : program.pieces)
        for (const std::vector<Point2>& stroke :
             engraved(plan.pieces[static_cast<std::size_t>(number) - 1])) {
            text += "<path class=\"engraved\" stroke=\"#060\" d=\"";
            for (std::size_t i = 0; i < stroke.size(); ++i)
                text += fmt::format("{}{} {}", i == 0 ? 'M' : 'L', mm(stroke[i].x),
                                    mm(-std::int64_t{stroke[i].y}));
            text += "\"/>\n";
        }
    text += "</g>\n<g font-family=\"sans-serif\" font-size=\"8\">\n";
    for (const int number : program.pieces) {
        const SheetPiece& piece = plan.pieces[static_cast<std::size_t>(number) - 1];
        if (!piece.engravings.empty()) continue;
        text += fmt::format("<text x=\"{}\" y=\"{}\">{}</text>\n", mm(piece.label.x),
                            mm(-std::int64_t{piece.label.y}), number);
    }
    return text + "</g>\n</svg>\n";
}

}  // namespace slabwright
