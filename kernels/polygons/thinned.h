// Loops and lines with fewer points: chords that stay within a tolerance of the line given.
#pragma once

#include <vector>

#include "kernels/polygons/farthest.h"
#include "kernels/polygons/loops.h"

namespace slabwright {

/// Of each point of a polyline, whether it stays where those go that lie within `tolerance` of the chord
/// between points that stay (Ramer–Douglas–Peucker). First and last stay. Every point of the polyline lies
/// within `tolerance` (the points' unit) of the result, and the other way round.
/// @param line of two points at least
[[nodiscard]] std::vector<char> kept_within(const PointRows& line, double tolerance);

/// The same of closed loops, `mm` at most from the chords between the points that stay; loops of fewer than
/// three points then are left out. Loops may cross where they come nearer to each other than twice that.
[[nodiscard]] Loops thinned(const Loops& loops, double mm);

/// Loops of more than 20 000 points, thinned by 0.005 mm and parted again where they would cross; others as
/// they are.
[[nodiscard]] Loops lighter(Loops loops);

}  // namespace slabwright
