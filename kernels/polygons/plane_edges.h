// Edges that meet in their ends only. Internal to polygons.
#pragma once

#include <vector>

#include "kernels/polygons/loops.h"

namespace slabwright {

/// From `a` to `b`, in the direction of its loop.
struct PlaneEdge {
    Point2 a, b;
    friend bool operator==(const PlaneEdge&, const PlaneEdge&) = default;
    friend auto operator<=>(const PlaneEdge&, const PlaneEdge&) = default;
};

/// The loops' edges, each once, divided where others cross or touch them; a crossing is rounded to 0.1 µm.
/// Where a few rounds of that do not end (edges within a unit of each other), the shorter of two that still
/// cross is left out. In ascending order. O(n log n) for edges that cross few of a grid's cells.
[[nodiscard]] std::vector<PlaneEdge> edges_meeting_in_ends(const Loops& loops);
[[nodiscard]] std::vector<PlaneEdge> edges_meeting_in_ends(std::vector<PlaneEdge> edges);

}  // namespace slabwright
