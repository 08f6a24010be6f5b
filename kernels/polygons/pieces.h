// A region piece by piece: each outer loop with its holes.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "kernels/polygons/loops.h"

namespace slabwright {

struct Box2 {
    Point2 min{INT32_MAX, INT32_MAX}, max{INT32_MIN, INT32_MIN};
    void grow(Point2 p) {
        min = {std::min(min.x, p.x), std::min(min.y, p.y)};
        max = {std::max(max.x, p.x), std::max(max.y, p.y)};
    }
    [[nodiscard]] bool meets(const Box2& o) const {
        return min.x <= o.max.x && o.min.x <= max.x && min.y <= o.max.y && o.min.y <= max.y;
    }
};

/// Copies all loops of a region behind those of another; nothing is clipped.
void append_loops(const Loops& loops, Loops& to);

struct Pieces {
    std::vector<Loops> regions;  ///< each one outer loop, then its holes
    std::vector<Box2> boxes;     ///< of the outer loops

    /// @param region nested or not
    explicit Pieces(const Loops& region);
    [[nodiscard]] std::size_t size() const { return regions.size(); }
    /// What of them lies in a region whose box is given.
    [[nodiscard]] Loops within(const Loops& region, const Box2& box) const;
};

}  // namespace slabwright
