// What semi-roughing is to cut: cells of a layer's stock that are worth a visit, level by level.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "engine/job.h"
#include "engine/stock/layer_stock.h"
#include "kernels/cutting/drop.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// mm over a level's tip: less is nothing to cut.
inline constexpr float kStandsOverLevel = 0.05F;

class LevelTargets {
public:
    /// @param limit mm along the normal of the surface: cells on which more is left over now
    LevelTargets(Context& context, const LayerStock& stock, double limit, const Tool& tool);
    [[nodiscard]] bool none() const { return left_over_.empty(); }
    [[nodiscard]] std::uint64_t bytes() const {
        return marked_.size() * sizeof(marked_[0]) +
               left_over_.size() * (sizeof(left_over_[0]) + sizeof(cells_[0]));
    }

    /// From here on cells are left alone on levels on which they lie within the swath of walls, as seen from
    /// the middle of the block that they are in.
    /// @param wall   a flat cutter of the swath's radius: it cannot stand there
    /// @param swath  mm
    /// @param lowest mm above the layer's bottom, of all levels
    /// @param floors mm; what stands on one of them is a target all the same, for no ball makes a floor
    void leave_walls(Context& context, const DropIndex& wall, double swath, double lowest,
                     std::span<const double> floors);

    /// Whether a level has any, as things are. @param tip, over as for mark()
    [[nodiscard]] bool any(double tip, double over) const;

    /// Marks the cells of a level.
    /// @param tip  mm above the layer's bottom
    /// @param over mm above the layer's bottom: only what lies over a surface that is higher
    void mark(double tip, double over);
    /// Of the level, row after row.
    [[nodiscard]] const std::vector<std::array<int, 2>>& cells() const { return cells_; }

    /// Whether a cutter whose middle is here (mm) meets one that still stands; a ball, one that it lowers by
    /// enough.
    [[nodiscard]] bool met(double x, double y);

private:
    static constexpr int kTile = 16;  // cells
    struct LeftOver {
        int i = 0, j = 0;
        float wall = -std::numeric_limits<float>::infinity();  // mm above the layer's bottom: on a level
                                                               // below, a wall is near
    };
    [[nodiscard]] bool is_target(const LeftOver& cell, float tip, double over) const;
    [[nodiscard]] std::size_t tile(int i, int j) const {
        return static_cast<std::size_t>(j / kTile) * static_cast<std::size_t>(tiles_x_) +
               static_cast<std::size_t>(i / kTile);
    }
    // Of a cell's tile, the row that it is in.
    [[nodiscard]] std::size_t row_of(int i, int j) const {
        return tile(i, j) * kTile + static_cast<std::size_t>(j % kTile);
    }
    // Whether a ball at a level's height, its axis so far from a cell's middle (mm²), lowers it by what is
    // worth it.
    [[nodiscard]] bool lowers_enough(std::size_t c, double away2, float tip) const;
    // Whether the one that was met last is met here too: places follow each other along a ring.
    [[nodiscard]] bool meets_as_before(double x, double y, double r) const;
    // A cutter whose middle is in one of the tiles around may meet what is in this one.
    void come_near(int ti, int tj);

    const LayerStock& stock_;
    double limit_, radius_;
    bool ball_;
    int reach_;  // of the cutter, tiles
    float tip_ = 0;
    int tiles_x_;
    std::vector<char> tiles_;            // that hold targets
    std::vector<char> near_;             // within reach of such
    std::vector<std::uint16_t> marked_;  // tile after tile, row after row, a bit for each cell
    std::vector<std::size_t> near_tiles_;
    std::array<int, 2> met_{-1, 0};          // at the last place that met one
    std::vector<LeftOver> left_over_;        // row after row
    std::vector<std::array<int, 2>> cells_;  // the level's, row after row
};

}  // namespace slabwright
