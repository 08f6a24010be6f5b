#include "io/write/sections_json.h"

#include "io/text/decimal.h"

namespace slabwright {

namespace {

void append_points(std::string& text, std::span<const Point2> points) {
    text += '[';
    for (std::size_t i = 0; i < points.size(); ++i) {
        text += i ? ",[" : "[";
        append_mm(text, points[i].x);
        text += ',';
        append_mm(text, points[i].y);
        text += ']';
    }
    text += ']';
}

}  // namespace

std::string sections_json(std::span<const Section> sections) {
    std::string text = "{\"schema\":\"slabwright.slice/1\",\"units\":\"mm\",\"sections\":[";
    for (std::size_t s = 0; s < sections.size(); ++s) {
        const Section& section = sections[s];
        text += s ? ",\n{\"z\":" : "\n{\"z\":";
        append_decimal(text, section.plane.z);
        text += section.plane.side == Side::above ? ",\"side\":\"above\"" : ",\"side\":\"below\"";
        text += ",\"area_mm2\":";
        append_decimal(text, area(section.loops));
        text += ",\"closed_gaps\":" + std::to_string(section.closed_gaps);
        text += ",\"loops\":[";
        for (std::size_t i = 0; i < section.loops.size(); ++i) {
            const std::int32_t parent = i < section.loops.parents.size() ? section.loops.parents[i] : -1;
            text += i ? ",\n{\"parent\":" : "\n{\"parent\":";
            text += parent < 0 ? "null" : std::to_string(parent);
            text += ",\"area_mm2\":";
            append_decimal(text, signed_area(section.loops.loop(i)));
            text += ",\"points\":";
            append_points(text, section.loops.loop(i));
            text += '}';
        }
        text += "],\"open_chains\":[";
        for (std::size_t i = 0; i < section.open_chains.size(); ++i) {
            text += i ? ",\n" : "\n";
            append_points(text, section.open_chains.loop(i));
        }
        text += "]}";
    }
    text += "]}\n";
    return text;
}

}  // namespace slabwright
