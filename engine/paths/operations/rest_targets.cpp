#include "engine/paths/operations/rest_targets.h"

#include <atomic>
#include <functional>
#include <utility>

#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr float kRise = 0.5F;  // mm: a wall that is lower than what stands beside it by less is as high
constexpr float kLevel = 0.966F,
                kUpright = 0.259F;  // of a normal, upward: within 15° of level and of upright

}  // namespace

RestTargets::RestTargets(Context& context, const LayerStock& stock, const RestPass& pass, double steep,
                         const DropIndex* probe, double reach_mm)
    : stock_(stock), rows_(static_cast<std::size_t>(stock.grid().ny)) {
    const CellGrid& grid = stock.grid();
    // Places around a cell, the nearest first.
    std::vector<std::array<int, 3>> around;
    const int reach = static_cast<int>(pass.swath / grid.cell);
    for (int dj = -reach; dj <= reach; ++dj)
        for (int di = -reach; di <= reach; ++di)
            if (di * di + dj * dj <= reach * reach) around.push_back({di * di + dj * dj, di, dj});
    std::sort(around.begin(), around.end());
    // Whether the nearest of the surface that is as high as what stands here rises steeply.
    auto beside_wall = [&](int i, int j) {
        const std::size_t here = grid.index(i, j);
        for (const auto& [far, di, dj] : around) {
            if (i + di < 0 || i + di >= grid.nx || j + dj < 0 || j + dj >= grid.ny) continue;
            const std::size_t c = grid.index(i + di, j + dj);
            const double rise = static_cast<double>(stock.surface(c)) - stock.surface(here);
            if (stock.surface(c) >= stock.height(here) - kRise && rise > 0)
                return rise >= std::tan(steep) * std::sqrt(far) * grid.cell;
        }
        return false;
    };
    const int nx = (grid.nx + kTile - 1) / kTile, ny = (grid.ny + kTile - 1) / kTile;
    tiles_x_ = static_cast<std::size_t>(nx);
    const auto tile = [&](int i, int j) {
        return static_cast<std::size_t>(j / kTile) * tiles_x_ + static_cast<std::size_t>(i / kTile);
    };
    std::vector<char> sloped(pass.on_slopes ? 0 : tiles_x_ * static_cast<std::size_t>(ny), 0);
    constexpr std::size_t grain = 16;  // rows
    count_ = parallel_reduce(
        context, rows_.size(), grain, std::size_t{0},
        [&](std::size_t begin, std::size_t end) {
            std::size_t count = 0;
            for (std::size_t r = begin; r < end; ++r)
                stock.each_left(static_cast<int>(r), pass.limit, [&, j = static_cast<int>(r)](int i) {
                    if (const float nz = stock.nz(grid.index(i, j));
                        !pass.on_slopes && nz > kUpright && nz < kLevel) {
                        std::atomic_ref(sloped[tile(i, j)]).store(1, std::memory_order_relaxed);
                        return;
                    }
                    if (reach > 0 && beside_wall(i, j)) return;
                    const double stands = stock.z_bottom() + stock.height(grid.index(i, j));
                    if (probe && probe->stands_over(grid.x(i), grid.y(j), just_under(stands - 1e-3))) return;
                    ++count;
                    if (!rows_[r].empty() && rows_[r].back()[1] + 1 == i) rows_[r].back()[1] = i;
                    else rows_[r].push_back({i, i});
                });
            return count;
        },
        std::plus<>());
    if (!pass.on_slopes) leave_slopes(sloped);
    find_highest(reach_mm);
}

void RestTargets::leave_slopes(const std::vector<char>& sloped) {
    const int nx = static_cast<int>(tiles_x_), ny = static_cast<int>(sloped.size() / tiles_x_);
    std::vector<char> near = sloped;
    for (int j = 0; j < ny; ++j)
        for (int i = 0; i < nx; ++i)
            if (sloped[static_cast<std::size_t>(j) * tiles_x_ + static_cast<std::size_t>(i)])
                for (int l = std::max(0, j - 1); l <= std::min(ny - 1, j + 1); ++l)
                    for (int k = std::max(0, i - 1); k <= std::min(nx - 1, i + 1); ++k)
                        near[static_cast<std::size_t>(l) * tiles_x_ + static_cast<std::size_t>(k)] = 1;
    count_ = 0;
    for (std::size_t j = 0; j < rows_.size(); ++j) {
        CellRuns kept;
        for (const auto& [first, last] : rows_[j])
            for (int i = first; i <= last; ++i) {
                if (near[j / kTile * tiles_x_ + static_cast<std::size_t>(i / kTile)]) continue;
                ++count_;
                if (!kept.empty() && kept.back()[1] + 1 == i) kept.back()[1] = i;
                else kept.push_back({i, i});
            }
        rows_[j] = std::move(kept);
    }
}

void RestTargets::forget(double enough) {
    const CellGrid& grid = stock_.grid();
    for (std::size_t t = 0; t < tiles_.size(); ++t) {
        Tile& tile = tiles_[t];
        tile.highest = kNone;
        for (std::uint64_t left = tile.marked; left != 0; left &= left - 1) {
            const int bit = std::countr_zero(left);
            const std::size_t c = grid.index(static_cast<int>(t % tiles_x_) * kTile + bit % kTile,
                                             static_cast<int>(t / tiles_x_) * kTile + bit / kTile);
            if (static_cast<double>(stock_.left(c)) <= enough) tile.marked &= ~(std::uint64_t{1} << bit);
            else tile.highest = std::max(tile.highest, stock_.height(c));
        }
    }
}

void RestTargets::find_highest(double reach) {
    if (count_ == 0) return;
    const CellGrid& grid = stock_.grid();
    const int nx = static_cast<int>(tiles_x_), ny = (grid.ny + kTile - 1) / kTile;
    tiles_.assign(tiles_x_ * static_cast<std::size_t>(ny), {});
    for (std::size_t j = 0; j < rows_.size(); ++j)
        for (const auto& [first, last] : rows_[j])
            for (int i = first; i <= last; ++i) {
                Tile& tile = tiles_[j / kTile * tiles_x_ + static_cast<std::size_t>(i / kTile)];
                tile.highest = std::max(tile.highest, stock_.height(grid.index(i, static_cast<int>(j))));
                tile.marked |= std::uint64_t{1}
                               << (kTile * (j % kTile) + static_cast<std::size_t>(i % kTile));
            }
    highest_.assign(tiles_.size(), kNone);
    const double far = reach / grid.cell;  // cells
    const int tiles = static_cast<int>(far / kTile) + 1;
    for (int j = 0; j < ny; ++j)
        for (int i = 0; i < nx; ++i) {
            const float here =
                tiles_[static_cast<std::size_t>(j) * tiles_x_ + static_cast<std::size_t>(i)].highest;
            if (here == kNone) continue;
            for (int dj = -std::min(tiles, j); dj <= std::min(tiles, ny - 1 - j); ++dj)
                for (int di = -std::min(tiles, i); di <= std::min(tiles, nx - 1 - i); ++di) {
                    float& there = highest_[static_cast<std::size_t>(j + dj) * tiles_x_ +
                                            static_cast<std::size_t>(i + di)];
                    there = std::max(there, here);
                }
        }
}

}  // namespace slabwright
