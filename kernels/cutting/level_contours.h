// Level contours of a cutter: the border of what its tip must not enter at one height, linked from fibres.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/cutting/fibres.h"

namespace slabwright {

/// Closed polylines of cutter locations at one height, travelled with the solid on the right (climb milling
/// with a spindle that turns clockwise). Contour i has the points starts[i] … starts[i + 1] − 1; the last is
/// joined to the first.
struct Contours {
    std::vector<Point2> points;  ///< 0.1 µm
    std::vector<float> nz;       ///< at each point, as Forbidden::nz
    std::vector<std::uint32_t> starts{0};
    [[nodiscard]] std::size_t size() const noexcept { return starts.size() - 1; }
};

/// Lines of a square grid over the solid and the cutter's reach around it.
struct FibreGrid {
    std::int32_t pitch = 0;          ///< 0.1 µm
    std::vector<std::int32_t> x, y;  ///< coordinates of the fibres along y (at x[i]) and along x (at y[j])
};

/// A grid of `pitch` (units), aligned to the origin, that encloses every contour of this cutter around this
/// solid.
[[nodiscard]] FibreGrid fibre_grid(const LayerSolid& solid, const CutterShape& cutter, std::int32_t pitch);

/// The contours at tip height `tip_z`. Every point is the exact end of a fibre's interval, neighbours are at
/// most √2·pitch apart. A chord of that length between two free positions enters the forbidden region of a
/// cutter of radius r by at most pitch²/(4r), measured normal to the part: whatever the region does between
/// the fibres, each point of it lies in a ball (for a flat cutter a disc) of radius r around a point of the
/// solid, and that ball contains neither end of the chord.
[[nodiscard]] Contours level_contours(Context& context, const LayerSolid& solid, const Loops& inside,
                                      const CutterShape& cutter, double tip_z, const FibreGrid& grid);

/// The same at several heights, in any order; a result for each.
[[nodiscard]] std::vector<Contours> level_contours(Context& context, const LayerSolid& solid,
                                                   std::span<const FibreLevel> levels,
                                                   const CutterShape& cutter, const FibreGrid& grid);

}  // namespace slabwright
