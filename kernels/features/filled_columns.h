// The air that stays filled under the part, column by column.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// Upright lines over the plan: line (row, column) stands at (x0 + column·cell, y0 + row·cell), mm.
struct ColumnGrid {
    double x0 = 0, y0 = 0, cell = 1;
    std::size_t rows = 0, columns = 0;
};

/// Air of one line and layer that stays filled, mm.
struct FilledGap {
    std::uint32_t column = 0;
    std::uint32_t layer = 0;  ///< from 0
    std::uint32_t facet = 0;  ///< its roof
    double low = 0, high = 0;
};

/// Lines are cut with all facets, the winding number telling solid from air. Air of a layer stays filled
/// where the layer has solid above it. What is under a micrometre tall is left out: faces of two bodies this
/// near are one joint.
/// @param borders mm, ascending: the layers' bottoms and the last one's top, which may be infinite
/// @return row after row; in each by column, from above
/// @throws Error(no_plan, "memory.limit"), Error(cancelled)
[[nodiscard]] std::vector<std::vector<FilledGap>> filled_gaps(Context& context, MeshView mesh,
                                                              std::span<const double> borders,
                                                              const ColumnGrid& grid);

/// What stays filled under one facet, as its columns tell.
struct FilledUnder {
    double volume_mm3 = 0;    ///< of air, over the columns whose roof is this facet
    double height_mm = 0;     ///< the tallest of them; 0: none that counts
    double x = 0, y = 0;      ///< its place
    double z = 0;             ///< where its roof is, mm
    std::uint32_t layer = 0;  ///< the layer it lies in, from 0
};

/// Sums up filled_gaps() of a square grid over the part. A line counts for the height only where its four
/// neighbours hold such air of the layer too: a wall that leans inwards by a hair leaves tall air as thin as
/// that hair. Volumes count every line.
/// @param borders mm, ascending: the layers' bottoms and the last one's top, which may be infinite
/// @param cell mm between columns, over 0
/// @return one for each facet
/// @throws Error(no_plan, "memory.limit"), Error(cancelled)
[[nodiscard]] std::vector<FilledUnder> filled_under(Context& context, MeshView mesh,
                                                    std::span<const double> borders, double cell);

/// The distance of columns that measures a part: half a million over its extent in plan, and 0.05 mm at
/// least.
[[nodiscard]] double filled_cell(MeshView mesh);

/// Where layers end, from the bottom up: the bottom, the tops, and infinity for the last one, for whatever
/// lies above is its own. Internal to features.
/// @throws Error(usage, "features.layer_tops") when the tops do not ascend from the bottom or are not finite
[[nodiscard]] std::vector<double> layer_borders(double bottom, std::span<const double> layer_tops);

}  // namespace slabwright
