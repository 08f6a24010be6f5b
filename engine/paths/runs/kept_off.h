// How far roughing stays off the walls.
#pragma once

#include <algorithm>

#include "engine/job.h"

namespace slabwright {

/// mm: what the contours of roughing, thinned and coarse as they are, may come nearer to the part than they
/// say, twice.
inline constexpr double kLeastKeptOff = 0.05;

/// The job's allowance, but never less than roughing's own error: with none it would cut into the part.
[[nodiscard]] inline double kept_off_walls(const Cutting& cutting) {
    return std::max(cutting.wall_allowance, kLeastKeptOff);
}

}  // namespace slabwright
