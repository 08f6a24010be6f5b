#include "engine/simulate/stack_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/simulate/laid_slabs.h"

namespace slabwright {

void check_stack(const SimulationStage& stage, SimulationReport& report) {
    const Box3 box = stage.part.box();
    const double tolerance = 10 * StandingPart::kSheet;
    const double over = box.max.z - stage.input.layers.back().z_top;
    if (over > tolerance && stage.options.whole)
        violate(report, "stack.short", fmt::format("the layers end {:.3f} mm below the pattern's top", over),
                nullptr, 0, Point3{box.max.x, box.max.y, box.max.z}, over);
    const double beyond =
        std::max({stage.input.stock_min[0] - box.min.x, stage.input.stock_min[1] - box.min.y,
                  box.max.x - stage.input.stock_max[0], box.max.y - stage.input.stock_max[1]});
    if (beyond > tolerance && stage.options.whole)
        violate(report, "stack.narrow", fmt::format("the pattern reaches {:.3f} mm past the slabs", beyond),
                nullptr, 0, {}, beyond);
    double below = 0;
    for (std::size_t l = 0; l < stage.input.layers.size(); ++l) {
        const SimulatedLayer& layer = stage.input.layers[l];
        if (std::abs(layer.z_bottom - below) > 1e-3)
            violate(report, "stack.gap",
                    fmt::format("layer {} begins at z {:.4f}, where the one below ends at {:.4f}", l + 1,
                                layer.z_bottom, below),
                    nullptr, 0, {}, layer.z_bottom - below);
        const double lacking = layer.z_top - layer.z_bottom - layer.slab_thickness;
        if (lacking > 1e-6)
            violate(report, "stack.thin",
                    fmt::format("layer {} is {:.4f} mm taller than its slab", l + 1, lacking), nullptr, 0, {},
                    lacking);
        below = layer.z_top;
    }
    for (Violation& v : blanks_too_small(stage.context, stage.input))
        report.violations.push_back(std::move(v));
}

}  // namespace slabwright
