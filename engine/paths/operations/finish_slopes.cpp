#include "engine/paths/operations/finish_slopes.h"

#include <algorithm>
#include <numbers>

namespace slabwright {

FinishSlopes finish_slopes(const Cutting& cutting) {
    constexpr double degree = std::numbers::pi / 180, none = 2;
    // Contours of what is as good as level run anywhere; a ball's place over a wall is decided by the last
    // bit.
    const double level = 0.5 * degree, wall = std::min(cutting.vertical_deg, 89.9) * degree,
                 limit = cutting.steep_limit_deg * degree, overlap = cutting.overlap_deg * degree;
    switch (cutting.finish_strategy) {
        case FinishStrategy::levels:
            return {level, level, -1, -1};
        case FinishStrategy::projection:
            return {none, none, wall, wall};
        case FinishStrategy::both:
            return {level, limit, wall, limit};
        case FinishStrategy::split:
            break;
    }
    return {limit - overlap, limit - overlap, limit + overlap, limit + overlap};
}

}  // namespace slabwright
