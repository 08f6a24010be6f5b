// The exact envelope of a cutter along a straight way: over each cell's centre, the lowest z that the cutter reaches.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace slabwright {

/// Cells of one size; cell (i, j) stands for the point at its centre, (x0 + i·cell, y0 + j·cell), mm.
struct CellGrid {
    double x0 = 0, y0 = 0, cell = 1;
    int nx = 0, ny = 0;

    [[nodiscard]] double x(int i) const { return x0 + i * cell; }
    [[nodiscard]] double y(int j) const { return y0 + j * cell; }
    [[nodiscard]] std::size_t count() const { return static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny); }
    [[nodiscard]] std::size_t index(int i, int j) const {
        return static_cast<std::size_t>(j) * static_cast<std::size_t>(nx) + static_cast<std::size_t>(i);
    }
};

/// The lower end of a cutter: height over its tip at radius r is 0 (flat and face), R − √(R² − r²) (ball) or r·slope (drill).
struct CutterEnd {
    enum class Form : std::uint8_t { flat, ball, cone } form = Form::flat;
    double radius = 0;  ///< mm
    double slope = 0;   ///< of the cone
};

/// Calls fn(cell index, z) for every cell whose centre the cutter covers while its tip goes straight from `from` to `to`.
/// With s the way along the motion in the plane, s0 the foot of the centre on it, q its distance from it and m the way's slope, the
/// height over the centre at s is z + m·s + end(√(q² + (s − s0)²)): convex in s, so its least value lies where the derivative
/// vanishes, moved into [0, L] and to where the cutter covers the centre at all. The result is exact, not sampled.
template <class Fn>
void sweep(const CellGrid& grid, const CutterEnd& end, const std::array<double, 3>& from, const std::array<double, 3>& to, Fn&& fn) {
    const double R = end.radius, R2 = R * R;
    double dx = to[0] - from[0], dy = to[1] - from[1];
    const double length = std::sqrt(dx * dx + dy * dy);
    double z = from[2], slope = 0;
    if (length > 1e-9) dx /= length, dy /= length, slope = (to[2] - from[2]) / length;
    else dx = 1, dy = 0, z = std::min(from[2], to[2]);
    const double run = length > 1e-9 ? length : 0;
    const double y_low = std::min(from[1], to[1]) - R, y_high = std::max(from[1], to[1]) + R;
    const int j0 = std::max(0, static_cast<int>(std::ceil(std::max(-1.0, (y_low - grid.y0) / grid.cell))));
    const int j1 = std::min(grid.ny - 1, static_cast<int>(std::floor(std::min<double>(grid.ny, (y_high - grid.y0) / grid.cell))));
    const double ball_lead = slope / std::sqrt(1 + slope * slope);
    const double cone_lead = end.slope > std::abs(slope) ? slope / std::sqrt(end.slope * end.slope - slope * slope) : 0;
    for (int j = j0; j <= j1; ++j) {
        const double y = grid.y(j);
        // The capsule's span on this row: where the row meets either disc, or the strip between them.
        double low = 1e300, high = -1e300;
        for (const auto& p : {from, to}) {
            const double w2 = R2 - (y - p[1]) * (y - p[1]);
            if (w2 < 0) continue;
            const double w = std::sqrt(w2);
            low = std::min(low, p[0] - w), high = std::max(high, p[0] + w);
        }
        if (run > 0) {
            for (const double side : {-R, R}) {  // the strip's long edges
                const double ax = from[0] - side * dy, ay = from[1] + side * dx, by = to[1] + side * dx, bx = to[0] - side * dy;
                if ((ay <= y) == (by <= y)) continue;
                const double x = ax + (y - ay) / (by - ay) * (bx - ax);
                low = std::min(low, x), high = std::max(high, x);
            }
        }
        if (low > high) continue;
        const int i0 = std::max(0, static_cast<int>(std::floor(std::clamp((low - grid.x0) / grid.cell, -1.0, grid.nx + 1.0))));
        const int i1 = std::min(grid.nx - 1, static_cast<int>(std::ceil(std::clamp((high - grid.x0) / grid.cell, -1.0, grid.nx + 1.0))));
        for (int i = i0; i <= i1; ++i) {
            const double px = grid.x(i) - from[0], py = y - from[1];
            const double s0 = px * dx + py * dy, q2 = std::max(0.0, px * px + py * py - s0 * s0);
            const double w2 = R2 - q2;
            if (w2 < 0) continue;
            const double w = std::sqrt(w2);
            const double s_low = std::max(0.0, s0 - w), s_high = std::min(run, s0 + w);
            if (s_low > s_high) continue;
            double s = s0, height = 0;
            switch (end.form) {
                case CutterEnd::Form::flat:
                    s = slope >= 0 ? s_low : s_high;
                    break;
                case CutterEnd::Form::ball: {
                    s = std::clamp(s0 - w * ball_lead, s_low, s_high);
                    height = R - std::sqrt(std::max(0.0, w2 - (s - s0) * (s - s0)));
                    break;
                }
                case CutterEnd::Form::cone: {
                    if (end.slope > std::abs(slope)) s = std::clamp(s0 - std::sqrt(q2) * cone_lead, s_low, s_high);
                    else s = slope >= 0 ? s_low : s_high;
                    height = end.slope * std::sqrt(q2 + (s - s0) * (s - s0));
                    break;
                }
            }
            fn(grid.index(i, j), z + slope * s + height);
        }
    }
}

}  // namespace slabwright
