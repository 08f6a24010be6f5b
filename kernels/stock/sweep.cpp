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

}  // namespace slabwright
