#include "kernels/cutting/cap_cells.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace slabwright {

namespace {

constexpr double kFinest = 0.2 * kUnitsPerMm;
constexpr double kMostCells = 1 << 19, kMostInARow = 1 << 12;
constexpr double kAll = -std::numeric_limits<double>::infinity();

std::size_t place(double v, std::size_t n) {
    return std::min(n - 1, static_cast<std::size_t>(std::max(0.0, v)));
}

}  // namespace

std::size_t CapCells::column(double x) const { return place((x - x0_) / cell_, columns_); }
std::size_t CapCells::row(double y) const { return place((y - y0_) / cell_, rows_); }

CapCells::CapCells(const Loops& loops) {
    if (loops.points.empty()) return;
    Point2 low = loops.points.front(), high = low;
    for (const Point2 p : loops.points) {
        low = {std::min(low.x, p.x), std::min(low.y, p.y)};
        high = {std::max(high.x, p.x), std::max(high.y, p.y)};
    }
    const double width = static_cast<double>(high.x) - low.x, depth = static_cast<double>(high.y) - low.y;
    cell_ = std::max({kFinest, std::sqrt(width * depth / kMostCells), std::max(width, depth) / kMostInARow});
    x0_ = low.x, y0_ = low.y;
    columns_ = static_cast<std::size_t>(width / cell_) + 1;
    rows_ = static_cast<std::size_t>(depth / cell_) + 1;
    // Calls fn(cell) for the cells that a segment meets, and for some that it misses by a hair.
    auto cells = [&](const Segment& s, auto&& fn) {
        const Point2 a = s.a.y <= s.b.y ? s.a : s.b, b = s.a.y <= s.b.y ? s.b : s.a;
        const double slope =
            a.y == b.y ? 0 : (static_cast<double>(b.x) - a.x) / (static_cast<double>(b.y) - a.y);
        const double left = std::min(a.x, b.x), right = std::max(a.x, b.x);
        for (std::size_t r = row(a.y - 1.0), last = row(b.y + 1.0); r <= last; ++r) {
            double from = left, to = right;
            if (a.y != b.y) {
                const double y0 = y0_ + static_cast<double>(r) * cell_ - 1, at0 = a.x + slope * (y0 - a.y),
                             at1 = at0 + slope * (cell_ + 2);
                from = std::max(from, std::min(at0, at1)), to = std::min(to, std::max(at0, at1));
            }
            for (std::size_t c = column(from - 1), end = column(to + 1); c <= end; ++c) fn(r * columns_ + c);
        }
    };
    auto each = [&](auto&& fn) {
        for (std::size_t l = 0; l < loops.size(); ++l) {
            const auto loop = loops.loop(l);
            for (std::size_t i = 0; i < loop.size(); ++i)
                fn(Segment{loop[i], loop[i + 1 == loop.size() ? 0 : i + 1]});
        }
    };
    starts_.assign(columns_ * rows_ + 1, 0);
    each([&](const Segment& s) { cells(s, [&](std::size_t cell) { ++starts_[cell + 1]; }); });
    for (std::size_t k = 1; k < starts_.size(); ++k) starts_[k] += starts_[k - 1];
    segments_.resize(starts_.back());
    std::vector<std::uint32_t> next(starts_.begin(), starts_.end() - 1);
    each([&](const Segment& s) { cells(s, [&](std::size_t cell) { segments_[next[cell]++] = s; }); });
    // From the right, where nothing is inside, to the left.
    winding_.assign(columns_ * rows_, 0);
    for (std::size_t r = 0; r < rows_; ++r) {
        int winding = 0;
        const double y = y0_ + (static_cast<double>(r) + 0.5) * cell_;
        for (std::size_t c = columns_; c-- > 0;) {
            const std::size_t cell = r * columns_ + c;
            if (starts_[cell] == starts_[cell + 1]) {
                winding_[cell] = static_cast<std::int8_t>(std::clamp(winding, -100, 100));
                continue;
            }
            winding_[cell] = kCrossed;
            winding += turns(c, r, kAll, y);
        }
    }
}

int CapCells::turns(std::size_t c, std::size_t r, double x, double y) const {
    const std::size_t cell = r * columns_ + c;
    int sum = 0;
    for (std::uint32_t k = starts_[cell]; k < starts_[cell + 1]; ++k) {
        const Segment& s = segments_[k];
        if ((s.a.y <= y) == (s.b.y <= y)) continue;
        const double at =
            s.a.x + (y - s.a.y) / (static_cast<double>(s.b.y) - s.a.y) * (static_cast<double>(s.b.x) - s.a.x);
        // Listed in several cells it counts in the one where it crosses the line.
        if (at > x && column(at) == c) sum += s.b.y > s.a.y ? 1 : -1;
    }
    return sum;
}

bool CapCells::inside(double x_mm, double y_mm) const {
    if (columns_ == 0) return false;
    const double x = x_mm * kUnitsPerMm, y = y_mm * kUnitsPerMm;
    if (x < x0_ || y < y0_ || x > x0_ + static_cast<double>(columns_) * cell_ ||
        y > y0_ + static_cast<double>(rows_) * cell_)
        return false;
    const std::size_t r = row(y), first = column(x);
    int winding = 0;
    for (std::size_t c = first; c < columns_; ++c) {
        if (const std::int8_t all = winding_[r * columns_ + c]; all != kCrossed) {
            winding += all;
            break;
        }
        winding += turns(c, r, c == first ? x : kAll, y);
    }
    return winding > 0;
}

}  // namespace slabwright
