// Sharp edges of the pattern, followed where something stands beside them (FINISH 3.2; METHOD.md section 17).
#pragma once

#include <vector>

#include "engine/paths/runs/layer_cut.h"
#include "engine/stock/layer_stock.h"

namespace slabwright {

/// Follows convex edges on both sides, a ball's centre at edge + R·n of either face, and concave ones where
/// the cutter touches both faces; only where more than twice the gouge tolerance stands within kEdgeBand and
/// that cutter lowers it. Of the layer's tools each stretch gets the one that leaves least there; the
/// cones of the job then go into what is left of concave ones. Places that would gouge, or that something
/// else keeps the cutter away from, are left out.
/// @returns an operation for each tool that has something to do, what they cut taken off the stock
/// @throws Error(cancelled)
[[nodiscard]] std::vector<Operation> follow_edges(const LayerCut& cut, LayerStock& stock);

/// How far from an edge, seen from above, something is taken to stand beside it, mm.
inline constexpr double kEdgeBand = 0.4;

}  // namespace slabwright
