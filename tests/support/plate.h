// A slab of one layer to be cut, 120 × 80 × 18 mm, and moves on it.
#pragma once

#include <cstdint>

#include "engine/plan.h"

namespace slabwright::test {

/// mm, and mm/min; 0: a rapid.
inline Move at(double x, double y, double z, std::uint32_t feed) {
    return {to_units(x), to_units(y), to_units(z), feed};
}

inline Plan plate() {
    Plan plan;
    plan.stock_min = {0, 0};
    plan.stock_max = {120, 80};
    plan.layers.resize(1);
    plan.layers[0].index = 1;
    plan.layers[0].z_top = 18;
    plan.layers[0].slab_thickness = 18;
    return plan;
}

}  // namespace slabwright::test
