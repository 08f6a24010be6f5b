// Features that decide where layer boundaries may lie (LUO 4.2.3; method.md section 3).
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

enum class FeatureType : std::uint8_t { peak, valley, up_flat, down_flat, shallow, saddle, undercut };
enum class FoundBy : std::uint8_t { exact, halving, facets };
enum class Finder : std::uint8_t { halving, exact, both };

[[nodiscard]] std::string_view name(FeatureType type);  ///< "peak", "valley", "up_flat", … as plan.json spells them
[[nodiscard]] std::string_view name(FoundBy found_by);

/// One feature, millimetres. For `shallow` and `undercut` [z_low, z_high] is the patch's range; else both are its height.
struct Feature {
    FeatureType type{};
    FoundBy found_by{};
    double z_low = 0, z_high = 0;
    double x = 0, y = 0;                ///< a point of the feature: the vertex, or the area's centroid moved to its nearest facet centroid
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
    double chordal_deviation_mm = 0.0254;           ///< of the STL; a lone horizontal facet narrower than this is no flat
    double flat_merge_mm = 1.0;                     ///< a peak or valley this near (in z, and touching in xy) an up-facing flat is dropped
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
[[nodiscard]] FeatureSet find_features(Context& context, MeshView mesh, const FeatureOptions& options = {});

}  // namespace slabwright
