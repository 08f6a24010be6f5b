#include "kernels/polygons/border_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace slabwright {

namespace {

/// The square of the distance from p to an edge, in units.
double to_edge2(Point2 p, Point2 a, Point2 b) {
    const double dx = double(b.x) - a.x, dy = double(b.y) - a.y, px = double(p.x) - a.x,
                 py = double(p.y) - a.y;
    const double length2 = dx * dx + dy * dy;
    const double t = length2 > 0 ? std::clamp((px * dx + py * dy) / length2, 0.0, 1.0) : 0;
    const double x = px - t * dx, y = py - t * dy;
    return x * x + y * y;
}

}  // namespace

BorderDistance::BorderDistance(const Loops& loops) : loops_(loops) {
    const std::size_t n = loops.points.size();
    if (n == 0) return;
    ends_.resize(n);
    for (std::size_t i = 0; i < loops.size(); ++i)
        for (std::uint32_t k = loops.starts[i]; k < loops.starts[i + 1]; ++k)
            ends_[k] = k + 1 < loops.starts[i + 1] ? k + 1 : loops.starts[i];
    std::int64_t x1 = std::numeric_limits<std::int32_t>::min(), y1 = x1;
    x0_ = y0_ = std::numeric_limits<std::int32_t>::max();
    for (const Point2 p : loops.points) {
        x0_ = std::min<std::int64_t>(x0_, p.x), x1 = std::max<std::int64_t>(x1, p.x);
        y0_ = std::min<std::int64_t>(y0_, p.y), y1 = std::max<std::int64_t>(y1, p.y);
    }
    // About as many cells as edges, so that most cells hold few.
    const double side = std::sqrt((double(x1 - x0_) + 1) * (double(y1 - y0_) + 1) / double(n));
    const double longest = double(std::max(x1 - x0_, y1 - y0_)) + 1;
    cell_ = static_cast<std::int64_t>(std::max({1.0, side, longest / 4096}));
    columns_ = (x1 - x0_) / cell_ + 1;
    rows_ = (y1 - y0_) / cell_ + 1;
    starts_.assign(static_cast<std::size_t>(columns_ * rows_) + 1, 0);
    const auto each_cell = [&](std::size_t edge, const auto& use) {
        const Point2 a = loops.points[edge], b = loops.points[ends_[edge]];
        const std::int64_t c0 = (std::min(a.x, b.x) - x0_) / cell_, c1 = (std::max(a.x, b.x) - x0_) / cell_;
        const std::int64_t r0 = (std::min(a.y, b.y) - y0_) / cell_, r1 = (std::max(a.y, b.y) - y0_) / cell_;
        for (std::int64_t r = r0; r <= r1; ++r)
            for (std::int64_t c = c0; c <= c1; ++c) {
                // A long slanting edge passes few of the cells of its box.
                if (c1 > c0 && r1 > r0) {
                    const Point2 middle{static_cast<std::int32_t>(x0_ + c * cell_ + cell_ / 2),
                                        static_cast<std::int32_t>(y0_ + r * cell_ + cell_ / 2)};
                    const double far = 0.8 * double(cell_) + 2;
                    if (to_edge2(middle, a, b) > far * far) continue;
                }
                use(static_cast<std::size_t>(r * columns_ + c));
            }
    };
    for (std::size_t e = 0; e < n; ++e) each_cell(e, [&](std::size_t cell) { ++starts_[cell + 1]; });
    for (std::size_t i = 1; i < starts_.size(); ++i) starts_[i] += starts_[i - 1];
    edges_.resize(starts_.back());
    std::vector<std::uint32_t> next(starts_.begin(), starts_.end() - 1);
    for (std::size_t e = 0; e < n; ++e)
        each_cell(e, [&](std::size_t cell) { edges_[next[cell]++] = static_cast<std::uint32_t>(e); });
}

void BorderDistance::look_in(std::int64_t column, std::int64_t row, Point2 p, Square& nearest) const {
    const auto cell = static_cast<std::size_t>(row * columns_ + column);
    for (std::uint32_t i = starts_[cell]; i < starts_[cell + 1]; ++i) {
        const std::uint32_t edge = edges_[i];
        const double square = to_edge2(p, loops_.points[edge], loops_.points[ends_[edge]]);
        if (square < nearest.distance || (square == nearest.distance && edge < nearest.edge))
            nearest = {square, edge};
    }
}

NearestEdge BorderDistance::nearest(Point2 p) const {
    return look_around(p, std::numeric_limits<double>::infinity());
}

NearestEdge BorderDistance::nearest_within(Point2 p, double most) const {
    return look_around(p, most * kUnitsPerMm);
}

NearestEdge BorderDistance::look_around(Point2 p, double most) const {
    Square nearest{std::numeric_limits<double>::infinity(), 0};
    if (ends_.empty()) return {0, nearest.distance};
    const auto floor_div = [&](std::int64_t v) { return v >= 0 ? v / cell_ : -((-v + cell_ - 1) / cell_); };
    const std::int64_t column = floor_div(p.x - x0_), row = floor_div(p.y - y0_);
    // Rings of cells around that of p, from the first that meets the grid; what lies in ring k + 1 or
    // farther is at least k cells away.
    const std::int64_t first =
        std::max({std::int64_t{0}, -column, column - (columns_ - 1), -row, row - (rows_ - 1)});
    const std::int64_t last = std::max(
        {std::abs(column), std::abs(column - (columns_ - 1)), std::abs(row), std::abs(row - (rows_ - 1))});
    for (std::int64_t ring = first; ring <= last; ++ring) {
        const double seen = double(std::max<std::int64_t>(ring - 1, 0)) * double(cell_);
        if (nearest.distance <= seen * seen || seen > most) break;
        const std::int64_t r0 = std::max<std::int64_t>(row - ring, 0), r1 = std::min(row + ring, rows_ - 1);
        for (std::int64_t r = r0; r <= r1; ++r) {
            const bool whole = r == row - ring || r == row + ring;
            const std::int64_t c0 = column - ring, c1 = column + ring;
            if (whole) {
                for (std::int64_t c = std::max<std::int64_t>(c0, 0); c <= std::min(c1, columns_ - 1); ++c)
                    look_in(c, r, p, nearest);
            } else {
                if (c0 >= 0 && c0 < columns_) look_in(c0, r, p, nearest);
                if (c1 >= 0 && c1 < columns_) look_in(c1, r, p, nearest);
            }
        }
    }
    return {nearest.edge, std::sqrt(nearest.distance) / kUnitsPerMm};
}

double farthest_from_border(const Loops& from, const BorderDistance& to, double step_mm) {
    double farthest = 0;
    for (std::size_t i = 0; i < from.size(); ++i) {
        const auto loop = from.loop(i);
        for (std::size_t k = 0; k < loop.size(); ++k) {
            const Point2 a = loop[k], b = loop[(k + 1) % loop.size()];
            const double length = std::hypot(double(b.x) - a.x, double(b.y) - a.y) / kUnitsPerMm;
            const int pieces = static_cast<int>(std::clamp(std::ceil(length / step_mm), 1.0, 1e6));
            for (int j = 0; j < pieces; ++j) {
                const double t = double(j) / pieces;
                farthest = std::max(
                    farthest, to({static_cast<std::int32_t>(std::lround(a.x + t * (double(b.x) - a.x))),
                                  static_cast<std::int32_t>(std::lround(a.y + t * (double(b.y) - a.y)))}));
            }
        }
    }
    return farthest;
}

}  // namespace slabwright
