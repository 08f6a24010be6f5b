#include "engine/paths/operations/level_targets.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>

#include "engine/paths/runs/layer_cut.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr double kEdge = 0.05;        // mm: what only the cutter's very edge meets was cut on the ring before
constexpr double kWorthOfBall = 0.5;  // mm that a ball must lower a cell by: its rings leave ridges
constexpr double kBlock = 0.125;      // of the swath of a wall: by how much it may be off

}  // namespace

LevelTargets::LevelTargets(Context& context, const LayerStock& stock, double limit, const Tool& tool)
    : stock_(stock),
      limit_(limit),
      radius_(clearing_radius(tool)),
      ball_(tool.kind == ToolKind::ball),
      reach_(1 + (static_cast<int>(radius_ / stock.grid().cell) + 1) / kTile),
      tiles_x_((stock.grid().nx + kTile - 1) / kTile),
      tiles_(static_cast<std::size_t>(tiles_x_) *
                 static_cast<std::size_t>((stock.grid().ny + kTile - 1) / kTile),
             0),
      near_(tiles_.size(), 0),
      marked_(tiles_.size() * kTile, 0) {
    // What is not left over now will not be on any level.
    const CellGrid& grid = stock.grid();
    std::vector<std::vector<LeftOver>> rows(static_cast<std::size_t>(grid.ny));
    parallel_each(context, rows.size(), [&](std::size_t j) {
        stock.each_left(static_cast<int>(j), limit, [&, row = static_cast<int>(j)](int i) {
            rows[j].push_back({i, row});
        });
    });
    for (const auto& row : rows) left_over_.insert(left_over_.end(), row.begin(), row.end());
}

void LevelTargets::leave_walls(Context& context, const DropIndex& wall, double swath, double lowest,
                               std::span<const double> floors) {
    const CellGrid& grid = stock_.grid();
    const auto on_floor = [&](std::size_t c) {
        const double z = stock_.z_bottom() + stock_.surface(c);
        return std::any_of(floors.begin(), floors.end(),
                           [&](double f) { return z <= f + 1e-3 && z >= f - kSameFloor - 1e-3; });
    };
    struct Block {
        double x = 0, y = 0;  // mm, its middle
        float highest = 0;    // mm above the layer's bottom, what stands in it
        float wall = 0;
    };
    const int side = std::max(1, static_cast<int>(kBlock * swath / grid.cell));
    std::vector<Block> blocks;
    std::vector<std::uint32_t> block_of(left_over_.size());
    // By column of blocks the latest; left_over_ goes row by row.
    std::vector<std::array<std::int64_t, 2>> latest(static_cast<std::size_t>(grid.nx / side + 1), {-1, -1});
    for (std::size_t k = 0; k < left_over_.size(); ++k) {
        const auto [i, j, none] = left_over_[k];
        const int column = i / side, row = j / side;
        auto& [in_row, block] = latest[static_cast<std::size_t>(column)];
        if (in_row != row) {
            in_row = row, block = static_cast<std::int64_t>(blocks.size());
            const double half = (side - 1) * grid.cell / 2;
            blocks.push_back({grid.x(column * side) + half, grid.y(row * side) + half});
        }
        block_of[k] = static_cast<std::uint32_t>(block);
        float& highest = blocks[block_of[k]].highest;
        highest = std::max(highest, stock_.height(grid.index(i, j)));
    }
    constexpr std::size_t grain = 128;
    parallel_for(context, blocks.size(), grain, [&](std::size_t begin, std::size_t end) {
        MetPoints met;
        for (std::size_t b = begin; b < end; ++b) {
            // Beside a wall as high as what stands there no level has anything of it.
            const std::optional<Rest> rest =
                wall.drop_within(blocks[b].x, blocks[b].y, stock_.z_bottom() + lowest,
                                 stock_.z_bottom() + static_cast<double>(blocks[b].highest), &met);
            blocks[b].wall = rest ? static_cast<float>(rest->tip_z - stock_.z_bottom())
                                  : std::numeric_limits<float>::infinity();
        }
    });
    for (std::size_t k = 0; k < left_over_.size(); ++k)
        if (LeftOver& cell = left_over_[k]; !on_floor(grid.index(cell.i, cell.j)))
            cell.wall = blocks[block_of[k]].wall;
    std::erase_if(left_over_,
                  [](const LeftOver& cell) { return cell.wall == std::numeric_limits<float>::infinity(); });
}

bool LevelTargets::any(double tip, double over) const {
    return std::any_of(left_over_.begin(), left_over_.end(),
                       [&](const LeftOver& cell) { return is_target(cell, static_cast<float>(tip), over); });
}

void LevelTargets::mark(double tip, double over) {
    const CellGrid& grid = stock_.grid();
    for (const auto& [i, j] : cells_) marked_[row_of(i, j)] = 0, tiles_[tile(i, j)] = 0;
    for (const std::size_t t : near_tiles_) near_[t] = 0;
    cells_.clear(), near_tiles_.clear();
    tip_ = static_cast<float>(tip);
    std::erase_if(left_over_, [&](const LeftOver& c) { return stock_.left(grid.index(c.i, c.j)) <= limit_; });
    for (const LeftOver& cell : left_over_) {
        if (!is_target(cell, tip_, over)) continue;
        const auto [i, j, wall] = cell;
        marked_[row_of(i, j)] |= static_cast<std::uint16_t>(1U << (i % kTile));
        if (!tiles_[tile(i, j)]) come_near(i / kTile, j / kTile);
        tiles_[tile(i, j)] = 1;
        cells_.push_back({i, j});
    }
}

bool LevelTargets::met(double x, double y) {
    const CellGrid& grid = stock_.grid();
    const auto cell = [&](double at, double from, int n) {
        return static_cast<int>(std::clamp((at - from) / grid.cell + 0.5, 0.0, n - 1.0));
    };
    if (!near_[tile(cell(x, grid.x0, grid.nx), cell(y, grid.y0, grid.ny))]) return false;
    const double r = std::max(radius_ - kEdge, radius_ / 2);
    if (meets_as_before(x, y, r)) return true;
    const int j0 = std::max(0, static_cast<int>(std::ceil((y - r - grid.y0) / grid.cell)));
    const int j1 = std::min(grid.ny - 1, static_cast<int>(std::floor((y + r - grid.y0) / grid.cell)));
    const int i0 = std::max(0, static_cast<int>(std::ceil((x - r - grid.x0) / grid.cell)));
    const int i1 = std::min(grid.nx - 1, static_cast<int>(std::floor((x + r - grid.x0) / grid.cell)));
    for (int tj = j0 / kTile; tj <= j1 / kTile && j0 <= j1; ++tj)
        for (int ti = i0 / kTile; ti <= i1 / kTile && i0 <= i1; ++ti) {
            if (!tiles_[static_cast<std::size_t>(tj) * static_cast<std::size_t>(tiles_x_) +
                        static_cast<std::size_t>(ti)])
                continue;
            std::uint16_t* const rows = &marked_[row_of(ti * kTile, tj * kTile)];
            for (int j = std::max(j0, tj * kTile); j <= std::min(j1, tj * kTile + kTile - 1); ++j) {
                if (rows[j % kTile] == 0) continue;
                const double dy = grid.y(j) - y, w = std::sqrt(std::max(0.0, r * r - dy * dy));
                const int first =
                    std::max(ti * kTile, static_cast<int>(std::ceil((x - w - grid.x0) / grid.cell)));
                const int last = std::min({ti * kTile + kTile - 1, grid.nx - 1,
                                           static_cast<int>(std::floor((x + w - grid.x0) / grid.cell))});
                if (first > last) continue;
                const std::uint32_t asked = ((2U << (last % kTile)) - 1U) & ~((1U << (first % kTile)) - 1U);
                for (std::uint32_t left = rows[j % kTile] & asked; left != 0; left &= left - 1) {
                    const int i = ti * kTile + std::countr_zero(left);
                    const std::size_t c = grid.index(i, j);
                    if (stock_.height(c) <= tip_ + kStandsOverLevel ||
                        (ball_ && !lowers_enough(c, 0, tip_))) {
                        rows[j % kTile] &= static_cast<std::uint16_t>(
                            ~(left & -left));  // nor does any place of the level lower it
                        continue;
                    }
                    if (ball_ && !lowers_enough(c, (grid.x(i) - x) * (grid.x(i) - x) + dy * dy, tip_))
                        continue;
                    met_ = {i, j};
                    return true;
                }
            }
        }
    return false;
}

bool LevelTargets::is_target(const LeftOver& cell, float tip, double over) const {
    const std::size_t c = stock_.grid().index(cell.i, cell.j);
    return stock_.height(c) > tip + kStandsOverLevel &&
           stock_.surface(c) <= std::max(tip, 0.0F) + kStandsOverLevel &&
           stock_.surface(c) > over + kStandsOverLevel && (!ball_ || lowers_enough(c, 0, tip)) &&
           tip >= cell.wall;
}

bool LevelTargets::lowers_enough(std::size_t c, double away2, float tip) const {
    const double most = stock_.height(c) - kWorthOfBall;
    if (stock_.surface(c) >= most || tip >= most) return false;
    return tip + radius_ - std::sqrt(std::max(0.0, radius_ * radius_ - away2)) < most;
}

bool LevelTargets::meets_as_before(double x, double y, double r) const {
    const CellGrid& grid = stock_.grid();
    const double within = r - 1e-6;  // mm: what rounding decides is left to met()
    const auto [i, j] = met_;
    if (i < 0 || (marked_[row_of(i, j)] >> (i % kTile) & 1) == 0) return false;
    const double dx = grid.x(i) - x, dy = grid.y(j) - y, away2 = dx * dx + dy * dy;
    if (away2 > within * within) return false;
    const std::size_t c = grid.index(i, j);
    return stock_.height(c) > tip_ + kStandsOverLevel && (!ball_ || lowers_enough(c, away2, tip_));
}

void LevelTargets::come_near(int ti, int tj) {
    const int tiles_y = static_cast<int>(tiles_.size()) / tiles_x_;
    for (int j = std::max(0, tj - reach_); j <= std::min(tiles_y - 1, tj + reach_); ++j)
        for (int i = std::max(0, ti - reach_); i <= std::min(tiles_x_ - 1, ti + reach_); ++i)
            if (const std::size_t t = tile(i * kTile, j * kTile); !near_[t])
                near_[t] = 1, near_tiles_.push_back(t);
}

}  // namespace slabwright
