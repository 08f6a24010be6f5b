// Features that decide where layer boundaries may lie (LUO 4.2.3; METHOD.md section 3).
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "kernels/export.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

enum class FeatureType : std::uint8_t { peak, valley, up_flat, down_flat, shallow, saddle, undercut };
enum class FoundBy : std::uint8_t { exact, halving, facets };
enum class Finder : std::uint8_t { halving, exact, both };

[[nodiscard]] SLABWRIGHT_API std::string_view name(
    FeatureType type);  ///< "peak", "valley", "up_flat", … as plan.json spells them
[[nodiscard]] SLABWRIGHT_API std::string_view name(FoundBy found_by);

/// One feature, millimetres. For `shallow` and `undercut` [z_low, z_high] is the patch's range; else both are
/// its height.
struct Feature {
    FeatureType type{};
    FoundBy found_by{};
    double z_low = 0, z_high = 0;
    double x = 0,
           y = 0;  ///< a point of the feature: the vertex, or the area's centroid moved to its nearest facet
                   ///< centroid
    double area = 0;                    ///< mm² of its facets (projected for flats); 0 for a single vertex
    std::vector<std::uint32_t> facets;  ///< its facets, ascending; empty for peaks, valleys and saddles
};

/// A place where halving and the exact scan disagree (Finder::both).
struct FinderDisagreement {
    FeatureType type{};
    double z = 0, x = 0, y = 0;
    FoundBy found_by{};  ///< the only finder that saw it
};

struct FeatureOptions {
    Finder finder = Finder::exact;
    double chordal_deviation_mm =
        0.0254;                  ///< of the STL; a lone horizontal facet narrower than this is no flat
    double flat_merge_mm = 1.0;  ///< a peak or valley this near (in z, and touching or as near in xy) an
                                 ///< up-facing flat is dropped
    double shallow_limit_rad = 0.2617993877991494;  ///< 15° for MDF
    double halving_coarse_mm = 2.54;
    double halving_resolution_mm = 0.254;
    double horizontal_rad = 1e-4;  ///< a facet whose normal is within this of ±z is horizontal
};

struct FeatureSet {
    std::vector<Feature> features;  ///< sorted by (type, z_low, z_high, x, y)
    std::vector<FinderDisagreement> disagreements;
};

/// Finds every feature of the mesh. Down-facing flats at the base (the lowest z) are no features.
/// Undercuts are connected patches of down-facing facets that are not horizontal.
/// @throws Error(usage, "features.options") for lengths or angles out of range
[[nodiscard]] FeatureSet find_features(Context& context, MeshView mesh, const FeatureOptions& options = {});

/// Material that stays under down-facing facets when the layers are milled from above: within a layer (zb,
/// zt] the milled shape at z is the union of the sections in [z, zt], so what lies under a facet of the same
/// layer stays.
struct UnmadeUndercut {
    FeatureType type{};  ///< down_flat when all its facets are horizontal (a flat that no boundary meets),
                         ///< else undercut
    double z_low = 0, z_high = 0;  ///< mm, range of what stays unmade's facets
    double area_mm2 = 0;           ///< of the facets, cut to the layers, under which something stays
    double height_mm = 0;          ///< the tallest air that stays filled, straight down from the facets
    double volume_mm3 = 0;         ///< of the air that stays filled under the facets
    double x = 0, y = 0, z = 0;    ///< where it is tallest, z on the facets
    /// The thickest that stays, along a facet's outward normal: what a tolerance limits. Never over the
    /// height.
    double thickness_mm = 0;
    std::vector<std::uint32_t> facets;  ///< ascending
};

/// Measures what given boundaries leave unmade, in patches (facets that are joined, and walls under their
/// ceiling), the thickest first (ties: the larger volume, then the lowest facet). Height and volume come from
/// half a million upright lines over the part (filled_columns.h): a height may be short by what roof and
/// floor rise over the distance of two lines. The thickness is found in closed form at corners, edge middles
/// and centroid of every facet as the layers cut it: how far its outward normal runs before no down-facing
/// facet of the layer lies straight above, or solid or the layer's bottom is met. A wall that leans out by
/// rounding is as thick as it leans, however tall; where nothing is wide enough for columns, its height is
/// that under its thickest place. Thicknesses under 1 µm are left out, and so are facets inside the solid (of
/// another shell).
/// @param layer_tops mm, ascending, in the mesh's own z; the first layer begins at the mesh's lowest z
/// @throws Error(usage, "features.layer_tops") when the tops do not ascend or are not finite
[[nodiscard]] std::vector<UnmadeUndercut> measure_undercuts(Context& context, MeshView mesh,
                                                            std::span<const double> layer_tops,
                                                            const FeatureOptions& options = {});

}  // namespace slabwright
