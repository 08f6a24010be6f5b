// The α-map of a layer: how steep its surface is at each height (LUO 5.4, METHOD.md section 5).
#pragma once

#include <cstdint>
#include <numbers>
#include <vector>

#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// Slopes are in radians from level, rounded down to a tenth of a degree, so that a stepdown that follows
/// from them is never too large.
struct AlphaMap {
    static constexpr double kTenth = std::numbers::pi / 1800;
    double z_low = 0, z_high = 0;  ///< mm
    double step = 0.1;             ///< mm: the height of a bin
    std::vector<std::vector<double>>
        slopes;  ///< by bin, upwards from z_low: the slopes that its facets have, ascending

    /// α between two heights: the smallest slope that is at least `at_least`; π/2 where there are none.
    [[nodiscard]] double least(double z0, double z1, double at_least = 0) const;

    /// Heights of one α, upwards; together they are all of the layer.
    struct Band {
        double z_low = 0, z_high = 0;  ///< mm
        double alpha = 0;              ///< rad
    };
    /// Where a stepdown that follows α changes. Neighbouring heights whose α differ by no more than
    /// `same_rad` are one band, with the smaller α, and so are bands lower than `least_height` and the
    /// neighbour that is nearer in α.
    [[nodiscard]] std::vector<Band> bands(double at_least = 0, double same_rad = kTenth,
                                          double least_height = 0) const;

    /// Of the facets to be machined, mm².
    double area = 0;                            ///< all that slope
    double vertical_area = 0;                   ///< upright ones, of these
    double least_slope = std::numbers::pi / 2;  ///< not rounded
    double least_steep =
        std::numbers::pi / 2;  ///< not rounded, of those that are at least as steep as AlphaOptions::steep
    /// Whether all that slopes is upright, and there is some: one flat end mill cuts it (LUO 5.5.2).
    [[nodiscard]] bool vertical() const { return area > 0 && vertical_area == area; }
};

struct AlphaOptions {
    double step = 0.1;                               ///< mm, over 0
    double upright = 89.9 * std::numbers::pi / 180;  ///< rad: what is steeper is a vertical wall
    double steep = 0;                                ///< rad, for AlphaMap::least_steep
    double cut_off = 0.001;  ///< mm: what lies so near to the layer's top belongs to the next one
};

/// Of the facets that are to be machined by slope between the heights: those that face up or are upright.
/// Level floors and what faces down are left out. A facet counts in every bin that it reaches into, up to the
/// layer's top; areas are of its part in the layer. In parallel; the same on any number of threads.
/// @throws Error(usage, "alpha_map.range") unless z_low < z_high and the step is over 0
[[nodiscard]] AlphaMap alpha_map(Context& context, MeshView mesh, double z_low, double z_high,
                                 const AlphaOptions& options = {});

}  // namespace slabwright
