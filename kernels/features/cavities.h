// Narrow deep cavities: slots, gaps between ribs, small holes (SHAPING 6; METHOD.md section 3).
//
// At each of many levels the medial axis of the air, milled from above, is taken where it is narrow. Pieces
// of neighbouring levels that lie over each other and are about as wide make one cavity.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "kernels/features/features.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

struct CavityOptions {
    double most_width_mm = 12.7;  ///< wider air is not narrow
    double least_width_mm = 0.2;  ///< narrower air is taken for a gap in the mesh
    double least_ratio = 1;       ///< of depth to width
    double least_depth_mm = 1;
    double step_mm = 2;  ///< between levels, beside those at flats and boundaries; a 150th of the height at
                         ///< least
};

/// So much of a cavity, seen from above, is so wide.
struct WidthShare {
    double width_mm = 0, area_mm2 = 0;
};

/// A cavity at one level. The area is what a round tool as wide as the cavity covers on its way along the
/// axis; corners that such a tool leaves are none of it.
struct CavityLevel {
    double z = 0;
    std::vector<WidthShare> widths;  ///< ascending
    [[nodiscard]] double area_mm2() const;
    /// What a tool of this diameter does not enter; a thousandth of a millimetre is let pass.
    [[nodiscard]] double area_under(double diameter_mm) const;
};

/// What of a cavity one layer has.
struct CavityInLayer {
    std::size_t layer = 0;           ///< from 0
    double layer_top_mm = 0;         ///< z
    double low_mm = 0, high_mm = 0;  ///< z, of the cavity in it
    /// How far a tool reaches down for it from the layer's top, where the layer's stock begins.
    [[nodiscard]] double reach_mm() const { return layer_top_mm - low_mm; }
};

struct NarrowCavity {
    Point3 at{};          ///< mm, in its middle at its floor
    double width_mm = 0;  ///< at its narrowest level, of all but the narrowest twentieth there
    double widest_mm = 0;
    double low_mm = 0, high_mm = 0;   ///< z of floor and rim: exact where these are level, else within a step
    double length_mm = 0;             ///< of its axis, at the level where it is longest; 0: it is round
    std::vector<CavityLevel> levels;  ///< from below
    std::vector<CavityInLayer> layers;  ///< from below

    [[nodiscard]] double depth_mm() const { return high_mm - low_mm; }
    [[nodiscard]] double ratio() const { return depth_mm() / width_mm; }
    [[nodiscard]] double area_mm2() const;  ///< at the level where it is largest
    /// What a tool of this diameter does not enter, at the level where that is most.
    [[nodiscard]] double area_under(double diameter_mm) const;
};

/// The narrow cavities of a pattern that is milled from above in layers; air under a roof of the same layer
/// stays filled and is none. Widths of upright walls are exact to the 0.1 µm of sections, on arcs to the
/// mesh's chords; of sections with more than 20 000 points within 0.02 mm. The slenderest first (ties: by
/// place). The same on any number of threads.
/// @param layer_tops z, ascending, the last at the pattern's top
/// @param features of the mesh: levels lie just under and over its flats
/// @throws Error(usage, "cavities.options") for limits out of order; and as shadows()
[[nodiscard]] std::vector<NarrowCavity> find_cavities(Context& context, MeshView mesh,
                                                      std::span<const double> layer_tops,
                                                      std::span<const Feature> features,
                                                      const CavityOptions& options = {});

}  // namespace slabwright
