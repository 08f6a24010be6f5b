// Holes made as round as they were drawn: their walls stand on chords of the circle through their corners.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "kernels/features/holes.h"

namespace slabwright {

/// The loops at the border of a hole's facets, as its facets run along them; none where one meets itself.
[[nodiscard]] std::vector<std::vector<std::uint32_t>> rims_of(MeshView mesh, const RoundHole& hole);

/// Whether all corners of a rim are equally high, within a micrometre.
[[nodiscard]] bool is_level(MeshView mesh, const std::vector<std::uint32_t>& rim);

struct RoundedMesh {
    Mesh mesh;
    std::vector<std::size_t> rounded;  ///< which of the holes, ascending
};

/// Puts corners between those of the rims, on the circle, until no chord lies farther within it than
/// `chord_mm`, and makes walls and cones anew between them. The facets around a rim get corners too, and
/// edges between level ones turn where an arc would reach out of a sliver; nothing else moves. Only upright
/// plain holes (narrowest_part) with level rims, open below or ending in a point, are rounded, and only where
/// no facet around the rim would fold.
/// @return none where no hole was rounded
[[nodiscard]] std::optional<RoundedMesh> with_rounded_holes(Context& context, MeshView mesh,
                                                            std::span<const RoundHole> holes,
                                                            double chord_mm);

}  // namespace slabwright
