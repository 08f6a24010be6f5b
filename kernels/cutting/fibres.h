// Push-cutter fibres: at one tip height, along straight lines in x or y, the intervals in which the cutter
// would touch the solid. Every facet (prism), convex edge (cylinder) and vertex (sphere) within reach forbids
// an interval in closed form; so do the section's inside and whatever overhangs the tip. The ends of the
// merged intervals are exact cutter locations (METHOD.md section 11).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/cutting/layer_solid.h"
#include "kernels/cutting/tool_shape.h"
#include "kernels/parallel/context.h"
#include "kernels/slicing/slicing.h"

namespace slabwright {

enum class Axis : std::uint8_t { x, y };

/// The cutter touches something for every position strictly within (low, high), mm along the fibre. At an
/// end, nz is the upward part of the unit normal at the contact (1: the tip stands on a flat; 0: a vertical
/// wall). For a flat cutter it is the touched facet's own nz.
struct Forbidden {
    double low = 0, high = 0;
    float nz_low = 0, nz_high = 0;
};

/// Intervals of many parallel fibres: those of line i are intervals[starts[i]] … intervals[starts[i + 1] −
/// 1], ascending and disjoint.
struct Fibres {
    std::vector<std::uint32_t> starts{0};
    std::vector<Forbidden> intervals;
    [[nodiscard]] std::span<const Forbidden> line(std::size_t i) const {
        return std::span(intervals).subspan(starts[i], starts[i + 1] - starts[i]);
    }
    [[nodiscard]] std::size_t size() const noexcept { return starts.size() - 1; }
};

/// The plane whose section is the inside that fibres() asks for at this tip height.
[[nodiscard]] Plane inside_plane(const LayerSolid& solid, const CutterShape& cutter, double tip_z);

/// Fibres along `axis` at the other coordinate's `lines` (units of 0.1 µm, ascending).
/// @param inside the mesh's section by inside_plane()
[[nodiscard]] Fibres fibres(Context& context, const LayerSolid& solid, const Loops& inside,
                            const CutterShape& cutter, double tip_z, Axis axis,
                            std::span<const std::int32_t> lines);

/// A height of a cutter's tip, mm, and the mesh's section by inside_plane() there.
struct FibreLevel {
    double tip_z = 0;
    const Loops* inside = nullptr;
};

/// The same at several heights, in any order; a result for each. What a cutter touches at one height it
/// touches or passes under at every lower one, so each level begins with the next higher one's intervals, and
/// only what reaches out of them is looked at.
[[nodiscard]] std::vector<Fibres> fibres(Context& context, const LayerSolid& solid,
                                         std::span<const FibreLevel> levels, const CutterShape& cutter,
                                         Axis axis, std::span<const std::int32_t> lines);

/// Where a fibre passes within `radius` of the facets, seen from above: the places from which a cutter of
/// that radius covers some of them. nz is the facets' own.
[[nodiscard]] Fibres covering(Context& context, std::span<const SolidFacet> facets, double radius, Axis axis,
                              std::span<const std::int32_t> lines);

/// The stretches of [low, high] (mm) that `forbidden` leaves free, those shorter than `shortest` left out.
struct Stretch {
    double low = 0, high = 0;
};
[[nodiscard]] std::vector<Stretch> free_stretches(std::span<const Forbidden> forbidden, double low,
                                                  double high, double shortest);

}  // namespace slabwright
