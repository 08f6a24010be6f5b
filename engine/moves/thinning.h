// Points of paths, and fewer of them: chords that stay within a tolerance of the line given.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/plan.h"

namespace slabwright {

/// A point of a path, 0.1 µm.
struct PathPoint {
    std::int32_t x = 0, y = 0, z = 0;
    friend bool operator==(const PathPoint&, const PathPoint&) = default;
};

/// Leaves out points of a polyline that lie within `tolerance` (0.1 µm units) of the chord between kept ones
/// (Ramer–Douglas–Peucker in three dimensions). First and last stay. Every point of the result lies within
/// `tolerance` of the polyline given.
[[nodiscard]] std::vector<PathPoint> simplify(std::span<const PathPoint> line, double tolerance);

/// The same of a line to two tolerances: to `loose` (0.1 µm) where the line then turns by no more than `turn`
/// (radians) at a point, to `fine` elsewhere. A machine slows down in sharper turns (travel_seconds), so
/// where it need not, no time is lost by longer chords.
[[nodiscard]] std::vector<PathPoint> simplify(std::span<const PathPoint> line, double fine, double loose,
                                              double turn);

/// The turn at a point, radians, that a machine takes at a feed (mm/min) without slowing down: θ = √(8aδ)/v
/// (travel_seconds).
[[nodiscard]] double fast_turn(const Machine& machine, double feed, double blend = kJunction);

}  // namespace slabwright
