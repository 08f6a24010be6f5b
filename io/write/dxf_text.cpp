#include "io/write/dxf_text.h"

#include "io/text/decimal.h"

namespace slabwright {

namespace {

/// With a point, by which some readers tell real values.
std::string real_mm(std::int64_t units) {
    std::string text;
    append_mm(text, units);
    return text.find('.') == std::string::npos ? text + ".0" : text;
}

}  // namespace

void DxfText::group(int code, std::string_view value) {
    text_ += std::to_string(code);
    text_ += '\n';
    text_ += value;
    text_ += '\n';
}

void DxfText::words(std::initializer_list<std::pair<int, std::string_view>> groups) {
    for (const auto& [code, value] : groups) group(code, value);
}

DxfText::DxfText(Point2 low, Point2 high, std::span<const std::string_view> layers) {
    words({{0, "SECTION"}, {2, "HEADER"}, {9, "$ACADVER"}, {1, "AC1009"}});
    words({{9, "$INSUNITS"}, {70, "4"}, {9, "$EXTMIN"}});
    group(10, real_mm(low.x));
    group(20, real_mm(low.y));
    group(9, "$EXTMAX");
    group(10, real_mm(high.x));
    group(20, real_mm(high.y));
    words({{0, "ENDSEC"}, {0, "SECTION"}, {2, "TABLES"}, {0, "TABLE"}, {2, "LAYER"}});
    group(70, std::to_string(layers.size()));
    int colour = 1;
    for (const std::string_view layer : layers) {
        words({{0, "LAYER"}, {2, layer}, {70, "0"}});
        group(62, std::to_string(colour++));
        group(6, "CONTINUOUS");
    }
    words({{0, "ENDTAB"}, {0, "ENDSEC"}, {0, "SECTION"}, {2, "ENTITIES"}});
}

void DxfText::loop(std::string_view layer, std::span<const Point2> points) { polyline(layer, points, true); }

void DxfText::open_line(std::string_view layer, std::span<const Point2> points) {
    polyline(layer, points, false);
}

void DxfText::polyline(std::string_view layer, std::span<const Point2> points, bool is_closed) {
    words({{0, "POLYLINE"}, {8, layer}, {66, "1"}, {10, "0.0"}, {20, "0.0"}, {30, "0.0"}});
    group(70, is_closed ? "1" : "0");
    for (const Point2 p : points) {
        words({{0, "VERTEX"}, {8, layer}});
        group(10, real_mm(p.x));
        group(20, real_mm(p.y));
        group(30, "0.0");
    }
    words({{0, "SEQEND"}, {8, layer}});
}

void DxfText::circle(std::string_view layer, Point2 middle, double diameter_mm) {
    words({{0, "CIRCLE"}, {8, layer}});
    group(10, real_mm(middle.x));
    group(20, real_mm(middle.y));
    group(30, "0.0");
    group(40, real_mm(to_units(diameter_mm / 2)));
}

void DxfText::label(Point2 at, const std::string& words_there, double height_mm) {
    words({{0, "TEXT"}, {8, "LABEL"}});
    group(10, real_mm(at.x));
    group(20, real_mm(at.y));
    group(30, "0.0");
    group(40, real_mm(to_units(height_mm)));
    group(1, words_there);
}

std::string DxfText::take() {
    words({{0, "ENDSEC"}, {0, "EOF"}});
    return std::move(text_);
}

}  // namespace slabwright
