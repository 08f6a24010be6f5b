// The proof that no tool runs into what stands on the table: every motion of every program's text against the
// keep-outs of the plan. No grid, no sampling; nothing of it is shared with the code that plans paths.
#pragma once

#include <array>
#include <vector>

#include "engine/simulate/simulate.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// mm by which a tool may come nearer than a keep-out's clearance: programs are written in steps.
inline constexpr double kKeepOutTolerance = 0.005;

/// Checks all programs, layer by layer. A keep-out on the base board stands in every layer, one on the slab
/// in those whose slab it touches. Cutter, shank and holder are cylinders; each must stay the clearance away
/// from the area, seen from above, wherever it is lower than the top. Arcs are taken as arcs.
///
/// Codes: keep_out.cut, one for each program and keep-out that it enters, at the motion that comes nearest;
/// keep_out.approach, where the first motions of a program, which come from an unknown place, run lower than
/// the top of a keep-out; keep_out.slab, where a slab lies on what stands on the base board.
/// @param input its programs, tools, layers, stock and machine
/// @param zero mm, pattern-base: x 0, y 0 of the programs (BuildPlan::zero)
/// @returns in the order of the programs; of layers first. Programs whose tool is unknown are passed over
/// @throws Error(cancelled)
[[nodiscard]] std::vector<Violation> check_keep_outs(Context& context, const SimulationInput& input,
                                                     const std::array<double, 2>& zero);

}  // namespace slabwright
