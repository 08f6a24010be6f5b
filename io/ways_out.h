// Which commands would build a pattern that is refused for its undercuts.
#pragma once

#include <memory>
#include <string>

#include "engine/job.h"
#include "kernels/export.h"
#include "kernels/parallel/context.h"

namespace slabwright {

struct Pattern;

/// A line for each way, the best first, with the command, what it leaves unmade and its layers; or one line
/// that none helps. Turns are offered where the job does nothing that depends on the order of turning.
/// @param pattern that plan() refused with "undercut.unmade". @param out of the plan that was asked for
/// @throws Error(cancelled), Error(no_plan, "memory.limit")
[[nodiscard]] SLABWRIGHT_API std::string ways_out_text(Context& context, const Pattern& pattern,
                                                       const Job& job, const std::string& out);

}  // namespace slabwright
