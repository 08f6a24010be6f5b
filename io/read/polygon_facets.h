// Polygons with holes in no place and any number of corners, cut into facets.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "io/read/mesh_format.h"

namespace slabwright {

/// Appends the facets of one polygon: three corners as they are, a convex one as a fan from its first corner,
/// any other by cutting its ears off. Costs the square of the number of corners where it is not convex.
/// @param corners at least three, in range; the polygon is about flat
void append_polygon(std::span<const std::uint32_t> corners, std::span<const FileVertex> vertices,
                    std::vector<Index3>& facets);

/// Most corners of a polygon.
inline constexpr std::size_t kMostCorners = 4096;

}  // namespace slabwright
