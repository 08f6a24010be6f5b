#include "kernels/access/place_proofs.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace slabwright {

PlaceDepth depth_of(const Point3& q, const ToolPlaces& at, const Envelope& e) {
    const double dx = q[0] - at.x, dy = q[1] - at.y, d = std::sqrt(dx * dx + dy * dy),
                 z = q[2] - at.tip - e.low - e.rounding;
    if (e.core == 0 &&
        e.sin_taper ==
            0) {  // a ball under its own cylinder: no more than the distance from its axis or centre
        const double fall = std::min(0.0, z), far = std::sqrt(d * d + fall * fall);
        return far > 0 ? PlaceDepth{e.rounding - far, {dx / far, dy / far, fall / far}, far}
                       : PlaceDepth{e.rounding, {}, 0};
    }
    const double ex = d > 0 ? dx / d : 1, ey = d > 0 ? dy / d : 0;
    auto depth = [&](double mm, double out, double rise, double bend) {
        return PlaceDepth{mm, {out * ex, out * ey, rise}, bend};
    };
    const double beyond = d - e.core, off = beyond * e.cos_taper - z * e.sin_taper,
                 up_flank = beyond * e.sin_taper + z * e.cos_taper;
    if (d > e.radius) return depth(e.radius - d, 1, 0, 0);
    if (z <= 0 && beyond <= 0) return depth(e.rounding + z, 0, -1, -z);
    if (beyond > 0 && up_flank <= 0) {  // below the flank's foot: the disc's border is nearest
        const double far = std::sqrt(beyond * beyond + z * z);
        return far > 0 ? depth(e.rounding - far, beyond / far, z / far, far) : depth(e.rounding, 1, 0, 0);
    }
    PlaceDepth side = off > 0 ? depth(e.rounding - off, e.cos_taper, -e.sin_taper, off)
                              : depth(e.rounding - off, e.cos_taper, -e.sin_taper, d);
    if (e.radius - d < side.mm) side = depth(e.radius - d, 1, 0, d);
    if (off > 0) return side;
    // Within the core the depth is the lesser of those from the side and from below. Where one of them is
    // ample all over the patch, the other decides.
    const double rise = e.rounding + z;
    if (rise - at.lift > at.tolerance && side.mm <= rise) return side;
    if (side.mm - at.spread > at.tolerance) return depth(rise, 0, -1, std::numeric_limits<double>::max());
    if (rise - at.lift > at.tolerance) return side;
    return depth(std::min(rise, side.mm), 0, 0, 0);
}

DepthProof proof_of(const PlaceDepth& depth, const ToolPlaces& at) {
    if (depth.bend <= 0) return {depth.mm - at.spread, 0, 0};
    return {depth.mm - at.second - at.spread * at.spread / (2 * depth.bend),
            dot(depth.gradient, at.along) * at.dl, dot(depth.gradient, at.around) * at.ds};
}

bool rules_out(const PlaceDepth& depth, const ToolPlaces& at) {
    const double tolerance = at.tolerance;
    if (depth.mm - at.spread > tolerance) return true;
    const DepthProof p = proof_of(depth, at);
    return p.floor - std::abs(p.by_l) - std::abs(p.by_s) > tolerance;
}

bool rule_out(const DepthProof& a, const DepthProof& b, double tolerance) {
    if (std::max(a.floor, b.floor) <= tolerance) return false;
    auto mean = [&](double w) {
        return w * a.floor + (1 - w) * b.floor - std::abs(w * a.by_l + (1 - w) * b.by_l) -
                   std::abs(w * a.by_s + (1 - w) * b.by_s) >
               tolerance;
    };
    auto cancelling = [&](double p, double q) { return (p > 0) != (q > 0) && p != q && mean(q / (q - p)); };
    return cancelling(a.by_l, b.by_l) || cancelling(a.by_s, b.by_s);
}

}  // namespace slabwright
