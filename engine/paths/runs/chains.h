// Runs along the surface joined to chains: from the end of one on to the nearest other without leaving the
// surface.
#pragma once

#include <vector>

#include "engine/paths/runs/layer_cut.h"

namespace slabwright {

/// How a cutter goes along the surface from one run to another.
struct Slide {
    const DropIndex* part =
        nullptr;  ///< drops of this cutter, or of a wider one that has room where the runs are
    bool ball = true;
    double chord = 0;  ///< mm: safe between free places
    double top = 0;    ///< mm: it does not climb onto this height, the finished top
    double near = 3;   ///< mm that it goes at most
    double under = 0;  ///< mm that the tip of `part`'s cutter lies under this one's
    /// Where the way along the surface is no straight one, it goes straight up, along and down; a flat end
    /// mill on one slope, if that is no steeper than `steepest` and cuts no more than `over` mm. False: by
    /// steps along the surface, so that a cutter that cannot plunge comes from beside what stands.
    bool hops = false;
    double steepest = 3, over = 0.0025;
};

/// Appends a free place to a line whose last place is free: straight where that is short enough to stay out
/// of the part. A ball goes by places between, on the straight way or where the surface is higher, and only
/// where these are still too far apart over the corner above the lower of two. Straight up is always free,
/// and so is level travel at the height of the higher; with a flat end mill only what is level is straight.
void append_free(std::vector<PathPoint>& line, PathPoint p, const Slide& slide);

/// Joins runs, each of which may be cut either way. A chain begins with the first run left, and goes on with
/// that which begins or ends nearest to its end, as long as the way along the surface is free and short.
[[nodiscard]] std::vector<std::vector<PathPoint>> chained(std::vector<std::vector<PathPoint>> runs,
                                                          const Slide& slide);

/// Cuts chains, each either way, the nearest first.
void follow_nearest(PathBuilder& path, const std::vector<std::vector<PathPoint>>& chains);

}  // namespace slabwright
