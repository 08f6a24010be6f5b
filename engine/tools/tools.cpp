#include "engine/tools/tools.h"

#include <algorithm>
#include <cmath>

namespace slabwright {

namespace {

// The tool of a kind that is as wide as LUO's fixed set has it, else the first of its kind.
const Tool& fixed_tool(const Job& job, ToolKind kind, double diameter) {
    for (const Tool& tool : job.tools)
        if (tool.kind == kind && std::abs(tool.diameter - diameter) < 1e-3) return tool;
    return tool_of_kind(job, kind);
}

// Whether a stiffer twin took the tool's place.
bool stiffen(const Job& job, Tool& tool) {
    const Tool* stiffest = &tool;
    for (const Tool& other : job.tools)
        if (other.kind == tool.kind && std::abs(other.diameter - tool.diameter) < 1e-3 &&
            other.stickout < stiffest->stickout - 1e-9)
            stiffest = &other;
    if (stiffest == &tool) return false;
    const double least = tool.stepdown_min, most = tool.stepdown_max;
    tool = *stiffest;
    tool.stepdown_min = std::min(least, tool.stepdown_max);
    tool.stepdown_max = std::min(most, tool.stepdown_max);
    return true;
}

}  // namespace

bool clears_on_contours(const Job& job) {
    if (job.cutting.rest_pattern != RestPattern::by_library)
        return job.cutting.rest_pattern == RestPattern::contour;
    auto several = [&](ToolKind kind) {
        return std::count_if(job.tools.begin(), job.tools.end(),
                             [&](const Tool& t) { return t.kind == kind; }) > 1;
    };
    return several(ToolKind::flat) || several(ToolKind::ball);
}

double least_slab(const Tool& tool) {
    return tool.stepdown_min > 0 ? tool.stepdown_min : tool.stepdown_max / 2;
}

std::vector<Tool> rest_tools(const Job& job, double rough_diameter, double finish_diameter) {
    // What a flat reaches at a corner a smaller one reaches too, and so it is with balls: the smallest of
    // either kind leave no more than all together.
    std::vector<Tool> rest;
    for (const Tool& tool : job.tools)
        if ((tool.kind == ToolKind::flat && tool.diameter < rough_diameter - 1e-9) ||
            (tool.kind == ToolKind::ball && tool.diameter < finish_diameter - 1e-9))
            rest.push_back(tool);
    std::stable_sort(rest.begin(), rest.end(), [](const Tool& a, const Tool& b) {
        return a.diameter != b.diameter ? a.diameter > b.diameter : a.kind < b.kind;
    });
    return rest;
}

std::vector<Tool> luo_library() {
    struct Size {
        const char* name;
        double inches, low, high;        // diameter and stepdowns
        double flute, stickout, holder;  // mm
    };
    constexpr Size sizes[] = {{"1/8 in", 0.125, 0, 0.0625, 25, 40, 32},
                              {"1/4 in", 0.25, 0.0625, 0.125, 30, 45, 32},
                              {"1/2 in", 0.5, 0.1, 0.15, 32, 60, 40},
                              {"3/4 in", 0.75, 0.12, 0.2, 38, 65, 50},
                              {"1 in", 1.0, 0.16, 0.25, 45, 75, 50}};
    std::vector<Tool> tools{Job{}.tools.front()};
    for (const ToolKind kind : {ToolKind::flat, ToolKind::ball}) {
        int number = kind == ToolKind::flat ? 2 : 12;
        for (const Size& size : sizes) {
            Tool tool;
            tool.number = number++;
            tool.kind = kind;
            tool.name = std::string(kind == ToolKind::flat ? "flat end mill " : "ball end mill ") + size.name;
            tool.diameter = tool.shank_diameter = size.inches * kInch;
            tool.flute_length = size.flute;
            tool.stickout = size.stickout;
            tool.holder_diameter = size.holder;
            tool.stepdown_min = size.low * kInch;
            tool.stepdown_max = size.high * kInch;
            tool.plunges = plunges_by_default(kind);
            tools.push_back(tool);
        }
    }
    return tools;
}

std::optional<LayerTools> stiffer_tools(const Job& job, const LayerTools& tools) {
    LayerTools stiffer = tools;
    bool changed = stiffen(job, stiffer.rough);
    changed |= stiffen(job, stiffer.finish);
    for (auto* more : {&stiffer.semi_rough, &stiffer.rest})
        for (Tool& tool : *more) changed |= stiffen(job, tool);
    return changed ? std::optional(stiffer) : std::nullopt;
}

LayerTools fixed_tools(const Job& job) {
    LayerTools tools;
    tools.rough = fixed_tool(job, ToolKind::flat, 0.5 * kInch);
    tools.finish = fixed_tool(job, ToolKind::ball, 0.25 * kInch);
    tools.rest = rest_tools(job, tools.rough.diameter, tools.finish.diameter);
    return tools;
}

}  // namespace slabwright
