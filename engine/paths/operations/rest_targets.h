// What a rest pass is to lower: the cells of the stock that are worth a visit.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "engine/paths/operations/line_directions.h"
#include "engine/paths/operations/rest.h"
#include "kernels/cutting/drop.h"
#include "kernels/parallel/context.h"

namespace slabwright {

// The greatest number under a height: what stands over it is as high or higher.
inline double just_under(double z) { return std::nextafter(z, -std::numeric_limits<double>::infinity()); }

// The cells worth a visit, row by row.
class RestTargets {
public:
    /// @param probe a flat cutter as wide as the limit, or less: where its rest is as high as what stands,
    /// that is as near to a wall beside it
    /// @param reach of the cutter, mm
    RestTargets(Context& context, const LayerStock& stock, const RestPass& pass, double steep,
                const DropIndex* probe, double reach_mm);
    [[nodiscard]] std::size_t count() const { return count_; }
    /// No cell that is marked within the cutter's reach stands higher, mm above the layer's bottom; −infinity
    /// where none is.
    [[nodiscard]] float highest_near(double x, double y) const {
        const CellGrid& grid = stock_.grid();
        const auto tile = [&](double at, double from, int n) {
            return std::clamp(static_cast<int>((at - from) / grid.cell + 0.5), 0, n - 1) / kTile;
        };
        return highest_[static_cast<std::size_t>(tile(y, grid.y0, grid.ny)) * tiles_x_ +
                        static_cast<std::size_t>(tile(x, grid.x0, grid.nx))];
    }
    /// Calls fn(i, j) for marked cells within `reach` mm of a place, all that stand over `above` mm among
    /// them, until one returns true; whether one did.
    template <class Fn>
    [[nodiscard]] bool any_near(double x, double y, double reach, double above, Fn&& fn) const {
        const CellGrid& grid = stock_.grid();
        const int i0 = std::max(0, static_cast<int>(std::ceil((x - reach - grid.x0) / grid.cell))),
                  i1 = std::min(grid.nx - 1, static_cast<int>(std::floor((x + reach - grid.x0) / grid.cell))),
                  j0 = std::max(0, static_cast<int>(std::ceil((y - reach - grid.y0) / grid.cell))),
                  j1 = std::min(grid.ny - 1, static_cast<int>(std::floor((y + reach - grid.y0) / grid.cell)));
        for (int tj = j0 / kTile; tj * kTile <= j1; ++tj)
            for (int ti = i0 / kTile; ti * kTile <= i1; ++ti) {
                const Tile& tile =
                    tiles_[static_cast<std::size_t>(tj) * tiles_x_ + static_cast<std::size_t>(ti)];
                if (tile.highest <= above) continue;
                for (int j = std::max(j0, tj * kTile); j <= std::min(j1, tj * kTile + kTile - 1); ++j) {
                    auto marked = static_cast<std::uint8_t>(tile.marked >> kTile * (j % kTile));
                    if (marked == 0) continue;
                    const double dy = grid.y(j) - y, w = std::sqrt(std::max(0.0, reach * reach - dy * dy));
                    const int first = static_cast<int>(std::ceil((x - w - grid.x0) / grid.cell)),
                              last = static_cast<int>(std::floor((x + w - grid.x0) / grid.cell));
                    for (; marked != 0; marked &= static_cast<std::uint8_t>(marked - 1))
                        if (const int i = ti * kTile + std::countr_zero(marked);
                            i >= first && i <= last && fn(i, j))
                            return true;
                }
            }
        return false;
    }
    /// Those of which no more than this (mm along the normal) is left now are not near any more.
    void forget(double enough);
    [[nodiscard]] std::array<int, 2> rows() const {
        int first = 0, last = stock_.grid().ny - 1;
        while (first <= last && rows_[static_cast<std::size_t>(first)].empty()) ++first;
        while (last >= first && rows_[static_cast<std::size_t>(last)].empty()) --last;
        return {first, last};
    }
    /// The marked cells of a row, and of all.
    [[nodiscard]] const CellRuns& row(int j) const { return rows_[static_cast<std::size_t>(j)]; }
    [[nodiscard]] std::span<const CellRuns> all_rows() const { return rows_; }

private:
    /// Leaves out the cells of tiles with a slope that is left, and of those beside them: the foot of a
    /// fillet is level, too.
    void leave_slopes(const std::vector<char>& sloped);
    void find_highest(double reach);

    static constexpr int kTile = 8;  // cells
    static constexpr float kNone = -std::numeric_limits<float>::infinity();
    // Of the cells that are marked.
    struct Tile {
        std::uint64_t marked = 0;  // a bit each, eight a row
        float highest = kNone;     // when they were last looked at: cutting only lowers them
    };
    const LayerStock& stock_;
    std::vector<CellRuns> rows_;
    std::size_t count_ = 0, tiles_x_ = 0;
    std::vector<Tile> tiles_;
    std::vector<float> highest_;  // by tile
};

}  // namespace slabwright
