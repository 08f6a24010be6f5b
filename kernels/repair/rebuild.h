// A surface made anew around what the facets of a mesh enclose, for meshes that mending leaves open.
#pragma once

#include "kernels/mesh/mesh.h"
#include "kernels/mesh/report.h"
#include "kernels/parallel/context.h"

namespace slabwright {

struct RebuildOptions {
    /// mm between the points of the grid; 0: kWishedCell, finer for a small part, or as fine as memory and
    /// kMostCells allow.
    double cell_mm = 0;
};
/// An edge is rounded by less than half a cell, so this keeps the surface within a tenth of a millimetre, mm.
inline constexpr double kWishedCell = 0.25;
inline constexpr std::uint64_t kMostCells = 64'000'000;

struct Rebuilt {
    Mesh mesh;          ///< with neighbours; empty where the facets enclose nothing
    MeshReport report;  ///< on it
    bool solid = false;
    double cell_mm = 0;
    /// The farthest that a vertex or facet middle of the surface lies from the mesh, mm: across a hole it
    /// lies far. And of the mesh from the surface: what lies within the solid, or encloses nothing, is
    /// missed.
    double deviation_mm = 0, missed_mm = 0;
};

/// The border of all points about which the mesh's generalized winding number is half or more (see
/// WindingTree and surface_of_winding()). Deterministic. Some seconds for each ten million cells.
/// @param mesh oriented as well as can be (as mend() leaves it): what faces the wrong way encloses nothing
/// @param given that the deviation is measured against
/// @throws Error(no_plan, "repair.cells"), Error(no_plan, "memory.limit"), Error(cancelled)
[[nodiscard]] Rebuilt rebuild(Context& context, MeshView mesh, MeshView given,
                              const RebuildOptions& options = {});

}  // namespace slabwright
