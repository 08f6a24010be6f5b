// PLY out: the pattern, coloured by what keeps it from being drawn.
#pragma once

#include <string>

#include "kernels/features/draw.h"
#include "kernels/mesh/mesh.h"

namespace slabwright {

/// Binary, little endian, for any viewer of meshes: vertices x, y, z in mm, as the mesh has them; faces with
/// `vertex_indices`, `draft` in degrees, `thickness` in mm where the wall is thin and else 0, and red, green,
/// blue: vermilion what is undercut to the draw, blue thin walls, yellow little draft, grey the rest.
/// @throws Error(usage, "draw_ply.report") when the report is of another mesh
[[nodiscard]] std::string draw_ply(MeshView mesh, const DrawReport& report, const std::string& comment);

}  // namespace slabwright
