// A layer whose programs do not make it yet, with other programs: what a simulation of them found goes back
// into it (METHOD.md section 14).
#pragma once

#include <string>

#include "engine/mend/faults.h"
#include "engine/plan.h"
#include "kernels/access/standing_part.h"
#include "kernels/parallel/context.h"

namespace slabwright {

struct MendedLayer {
    Layer layer;
    bool changed = false;  ///< false: nothing is known that would help
    std::string done;      ///< in words
};

/// Where a cutter goes into the part, its way is raised; where its core comes down on stock, it goes down on
/// a ramp, and from the second round on not at all; what is too deep is cut in several passes; a rapid that
/// meets stock goes above it; an operation that removes nothing is dropped; what is left is touched up.
/// @param round 1 …; what did not help is not tried again
[[nodiscard]] MendedLayer mend_layer(Context& context, const Job& job, const StandingPart& part,
                                     const Layer& layer, const LayerFaults& faults, int round);

}  // namespace slabwright
