// The triangle mesh: float32 vertices welded bit-exactly, uint32 indices, adjacency across edges.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "kernels/geometry/vectors.h"
#include "kernels/mesh/bulk_memory.h"

namespace slabwright {

class Context;

/// Three vertex (or facet) indices.
using Index3 = std::array<std::uint32_t, 3>;

/// No facet lies across this edge: the mesh is open there.
inline constexpr std::uint32_t kNoFacet = 0xFFFFFFFFu;

/// What a facet is to the solid that its mesh means: where the winding number is not zero.
enum class FacetRole : std::uint8_t {
    surface,  ///< the solid lies behind it, and nothing in front of it
    turned,   ///< the solid lies in front of it, and nothing behind it: of a body that is inside out
    unsure,   ///< it meets other facets, so that it may be part of the surface with either side
    inner,    ///< the solid lies on both sides
};

/// Borrowed arrays of a mesh. Facets are counter-clockwise seen from outside.
struct MeshView {
    std::span<const Vec3f> vertices;  ///< mm, frame `pattern-base` (z = 0 at the pattern's bottom)
    std::span<const Index3> facets;
    /// neighbours[f][k] is the facet across the edge (facets[f][k], facets[f][(k + 1) % 3]), or kNoFacet.
    std::span<const Index3> neighbours;
    /// Of every facet, as facet_roles() tells them; none: all are surface.
    std::span<const FacetRole> roles = {};

    [[nodiscard]] FacetRole role(std::size_t facet) const {
        return roles.empty() ? FacetRole::surface : roles[facet];
    }
    [[nodiscard]] std::size_t size() const noexcept { return facets.size(); }
};

struct Box3 {
    Vec3f min, max;
};

/// Note that resize() leaves new elements indeterminate.
struct Mesh {
    BulkVector<Vec3f> vertices;
    BulkVector<Index3> facets;
    BulkVector<Index3> neighbours;
    BulkVector<FacetRole> roles;  ///< none: all are surface

    [[nodiscard]] MeshView view() const noexcept { return {vertices, facets, neighbours, roles}; }
};

/// Bounding box of the vertices that facets use; all zeros for an empty mesh.
[[nodiscard]] Box3 bounds(MeshView mesh);
/// The same, in parallel.
[[nodiscard]] Box3 bounds(Context& context, MeshView mesh);

}  // namespace slabwright
