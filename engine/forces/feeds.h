// The forces of every stretch of a layer's programs, and feeds that fit them (method.md sections 8 and 9).
#pragma once

#include <span>

#include "engine/forces/op_cuts.h"
#include "engine/plan.h"
#include "kernels/forces/forces.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// The cut of a stretch at this feed (mm/min). Depth and width are rounded up to classes (8 to a doubling of the depth, a 24th of the diameter), so that a layer of any length has some hundreds of different cuts. A ball that engages no higher than its radius is as wide as
/// its circle there.
[[nodiscard]] CutSegment cut_of(const CutStretch& stretch, const Tool& tool, const Job& job, double feed);

/// What an operation may bend its cutter, normal to the way, mm: roughing as much as it leaves for finishing, finishing the cusp, facing what facing takes off.
[[nodiscard]] double bending_limit(const Operation& operation, const Job& job);

/// Feeds come in this many steps of the fastest that tool and machine allow.
inline constexpr int kFeedSteps = 16;

/// Runs a layer's operations, in their order, through a standing slab and sets of each peak_force_n (resultant), deflection_mm (of the tip, in the
/// plane), wall_error_mm (normal to the way) and peak_at, from the closed form or the double reference. Where the job adapts feeds, every move's feed is first
/// set to the fastest of kFeedSteps steps at which
///   * the cutter bends by no more than the operation's limit, but not under an eighth of what was planned, and
///   * the thickest chip is no thicker than planned: that of a slot at the planned feed, the finish feed or the tool's.
/// A faster feed is taken only where it lasts for at least 20 mm; roughing, facing and entries at the plunge feed are never made faster than planned. Drills are left alone.
/// @param diagnostics gets, per operation, "feed.lowered" (where and how far), and "cut.deflection" where it bends too far at the slowest
/// @throws Error(usage, "forces.spindle") when an operation mills with its spindle at rest; Error(usage, "forces.segment"); Error(cancelled)
void rate_layer(Context& context, Layer& layer, const Plan& plan, std::vector<Diagnostic>& diagnostics);

}  // namespace slabwright
