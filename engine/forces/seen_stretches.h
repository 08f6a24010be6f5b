// What an operation's stretches look like to those who choose its feeds, and again where some of its runs are
// divided into passes.
#pragma once

#include <span>
#include <vector>

#include "engine/forces/feed_choice.h"
#include "engine/forces/feeds.h"
#include "engine/forces/split_cuts.h"
#include "engine/forces/wall_map.h"
#include "engine/stock/cut_stretches.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// Whether it clears: roughing, and facing of a slab.
[[nodiscard]] bool roughs(OperationKind kind);

/// Runs an operation, or some of its moves, through what stands.
/// @param setback of the glue from the edge of what carries the slab, mm
/// @param seen  gets all stretches, without feeds
/// @param parts only these moves; none: all
/// @throws Error(cancelled)
void run_through(Context& context, StandingSlab& slab, const Operation& op, const Tool& tool,
                 const Layer& layer, const WoodLimits& limits, double setback, std::vector<SeenStretch>& seen,
                 std::span<const MoveRange> parts = {});

/// Whether a stretch lies partly in a run.
[[nodiscard]] bool any_halved(const std::vector<SeenStretch>& seen, std::span<const Passes> runs);

/// What was seen before runs were split, with `anew` in place of what was seen of the runs.
/// @param parts where the runs lie now
/// @param all   gets it
void replaced(const std::vector<SeenStretch>& seen, std::span<const Passes> runs,
              std::span<const MoveRange> parts, const std::vector<SeenStretch>& anew,
              std::vector<SeenStretch>& all);

/// Leaves out the passes that cut nothing.
/// @param seen of the moves as they were split; @param split where the passes lie in them
/// @returns whether there was one
bool without_idle(std::span<Passes> runs, std::span<const SplitRun> split,
                  const std::vector<SeenStretch>& seen);

}  // namespace slabwright
