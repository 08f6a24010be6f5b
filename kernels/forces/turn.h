// One pitch of a turning cutter, cut where a tooth begins or ceases to enter or leave; shared by closed form,
// reference and OpenCL, so that all three look at the same instants. Internal to forces.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "kernels/forces/forces.h"

namespace slabwright::forces {

/// Lags and pieces shorter than this are taken as none: at the seam of two teeth (a slot cut by two flutes)
/// rounding would else make both seem engaged. It turns no force by more than itself.
inline constexpr double kShortest = 1e-5;

/// Fx, Fy, Fz and torque.
struct Instant {
    double x = 0, y = 0, z = 0, torque = 0;
};

/// What stays the same over the turn. A tooth's turn u is its angle at the tip, not wrapped: tooth m has u =
/// θ + m·pitch, and at height z it stands at u − lag_per_mm·z.
struct Turn {
    double pitch = 0;
    double entry = 0, exit = 0;
    double lag_per_mm = 0;  ///< 0 when too small to matter
    double low = 0, high = 0;
    double first = 0, last = 0;  ///< a tooth with u outside (first, last) cuts nowhere
    struct Piece {
        double begin = 0, length = 0;
    };
    /// Between the turns at which a tooth comes to an end of the arc with its lower end or its upper, or with
    /// the upper end of a corner that is no ball's or of a flank.
    std::array<Piece, 8> pieces;
    int count = 0;
};

/// A cutter's rounding, below its upright side: the edge runs at disc + radius·sin κ from the axis. Without
/// one the radius is the cutter's.
struct Rounding {
    bool has = false;
    double radius = 0, disc = 0;  ///< mm
};
[[nodiscard]] inline Rounding rounding_of(const CutSegment& s) {
    if (s.flat()) return {false, s.radius_mm, 0};
    if (s.tapers()) return {s.corner_mm > 0, s.corner_mm, 0};
    return {true, s.corner_mm, s.radius_mm - s.corner_mm};
}

/// Between the tip's rounding and the upright side of a cutter with a taper: from where the edge stands as
/// steep as the taper, `radius` from the axis, up to where it is as wide as the cutter. Of others it is where
/// their rounding ends, and has no height.
struct Flank {
    double low = 0, high = 0, radius = 0;  ///< mm
};
[[nodiscard]] inline Flank flank_of(const CutSegment& s) {
    if (!s.tapers()) return {s.corner_mm, s.corner_mm, s.radius_mm};
    const double from = s.corner_mm * std::cos(s.taper_rad), low = s.corner_mm * (1 - std::sin(s.taper_rad));
    return {low, low + std::max(0.0, s.radius_mm - from) / std::tan(s.taper_rad), from};
}

/// @throws Error(usage, "forces.segment") for a segment out of range; `index` names it
void check_segment(const CutSegment& segment, std::size_t index);

/// A segment that cuts nothing has no pieces.
[[nodiscard]] Turn make_turn(const CutSegment& segment);

/// The largest angle between samples for an accuracy, clamped to what is sensible (1e-8 … 0.1).
[[nodiscard]] inline double sample_angle(double accuracy) {
    return std::sqrt(2 * std::clamp(accuracy, 1e-8, 0.1));
}

/// Samples come in blocks of as many as a vector of the OpenCL kernel holds.
inline constexpr int kSampleBlock = 8;

/// Samples of a piece, both ends included.
[[nodiscard]] inline int samples_of(const Turn::Piece& piece, double angle) {
    const int blocks = static_cast<int>(std::ceil((piece.length / angle + 1) / kSampleBlock));
    return kSampleBlock * std::max(1, blocks);
}

/// The teeth that cut during a piece: m = first … last.
struct Teeth {
    int first = 0, last = -1;
};
[[nodiscard]] inline Teeth teeth_in(const Turn& turn, const Turn::Piece& piece) {
    const double middle = piece.begin + piece.length / 2;
    return {static_cast<int>(std::ceil((turn.first - middle) / turn.pitch)),
            static_cast<int>(std::floor((turn.last - middle) / turn.pitch))};
}

/// The heights at which a tooth is engaged at turn u, when the piece's middle lies at `middle` of the same
/// tooth. Which limit bounds them is decided in the middle, once for the piece; rounding at its ends cannot
/// change it.
struct Heights {
    double low = 0, high = 0;
};
[[nodiscard]] inline Heights engaged_heights(const Turn& t, double middle, double u) {
    Heights h{t.low, t.high};
    if (t.lag_per_mm > 0) {
        if (middle - t.lag_per_mm * t.high < t.entry)
            h.high = std::clamp((u - t.entry) / t.lag_per_mm, t.low, t.high);
        if (middle - t.lag_per_mm * t.low > t.exit)
            h.low = std::clamp((u - t.exit) / t.lag_per_mm, t.low, t.high);
    }
    h.high = std::max(h.high, h.low);
    return h;
}

[[nodiscard]] inline double watts_per_nmm(double rpm) { return rpm * 2 * std::numbers::pi / 60 / 1000; }

/// Fills the means of x, y, z, torque and power from the integrals over arc and edge, which every profile has
/// in closed form: each height sees the whole arc once a tooth, so the order of integration may be swapped.
void set_means(const CutSegment& segment, const Turn& turn, SegmentForces& out);

/// Gathers peaks, and the mean of the resultant by the trapezoidal rule over the pieces, of what
/// `tooth(heights, u)` returns as an Instant.
template <class Tooth>
SegmentForces sweep_turn(const CutSegment& segment, const Turn& turn, double accuracy, Tooth&& tooth) {
    SegmentForces out;
    const double angle = sample_angle(accuracy);
    for (int p = 0; p < turn.count; ++p) {
        const Turn::Piece& piece = turn.pieces[static_cast<std::size_t>(p)];
        const int n = samples_of(piece, angle);
        const double step = piece.length / (n - 1), middle = piece.begin + piece.length / 2;
        const Teeth teeth = teeth_in(turn, piece);
        for (int i = 0; i < n; ++i) {
            const double theta = i + 1 < n ? piece.begin + i * step : piece.begin + piece.length;
            Instant sum;
            for (int m = teeth.first; m <= teeth.last; ++m) {
                const double u = theta + m * turn.pitch;
                const Instant f = tooth(engaged_heights(turn, middle + m * turn.pitch, u), u);
                sum.x += f.x, sum.y += f.y, sum.z += f.z, sum.torque += f.torque;
            }
            const double in_plane = std::sqrt(sum.x * sum.x + sum.y * sum.y),
                         weight = (i == 0 || i + 1 == n ? 0.5 : 1) * step / turn.pitch;
            out.peak_x_n = std::max(out.peak_x_n, std::abs(sum.x));
            out.peak_y_n = std::max(out.peak_y_n, std::abs(sum.y));
            out.peak_z_n = std::max(out.peak_z_n, std::abs(sum.z));
            out.peak_in_plane_n = std::max(out.peak_in_plane_n, in_plane);
            out.peak_resultant_n =
                std::max(out.peak_resultant_n, std::sqrt(in_plane * in_plane + sum.z * sum.z));
            out.peak_torque_nmm = std::max(out.peak_torque_nmm, std::abs(sum.torque));
            out.mean_in_plane_n += weight * in_plane;
        }
    }
    set_means(segment, turn, out);
    out.peak_power_w = out.peak_torque_nmm * watts_per_nmm(segment.spindle_rpm);
    return out;
}

}  // namespace slabwright::forces
