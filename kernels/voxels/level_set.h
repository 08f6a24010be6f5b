// The surface of a solid that is known by its winding number, on a sparse grid.
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

}  // namespace slabwright
