#include "kernels/stock/stock.h"

#include "kernels/wide.h"

namespace slabwright {

void Stock::add_slab(double z_bottom, double thickness) {
    slabs_.push_back({z_bottom, thickness, std::vector<float>(grid_.count(), static_cast<float>(thickness))});
}

namespace {

// What one row of cells over a slab's bottom lost.
struct RowLoss {
    double removed = 0, most = 0, highest = -1e300, lowest = 1e300;
    int deepest = 0;  // the first cell that lost most
    std::uint64_t deep = 0;
};

// Lowers n cells to h where they stand higher, none to under the slab's bottom. Eight places for each figure, so that a compiler sees that
// the order of cells does not matter.
SLABWRIGHT_WIDE RowLoss lower_row(float* __restrict height, int n, const double* __restrict h, double bottom, double deep) {
    constexpr std::size_t lanes = 8;
    std::array<double, lanes> removed{}, most{}, highest, lowest;
    std::array<std::uint64_t, lanes> cells{};
    std::array<int, lanes> deepest{};
    highest.fill(-1e300), lowest.fill(1e300);
    const auto one = [&](int c, std::size_t k) {
        const float stood = height[c], left = static_cast<float>(h[c] - bottom);
        const bool lower = left < stood;
        const double before = bottom + static_cast<double>(stood), after = bottom + static_cast<double>(left), lost = lower ? before - after : 0.0;
        removed[k] += lost;
        deepest[k] = lost > most[k] ? c : deepest[k];
        most[k] = lost > most[k] ? lost : most[k];
        const double top = lower ? before : -1e300, low = lower ? after : 1e300;
        highest[k] = top > highest[k] ? top : highest[k];
        lowest[k] = low < lowest[k] ? low : lowest[k];
        cells[k] += static_cast<std::uint64_t>(lost > deep);
        height[c] = lower ? left : stood;
    };
    int c = 0;
    for (; c + static_cast<int>(lanes) <= n; c += static_cast<int>(lanes))
        for (std::size_t k = 0; k < lanes; ++k) one(c + static_cast<int>(k), k);
    for (; c < n; ++c) one(c, 0);
    RowLoss loss;
    for (std::size_t k = 0; k < lanes; ++k) {
        loss.removed += removed[k];
        if (most[k] > loss.most || (most[k] == loss.most && deepest[k] < loss.deepest)) loss.most = most[k], loss.deepest = deepest[k];
        loss.highest = std::max(loss.highest, highest[k]);
        loss.lowest = std::min(loss.lowest, lowest[k]);
        loss.deep += cells[k];
    }
    return loss;
}

}  // namespace

// Takes away what a cutter gets lower than, and says what that was.
class Stock::Taking {
public:
    Taking(Stock& stock, double deep) : stock_(stock), deep_(deep) {}

    void operator()(std::size_t cell, double z) {
        double lost = 0;
        for (std::size_t k = stock_.slabs_.size(); k-- > 0;) {
            Slab& slab = stock_.slabs_[k];
            float& height = slab.height[cell];
            if (height > 0) {
                const auto left = static_cast<float>(std::max(0.0, z - slab.bottom));
                if (left < height) {
                    const double before = slab.bottom + height, after = slab.bottom + left;
                    lost += before - after;
                    effect_.highest = std::max(effect_.highest, before);
                    effect_.lowest = std::min(effect_.lowest, after);
                    effect_.removed += before - after;
                    if (lost > effect_.deepest) effect_.deepest = lost, deepest_cell_ = cell;
                    height = left;
                }
            }
            if (z >= slab.bottom) break;
        }
        effect_.deep_cells += lost > deep_;
        if (-z > stock_.board_[cell]) {
            effect_.lowest = std::min(effect_.lowest, z);
            stock_.board_[cell] = static_cast<float>(-z);
        }
    }
    void row(std::size_t first, int n, const double* h, double lowest) {
        if (!within_top(lowest)) {
            for (int i = 0; i < n; ++i)
                if (h[i] < kUncovered) (*this)(first + static_cast<std::size_t>(i), h[i]);
            return;
        }
        Slab& slab = stock_.slabs_.back();
        const RowLoss loss = lower_row(slab.height.data() + first, n, h, slab.bottom, deep_);
        effect_.removed += loss.removed;
        effect_.highest = std::max(effect_.highest, loss.highest);
        effect_.lowest = std::min(effect_.lowest, loss.lowest);
        effect_.deep_cells += loss.deep;
        if (loss.most > effect_.deepest) effect_.deepest = loss.most, deepest_cell_ = first + static_cast<std::size_t>(loss.deepest);
    }
    void level(std::size_t first, int n, double z) {
        std::array<double, kSweptTogether> h;
        h.fill(z);
        for (int i = 0; i < n; i += kSweptTogether) row(first + static_cast<std::size_t>(i), std::min(kSweptTogether, n - i), h.data(), z);
    }
    [[nodiscard]] CutEffect effect() const {
        CutEffect effect = effect_;
        const auto nx = static_cast<std::size_t>(stock_.grid_.nx);
        if (effect.deepest > 0)
            effect.where = {stock_.grid_.x(static_cast<int>(deepest_cell_ % nx)), stock_.grid_.y(static_cast<int>(deepest_cell_ / nx))};
        return effect;
    }
    /// The topmost slab's surface decides: a cutter that stays above it takes nothing there, nor of what lies below.
    [[nodiscard]] StandingHeights standing() const {
        if (stock_.slabs_.empty()) return {stock_.board_.data(), 1e300};
        return {stock_.slabs_.back().height.data(), stock_.slabs_.back().bottom};
    }

private:
    // Whether all that is taken is the topmost slab's.
    [[nodiscard]] bool within_top(double lowest) const { return !stock_.slabs_.empty() && lowest >= std::max(0.0, stock_.slabs_.back().bottom); }

    Stock& stock_;
    double deep_;
    CutEffect effect_;
    std::size_t deepest_cell_ = 0;
};

CutEffect Stock::cut(const CutterEnd& end, const std::array<double, 3>& from, const std::array<double, 3>& to, double deep,
                     const ChainedSweep& chain) {
    Taking taking(*this, deep);
    sweep_above(grid_, end, from, to, taking.standing(), taking, chain);
    return taking.effect();
}

CutEffect Stock::cut(const CutterEnd& end, const LevelArc& arc, double deep) {
    Taking taking(*this, deep);
    sweep_above(grid_, end, arc, taking.standing(), taking);
    return taking.effect();
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
