// The tool paths of one layer (SHAPING, FINISH; METHOD.md sections 5 and 11), with the tools that were chosen
// for it.
#pragma once

#include <vector>

#include "engine/layer_job.h"
#include "kernels/parallel/context.h"

namespace slabwright {

struct LayerResult {
    std::vector<Operation> operations;  ///< in the order of execution
    std::vector<Diagnostic> diagnostics;
    double left_mm2 = 0;  ///< plan view of what is left over the cusp's limit; 0 where it is not followed
                          ///< (Cutting::uniform_steps)
    LayerPace pace{};     ///< where it is asked for; as far as its stages were planned
    bool given_up =
        false;  ///< the operations are the first ones only (LayerJob::ahead); left_mm2 is not known
};

/// Face, rough, floors, walls, levels and raster of one layer, and what these leave. Operations that would
/// remove nothing are left out.
[[nodiscard]] LayerResult plan_layer_paths(Context& context, const LayerJob& layer);

}  // namespace slabwright
