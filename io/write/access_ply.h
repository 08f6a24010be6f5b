// PLY out: the facets that are to be machined in a layer, with the share of each that a tool reaches.
#pragma once

#include <span>
#include <string>

#include "kernels/mesh/mesh.h"

namespace slabwright {

/// Binary, little endian, for any viewer of meshes: vertices x, y, z in mm, as the mesh has them; faces with
/// `vertex_indices`, `reached` (a float, 0 to 1), `facet` (its number in the mesh), and red, green, blue:
/// from orange where nothing is reached to blue where all is. Facets whose share is negative are left out,
/// and the vertices that only they have.
/// @param shares per facet of the mesh
/// @param comment one line, for the header
/// @throws Error(usage, "access_ply.shares") when there are not as many shares as facets
[[nodiscard]] std::string access_ply(MeshView mesh, std::span<const float> shares,
                                     const std::string& comment);

}  // namespace slabwright
