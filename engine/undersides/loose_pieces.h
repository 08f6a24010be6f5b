// Whether a slab whose underside has been milled hangs together until it is laid.
#pragma once

#include "engine/plan.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// Whether all that stands over the recess's floor holds to the slab's rim by more than the floor: looked for
/// in sections no more than 2 mm apart, whose pieces hold to those of the next that they overlap by 20 mm² or
/// half their own area. What is held by less than two sections tell counts as loose.
/// @param target of the slab (underside_target). @throws as slice()
[[nodiscard]] bool hangs_together(Context& context, const Mesh& target, const TurnedSlab& slab);

}  // namespace slabwright
