// What an operation's heaviest cut does to its tool, for the plan (METHOD.md sections 8 and 9).
#pragma once

#include "engine/plan.h"
#include "kernels/forces/forces.h"

namespace slabwright {

/// The heaviest nominal cut of an operation: its fastest feed among the moves that travel in the plane
/// (mm/min over spindle speed and flutes), its largest stepdown, and its width.
///   * rough and semi-rough: a slot, for a clearing program opens with one;
///   * face: its stepover; where that is unknown, a slot;
///   * finish, corner, edge: what the tool before left. With a stepdown, the wall allowance wide; with a
///   stepover, the floor
///     allowance deep; a ball meets the steps of roughing too (the job's rough cusp).
/// A ball that cuts less deep than its radius engages over the arc that its width has on the circle at that
/// depth. Coefficients by the job's transform of its material at the tool's helix. No moves that mill, or a
/// drill (it does not mill): a segment without depth.
/// @throws Error(usage, "forces.spindle") when it mills with a spindle speed of 0
[[nodiscard]] CutSegment heaviest_cut(const Operation& operation, const Tool& tool, const Job& job);

/// Fills peak_force_n (the resultant), deflection_mm and wall_error_mm (both of the tip, by the largest force
/// in the plane, over the tool's stickout) from the closed form or the double reference, so that they are the
/// same on every device.
/// @throws as heaviest_cut; Error(usage, "forces.segment") for a tool or material that the force model does
/// not take
void rate_operation(Operation& operation, const Tool& tool, const Job& job);

/// Lowers the operation's feeds, by sixteenths of its fastest in the plane and to kLeastFeedShare of it at
/// most, until its heaviest nominal cut holds: bending, the cutter's strength, torque and power of the
/// spindle. Slower feeds stay as they are.
/// @returns whether a feed is another now. @throws as rate_operation
bool slow_down(Operation& operation, const Tool& tool, const Job& job);

}  // namespace slabwright
