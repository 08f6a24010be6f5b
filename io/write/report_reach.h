// Which facets of the report's picture some tool of the library reaches.
#pragma once

#include <string>

#include "engine/simulate/simulate.h"
#include "kernels/access/standing_part.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

inline constexpr double kReachDistance = 0.1;  ///< mm from the surface that a tool must come to reach it

/// For every facet of the picture: 0 faces down, 1 some tool reaches its middle, 2 none was found that does.
/// Facets that lie in one small cell and face about the same way share the answer of the first of them,
/// because a search without success is long.
struct ReachMap {
    std::string codes;
    double cell_mm = 0;
};

/// @param board mm that tools may go into the base board @param model of the part, decimated
[[nodiscard]] ReachMap reach_map(Context& context, const StandingPart& part, const SimulationInput& input,
                                 double board, MeshView model);

}  // namespace slabwright
