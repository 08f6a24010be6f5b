// What the proof of a plan says of the plan: which of its layers are to be planned again, and what is told
// where that does not help.
#pragma once

#include <string>
#include <vector>

#include "engine/mend/faults.h"
#include "engine/plan.h"
#include "io/verify.h"
#include "kernels/errors.h"

namespace slabwright {

/// Whether all that was found lies in how the part is cut. What else a proof may find (a program that is
/// missing, a sequence that cannot be run) no other path mends: then the writing is broken, not the plan.
[[nodiscard]] bool is_of_the_part(const SimulationReport& report);

/// The layers with faults, ascending, in terms of the plan's operations and moves.
/// @param found of the folder that was written of this plan, with VerifyOptions::faults
[[nodiscard]] std::vector<LayerFaults> faults_of(const Plan& plan, const Verification& found);

/// Mends the undersides in which something was found, as a plan's layers are mended (Replanner); the plan's
/// sequence follows. @param found as for faults_of(). @param round 1 …
/// @returns whether any has other programs. @throws as Replanner::mend() and underside_target()
[[nodiscard]] bool mend_undersides(Context& context, Plan& plan, const Verification& found, int round);

/// An error of kind no_plan for each thing that was found: what, where, and what may help.
/// @param stl the pattern's file
[[nodiscard]] std::vector<Error> refusals_of(const SimulationReport& report, const std::string& stl);

}  // namespace slabwright
