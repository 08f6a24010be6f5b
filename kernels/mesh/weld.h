// From facet corners to a mesh: equal corners become one vertex, edges find their neighbours.
#pragma once

#include <array>
#include <cstring>
#include <span>
#include <vector>

#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// Facets as they lie in memory, in a file that was read for one: corner c of facet f is three floats, in the
/// machine's byte order and not aligned, at data + f·stride_bytes + 12·c. Each is scaled and lowered in
/// double, then rounded to float.
struct FacetRecords {
    const char* data = nullptr;
    std::size_t count = 0, stride_bytes = 36;
    double mm_per_unit = 1, lowest_mm = 0;

    [[nodiscard]] Vec3f corner(std::size_t facet, std::size_t k) const noexcept {
        std::array<float, 3> p;
        std::memcpy(p.data(), data + facet * stride_bytes + 12 * k, sizeof p);
        if (mm_per_unit == 1 && lowest_mm == 0)
            return {p[0], p[1], p[2]};  // what follows would change nothing
        return {static_cast<float>(p[0] * mm_per_unit), static_cast<float>(p[1] * mm_per_unit),
                static_cast<float>(p[2] * mm_per_unit - lowest_mm)};
    }
};

/// Whether facets that follow each other share corners, as programs mostly write them: asked of a few places.
/// Where they do not, all work over the mesh goes all over the memory.
[[nodiscard]] bool neighbours_follow(const FacetRecords& facets);

/// The same facets in an order in which neighbours mostly follow each other: by the cells of a grid, in
/// Morton order, in which their first corners lie, and as they were within a cell. 36 bytes a facet, charged
/// by the caller.
/// @param box of their corners, scaled and lowered
[[nodiscard]] BulkVector<std::array<Vec3f, 3>> in_space(Context& context, const FacetRecords& facets,
                                                        const Box3& box);

/// Welds bit-exactly (−0 equals +0). Vertices are numbered by first use, facets keep their order and count,
/// degenerate ones included. Edges are paired one for one in opposite directions; where more than two facets
/// meet, each pair is chosen so that the solid lies between its facets (so sections stay closed); what finds
/// no partner is kNoFacet. An edge of no length (of a facet with two equal corners) has no partner either.
/// Where facets lie on one another at an edge (within a microradian), bodies are kept apart. Scratch: 26
/// bytes a facet on an ordinary mesh, charged; 60 bytes a facet together with the mesh.
/// @param facets finite once they are scaled
/// @param odd filled with what report_mesh() would otherwise search for, see pair_edges()
/// @throws Error(input, "mesh.too_large") over 715 827 882 facets
[[nodiscard]] Mesh weld_records(Context& context, const FacetRecords& facets,
                                std::vector<std::uint32_t>* odd = nullptr);
[[nodiscard]] Mesh weld(Context& context, std::span<const std::array<Vec3f, 3>> corners,
                        std::vector<std::uint32_t>* odd = nullptr);
/// The same; the corners are let go as soon as they are not needed any more: where neighbours follow each
/// other, once each block's are compared.
[[nodiscard]] Mesh weld_and_let_go(Context& context, BulkVector<std::array<Vec3f, 3>>&& corners,
                                   std::vector<std::uint32_t>* odd = nullptr);

/// Merges vertices nearer than `tolerance_mm` (each to the lowest index of its cluster; clusters are chained)
/// and pairs the edges again; facets left with two equal corners are removed. `merged` counts the vertices
/// that went; the others are numbered by first use.
/// @throws Error(usage, "weld.tolerance") unless the tolerance is positive and finite
struct ToleranceWeld {
    Mesh mesh;
    std::uint64_t merged = 0, removed_facets = 0;
};
[[nodiscard]] ToleranceWeld weld_within(Context& context, MeshView mesh, double tolerance_mm);

/// Fills `neighbours` from `facets` (as weld() does). `odd` is filled with the lower ends, ascending, of all
/// edges about which report_mesh() might have something to say (and some more): on a good mesh with next to
/// nothing.
void pair_edges(Context& context, Mesh& mesh, std::vector<std::uint32_t>* odd = nullptr);

}  // namespace slabwright
