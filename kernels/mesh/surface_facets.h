// Facets of a parametric surface, divided until they lie within a deviation of it.
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "kernels/geometry/vectors.h"
#include "kernels/mesh/mesh.h"

namespace slabwright {

/// Facets whose corners lie on one surface.
struct SurfaceFacets {
    std::vector<Point3> at;                 ///< mm
    std::vector<std::array<double, 2>> uv;  ///< the surface's parameters there, of each corner
    std::vector<Index3> facets;
};

/// A point of a surface, mm, by its parameters u and v.
using ParametricSurface = std::function<Point3(double, double)>;

/// Divides facets, at the middles of their edges or of themselves, where the surface lies farther off. An
/// edge that only one facet knows bounds the surface and stays as it is, for another surface may share it.
/// Corners keep their numbers, new ones follow.
/// @returns the farthest that the surface lies from the facets at four places within each, mm: no more than
/// the deviation, but where edges that stay, or a surface that is not smooth, allow no less
double refine_on(const ParametricSurface& surface, double deviation_mm, SurfaceFacets& mesh);

}  // namespace slabwright
