#include "io/write/sheets_drawings.h"

#include <fmt/format.h>

#include "io/text/decimal.h"
#include "io/text/json_text.h"
#include "kernels/polygons/pieces.h"

namespace slabwright {

namespace {

void append_group(std::string& text, int code, const std::string& value) {
    text += std::to_string(code) + '\n' + value + '\n';
}

/// With a point, by which some readers tell real values.
std::string real_mm(std::int64_t units) {
    std::string text;
    append_mm(text, units);
    return text.find('.') == std::string::npos ? text + ".0" : text;
}

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

}  // namespace

namespace {

void append_words(std::string& text, std::initializer_list<std::pair<int, const char*>> words) {
    for (const auto& [code, value] : words) append_group(text, code, value);
}

void append_head(std::string& text, Point2 low, Point2 high) {
    append_words(text, {{0, "SECTION"}, {2, "HEADER"}, {9, "$ACADVER"}, {1, "AC1009"}});
    append_words(text, {{9, "$INSUNITS"}, {70, "4"}, {9, "$EXTMIN"}});
    append_group(text, 10, real_mm(low.x));
    append_group(text, 20, real_mm(low.y));
    append_group(text, 9, "$EXTMAX");
    append_group(text, 10, real_mm(high.x));
    append_group(text, 20, real_mm(high.y));
    append_words(text, {{0, "ENDSEC"}, {0, "SECTION"}, {2, "TABLES"}, {0, "TABLE"}, {2, "LAYER"}, {70, "4"}});
    int colour = 1;
    for (const char* layer : {"CUT", "HOLE", "LABEL", "TAB"}) {
        append_words(text, {{0, "LAYER"}, {2, layer}, {70, "0"}});
        append_group(text, 62, std::to_string(colour++));
        append_group(text, 6, "CONTINUOUS");
    }
    append_words(text, {{0, "ENDTAB"}, {0, "ENDSEC"}, {0, "SECTION"}, {2, "ENTITIES"}});
}

void append_loop(std::string& text, const char* layer, std::span<const Point2> points) {
    append_words(text,
                 {{0, "POLYLINE"}, {8, layer}, {66, "1"}, {10, "0.0"}, {20, "0.0"}, {30, "0.0"}, {70, "1"}});
    for (const Point2 p : points) {
        append_words(text, {{0, "VERTEX"}, {8, layer}});
        append_group(text, 10, real_mm(p.x));
        append_group(text, 20, real_mm(p.y));
        append_group(text, 30, "0.0");
    }
    append_words(text, {{0, "SEQEND"}, {8, layer}});
}

void append_label(std::string& text, Point2 at, const std::string& words) {
    append_words(text, {{0, "TEXT"}, {8, "LABEL"}});
    append_group(text, 10, real_mm(at.x));
    append_group(text, 20, real_mm(at.y));
    append_group(text, 30, "0.0");
    append_group(text, 40, "8.0");
    append_group(text, 1, words);
}

}  // namespace

std::string sheet_dxf(const SheetsPlan& plan, std::size_t index) {
    const SheetProgram& program = plan.programs[index];
    std::string text;
    append_head(text, {0, 0}, {to_units(program.stock.length), to_units(program.stock.width)});
    for (const SheetWay& way : program.ways) append_loop(text, way.is_hole ? "HOLE" : "CUT", loop_of(way));
    for (const int number : program.pieces) {
        const SheetPiece& piece = plan.pieces[static_cast<std::size_t>(number) - 1];
        append_label(text, piece.label, std::to_string(number));
        const Loops tabs = placed(piece.hold.added, piece.place);
        for (std::size_t l = 0; l < tabs.size(); ++l) append_loop(text, "TAB", tabs.loop(l));
    }
    append_words(text, {{0, "ENDSEC"}, {0, "EOF"}});
    return text;
}

std::string loops_dxf(const Loops& loops, const std::string& label) {
    std::string text;
    Box2 box;
    for (const Point2 p : loops.points) box.grow(p);
    if (loops.points.empty()) box.min = box.max = {0, 0};
    append_head(text, box.min, box.max);
    for (std::size_t l = 0; l < loops.size(); ++l)
        append_loop(text, signed_area(loops.loop(l)) < 0 ? "HOLE" : "CUT", loops.loop(l));
    append_label(text, {box.min.x + to_units(5), box.min.y + to_units(5)}, label);
    append_words(text, {{0, "ENDSEC"}, {0, "EOF"}});
    return text;
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
    text += "</g>\n<g font-family=\"sans-serif\" font-size=\"8\">\n";
    for (const int number : program.pieces) {
        const SheetPiece& piece = plan.pieces[static_cast<std::size_t>(number) - 1];
        text += fmt::format("<text x=\"{}\" y=\"{}\">{}</text>\n", mm(piece.label.x),
                            mm(-std::int64_t{piece.label.y}), number);
    }
    return text + "</g>\n</svg>\n";
}

}  // namespace slabwright
