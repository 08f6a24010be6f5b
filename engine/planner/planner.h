// From a mesh and a job to a plan.
#pragma once

#include "engine/plan.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// Plans the whole build. `mesh` stands on z = 0, closed and oriented except for what `diagnostics` of the
/// loader says.
/// @param input is copied into the plan
/// @throws Error(no_plan) when the part cannot be made: too large (says by how much), undercut, nothing to
/// cut
/// @throws Error(cancelled)
[[nodiscard]] Plan make_plan(Context& context, const Mesh& mesh, const InputInfo& input, const Job& job);

}  // namespace slabwright
