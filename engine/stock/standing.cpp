#include "engine/stock/standing.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/stock/sweep.h"

namespace slabwright {

namespace {

constexpr double kRounding =
    2e-5;  // mm: what rounding a height to float and a place to the grid may take away
constexpr std::size_t kTable = 512;

}  // namespace

double Standing::cell_size(std::array<double, 2> min, std::array<double, 2> max, double thinnest) {
    return std::max(std::min(kCell, kCellShare * thinnest),
                    std::sqrt((max[0] - min[0]) * (max[1] - min[1]) / static_cast<double>(kMostCells)));
}

std::uint64_t Standing::bytes(std::array<double, 2> min, std::array<double, 2> max, double thinnest) {
    const double cell = cell_size(min, max, thinnest);
    return static_cast<std::uint64_t>(std::ceil((max[0] - min[0]) / cell)) *
           static_cast<std::uint64_t>(std::ceil((max[1] - min[1]) / cell)) * sizeof(float);
}

Standing::Standing(std::array<double, 2> min, std::array<double, 2> max, double top, double thinnest)
    : cell_(cell_size(min, max, thinnest)),
      d_(cell_ * std::sqrt(0.5) + 1e-6),
      x0_(min[0] + cell_ / 2),
      y0_(min[1] + cell_ / 2),
      top_(top),
      nx_(std::max(1, static_cast<int>(std::ceil((max[0] - min[0]) / cell_)))),
      ny_(std::max(1, static_cast<int>(std::ceil((max[1] - min[1]) / cell_)))),
      height_(static_cast<std::size_t>(nx_) * static_cast<std::size_t>(ny_), static_cast<float>(kRounding)) {}

Standing::HeightTable Standing::made_table(const CutterShape& cutter) const {
    const double radius = cutter.radius;
    HeightTable table{cutter, 0, std::vector<float>(kTable + 1)};
    const double reach = radius - d_;
    if (reach <= 0) return table;
    table.scale = kTable / (reach * reach);
    for (std::size_t k = 0; k <= kTable; ++k) {
        const double rho =
            std::min(radius, std::min(reach, std::sqrt((static_cast<double>(k) + 1) / table.scale)) + d_);
        table.height[k] =
            static_cast<float>(cutter.is_ball() ? radius - std::sqrt(radius * radius - rho * rho)
                                                : under_side(cutter).height(rho));
    }
    return table;
}

const Standing::HeightTable& Standing::table_of(const CutterShape& cutter) const {
    const auto found = std::find_if(tables_.begin(), tables_.end(),
                                    [&](const HeightTable& t) { return t.cutter == cutter; });
    return found != tables_.end() ? *found : tables_.emplace_back(made_table(cutter));
}

// Calls take(first row, rows, spans) for the cells whose centres lie within `radius` of the segment from a to
// b, some rows at a time; `been`: without those within it of a.
template <class Spans>
void Standing::each_spans(double radius, const std::array<double, 2>& a, const std::array<double, 2>& b,
                          bool been, Spans&& take) const {
    if (radius <= 0) return;
    const CellGrid grid{x0_, y0_, cell_, nx_, ny_};
    const auto [first, last] =
        rows_between(grid, std::min(a[1], b[1]) - radius, std::max(a[1], b[1]) + radius);
    RowSpans spans;
    for (int j = first; j <= last; j += RowSpans::kRows) {
        const int together = std::min(RowSpans::kRows, last - j + 1);
        spans_of_rows(grid, j, together, a, b, radius, been, spans);
        take(j, together, spans);
    }
}

// Calls row(j, first, last) for all of them.
template <class Row>
void Standing::rows(double radius, const std::array<double, 2>& a, const std::array<double, 2>& b,
                    Row&& row) const {
    each_spans(radius, a, b, false, [&](int j, int together, const RowSpans& spans) {
        for (std::size_t k = 0; k < static_cast<std::size_t>(together); ++k)
            if (spans.low[k] <= spans.left[k]) row(j + static_cast<int>(k), spans.low[k], spans.left[k]);
    });
}

// Calls row(j, first, last) for the cells whose centres lie within `radius` of a and of b.
template <class Row>
void Standing::rows_in_both(double radius, const std::array<double, 2>& a, const std::array<double, 2>& b,
                            Row&& row) const {
    const auto cell_from = [&](double at, double first, int n) {
        return static_cast<int>(std::clamp(std::ceil((at - first) / cell_), 0.0, static_cast<double>(n)));
    };
    const int j0 = cell_from(std::max(a[1], b[1]) - radius, y0_, ny_),
              j1 = cell_from(std::min(a[1], b[1]) + radius, y0_, ny_);
    for (int j = j0; j < j1; ++j) {
        const double y = y0_ + j * cell_;
        const double wa = std::sqrt(std::max(0.0, radius * radius - (y - a[1]) * (y - a[1]))),
                     wb = std::sqrt(std::max(0.0, radius * radius - (y - b[1]) * (y - b[1])));
        const int i0 = cell_from(std::max(a[0] - wa, b[0] - wb), x0_, nx_),
                  i1 = cell_from(std::min(a[0] + wa, b[0] + wb), x0_, nx_);
        if (i0 < i1) row(j, i0, i1 - 1);
    }
}

void Standing::cut(const CutterShape& cutter, const std::array<double, 3>& from,
                   const std::array<double, 3>& to, double core) {
    if (!cutter.is_plain() && core > 0) {
        // Its floor has the core; the rounding around that takes what it passes over.
        const double floor = under_side(cutter).core;
        if (floor > d_) cut(flat_cutter(floor), from, to, core);
    }
    const std::array<double, 2> a{from[0], from[1]}, b{to[0], to[1]};
    const double dx = b[0] - a[0], dy = b[1] - a[1], l2 = dx * dx + dy * dy;
    const double low = std::min(from[2], to[2]), high = std::max(from[2], to[2]);
    if (low >= top_ || cutter.radius <= d_) return;
    if (cutter.is_flat()) {
        // Each covered cell was covered at some place of the way, and no place is higher than its higher end.
        const auto z = static_cast<float>((l2 > 0 ? high : low) - top_ + kRounding);
        const bool level = from[2] == to[2], been = level && from == last_ && cutter.radius == last_radius_;
        const double under = core > 0 ? core + d_ : 0;
        const auto lower = [&](int j, int together, const RowSpans& spans) {
            lower_spans(height_.data() + static_cast<std::size_t>(j) * static_cast<std::size_t>(nx_),
                        static_cast<std::size_t>(nx_), together, spans, z);
        };
        // Where it has been its core has been too, and has not cleared what is no longer under it: what the
        // core has left on its way back from b to a. (All else of that way is cleared in any case.)
        if (under > 0 && under < cutter.radius - d_ && been) each_spans(under, b, a, true, lower);
        under_core_.clear();
        if (under > 0 && !been)
            rows_in_both(under, a, b, [&](int j, int first, int last) {
                const auto row = height_.begin() + static_cast<std::ptrdiff_t>(j) * nx_;
                under_core_.insert(under_core_.end(), row + first, row + last + 1);
            });
        each_spans(cutter.radius - d_, a, b, been, lower);
        if (!under_core_.empty()) {
            auto kept = under_core_.cbegin();
            rows_in_both(under, a, b, [&](int j, int first, int last) {
                const std::ptrdiff_t n = last + 1 - first;
                std::copy_n(kept, n, height_.begin() + static_cast<std::ptrdiff_t>(j) * nx_ + first);
                kept += n;
            });
        }
        if (level) last_ = to, last_radius_ = cutter.radius;
        return;
    }
    const HeightTable& table = table_of(cutter);
    const float* const profile = table.height.data();
    const double scale = table.scale;
    // The place of the way nearest to the cell's centre: on steep ways others may be lower, but this one is
    // sure.
    const double z0 = (l2 > 0 ? from[2] : low) - top_ + kRounding, rise = l2 > 0 ? to[2] - from[2] : 0.0,
                 fx = l2 > 0 ? dx / l2 : 0.0, fy = l2 > 0 ? dy / l2 : 0.0;
    rows(cutter.radius - d_, a, b, [&](int j, int first, int last) {
        float* const h = height_.data() + static_cast<std::size_t>(j) * static_cast<std::size_t>(nx_);
        const double py = y0_ + j * cell_ - a[1];
        for (int i = first; i <= last; ++i) {
            const double px = x0_ + i * cell_ - a[0];
            const double t = std::clamp(px * fx + py * fy, 0.0, 1.0), ex = px - t * dx, ey = py - t * dy;
            const auto bin = std::min(kTable, static_cast<std::size_t>((ex * ex + ey * ey) * scale));
            if (core > 0 && profile[bin] <= 0) continue;
            h[i] = std::min(h[i], static_cast<float>(z0 + t * rise + static_cast<double>(profile[bin])));
        }
    });
}

double Standing::top(double radius, const std::array<double, 2>& a, const std::array<double, 2>& b) const {
    float most = -std::numeric_limits<float>::infinity();
    each_spans(radius + d_, a, b, false, [&](int j, int together, const RowSpans& spans) {
        most = std::max(
            most, highest_in(height_.data() + static_cast<std::size_t>(j) * static_cast<std::size_t>(nx_),
                             static_cast<std::size_t>(nx_), together, spans));
    });
    return top_ + static_cast<double>(most);
}

double Standing::free_tip(const CutterShape& cutter, const std::array<double, 2>& a,
                          const std::array<double, 2>& b) const {
    if (cutter.is_flat()) return top(cutter.radius - 2 * d_, a, b);
    const HeightTable& table = table_of(cutter);
    const double dx = b[0] - a[0], dy = b[1] - a[1], l2 = dx * dx + dy * dy;
    double most = -std::numeric_limits<double>::infinity();
    rows(cutter.radius - d_, a, b, [&](int j, int first, int last) {
        const float* const h = height_.data() + static_cast<std::size_t>(j) * static_cast<std::size_t>(nx_);
        const double py = y0_ + j * cell_ - a[1];
        for (int i = first; i <= last; ++i) {
            const double px = x0_ + i * cell_ - a[0],
                         t = l2 > 0 ? std::clamp((px * dx + py * dy) / l2, 0.0, 1.0) : 0.0;
            const double ex = px - t * dx, ey = py - t * dy;
            const auto bin = std::min(kTable, static_cast<std::size_t>((ex * ex + ey * ey) * table.scale));
            most = std::max(most, static_cast<double>(h[i] - table.height[bin]));
        }
    });
    return top_ + most;
}

}  // namespace slabwright
