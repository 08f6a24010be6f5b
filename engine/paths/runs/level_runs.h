// Stretches of contours that are cut level by level, region after region.
#pragma once

#include <vector>

#include "engine/paths/runs/layer_cut.h"

namespace slabwright {

/// An open or closed stretch of a contour; closed ones repeat their first point at the end.
struct LevelRun {
    std::vector<PathPoint> points;
    bool closed = false;
};

/// Which way open runs are cut: with the part on their right, so that the cutter climbs, or from whichever
/// end is nearer.
enum class LevelWays { climbing, either };

/// Cuts contour `c` into the stretches of its wanted points (one flag for each of its points), thinned to
/// `tolerance` (0.1 µm), at height z.
void append_level_runs(const Contours& contours, std::size_t c, std::int32_t z,
                       const std::vector<char>& wanted, double tolerance, std::vector<LevelRun>& out);

/// Cuts the runs of all levels, which come in the order in which they may be cut: a run waits for those of
/// earlier levels within a tool's diameter of it, and of all that wait for none the nearest to the tool is
/// next (METHOD.md section 11, the order of levels). Closed ones keep their direction, with the part on the
/// right, and are begun where the tool is nearest, or where there is room for leads.
/// @param leads arcs into the cut and out of it (add_leads)
/// @param ways of open runs
void cut_levels(PathBuilder& path, const LayerCut& cut, const Tool& tool, const DropIndex& part,
                std::vector<std::vector<LevelRun>>& levels, bool leads, LevelWays ways);

}  // namespace slabwright
