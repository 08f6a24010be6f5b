#include "engine/mend/free_cutter.h"

#include <algorithm>

namespace slabwright {

FreeCutter::FreeCutter(const StandingPart& part, double z_top, const Tool& tool, double wider, double most)
    : part_(part),
      z_top_(z_top),
      radius_(tool.diameter / 2 + wider),
      shank_(tool.shank_diameter > tool.diameter && tool.flute_length > 0 ? tool.shank_diameter / 2 + wider
                                                                          : 0),
      nose_(tool.holder_diameter > tool.diameter && tool.stickout > 0 ? tool.holder_diameter / 2 + wider : 0),
      flute_(tool.flute_length),
      stickout_(tool.stickout),
      most_(most),
      ball_(tool.kind == ToolKind::ball) {}

bool FreeCutter::is_free(const Point3& from, const Point3& to) const {
    if (std::min(from[2], to[2]) >= z_top_) return true;
    if ((ball_ ? part_.ball(z_top_, from, to, radius_, most_)
               : part_.cylinder(z_top_, from, to, radius_, most_))
            .found)
        return false;
    const auto follows = [&](double radius, double above) {
        if (radius <= 0 || std::min(from[2], to[2]) + above >= z_top_) return false;
        return part_
            .cylinder(z_top_, {from[0], from[1], from[2] + above}, {to[0], to[1], to[2] + above}, radius,
                      most_)
            .found;
    };
    return !follows(shank_, flute_) && !follows(nose_, stickout_);
}

double FreeCutter::lift(const Point3& at) const {
    if (is_free(at, at)) return 0;
    double low = 0, high = std::max(0.0, z_top_ - at[2]);
    while (high - low > kLift) {
        const double mid = (low + high) / 2;
        const Point3 raised{at[0], at[1], at[2] + mid};
        (is_free(raised, raised) ? high : low) = mid;
    }
    return high;
}

}  // namespace slabwright
