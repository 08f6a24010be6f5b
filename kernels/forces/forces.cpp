#include "kernels/forces/forces.h"

#include <algorithm>
#include <cmath>

#include "kernels/errors.h"
#include "kernels/forces/turn.h"

namespace slabwright {

CutSegment segment_of(const CutterShape& cutter) {
    CutSegment segment;
    segment.radius_mm = cutter.radius;
    segment.corner_mm = cutter.corner;
    segment.taper_rad = cutter.taper_rad;
    return segment;
}

double radius_at(const CutSegment& s, double height_mm) {
    const double r = s.radius_mm, corner = s.corner_mm;
    if (s.tapers()) {
        const forces::Flank flank = forces::flank_of(s);
        if (height_mm < flank.low) return std::sqrt(height_mm * (2 * corner - height_mm));
        return std::min(r, flank.radius + (height_mm - flank.low) * std::tan(s.taper_rad));
    }
    return height_mm < corner ? r - corner + std::sqrt(height_mm * (2 * corner - height_mm)) : r;
}

ForceCoefficients resolve_coefficients(const OrthogonalForces& k, double helix,
                                       CoefficientTransform transform) {
    const double c = std::cos(helix), s = std::sin(helix);
    if (transform == CoefficientTransform::printed) {
        const double tc = k.kfc + k.ktc * c, te = k.kfe + k.kte * c;
        return {tc, tc, k.ktc * s, te, te, k.kte * s};
    }
    return {k.ktc * c, k.kfc, k.ktc * s, k.kte * c, k.kfe, k.kte * s};
}

EngagementArc engagement_arc(double radius, double width, MillingSense sense) {
    if (!(radius > 0 && width >= 0))
        throw Error(ErrorKind::usage, "forces.segment",
                    "a cut needs a positive radius and a width of at least 0");
    const double arc = std::acos(std::max(-1.0, 1 - width / radius));
    if (sense == MillingSense::up) return {0, arc};
    return {std::numbers::pi - arc, std::numbers::pi};
}

CutForce peak_force(const CutSegment& segment, double accuracy) {
    const SegmentForces f =
        segment.flat() ? closed_form_forces(segment, accuracy) : reference_forces(segment, accuracy);
    return {f.peak_resultant_n, f.peak_z_n, f.peak_torque_nmm, f.mean_power_w, f.peak_in_plane_n};
}

}  // namespace slabwright
