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

}  // namespace slabwright
