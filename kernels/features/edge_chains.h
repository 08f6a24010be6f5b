// Sharp edges of a mesh, joined to chains (FINISH 3.2; METHOD.md section 3).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "kernels/geometry/vectors.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// Mesh edges one after another, all convex or all concave. It ends where no other sharp edge goes on, where
/// several do, or where the kind changes.
struct EdgeChain {
    bool convex = false;                  ///< the solid is on the inside of the bend
    bool closed = false;                  ///< its end meets its beginning
    std::vector<std::uint32_t> vertices;  ///< in their order; of a closed one the first is not repeated
    std::vector<std::array<std::uint32_t, 2>> sides;  ///< of each edge in turn: the facets beside it
    double length_mm = 0;
    double sharpest_deg = 0;  ///< the most by which faces turn at it; 90 at a cube's edge
    Point3 at{};              ///< the middle of that edge
};

/// The edges at which faces turn by at least `least_deg`. Edges of facets too thin for a normal, or inside
/// the solid, are none, and neither are lines along which bodies cut each other without a common edge. The
/// longest first (ties: by the first vertex). The same on any number of threads.
/// @throws Error(usage, "edges.limit") unless the limit is 1 to 179 degrees, Error(cancelled)
[[nodiscard]] std::vector<EdgeChain> find_edge_chains(Context& context, MeshView mesh, double least_deg = 30);

}  // namespace slabwright
