// LUO's sample part for layer placement (LUO 4.3.1, figure 4.18), built from the heights of its table 4.1.
#pragma once

#include <array>
#include <vector>

#include "kernels/mesh/mesh.h"

namespace slabwright {

/// A closed part on z = 0 in millimetres, 4.3 × 2.0 × 1.5 in, whose features lie where table 4.1 designs them
/// (inches): up-facing flats .300 .700 1.000 1.180 1.500; a down-facing flat 1.200, the underside of a tee; a
/// round ridge .650 whose facets under 15° reach down to .624 on either side (small slope surfaces 1 and 4);
/// ramps under 15° from .516 to .523 and from .652 to .744 (surfaces 2 and 3); a sharp ridge .805; a pit
/// .755, sharp at its bottom, so that it adds no shallow surface that the table does not have. The drawing is
/// not published, only these heights; plan and lengths are ours. Arcs deviate by .00073 in.
[[nodiscard]] std::vector<std::array<Vec3f, 3>> luo_layer_sample();

}  // namespace slabwright
