// How far points are from the border of a region.
#pragma once

#include <cstdint>
#include <vector>

#include "kernels/polygons/loops.h"

namespace slabwright {

/// An edge begins at the point of its index.
struct NearestEdge {
    std::uint32_t edge = 0;
    double distance = 0;  ///< mm; infinite where there are no loops
};

/// Answers "how far is the nearest edge of these loops" from any thread, in about the time that the edges of
/// a few grid cells take. Keeps a view of the loops. Memory: some 16 bytes an edge.
class BorderDistance {
public:
    explicit BorderDistance(const Loops& loops);
    /// mm; infinite where there are no loops.
    [[nodiscard]] double operator()(Point2 p) const { return nearest(p).distance; }
    [[nodiscard]] NearestEdge nearest(Point2 p) const;  ///< of several found at once the first
    /// The same where an edge is within `most` mm; where none is, the distance is some value over that. Takes
    /// no longer the farther away the edges are.
    [[nodiscard]] NearestEdge nearest_within(Point2 p, double most) const;

private:
    struct Square {
        double distance = 0;  ///< the square of it, in units
        std::uint32_t edge = 0;
    };
    void look_in(std::int64_t column, std::int64_t row, Point2 p, Square& nearest) const;
    [[nodiscard]] NearestEdge look_around(Point2 p, double most) const;  ///< most in units
    const Loops& loops_;
    std::vector<std::uint32_t> ends_;  ///< of each edge, the index of its second point
    std::int64_t x0_ = 0, y0_ = 0, cell_ = 1, columns_ = 0, rows_ = 0;
    std::vector<std::uint32_t> starts_, edges_;  ///< of each cell, the edges whose boxes meet it
};

/// The greatest distance of the border of `from` from the border of `to`, mm: at its points, and at points
/// between them no farther apart than `step_mm`. 0 where `from` is empty, infinite where only `to` is.
[[nodiscard]] double farthest_from_border(const Loops& from, const BorderDistance& to, double step_mm);

}  // namespace slabwright
