// Vertical holes by a drill (FINISH 3.3), down in pecks, up to clear the chips; or by an end mill on a helix.
#pragma once

#include <span>
#include <vector>

#include "engine/layer_job.h"
#include "engine/paths/runs/layer_cut.h"

namespace slabwright {

/// The layer's holes, one program a tool, in the library's order; of a drill's holes the nearest comes next.
/// Each peck is one of the drill's stepdown_max at most; before it the drill comes out of the hole.
[[nodiscard]] std::vector<Operation> drill_holes(const LayerCut& cut);

/// mm above what stands where the plunge feed of a hole begins.
inline constexpr double kAirOverHole = 0.5;
/// mm above a layer's top where a drill goes from hole to hole.
inline constexpr double kLinkOverHoles = 2;

/// Holes in the order in which they are made: first that of the least x, then y, and after each the nearest.
[[nodiscard]] std::vector<DrilledHole> in_order(std::vector<DrilledHole> holes);

/// Whether a flat end mill bores a hole of a diameter (mm) on a helix: it is at least half as wide, and
/// narrower by more than its core.
[[nodiscard]] bool can_bore(const Tool& tool, double diameter);

/// Bores a hole: down on a helix of radius hole.around, a level turn at the bottom, out in the middle.
/// @param operation that `path` writes, whose stepdown grows to a turn's
/// @param chord_mm by which chords may lie within the circle
void bore(PathBuilder& path, Operation& operation, const Tool& tool, const DrilledHole& hole,
          double chord_mm);

/// Drills a hole in pecks. @param operation that `path` writes, whose stepdown grows to the deepest peck
void peck(PathBuilder& path, Operation& operation, const Tool& drill, const DrilledHole& hole);

}  // namespace slabwright
