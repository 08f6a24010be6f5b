#include "kernels/stock/sweep.h"

#include <cmath>

namespace slabwright {

// Square roots make most of it, and wide vectors do several at once. All variants give the same bits: they do the same operations, each rounded
// as IEEE says, and none is fused.
#if defined(__x86_64__) && defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__)
[[gnu::target_clones("avx512f", "avx2", "default")]]
#endif
void ball_row(double a, double b, double c, double r2, double q, double dq, int n, double* h) {
    for (int k = 0; k < n; ++k) {
        const double across = q + k * dq;
        h[k] = a + b * k - c * std::sqrt(r2 - across * across);
    }
}

}  // namespace slabwright
