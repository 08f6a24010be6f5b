#include "engine/layers/tool_map.h"

#include <algorithm>
#include <cmath>

#include "engine/forces/cuts.h"
#include "kernels/errors.h"
#include "kernels/forces/deflection.h"
#include "kernels/parallel/parallel.h"
#include "kernels/polygons/loops.h"
#include "kernels/slicing/slicing.h"

namespace slabwright {

namespace {

constexpr double kThinnestSlice = 1.27;  // mm, LUO's .05 in
constexpr double kSlices = 64;
constexpr double kTouch = 0.05;  // mm: a wall so near to what the tool leaves is reached
constexpr double kSample = 0.5;  // mm, along walls

// The share of a section's border that a disc of this radius reaches from outside: what it leaves standing is
// the section closed by it, and a place is reached where that has its border too.
double reached_share(const Loops& section, double radius) {
    constexpr double tolerance = kTouch / 25;
    const Loops left = offset(offset(section, radius, tolerance), -radius - kTouch, tolerance);
    double all = 0, inside = 0;
    for (std::size_t l = 0; l < section.size(); ++l) {
        const auto loop = section.loop(l);
        for (std::size_t i = 0; i < loop.size(); ++i) {
            const Point2 a = loop[i], b = loop[i + 1 < loop.size() ? i + 1 : 0];
            const double length = std::hypot(to_mm(std::int64_t{b.x} - a.x), to_mm(std::int64_t{b.y} - a.y));
            const int parts = std::max(1, static_cast<int>(std::ceil(length / kSample)));
            all += length;
            for (int k = 0; k < parts; ++k) {
                const double t = (k + 0.5) / parts;
                const Point2 p{static_cast<std::int32_t>(std::lround(a.x + t * (double{1} * b.x - a.x))),
                               static_cast<std::int32_t>(std::lround(a.y + t * (double{1} * b.y - a.y)))};
                if (winding(left, p) != 0) inside += length / parts;
            }
        }
    }
    return all > 0 ? 1 - inside / all : 1;
}

}  // namespace

double allowed_layer(const Job& job, const Tool& tool) {
    const double across =
        (tool.kind == ToolKind::ball ? reference_forces(hardest_cut(job, tool, tool.stepdown_max))
                                     : closed_form_forces(hardest_cut(job, tool, tool.stepdown_max)))
            .peak_y_n;
    Tool short_enough = tool;
    short_enough.flute_length =
        std::min(tool.flute_length,
                 allowed_tool_length(across, job.tolerances.cusp, tool.diameter, 1e3 * tool.modulus_gpa));
    return std::max(job.layers.min_layer, max_layer_of(job, short_enough));
}

ToolMap tool_map(Context& context, MeshView mesh, const Job& job, const std::vector<Feature>& features) {
    ToolMap map;
    for (const Tool& tool : job.tools)
        if (tool.kind == ToolKind::ball) map.tools.push_back(tool);
    if (map.tools.empty()) (void)tool_of_kind(job, ToolKind::ball);  // throws
    std::stable_sort(map.tools.begin(), map.tools.end(),
                     [](const Tool& a, const Tool& b) { return a.diameter < b.diameter; });
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
        if (f.type == FeatureType::up_flat || f.type == FeatureType::down_flat)
            heights.push_back(std::clamp<double>(f.z_low, 0, height));
    std::sort(heights.begin(), heights.end());
    heights.erase(std::unique(heights.begin(), heights.end(), [](double a, double b) { return b - a < 0.1; }),
                  heights.end());
    if (height - heights.back() > 0)
        heights.back() = height;  // the last of near ones stays the pattern's height

    std::vector<Plane> planes;
    for (std::size_t i = 0; i + 1 < heights.size(); ++i)
        planes.push_back({(heights[i] + heights[i + 1]) / 2, Side::above});
    const std::vector<Section> sections = slice(context, mesh, planes, {job.tolerances.gap});
    map.slices.resize(planes.size());
    parallel_each(context, planes.size(), [&](std::size_t i) {
        std::size_t chosen = map.tools.size() - 1;
        while (chosen > 0 &&
               reached_share(sections[i].loops, map.tools[chosen].diameter / 2) < job.selection.threshold)
            --chosen;
        map.slices[i] = {heights[i], heights[i + 1], chosen};
    });
    return map;
}

}  // namespace slabwright
