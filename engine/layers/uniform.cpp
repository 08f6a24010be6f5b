// The control: layers of one thickness, whatever the pattern looks like (LUO figures 4.3 and 4.21).
#include "engine/layers/rules.h"

namespace slabwright {

LayerPlacement place_layers_uniform(const LayerRequest& request) {
    const LayerRules rules(request);
    LayerPlacement placement;
    Ticks below = 0;
    for (Ticks z = rules.max_layer(); z < rules.height() - kSame; z += rules.max_layer()) {
        placement.boundaries.push_back({static_cast<double>(z) / kTicksPerMm, 0, rules.describe(below, z)});
        below = z;
    }
    placement.boundaries.push_back({request.height, 0, rules.describe(below, rules.height())});
    finish_placement(rules, placement);
    return placement;
}

LayerPlacement place_layers(LayerStrategy strategy, const LayerRequest& request) {
    switch (strategy) {
        case LayerStrategy::printed:
            return place_layers_printed(request);
        case LayerStrategy::uniform:
            return place_layers_uniform(request);
        case LayerStrategy::optimal:
        case LayerStrategy::combined:
            break;
    }
    return place_layers_optimal(request);
}

}  // namespace slabwright
