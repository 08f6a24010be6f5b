// Fibres of a cutter that is neither flat nor a ball. Internal to this folder: fibres() calls it.
#pragma once

#include <span>
#include <vector>

#include "kernels/cutting/fibres.h"

namespace slabwright {

/// As fibres() for a cutter that is neither flat nor a ball: every facet by itself, many lines in parallel.
[[nodiscard]] std::vector<Fibres> revolved_fibres(Context& context, const LayerSolid& solid,
                                                  std::span<const FibreLevel> levels,
                                                  const CutterShape& cutter, Axis axis,
                                                  std::span<const std::int32_t> lines);

}  // namespace slabwright
