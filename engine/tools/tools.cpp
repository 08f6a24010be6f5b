#include "engine/tools/tools.h"

#include <algorithm>
#include <cmath>

namespace slabwright {

namespace {

constexpr double kHair = 1e-9;  // mm, or a share: rounding

// The tool of a kind that is as wide as LUO's fixed set has it, else the first of its kind.
const Tool& fixed_tool(const Job& job, ToolKind kind, double diameter) {
    for (const Tool& tool : job.tools)
        if (tool.kind == kind && std::abs(tool.diameter - diameter) < 1e-3) return tool;
    return tool_of_kind(job, kind);
}

// Of two cutters as wide, the one whose value is less bends less: L³/E.
double bends(const Tool& tool) { return tool.stickout * tool.stickout * tool.stickout / tool.modulus_gpa; }

// Whether a stiffer twin took the tool's place.
bool stiffen(const Job& job, Tool& tool) {
    const Tool* stiffest = &tool;
    for (const Tool& other : job.tools)
        if (other.kind == tool.kind && std::abs(other.diameter - tool.diameter) < 1e-3 &&
            std::abs(other.corner_radius - tool.corner_radius) < 1e-3 &&
            std::abs(other.taper_deg - tool.taper_deg) < 1e-3 &&
            bends(other) < (1 - kHair) * bends(*stiffest))
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
    const auto roughing = std::count_if(job.tools.begin(), job.tools.end(),
                                        [](const Tool& t) { return roughs_layers(t.kind); });
    return roughing > 1 || several(ToolKind::ball);
}

double least_slab(const Tool& tool) {
    return tool.stepdown_min > 0 ? tool.stepdown_min : tool.stepdown_max / 2;
}

double shallow_step(const Tool& tool) { return std::min(tool.stepdown_max, 1.5 * least_slab(tool)); }

std::vector<Tool> rest_tools(const Job& job, const Tool& rough, double finish_diameter) {
    // What a flat reaches at a corner a smaller one reaches too, and so it is with balls: the smallest of
    // either kind leave no more than all together.
    const bool is_flat = rough.kind == ToolKind::flat;
    std::vector<Tool> rest;
    for (const Tool& tool : job.tools)
        if ((tool.kind == ToolKind::flat && tool.diameter < rough.diameter + (is_flat ? -kHair : kHair)) ||
            (has_ball_tip(tool.kind) && tip_diameter(tool) < finish_diameter - kHair))
            rest.push_back(tool);
    if (!is_flat && std::none_of(rest.begin(), rest.end(),
                                 [](const Tool& tool) { return tool.kind == ToolKind::flat; })) {
        const Tool* narrowest = nullptr;
        for (const Tool& tool : job.tools)
            if (tool.kind == ToolKind::flat && (narrowest == nullptr || tool.diameter < narrowest->diameter))
                narrowest = &tool;
        if (narrowest != nullptr) rest.push_back(*narrowest);
    }
    std::stable_sort(rest.begin(), rest.end(), [](const Tool& a, const Tool& b) {
        const double wide = tip_diameter(a), other = tip_diameter(b);
        return wide != other ? wide > other : a.kind < b.kind;
    });
    return rest;
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
    const auto has = [&](ToolKind kind) {
        return std::any_of(job.tools.begin(), job.tools.end(), [&](const Tool& t) { return t.kind == kind; });
    };
    const bool bull_nose = !has(ToolKind::flat) && has(ToolKind::bull_nose);
    tools.rough = fixed_tool(job, bull_nose ? ToolKind::bull_nose : ToolKind::flat, 0.5 * kInch);
    tools.finish = fixed_tool(job, ToolKind::ball, 0.25 * kInch);
    tools.rest = rest_tools(job, tools.rough, tools.finish.diameter);
    return tools;
}

}  // namespace slabwright
