// The three writers of sections, read back and compared.
#include <gtest/gtest.h>

#include <clocale>
#include <cmath>
#include <cstdlib>
#include <locale>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <sstream>

#include "io/text/decimal.h"
#include "io/write/sections_dxf.h"
#include "io/write/sections_json.h"
#include "io/write/sections_svg.h"

namespace {

using namespace slabwright;

/// An outer loop, its hole and an open chain at 12.7; a triangle far out at −0.05, below; nothing at 3e-5; a
/// repeat.
std::vector<Section> sample() {
    std::vector<Section> sections(4);
    Section& a = sections[0];
    a.plane = {12.7, Side::above};
    a.loops.points = {{0, 0},         {100000, 0},    {100000, 50001}, {0, 50001},
                      {20000, 10000}, {20000, 30000}, {45000, 30000},  {45000, 10000}};
    a.loops.starts = {0, 4, 8};
    a.loops.parents = {-1, 0};
    a.open_chains.points = {{-70000, 5}, {-60000, -123456}, {-50001, 0}};
    a.open_chains.starts = {0, 3};
    a.closed_gaps = 2;
    Section& b = sections[1];
    b.plane = {-0.05, Side::below};
    b.loops.points = {{-2147483648, -2147483648}, {2147483647, -1}, {7, 2147483647}};
    b.loops.starts = {0, 3};
    b.loops.parents = {-1};
    sections[2].plane = {3e-5, Side::above};
    sections[3] = a;
    return sections;
}

std::string unit_text(std::int64_t units) {
    std::string text;
    append_mm(text, units);
    return text;
}

TEST(SectionsWriters, DecimalsAreExactAndPlain) {
    EXPECT_EQ(unit_text(0), "0");
    EXPECT_EQ(unit_text(1), "0.0001");
    EXPECT_EQ(unit_text(-1), "-0.0001");
    EXPECT_EQ(unit_text(127000), "12.7");
    EXPECT_EQ(unit_text(-2147483648LL), "-214748.3648");
    EXPECT_EQ(unit_text(10050), "1.005");
    EXPECT_EQ(height_text(2.54 * 3), "7.62");
    EXPECT_EQ(height_text(-0.0), "0");
    std::mt19937_64 random(7);
    for (int i = 0; i < 20000; ++i) {
        const auto units = static_cast<std::int64_t>(random() % 4294967296ULL) - 2147483648LL;
        ASSERT_EQ(std::llround(std::strtod(unit_text(units).c_str(), nullptr) * kUnitsPerMm), units);
        const double value = std::ldexp(static_cast<double>(random() % 1000003) - 500000,
                                        static_cast<int>(random() % 120) - 80);
        std::string text;
        append_decimal(text, value);
        ASSERT_EQ(std::strtod(text.c_str(), nullptr), value) << text;
        ASSERT_EQ(text.find_first_of("eE"), std::string::npos);
    }
    for (const double extreme : {1.7976931348623157e308, 4.9406564584124654e-324, -0.0}) {
        std::string text;
        append_decimal(text, extreme);
        EXPECT_EQ(std::strtod(text.c_str(), nullptr), extreme);
        EXPECT_NE(text, "-0");
    }
}

TEST(SectionsWriters, JsonReadsBackExactly) {
    const auto sections = sample();
    const std::string text = sections_json(sections);
    const auto json = nlohmann::json::parse(text);
    EXPECT_EQ(json.at("schema"), "slabwright.slice/1");
    EXPECT_EQ(json.at("units"), "mm");
    ASSERT_EQ(json.at("sections").size(), sections.size());
    auto read = [](const nlohmann::json& point) {
        return Point2{static_cast<std::int32_t>(std::llround(point.at(0).get<double>() * kUnitsPerMm)),
                      static_cast<std::int32_t>(std::llround(point.at(1).get<double>() * kUnitsPerMm))};
    };
    for (std::size_t s = 0; s < sections.size(); ++s) {
        const auto& entry = json["sections"][s];
        EXPECT_EQ(entry.at("z").get<double>(), sections[s].plane.z);
        EXPECT_EQ(entry.at("side"), sections[s].plane.side == Side::above ? "above" : "below");
        EXPECT_EQ(entry.at("area_mm2").get<double>(), area(sections[s].loops));
        EXPECT_EQ(entry.at("closed_gaps").get<unsigned>(), sections[s].closed_gaps);
        ASSERT_EQ(entry.at("loops").size(), sections[s].loops.size());
        for (std::size_t i = 0; i < sections[s].loops.size(); ++i) {
            const auto& loop = entry["loops"][i];
            const auto points = sections[s].loops.loop(i);
            EXPECT_EQ(loop.at("parent").is_null() ? -1 : loop.at("parent").get<int>(),
                      sections[s].loops.parents[i]);
            EXPECT_EQ(loop.at("area_mm2").get<double>(), signed_area(points));
            ASSERT_EQ(loop.at("points").size(), points.size());
            for (std::size_t k = 0; k < points.size(); ++k) EXPECT_EQ(read(loop["points"][k]), points[k]);
        }
        ASSERT_EQ(entry.at("open_chains").size(), sections[s].open_chains.size());
        for (std::size_t i = 0; i < sections[s].open_chains.size(); ++i) {
            const auto points = sections[s].open_chains.loop(i);
            ASSERT_EQ(entry["open_chains"][i].size(), points.size());
            for (std::size_t k = 0; k < points.size(); ++k)
                EXPECT_EQ(read(entry["open_chains"][i][k]), points[k]);
        }
    }
    EXPECT_EQ(nlohmann::json::parse(sections_json({})).at("sections").size(), 0u);
}

/// All values of an XML attribute, in order.
std::vector<std::string> attributes(const std::string& text, const std::string& name) {
    std::vector<std::string> values;
    const std::string key = " " + name + "=\"";
    for (std::size_t at = 0; (at = text.find(key, at)) != std::string::npos;) {
        at += key.size();
        const std::size_t end = text.find('"', at);
        values.push_back(text.substr(at, end - at));
        at = end;
    }
    return values;
}

TEST(SectionsWriters, SvgShowsEveryLoopTheRightWayUp) {
    auto sections = sample();
    sections.erase(sections.begin() + 1);  // the far triangle
    const std::string text = sections_svg(sections);
    const auto ids = attributes(text, "id");
    EXPECT_EQ(ids, (std::vector<std::string>{"z12.7", "z0", "z12.7-2"}));
    EXPECT_NE(text.find("fill-rule=\"evenodd\""), std::string::npos);
    EXPECT_EQ(attributes(text, "width").front(), "19mm");        // −7 … 10 and 1 mm on either side
    EXPECT_EQ(attributes(text, "height").front(), "19.3457mm");  // −12.3456 … 5.0001
    EXPECT_EQ(attributes(text, "viewBox").front(), "-8 -6.0001 19 19.3457");
    const auto paths = attributes(text, "d");
    ASSERT_EQ(paths.size(), 4u);
    EXPECT_EQ(paths[0], "M0 0L10 0L10 -5.0001L0 -5.0001ZM2 -1L2 -3L4.5 -3L4.5 -1Z");
    EXPECT_EQ(paths[1], "M-7 -0.0005L-6 12.3456L-5.0001 0");
    EXPECT_EQ(attributes(sections_svg(sample()), "id")[1], "z-0.05-below");
    EXPECT_EQ(attributes(sections_svg({}), "viewBox").front(), "-1 -1 2 2");
}

TEST(SectionsWriters, DxfGroupsReadBack) {
    const auto sections = sample();
    std::istringstream in(sections_dxf(sections));
    std::vector<std::pair<int, std::string>> groups;
    for (std::string code, value; std::getline(in, code) && std::getline(in, value);)
        groups.emplace_back(std::stoi(code), value);
    ASSERT_FALSE(groups.empty());
    EXPECT_EQ(groups.back(), (std::pair<int, std::string>(0, "EOF")));
    std::set<std::string> layers;
    Loops closed, open;
    std::vector<std::string> closed_layers;
    std::string entity, section, variable, units;
    Loops* polyline = nullptr;
    Point2 vertex;
    std::string layer;
    for (std::size_t g = 0; g < groups.size(); ++g) {
        const auto& [code, value] = groups[g];
        if (code == 9) variable = value;
        if (code == 70 && variable == "$INSUNITS" && entity == "SECTION" && section == "HEADER")
            units = value;
        if (code == 2 && entity == "SECTION") section = value;
        if (code == 2 && entity == "LAYER") {
            EXPECT_TRUE(layers.insert(value).second) << "twice: " << value;
        }
        if (code == 8) {
            layer = value;
            EXPECT_TRUE(layers.count(value)) << value;
            EXPECT_EQ(value.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-$"), std::string::npos)
                << "not a name in R12: " << value;
        }
        if (code == 70 && entity == "POLYLINE") {
            polyline = value == "1" ? &closed : &open;
            if (value == "1") closed_layers.push_back(layer);
        }
        if (code == 10 && entity == "VERTEX")
            vertex.x = static_cast<std::int32_t>(std::llround(std::stod(value) * kUnitsPerMm));
        if (code == 20 && entity == "VERTEX")
            vertex.y = static_cast<std::int32_t>(std::llround(std::stod(value) * kUnitsPerMm));
        if (code == 30 && entity == "VERTEX") polyline->points.push_back(vertex);
        if (code == 10 || code == 20 || code == 30) {
            EXPECT_EQ(value.find_first_of("eE"), std::string::npos);
            EXPECT_NE(value.find('.'), std::string::npos);
        }
        if (code == 0) {
            entity = value;
            if (value == "SEQEND") polyline->close_loop();
        }
    }
    EXPECT_EQ(units, "4");
    EXPECT_EQ(layers, (std::set<std::string>{"Z_12_7", "Z_12_7_OPEN", "Z_-0_05_BELOW", "Z_0"}));
    EXPECT_EQ(closed_layers,
              (std::vector<std::string>{"Z_12_7", "Z_12_7", "Z_-0_05_BELOW", "Z_12_7", "Z_12_7"}));
    Loops expected, expected_open;
    for (const Section& s : sections) {
        for (std::size_t i = 0; i < s.loops.size(); ++i) {
            expected.points.insert(expected.points.end(), s.loops.loop(i).begin(), s.loops.loop(i).end());
            expected.close_loop();
        }
        for (std::size_t i = 0; i < s.open_chains.size(); ++i) {
            expected_open.points.insert(expected_open.points.end(), s.open_chains.loop(i).begin(),
                                        s.open_chains.loop(i).end());
            expected_open.close_loop();
        }
    }
    EXPECT_EQ(closed.points, expected.points);
    EXPECT_EQ(closed.starts, expected.starts);
    EXPECT_EQ(open.points, expected_open.points);
    EXPECT_EQ(open.starts, expected_open.starts);
}

/// A decimal comma and grouped thousands, on any machine.
struct CommaPunctuation : std::numpunct<char> {
    char do_decimal_point() const override { return ','; }
    char do_thousands_sep() const override { return '.'; }
    std::string do_grouping() const override { return "\3"; }
};

TEST(SectionsWriters, DoNotDependOnTheLocale) {
    const auto sections = sample();
    const std::string json = sections_json(sections), svg = sections_svg(sections),
                      dxf = sections_dxf(sections);
    const std::locale before = std::locale::global(std::locale(std::locale::classic(), new CommaPunctuation));
    std::ostringstream probe;
    probe << 1234.5;
    EXPECT_EQ(probe.str(), "1.234,5");  // the trap is set
    for (const char* name : {"de_DE.UTF-8", "de_DE.utf8", "fr_FR.UTF-8"})
        if (std::setlocale(LC_ALL, name)) break;
    EXPECT_EQ(sections_json(sections), json);
    EXPECT_EQ(sections_svg(sections), svg);
    EXPECT_EQ(sections_dxf(sections), dxf);
    std::setlocale(LC_ALL, "C");
    std::locale::global(before);
}

}  // namespace
