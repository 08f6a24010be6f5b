#include "kernels/stock/stock.h"

#include <cstring>
#include <functional>

#include "kernels/geometry/vectors.h"
#include "kernels/geometry/wide.h"

namespace slabwright {

namespace {

constexpr int kLanes = 8;
constexpr int kBlockCells = 16;  // a side

int blocks_of(int cells) { return (cells + kBlockCells - 1) / kBlockCells; }

}  // namespace

Stock::Stock(const CellGrid& grid)
    : grid_(grid),
      board_(grid.count(), 0.0f),
      block_tops_(static_cast<std::size_t>(blocks_of(grid.nx)) * static_cast<std::size_t>(blocks_of(grid.ny)),
                  0.0f) {}

void Stock::add_slab(double z_bottom, double thickness) {
    slabs_.push_back({z_bottom, thickness, std::vector<float>(grid_.count(), static_cast<float>(thickness))});
    std::fill(block_tops_.begin(), block_tops_.end(), static_cast<float>(thickness));
}

void Stock::add_slab(double z_bottom, double thickness, const std::array<double, 2>& low,
                     const std::array<double, 2>& high) {
    add_slab(z_bottom, thickness);
    std::vector<float>& height = slabs_.back().height;
    std::size_t cell = 0;
    for (int j = 0; j < grid_.ny; ++j) {
        const double y = grid_.y(j);
        for (int i = 0; i < grid_.nx; ++i, ++cell) {
            const double x = grid_.x(i);
            if (x < low[0] || x > high[0] || y < low[1] || y > high[1]) height[cell] = 0;
        }
    }
}

void Stock::fill(const std::array<double, 2>& middle, double radius, double lowest, double z) {
    Slab& slab = slabs_.back();
    const auto up = static_cast<float>(z - slab.bottom);
    const auto first = [&](double from, double at) {
        return std::max(0, static_cast<int>(std::ceil((at - radius - from) / grid_.cell)));
    };
    for (int j = first(grid_.y0, middle[1]); j < grid_.ny && grid_.y(j) <= middle[1] + radius; ++j)
        for (int i = first(grid_.x0, middle[0]); i < grid_.nx && grid_.x(i) <= middle[0] + radius; ++i) {
            float& height = slab.height[grid_.index(i, j)];
            if (std::hypot(grid_.x(i) - middle[0], grid_.y(j) - middle[1]) <= radius &&
                slab.bottom + height >= lowest)
                height = std::max(height, up);
        }
    for (float& top : block_tops_) top = std::max(top, up);
}

namespace {

// What cells over a slab's bottom lost, told in eight places, so that a compiler sees that the order of cells
// does not matter.
struct Losses {
    std::array<double, kLanes> removed{}, most{}, highest{}, lowest{}, deepest{}, deep{};
    Losses() { highest.fill(-kUnbounded), lowest.fill(kUnbounded); }
};

// Lowers n cells, whole eights of them, to `left` over a slab's bottom where they stand higher. `first` is
// the first one's number.
template <class Left>
[[gnu::always_inline]] inline void lower_lanes(float* __restrict height, int n, Left&& left_at, double bottom,
                                               double deep, int first, Losses& __restrict losses) {
    constexpr double none = 2e300;
    Losses all = losses;
    for (int c = 0; c < n; c += kLanes)
        for (std::size_t k = 0; k < kLanes; ++k) {
            const std::size_t at = static_cast<std::size_t>(c) + k;
            const float stood = height[at], left = left_at(at), stands = left < stood ? left : stood;
            const double before = bottom + static_cast<double>(stood),
                         after = bottom + static_cast<double>(stands), lost = before - after;
            const double top = before - (stands < stood ? 0.0 : none),
                         low = after + (stands < stood ? 0.0 : none);
            all.removed[k] += lost;
            all.deepest[k] =
                lost > all.most[k] ? static_cast<double>(first + static_cast<int>(at)) : all.deepest[k];
            all.most[k] = lost > all.most[k] ? lost : all.most[k];
            all.highest[k] = top > all.highest[k] ? top : all.highest[k];
            all.lowest[k] = low < all.lowest[k] ? low : all.lowest[k];
            all.deep[k] += lost > deep ? 1.0 : 0.0;
            height[at] = stands;
        }
    losses = all;
}

// To h; no h is under the slab's bottom but by rounding.
SLABWRIGHT_WIDE void lower_eights(float* __restrict height, int n, const double* __restrict h, double bottom,
                                  double deep, int first, Losses& __restrict losses) {
    lower_lanes(
        height, n,
        [&](std::size_t at) {
            const double over = h[at] - bottom;
            return static_cast<float>(over > 0 ? over : 0.0);
        },
        bottom, deep, first, losses);
}

// Lowers any number of cells to one height over the slab's bottom; whether any stood higher.
SLABWRIGHT_WIDE bool lower_level(float* __restrict height, int n, float left, double bottom, double deep,
                                 Losses& __restrict losses) {
    int higher = 0;
    for (int i = 0; i < n; ++i) higher |= static_cast<int>(height[i] > left);
    if (higher == 0) return false;
    const int whole = n / kLanes * kLanes;
    lower_lanes(
        height, whole, [&](std::size_t) { return left; }, bottom, deep, 0, losses);
    if (whole == n) return true;
    std::array<float, kLanes> rest{};
    std::copy(height + whole, height + n, rest.begin());
    lower_lanes(
        rest.data(), kLanes, [&](std::size_t) { return left; }, bottom, deep, whole, losses);
    std::copy_n(rest.begin(), n - whole, height + whole);
    return true;
}

// The greatest of n heights.
[[gnu::always_inline]] inline float greatest(const float* height, int n) {
    float most = 0;
    int i = 0;
    if (n >= kLanes) {
        Floats8 all{}, h;
        for (; i + kLanes <= n; i += kLanes) {
            std::memcpy(&h, height + i, sizeof h);
            all = h > all ? h : all;
        }
        // The last eight may hold some that came before.
        std::memcpy(&h, height + n - kLanes, sizeof h);
        all = h > all ? h : all;
        for (int k = 0; k < kLanes; ++k) most = all[k] > most ? all[k] : most;
        return most;
    }
    for (; i < n; ++i) most = height[i] > most ? height[i] : most;
    return most;
}

// Keeps those intervals of rows, nx cells long, of which something is over `left`; the greatest of all
// heights, or `left`.
SLABWRIGHT_WIDE float keep_over(const float* height, std::size_t nx, float left,
                                std::vector<LevelRegion::Interval>& intervals) {
    float most = left;
    std::size_t kept = 0;
    for (const LevelRegion::Interval& i : intervals) {
        const float here =
            greatest(height + static_cast<std::size_t>(i.row) * nx + i.first, i.last - i.first + 1);
        if (!(here > left)) continue;
        most = here > most ? here : most;
        intervals[kept++] = i;
    }
    intervals.resize(kept);
    return most;
}

// Lowers n cells to one height; how much they lost together.
SLABWRIGHT_WIDE double lower_run(float* __restrict height, int n, float left, double bottom) {
    Doubles8 lost{};
    const double after = bottom + static_cast<double>(left);
    int i = 0;
    for (; i + kLanes <= n; i += kLanes) {
        Floats8 h;
        std::memcpy(&h, height + i, sizeof h);
        const Doubles8 stood = __builtin_convertvector(h, Doubles8), none{};
        lost += stood > static_cast<double>(left) ? (bottom + stood) - after : none;
        h = h > left ? Floats8{} + left : h;
        std::memcpy(height + i, &h, sizeof h);
    }
    double sum = 0;
    for (; i < n; ++i) {
        const float stood = height[i];
        if (stood > left) sum += (bottom + static_cast<double>(stood)) - after, height[i] = left;
    }
    for (int k = 0; k < kLanes; ++k) sum += lost[k];
    return sum;
}

// The same of any number of cells.
Losses lower_row(float* height, int n, const double* h, double bottom, double deep) {
    Losses losses;
    const int whole = n / kLanes * kLanes;
    lower_eights(height, whole, h, bottom, deep, 0, losses);
    if (whole == n) return losses;
    std::array<float, kLanes> rest{};
    std::array<double, kLanes> rest_h;
    rest_h.fill(kUncovered);
    std::copy(height + whole, height + n, rest.begin());
    std::copy(h + whole, h + n, rest_h.begin());
    lower_eights(rest.data(), kLanes, rest_h.data(), bottom, deep, whole, losses);
    std::copy_n(rest.begin(), n - whole, height + whole);
    return losses;
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
        if (lost > deep_) count_deep(cell, 1);
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
        if (n > kLanes) {
            take(first, lower_row(slab.height.data() + first, n, h, slab.bottom, deep_));
            return;
        }
        for (int i = 0; i < n; ++i) {
            const double over = h[i] - slab.bottom;
            lower(slab, first + static_cast<std::size_t>(i), static_cast<float>(over > 0 ? over : 0.0));
        }
    }
    void level(std::size_t first, int n, double z) {
        if (!within_top(z)) {
            for (int i = 0; i < n; ++i) (*this)(first + static_cast<std::size_t>(i), z);
            return;
        }
        Slab& slab = stock_.slabs_.back();
        const double over = z - slab.bottom;
        const auto left = static_cast<float>(over > 0 ? over : 0.0);
        if (n > kLanes) {
            for (int i = 0; i < n; i += kSweptTogether) {
                Losses losses;
                if (lower_level(slab.height.data() + first + i, std::min(kSweptTogether, n - i), left,
                                slab.bottom, deep_, losses))
                    take(first + static_cast<std::size_t>(i), losses);
            }
            return;
        }
        for (int i = 0; i < n; ++i) lower(slab, first + static_cast<std::size_t>(i), left);
    }
    [[nodiscard]] CutEffect effect() const {
        CutEffect effect = effect_;
        const auto nx = static_cast<std::size_t>(stock_.grid_.nx);
        if (effect.deep_cells > 0)
            effect.deep_across =
                static_cast<double>(effect.deep_cells) / static_cast<double>(std::max(deep_rows_, fullest_));
        if (effect.deepest > 0)
            effect.where = {stock_.grid_.x(static_cast<int>(deepest_cell_ % nx)),
                            stock_.grid_.y(static_cast<int>(deepest_cell_ / nx))};
        return effect;
    }
    /// The topmost slab's surface decides: a cutter that stays above it takes nothing there, nor of what lies
    /// below.
    [[nodiscard]] StandingHeights standing() const {
        if (stock_.slabs_.empty()) return {stock_.board_.data(), kUnbounded};
        return {stock_.slabs_.back().height.data(), stock_.slabs_.back().bottom};
    }

private:
    // The same for one cell of the topmost slab alone, to a height over its bottom.
    void lower(Slab& slab, std::size_t cell, float left) {
        float& height = slab.height[cell];
        if (!(left < height)) return;
        const double before = slab.bottom + static_cast<double>(height),
                     after = slab.bottom + static_cast<double>(left), lost = before - after;
        effect_.removed += lost;
        effect_.highest = std::max(effect_.highest, before);
        effect_.lowest = std::min(effect_.lowest, after);
        if (lost > deep_) count_deep(cell, 1);
        if (lost > effect_.deepest) effect_.deepest = lost, deepest_cell_ = cell;
        height = left;
    }
    // Adds what cells from the first one on lost.
    void take(std::size_t first, const Losses& losses) {
        for (const double removed : losses.removed) effect_.removed += removed;
        effect_.highest = std::max(effect_.highest,
                                   joined(losses.highest, [](double a, double b) { return a > b ? a : b; }));
        effect_.lowest =
            std::min(effect_.lowest, joined(losses.lowest, [](double a, double b) { return a < b ? a : b; }));
        const double deep = joined(losses.deep, std::plus<>()),
                     most = joined(losses.most, [](double a, double b) { return a > b ? a : b; });
        if (deep > 0) count_deep(first, static_cast<std::uint64_t>(deep));
        if (!(most > effect_.deepest)) return;
        // Of cells that lost as much the first.
        double deepest = kUnbounded;
        for (std::size_t k = 0; k < kLanes; ++k)
            if (losses.most[k] == most) deepest = std::min(deepest, losses.deepest[k]);
        effect_.deepest = most;
        deepest_cell_ = first + static_cast<std::size_t>(deepest);
    }
    // Of all lanes, halved and halved again.
    template <class Join>
    static double joined(std::array<double, kLanes> lanes, Join&& join) {
        for (std::size_t half = kLanes / 2; half > 0; half /= 2)
            for (std::size_t k = 0; k < half; ++k) lanes[k] = join(lanes[k], lanes[k + half]);
        return lanes[0];
    }
    // Of n cells of the row of `cell`, which lie together or not.
    void count_deep(std::size_t cell, std::uint64_t n) {
        const std::size_t row = cell / static_cast<std::size_t>(stock_.grid_.nx);
        if (row != deep_row_) deep_row_ = row, in_row_ = 0, ++deep_rows_;
        in_row_ += n;
        fullest_ = std::max(fullest_, in_row_);
        effect_.deep_cells += n;
    }
    // Whether all that is taken is the topmost slab's.
    [[nodiscard]] bool within_top(double lowest) const {
        return !stock_.slabs_.empty() && lowest >= std::max(0.0, stock_.slabs_.back().bottom);
    }

    Stock& stock_;
    double deep_;
    CutEffect effect_;
    std::size_t deepest_cell_ = 0;
    std::size_t deep_row_ =
        static_cast<std::size_t>(-1);  // the last one with cells that lost more than `deep`
    std::uint64_t deep_rows_ = 0, in_row_ = 0, fullest_ = 0;
};

CutEffect Stock::cut(const CutterEnd& end, const std::array<double, 3>& from, const std::array<double, 3>& to,
                     double deep, const ChainedSweep& chain) {
    Taking taking(*this, deep);
    sweep_above(grid_, end, from, to, taking.standing(), taking, chain);
    return taking.effect();
}

CutEffect Stock::cut(const CutterEnd& end, const LevelArc& arc, double deep) {
    Taking taking(*this, deep);
    sweep_above(grid_, end, arc, taking.standing(), taking);
    return taking.effect();
}

std::optional<LevelEffect> Stock::cut(LevelRegion& region, double z, double most) {
    std::vector<LevelRegion::Interval>& intervals = region.intervals();
    if (slabs_.empty() || z < std::max(0.0, slabs_.back().bottom)) return {};
    Slab& slab = slabs_.back();
    const auto nx = static_cast<std::size_t>(grid_.nx);
    const auto left = static_cast<float>(z - slab.bottom);
    const float highest = keep_over(slab.height.data(), nx, left, intervals);
    LevelEffect effect;
    if (!(highest > left)) return effect;
    effect.lowest = slab.bottom + static_cast<double>(left);
    effect.deepest = (slab.bottom + static_cast<double>(highest)) - effect.lowest;
    if (effect.deepest > most) return {};
    for (const LevelRegion::Interval& i : intervals)
        effect.removed += lower_run(slab.height.data() + static_cast<std::size_t>(i.row) * nx + i.first,
                                    i.last - i.first + 1, left, slab.bottom);
    return effect;
}

bool Stock::clear(double x0, double x1, double y0, double y1, double z) {
    if (slabs_.empty()) return false;
    const Slab& slab = slabs_.back();
    const float level = level_over(slab.bottom, z);
    const double per_mm = 1 / grid_.cell;
    const int i0 = std::max(0, floor_of(std::max(-1.0, (x0 - grid_.x0) * per_mm))),
              j0 = std::max(0, floor_of(std::max(-1.0, (y0 - grid_.y0) * per_mm)));
    const int i1 = std::min(grid_.nx - 1, ceiling(std::min<double>(grid_.nx, (x1 - grid_.x0) * per_mm)));
    const int j1 = std::min(grid_.ny - 1, ceiling(std::min<double>(grid_.ny, (y1 - grid_.y0) * per_mm)));
    const auto nx = static_cast<std::size_t>(grid_.nx), row = static_cast<std::size_t>(blocks_of(grid_.nx));
    for (int j = j0 / kBlockCells; j * kBlockCells <= j1; ++j)
        for (int i = i0 / kBlockCells; i * kBlockCells <= i1; ++i) {
            float& top = block_tops_[static_cast<std::size_t>(j) * row + static_cast<std::size_t>(i)];
            if (!(top > level)) continue;
            top = highest_of(
                slab.height.data() + static_cast<std::size_t>(j * kBlockCells) * nx + i * kBlockCells, nx,
                std::min(kBlockCells, grid_.nx - i * kBlockCells),
                std::min(kBlockCells, grid_.ny - j * kBlockCells));
            if (top > level) return false;
        }
    return true;
}

double Stock::highest() const {
    double most = -kUnbounded;
    if (!slabs_.empty()) {
        const float top = highest_of(slabs_.back().height.data(), 0, static_cast<int>(grid_.count()), 1);
        if (top > 0) {
            most = slabs_.back().bottom + static_cast<double>(top);
            // Only where the topmost slab is cut through does one below it show.
            bool below = false;
            for (std::size_t k = 0; k + 1 < slabs_.size() && !below; ++k)
                below =
                    slabs_[k].bottom + slabs_[k].thickness > most &&
                    slabs_[k].bottom + static_cast<double>(highest_of(slabs_[k].height.data(), 0,
                                                                      static_cast<int>(grid_.count()), 1)) >
                        most;
            if (!below) return most;
        }
    }
    for (std::size_t c = 0; c < grid_.count(); ++c) most = std::max(most, top(c));
    return most;
}

double Stock::top(std::size_t cell) const {
    for (std::size_t k = slabs_.size(); k-- > 0;)
        if (slabs_[k].height[cell] > 0) return slabs_[k].bottom + slabs_[k].height[cell];
    return -static_cast<double>(board_[cell]);
}

double Stock::reach(double radius, const std::array<double, 3>& from, const std::array<double, 3>& to,
                    std::array<double, 2>& where) const {
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
