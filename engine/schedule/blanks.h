// How large each slab is sawn (METHOD.md section 18).
#pragma once

#include <vector>

#include "engine/plan.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// With slabs.blanks = "layer" gives each layer slabs that cover what it keeps of the pattern and its
/// supports, seen from above, and slabs.margin on every side; up to a whole millimetre long and wide, within
/// the plan's stock. With "pattern", and where a flask takes the whole of every slab, layers have none of
/// their own.
/// @param mesh the pattern with its supports, pattern-base
/// @param plan its stock, and its layers' heights
/// @throws Error(cancelled)
void saw_blanks(Context& context, MeshView mesh, Plan& plan);

/// What the slabs of every layer cover.
[[nodiscard]] std::vector<Blank> slabs_of(const Plan& plan);

}  // namespace slabwright
