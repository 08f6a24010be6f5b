// On which side a pattern is best built: the six sides of its box and the facets of its convex hull.
#pragma once

#include <array>
#include <vector>

#include "engine/job.h"
#include "engine/planner/ways_out.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// A way to lay a pattern down.
struct Orientation {
    std::array<double, 3> turn{};  ///< degrees, as PrepareJob::turn
    std::array<double, 3> size{};  ///< of the pattern as it then lies, mm
    double foot_mm2 = 0;           ///< of the pattern that then lies on the board
    Lying outcome;
};

/// Ways to lay a pattern down, each looked at as a plan looks at it, the best first: with room, then least
/// unmade (to a hundredth of a cubic centimetre), fewest layers, largest foot. As it lies, on each side of
/// its box, and on the facets of its convex hull that have at least a hundredth of the hull's surface, the
/// largest `most_facets` of them; in the plane so that its outline's box is least, and lies within the slab;
/// as it lies also not turned at all. Ways that differ by less than half a degree are one. Deterministic;
/// some tenths of a second each for a million facets.
/// @param mesh a solid. @throws as lying()
[[nodiscard]] std::vector<Orientation> orientations(Context& context, MeshView mesh, const Job& job,
                                                    std::size_t most_facets = 12);

/// The angles that lay the side with outward normal `down` on the board, turned about z by none.
[[nodiscard]] std::array<double, 3> turn_that_lays(const std::array<double, 3>& down);

}  // namespace slabwright
