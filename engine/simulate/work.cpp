#include "engine/simulate/work.h"

#include <algorithm>

namespace slabwright {

SimulationWork simulation_work(const SimulationSize& size) {
    // Fitted to plans of the metre pattern (1 350 000 mm² of stock, 0.1 to 10 M facets, points every 0.25 and
    // 0.5 mm); bench/time_left_bench shows what comes of it there and elsewhere. A step is checked against
    // the facets about it; a point of the stock is made and judged once a layer and cut as often as cutters
    // pass over it; the facets are the surface that it is judged by.
    constexpr double kStep = 0.55,
                     kFacetsAbout = 0.18;  // checking; the second by the facets of a square millimetre
    constexpr double kPoint = 0.028, kSwept = 0.0027, kStepOver = 0.45, kFacet = 1.1;  // cutting
    const double steps = static_cast<double>(size.steps), facets = static_cast<double>(size.facets),
                 stock = std::max(1.0, size.stock_mm2);
    const double cell_mm2 = std::max(1e-4, size.cell_mm * size.cell_mm);
    return {steps * (kStep + kFacetsAbout * facets / stock),
            kPoint * stock / cell_mm2 * static_cast<double>(size.layers) +
                kSwept * size.swept_mm2 / cell_mm2 + kStepOver * steps + kFacet * facets};
}

}  // namespace slabwright
