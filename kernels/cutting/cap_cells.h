// Whether a place lies in a region, for very many places: cells know whether they are inside, but for those
// that the border crosses.
#pragma once

#include <cstdint>
#include <vector>

#include "kernels/polygons/loops.h"

namespace slabwright {

class CapCells {
public:
    CapCells() = default;
    /// The region where the loops' winding number is positive.
    explicit CapCells(const Loops& loops);
    /// @param x, y mm. A place exactly on the border is on either side.
    [[nodiscard]] bool inside(double x, double y) const;

private:
    struct Segment {
        Point2 a, b;
    };
    static constexpr std::int8_t kCrossed = INT8_MIN;
    [[nodiscard]] std::size_t column(double x) const;  // x, y: 0.1 µm
    [[nodiscard]] std::size_t row(double y) const;
    /// Turns of the border in a cell, to the right of x, on the line at height y.
    [[nodiscard]] int turns(std::size_t column, std::size_t row, double x, double y) const;
    double x0_ = 0, y0_ = 0, cell_ = 1;  // 0.1 µm
    std::size_t columns_ = 0, rows_ = 0;
    std::vector<std::int8_t> winding_;   // all over a cell, or kCrossed
    std::vector<std::uint32_t> starts_;  // of a cell's segments
    std::vector<Segment> segments_;
};

}  // namespace slabwright
