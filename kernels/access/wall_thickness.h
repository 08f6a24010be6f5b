// How thick the solid is under its surface.
#pragma once

#include <cstdint>
#include <vector>

#include "kernels/geometry/vectors.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// What is thin of one facet.
struct ThinFacet {
    std::uint32_t facet = 0;
    float share = 0;         ///< of its area under which the solid is thinner than asked for
    float thickness_mm = 0;  ///< where it is thinnest
    Point3 at{};             ///< there, on the facet
};

/// Rays go from points of every facet straight into the solid until they leave it, where they may meet a
/// surface that faces away within 45°: so the edge of a block is not thin, however near its other face.
/// Points lie `spacing` apart on the whole, one on each facet at least. Where bodies
/// overlap the winding number tells solid from air; points where their faces coincide may be passed over.
/// Deterministic.
/// @param mesh with roles where bodies overlap
/// @param limit mm, over 0 @param spacing mm, over 0
/// @return by facet, those with a thin point
/// @throws Error(input, "mesh.not_finite"), Error(no_plan, "memory.limit"), Error(cancelled)
[[nodiscard]] std::vector<ThinFacet> thin_facets(Context& context, MeshView mesh, double limit,
                                                 double spacing);

}  // namespace slabwright
