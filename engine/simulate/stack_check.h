// Whether slabs and layers can hold the part at all.
#pragma once

#include "engine/simulate/stage.h"

namespace slabwright {

/// Tells of a stack that is too short, too narrow, has gaps, or whose slabs are too thin or too small: what
/// no slab covers cannot be missed by any cut.
void check_stack(const SimulationStage& stage, SimulationReport& report);

}  // namespace slabwright
