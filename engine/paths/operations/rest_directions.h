// In which direction a rest pass lays its lines over what it is to lower: along corners and creases rather
// than across them, so that they are few and long.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/paths/operations/rest_targets.h"
#include "kernels/stock/cell_grid.h"

namespace slabwright {

/// Stretches of a line.
using Spans = std::vector<std::array<std::int32_t, 2>>;  // 0.1 µm, ascending and disjoint

/// Lines that go p cells to the right and q up. A place has a coordinate along its line and one across, the
/// line's own, both in 0.1 µm; (along, across) turned by the direction is (x, y).
struct LineDirection {
    int p = 1, q = 0;     // without a common divisor, q ≥ 0
    double c = 1, s = 0;  // its cosine and sine

    /// @returns x, y, 0.1 µm
    [[nodiscard]] std::array<std::int32_t, 2> place(std::int32_t along, std::int32_t across) const;
    /// From where to where along it a line lies in a rectangle, mm; the first is greater than the second
    /// where it does not.
    /// @param x,y the rectangle's least and greatest coordinate, mm
    [[nodiscard]] std::array<double, 2> within(double across, const std::array<double, 2>& x,
                                               const std::array<double, 2>& y) const;
};

/// The targets of a pass, each in the lines of one direction: that in which the targets around it reach
/// farthest, and along x where others do not reach much farther.
class RestDirections {
public:
    /// @param rows the targets, row by row of the grid
    /// @param radius of the cutter, mm
    RestDirections(Context& context, const CellGrid& grid, std::span<const CellRuns> rows, double radius);

    [[nodiscard]] std::span<const LineDirection> all() const { return directions_; }
    /// The least and greatest coordinate across of a direction's targets, mm; the first is greater than the
    /// second where it has none.
    [[nodiscard]] std::array<double, 2> across(std::size_t direction) const;
    /// The stretches of a line, between two ends (mm), from which a cutter that covers `radius` mm around it
    /// covers some of its direction's targets.
    [[nodiscard]] Spans around(std::size_t direction, double across, double radius,
                               const std::array<double, 2>& ends) const;

private:
    /// Cells on lines through their middles. Lines are numbered by p·j − q·i, places on them by p·i + q·j: a
    /// cell / √(p² + q²) lies from one number to the next.
    struct Cells {
        int first = 0;                // the line lines[0] is
        std::vector<CellRuns> lines;  // of each run the first and last place
    };
    [[nodiscard]] double between(std::size_t direction) const;  // mm, from one number to the next
    void sort_targets(std::span<const CellRuns> rows, const std::vector<std::uint8_t>& direction_of,
                      int side);

    CellGrid grid_;
    std::vector<LineDirection> directions_;
    std::vector<Cells> cells_;  // by direction
};

}  // namespace slabwright
