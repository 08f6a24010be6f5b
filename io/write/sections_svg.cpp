#include "io/write/sections_svg.h"

#include <algorithm>
#include <limits>
#include <map>

#include "io/text/decimal.h"

namespace slabwright {

namespace {

/// "M x y L x y …", y turned over: in SVG it grows downwards.
void append_path(std::string& text, std::span<const Point2> points, bool closed) {
    char command = 'M';
    for (const Point2 p : points) {
        text += command;
        append_mm(text, p.x);
        text += ' ';
        append_mm(text, -static_cast<std::int64_t>(p.y));
        command = 'L';
    }
    if (closed) text += 'Z';
}

}  // namespace

std::string sections_svg(std::span<const Section> sections) {
    std::int64_t x0 = std::numeric_limits<std::int64_t>::max(), y0 = x0, x1 = -x0, y1 = -x0;
    for (const Section& section : sections) {
        for (const Loops* loops : {&section.loops, &section.open_chains}) {
            for (const Point2 p : loops->points) {
                x0 = std::min<std::int64_t>(x0, p.x), x1 = std::max<std::int64_t>(x1, p.x);
                y0 = std::min<std::int64_t>(y0, p.y), y1 = std::max<std::int64_t>(y1, p.y);
            }
        }
    }
    if (x0 > x1) x0 = y0 = x1 = y1 = 0;                          // nothing was met
    const auto margin = static_cast<std::int64_t>(kUnitsPerMm);  // 1 mm, so that lines on the border show
    x0 -= margin, y0 -= margin, x1 += margin, y1 += margin;

    std::string text =
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" "
        "version=\"1.1\" width=\"";
    append_mm(text, x1 - x0);
    text += "mm\" height=\"";
    append_mm(text, y1 - y0);
    text += "mm\" viewBox=\"";
    append_mm(text, x0);
    text += ' ';
    append_mm(text, -y1);
    text += ' ';
    append_mm(text, x1 - x0);
    text += ' ';
    append_mm(text, y1 - y0);
    text +=
        "\">\n<g fill=\"#c08a4a\" fill-opacity=\"0.15\" fill-rule=\"evenodd\" stroke=\"#333\" "
        "stroke-width=\"0.1\">\n";
    std::map<std::string, int> used;
    for (const Section& section : sections) {
        std::string id = "z" + height_text(section.plane.z);
        if (section.plane.side == Side::below) id += "-below";
        if (const int times = ++used[id]; times > 1) id += "-" + std::to_string(times);
        text += "<g id=\"" + id + "\">\n";
        if (!section.loops.empty()) {
            text += "<path d=\"";
            for (std::size_t i = 0; i < section.loops.size(); ++i)
                append_path(text, section.loops.loop(i), true);
            text += "\"/>\n";
        }
        for (std::size_t i = 0; i < section.open_chains.size(); ++i) {
            text += "<path class=\"open\" fill=\"none\" stroke=\"#c00\" d=\"";
            append_path(text, section.open_chains.loop(i), false);
            text += "\"/>\n";
        }
        text += "</g>\n";
    }
    text += "</g>\n</svg>\n";
    return text;
}

}  // namespace slabwright
