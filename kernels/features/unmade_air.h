// The air of a part that milling cannot take out, where layers are milled from above or from both sides
// (METHOD.md section 16).
//
// In a layer that is milled from above, air under solid of the same layer stays filled. Where a slab's
// underside is milled before the slab is bonded, and its top after that, only that air stays which has solid
// of the same layer above and below it. So air between two bodies of solid is made as soon as one boundary
// lies in it, on either of them or anywhere between.
//
// Both are found along upright lines, a square grid of them over the part:
//     const AirGaps gaps = air_gaps(context, mesh, filled_cell(mesh));
//     const UnmadeAir left = unmade_air(context, gaps, tops, MilledFrom::both_sides);
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "kernels/features/filled_columns.h"
#include "kernels/geometry/vectors.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// Which sides of a slab are milled.
enum class MilledFrom : std::uint8_t { above, both_sides };

/// A boundary this near to solid lies on it, mm; air less high is none.
inline constexpr double kLeastGap = 1e-3;

/// Air of one line with solid over it.
struct AirGap {
    std::uint32_t column = 0;
    std::uint32_t facet = 0;   ///< its roof
    double low = 0, high = 0;  ///< mm; `low` is the part's lowest z where nothing is under it
    bool has_floor = false;    ///< whether solid is under it
};

/// The air under solid along a part's upright lines, whatever its layers are.
struct AirGaps {
    ColumnGrid grid;
    double bottom = 0, top = 0;             ///< of the part, mm
    std::vector<std::vector<AirGap>> rows;  ///< by column, and from above in each
    std::shared_ptr<MemoryCharge> charge;   ///< of the gaps; the context must outlive it
};

/// Cuts upright lines with all facets; the winding number tells solid from air. Gaps under kLeastGap are left
/// out.
/// @param cell mm between lines, over 0; filled_cell() for half a million of them
/// @throws Error(no_plan, "memory.limit"), Error(cancelled)
[[nodiscard]] AirGaps air_gaps(Context& context, MeshView mesh, double cell);

/// Air that stays filled and hangs together: of one layer, in lines beside one another.
struct UnmadePocket {
    double volume_mm3 = 0;
    double height_mm = 0;  ///< of the tallest line whose four neighbours belong to it too
    Point3 at{};           ///< the middle of that line's air
    std::uint32_t layer = 0;
};

/// What given layers leave filled.
struct UnmadeAir {
    double volume_mm3 = 0;
    /// How far the volume may be off, by the spacing of the lines: half of what the four grids of every other
    /// line in x and y differ by. About two standard deviations, not a bound.
    double error_mm3 = 0;
    double height_mm = 0;               ///< of the tallest pocket
    std::vector<double> of_layers;      ///< mm³, one for each layer
    std::vector<UnmadePocket> pockets;  ///< the largest first; those too thin for a height are left out
};

/// @param layer_tops mm, ascending, over the part's bottom; what lies above the last is the last layer's
/// @throws Error(usage, "features.layer_tops") when the tops do not ascend or are not finite,
/// Error(cancelled)
[[nodiscard]] UnmadeAir unmade_air(Context& context, const AirGaps& gaps, std::span<const double> layer_tops,
                                   MilledFrom milled);

/// A layer as it is milled.
struct MilledLayer {
    double top = 0;  ///< mm
    MilledFrom milled = MilledFrom::above;
    double web = 0;  ///< mm under its top that are not milled from below
    /// Where `strip_pitch` is over 0 the web comes in strips along x, `strip_width` wide, the middle of the
    /// first half a pitch behind y = `front`; between them `film` mm are not milled from below. mm
    double strip_pitch = 0, strip_width = 0, front = 0, film = 0;
    /// mm that are not milled from below at y
    [[nodiscard]] double web_at(double y) const;
};

/// The same of layers that are not milled alike. Where a layer is milled on both sides, that air too stays
/// that has solid of the layer above it and lies in its web.
[[nodiscard]] UnmadeAir unmade_air(Context& context, const AirGaps& gaps,
                                   std::span<const MilledLayer> layers);

}  // namespace slabwright
