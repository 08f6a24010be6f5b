// Where closed lines run inside a region.
#pragma once

#include <vector>

#include "kernels/polygons/loops.h"

namespace slabwright {

struct RunInside {
    std::vector<Point2> points;  ///< 0.1 µm; a closed one does not repeat its first
    std::size_t loop = 0;        ///< of which line
    bool closed = false;         ///< all of that lies inside
};

/// The stretches of closed lines that lie inside `region` (winding number over 0), in their lines' direction
/// and order, beginning and ending where a line crosses the region's border, to 0.1 µm. Where the two touch
/// or overlap, either side is as good as the other; should that leave the crossings of a line contradictory,
/// it comes back whole. O(points) besides the border's edges that lie near each of them.
[[nodiscard]] std::vector<RunInside> runs_inside(const Loops& lines, const Loops& region);

}  // namespace slabwright
