// The double reference: equations 1 and 2 of LUO as forces.h states them, integrated along the engaged part
// of every tooth by Gauss's rule. On the ball, and on a bull-nose's corner, the variable is q = sin(κ/2), z =
// 2Rq²: the edge is smooth in it at the tip, where it is not in z. Panels of at most a quarter radian of lag
// leave the eight-point rule an error below the last digits.
#include "kernels/errors.h"
#include "kernels/forces/turn.h"

namespace slabwright {

namespace {

// Abscissae and weights of the eight-point Gauss–Legendre rule on [−1, 1]; symmetric.
constexpr std::array<double, 4> kNode{0.1834346424956498, 0.5255324099163290, 0.7966664774136267,
                                      0.9602898564975363};
constexpr std::array<double, 4> kWeight{0.3626837833783620, 0.3137066458778873, 0.2223810344533745,
                                        0.1012285362903763};

template <class F>
void gauss(double low, double high, int panels, F&& f) {
    const double half = (high - low) / panels / 2;
    for (int p = 0; p < panels; ++p) {
        const double middle = low + (2 * p + 1) * half;
        for (std::size_t i = 0; i < 4; ++i)
            f(middle - half * kNode[i], half * kWeight[i]), f(middle + half * kNode[i], half * kWeight[i]);
    }
}

}  // namespace

SegmentForces reference_forces(const CutSegment& s, double accuracy) {
    forces::check_segment(s, 0);
    const forces::Turn turn = forces::make_turn(s);
    if (turn.count == 0) return {};
    const ForceCoefficients& k = s.coefficients;
    const forces::Rounding rounding = forces::rounding_of(s);
    const forces::Flank flank = forces::flank_of(s);
    const double r = rounding.radius, disc = rounding.disc, c = s.chip_load_mm, lag = turn.lag_per_mm,
                 sin_taper = std::sin(s.taper_rad), cos_taper = std::cos(s.taper_rad);
    forces::Instant f;
    // Adds db of edge at slope κ and a distance from the axis; `turn_of_tooth` is the tooth's angle at the
    // tip.
    auto add = [&](double turn_of_tooth, double z, double sin_k, double cos_k, double db, double from_axis) {
        const double phi = turn_of_tooth - lag * z, sin_phi = std::sin(phi), cos_phi = std::cos(phi),
                     h = c * sin_phi * sin_k;
        const double ft = (k.ktc * h + k.kte) * db, fr = (k.krc * h + k.kre) * db,
                     fa = (k.kac * h + k.kae) * db;
        const double inward = fr * sin_k + fa * cos_k;
        f.x += -ft * cos_phi - inward * sin_phi;
        f.y += ft * sin_phi - inward * cos_phi;
        f.z += fa * sin_k - fr * cos_k;
        f.torque += ft * from_axis;
    };
    return forces::sweep_turn(s, turn, accuracy, [&](const forces::Heights& heights, double u) {
        f = {};
        if (heights.high <= heights.low) return f;
        const double ball_top = rounding.has ? std::min(flank.low, heights.high) : 0,
                     foot = std::max(ball_top, heights.low), flank_top = std::min(flank.high, heights.high),
                     shank = std::max(foot, flank_top);
        auto panels = [&](double length) {
            return std::max(1, static_cast<int>(std::ceil(length * lag * 4)));
        };
        if (ball_top > heights.low)
            gauss(std::sqrt(heights.low / (2 * r)), std::sqrt(ball_top / (2 * r)),
                  1 + panels(ball_top - heights.low), [&](double q, double dq) {
                      const double p = std::sqrt(1 - q * q);
                      add(u, 2 * r * q * q, 2 * q * p, 1 - 2 * q * q, 2 * r * dq / p, disc + r * 2 * q * p);
                  });
        if (s.tapers() && flank_top > foot)
            gauss(foot, flank_top, panels(flank_top - foot), [&](double z, double dz) {
                const double from_axis = flank.radius + (z - flank.low) * sin_taper / cos_taper;
                add(u, z, cos_taper, sin_taper, dz / cos_taper, from_axis);
            });
        if (heights.high > shank)
            gauss(shank, heights.high, panels(heights.high - shank),
                  [&](double z, double dz) { add(u, z, 1, 0, dz, s.radius_mm); });
        return f;
    });
}

}  // namespace slabwright
