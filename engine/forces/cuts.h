// The hardest cuts that a job's cutters make, as the force model takes them (METHOD.md section 8).
#pragma once

#include "engine/job.h"
#include "kernels/forces/forces.h"

namespace slabwright {

/// The material's orthogonal data on an edge of this helix, by the job's transform.
[[nodiscard]] ForceCoefficients coefficients_of(const Material& material, double helix_rad);

/// A cutter of this job with nothing engaged yet: profile, flutes, radius, helix, coefficients, and the speed
/// at which it turns.
[[nodiscard]] CutSegment idle_cut(const Job& job, const Tool& tool);

/// A slot `depth_mm` deep at the tool's largest feed: what opens a level of roughing.
[[nodiscard]] CutSegment slot_cut(const Job& job, const Tool& tool, double depth_mm);

/// The hardest cut of each kind of cutter at this depth: a slot for a flat end mill, which roughs; for a
/// ball, which finishes, what roughing leaves on a wall (the wall allowance and the rough cusp), at the
/// finish feed.
[[nodiscard]] CutSegment hardest_cut(const Job& job, const Tool& tool, double depth_mm);

}  // namespace slabwright
