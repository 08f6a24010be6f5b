#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/simulate/simulate.h"

namespace slabwright {

double SimulationReport::unreachable_mm2() const {
    std::uint64_t cells = 0;
    for (const LayerFindings& f : layers) cells += f.unreachable;
    return static_cast<double>(cells) * cell * cell;
}

Extreme SimulationReport::unreachable() const {
    Extreme most;
    for (const LayerFindings& f : layers)
        if (f.unreachable_left.size > most.size) most = f.unreachable_left;
    return most;
}

double SimulationReport::unmade_mm3() const {
    double sum = 0;
    for (const LayerFindings& f : layers) sum += f.unmade_mm3;
    return sum;
}

Extreme SimulationReport::unmade() const {
    Extreme most;
    for (const LayerFindings& f : layers)
        if (f.unmade.size > most.size) most = f.unmade;
    return most;
}

double jitter(std::size_t k) {
    const double steps = static_cast<double>(k) * 0.6180339887498949;
    return steps - std::floor(steps);
}

double simulation_cell(const std::vector<Tool>& tools, double cusp) {
    double ball = 0, any = 0;
    for (const Tool& t : tools) {
        if (t.kind == ToolKind::ball && (ball == 0 || t.diameter < ball)) ball = t.diameter;
        if (any == 0 || t.diameter < any) any = t.diameter;
    }
    const double radius = (ball > 0 ? ball : any) / 2;
    return std::clamp(std::sqrt(2 * radius * std::max(cusp, 1e-4)) / 2, 0.05, 1.0);
}

}  // namespace slabwright
