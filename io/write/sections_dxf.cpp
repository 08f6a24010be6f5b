#include "io/write/sections_dxf.h"

#include <algorithm>
#include <limits>
#include <set>

#include "io/text/decimal.h"

namespace slabwright {

namespace {

/// A group of the file: its code on one line, its value on the next.
void append_group(std::string& text, int code, const std::string& value) {
    text += std::to_string(code);
    text += '\n';
    text += value;
    text += '\n';
}

/// Real values are written with a point, as some readers tell them from integers by it.
std::string real(const std::string& text) { return text.find('.') == std::string::npos ? text + ".0" : text; }

std::string real_mm(std::int64_t units) {
    std::string text;
    append_mm(text, units);
    return real(text);
}

std::string layer_name(const Section& section, bool open) {
    std::string name = "Z_" + height_text(section.plane.z);
    std::replace(name.begin(), name.end(), '.', '_');
    if (section.plane.side == Side::below) name += "_BELOW";
    if (open) name += "_OPEN";
    return name;
}

void append_polyline(std::string& text, const std::string& layer, const std::string& height,
                     std::span<const Point2> points, bool closed) {
    append_group(text, 0, "POLYLINE");
    append_group(text, 8, layer);
    append_group(text, 66, "1");
    append_group(text, 10, "0.0");
    append_group(text, 20, "0.0");
    append_group(text, 30, height);
    append_group(text, 70, closed ? "1" : "0");
    for (const Point2 p : points) {
        append_group(text, 0, "VERTEX");
        append_group(text, 8, layer);
        append_group(text, 10, real_mm(p.x));
        append_group(text, 20, real_mm(p.y));
        append_group(text, 30, height);
    }
    append_group(text, 0, "SEQEND");
    append_group(text, 8, layer);
}

}  // namespace

std::string sections_dxf(std::span<const Section> sections) {
    std::vector<std::string> layers;  // in the order of the sections
    std::set<std::string> known;
    std::int32_t x0 = std::numeric_limits<std::int32_t>::max(), y0 = x0,
                 x1 = std::numeric_limits<std::int32_t>::min(), y1 = x1;
    for (const Section& section : sections) {
        if (auto name = layer_name(section, false); known.insert(name).second) layers.push_back(name);
        if (!section.open_chains.empty())
            if (auto name = layer_name(section, true); known.insert(name).second) layers.push_back(name);
        for (const Loops* loops : {&section.loops, &section.open_chains}) {
            for (const Point2 p : loops->points) {
                x0 = std::min(x0, p.x), x1 = std::max(x1, p.x);
                y0 = std::min(y0, p.y), y1 = std::max(y1, p.y);
            }
        }
    }
    if (x0 > x1) x0 = y0 = x1 = y1 = 0;

    std::string text;
    append_group(text, 0, "SECTION");
    append_group(text, 2, "HEADER");
    append_group(text, 9, "$ACADVER");
    append_group(text, 1, "AC1009");
    append_group(text, 9, "$INSUNITS");
    append_group(text, 70, "4");
    append_group(text, 9, "$EXTMIN");
    append_group(text, 10, real_mm(x0));
    append_group(text, 20, real_mm(y0));
    append_group(text, 9, "$EXTMAX");
    append_group(text, 10, real_mm(x1));
    append_group(text, 20, real_mm(y1));
    append_group(text, 0, "ENDSEC");
    append_group(text, 0, "SECTION");
    append_group(text, 2, "TABLES");
    append_group(text, 0, "TABLE");
    append_group(text, 2, "LAYER");
    append_group(text, 70, std::to_string(layers.size()));
    for (const std::string& layer : layers) {
        append_group(text, 0, "LAYER");
        append_group(text, 2, layer);
        append_group(text, 70, "0");
        append_group(text, 62, layer.ends_with("_OPEN") ? "1" : "7");
        append_group(text, 6, "CONTINUOUS");
    }
    append_group(text, 0, "ENDTAB");
    append_group(text, 0, "ENDSEC");
    append_group(text, 0, "SECTION");
    append_group(text, 2, "ENTITIES");
    for (const Section& section : sections) {
        std::string height;
        append_decimal(height, section.plane.z);
        height = real(height);
        for (std::size_t i = 0; i < section.loops.size(); ++i)
            append_polyline(text, layer_name(section, false), height, section.loops.loop(i), true);
        for (std::size_t i = 0; i < section.open_chains.size(); ++i)
            append_polyline(text, layer_name(section, true), height, section.open_chains.loop(i), false);
    }
    append_group(text, 0, "ENDSEC");
    append_group(text, 0, "EOF");
    return text;
}

}  // namespace slabwright
