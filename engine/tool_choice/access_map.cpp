#include "engine/tool_choice/access_map.h"

#include <algorithm>
#include <set>

#include "engine/tool_choice/reach_ratio.h"

namespace slabwright {

void access_maps(Context& context, MeshView mesh, const Plan& plan,
                 const std::function<void(const AccessMap&)>& take) {
    const AccessScene scene(context, mesh);
    const Overrun overrun = overrun_of(plan.job);
    for (const Layer& layer : plan.layers) {
        std::set<int> numbers;
        for (const Operation& operation : layer.operations) numbers.insert(operation.tool);
        if (layer.selection)
            for (const ToolCandidate& candidate : layer.selection->candidates) numbers.insert(candidate.tool);
        for (const int number : numbers) {
            const auto tool = std::find_if(plan.job.tools.begin(), plan.job.tools.end(),
                                           [&](const Tool& t) { return t.number == number; });
            if (tool == plan.job.tools.end() || !is_end_mill(tool->kind)) continue;
            AccessOptions options =
                access_options(plan.job, layer.z_bottom - (layer.index > 1 ? overrun.below : overrun.board));
            options.shares = true;
            take({layer.index, number,
                  scene.accessible(context, layer.z_bottom, layer.z_top, shape_of(*tool), options)});
        }
    }
}

}  // namespace slabwright
