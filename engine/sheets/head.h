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

/// What a control without tool centre point control is told: the place of the head's pivot, less the pivot's
/// length in z, mm. Z is 0 where an upright jet begins at the sheet's top.
/// @param pivot mm from where A and C turn to the sheet's top, along the jet
struct PivotPlace {
    double x = 0, y = 0, z = 0;
};
[[nodiscard]] PivotPlace pivot_place(Point2 top, double a_deg, double c_deg, double pivot);

/// A closed way as points of the head; the last is at the place of the first. A = acos(−Vz/|V|) and
/// C = atan2(Vy, Vx) of the jet's direction V. C turns by less than half a turn from point to point, and
/// stays as it was where A is next to nothing. Between two points A and C change evenly, which moves the
/// bottom on a curve, and the top too where the pivot is moved: points are added until these are within
/// `tolerance` of the straight line.
/// @param thickness mm of the sheet. @param tolerance mm, over 0. @param pivot mm, as pivot_place(); 0: the
/// control keeps the top in place
[[nodiscard]] std::vector<HeadPoint> head_way(const AxisLoop& loop, double thickness, double tolerance,
                                              double pivot = 0);

}  // namespace slabwright
