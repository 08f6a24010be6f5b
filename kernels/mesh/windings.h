// Winding numbers of points: the solid that a mesh means is where they are not zero.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// How often the facets wind around each point (mm), counted along a ray to +z, so that an opening in the
/// base plane does not matter. A facet that a point lies on may count or not. One pass over the facets, for
/// few points. @throws Error(cancelled)
[[nodiscard]] std::vector<int> windings_at(Context& context, MeshView mesh,
                                           std::span<const std::array<double, 3>> points);

}  // namespace slabwright
