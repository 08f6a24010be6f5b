// The lines of a projected raster: in which directions they run, and how far apart they lie.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/paths/operations/finish_slopes.h"
#include "engine/paths/operations/line_directions.h"
#include "engine/paths/runs/layer_cut.h"

namespace slabwright {

/// The facets that a ball is projected on.
struct RasterFacets {
    std::vector<SolidFacet> shallow;  ///< at least one
    std::vector<SolidFacet> made;     ///< those of them that the ball makes: no floors
    FinishSlopes slopes;
    double radius = 0;  ///< mm, of the ball
    double top = 0;     ///< mm: the rim of the layer's flat top, made by the walls under it, begins there
};

/// Lines of one direction.
struct RasterLines {
    std::size_t number = 0;  ///< of their direction
    LineDirection direction;
    std::vector<std::int32_t> across;  ///< where they lie across it, 0.1 µm, ascending
    double widest_mm = 0;              ///< the largest step-over
    bool kept_wide = false;            ///< cutting.min_stepover was wider than the cusp allows
    std::vector<bool> apart;           ///< of a sample: whether lines are left out behind this one
    std::vector<Spans> reach;          ///< of each line where the ball may touch what is to be made
};

/// Lines along x over all the facets, the step-overs by FINISH eq. 9, each from the slopes that the ball
/// touches there.
[[nodiscard]] RasterLines raster_lines(const LayerCut& cut, const RasterFacets& facets);
/// The same of one direction over its targets, from the slopes near them.
[[nodiscard]] RasterLines raster_lines(const LayerCut& cut, const RasterFacets& facets,
                                       const LineDirections& directions, std::size_t number);

/// About how long it is to run them, mm, with some for the beginning of each stretch.
[[nodiscard]] double length_mm(const RasterLines& lines);

/// A sample: so many groups of `together` lines that lie beside each other, at even distances.
[[nodiscard]] RasterLines some_of(const RasterLines& lines, std::size_t groups, std::size_t together);

}  // namespace slabwright
