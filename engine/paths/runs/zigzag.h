// Zigzag clearing of free stretches on parallel lines.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "engine/paths/runs/layer_cut.h"

namespace slabwright {

/// Clears a region given as free stretches on parallel lines along x, chained into zigzags, the nearest
/// first; each chain is begun outside the stock where one of its ends lies there. `path` must know its
/// surroundings, so that it ramps down elsewhere.
/// @param line_y     0.1 µm, ascending
/// @param free       per line
/// @param tip_z      mm
/// @param links      the fibres along y at given x (0.1 µm, ascending): where the tool may pass from line to
/// line
void zigzag(PathBuilder& path, const LayerCut& cut, const Tool& tool, std::span<const std::int32_t> line_y,
            const std::vector<std::vector<Stretch>>& free, double tip_z,
            const std::function<Fibres(std::span<const std::int32_t>)>& links);

}  // namespace slabwright
