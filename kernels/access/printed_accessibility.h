// Accessibility as printed (LUO 5.5.1; METHOD.md section 6): by length, over the section polylines of a
// layer.
#pragma once

#include <cstdint>
#include <span>

#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"
#include "kernels/polygons/loops.h"

namespace slabwright {

/// Lengths in mm.
struct PrintedAccessibility {
    double all = 0;  ///< Lall, of what is to be machined
    double intersecting =
        0;               ///< Lins: the tool, placed in contact there, would cut into the section elsewhere
    double corners = 0;  ///< Lcor: R / tan(θ/2) on each side of a concave corner of inner angle θ, no more
                         ///< than the edge has
    double weight = 2;   ///< W

    /// AR = (Lall − W·Lins − Lcor) / Lall; 1 where nothing is to be machined. Negative where most of the
    /// offsets intersect.
    [[nodiscard]] double ratio() const { return all > 0 ? (all - weight * intersecting - corners) / all : 1; }
};

/// Of one section: solid to the left of its loops, as slice() gives them. Lins is exact for the polyline, to
/// within `touch` of depth, mm. Its parts within Lcor are not counted again.
/// @param left_out one for every point of the section, not 0 where the edge that begins there is not to be
/// machined; or empty
/// @throws Error(usage, "access.printed") for a radius that is not over 0 or a left_out of another length
[[nodiscard]] PrintedAccessibility printed_accessibility(const Loops& section, double radius_mm,
                                                         double weight = 2,
                                                         std::span<const std::uint8_t> left_out = {},
                                                         double touch = 0.001);

/// Of a layer: the sum over this many sections at the middles of equal steps between z_low and z_high.
/// Undercut parts are left out: edges of facets that face down by more than 1e-4 rad.
/// @throws also what slice() throws
[[nodiscard]] PrintedAccessibility printed_accessibility(Context& context, MeshView mesh, double z_low,
                                                         double z_high, double radius_mm, double weight = 2,
                                                         int sections = 8);

}  // namespace slabwright
