// One tile's stock beside the part, when all programs of all layers have run.
#pragma once

#include "engine/simulate/stage.h"
#include "kernels/stock/stock.h"

namespace slabwright {

/// Compares every layer's stock in a tile with the part's envelope: gouges, what is left and whether a tool
/// reaches it, air that stays filled, what of the flask is gone.
/// @param i0,j0 the tile's first cell. @param report its maps are filled where SimulationOptions::maps asks
/// for them;
///        tiles write to their own cells only
/// @throws Error(cancelled)
void measure_tile(const SimulationStage& stage, const Stock& stock, int i0, int j0, TileResult& result,
                  SimulationReport& report);

}  // namespace slabwright
