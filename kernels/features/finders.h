// The finders that find_features() joins, one file each. Internal to features.
#pragma once

#include <span>
#include <vector>

#include "kernels/features/facet_classes.h"
#include "kernels/features/features.h"

namespace slabwright {

/// up_flat or down_flat (never the base), or nothing when the patch is a single facet narrower than the chordal
/// deviation: what repair programs add is no feature (LUO 4.2.3). Takes the patches' facets.
[[nodiscard]] std::vector<Feature> find_flats(MeshView mesh, std::vector<Patch>& patches, const FeatureOptions& options);
/// Type III: patches under the slope limit that are not horizontal.
[[nodiscard]] std::vector<Feature> find_shallow(MeshView mesh, std::vector<Patch>& patches);
/// Down-facing patches that are not horizontal.
[[nodiscard]] std::vector<Feature> find_undercuts(MeshView mesh, std::vector<Patch>& patches);

/// Peaks, valleys and saddles of the mesh by the signs around every vertex and plateau. Plateaus with a flat (of either kind)
/// are left out, and so is what differs by `flat_reach` or less (mm) from an up-facing flat that its facets touch.
[[nodiscard]] std::vector<Feature> find_exact(Context& context, MeshView mesh, std::span<const Feature> flats, double flat_reach);

/// Peaks, valleys and saddles by LUO's halving search.
[[nodiscard]] std::vector<Feature> find_halving(Context& context, MeshView mesh, const FeatureOptions& options);

/// Removes the features of `points` that lie within `reach_z` in height and `reach_xy` in plan of an up-facing flat.
void drop_near_flats(Context& context, MeshView mesh, std::span<const Feature> flats, double reach_z, double reach_xy, std::vector<Feature>& points);

}  // namespace slabwright
