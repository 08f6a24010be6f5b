#include "engine/tools/libraries.h"

#include <span>
#include <string>

namespace slabwright {

namespace {

/// A size of end mills, mm.
struct Size {
    const char* name;
    double diameter, stepdown_min, stepdown_max;
    double flute, stickout, holder;
    double shank = diameter;
};

Tool end_mill(int number, ToolKind kind, const Size& size) {
    Tool tool;
    tool.number = number;
    tool.kind = kind;
    tool.name = std::string(kind == ToolKind::flat ? "flat end mill " : "ball end mill ") + size.name;
    tool.diameter = size.diameter;
    tool.shank_diameter = size.shank;
    tool.flute_length = size.flute;
    tool.stickout = size.stickout;
    tool.holder_diameter = size.holder;
    tool.stepdown_min = size.stepdown_min;
    tool.stepdown_max = size.stepdown_max;
    tool.plunges = plunges_by_default(kind);
    return tool;
}

/// Cemented tungsten carbide is commonly given as 530 to 700 GPa, the less the more cobalt it has.
constexpr double kCarbideGpa = 550;

// End mills up to half an inch are bought of solid carbide; wider ones, and face mills, have bodies of steel.
void make_of_carbide(std::span<Tool> tools) {
    constexpr double kWidestSolid = 0.5 * kInch;
    for (Tool& tool : tools)
        if (is_end_mill(tool.kind) && tool.diameter <= kWidestSolid) tool.modulus_gpa = kCarbideGpa;
}

/// How deep flats of these widths may cut in MDF, in diameters, at the chip of .25 mm that max_feed and
/// max_rpm make: charts (CuttingChart::mdf) have .5 mm a tooth for 1/2 in one diameter deep and a quarter
/// less two deep, .3 mm for 1/4 in one deep, and nothing wider; of 1/8 in they have .1 mm, so it stays at
/// LUO's depth.
constexpr double kWholeDepth = 1, kHalfDepth = 2, kQuarterDepth = 1;
/// And balls, as LUO's of 1/4 and 1/8 in do.
constexpr double kBallDepth = 0.5;

/// A row of LUO table 5.4, inches: the diameter, and the range of its stepdown.
struct LuoRow {
    double diameter, low, high;
};
constexpr LuoRow kEighth{0.125, 0, 0.0625}, kQuarter{0.25, 0.0625, 0.125}, kHalf{0.5, 0.1, 0.15},
    kThreeQuarters{0.75, 0.12, 0.2}, kWhole{1.0, 0.16, 0.25};

Size in_inches(const char* name, const LuoRow& row, double flute, double stickout, double holder) {
    return {name, row.diameter * kInch, row.low * kInch, row.high * kInch, flute, stickout, holder};
}

/// A size in mm that steps in proportion to its diameter as the row's does.
Size in_mm(const char* name, double diameter, const LuoRow& row, double flute, double stickout,
           double holder) {
    const double scale = diameter / row.diameter;
    return {name, diameter, row.low * scale, row.high * scale, flute, stickout, holder};
}

// The size, but for stepdowns up to so many of its diameters.
Size up_to(Size size, double diameters) {
    size.stepdown_max = diameters * size.diameter;
    return size;
}

// The size with its cutter on a thicker shank.
Size on_shank(Size size, double shank) {
    size.shank = shank;
    return size;
}

}  // namespace

std::vector<Tool> luo_library() {
    const Size sizes[] = {in_inches("1/8 in", kEighth, 25, 40, 32), in_inches("1/4 in", kQuarter, 30, 45, 32),
                          in_inches("1/2 in", kHalf, 32, 60, 40),
                          in_inches("3/4 in", kThreeQuarters, 38, 65, 50),
                          in_inches("1 in", kWhole, 45, 75, 50)};
    std::vector<Tool> tools{Job{}.tools.front()};
    for (const ToolKind kind : {ToolKind::flat, ToolKind::ball}) {
        int number = kind == ToolKind::flat ? 2 : 12;
        for (const Size& size : sizes) tools.push_back(end_mill(number++, kind, size));
    }
    return tools;
}

std::vector<Tool> shop_library() {
    // Slender cutters are bought on thicker shanks, which bend less; their flutes are longer than a layer is
    // tall.
    const Size eighth = on_shank(in_inches("1/8 in", kEighth, kInch, 36, 32), 0.25 * kInch);
    std::vector<Tool> tools = Job{}.tools;
    tools[1].stepdown_max = kHalfDepth * tools[1].diameter;
    tools.push_back(end_mill(4, ToolKind::flat, up_to(in_inches("1 in", kWhole, 50.8, 75, 50), kWholeDepth)));
    tools.push_back(
        end_mill(5, ToolKind::flat, up_to(in_inches("1/4 in", kQuarter, kInch, 38, 32), kQuarterDepth)));
    tools.push_back(end_mill(6, ToolKind::flat, eighth));
    tools.push_back(end_mill(7, ToolKind::ball, up_to(in_inches("1/2 in", kHalf, 32, 50, 40), kBallDepth)));
    tools.push_back(end_mill(8, ToolKind::ball, eighth));
    make_of_carbide(tools);
    return tools;
}

std::vector<Tool> forms_library() {
    std::vector<Tool> tools = Job{}.tools;
    const auto add = [&](ToolKind kind, const char* name, const Size& size) -> Tool& {
        Tool tool = end_mill(static_cast<int>(tools.size()) + 1, kind, size);
        tool.name = name;
        tools.push_back(std::move(tool));
        return tools.back();
    };
    add(ToolKind::bull_nose, "bull-nose 1 in R3", in_inches("", kWhole, 50.8, 75, 50)).corner_radius = 3;
    add(ToolKind::ball, "ball end mill 1/2 in", in_inches("", kHalf, 32, 50, 40));
    Tool& tapered = add(ToolKind::tapered_ball, "tapered ball R1.5 to 1/4 in",
                        {"", 0.25 * kInch, 0, 0.0625 * kInch, 28, 42, 32});
    tapered.corner_radius = 1.5;
    tapered.taper_deg = 5;
    Tool& cone = add(ToolKind::cone, "cone 90 degrees", {"", 12, 0, 3, 12, 40, 32});
    cone.point_deg = 90;
    Tool& drill = add(ToolKind::drill, "drill 8 mm", {"", 8, 0, 8, 50, 65, 32});
    drill.max_rpm = 6000;
    drill.max_feed = drill.plunge_feed = 900;
    make_of_carbide(std::span(tools).subspan(Job{}.tools.size()));
    return tools;
}

std::vector<Tool> metric_library() {
    const Size three = on_shank(in_mm("3 mm", 3, kEighth, 24, 35, 32), 6);
    const Size six = in_mm("6 mm", 6, kQuarter, 30, 45, 32);
    const Size twelve = in_mm("12 mm", 12, kHalf, 32, 50, 40);
    std::vector<Tool> tools{Job{}.tools.front()};
    tools.push_back(end_mill(2, ToolKind::flat, up_to(twelve, kHalfDepth)));
    tools.push_back(end_mill(3, ToolKind::ball, six));
    tools.push_back(end_mill(4, ToolKind::flat, up_to(in_mm("25 mm", 25, kWhole, 50, 75, 50), kWholeDepth)));
    tools.push_back(end_mill(5, ToolKind::flat, up_to(six, kQuarterDepth)));
    tools.push_back(end_mill(6, ToolKind::flat, three));
    tools.push_back(end_mill(7, ToolKind::ball, up_to(twelve, kBallDepth)));
    tools.push_back(end_mill(8, ToolKind::ball, three));
    make_of_carbide(tools);
    return tools;
}

std::optional<std::vector<Tool>> named_library(std::string_view name) {
    if (name == "fixed") return Job{}.tools;
    if (name == "shop") return shop_library();
    if (name == "forms") return forms_library();
    if (name == "metric") return metric_library();
    if (name == "luo") return luo_library();
    return std::nullopt;
}

}  // namespace slabwright
