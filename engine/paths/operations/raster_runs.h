// What the ball runs on a raster's lines.
#pragma once

#include <vector>

#include "engine/paths/operations/raster_lines.h"
#include "engine/paths/runs/chains.h"
#include "engine/paths/runs/layer_cut.h"
#include "kernels/cutting/drop.h"

namespace slabwright {

using RasterRuns = std::vector<std::vector<PathPoint>>;

/// The ball's ways over the surface.
[[nodiscard]] Slide raster_slide(const LayerCut& cut, const DropIndex& ball);

/// Runs where the ball has something to make: those on the lines, then those on lines in between, which are
/// laid where the surface turns faster than the raster follows.
/// @param directions of the raster, but for places that have lines of another; null: it makes all
[[nodiscard]] RasterRuns raster_runs(const LayerCut& cut, const RasterFacets& facets,
                                     const RasterLines& raster, const DropIndex& ball,
                                     const LineDirections* directions);

}  // namespace slabwright
