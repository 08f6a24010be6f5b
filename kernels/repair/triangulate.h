// Triangles over a closed loop of points in space.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/repair/xyz.h"

namespace slabwright {

/// Loops of more points are closed by ear clipping in their plane, or not at all.
inline constexpr std::size_t kMostForLeastArea = 400;

/// The triangulation of a loop of n points that has the least area (Barequet and Sharir, "Filling gaps in
/// the boundary of a polyhedron", 1995; Klincsek 1980): n − 2 triangles of positions in the loop, that run
/// along it. Time n³, memory n²; n at most kMostForLeastArea.
[[nodiscard]] std::vector<std::array<std::uint32_t, 3>> least_area(std::span<const Xyz> loop);

/// The triangles of a flat region by clipping of ears, its holes joined to its outline by bridges.
/// @param loops positions of the points of each loop; the first is the outline, counter-clockwise seen along
/// −normal, the others its holes, clockwise
/// @returns triangles of positions in `points`; empty where the loops cross themselves
[[nodiscard]] std::vector<std::array<std::uint32_t, 3>> clip_ears(
    std::span<const Xyz> points, const std::vector<std::vector<std::uint32_t>>& loops, const Xyz& normal);

}  // namespace slabwright
