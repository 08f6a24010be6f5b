// Which of a pattern's holes are drilled, with what, and how deep in each layer (FINISH 3.3; METHOD.md
// section 11).
#pragma once

#include <optional>
#include <vector>

#include "engine/layer_job.h"
#include "engine/plan.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

struct DrillPlan {
    std::vector<std::vector<DrilledHole>> layers;  ///< of every layer of the plan
    /// The pattern with the drilled holes closed, for all other operations; none where nothing is drilled.
    std::optional<Mesh> closed;
    std::vector<Diagnostic>
        diagnostics;  ///< of holes that a drill of the library would fit, but that are milled
};

/// Looks for holes only where the library has a drill. Drilled are upright holes that begin at a level
/// rim, plain ones and the narrowest part of those that widen towards the mouth (narrowest_part), through to
/// the board or ending in the drill's own cone, whose circle lies within `gouge` of the drill's with the
/// mesh's chords and within `cusp` from outside, as deep as flutes and stick-out reach from the layer's top.
/// With cutting.bore_holes, upright plain holes that no drill was meant for, through or with a flat bottom,
/// are bored by the widest flat end mill that can (can_bore), as wide as the mesh's chords leave it. In every
/// layer the full diameter goes down to the layer's bottom; the point dips into what is drilled below, or
/// into the board as far as the job lets cutters cut it. All other holes are milled as before.
/// @param plan its job and layers
[[nodiscard]] DrillPlan plan_drilling(Context& context, MeshView pattern, const Plan& plan);

}  // namespace slabwright
