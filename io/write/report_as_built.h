// What stands when everything has been cut, for the report's picture of the finished stack: the wood of every
// layer, and what of it should be air.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "engine/simulate/simulate.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// Heights of a layer's wood as base64 of bytes, row after row: 0 where nothing stands, else 1 … 255 from the
/// layer's bottom to its top (wood above the top, where there is any, counts as 255). Runs of equal bytes are
/// written as pairs (length, byte) where that is shorter.
struct PackedHeights {
    bool in_runs = false;
    std::string base64;
};

/// @param surface mm, of every point
[[nodiscard]] PackedHeights packed_wood(const SimulatedLayer& layer, const std::vector<float>& surface);

/// What stays filled under overhangs of each layer: boxes along the grid's rows, as base64 of five 16-bit
/// numbers each: row, column, how many columns, and between which heights, as shares of the pattern's own
/// height. Neighbours whose heights differ by less than a tolerance share a box; it grows until there are few
/// enough.
struct PackedFilling {
    struct Layer {
        std::string boxes;  ///< base64
        double mm3 = 0;
        std::string below;  ///< base64 of boxes likewise: what is milled from below
    };
    double z0 = 0, height = 0, tolerance = 0;  ///< mm
    std::vector<Layer> layers;
};

/// @param both_sides by layer, whether its slab is milled from below too: what is open there is made
/// @param first the grid's first point, mm, @param cell mm between its points
[[nodiscard]] PackedFilling packed_filling(Context& context, MeshView mesh,
                                           std::span<const SimulatedLayer> layers,
                                           const std::vector<bool>& both_sides,
                                           const std::array<double, 2>& first, double cell, int nx, int ny);

}  // namespace slabwright
