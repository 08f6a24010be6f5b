// The nearest point of a mesh, by Embree: for accessibility, for the depth of a gouge, for the height of what
// was left over.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "kernels/access/standing_part.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// What is nearest to a query point.
struct ClosestHit {
    double distance = 0;  ///< mm, negative inside the solid; the radius asked for when nothing is within it
    Point3 point{};       ///< on the facet
    std::uint32_t facet =
        kNoFacet;  ///< of equally near ones the lowest index; kNoFacet when nothing is within the radius
};

/// Embree's tree over a mesh, for queries from many threads. Distances are computed in double from the
/// float32 vertices; Embree only finds the candidates. The mesh's arrays and the context, to which its memory
/// is charged, must outlive it.
/// @throws Error(no_plan, "memory.limit"), and Error(input) on a facet with a non-finite corner (Embree would
/// leave it out in silence)
class ClosestPoint {
public:
    ClosestPoint(Context& context, MeshView mesh);
    ~ClosestPoint();
    ClosestPoint(const ClosestPoint&) = delete;
    ClosestPoint& operator=(const ClosestPoint&) = delete;

    /// Nearest point within max_radius (mm; finite or infinite), signed by winding().
    [[nodiscard]] ClosestHit query(const Point3& point, double max_radius) const;
    /// The same without the sign: distance ≥ 0.
    [[nodiscard]] ClosestHit query_unsigned(const Point3& point, double max_radius) const;
    /// One hit for each point, in the order of the points; in parallel, along a space-filling curve.
    [[nodiscard]] std::vector<ClosestHit> query(Context& context, std::span<const Point3> points,
                                                double max_radius) const;

    /// How many times the solid surrounds the point: 0 outside, 1 inside a proper solid. Counts the signed
    /// crossings of the upward ray in the half-open manner, so rays through edges and vertices are no
    /// exception.
    [[nodiscard]] int winding(const Point3& point) const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace slabwright
