// How steep a pattern is, and where (LUO 5.4; METHOD.md section 5).
#pragma once

#include <vector>

#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// Slopes of the facets that face upwards or are upright: 0° is flat, 90° vertical.
struct SlopeProfile {
    double z_low = 0, z_high = 0;   ///< mm, of the vertices
    std::vector<double> least_deg;  ///< the α-map: the least slope of the facets that meet each of the equal
                                    ///< steps of z; 90 where there are none
    std::vector<double> area_mm2;   ///< area by degree of slope: [0, 1), … [89, 90]
    double down_flat_mm2 = 0;       ///< horizontal, facing down (the base among them)
    double undercut_mm2 = 0;        ///< facing down otherwise
};

/// @param steps of equal height, 1 or more. A facet within `horizontal_rad` of level or upright counts as
/// such; one that touches a
///        step in its border alone does not meet it. Flats under `least_flat_mm2` are left out of the α-map:
///        repair slivers.
[[nodiscard]] SlopeProfile slope_profile(Context& context, MeshView mesh, int steps,
                                         double horizontal_rad = 1e-4, double least_flat_mm2 = 1e-3);

}  // namespace slabwright
