#include "kernels/stock/sweep.h"

#include <cmath>

#include "kernels/wide.h"

namespace slabwright {

SLABWRIGHT_WIDE void ball_row(double a, double b, double c, double r2, double q, double dq, int n, double* h) {
    for (int k = 0; k < n; ++k) {
        const double across = q + k * dq;
        h[k] = a + b * k - c * std::sqrt(r2 - across * across);
    }
}

namespace {

// Eight at a time, so that a compiler sees that their order does not matter.
inline bool some_over(const float* stands, double bottom, int n, double level) {
    int k = 0, over = 0;
    for (; k + 8 <= n; k += 8)
        for (int i = 0; i < 8; ++i) over |= static_cast<int>(bottom + static_cast<double>(stands[k + i]) > level);
    for (; k < n; ++k) over |= static_cast<int>(bottom + static_cast<double>(stands[k]) > level);
    return over != 0;
}

inline bool some_lower(const float* __restrict stands, double bottom, int n, double* __restrict h) {
    int any = 0;
    for (int k = 0; k < n; ++k) {
        const bool lower = bottom + static_cast<double>(stands[k]) > h[k];
        h[k] = lower ? h[k] : kUncovered;
        any |= static_cast<int>(lower);
    }
    return any != 0;
}

}  // namespace

SLABWRIGHT_WIDE bool any_over(const float* stands, double bottom, int n, double level) { return some_over(stands, bottom, n, level); }
SLABWRIGHT_WIDE bool keep_lower(const float* stands, double bottom, int n, double* h) { return some_lower(stands, bottom, n, h); }

// The loops hold no branch, so that a compiler does several cells in one step; what does not depend on the cell is decided outside.
SLABWRIGHT_WIDE bool row_heights(const RowWay& way, int i0, int n, double py, const float* __restrict stands, double bottom, double* __restrict h) {
    if (stands != nullptr && !some_over(stands, bottom, n, way.lowest)) return false;
    const RowWay w = way;
    auto centre = [&](int k) { return w.x0 + (i0 + k) * w.cell - w.from_x; };
    if (!w.ball) {
        for (int k = 0; k < n; ++k) h[k] = flat_height(w, centre(k), py);
    } else if (w.slope == 0) {
        for (int k = 0; k < n; ++k) h[k] = level_ball_height(w, centre(k), py);
    } else {
        for (int k = 0; k < n; ++k) h[k] = sloped_ball_height(w, centre(k), py);
    }
    if (stands != nullptr) return some_lower(stands, bottom, n, h);
    int any = 0;
    for (int k = 0; k < n; ++k) any |= static_cast<int>(h[k] < kUncovered);
    return any != 0;
}

// The capsule's span on a row is where the row meets either disc, or the strip between them.
SLABWRIGHT_WIDE void spans_of_rows(const CellGrid& grid, int first_row, int rows, const std::array<double, 2>& from, const std::array<double, 2>& to,
                                   double radius, bool been, RowSpans& spans) {
    double dx = to[0] - from[0], dy = to[1] - from[1];
    const double run = std::sqrt(dx * dx + dy * dy);
    const bool moves = run > 1e-9;
    if (moves) dx /= run, dy /= run;
    const double inf = 1e300, r2 = radius * radius, nx = grid.nx, per_mm = 1 / grid.cell;
    const std::array<double, 2> side{-radius, radius};
    constexpr int lanes = 8;  // whole vectors of rows: what is past the last is not asked for
    const double rise = to[1] - from[1], inverse = rise == 0 ? 0 : (to[0] - from[0]) / rise;
    for (int k = 0; k < (rows + lanes - 1) / lanes * lanes; ++k) {
        const double y = grid.y0 + (first_row + k) * grid.cell;
        const double a2 = r2 - (y - from[1]) * (y - from[1]), b2 = r2 - (y - to[1]) * (y - to[1]);
        const double a = std::sqrt(a2 > 0 ? a2 : 0.0), b = std::sqrt(b2 > 0 ? b2 : 0.0);
        double low = a2 < 0 ? inf : from[0] - a, high = a2 < 0 ? -inf : from[0] + a;
        const double low_b = b2 < 0 ? inf : to[0] - b, high_b = b2 < 0 ? -inf : to[0] + b;
        low = low_b < low ? low_b : low, high = high_b > high ? high_b : high;
        for (const double s : side) {
            const double ax = from[0] - s * dy, ay = from[1] + s * dx, by = to[1] + s * dx;
            const bool met = moves && (ay <= y) != (by <= y);
            const double x = ax + (y - ay) * inverse;
            low = met && x < low ? x : low, high = met && x > high ? x : high;
        }
        // What is left of where the disc starts, and what is right of it; all in one where it is not known to have been there.
        const bool hole = been && !(a2 < 0), none = low > high;
        const double left = hole ? from[0] - a : high, right = from[0] + a;
        const double i_low = std::ceil((low - grid.x0) * per_mm), i_left = std::floor((left - grid.x0) * per_mm);
        const double i_right = std::ceil((right - grid.x0) * per_mm), i_high = std::floor((high - grid.x0) * per_mm);
        auto within = [](double v, double least, double most) { return static_cast<std::int32_t>(v < least ? least : v > most ? most : v); };
        const auto r = static_cast<std::size_t>(k);
        spans.low[r] = none ? 0 : within(i_low, 0, nx);
        spans.left[r] = none ? -1 : within(i_left, -1, nx - 1);
        spans.right[r] = none || !hole ? 0 : within(i_right, 0, nx);
        spans.high[r] = none || !hole ? -1 : within(i_high, -1, nx - 1);
    }
}

SLABWRIGHT_WIDE void lower_to(float* __restrict height, int n, const double* __restrict h) {
    for (int k = 0; k < n; ++k) {
        const auto left = static_cast<float>(h[k] > 0 ? h[k] : 0.0);
        height[k] = left < height[k] ? left : height[k];
    }
}

SLABWRIGHT_WIDE void lower_to(float* height, int n, double z) {
    const auto level = static_cast<float>(z > 0 ? z : 0.0);
    for (int k = 0; k < n; ++k) height[k] = level < height[k] ? level : height[k];
}

SLABWRIGHT_WIDE void edge_parts(const PartedWay& way, double px, double cell, double py, int n, std::int32_t* __restrict part,
                                double* __restrict across) {
    const double r2 = way.radius * way.radius, last = way.count - 1;
    for (int k = 0; k < n; ++k) {
        const double x = px + k * cell, aside = way.dx * py - way.dy * x, w2 = r2 - aside * aside;
        const double met = (x * way.dx + py * way.dy - std::sqrt(w2 > 0 ? w2 : 0.0)) * way.per_mm, from_begin = met > 0 ? met : 0.0;
        part[k] = static_cast<std::int32_t>(from_begin < last ? from_begin : last);
        across[k] = aside;
    }
}

}  // namespace slabwright
