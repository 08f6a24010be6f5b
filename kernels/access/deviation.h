// How far two surfaces lie apart.
#pragma once

#include "kernels/access/standing_part.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// The greatest distance, mm, from every vertex and facet middle of each mesh to the other's surface. A
/// measurement at those points, not a bound between them. 0 when either has no facets.
[[nodiscard]] double surface_deviation(Context& context, const StandingPart& a, const StandingPart& b);

}  // namespace slabwright
