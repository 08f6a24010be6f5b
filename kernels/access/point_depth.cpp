// How deep a drill stands in the part: a cone under a cylinder.
#include <algorithm>
#include <cmath>

#include "kernels/access/piece_depth.h"
#include "kernels/access/poke.h"
#include "kernels/access/standing_part.h"
#include "kernels/access/standing_walk.h"

namespace slabwright {

namespace {
constexpr double kFine = StandingPart::kNumericalError;
}

Penetration StandingPart::pointed(double z_top, const Point3& tip, double radius, double taper_rad,
                                  double at_least) const {
    Penetration result{0, tip, false};
    const double top = z_top - kSheet, sine = std::sin(taper_rad);
    if (radius <= at_least || tip[2] >= top) return result;
    Envelope whole;
    whole.radius = radius;
    whole.sin_taper = sine;
    whole.cos_taper = std::cos(taper_rad);
    double deepest = at_least;
    const auto raise = [&](double depth) {
        if (depth <= deepest) return;
        deepest = depth;
        result = {depth, tip, true};
    };
    // Under the cap the axis is the deepest, at the top.
    if (const double under = std::min(radius, (top - tip[2]) * sine);
        under > deepest && covered(tip[0], tip[1], top))
        raise(under);
    const Within box({tip[0] - radius, tip[1] - radius, tip[2]}, {tip[0] + radius, tip[1] + radius, top});
    walk_within(box, [&](const Facet& facet) {
        below(facet.v, top, [&](const Triangle& triangle) {
            Point3 at{};
            const auto is_deeper = [&](double depth) {
                return depth < radius && pokes(triangle, tip[0], tip[1], tip[2], whole.eroded(depth), at);
            };
            if (!is_deeper(deepest)) return;
            double low = deepest, high = radius;
            while (high - low > kFine) {
                const double middle = (low + high) / 2;
                (is_deeper(middle) ? low : high) = middle;
            }
            raise(high);
        });
    });
    return result;
}

}  // namespace slabwright
