// The holes for dowels in a layer's top (engine/schedule/dowels): drilled, or bored by a flat end mill.
#pragma once

#include <optional>

#include "engine/plan.h"

namespace slabwright {

/// Diameters that differ by less are one, mm: of a drill and its dowel.
inline constexpr double kSameDowel = 0.05;

/// How low a tool's tip goes below the full diameter's end, mm: a drill's point.
[[nodiscard]] double point_below(const Tool& tool);

/// What makes a job's dowel holes of this depth (mm, full diameter): the first drill of the dowels'
/// diameter; else the widest flat end mill that bores them on a helix, at least half as wide as the hole and
/// narrower by more than its core. Flutes and stick-out must reach, less cutting.holder_clearance.
/// @throws Error(usage, "dowel.tool") where the library has none
[[nodiscard]] const Tool& dowel_tool(const Job& job, double depth);

/// Of the job's dowels.diameter and those that shops keep (DIN 68150-1), 8 and 10 mm first, the first whose
/// holes of this depth (mm) the library makes; none where it makes none.
[[nodiscard]] std::optional<double> dowel_size(const Job& job, double depth);

/// The program for a layer's dowels; no moves where it has none.
[[nodiscard]] Operation dowel_holes(const Job& job, const Layer& layer, const Tool& tool);

}  // namespace slabwright
