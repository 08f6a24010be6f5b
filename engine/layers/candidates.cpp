#include "engine/layers/candidates.h"

#include <algorithm>
#include <cmath>

#include "engine/layers/tool_map.h"

namespace slabwright {

namespace {

bool same_tops(const LayerPlacement& a, const LayerPlacement& b) {
    return std::equal(a.boundaries.begin(), a.boundaries.end(), b.boundaries.begin(), b.boundaries.end(),
                      [](const Boundary& x, const Boundary& y) { return std::abs(x.z - y.z) < kSameHeight; });
}

}  // namespace

std::vector<LayerCandidate> layer_candidates(Context& context, MeshView mesh, const Job& job,
                                             const LayerRequest& request) {
    std::vector<LayerCandidate> tried;
    tried.push_back({"optimal", request.max_layer, place_layers_optimal(request)});
    const LayerCost usual = tried[0].placement.cost;
    const auto add = [&](const char* name, double max_layer, LayerPlacement placement, bool any) {
        if (!any && (placement.cost.broken_type2 > usual.broken_type2 ||
                     placement.cost.broken_type1 > usual.broken_type1 ||
                     placement.cost.thin_layers > usual.thin_layers))
            return;
        for (const LayerCandidate& t : tried)
            if (same_tops(t.placement, placement)) return;
        tried.push_back({name, max_layer, std::move(placement)});
    };
    add("printed", request.max_layer, place_layers_printed(request), true);
    LayerRequest bonded = request;
    bonded.max_layer = max_bonded_layer_thickness(job);
    add("bonded slabs", bonded.max_layer, place_layers_optimal(bonded), false);
    const ToolMap map = tool_map(context, mesh, job, request.features);
    const std::vector<ToolSlice> layers = join_slices(map.slices, map.allowed_mm, request.min_layer);
    bonded.max_layer = max_layer_of_longest(job);
    add("layers by tools", bonded.max_layer, place_layers_by_tools(bonded, layers, map.allowed_mm), false);
    return tried;
}

}  // namespace slabwright
