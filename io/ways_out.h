// Which commands would build a pattern that is refused for its undercuts.
#pragma once

#include <string>
#include <vector>

#include "engine/job.h"
#include "engine/planner/milled_ways.h"
#include "engine/planner/ways_out.h"
#include "kernels/export.h"
#include "kernels/parallel/context.h"

namespace slabwright {

struct Pattern;

/// A command, and what comes of it.
struct WayOutCommand {
    std::string command;  ///< as a shell takes it
    WayOut way;
};

struct WaysOut {
    bool looked = false;  ///< not where the mesh has so many facets that looking would take minutes
    Lying lies;           ///< as the pattern lies
    std::vector<WayOutCommand> commands;  ///< the best first
    std::vector<MilledWay> milled;        ///< milled_ways(): as it lies first
};

/// Turns are offered where the job does nothing that depends on the order of turning.
/// @param pattern that plan() refused with "undercut.unmade". @param out of the plan that was asked for
/// @throws Error(cancelled), Error(no_plan, "memory.limit")
[[nodiscard]] SLABWRIGHT_API WaysOut find_ways_out(Context& context, const Pattern& pattern, const Job& job,
                                                   const std::string& out);

/// For people: what stays and where; a line for each command and one for what it leaves unmade and its
/// layers, or one line that none helps; a table of the six sides. Empty where nothing was
/// looked at.
[[nodiscard]] SLABWRIGHT_API std::string ways_out_text(const WaysOut& ways);

/// Schema slabwright.ways_out/1.
[[nodiscard]] SLABWRIGHT_API std::string ways_out_json(const WaysOut& ways);

}  // namespace slabwright
