// In which direction lines are laid over what is to be lowered: along corners, creases and fillets rather
// than across them, so that they are few and long.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/parallel/context.h"
#include "kernels/stock/cell_grid.h"

namespace slabwright {

/// Of a row of cells, first and last of each run.
using CellRuns = std::vector<std::array<int, 2>>;

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
/// farthest, and along one axis where others do not reach much farther.
class LineDirections {
public:
    enum Usual : std::uint8_t { along_x = 0, along_y = 4 };  ///< numbers of directions

    /// @param rows the targets, row by row of the grid
    /// @param radius of the cutter, mm
    /// @param least mm that the targets around it must reach for a direction of their own
    LineDirections(Context& context, const CellGrid& grid, std::span<const CellRuns> rows, double radius,
                   Usual usual = along_x, double least = 0);

    [[nodiscard]] std::span<const LineDirection> all() const { return directions_; }
    /// Whether the lines over a place, mm, have another direction: there are targets near it, and theirs is.
    [[nodiscard]] bool is_another(std::size_t direction, double x, double y) const {
        const std::uint8_t there = of_blocks_[block_at(x, y)];
        return there != kNone && there != direction;
    }
    /// How many blocks of targets of a direction lie in the rectangles from the grid's corner: see
    /// has_some().
    [[nodiscard]] std::vector<std::uint32_t> counts(std::size_t direction) const;
    /// Whether a rectangle, mm, meets a block of targets of the direction that these are the counts() of.
    [[nodiscard]] bool has_some(std::span<const std::uint32_t> counts, const std::array<double, 2>& low,
                                const std::array<double, 2>& high) const;
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
    void sort_targets(std::span<const CellRuns> rows);

    [[nodiscard]] std::array<int, 2> block_of(double x, double y) const {
        const auto cell = [&](double at, double from, int n) {
            return std::clamp(static_cast<int>((at - from) / grid_.cell + 0.5), 0, n - 1) / side_;
        };
        return {cell(x, grid_.x0, grid_.nx), cell(y, grid_.y0, grid_.ny)};
    }
    [[nodiscard]] std::size_t block_at(double x, double y) const {
        const auto [i, j] = block_of(x, y);
        return static_cast<std::size_t>(j) * blocks_x_ + static_cast<std::size_t>(i);
    }

    static constexpr std::uint8_t kNone = 255;
    CellGrid grid_;
    std::vector<LineDirection> directions_;
    int side_ = 1;  // of a block, cells
    std::size_t blocks_x_ = 0;
    std::vector<std::uint8_t> of_blocks_;  // the number of a direction, kNone where there are no targets
    std::vector<Cells> cells_;             // by direction
};

}  // namespace slabwright
