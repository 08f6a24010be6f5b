// What stands of one layer while it is planned: the slab, cut by the operations planned so far, over the finished surface.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/paths/layer_cut.h"
#include "kernels/stock/sweep.h"

namespace slabwright {

/// y of a grid's rows, 0.1 µm.
[[nodiscard]] std::vector<double> rows_of(const CellGrid& grid);

/// mm: less than this off a cell is nothing done.
inline constexpr float kEmpty = 0.01F;

/// What an operation took off a stock. A cell's centre that lies on a wall to within rounding may stand in one stock and not in another,
/// so a few cells alone are no reason to go there.
struct Taken {
    float most = 0;         ///< mm that one cell lost
    std::size_t cells = 0;  ///< that lost more than kEmpty
    [[nodiscard]] bool nothing() const { return cells < 4 && most < 0.4F; }
    [[nodiscard]] bool few() const { return cells < 4; }
};

/// Heights over a grid of cells, mm above the layer's bottom; each stands for its cell's centre, where it is exact (kernels/stock/sweep).
/// Only what lies within the layer is kept: cuts below its bottom clear nothing that is left to do.
class LayerStock {
public:
    /// The faced slab, `cell` mm fine, and the solid's upper surface over the same cells.
    LayerStock(const LayerCut& cut, double cell);

    /// Takes away what the operation's feed moves meet, all of them straight (arcs are fitted when a layer is planned). Rows in parallel.
    Taken cut(const LayerCut& cut, const Operation& operation, const Tool& tool);
    /// Takes away what one place of a cutter covers.
    void cut_at(const CutterEnd& end, double x, double y, double tip_z);

    /// A copy of all heights, to try something and undo it. One that was undone leaves its memory to the next: new memory of that size costs more than
    /// the copying.
    [[nodiscard]] std::vector<float> heights() {
        std::vector<float> copy = std::move(spare_);
        copy.assign(height_.begin(), height_.end());
        return copy;
    }
    void restore(std::vector<float> heights) {
        height_.swap(heights);
        spare_ = std::move(heights);
    }

    [[nodiscard]] const CellGrid& grid() const { return grid_; }
    [[nodiscard]] double z_bottom() const { return z_bottom_; }
    /// mm above the layer's bottom
    [[nodiscard]] float height(std::size_t cell) const { return height_[cell]; }
    [[nodiscard]] float surface(std::size_t cell) const { return surface_[cell]; }
    /// Share of a height that is a distance from the facet below: the upward part of its normal; 1 beside the pattern.
    [[nodiscard]] float nz(std::size_t cell) const { return static_cast<float>(nz_[cell]) / 255.0F; }
    /// What is left over in a cell, mm along the normal of the facet below.
    [[nodiscard]] float left(std::size_t cell) const { return (height_[cell] - surface_[cell]) * nz(cell); }

    /// mm² on which more than `limit` (mm along the normal) is left over.
    [[nodiscard]] double area_over(Context& context, double limit) const;

    /// Bytes of the stock of a layer of `plane_mm2` with the finest ball of the job, and of a copy of its heights.
    [[nodiscard]] static std::uint64_t bytes(const Job& job, double plane_mm2);

private:
    CellGrid grid_;
    double z_bottom_ = 0;
    std::vector<float> height_, surface_, spare_;
    std::vector<std::uint8_t> nz_;
};

/// Cells that resolve what passes of the layer's finest ball leave: a quarter of their distance, coarser where the layer would
/// take more than kStockCells of them.
inline constexpr double kStockCells = 24e6;
[[nodiscard]] double stock_cell(const LayerCut& cut);

[[nodiscard]] CutterEnd cutter_end(const Tool& tool);

}  // namespace slabwright
