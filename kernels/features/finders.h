// The finders that find_features() joins, one file each. Internal to features.
#pragma once

#include <span>
#include <vector>

#include "kernels/features/facet_classes.h"
#include "kernels/features/features.h"

namespace slabwright {

/// up_flat or down_flat (never the base), or nothing when the patch is a single facet narrower than the
/// chordal deviation: what repair programs add is no feature (LUO 4.2.3). Takes the patches' facets.
[[nodiscard]] std::vector<Feature> find_flats(Context& context, MeshView mesh, std::vector<Patch>& patches,
                                              const FeatureOptions& options);
/// Type III: patches under the slope limit that are not horizontal.
[[nodiscard]] std::vector<Feature> find_shallow(Context& context, MeshView mesh, std::vector<Patch>& patches);
/// Down-facing patches that are not horizontal.
[[nodiscard]] std::vector<Feature> find_undercuts(Context& context, MeshView mesh,
                                                  std::vector<Patch>& patches);

/// The facets around every vertex, those with two equal corners left out, and the plateaus: vertices of one
/// height that edges join.
struct VertexStars {
    std::vector<std::uint32_t> starts;
    BulkVector<std::uint32_t> facets;  ///< those around vertex v, ascending, are [starts[v], starts[v + 1])
    BulkVector<std::uint32_t> lowest;  ///< clusters of the vertices (kernels/mesh/clusters.h): each a plateau
    std::vector<std::uint8_t> level;   ///< 1 for a vertex of a plateau, 0 for one that is alone at its height
    static constexpr std::uint64_t bytes(MeshView mesh) {
        return 12 * mesh.facets.size() + 19 * mesh.vertices.size();
    }  ///< with what find_exact adds
    [[nodiscard]] std::span<const std::uint32_t> around(std::uint32_t v) const {
        return std::span(facets).subspan(starts[v], starts[v + 1] - starts[v]);
    }
};
[[nodiscard]] VertexStars vertex_stars(Context& context, MeshView mesh);

/// Peaks, valleys and saddles of the mesh by the signs around every vertex and plateau. Plateaus with a flat
/// (of either kind) are left out, and so is what differs by `flat_reach` or less (mm) from an up-facing flat
/// that its facets touch.
[[nodiscard]] std::vector<Feature> find_exact(Context& context, MeshView mesh, VertexStars stars,
                                              std::span<const Feature> flats, double flat_reach);

/// Peaks, valleys and saddles by LUO's halving search.
[[nodiscard]] std::vector<Feature> find_halving(Context& context, MeshView mesh,
                                                const FeatureOptions& options);

/// Removes the features of `points` that lie within `reach_z` in height and `reach_xy` in plan of an
/// up-facing flat.
void drop_near_flats(Context& context, MeshView mesh, std::span<const Feature> flats, double reach_z,
                     double reach_xy, std::vector<Feature>& points);

}  // namespace slabwright
