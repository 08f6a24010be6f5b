// The flat end mill's forces without discs. Over the engaged heights, L of them about a middle at which the
// tooth stands at φ, the tooth's angle spans 2δ = lag·L, and the integrals over z are
//     ∫ sin = L·sin φ·sinc δ,   ∫ cos = L·cos φ·sinc δ,   ∫ sin 2 = L·sin 2φ·sinc 2δ,   ∫ cos 2 = L·cos
//     2φ·sinc 2δ,
// which hold as they stand without helix (δ = 0) too, and lose no digits near it, as differences of
// antiderivatives would.
#include "kernels/errors.h"
#include "kernels/forces/turn.h"

namespace slabwright {

namespace {

double sinc(double x) { return std::abs(x) < 1e-4 ? 1 - x * x / 6 : std::sin(x) / x; }

}  // namespace

SegmentForces closed_form_forces(const CutSegment& s, double accuracy) {
    forces::check_segment(s, 0);
    if (!s.flat())
        throw Error(ErrorKind::usage, "forces.segment", "a cutter with a rounding has no closed form", {},
                    "use reference_forces");
    const forces::Turn turn = forces::make_turn(s);
    if (turn.count == 0) return {};
    const ForceCoefficients& k = s.coefficients;
    const double tc = k.ktc * s.chip_load_mm, rc = k.krc * s.chip_load_mm, ac = k.kac * s.chip_load_mm;
    return forces::sweep_turn(s, turn, accuracy, [&](const forces::Heights& h, double u) {
        const double length = h.high - h.low, phi = u - turn.lag_per_mm * (h.high + h.low) / 2,
                     delta = turn.lag_per_mm * length / 2;
        const double one = sinc(delta), two = sinc(2 * delta);
        const double s1 = std::sin(phi) * one, c1 = std::cos(phi) * one, s2 = std::sin(2 * phi) * two,
                     c2 = std::cos(2 * phi) * two;
        forces::Instant f;
        f.x = length * (-0.5 * tc * s2 - k.kte * c1 - 0.5 * rc * (1 - c2) - k.kre * s1);
        f.y = length * (0.5 * tc * (1 - c2) + k.kte * s1 - 0.5 * rc * s2 - k.kre * c1);
        f.z = length * (ac * s1 + k.kae);
        f.torque = length * s.radius_mm * (tc * s1 + k.kte);
        return f;
    });
}

}  // namespace slabwright
