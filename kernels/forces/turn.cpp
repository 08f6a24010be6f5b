#include "kernels/forces/turn.h"

#include <string>

#include "kernels/errors.h"

namespace slabwright::forces {

namespace {

[[noreturn]] void refuse(const char* what, std::size_t index) {
    throw Error(ErrorKind::usage, "forces.segment", what, "segment " + std::to_string(index),
                "correct the cut's geometry or the material's coefficients");
}

bool finite(const ForceCoefficients& k) {
    return std::isfinite(k.ktc) && std::isfinite(k.krc) && std::isfinite(k.kac) && std::isfinite(k.kte) &&
           std::isfinite(k.kre) && std::isfinite(k.kae);
}

}  // namespace

void check_segment(const CutSegment& s, std::size_t index) {
    // Written so that NaN fails every test.
    if (s.flutes < 1 || s.flutes > 32) refuse("the number of flutes is not in 1 … 32", index);
    if (!(s.radius_mm > 0 && s.radius_mm <= 1e4)) refuse("the cutter's radius is not positive", index);
    if (!(s.corner_mm >= 0 && s.corner_mm <= s.radius_mm))
        refuse("the corner is not between 0 and the cutter's radius", index);
    if (!(s.taper_rad >= 0 && s.taper_rad < std::numbers::pi / 2))
        refuse("the taper is not in 0 … 90°", index);
    if (!(s.helix_rad >= 0 && s.helix_rad <= std::numbers::pi / 3 + 1e-12))
        refuse("the helix angle is not in 0 … 60°", index);
    if (!(s.low_mm >= 0 && s.high_mm >= s.low_mm && s.high_mm <= 64 * s.radius_mm))
        refuse("the engaged heights are not ordered, negative, or above 64 radii", index);
    if (!(s.arc.entry_rad >= 0 && s.arc.exit_rad >= s.arc.entry_rad &&
          s.arc.exit_rad <= std::numbers::pi + 1e-12))
        refuse("the engagement arc is not within 0 … π", index);
    if (!(s.chip_load_mm >= 0 && std::isfinite(s.chip_load_mm))) refuse("the chip load is negative", index);
    if (!(s.spindle_rpm >= 0 && std::isfinite(s.spindle_rpm))) refuse("the spindle speed is negative", index);
    if (!finite(s.coefficients)) refuse("a force coefficient is not a number", index);
}

Turn make_turn(const CutSegment& s) {
    Turn t;
    t.pitch = 2 * std::numbers::pi / s.flutes;
    t.entry = s.arc.entry_rad;
    t.exit = s.arc.exit_rad;
    t.low = s.low_mm;
    t.high = s.high_mm;
    t.lag_per_mm = std::tan(s.helix_rad) / s.radius_mm;
    if (t.lag_per_mm * t.high < kShortest) t.lag_per_mm = 0;
    t.first = t.entry + t.lag_per_mm * t.low;
    t.last = t.exit + t.lag_per_mm * t.high;
    if (t.high <= t.low || t.exit - t.entry < kShortest) return t;
    std::array<double, 8> cuts{t.first, t.entry + t.lag_per_mm * t.high, t.exit + t.lag_per_mm * t.low,
                               t.last};
    std::size_t count = 4;
    // Over its corner, and over its flank, an edge stands steeper at once.
    const Flank flank = flank_of(s);
    const auto cut_at = [&](double z) {
        if (z <= t.low || z >= t.high) return;
        for (const double end : {t.entry, t.exit}) cuts[count++] = end + t.lag_per_mm * z;
    };
    if (!s.flat() && !s.ball()) cut_at(flank.low);
    if (s.tapers()) cut_at(flank.high);
    const auto used = std::span(cuts).first(count);
    for (double& cut : used) cut -= t.pitch * std::floor(cut / t.pitch);
    std::sort(used.begin(), used.end());
    for (std::size_t i = 0; i < count; ++i) {
        const double next = i + 1 < count ? cuts[i + 1] : cuts[0] + t.pitch;
        if (next - cuts[i] < kShortest) continue;
        t.pieces[static_cast<std::size_t>(t.count++)] = {cuts[i], next - cuts[i]};
    }
    return t;
}

void set_means(const CutSegment& s, const Turn& t, SegmentForces& out) {
    const ForceCoefficients& k = s.coefficients;
    const Rounding rounding = rounding_of(s);
    const double r = rounding.radius, disc = rounding.disc, tc = k.ktc * s.chip_load_mm,
                 rc = k.krc * s.chip_load_mm, ac = k.kac * s.chip_load_mm;
    // Over the edge: of 1, sin κ, sin²κ, cos κ and sin κ·cos κ; and of the radius and the radius times sin κ.
    double e0 = 0, e1 = 0, e2 = 0, g0 = 0, g1 = 0, m0 = 0, m1 = 0, shank = t.low;
    const Flank flank = flank_of(s);
    if (rounding.has && t.low < flank.low) {
        shank = std::min(flank.low, t.high);
        const double c0 = 1 - t.low / r, c1 = 1 - shank / r, s0 = std::sqrt(1 - c0 * c0),
                     s1 = std::sqrt(1 - c1 * c1);
        e0 = r * (std::acos(c1) - std::acos(c0));
        e1 = r * (c0 - c1);
        e2 = (e0 - r * (s1 * c1 - s0 * c0)) / 2;
        g0 = r * (s1 - s0);
        g1 = r * (s1 * s1 - s0 * s0) / 2;
        m0 = r * e1 + disc * e0;
        m1 = r * e2 + disc * e1;
    }
    if (const double top = std::min(flank.high, t.high); top > shank) {
        const double cosine = std::cos(s.taper_rad), tangent = std::tan(s.taper_rad), dz = top - shank,
                     middle = flank.radius + ((top + shank) / 2 - flank.low) * tangent;
        e0 += dz / cosine, e1 += dz, e2 += dz * cosine;
        g0 += dz * tangent, g1 += dz * cosine * tangent;
        m0 += middle * dz / cosine, m1 += middle * dz;
        shank = top;
    }
    if (t.high > shank) {
        const double dz = t.high - shank;
        e0 += dz, e1 += dz, e2 += dz;
        m0 += s.radius_mm * dz, m1 += s.radius_mm * dz;
    }
    // Over the arc: of 1, sin φ, cos φ, sin²φ and sin φ·cos φ, a pitch long.
    const double sa = std::sin(t.entry), ca = std::cos(t.entry), sb = std::sin(t.exit), cb = std::cos(t.exit);
    const double a0 = (t.exit - t.entry) / t.pitch, a1 = (ca - cb) / t.pitch, b1 = (sb - sa) / t.pitch;
    const double a2 = (a0 - (sb * cb - sa * ca) / t.pitch) / 2, ab = (sb * sb - sa * sa) / 2 / t.pitch;
    out.mean_x_n =
        -(tc * e1 * ab + k.kte * e0 * b1) - (rc * e2 + ac * g1) * a2 - (k.kre * e1 + k.kae * g0) * a1;
    out.mean_y_n =
        (tc * e1 * a2 + k.kte * e0 * a1) - (rc * e2 + ac * g1) * ab - (k.kre * e1 + k.kae * g0) * b1;
    out.mean_z_n = (ac * e2 - rc * g1) * a1 + (k.kae * e1 - k.kre * g0) * a0;
    out.mean_torque_nmm = tc * m1 * a1 + k.kte * m0 * a0;
    out.mean_power_w = out.mean_torque_nmm * watts_per_nmm(s.spindle_rpm);
}

}  // namespace slabwright::forces
