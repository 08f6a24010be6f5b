#include "engine/tools/tools.h"

#include <algorithm>
#include <cmath>

namespace slabwright {

namespace {

const Tool* smallest(const Job& job, ToolKind kind) {
    const Tool* found = nullptr;
    for (const Tool& tool : job.tools)
        if (tool.kind == kind && (!found || tool.diameter < found->diameter)) found = &tool;
    return found;
}

// The tool of a kind that is as wide as LUO's fixed set has it, else the first of its kind.
const Tool& fixed_tool(const Job& job, ToolKind kind, double diameter) {
    for (const Tool& tool : job.tools)
        if (tool.kind == kind && std::abs(tool.diameter - diameter) < 1e-3) return tool;
    return tool_of_kind(job, kind);
}

}  // namespace

std::vector<Tool> rest_tools(const Job& job, double rough_diameter, double finish_diameter) {
    // What a flat reaches at a corner a smaller one reaches too, and so it is with balls: the smallest of either kind leave no more
    // than all together. Those between would save a few passes and cost a change of tool each.
    std::vector<Tool> rest;
    if (const Tool* flat = smallest(job, ToolKind::flat); flat && flat->diameter < rough_diameter - 1e-9) rest.push_back(*flat);
    if (const Tool* ball = smallest(job, ToolKind::ball); ball && ball->diameter < finish_diameter - 1e-9) rest.push_back(*ball);
    std::stable_sort(rest.begin(), rest.end(), [](const Tool& a, const Tool& b) { return a.diameter > b.diameter; });
    return rest;
}

LayerTools fixed_tools(const Job& job) {
    LayerTools tools;
    tools.rough = fixed_tool(job, ToolKind::flat, 0.5 * kInch);
    tools.finish = fixed_tool(job, ToolKind::ball, 0.25 * kInch);
    tools.rest = rest_tools(job, tools.rough.diameter, tools.finish.diameter);
    return tools;
}

}  // namespace slabwright
