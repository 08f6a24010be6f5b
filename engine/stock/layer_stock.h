// What stands of one layer while it is planned: the slab, cut by the operations planned so far, over the
// finished surface.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "engine/layer_job.h"
#include "kernels/cutting/layer_solid.h"
#include "kernels/mesh/bulk_memory.h"
#include "kernels/parallel/context.h"
#include "kernels/parallel/scratch_pool.h"
#include "kernels/stock/sweep.h"

namespace slabwright {

/// y of a grid's rows, 0.1 µm.
[[nodiscard]] std::vector<double> rows_of(const CellGrid& grid);

/// mm: less than this off a cell is nothing done.
inline constexpr float kEmpty = 0.01F;

/// What an operation took off a stock, along the normal of the surface below. A cell's centre that lies on a
/// wall to within rounding may stand in one stock and not in another, and a cell stands for no more than its
/// centre, so a few cells alone, a trace off some, however tall, or a shallow one off many are no reason to
/// go there. Where many lost something, no more than that need be counted.
struct Taken {
    static constexpr std::size_t kFew = 4, kSome = 8;
    static constexpr double kTrace = 0.5;  ///< mm³
    float most = 0;                        ///< mm that one cell lost
    double mm3 = 0;
    std::size_t cells = 0;  ///< that lost more than kEmpty of height
    [[nodiscard]] bool nothing() const {
        return (few() && most < 0.4F) || (mm3 < kTrace && (most < 0.2F || cells < kSome));
    }
    [[nodiscard]] bool few() const { return cells < kFew; }
};

/// What a layer's stock is kept in, of any content; one layer leaves it to the next, for new memory of that
/// size costs more than filling it.
struct StockMemory {
    BulkVector<float> height, surface, kept;
    BulkVector<std::uint8_t> nz;
};

/// Tiles of a height field as they were before they were changed.
class KeptTiles {
public:
    static constexpr int kTile = 64;  ///< cells
    /// @param memory to keep them in: of its pages only those are touched that hold tiles
    explicit KeptTiles(const CellGrid& grid, BulkVector<float> memory = {});

    /// Keeps the tiles that the cells [i0, i1] × [j0, j1] lie in, but for those that are kept already.
    void keep(const float* height, int i0, int i1, int j0, int j1);
    /// Keeps those of a row of tiles that are kept in `row`, which begins at its first cell, as they are
    /// there. Rows may be added by several threads at once, if there is room.
    void add(int tile_row, const KeptTiles& row);
    /// Keeps what is kept in another of the same grid, as it is there.
    void add(const KeptTiles& later);
    /// Makes all kept tiles what they were.
    void put_back(float* height) const;
    /// Calls fn(kept, first cell, n) for all rows of n cells that are kept.
    template <class Fn>
    void rows(Fn&& fn) const {
        for (std::size_t t = 0; t < is_kept_.size(); ++t) {
            if (is_kept_[t] == 0) continue;
            const int i = static_cast<int>(t % tiles_x_) * kTile, j = static_cast<int>(t / tiles_x_) * kTile,
                      n = std::min(kTile, nx_ - i);
            const float* kept = memory_.data() + t * kCells;
            for (int k = j; k < std::min(ny_, j + kTile); ++k, kept += kTile)
                fn(kept,
                   static_cast<std::size_t>(k) * static_cast<std::size_t>(nx_) + static_cast<std::size_t>(i),
                   n);
        }
    }
    void make_room() {
        if (memory_.size() != is_kept_.size() * kCells)
            memory_.clear(), memory_.resize(is_kept_.size() * kCells);
    }
    [[nodiscard]] BulkVector<float> release() { return std::move(memory_); }

private:
    static constexpr std::size_t kCells = std::size_t{kTile} * kTile;
    int nx_, ny_;
    std::size_t tiles_x_;
    std::vector<std::uint8_t> is_kept_;  // by tile
    BulkVector<float> memory_;           // kCells for each
};

/// Heights over a grid of cells, mm above the layer's bottom; each stands for its cell's centre, where it is
/// exact (kernels/stock/sweep). Only what lies within the layer is kept: cuts below its bottom clear nothing
/// that is left to do.
class LayerStock {
public:
    /// The faced slab, `cell` mm fine, and the upper surface of the layer's solid over the same cells.
    LayerStock(Context& context, const LayerJob& layer, const LayerSolid& solid, double cell,
               StockMemory memory = {});
    /// What it was kept in.
    [[nodiscard]] StockMemory release() && { return std::move(memory_); }

    /// Takes away what the operation's feed moves meet, all of them straight (arcs are fitted when a layer is
    /// planned). Rows in parallel.
    Taken cut(Context& context, const Operation& operation, const Tool& tool);
    /// Whether an operation that keeps off the part by less than a cell (Operation::spare) has cut near a
    /// rectangle, mm: what it left may stand between the cells' centres.
    [[nodiscard]] bool may_hide_remains(const std::array<double, 2>& low,
                                        const std::array<double, 2>& high) const;
    /// Takes away what one place of a cutter covers.
    void cut_at(const CutterEnd& end, double x, double y, double tip_z);
    /// Takes away what a cutter covers whose tip goes straight between two places, mm.
    /// @param been it has already taken away what it covers at the first
    void cut_along(const CutterEnd& end, const std::array<double, 3>& from, const std::array<double, 3>& to,
                   bool been = false);

    [[nodiscard]] std::span<const float> heights() const { return memory_.height; }

    /// What is cut while it lives, within another trial or not, can be undone.
    class Trial {
    public:
        explicit Trial(LayerStock& stock)
            : stock_(stock), kept_(stock.grid_, std::move(stock.memory_.kept)), outer_(stock.trial_) {
            stock.trial_ = this;
        }
        ~Trial();
        Trial(const Trial&) = delete;
        Trial& operator=(const Trial&) = delete;
        /// The stock stands as it did when the trial began, and the trial is over.
        void undo();

    private:
        friend class LayerStock;
        void end();
        LayerStock& stock_;
        KeptTiles kept_;
        Trial* outer_;
        bool over_ = false;
    };

    [[nodiscard]] const CellGrid& grid() const { return grid_; }
    [[nodiscard]] double z_bottom() const { return z_bottom_; }
    /// mm above the layer's bottom
    [[nodiscard]] float height(std::size_t cell) const { return memory_.height[cell]; }
    [[nodiscard]] float surface(std::size_t cell) const { return memory_.surface[cell]; }
    /// Share of a height that is a distance from the facet below: the upward part of its normal; 1 beside the
    /// pattern.
    [[nodiscard]] float nz(std::size_t cell) const { return static_cast<float>(memory_.nz[cell]) / 255.0F; }
    /// What is left over in a cell, mm along the normal of the facet below.
    [[nodiscard]] float left(std::size_t cell) const { return (height(cell) - surface(cell)) * nz(cell); }

    /// Calls fn(i) for the cells of row j on which more than `limit` is left over. A row is for one thread at
    /// a time.
    template <class Fn>
    void each_left(int j, double limit, Fn&& fn) const {
        const float most = level_over(0, limit);
        float* const known = most_left_.data() + static_cast<std::size_t>(j) * words_;
        for (int i = 0; i < grid_.nx; i += kWord) {
            float& most_here = known[i / kWord];
            if (most_here <= most) continue;
            const std::size_t first = grid_.index(i, j);
            const float *const stands = memory_.height.data() + first, *const surface =
                                                                           memory_.surface.data() + first;
            const std::uint8_t* const nz = memory_.nz.data() + first;
            const int n = std::min(kWord, grid_.nx - i);
            std::uint64_t bits = cells_left(stands, surface, nz, n, most);
            // What a trial cuts may come back.
            if (bits == 0 && trial_ == nullptr) most_here = most_left(stands, surface, nz, n);
            for (; bits != 0; bits &= bits - 1) fn(i + std::countr_zero(bits));
        }
    }

    /// mm² on which more than `limit` (mm along the normal) is left over.
    [[nodiscard]] double area_over(Context& context, double limit) const;
    /// mm³ that stand there over the surface.
    [[nodiscard]] double volume_over(Context& context, double limit) const;

    /// Bytes of the stock of a layer of `plane_mm2` with the finest ball of the job, and of what a trial may
    /// keep of its heights.
    [[nodiscard]] static std::uint64_t bytes(const Job& job, double plane_mm2);

private:
    static constexpr int kWord = 64;  // cells that are asked together

    CellGrid grid_;
    double z_bottom_ = 0, z_top_ = 0;
    StockMemory memory_;
    std::size_t words_ = 0;             // of a row
    static constexpr int kHiding = 16;  // cells: what hides remains is noted by squares of this side
    std::vector<char> hides_;           // by square; empty: none does
    void note_hidden(std::span<const Move> moves, double radius);
    mutable std::vector<float>
        most_left_;  // by word: no more than that is left over, now or later; what each_left() has found
    Trial* trial_ = nullptr;  // the innermost
};

/// Cells that resolve what passes of the layer's finest ball leave: a quarter of their distance, coarser
/// where the layer would take more than kStockCells of them.
inline constexpr double kStockCells = 8e6;
[[nodiscard]] double stock_cell(const LayerJob& layer);

[[nodiscard]] inline CutterEnd cutter_end(const Tool& tool) { return cutter_end(cutter_shape(tool)); }

}  // namespace slabwright
