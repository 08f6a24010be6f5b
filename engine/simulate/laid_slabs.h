// The slabs of a build as they are laid, each as large as its layer says.
#pragma once

#include <vector>

#include "engine/simulate/simulate.h"
#include "kernels/parallel/context.h"
#include "kernels/stock/stock.h"

namespace slabwright {

/// Bonds a layer's slab onto the stock, as far as it covers its cells.
void lay_slab(Stock& stock, const SimulatedLayer& layer);

/// The walls of a layer's flask and of the one below it, into which a cutter dips at a joint. Walls alone:
/// what is cut far inside the flask shows in the stock.
[[nodiscard]] Mesh flask_walls(const std::vector<SimulatedLayer>& layers, std::size_t layer);

/// How high a layer's raw slab stands over a part of the stock: its top, or where it covers none of the cells
/// its bottom.
[[nodiscard]] double laid_top(const SimulatedLayer& layer, const CellGrid& grid);

/// Where the part reaches past a layer's slab, stack.blank: no cut can make wood that was never laid. What
/// ends within .01 mm of the layer's bottom or begins so near its top belongs to the layer beside it.
/// @throws Error(cancelled)
[[nodiscard]] std::vector<Violation> blanks_too_small(Context& context, const SimulationInput& input);

}  // namespace slabwright
