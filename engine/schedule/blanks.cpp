#include "engine/schedule/blanks.h"

#include <algorithm>
#include <cmath>

#include "kernels/mesh/part.h"

namespace slabwright {

namespace {

/// mm from a layer's ends, where faces that lie at the joint belong to the layer beside it.
constexpr double kBesideEnds = 0.01;
constexpr double kSawn = 1;  // mm: sizes are whole ones

}  // namespace

void saw_blanks(Context& context, MeshView mesh, Plan& plan) {
    for (Layer& layer : plan.layers) layer.blank.reset();
    if (plan.job.slabs.blanks != Blanks::layer || plan.job.flask.enabled) return;
    std::vector<std::array<double, 2>> ranges;
    for (const Layer& layer : plan.layers) {
        const double beside = std::min(kBesideEnds, (layer.z_top - layer.z_bottom) / 4);
        ranges.push_back({layer.z_bottom + beside, layer.z_top - beside});
    }
    const std::vector<PlanBox> boxes = boxes_between(context, mesh, ranges);
    for (std::size_t i = 0; i < boxes.size(); ++i) {
        if (boxes[i].is_empty()) continue;  // nothing of it stays
        Blank& blank = plan.layers[i].blank.emplace();
        for (std::size_t k = 0; k < 2; ++k) {
            const double low = plan.stock_min[k], high = plan.stock_max[k];
            const double begin = std::max(low, boxes[i].min[k] - plan.job.slabs.margin),
                         end = std::min(high, boxes[i].max[k] + plan.job.slabs.margin);
            const double size = std::min(high - low, std::ceil((end - begin) / kSawn - 1e-9) * kSawn);
            // What rounding adds goes beyond its end, or before its begin where the stock ends there.
            blank.min[k] = std::max(low, std::min(begin, high - size));
            blank.max[k] = std::min(high, blank.min[k] + size);
        }
    }
}

std::vector<Blank> slabs_of(const Plan& plan) {
    std::vector<Blank> slabs;
    for (const Layer& layer : plan.layers) slabs.push_back(slab_of(plan, layer));
    return slabs;
}

}  // namespace slabwright
