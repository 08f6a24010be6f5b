#include "engine/layers/tool_map.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/forces/cuts.h"
#include "kernels/access/printed_accessibility.h"
#include "kernels/errors.h"
#include "kernels/forces/deflection.h"

namespace slabwright {

namespace {

constexpr double kThinnestSlice = 1.27;  // mm, LUO's .05 in
constexpr double kSlices = 64;

}  // namespace

double allowed_layer(const Job& job, const Tool& tool) {
    const double across = (tool.kind == ToolKind::ball ? reference_forces(hardest_cut(job, tool, tool.stepdown_max))
                                                       : closed_form_forces(hardest_cut(job, tool, tool.stepdown_max)))
                              .peak_y_n;
    const double length = std::min(tool.flute_length, allowed_tool_length(across, job.tolerances.cusp, tool.diameter));
    const double steepest = job.cutting.vertical_deg * std::numbers::pi / 180;
    const double overrun = tool.kind == ToolKind::ball ? tool.diameter / 2 * (1 - std::cos(steepest)) : 0;
    return std::max(job.layers.min_layer, length - overrun - job.cutting.holder_clearance);
}

ToolMap tool_map(Context& context, MeshView mesh, const Job& job, const std::vector<Feature>& features) {
    ToolMap map;
    for (const Tool& tool : job.tools)
        if (tool.kind == ToolKind::ball) map.tools.push_back(tool);
    if (map.tools.empty()) (void)tool_of_kind(job, ToolKind::ball);  // throws
    std::stable_sort(map.tools.begin(), map.tools.end(), [](const Tool& a, const Tool& b) { return a.diameter < b.diameter; });
    for (const Tool& tool : map.tools) map.allowed_mm.push_back(allowed_layer(job, tool));
    const double height = bounds(mesh).max.z;
    if (map.tools.size() == 1) {
        map.slices.push_back({0, height, 0});
        return map;
    }
    std::vector<double> heights{0, height};
    const double step = std::max(kThinnestSlice, height / kSlices);
    for (double z = step; z < height - 0.5 * step; z += step) heights.push_back(z);
    for (const Feature& f : features)
        if (f.type == FeatureType::up_flat || f.type == FeatureType::down_flat) heights.push_back(std::clamp<double>(f.z_low, 0, height));
    std::sort(heights.begin(), heights.end());
    heights.erase(std::unique(heights.begin(), heights.end(), [](double a, double b) { return b - a < 0.1; }), heights.end());
    if (height - heights.back() > 0) heights.back() = height;  // the last of near ones stays the pattern's height

    for (std::size_t i = 0; i + 1 < heights.size(); ++i) {
        std::size_t chosen = 0;
        for (std::size_t t = map.tools.size(); t-- > 1;) {
            context.throw_if_cancelled();
            if (printed_accessibility(context, mesh, heights[i], heights[i + 1], map.tools[t].diameter / 2, job.selection.overlap_weight, 1).ratio() <
                job.selection.threshold)
                continue;
            chosen = t;
            break;
        }
        map.slices.push_back({heights[i], heights[i + 1], chosen});
    }
    return map;
}

}  // namespace slabwright
