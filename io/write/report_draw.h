// Which facets of the report's picture keep the pattern from being drawn.
#pragma once

#include <string>

#include "kernels/features/draw.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// check_draw() with its usual limits; without thin walls (limits.thin_mm = 0) where the context's memory
/// does not suffice to look for them.
/// @throws Error(no_plan, "memory.limit") where it does not suffice for the rest, Error(cancelled)
[[nodiscard]] DrawReport draw_within_memory(Context& context, MeshView mesh);

/// For every facet of the picture what the facet of the pattern is that lies nearest to its middle: 0 nothing
/// of it, 1 little draft, 2 undercut to the draw, 3 a thin wall. Empty where the context's memory does not
/// suffice.
/// @param report of the mesh @param model of the mesh, decimated
[[nodiscard]] std::string draw_codes(Context& context, MeshView mesh, const DrawReport& report,
                                     MeshView model);

}  // namespace slabwright
