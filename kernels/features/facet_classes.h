// How each facet faces, and the connected patches of facets that face alike. Internal to features.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "kernels/features/features.h"

namespace slabwright {

/// What a facet is to the features. `base` faces down in the lowest plane; `sliver` is so thin that its
/// normal is rounding noise: it belongs to no feature, but patches connect across it.
enum class FacetClass : std::uint8_t { other, base, sliver, up_flat, down_flat, shallow, undercut };

/// Heights nearer than this (mm) to the lowest z are the base.
inline constexpr double kBaseTolerance = 1e-3;

struct FacetClasses {
    std::vector<FacetClass> of;  ///< one per facet
    double z_base = 0;           ///< lowest z of the facets' corners
};

/// Twice the area times the outward unit normal, in double from the float corners.
[[nodiscard]] Vec3d area_normal(MeshView mesh, std::uint32_t facet);

/// The facet's corners counter-clockwise seen from outside the solid that the mesh means (FacetRole::turned).
[[nodiscard]] Index3 outward(MeshView mesh, std::uint32_t facet);
/// Twice the area over the longest edge: the facet's smallest height, mm.
[[nodiscard]] double smallest_height(MeshView mesh, std::uint32_t facet);

[[nodiscard]] FacetClasses classify_facets(Context& context, MeshView mesh, const FeatureOptions& options);

/// Connected facets of one class, ascending, patches in the order of their lowest facet. A feature of the
/// given type still needs its facets judged: a patch is only what hangs together.
struct Patch {
    FacetClass facet_class{};
    std::vector<std::uint32_t> facets;
};
[[nodiscard]] std::vector<Patch> connected_patches(Context& context, MeshView mesh,
                                                   const FacetClasses& classes);

/// The patch as a feature: z range of its corners, its area (projected for flats), and the facet centroid
/// nearest to its centroid of area.
/// @throws Error(cancelled)
[[nodiscard]] Feature feature_of_patch(Context& context, MeshView mesh, FeatureType type, Patch patch);

}  // namespace slabwright
