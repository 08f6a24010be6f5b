// Of many points the one farthest from a segment.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace slabwright {

/// Points in space by their coordinates, of any unit.
struct PointRows {
    std::vector<double> x, y, z;
};

struct Farthest {
    double distance2 = -1;  ///< the square of its distance
    std::size_t at = 0;     ///< of several the first
};

/// Of the points first + 1 … last − 1 that farthest from the segment between first and last; {-1, first}:
/// there is none.
[[nodiscard]] Farthest farthest_between(const PointRows& points, std::size_t first, std::size_t last);

}  // namespace slabwright
