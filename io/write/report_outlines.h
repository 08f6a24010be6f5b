// Lines that the report draws: sections, and where glue goes.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/polygons/loops.h"

namespace slabwright {

inline constexpr double kOutlineTolerance = 0.05;  ///< mm, of sections and glue
inline constexpr double kHundredths = 100;         ///< outlines are written in 0.01 mm

/// One loop, thinned (kOutlineTolerance), as x, y, x, y… in 0.01 mm.
[[nodiscard]] std::vector<std::int64_t> outline(std::span<const Point2> loop);

}  // namespace slabwright
