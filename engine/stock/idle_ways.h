// Which parts of a cutter's way take something off what stands of a layer.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "engine/stock/layer_stock.h"
#include "kernels/geometry/cutter_shape.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// A straight way of a cutter's tip, mm.
struct StraightPiece {
    std::array<double, 3> from{}, to{};
};

/// Which of pieces that a cutter goes, one after the other, have something to do: more than `limit` (mm along
/// the normal of the surface below) is left over a cell of the stock that the cutter, a cell wider, comes to,
/// or may stand there unseen, beside a wall (LayerStock::may_hide_remains). Those that have not are not gone.
/// The stock stays as it is. Rows in parallel.
/// @throws Error(usage, "tool.shape") for measures that make no cutter; Error(cancelled)
[[nodiscard]] std::vector<char> which_cut(Context& context, const LayerStock& stock,
                                          const CutterShape& cutter, std::span<const StraightPiece> pieces,
                                          double limit);

}  // namespace slabwright
