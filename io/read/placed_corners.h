// From what a format says to corners in millimetres on z = 0.
#pragma once

#include <array>

#include "io/read/mesh_format.h"
#include "kernels/geometry/affine.h"
#include "kernels/mesh/raw_array.h"

namespace slabwright {

/// Facets, set on z = 0 in millimetres, and where they lie in the file.
struct PlacedCorners {
    FacetRecords facets;  ///< of the file's bytes, or of `placed`
    RawArray<std::array<Vec3f, 3>> placed;
    std::array<double, 3> min{}, max{};  ///< mm, as in the file, mapped
};

/// The one rounding a coordinate suffers: scaled and lowered in double, then to float32 (as FacetRecords do
/// with binary ones). Corners that are equal in the file stay equal. @param decoded must outlive the corners
/// where it holds records. @param map of what the file says in millimetres; where it mirrors, facets are
/// turned over. Deterministic.
[[nodiscard]] PlacedCorners place_corners(Context& context, const DecodedMesh& decoded, double mm_per_unit,
                                          const AffineMap& map = {});

}  // namespace slabwright
