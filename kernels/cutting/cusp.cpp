#include "kernels/cutting/cusp.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace slabwright {

double ball_level_cusp(double r, double alpha, double stepdown) {
    const double s = std::sin(alpha), c = std::cos(alpha),
                 step_along = stepdown / s;  // along the slope between contacts
    const double u = c > 0 ? stepdown * c / s : 0;
    if (u >= 2 * r) return std::numeric_limits<double>::infinity();
    // Where the two circles meet. They meet above the lower ball's equator as long as SD ≤ 2(R − L)·cos α,
    // which at the meeting point is step_along/2·s ≤ (R − L)·c; past that the lower cutter's vertical side
    // meets the upper circle.
    if (step_along < 2 * r) {
        const double cusp = r - std::sqrt(r * r - step_along * step_along / 4);
        if (stepdown <= 2 * (r - cusp) * c) return cusp;
    }
    return r * (1 - s) + (stepdown - std::sqrt(std::max(0.0, 2 * r * u - u * u))) * c;
}

double ball_level_stepdown(double r, double alpha, double cusp) {
    const double printed = ball_level_stepdown_printed(r, alpha, cusp);
    const double s = std::sin(alpha), c = std::cos(alpha);
    if (printed <= 2 * (r - cusp) * c) return printed;
    if (c < 1e-12) return std::numeric_limits<double>::infinity();  // a vertical wall keeps no cusp
    // The second case solved for SD, with t = cot α and K = (L − R(1 − sin α)) / cos α: of
    // SD²(1 + t²) − 2 SD (K + R t) + K² = 0 the larger root, where the cusp grows with the stepdown.
    const double t = c / s, k = (cusp - r * (1 - s)) / c, half = k + r * t;
    const double root = std::sqrt(std::max(0.0, half * half - (1 + t * t) * k * k));
    return std::min((half + root) / (1 + t * t), 2 * r * s / c);
}

double ball_level_stepdown_printed(double r, double alpha, double cusp) {
    return 2 * std::sqrt(2 * r * cusp - cusp * cusp) * std::sin(alpha);
}

double flat_level_cusp(double alpha, double stepdown) { return stepdown * std::cos(alpha); }

double flat_level_stepdown(double alpha, double cusp) {
    const double c = std::cos(alpha);
    return c < 1e-12 ? std::numeric_limits<double>::infinity() : cusp / c;
}

double raster_stepover(double r, double cusp, double normal_dot_step) {
    return 2 * std::sqrt(cusp * (2 * r - cusp) * std::max(0.0, 1 - normal_dot_step * normal_dot_step));
}

}  // namespace slabwright
