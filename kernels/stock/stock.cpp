#include "kernels/stock/stock.h"

namespace slabwright {

void Stock::add_slab(double z_bottom, double thickness) {
    slabs_.push_back({z_bottom, thickness, std::vector<float>(grid_.count(), static_cast<float>(thickness))});
}

/// Cuts by sweep(standing, fn), which gives every cell that the cutter gets lower than standing(cell).
template <class Sweep>
CutEffect Stock::take(double deep, Sweep&& sweep) {
    CutEffect effect;
    const auto nx = static_cast<std::size_t>(grid_.nx);
    std::size_t deepest_cell = 0;
    auto taken = [&](std::size_t cell, double before, double after, double& lost) {
        lost += before - after;
        effect.highest = std::max(effect.highest, before);
        effect.lowest = std::min(effect.lowest, after);
        effect.removed += before - after;
        if (lost > effect.deepest) effect.deepest = lost, deepest_cell = cell;
    };
    // The topmost slab's surface decides: a cutter that stays above it takes nothing there, nor of what lies below.
    const double bottom = slabs_.empty() ? 1e300 : slabs_.back().bottom;
    const float* const heights = slabs_.empty() ? board_.data() : slabs_.back().height.data();
    sweep(StandingHeights{heights, bottom}, [&](std::size_t cell, double z) {
        double lost = 0;
        for (std::size_t k = slabs_.size(); k-- > 0;) {
            Slab& slab = slabs_[k];
            float& height = slab.height[cell];
            if (height > 0) {
                const auto left = static_cast<float>(std::max(0.0, z - slab.bottom));
                if (left < height) {
                    taken(cell, slab.bottom + height, slab.bottom + left, lost);
                    height = left;
                }
            }
            if (z >= slab.bottom) break;
        }
        effect.deep_cells += lost > deep;
        if (-z > board_[cell]) {
            effect.lowest = std::min(effect.lowest, z);
            board_[cell] = static_cast<float>(-z);
        }
    });
    if (effect.deepest > 0) effect.where = {grid_.x(static_cast<int>(deepest_cell % nx)), grid_.y(static_cast<int>(deepest_cell / nx))};
    return effect;
}

CutEffect Stock::cut(const CutterEnd& end, const std::array<double, 3>& from, const std::array<double, 3>& to, double deep,
                     const ChainedSweep& chain) {
    return take(deep, [&](auto&& standing, auto&& fn) { sweep_above(grid_, end, from, to, standing, fn, chain); });
}

CutEffect Stock::cut(const CutterEnd& end, const LevelArc& arc, double deep) {
    return take(deep, [&](auto&& standing, auto&& fn) { sweep_above(grid_, end, arc, standing, fn); });
}

double Stock::top(std::size_t cell) const {
    for (std::size_t k = slabs_.size(); k-- > 0;)
        if (slabs_[k].height[cell] > 0) return slabs_[k].bottom + slabs_[k].height[cell];
    return -static_cast<double>(board_[cell]);
}

double Stock::reach(double radius, const std::array<double, 3>& from, const std::array<double, 3>& to, std::array<double, 2>& where) const {
    double most = 0;
    const double lowest = std::min(from[2], to[2]);
    if (!slabs_.empty() && lowest >= slabs_.back().bottom + slabs_.back().thickness) return 0;
    sweep(grid_, {CutterEnd::Form::flat, radius, 0}, from, to, [&](std::size_t cell, double z) {
        const double over = top(cell) - z;
        if (over > most) {
            most = over;
            const auto nx = static_cast<std::size_t>(grid_.nx);
            where = {grid_.x(static_cast<int>(cell % nx)), grid_.y(static_cast<int>(cell / nx))};
        }
    });
    return most;
}

}  // namespace slabwright
