#include "engine/tool_choice/reach_ratio.h"

#include <algorithm>
#include <cmath>

#include "kernels/access/printed_accessibility.h"

namespace slabwright {

ToolShape shape_of(const Tool& tool) {
    ToolShape shape;
    shape.cutter = cutter_shape(tool);
    shape.flute_length = tool.flute_length;
    shape.shank_radius = tool.shank_diameter / 2;
    shape.stickout = tool.stickout;
    shape.holder_radius = tool.holder_diameter / 2;
    if (tool.holder_profile.empty()) return shape;
    for (const ToolSection& s : cylinders_of(tool))
        if (s.above > tool.stickout) shape.holder.push_back({s.above, s.radius});
    return shape;
}

AccessOptions access_options(const Job& job, double lowest_tip) {
    AccessOptions options;
    options.tolerance = job.tolerances.cusp;
    options.lowest_tip = lowest_tip;
    return options;
}

namespace {

// AR without the digits that its likely error makes meaningless; not so far off that it would come to lie on
// the other side of a limit which decided (AccessOptions::limit).
double in_known_digits(const Accessibility& found) {
    if (!(found.likely_error > 0)) return found.ratio();
    const double digit = std::pow(10.0, std::floor(std::log10(found.likely_error)));
    return std::round(found.ratio() / digit) * digit;
}

}  // namespace

ReachRatio reach_ratio(Context& context, const LayerJob& layer, const AccessScene* scene) {
    if (layer.job->selection.accessibility == AccessRule::sections) return {};
    return [&context, &layer, scene](const Tool& tool) {
        const Job& job = *layer.job;
        if (job.selection.accessibility == AccessRule::printed)
            return printed_accessibility(context, layer.mesh, layer.z_bottom, layer.z_top, tool.diameter / 2,
                                         job.selection.overlap_weight)
                .ratio();
        auto ratio = [&](const Tool& t) {
            AccessOptions options = access_options(job, layer.floor_below);
            options.limit = job.selection.threshold;
            return in_known_digits(
                scene->accessible(context, layer.z_bottom, layer.z_top, shape_of(t), options));
        };
        double share = ratio(tool);
        if (tool.kind == ToolKind::ball && share < job.selection.threshold)
            for (const Tool& twin : job.tools)
                if (twin.kind == ToolKind::flat && std::abs(twin.diameter - tool.diameter) < 1e-3)
                    share = std::max(share, ratio(twin));
        return share;
    };
}

}  // namespace slabwright
