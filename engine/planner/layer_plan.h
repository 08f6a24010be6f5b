// One layer of a plan: its tools are chosen, its paths laid, its forces met by feeds.
#pragma once

#include "engine/forces/feeds.h"
#include "engine/paths/paths.h"
#include "engine/plan.h"
#include "kernels/access/accessibility.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"
#include "kernels/parallel/progress_part.h"

namespace slabwright {

/// What a layer's planning looks at besides the layer. All outlives it.
struct LayerGround {
    const Plan& plan;  ///< its job, stock, features and flask; of its layers only the one that is planned
    MeshView pattern;  ///< the whole of it, pattern-base; the plan's features name its facets
    MeshView mesh;     ///< what the paths are laid on: the pattern, or a lighter one within `mesh_gap` of it
    double mesh_gap = 0;                 ///< mm
    const AccessScene* scene = nullptr;  ///< of the mesh; needed where tools are chosen by the exact rule
    const Loops* carried_by =
        nullptr;  ///< what stays of the slab below the layer's joint; null: it lies on the board
    ScratchPool<StockMemory>* stock_memory =
        nullptr;                            ///< which layers leave to each other; null: each has its own
    std::span<const StandingFoot> walls{};  ///< feet of thin walls that stand in this layer
    const std::vector<DrilledHole>* drilled = nullptr;  ///< of this layer, closed in `mesh`; null: none
    KnownCuts* known_cuts = nullptr;  ///< which layers tell each other; null: each finds its own
    bool shallow = false;             ///< flats cut no deeper than shallow_step() at once
};

struct PlannedLayer {
    Layer layer;
    std::vector<Diagnostic> diagnostics;
    LayerCuts cuts;  ///< of its programs, for their peaks; empty with the nominal engagement
};

/// Plans layer `index` (0 …) of the ground's plan, which has its z range and slab. Where the job selects
/// tools, the sets worth a look are planned whole and compared: the first, the fixed set where the job
/// compares, is the measure of what may be left over; of those that leave no more, the one that takes the
/// least time is taken, changes of tool counted. What was compared is in Layer::selection.
/// @throws Error(usage, "job.tool") when the library lacks a flat or a ball; Error(no_plan), Error(cancelled)
[[nodiscard]] PlannedLayer plan_layer(Context& context, const LayerGround& ground, std::size_t index,
                                      ProgressPart& progress);

/// No program asks for more than tool and machine can: ways down through air are planned at the tool's own
/// feeds. Times are those of the machine anyway.
void limit_feeds(Operation& operation, const Job& job);

}  // namespace slabwright
