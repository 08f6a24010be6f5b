// Stock as a grid of cells, pieces as runs of cells, and where a piece has room (METHOD.md section 13).
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "kernels/polygons/loops.h"

namespace slabwright {

/// Cells in a row from `first` to `last`, both of them in it.
struct CellRun {
    int row = 0, first = 0, last = 0;
};

/// A piece as the cells that it touches, from the low corner of its box.
struct CellShape {
    Point2 low;  ///< of the box
    int columns = 0, rows = 0;
    std::vector<CellRun> runs;  ///< by row, then column; between two of a row lies a cell of neither
};

/// Every cell that a region touches: those that its edges pass, and those that it covers. Never fewer, so
/// that regions whose cells lie apart lie apart.
/// @param cell side of a cell, 0.1 µm
[[nodiscard]] CellShape cells_of(const Loops& region, std::int64_t cell);

/// Which cells of a rectangle are taken, a bit each.
class NestGrid {
public:
    NestGrid(int columns, int rows);
    [[nodiscard]] int columns() const { return columns_; }
    [[nodiscard]] int rows() const { return rows_; }
    /// The last taken cell of a row from column `first` to `last`, which are in the grid; −1: none is.
    [[nodiscard]] int last_taken(int row, int first, int last) const;
    void take(const CellShape& shape, int column, int row);
    void take(int row, int first, int last);  ///< what of it is in the grid

private:
    int columns_, rows_;
    std::size_t words_;
    std::vector<std::uint64_t> bits_;
};

struct CellSpot {
    int column = 0, row = 0;
};

/// The lowest place at which a shape meets no taken cell, and there the leftmost. What is in its way says how
/// far on the next place is, so few places are tried.
/// @param most_rows the shape must end at this row of the grid or below
[[nodiscard]] std::optional<CellSpot> lowest_spot(const NestGrid& taken, const CellShape& shape,
                                                  int most_rows);

}  // namespace slabwright
