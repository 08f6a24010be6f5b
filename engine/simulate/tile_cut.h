// A program run over one tile of the stock.
#pragma once

#include <vector>

#include "engine/simulate/stage.h"
#include "kernels/stock/stock.h"

namespace slabwright {

/// Straight level motions of a flat cutter at one height that follow one another in a tile. What they take
/// together does not depend on their order, so it is taken once for all, unless it is so deep that it must be
/// told of which motion.
struct LevelMotions {
    explicit LevelMotions(const CellGrid& grid) : region(grid) {}
    struct Motion {
        std::size_t step;
        bool been;  ///< whether the motion before has taken what the cutter covers at the begin
    };
    LevelRegion region;
    std::vector<Motion> motions;
    double z = 0;
};

/// Runs a program over a tile whose highest stock stands at `top`, and adds what it did there to `out`.
/// @param level scratch that the tile's programs share, empty before and after
/// @returns whether it took anything
bool run_program(const SimulationStage& stage, const PreparedProgram& program, Stock& stock, double top,
                 LevelMotions& level, TileProgram& out);

}  // namespace slabwright
