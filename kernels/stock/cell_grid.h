// Cells seen from above, and what stands in them.
#pragma once

#include <cstddef>
#include <limits>

namespace slabwright {

/// Cells of one size; cell (i, j) stands for the point at its centre, (x0 + i·cell, y0 + j·cell), mm.
struct CellGrid {
    double x0 = 0, y0 = 0, cell = 1;
    int nx = 0, ny = 0;

    [[nodiscard]] double x(int i) const { return x0 + i * cell; }
    [[nodiscard]] double y(int j) const { return y0 + j * cell; }
    [[nodiscard]] std::size_t count() const {
        return static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny);
    }
    [[nodiscard]] std::size_t index(int i, int j) const {
        return static_cast<std::size_t>(j) * static_cast<std::size_t>(nx) + static_cast<std::size_t>(i);
    }
};

/// What stands in cells: heights over a level `bottom`, mm. Given as such to sweep_above, many cells are
/// compared at once.
struct StandingHeights {
    const float* height = nullptr;
    double bottom = 0;
    double operator()(std::size_t cell) const { return bottom + height[cell]; }
};

inline constexpr double kUncovered = std::numeric_limits<double>::infinity();

}  // namespace slabwright
