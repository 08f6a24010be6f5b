// A program's way with fewer points, for a picture.
#pragma once

#include <vector>

#include "engine/simulate/program.h"

namespace slabwright {

/// The tool's tip when a motion ends.
struct ReplayPoint {
    double x = 0, y = 0, z = 0;  ///< mm, frame pattern-base
    double seconds = 0;          ///< since the first, by way over feed
    bool rapid = false;          ///< how it came here
};

/// The known places of a program, thinned as they are found. @param rapid_feed mm/min of G0 @param
/// tolerance_mm as thin(); 0: all of them
[[nodiscard]] std::vector<ReplayPoint> path_of(const Program& program, double rapid_feed,
                                               double tolerance_mm = 0);

/// Leaves out points so that each left-out one lies within `tolerance_mm` of the straight line that replaces
/// it (Douglas and Peucker, in 3D, over runs of feed or of rapid motions; a run is cut after 1024 points, so
/// time grows no faster than their number).
void thin(std::vector<ReplayPoint>& path, double tolerance_mm);

}  // namespace slabwright
