// How long a simulation takes, foretold from what is known before it: by this progress is divided, and
// nothing else.
#pragma once

#include <cstddef>
#include <cstdint>

namespace slabwright {

/// What a simulation works through.
struct SimulationSize {
    std::uint64_t steps = 0;  ///< of all programs
    double swept_mm2 = 0;     ///< lengths cut times the diameters of their cutters
    double stock_mm2 = 0;     ///< plan view
    double cell_mm = 0;       ///< between the points of the stock
    std::size_t layers = 0, facets = 0;
};

/// Microseconds of processor time on the machine of bench/RESULTS.md. Only their ratio is of use elsewhere.
struct SimulationWork {
    double checking = 0, cutting = 0;
};
[[nodiscard]] SimulationWork simulation_work(const SimulationSize& size);

}  // namespace slabwright
