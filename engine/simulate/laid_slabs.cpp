#include "engine/simulate/laid_slabs.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "kernels/mesh/part.h"

namespace slabwright {

namespace {

constexpr double kBesideEnds = 0.01;  // mm
constexpr double kBeyond = 0.001;     // mm that rounding may put a section past its slab

}  // namespace

void lay_slab(Stock& stock, const SimulatedLayer& layer) {
    if (layer.blank) stock.add_slab(layer.z_bottom, layer.slab_thickness, layer.blank->min, layer.blank->max);
    else stock.add_slab(layer.z_bottom, layer.slab_thickness);
}

Mesh flask_walls(const std::vector<SimulatedLayer>& layers, std::size_t layer) {
    Mesh walls;
    for (std::size_t l = layer > 0 ? layer - 1 : 0; l <= layer; ++l) {
        const auto low = static_cast<float>(layers[l].z_bottom), high = static_cast<float>(layers[l].z_top);
        for (std::size_t k = 0; k < layers[l].flask.size(); ++k) {
            const auto loop = layers[l].flask.loop(k);
            for (std::size_t i = 0; i < loop.size(); ++i) {
                const auto first = static_cast<std::uint32_t>(walls.vertices.size());
                for (const Point2 p : {loop[i], loop[(i + 1) % loop.size()]})
                    for (const float z : {low, high})
                        walls.vertices.push_back(
                            {static_cast<float>(to_mm(p.x)), static_cast<float>(to_mm(p.y)), z});
                walls.facets.push_back({first, first + 2, first + 3});
                walls.facets.push_back({first, first + 3, first + 1});
            }
        }
    }
    return walls;
}

double laid_top(const SimulatedLayer& layer, const CellGrid& grid) {
    const auto covers = [&](std::size_t k, double first, int count) {
        // Of the cells from the slab's begin on the first.
        const double begin = std::max(0.0, std::ceil((layer.blank->min[k] - first) / grid.cell - 1e-9));
        return begin < count && first + begin * grid.cell <= layer.blank->max[k] + 1e-9;
    };
    const bool laid = !layer.blank || (covers(0, grid.x0, grid.nx) && covers(1, grid.y0, grid.ny));
    return layer.z_bottom + (laid ? layer.slab_thickness : 0);
}

std::vector<Violation> blanks_too_small(Context& context, const SimulationInput& input) {
    std::vector<std::array<double, 2>> ranges;
    for (const SimulatedLayer& layer : input.layers) {
        const double beside = std::min(kBesideEnds, (layer.z_top - layer.z_bottom) / 4);
        ranges.push_back({layer.z_bottom + beside, layer.z_top - beside});
    }
    const std::vector<PlanBox> boxes = boxes_between(context, input.mesh, ranges);
    std::vector<Violation> found;
    for (std::size_t l = 0; l < boxes.size(); ++l) {
        if (!input.layers[l].blank || boxes[l].is_empty()) continue;
        const Blank& blank = *input.layers[l].blank;
        double beyond = 0;
        for (std::size_t k = 0; k < 2; ++k)
            beyond = std::max({beyond, blank.min[k] - boxes[l].min[k], boxes[l].max[k] - blank.max[k]});
        if (beyond > kBeyond)
            found.push_back(
                {"stack.blank",
                 fmt::format("layer {}: the pattern reaches {:.3f} mm past its slab", l + 1, beyond),
                 "",
                 0,
                 {},
                 beyond,
                 l});
    }
    return found;
}

}  // namespace slabwright
