#include "kernels/stock/level_region.h"

#include <algorithm>
#include <bit>
#include <limits>

#include "kernels/geometry/wide.h"

namespace slabwright {

namespace {

// Of a row without an interval: joined to another they are that one.
constexpr std::int32_t kNoLow = std::numeric_limits<std::int32_t>::max() / 2,
                       kNoHigh = std::numeric_limits<std::int32_t>::min() / 2;

}  // namespace

SLABWRIGHT_WIDE std::uint64_t join_spans(const RowSpans& spans, int rows, std::int32_t* __restrict low,
                                         std::int32_t* __restrict high) {
    std::array<std::int32_t, RowSpans::kRows> apart;
    std::int32_t any = 0;
    for (int k = 0; k < rows; ++k) {
        const auto at = static_cast<std::size_t>(k);
        const std::int32_t l = spans.low[at], h = spans.left[at], was_low = low[k], was_high = high[k];
        const std::int32_t there = l <= h ? -1 : 0,
                           away =
                               ((was_low <= was_high) & ((l > was_high + 1) | (h + 1 < was_low))) ? there : 0;
        const bool join = (there & ~away) != 0;
        low[k] = join && l < was_low ? l : was_low;
        high[k] = join && h > was_high ? h : was_high;
        apart[at] = away;
        any |= away;
    }
    std::uint64_t rows_apart = 0;
    if (any != 0)
        for (std::size_t k = 0; k < static_cast<std::size_t>(rows); ++k)
            rows_apart |= std::uint64_t{apart[k] != 0} << k;
    return rows_apart;
}

LevelRegion::LevelRegion(const CellGrid& grid)
    : grid_(grid),
      low_(static_cast<std::size_t>(grid.ny), kNoLow),
      high_(static_cast<std::size_t>(grid.ny), kNoHigh),
      first_row_(grid.ny),
      last_row_(-1) {}

void LevelRegion::add(const std::array<double, 2>& from, const std::array<double, 2>& to, double radius) {
    if (!begun_) done_.clear(), begun_ = true;
    const auto [j0, j1] =
        rows_between(grid_, std::min(from[1], to[1]) - radius, std::max(from[1], to[1]) + radius);
    first_row_ = std::min(first_row_, j0);
    last_row_ = std::max(last_row_, j1);
    RowSpans spans;
    for (int j = j0; j <= j1; j += RowSpans::kRows) {
        const int rows = std::min(RowSpans::kRows, j1 - j + 1);
        spans_of_rows(grid_, j, rows, from, to, radius, false, spans);
        for (std::uint64_t apart = join_spans(spans, rows, &low_[static_cast<std::size_t>(j)],
                                              &high_[static_cast<std::size_t>(j)]);
             apart != 0; apart &= apart - 1) {
            const auto k = static_cast<std::size_t>(std::countr_zero(apart)),
                       row = static_cast<std::size_t>(j) + k;
            done_.push_back({static_cast<std::int32_t>(row), low_[row], high_[row]});
            low_[row] = spans.low[k];
            high_[row] = spans.left[k];
        }
    }
}

std::vector<LevelRegion::Interval>& LevelRegion::intervals() {
    if (!begun_) done_.clear();
    begun_ = false;
    for (int j = first_row_; j <= last_row_; ++j) {
        const auto row = static_cast<std::size_t>(j);
        if (low_[row] <= high_[row]) done_.push_back({j, low_[row], high_[row]});
        low_[row] = kNoLow;
        high_[row] = kNoHigh;
    }
    first_row_ = grid_.ny;
    last_row_ = -1;
    return done_;
}

}  // namespace slabwright
