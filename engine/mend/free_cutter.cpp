#include "engine/mend/free_cutter.h"

#include <algorithm>

namespace slabwright {

FreeCutter::FreeCutter(const StandingPart& part, double z_top, const Tool& tool, double wider, double most)
    : part_(part),
      z_top_(z_top),
      radius_(tool.diameter / 2 + wider),
      most_(most),
      shape_(cutter_shape(tool)),
      cylinders_(cylinders_of(tool)) {
    for (ToolSection& cylinder : cylinders_) cylinder.radius += wider;
    // Thicker all around a cutter with a taper is one whose tip is rounder by as much and lies lower; all
    // others have their side and no floor to go by.
    if (shape_.taper_rad > 0) shape_.corner += wider, lower_ = wider;
    else if (!shape_.is_ball()) shape_ = flat_cutter(radius_);
    else shape_.corner = radius_;
    shape_.radius = radius_;
}

bool FreeCutter::is_free(const Point3& from, const Point3& to) const {
    if (std::min(from[2], to[2]) >= z_top_) return true;
    if (part_
            .depth(shape_, z_top_, {from[0], from[1], from[2] - lower_}, {to[0], to[1], to[2] - lower_},
                   most_)
            .found)
        return false;
    return std::none_of(cylinders_.begin(), cylinders_.end(), [&](const ToolSection& cylinder) {
        const double above = cylinder.above;
        if (std::min(from[2], to[2]) + above >= z_top_) return false;
        return part_
            .cylinder(z_top_, {from[0], from[1], from[2] + above}, {to[0], to[1], to[2] + above},
                      cylinder.radius, most_)
            .found;
    });
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
