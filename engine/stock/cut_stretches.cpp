#include "engine/stock/cut_stretches.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <optional>

#include "kernels/geometry/vectors.h"

namespace slabwright {

namespace {

constexpr double kFinestCell = 0.2;   // mm
constexpr double kLeastTaken = 1e-4;  // mm: less is rounding, of paths and of heights
constexpr double kPlunge = 1;         // mm³ that make a move straight down a plunge

// What a stretch has met so far.
struct Met {
    double volume = 0, low = kUnbounded, high = -kUnbounded, side = 0;
};

// Lowers cells, and tells the part of the way on which the cutter's edge comes to each of them, or the first
// if it is there already.
struct Meeting {
    const CellGrid& grid;
    float* height;
    PartedWay way;
    std::array<double, 2> from;
    double tip, rise;  // over the slab's bottom, mm: of the way's begin, and from part to part
    std::vector<Met>& parts;

    void operator()(std::size_t cell, double z) { level(cell, 1, z); }
    void row(std::size_t first, int n, const double* h, double /*lowest*/) {
        take(first, cells_over(height + first, n, h, 0, kLeastTaken),
             [&](std::size_t k) { return std::max(0.0, h[k]); });
    }
    void level(std::size_t first, int n, double z) {
        const double left = std::max(0.0, z);
        for (int k = 0; k < n; k += kSweptTogether) {
            const std::size_t begin = first + static_cast<std::size_t>(k);
            take(begin, cells_over(height + begin, std::min(kSweptTogether, n - k), left, kLeastTaken),
                 [&](std::size_t) { return left; });
        }
    }
    // Lowers the cells whose bits are set, counted from the first, to left(k).
    template <class Left>
    void take(std::size_t first, std::uint64_t cells, Left&& left_of) {
        if (cells == 0) return;
        const auto nx = static_cast<std::size_t>(grid.nx);
        std::array<std::int32_t, kSweptTogether> part;
        std::array<double, kSweptTogether> across;
        edge_parts(way, grid.x(static_cast<int>(first % nx)) - from[0], grid.cell,
                   grid.y(static_cast<int>(first / nx)) - from[1], 64 - std::countl_zero(cells), part.data(),
                   across.data());
        const double area = grid.cell * grid.cell;
        std::int32_t p = part[static_cast<std::size_t>(std::countr_zero(cells))];
        Met m = parts[static_cast<std::size_t>(p)];
        double low = std::min(tip + rise * p, tip + rise * (p + 1));
        for (; cells != 0; cells &= cells - 1) {
            const auto k = static_cast<std::size_t>(std::countr_zero(cells));
            const double stood = height[first + k], left = left_of(k);
            height[first + k] = static_cast<float>(left);
            if (part[k] != p) {
                parts[static_cast<std::size_t>(p)] = m;
                p = part[k];
                m = parts[static_cast<std::size_t>(p)];
                low = std::min(tip + rise * p, tip + rise * (p + 1));
            }
            m.volume += (stood - left) * area;
            m.low = std::min(m.low, left - low);
            m.high = std::max(m.high, stood - low);
            m.side += (stood - left) * across[k];
        }
        parts[static_cast<std::size_t>(p)] = m;
    }
};

// Smallest x and y, largest x and y of a move and the cutter on it, mm.
std::array<double, 4> box_of(const Move& from, const Move& move, double radius) {
    std::array<double, 4> box{to_mm(std::min(from.x, move.x)), to_mm(std::min(from.y, move.y)),
                              to_mm(std::max(from.x, move.x)), to_mm(std::max(from.y, move.y))};
    if (move.is_arc()) box = arc_shape(from, move).box();
    return {box[0] - radius, box[1] - radius, box[2] + radius, box[3] + radius};
}

// The surroundings of some moves, as tiles of the grid.
class Surrounded {
public:
    Surrounded(const CellGrid& grid, const Operation& operation, std::span<const MoveRange> parts,
               double radius)
        : grid_(grid),
          radius_(radius + grid.cell),
          nx_(grid.nx / kTile + 1),
          ny_(grid.ny / kTile + 1),
          sums_((static_cast<std::size_t>(nx_) + 1) * (static_cast<std::size_t>(ny_) + 1), 0) {
        for (const MoveRange& part : parts)
            for (std::uint32_t k = part.first; k <= part.last; ++k) {
                const auto [i0, j0, i1, j1] = tiles(operation.moves[k - 1], operation.moves[k]);
                for (int j = j0; j <= j1; ++j)
                    for (int i = i0; i <= i1; ++i) sums_[at(i + 1, j + 1)] = 1;
            }
        for (int j = 1; j <= ny_; ++j)
            for (int i = 1; i <= nx_; ++i)
                sums_[at(i, j)] += sums_[at(i - 1, j)] + sums_[at(i, j - 1)] - sums_[at(i - 1, j - 1)];
    }
    [[nodiscard]] bool near(const Move& from, const Move& move) const {
        const auto [i0, j0, i1, j1] = tiles(from, move);
        return sums_[at(i1 + 1, j1 + 1)] - sums_[at(i0, j1 + 1)] - sums_[at(i1 + 1, j0)] + sums_[at(i0, j0)] >
               0;
    }

private:
    static constexpr int kTile = 4;  // cells
    [[nodiscard]] std::size_t at(int i, int j) const {
        return static_cast<std::size_t>(j) * (static_cast<std::size_t>(nx_) + 1) +
               static_cast<std::size_t>(i);
    }
    // First and last; what lies beside the grid counts to its border.
    [[nodiscard]] std::array<int, 4> tiles(const Move& from, const Move& move) const {
        const std::array<double, 4> box = box_of(from, move, radius_);
        const auto tile = [&](double v, double begin, int n) {
            return static_cast<int>(std::clamp(std::floor((v - begin) / (kTile * grid_.cell)), 0.0, n - 1.0));
        };
        return {tile(box[0], grid_.x0, nx_), tile(box[1], grid_.y0, ny_), tile(box[2], grid_.x0, nx_),
                tile(box[3], grid_.y0, ny_)};
    }
    const CellGrid& grid_;
    double radius_;
    int nx_, ny_;
    std::vector<std::int32_t> sums_;  // of marked tiles left of and below a corner
};

}  // namespace

double StandingSlab::cell_for(const Job& job, std::array<double, 2> stock_min,
                              std::array<double, 2> stock_max) {
    const double plane = (stock_max[0] - stock_min[0]) * (stock_max[1] - stock_min[1]);
    return std::max({kFinestCell, std::min(job.cutting.wall_allowance, 0.5), std::sqrt(plane / kMostCells)});
}

StandingSlab::StandingSlab(std::array<double, 2> stock_min, std::array<double, 2> stock_max, double bottom,
                           double top, double cell)
    : grid_{stock_min[0] + cell / 2, stock_min[1] + cell / 2, cell,
            std::max(1, static_cast<int>(std::lround((stock_max[0] - stock_min[0]) / cell))),
            std::max(1, static_cast<int>(std::lround((stock_max[1] - stock_min[1]) / cell)))},
      bottom_(bottom),
      height_(grid_.count(), static_cast<float>(top - bottom)) {}

void StandingSlab::run(const Operation& operation, const Tool& tool,
                       const std::function<void(const CutStretch&)>& stretch) {
    plunges_.clear();
    run(operation, tool, {}, true, stretch);
}

void StandingSlab::run_parts(const Operation& operation, const Tool& tool, std::span<const MoveRange> parts,
                             const std::function<void(const CutStretch&)>& stretch) {
    run(operation, tool, parts, false, stretch);
}

void StandingSlab::run(const Operation& operation, const Tool& tool, std::span<const MoveRange> parts,
                       bool all, const std::function<void(const CutStretch&)>& stretch) {
    const CutterEnd end = cutter_end(cutter_shape(tool));
    std::optional<Surrounded> around;
    if (!all) around.emplace(grid_, operation, parts, end.radius);
    bool told = all;
    const double enough = std::max(end.radius / 2, 3 * grid_.cell);
    CutStretch now;
    Met met;
    const auto finish = [&] {
        if (now.length > 0) {
            if (met.volume > 0) {
                now.low = std::max(0.0, met.low);
                now.high = met.high;
                now.width = std::min(tool.diameter, met.volume / (std::max(now.length, 2 * grid_.cell) *
                                                                  (now.high - now.low)));
                now.left = met.side > 0;
            }
            stretch(now);
        }
        now = {};
        met = {};
    };
    // One straight way, told in equal parts. A cell is met when the cutter's leading edge comes to it, or at
    // the way's begin.
    std::vector<Met> by_part;
    bool been = false;  // the cutter has cut where the way begins
    const auto step = [&](std::uint32_t move, const std::array<double, 3>& from,
                          const std::array<double, 3>& to, std::size_t count) {
        const double length = std::hypot(to[0] - from[0], to[1] - from[1]),
                     slope = length > 0 ? (to[2] - from[2]) / length : 0;
        const double part = length / static_cast<double>(count);
        by_part.assign(count, {});
        Meeting meeting{grid_,        height_.data(), {}, {from[0], from[1]}, from[2] - bottom_,
                        slope * part, by_part};
        if (length > 0)
            meeting.way = {(to[0] - from[0]) / length, (to[1] - from[1]) / length, end.radius,
                           static_cast<double>(count) / length, static_cast<int>(count)};
        sweep_above(grid_, end, {from[0], from[1], from[2] - bottom_}, {to[0], to[1], to[2] - bottom_},
                    StandingHeights{height_.data(), 0}, meeting, {.been = been});
        been = true;
        if (length == 0 || !told) return;
        for (std::size_t p = 0; p < count; ++p) {
            const Met& m = by_part[p];
            met = {met.volume + m.volume, std::min(met.low, m.low), std::max(met.high, m.high),
                   met.side + m.side};
            if (now.length == 0) now.first = move;
            now.last = move;
            now.length += part;
            const double t = static_cast<double>(p + 1) / static_cast<double>(count);
            now.at = p + 1 == count ? to
                                    : std::array<double, 3>{from[0] + t * (to[0] - from[0]),
                                                            from[1] + t * (to[1] - from[1]),
                                                            from[2] + t * (to[2] - from[2])};
            if (now.length >= enough || count > 1) finish();
        }
    };
    for (std::size_t k = 1; k < operation.moves.size(); ++k) {
        const Move &a = operation.moves[k - 1], &b = operation.moves[k];
        if (!all) {
            if (told && k > parts.front().last) finish(), parts = parts.subspan(1);
            if (parts.empty()) return;
            told = k >= parts.front().first;
            if (!told && b.feed != 0 && !around->near(a, b)) {
                been = true;
                continue;
            }
        }
        if (b.feed == 0) {
            finish(), been = false;
            continue;
        }
        const std::array<double, 3> from{to_mm(a.x), to_mm(a.y), to_mm(a.z)},
            to{to_mm(b.x), to_mm(b.y), to_mm(b.z)};
        const auto move = static_cast<std::uint32_t>(k);
        if (now.length > 0 && operation.moves[now.last].feed != b.feed) finish();
        if (a.x == b.x && a.y == b.y) {
            finish();
            step(move, from, to, 1);
            if (all && by_part.front().volume > kPlunge) plunges_.push_back(move);
            continue;
        }
        if (b.is_arc()) {
            // Chords that miss the arc by less than a tenth of a cell, and are no longer than a stretch.
            const ArcShape arc = arc_shape(a, b);
            const double most = std::min(
                {2 * std::acos(std::max(0.0, 1 - 0.1 * grid_.cell / arc.radius)), enough / arc.radius, 0.5});
            const int chords = std::max(1, static_cast<int>(std::ceil(std::abs(arc.sweep) / most)));
            std::array<double, 3> last = from;
            for (int p = 1; p <= chords; ++p) {
                const double angle = arc.start + arc.sweep * p / chords;
                const std::array<double, 3> next =
                    p == chords ? to
                                : std::array<double, 3>{arc.x + arc.radius * std::cos(angle),
                                                        arc.y + arc.radius * std::sin(angle), to[2]};
                step(move, last, next, 1);
                last = next;
            }
            continue;
        }
        const double length = std::hypot(to[0] - from[0], to[1] - from[1]);
        const auto count = told ? static_cast<std::size_t>(std::max(1.0, std::floor(length / enough))) : 1;
        if (count > 1) finish();
        step(move, from, to, count);
    }
    finish();
}

}  // namespace slabwright
