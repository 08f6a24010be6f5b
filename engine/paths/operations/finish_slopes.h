// Which slopes are finished by level contours, and which by projected paths.
#pragma once

#include "engine/job.h"

namespace slabwright {

/// The slopes, in radians from level, that the job's finish strategy gives to level contours (from
/// `levels_from` up, over π/2: none) and to projected paths (up to `projection_to`, negative: none), and
/// those on which the cusp decides their steps.
struct FinishSlopes {
    double levels_from = 0, levels_keep = 0;
    double projection_to = 0, projection_keep = 0;
};
[[nodiscard]] FinishSlopes finish_slopes(const Cutting& cutting);

}  // namespace slabwright
