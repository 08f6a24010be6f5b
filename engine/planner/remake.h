// A spoilt layer made again: faced off down to the joint under it, then built anew, with all that is to come.
//
// What stands above the spoilt layer goes with it, layer by layer from the top, each by a program of its own
// with the table at that layer's height: so no program needs more travel than a layer does. The new sequence
// begins with the steps that are done, as they were, so that it can be replayed from its first step; then the
// machine is cleared by hand, the layers are faced off, and the plan's own steps of the spoilt layer and of
// those above it follow, with feed loads, tool changes and table times as they now must be.
#pragma once

#include <string>
#include <vector>

#include "engine/plan.h"
#include "engine/simulate/build_replay.h"
#include "kernels/parallel/context.h"

namespace slabwright {

struct RemakeRequest {
    const BuildPlan& plan;          ///< states its job
    const BuildSequence& sequence;  ///< that is in force; steps are numbered in their order, from 1
    const BuildSequence& own;       ///< the plan's own, numbered likewise
    const BuildState& state;        ///< where the build stands in `sequence`
    int layer = 0;                  ///< the spoilt one
    std::string folder;             ///< from OUT, where the programs will lie: "resume_001/nc/"
};

struct Remake {
    /// With what the programs are written: job, pattern, stock; of its layers each that is faced off has one
    /// operation, the others none.
    Plan plan;
    std::vector<std::size_t> layers;  ///< that are faced off, from the top down: indices into the plan's
    std::vector<double> tops;         ///< mm, pattern-base: what the first of these stood up to, and so on
    double most_mm = 0;               ///< that the face mill takes at once
    std::vector<SequenceStep> steps;
};

/// @throws Error(usage) "resume.layer" where the plan has no such layer or it is not begun,
/// "resume.unpressed" and "resume.incomplete" where a slab of the layer on top waits for the press or for its
/// neighbours, "resume.unloaded"; Error(no_plan, "resume.job") where plan.json states no job;
/// Error(usage, "job.tool") without a face mill
[[nodiscard]] Remake remake_layer(Context& context, const RemakeRequest& request);

}  // namespace slabwright
