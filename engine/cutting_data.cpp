#include "engine/cutting_data.h"

#include <fmt/format.h>

#include <array>

#include "kernels/errors.h"

namespace slabwright {

namespace {

constexpr double kInches = 25.4;  // mm

// Spiral router bits as wide as a size and up to the next that its chart has; 1/8 in and 1/4 in stand for 3
// mm and 6 mm too, and the widest size for half a millimetre more.
CuttingData line(double from_mm, double to_mm, double chip_inch, double rpm, const char* chart,
                 const char* cell) {
    return {CuttingScope::end_mill, from_mm, to_mm, 0,
            chip_inch * kInches,    0,       rpm,   fmt::format("{}, {}", chart, cell)};
}

constexpr const char* kAst =
    "AST Tooling, Speeds and Feeds - Spiral Router Bits, asttooling.com/pages/speeds-and-feeds-charts";
constexpr const char* kAmanaWood =
    "Amana Tool, cdn.shopify.com/s/files/1/1558/5651/files/Solid-Carbide-Spiral-Plunge-Solid-Wood-v5.pdf";
constexpr const char* kAmanaFoam =
    "Amana Tool, cdn.shopify.com/s/files/1/1558/5651/files/Foam-Cutting-Speed-Chart-v7.pdf";

// mm: where the sizes begin.
constexpr double kEighth = 3, kThreeSixteenths = 4.75, kQuarter = 6, kFiveSixteenths = 7.9,
                 kThreeEighths = 9.5, kHalf = 12, kOverHalf = 13.2;

const std::vector<CuttingData>& mdf() {
    static const std::vector<CuttingData> lines{
        line(kEighth, kQuarter - 0.01, 0.004, 0, kAst, "MDF, 1/8 in: .004 to .007 in"),
        line(kQuarter, kThreeEighths - 0.01, 0.012, 0, kAst, "MDF, 1/4 in: .012 to .015 in"),
        line(kThreeEighths, kHalf - 0.01, 0.017, 0, kAst, "MDF, 3/8 in: .017 to .019 in"),
        line(kHalf, kOverHalf, 0.020, 0, kAst, "MDF, 1/2 in: .020 to .025 in")};
    return lines;
}

const std::vector<CuttingData>& plywood() {
    static const std::vector<CuttingData> lines{
        line(kEighth, kQuarter - 0.01, 0.003, 0, kAst, "plywood, 1/8 in: .003 to .005 in"),
        line(kQuarter, kThreeEighths - 0.01, 0.006, 0, kAst, "plywood, 1/4 in: .006 to .009 in"),
        line(kThreeEighths, kHalf - 0.01, 0.015, 0, kAst, "plywood, 3/8 in: .015 to .018 in"),
        line(kHalf, kOverHalf, 0.018, 0, kAst, "plywood, 1/2 in: .018 to .021 in")};
    return lines;
}

const std::vector<CuttingData>& pine() {
    constexpr double rpm = 18000;
    static const std::vector<CuttingData> lines{
        line(kEighth, kThreeSixteenths - 0.01, 0.003, rpm, kAmanaWood, "softwood, 1/8 in: .003 to .005 in"),
        line(kThreeSixteenths, kQuarter - 0.01, 0.004, rpm, kAmanaWood, "softwood, 3/16 in: .004 to .006 in"),
        line(kQuarter, kThreeEighths - 0.01, 0.005, rpm, kAmanaWood,
             "softwood, 1/4 and 5/16 in: .005 to .007 in"),
        line(kThreeEighths, kHalf - 0.01, 0.006, rpm, kAmanaWood, "softwood, 3/8 in: .006 to .008 in"),
        line(kHalf, kOverHalf, 0.007, rpm, kAmanaWood, "softwood, 1/2 in: .007 to .009 in")};
    return lines;
}

const std::vector<CuttingData>& foam() {
    constexpr double rpm = 18000;
    static const std::vector<CuttingData> lines{
        line(kEighth, kQuarter - 0.01, 0.002, rpm, kAmanaFoam, "1/8 and 3/16 in: .002 to .004 in"),
        line(kQuarter, kHalf - 2, 0.004, rpm, kAmanaFoam, "1/4 to 3/8 in: .004 to .006 in")};
    return lines;
}

bool is_in(CuttingScope scope, ToolKind kind) {
    switch (scope) {
        case CuttingScope::any:
            return true;
        case CuttingScope::end_mill:
            return kind != ToolKind::face && kind != ToolKind::drill;
        case CuttingScope::flat:
            return kind == ToolKind::flat;
        case CuttingScope::ball:
            return kind == ToolKind::ball;
        case CuttingScope::face:
            return kind == ToolKind::face;
        case CuttingScope::drill:
            return kind == ToolKind::drill;
        case CuttingScope::bull_nose:
            return kind == ToolKind::bull_nose;
        case CuttingScope::tapered_ball:
            return kind == ToolKind::tapered_ball;
        case CuttingScope::cone:
            return kind == ToolKind::cone;
    }
    return false;
}

}  // namespace

bool covers(const CuttingData& data, ToolKind kind, double diameter, int flutes) {
    return is_in(data.kind, kind) && diameter >= data.diameter_min &&
           (data.diameter_max == 0 || diameter <= data.diameter_max) &&
           (data.flutes == 0 || data.flutes == flutes);
}

std::span<const CuttingData> lines_of(CuttingChart chart) {
    switch (chart) {
        case CuttingChart::none:
            break;
        case CuttingChart::mdf:
            return mdf();
        case CuttingChart::pine:
            return pine();
        case CuttingChart::plywood:
            return plywood();
        case CuttingChart::foam:
            return foam();
    }
    return {};
}

void validate_cutting_data(const std::vector<CuttingData>& lines) {
    for (std::size_t i = 0; i < lines.size(); ++i) {
        const CuttingData& data = lines[i];
        const auto key = [&](const char* name) {
            return fmt::format("material.cutting[{}].{}", i + 1, name);
        };
        const auto require = [&](const char* name, double value, double least, double most) {
            if (value >= least && value <= most) return;
            throw Error(ErrorKind::usage, "job.range",
                        fmt::format("{} is {}, out of range", key(name), value), key(name),
                        fmt::format("give a number from {} up to {}", least, most));
        };
        require("diameter_min", data.diameter_min, 0, 1000);
        if (data.diameter_max != 0) require("diameter_max", data.diameter_max, data.diameter_min, 1000);
        require("flutes", data.flutes, 0, 100);
        require("chip_load", data.chip_load, 0.001, 10);
        require("surface_speed", data.surface_speed, 0, 10000);
        require("spindle_rpm", data.spindle_rpm, 0, 1e6);
        if (data.source.empty())
            throw Error(ErrorKind::usage, "job.range", key("source") + " is empty", key("source"),
                        "name the chart, the test or the person that these figures are from");
    }
}

}  // namespace slabwright
