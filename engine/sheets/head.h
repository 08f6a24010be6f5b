// Where a tilting head stands along a cut: A leans it from upright, C says towards where (METHOD.md section
// 13).
#pragma once

#include <vector>

#include "engine/sheets/sheet_cuts.h"

namespace slabwright {

/// The axis meets the sheet's top at `top`; the jet goes down and, at a tilt a, towards the azimuth c.
struct HeadPoint {
    Point2 top;
    double a_deg = 0;  ///< 0 or more
    double c_deg = 0;  ///< counter-clockwise from x, counted on over full turns
};

/// Where that axis leaves a sheet's bottom. @param thickness mm
[[nodiscard]] Point2 bottom_of(const HeadPoint& point, double thickness);

/// A closed way as points of the head; the last is at the place of the first. A = acos(−Vz/|V|) and
/// C = atan2(Vy, Vx) of the jet's direction V. C turns by less than half a turn from point to point, and
/// stays as it was where A is next to nothing. Between two points A and C change evenly, which moves the
/// bottom on a curve: points are added until that is within `tolerance` of the straight line.
/// @param thickness mm of the sheet. @param tolerance mm, over 0
[[nodiscard]] std::vector<HeadPoint> head_way(const AxisLoop& loop, double thickness, double tolerance);

}  // namespace slabwright
