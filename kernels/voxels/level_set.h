// Surfaces that are made anew on a sparse grid: of a solid that is known by its winding number, and at a
// distance outside of a solid.
#pragma once

#include <array>
#include <cstdint>
#include <functional>

#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// The winding number about a point, mm. Called from many threads at once.
using WindingField = std::function<double(const std::array<double, 3>&)>;

struct LevelSetOptions {
    double cell_mm = 1;
    /// Cells that lie in one plane are merged where their normals differ by no more than this, 0 to 1.
    double adaptivity = 0;
    std::uint64_t most_cells = 64'000'000;  ///< sampled; 24 bytes each, charged
};

/// The border of the points whose winding number is half or more, either way. Cells are sampled near the
/// mesh, and from there along the border wherever it leaves the mesh, across holes. Near the mesh the border
/// lies on it (as distances tell, so a smooth surface is met far more closely than by a cell, and an edge is
/// rounded by about a third of one); across a hole it lies where the winding number is a half. What is
/// thinner than a cell may be lost. Deterministic.
/// @param near the mesh, closed or not
/// @returns a closed surface with vertices and facets, no neighbours; empty where nothing is enclosed
/// @throws Error(no_plan, "repair.cells") when more cells than most_cells would be needed, "memory.limit",
/// Error(cancelled)
[[nodiscard]] Mesh surface_of_winding(Context& context, MeshView near, const WindingField& winding,
                                      const LevelSetOptions& options);

struct OffsetSurfaceOptions {
    double distance_mm = 1;
    double cell_mm = 0.5;
};

/// The distance of a point from the facets of a mesh, mm, without a sign. Called from many threads at once.
using DistanceField = std::function<double(const std::array<double, 3>&)>;

/// The points outside of a solid at this distance from its facets. On the grid distances are exact; between
/// its points the surface may lie nearer by 3·cell² / (8·distance), and in creases farther by a third of a
/// cell: what is asked of it must be measured on it. Deterministic. Some 8 bytes for each cell of the band
/// between solid and surface, which the caller charges.
/// @param mesh closed. Where it crosses itself its inner walls lie inside
/// @param distance from the mesh. OpenVDB's own, several cells from it, is that of facets which are nearest
/// to cells beside, and by up to half a cell too great
/// @returns a closed surface with vertices and facets, no neighbours
/// @throws Error(cancelled)
[[nodiscard]] Mesh offset_surface(Context& context, MeshView mesh, const DistanceField& distance,
                                  const OffsetSurfaceOptions& options);

}  // namespace slabwright
