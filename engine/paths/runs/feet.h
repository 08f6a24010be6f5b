// The feet of steep walls on floors: the ball that finishes such a wall comes down to the floor a little
// beside it, and what it leaves there is cut by a flat end mill that goes around the wall a few times close
// above the floor.
#pragma once

#include <span>
#include <vector>

#include "engine/paths/runs/level_runs.h"

namespace slabwright {

/// Whether a facet is an upward one of a floor at height z (of cut.floors).
[[nodiscard]] bool lies_on_floor(const SolidFacet& facet, double z);
/// All of them.
[[nodiscard]] std::vector<SolidFacet> floor_facets(const LayerCut& cut, double z);

/// Which points of a level's contours, on the fibres of `grid`, belong to a cutter (radius r mm) that stands
/// over some of these facets.
class NearFloor {
public:
    NearFloor(const LayerCut& cut, std::span<const SolidFacet> facets, double r, const FibreGrid& grid);
    [[nodiscard]] bool operator()(Point2 p) const;

private:
    const FibreGrid& grid_;
    Fibres x_, y_;
};

/// Contours at these tips as they are near the facets of `around`, which comes of solid_near(): what lies
/// elsewhere is left out.
/// @param inside  the sections for the tips  @param grid  of the whole solid
[[nodiscard]] std::vector<Contours> contours_near(Context& context, const LayerSolid& around,
                                                  std::span<const double> tips,
                                                  std::span<const Section> inside, const CutterShape& cutter,
                                                  const FibreGrid& grid);

/// Heights over a floor, descending, at which a flat end mill goes around the steep walls that stand on it:
/// as high as the layer's ball leaves more than a cusp, in steps that leave no more than one. None where that
/// would take more than a few.
[[nodiscard]] std::vector<double> foot_heights(const LayerCut& cut, double floor);

/// The runs at these heights, a level each, where the wall is steep but not upright.
/// @param wider  drops of wider cutters (and their radii, mm), who have been there where they can stand
/// against the wall
void append_foot_runs(const LayerCut& cut, const Tool& tool, double floor, const FibreGrid& grid,
                      std::span<const std::pair<const DropIndex*, double>> wider,
                      std::vector<std::vector<LevelRun>>& levels);

}  // namespace slabwright
