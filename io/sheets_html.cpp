#include "io/sheets_html.h"

#include <cmath>
#include <numbers>

#include "io/report_template.h"
#include "io/text/json_text.h"

namespace slabwright {

namespace {

constexpr std::string_view kDataMark = "/*slabwright:data*/null";
constexpr double kThinned = 0.05;  // mm
constexpr double kHundredths = 100;

struct End {
    double x = 0, y = 0;
};

End bottom_of(const ReadHead& head, double thickness) {
    constexpr double degree = std::numbers::pi / 180;
    const double aside = thickness * std::tan(head.a * degree);
    return {head.x + aside * std::cos(head.c * degree), head.y + aside * std::sin(head.c * degree)};
}

double beside(End p, End a, End b) {
    const double l = std::hypot(b.x - a.x, b.y - a.y);
    return l > 0 ? std::abs((p.x - a.x) * (b.y - a.y) - (p.y - a.y) * (b.x - a.x)) / l
                 : std::hypot(p.x - a.x, p.y - a.y);
}

/// Which points of a loop are drawn: between two, both ends of all that are left out lie within kThinned of
/// the straight line (Douglas and Peucker).
std::vector<std::size_t> drawn(const std::vector<End>& top, const std::vector<End>& bottom) {
    std::vector<bool> kept(top.size(), false);
    kept.front() = kept.back() = true;
    std::vector<std::pair<std::size_t, std::size_t>> open{{0, top.size() / 2},
                                                          {top.size() / 2, top.size() - 1}};
    kept[top.size() / 2] = true;
    while (!open.empty()) {
        const auto [a, b] = open.back();
        open.pop_back();
        double most = kThinned;
        std::size_t at = 0;
        for (std::size_t i = a + 1; i < b; ++i) {
            const double away =
                std::max(beside(top[i], top[a], top[b]), beside(bottom[i], bottom[a], bottom[b]));
            if (away > most) most = away, at = i;
        }
        if (at == 0) continue;
        kept[at] = true;
        open.push_back({a, at});
        open.push_back({at, b});
    }
    std::vector<std::size_t> indices;
    for (std::size_t i = 0; i + 1 < top.size(); ++i)  // the last is at the place of the first
        if (kept[i]) indices.push_back(i);
    return indices;
}

void put_way(JsonText& json, const ReadWay& way, double thickness) {
    std::vector<End> top, bottom;
    for (std::size_t i = 1; i < way.points.size(); ++i) {  // without the way in
        top.push_back({way.points[i].x, way.points[i].y});
        bottom.push_back(bottom_of(way.points[i], thickness));
    }
    json.begin_object(JsonText::Shape::line).key("piece").integer(way.piece).key("pass").integer(way.pass);
    json.key("hole").boolean(way.is_hole);
    const std::vector<std::size_t> indices = top.empty() ? std::vector<std::size_t>{} : drawn(top, bottom);
    for (const auto& [name, ends] : {std::pair{"top", &top}, std::pair{"bottom", &bottom}}) {
        json.key(name).begin_array(JsonText::Shape::line);
        for (const std::size_t i : indices)
            json.integer(std::llround((*ends)[i].x * kHundredths))
                .integer(std::llround((*ends)[i].y * kHundredths));
        json.end();
    }
    json.end();
}

/// JSON within a script: no text in it may end the script.
std::string harmless(std::string_view json) {
    std::string text;
    for (const char c : json) {
        if (c == '<') text += "\\u003c";
        else text += c;
    }
    return text;
}

}  // namespace

std::string assembly_html(std::string_view sheets, std::string_view verify,
                          const std::vector<ReadSheetProgram>& programs) {
    std::string page(assembly_template());
    const std::size_t mark = page.find(kDataMark);
    if (mark == std::string::npos) return {};
    JsonText ways;
    ways.begin_array();
    for (const ReadSheetProgram& program : programs) {
        ways.begin_array();
        for (const ReadWay& way : program.ways) put_way(ways, way, program.thickness);
        ways.end();
    }
    ways.end();
    const std::string data = "{\"sheets\":" + harmless(sheets) + ",\"verify\":" + harmless(verify) +
                             ",\"ways\":" + ways.take() + "}";
    return page.replace(mark, kDataMark.size(), data);
}

}  // namespace slabwright
