// The narrow part of a medial axis: where two walls face each other, and how far apart they are.
#pragma once

#include <cstdint>
#include <numbers>
#include <vector>

#include "kernels/polygons/loops.h"

namespace slabwright {

struct MedialPoint {
    double x = 0, y = 0;   ///< mm
    double clearance = 0;  ///< mm, to the nearest wall: half the width there
};

/// A straight stretch of the axis between two of its points, by their indices.
struct MedialLink {
    std::uint32_t from = 0, to = 0;
};

struct MedialAxis {
    std::vector<MedialPoint> points;
    std::vector<MedialLink> links;  ///< a point without one is the middle of something round
};

struct MedialLimits {
    double most_clearance_mm = 6.35;
    /// Seen from a point of the axis the two nearest places of the walls lie at least this far apart. Walls
    /// that face each other are π apart; the branch that ends in a square corner has π/2.
    double least_spread_rad = 2 * std::numbers::pi / 3;
    double step_mm = 1;  ///< between points of a link, at most
};

/// Of the plane outside `solid`, between its loops and beside them, the medial axis where it is narrow: where
/// walls face each other within the limits, and the middles of what is round (the nearest places of the walls
/// lie all around them). Clearances at ends, branches and pinches are exact to 0.4 µm; where
/// a limit cuts the axis off, it ends within a step of there. By the Voronoi diagram of the loops' edges
/// (Boost.Polygon), O(n log n).
/// @param solid as simplify() gives it; edges that cross or touch in spite of that are divided there
[[nodiscard]] MedialAxis narrow_axis(const Loops& solid, const MedialLimits& limits = {});

}  // namespace slabwright
