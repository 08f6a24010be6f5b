// What is left standing: slabs bonded one on another, each a height field over its own bottom.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "kernels/geometry/vectors.h"
#include "kernels/stock/level_region.h"
#include "kernels/stock/sweep.h"

namespace slabwright {

/// What one motion did to the stock, over the cells of one piece of it.
struct CutEffect {
    double removed = 0;             ///< mm of height summed over cells: times cell² it is a volume
    double deepest = 0;             ///< mm that one cell lost, at most
    double highest = -kUnbounded;   ///< z of the highest stock that the motion took, before it was taken
    double lowest = kUnbounded;     ///< z of the lowest point cut
    std::array<double, 2> where{};  ///< the cell that lost most
    std::uint64_t deep_cells = 0;   ///< cells that lost more than `deep`
    double deep_across = 0;  ///< how many cells wide they lie on average: their number over the longer of
                             ///< their rows and the fullest row
};

/// What a region cut to one height lost.
struct LevelEffect {
    double removed = 0, deepest = 0;  ///< as in CutEffect
    double lowest = kUnbounded;       ///< z of what was cut
};

/// The stock over a rectangle of cells. Slabs are added from below; a column that is cut through a slab's
/// bottom shows what stands below it, and is cut there too. Under the first slab lies the base board, whose
/// cuts are kept as well.
class Stock {
public:
    explicit Stock(const CellGrid& grid);

    /// Bonds a slab of `thickness` mm with its bottom at z_bottom, at or above what was added before.
    void add_slab(double z_bottom, double thickness);
    /// The same with a slab that covers less than the grid: where the middle of a cell lies outside of
    /// [low, high] (mm, x and y), nothing of it stands.
    void add_slab(double z_bottom, double thickness, const std::array<double, 2>& low,
                  const std::array<double, 2>& high);

    /// Takes away what the cutter meets on its way. Cells that lose more than `deep` mm are counted. @param
    /// chain as for sweep_above: what another motion of the chain gets as low or lower is left to that one
    CutEffect cut(const CutterEnd& end, const std::array<double, 3>& from, const std::array<double, 3>& to,
                  double deep = kUnbounded, const ChainedSweep& chain = {});
    /// The same along a level arc.
    CutEffect cut(const CutterEnd& end, const LevelArc& arc, double deep = kUnbounded);
    /// The same down to z in a whole region of this stock's grid, at once; nothing at all where a cell would
    /// lose more than `most` mm, or more than the topmost slab.
    std::optional<LevelEffect> cut(LevelRegion& region, double z, double most);

    /// Fills holes in the topmost slab: its surface goes up to z in cells whose middles lie within `radius`
    /// mm of a place, where it lies between `lowest` and z (mm).
    void fill(const std::array<double, 2>& middle, double radius, double lowest, double z);

    /// Whether nothing of the topmost slab stands higher than z over the cells within [x0, x1] × [y0, y1].
    /// Told from blocks of cells whose highest is known, or was when they stood higher; one that does not
    /// tell is looked at again.
    [[nodiscard]] bool clear(double x0, double x1, double y0, double y1, double z);

    /// Largest height by which stock stands above the lower face of an upright cylinder (shank or holder)
    /// anywhere on its way; 0 when it is free. `where` gets the place.
    [[nodiscard]] double reach(double radius, const std::array<double, 3>& from,
                               const std::array<double, 3>& to, std::array<double, 2>& where) const;

    /// z of the slab's surface in a cell; its bottom when it is cut through.
    [[nodiscard]] double surface(std::size_t slab, std::size_t cell) const {
        return slabs_[slab].bottom + slabs_[slab].height[cell];
    }
    /// The same of all cells.
    [[nodiscard]] StandingHeights standing(std::size_t slab) const {
        return {slabs_[slab].height.data(), slabs_[slab].bottom};
    }
    /// z of the highest stock in a column, 0 or less on the bare board.
    [[nodiscard]] double top(std::size_t cell) const;
    /// The same of all columns.
    [[nodiscard]] double highest() const;
    /// mm cut into the base board.
    [[nodiscard]] double board_cut(std::size_t cell) const { return board_[cell]; }
    [[nodiscard]] std::size_t slabs() const { return slabs_.size(); }
    [[nodiscard]] const CellGrid& grid() const { return grid_; }
    [[nodiscard]] std::uint64_t bytes() const { return grid_.count() * 4 * (slabs_.size() + 1); }

private:
    class Taking;
    struct Slab {
        double bottom, thickness;
        std::vector<float> height;  ///< above the slab's bottom: a float holds 50 mm to 4e-6
    };
    CellGrid grid_;
    std::vector<Slab> slabs_;
    std::vector<float> board_;
    std::vector<float> block_tops_;  ///< of the topmost slab, no less than the highest of each block of
                                     ///< cells, rows of blocks
};

}  // namespace slabwright
