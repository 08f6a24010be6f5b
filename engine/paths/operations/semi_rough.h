// Semi-roughing (LUO 5.5.2): what a wider cutter left outside the swath of the cutter that finishes, and only
// that, is cut by contour passes, level by level.
#pragma once

#include "engine/paths/runs/layer_cut.h"
#include "engine/stock/layer_stock.h"

namespace slabwright {

struct SemiRoughPass {
    const char* purpose = "";
    double limit =
        1.0;           ///< mm along the normal: what stands higher over the finished surface is worth a visit
    double swath = 0;  ///< mm: what lies so near to a wall, sideways at its height, is left to what follows
    double allowance = 0.3;  ///< mm kept off the walls; 0: they are met as in finishing
};

/// Rings around what must stay, the farthest first, of which only those stretches are kept that cut something
/// worth a visit. A flat end mill's levels are those of terraced_steps(); a ball's at even steps down to the
/// bottom, with others between them for what does not reach down to the next, and one below it, as far as
/// that may be cut into, for walls that go on there. The allowance of a ball is kept along the normal. Takes
/// what it cuts off the stock.
[[nodiscard]] Operation semi_rough_layer(const LayerCut& cut, LayerStock& stock, const Tool& tool,
                                         const SemiRoughPass& pass);

}  // namespace slabwright
