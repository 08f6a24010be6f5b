// What a level disc comes over along many ways at one height, as intervals of rows: each cell is touched
// once, not by every way over it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "kernels/stock/sweep.h"

namespace slabwright {

/// The union of ways of one disc. Intervals of one row that follow one another and meet are joined as they
/// come; those that do not may overlap.
class LevelRegion {
public:
    explicit LevelRegion(const CellGrid& grid);

    void add(const std::array<double, 2>& from, const std::array<double, 2>& to, double radius);

    struct Interval {
        std::int32_t row, first, last;
    };
    /// All that was added since the last call; none is empty. Valid until the next way is added, which begins
    /// anew.
    [[nodiscard]] std::vector<Interval>& intervals();

private:
    CellGrid grid_;
    std::vector<std::int32_t> low_, high_;  // of each row, the interval that still grows; low > high: none
    std::vector<Interval> done_;
    int first_row_, last_row_;  // that may have one
    bool begun_ = false;
};

/// Joins [low, left] of each row of `spans` to the row's interval; rows whose interval does not meet it are
/// left as they are.
/// @returns a bit for each of those
[[nodiscard]] std::uint64_t join_spans(const RowSpans& spans, int rows, std::int32_t* low,
                                       std::int32_t* high);

}  // namespace slabwright
