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
    const double dx = way.dx, dy = way.dy, run = way.run, slope = way.slope, z = way.z, R = way.radius, R2 = R * R, lead = way.lead,
                 least = way.s_least, most = way.s_most, x0 = way.x0, cell = way.cell, from_x = way.from_x;
    if (way.ball && slope == 0) {
        for (int k = 0; k < n; ++k) {
            const double px = x0 + (i0 + k) * cell - from_x, s0 = px * dx + py * dy, d2 = px * px + py * py - s0 * s0, q2 = d2 > 0 ? d2 : 0.0,
                         w2 = R2 - q2;
            const double s_up = s0 > 0 ? s0 : 0.0, s = s_up < run ? s_up : run, over = s0 - s, h2 = w2 - over * over;
            const double height = z + R - std::sqrt(h2 > 0 ? h2 : 0.0);
            const bool asked = (h2 >= 0) & (s0 <= most) & (s0 >= least);
            h[k] = asked ? height : kUncovered;
        }
    } else if (way.ball) {
        for (int k = 0; k < n; ++k) {
            const double px = x0 + (i0 + k) * cell - from_x, s0 = px * dx + py * dy, d2 = px * px + py * py - s0 * s0, q2 = d2 > 0 ? d2 : 0.0,
                         w2 = R2 - q2;
            const double w = std::sqrt(w2 > 0 ? w2 : 0.0), low = s0 - w > 0 ? s0 - w : 0.0, high = s0 + w < run ? s0 + w : run, at = s0 - w * lead;
            const double s_up = at < low ? low : at, s = high < s_up ? high : s_up, h2 = w2 - (s - s0) * (s - s0);
            const double height = (R - std::sqrt(h2 > 0 ? h2 : 0.0)) + (z + slope * s);
            const bool asked = (w2 >= 0) & (low <= high) & (at <= most) & (at >= least);
            h[k] = asked ? height : kUncovered;
        }
    } else {
        for (int k = 0; k < n; ++k) {
            const double px = x0 + (i0 + k) * cell - from_x, s0 = px * dx + py * dy, d2 = px * px + py * py - s0 * s0, q2 = d2 > 0 ? d2 : 0.0,
                         w2 = R2 - q2;
            const double w = std::sqrt(w2 > 0 ? w2 : 0.0), low = s0 - w > 0 ? s0 - w : 0.0, high = s0 + w < run ? s0 + w : run;
            const double height = z + slope * (slope >= 0 ? low : high);
            const bool asked = (w2 >= 0) & (low <= high) & (s0 <= most) & (s0 >= least);
            h[k] = asked ? height : kUncovered;
        }
    }
    if (stands != nullptr) return some_lower(stands, bottom, n, h);
    int any = 0;
    for (int k = 0; k < n; ++k) any |= static_cast<int>(h[k] < kUncovered);
    return any != 0;
}

}  // namespace slabwright
