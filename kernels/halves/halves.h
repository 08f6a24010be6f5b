// A solid in two halves: cut by a plane, capped, with holes for dowels that keep the halves together.
//
//     Halves halves = split_solid(context, mesh.view(), report, {.normal = {0, 0, 1}, .offset_mm = 40});
//     halves.above.mesh …                 // cut face down on z = 0, as it is built
//
// Put together again the halves are the solid: the points of the cut are the same float32 in both.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "kernels/geometry/affine.h"
#include "kernels/mesh/mesh.h"
#include "kernels/mesh/report.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// All points with normal · p = offset.
struct CutPlane {
    Vec3d normal{0, 0, 1};  ///< of any length over 0
    double offset_mm = 0;   ///< along the normal made one long
};

/// Holes of equal depth into both halves, square to the cut. The second is narrower by kSecondDowel, so that
/// the halves fit one way only.
struct DowelRules {
    double diameter_mm = 10;    ///< of the first; 0: none
    double depth_mm = 12;       ///< in each half
    double clearance_mm = 0.1;  ///< that a hole is wider than its dowel
    double wall_mm = 4;         ///< least material between a hole and the surface
};
inline constexpr double kSecondDowel = 0.8;

struct Dowel {
    Point3 at{};             ///< on the cut, in the solid's frame, mm
    double diameter_mm = 0;  ///< of the dowel
    double depth_mm = 0;     ///< in each half
};

struct Half {
    Mesh mesh;          ///< with neighbours, its cut face down on z = 0
    MeshReport report;  ///< on it
    AffineMap map;      ///< from the solid's frame
};

struct Halves {
    Half above, below;          ///< of the plane, the way that its normal points
    std::vector<Dowel> dowels;  ///< 0 to 2; as far apart as the cut allows
    double cut_mm2 = 0;         ///< of the cap, without holes
};

/// Cuts a solid. Each body is capped on its own, so that bodies may overlap. Vertices within 1e-5 mm of the
/// plane lie on it. Time O(n), and squared in the points of one body's section.
/// @param mesh with neighbours; its report says which facets are one body
/// @param mirror_below the half below is mirrored in x as well, as for a pattern on the other side of a plate
/// @throws Error(usage, "split.plane") for a plane without direction, Error(input, "split.misses") where all
/// of it lies on one side, Error(input, "split.crossing") where a section crosses itself or a half is no
/// solid, Error(cancelled)
[[nodiscard]] Halves split_solid(Context& context, MeshView mesh, const MeshReport& report,
                                 const CutPlane& plane, const DowelRules& dowels = {},
                                 bool mirror_below = false);

}  // namespace slabwright
