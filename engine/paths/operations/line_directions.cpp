#include "engine/paths/operations/line_directions.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "kernels/geometry/units.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr double kBlock = 0.25;       // of the radius: the side of a block of cells that have one direction
constexpr double kCovered = 0.5;      // of the radius: what lies so near to a target goes with it
constexpr double kLongest = 16;       // radii: lines are no better for being longer
constexpr int kTile = 4;              // blocks along a tile; those of tiles beside one another count alike
constexpr double kMuchFarther = 2.5;  // times as far as along the usual axis

/// Blocks of cells, row by row; few of them are marked.
class Blocks {
public:
    Blocks(const CellGrid& grid, std::span<const CellRuns> rows, double radius)
        : side_(std::max(1, static_cast<int>(kBlock * radius / grid.cell))),
          nx_((grid.nx - 1) / side_ + 1),
          ny_((grid.ny - 1) / side_ + 1),
          mm_(side_ * grid.cell),
          is_marked_(static_cast<std::size_t>(nx_) * static_cast<std::size_t>(ny_), 0) {
        for (int j = 0; j < grid.ny; ++j)
            for (const auto& [first, last] : rows[static_cast<std::size_t>(j)])
                for (int i = first / side_; i <= last / side_; ++i) mark(i, j / side_);
    }

    [[nodiscard]] int side() const { return side_; }
    [[nodiscard]] std::size_t count() const { return is_marked_.size(); }
    [[nodiscard]] int nx() const { return nx_; }
    [[nodiscard]] int ny() const { return ny_; }
    [[nodiscard]] double mm() const { return mm_; }
    [[nodiscard]] std::size_t at(int i, int j) const {
        return static_cast<std::size_t>(j) * static_cast<std::size_t>(nx_) + static_cast<std::size_t>(i);
    }
    [[nodiscard]] std::array<int, 2> place(std::size_t block) const {
        const auto row = static_cast<std::size_t>(nx_);
        return {static_cast<int>(block % row), static_cast<int>(block / row)};
    }
    [[nodiscard]] bool is_marked(int i, int j) const {
        return i >= 0 && j >= 0 && i < nx_ && j < ny_ && is_marked_[at(i, j)] != 0;
    }
    [[nodiscard]] const std::vector<std::size_t>& marked() const { return marked_; }

    /// Those no farther than `by` from a marked one, row by row.
    [[nodiscard]] Blocks widened(int by) const {
        Blocks rows = *this, all = *this;
        for (const std::size_t b : marked_) {
            const auto [i, j] = place(b);
            for (int k = std::max(0, i - by); k <= std::min(nx_ - 1, i + by); ++k) rows.mark(k, j);
        }
        for (const std::size_t b : rows.marked_) {
            const auto [i, j] = place(b);
            for (int k = std::max(0, j - by); k <= std::min(ny_ - 1, j + by); ++k) all.mark(i, k);
        }
        std::sort(all.marked_.begin(), all.marked_.end());
        return all;
    }

private:
    void mark(int i, int j) {
        std::uint8_t& is = is_marked_[at(i, j)];
        if (is == 0) marked_.push_back(at(i, j));
        is = 1;
    }

    int side_, nx_, ny_;  // of a block in cells; blocks
    double mm_;           // of a block's side
    std::vector<std::uint8_t> is_marked_;
    std::vector<std::size_t> marked_;
};

/// How far the marks reach through each marked block along a direction, mm; other blocks have no value.
std::unique_ptr<float[]> reach_along(const Blocks& blocks, const LineDirection& d, double longest) {
    auto before = std::make_unique_for_overwrite<float[]>(blocks.count()),
         reach = std::make_unique_for_overwrite<float[]>(blocks.count());
    const auto step = static_cast<float>(blocks.mm() * std::hypot(d.p, d.q));
    const auto count = [&](std::size_t block, int sense, float* far) {
        const auto [i, j] = blocks.place(block);
        const int k = i - sense * d.p, l = j - sense * d.q;
        far[block] = step + (blocks.is_marked(k, l) ? far[blocks.at(k, l)] : 0);
    };
    // Those before a block in its line stand in a row before its own, or to the left of it.
    const std::vector<std::size_t>& marked = blocks.marked();
    for (const std::size_t b : marked) count(b, 1, before.get());
    for (std::size_t m = marked.size(); m-- > 0;) count(marked[m], -1, reach.get());
    for (const std::size_t b : marked)
        reach[b] = std::min(static_cast<float>(longest), before[b] + reach[b] - step);
    return reach;
}

/// By block, the number of the direction in which the marks around it reach farthest; `none` where none is.
std::vector<std::uint8_t> farthest(Context& context, const Blocks& blocks,
                                   std::span<const LineDirection> directions, double radius,
                                   std::size_t usual, double least, std::uint8_t none) {
    const Blocks covered = blocks.widened(static_cast<int>(std::ceil(kCovered * radius / blocks.mm())));
    const int nx = (blocks.nx() - 1) / kTile + 1, ny = (blocks.ny() - 1) / kTile + 1;
    const auto tile = [&](int i, int j) {
        return static_cast<std::size_t>(j) * static_cast<std::size_t>(nx) + static_cast<std::size_t>(i);
    };
    const auto tile_of = [&](std::size_t block) {
        const auto [i, j] = blocks.place(block);
        return tile(i / kTile, j / kTile);
    };
    std::vector<std::vector<float>> far(directions.size());  // sums, by tile
    parallel_each(context, directions.size(), [&](std::size_t d) {
        const auto reach = reach_along(covered, directions[d], kLongest * radius);
        far[d].assign(static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny), 0);
        for (const std::size_t b : blocks.marked()) far[d][tile_of(b)] += reach[b];
    });
    std::vector<float> marks(far[0].size(), 0);
    for (const std::size_t b : blocks.marked()) ++marks[tile_of(b)];
    std::vector<std::uint8_t> best(far[0].size(), static_cast<std::uint8_t>(usual));
    for (int j = 0; j < ny; ++j)
        for (int i = 0; i < nx; ++i) {
            if (marks[tile(i, j)] == 0) continue;
            const auto around = [&](const std::vector<float>& of_tiles) {
                float sum = 0;
                for (int l = std::max(0, j - 1); l <= std::min(ny - 1, j + 1); ++l)
                    for (int k = std::max(0, i - 1); k <= std::min(nx - 1, i + 1); ++k)
                        sum += of_tiles[tile(k, l)];
                return sum;
            };
            float most = std::max(static_cast<float>(kMuchFarther) * around(far[usual]),
                                  static_cast<float>(least) * around(marks));
            for (std::size_t d = 0; d < directions.size(); ++d)
                if (const float sum = around(far[d]); d != usual && sum > most)
                    most = sum, best[tile(i, j)] = static_cast<std::uint8_t>(d);
        }
    std::vector<std::uint8_t> of_blocks(blocks.count(), none);
    for (const std::size_t b : blocks.marked()) of_blocks[b] = best[tile_of(b)];
    return of_blocks;
}

}  // namespace

std::array<std::int32_t, 2> LineDirection::place(std::int32_t along, std::int32_t across) const {
    return {static_cast<std::int32_t>(std::lround(c * along - s * across)),
            static_cast<std::int32_t>(std::lround(s * along + c * across))};
}

std::array<double, 2> LineDirection::within(double across, const std::array<double, 2>& x,
                                            const std::array<double, 2>& y) const {
    std::array<double, 2> ends{-std::numeric_limits<double>::infinity(),
                               std::numeric_limits<double>::infinity()};
    const auto cut = [&](double from, double slope, const std::array<double, 2>& between) {
        if (slope == 0) {
            if (from < between[0] || from > between[1]) ends = {1, 0};
            return;
        }
        const double a = (between[0] - from) / slope, b = (between[1] - from) / slope;
        ends[0] = std::max(ends[0], std::min(a, b));
        ends[1] = std::min(ends[1], std::max(a, b));
    };
    cut(-s * across, c, x);
    cut(c * across, s, y);
    return ends;
}

LineDirections::LineDirections(Context& context, const CellGrid& grid, std::span<const CellRuns> rows,
                               double radius, Usual usual, double least)
    : grid_(grid) {
    for (const auto& [p, q] : {std::array{1, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 1}, {-1, 2}, {-1, 1}, {-2, 1}}) {
        const double far = std::hypot(p, q);
        directions_.push_back({p, q, p / far, q / far});
    }
    const Blocks blocks(grid, rows, radius);
    side_ = blocks.side();
    blocks_x_ = static_cast<std::size_t>(blocks.nx());
    of_blocks_ = farthest(context, blocks, directions_, radius, usual, least, kNone);
    sort_targets(rows);
}

std::vector<std::uint32_t> LineDirections::counts(std::size_t direction) const {
    const std::size_t row = blocks_x_ + 1, rows = of_blocks_.size() / blocks_x_ + 1;
    std::vector<std::uint32_t> counts(row * rows, 0);
    for (std::size_t j = 1; j < rows; ++j)
        for (std::size_t i = 1; i < row; ++i)
            counts[j * row + i] = counts[j * row + i - 1] + counts[(j - 1) * row + i] -
                                  counts[(j - 1) * row + i - 1] +
                                  (of_blocks_[(j - 1) * blocks_x_ + i - 1] == direction ? 1 : 0);
    return counts;
}

bool LineDirections::has_some(std::span<const std::uint32_t> counts, const std::array<double, 2>& low,
                              const std::array<double, 2>& high) const {
    const auto [i0, j0] = block_of(low[0], low[1]);
    const auto [i1, j1] = block_of(high[0], high[1]);
    const auto at = [&](int i, int j) {
        return counts[static_cast<std::size_t>(j) * (blocks_x_ + 1) + static_cast<std::size_t>(i)];
    };
    return at(i1 + 1, j1 + 1) + at(i0, j0) != at(i0, j1 + 1) + at(i1 + 1, j0);
}

double LineDirections::between(std::size_t direction) const {
    return grid_.cell / std::hypot(directions_[direction].p, directions_[direction].q);
}

void LineDirections::sort_targets(std::span<const CellRuns> rows) {
    cells_.resize(directions_.size());
    for (std::size_t d = 0; d < directions_.size(); ++d) {
        const auto [p, q] = std::array{directions_[d].p, directions_[d].q};
        cells_[d].first = -q * (grid_.nx - 1) + std::min(0, p * (grid_.ny - 1));
        const int last = std::max(0, p * (grid_.ny - 1));
        cells_[d].lines.resize(static_cast<std::size_t>(last - cells_[d].first) + 1);
    }
    for (int j = 0; j < grid_.ny; ++j)
        for (const auto& [first, last] : rows[static_cast<std::size_t>(j)])
            for (int i = first; i <= last; ++i) {
                const std::size_t d = of_blocks_[static_cast<std::size_t>(j / side_) * blocks_x_ +
                                                 static_cast<std::size_t>(i / side_)];
                const auto [p, q] = std::array{directions_[d].p, directions_[d].q};
                auto& line = cells_[d].lines[static_cast<std::size_t>(p * j - q * i - cells_[d].first)];
                const int along = p * i + q * j, step = p * p + q * q;
                if (!line.empty() && line.back()[1] + step == along) line.back()[1] = along;
                else line.push_back({along, along});
            }
}

std::array<double, 2> LineDirections::across(std::size_t direction) const {
    const Cells& cells = cells_[direction];
    const LineDirection& d = directions_[direction];
    const auto has_some = [](const auto& line) { return !line.empty(); };
    const auto first = std::find_if(cells.lines.begin(), cells.lines.end(), has_some);
    const auto last = std::find_if(cells.lines.rbegin(), cells.lines.rend(), has_some);
    if (first == cells.lines.end()) return {1, 0};
    const double zero = d.c * grid_.y0 - d.s * grid_.x0;
    const auto at = [&](std::ptrdiff_t line) {
        return zero + static_cast<double>(cells.first + line) * between(direction);
    };
    return {at(first - cells.lines.begin()), at(cells.lines.rend() - last - 1)};
}

Spans LineDirections::around(std::size_t direction, double across, double radius,
                             const std::array<double, 2>& ends) const {
    const Cells& cells = cells_[direction];
    const LineDirection& d = directions_[direction];
    const double unit = between(direction), along_zero = d.c * grid_.x0 + d.s * grid_.y0,
                 zero = d.c * grid_.y0 - d.s * grid_.x0;
    const int low_line = std::max(cells.first, static_cast<int>(std::ceil((across - radius - zero) / unit)));
    const int high_line = std::min(cells.first + static_cast<int>(cells.lines.size()) - 1,
                                   static_cast<int>(std::floor((across + radius - zero) / unit)));
    Spans all;
    for (int k = low_line; k <= high_line; ++k) {
        const double off = zero + k * unit - across,
                     w = std::sqrt(std::max(0.0, radius * radius - off * off));
        for (const auto& run : cells.lines[static_cast<std::size_t>(k - cells.first)]) {
            const double low = std::max(along_zero + run[0] * unit - w, ends[0]),
                         high = std::min(along_zero + run[1] * unit + w, ends[1]);
            if (low < high) all.push_back({to_units(low), to_units(high)});
        }
    }
    std::sort(all.begin(), all.end());
    Spans merged;
    for (const auto& s : all)
        if (!merged.empty() && s[0] <= merged.back()[1]) merged.back()[1] = std::max(merged.back()[1], s[1]);
        else merged.push_back(s);
    return merged;
}

}  // namespace slabwright
