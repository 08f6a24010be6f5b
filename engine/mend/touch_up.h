// Operations that take what a simulation found left over, place by place: wherever a tool of the library
// covers more of it, that tool goes there.
#pragma once

#include <span>
#include <vector>

#include "engine/mend/faults.h"
#include "engine/plan.h"
#include "kernels/access/standing_part.h"

namespace slabwright {

/// One operation for each tool that is needed, flat ones first. A tool whose core would meet what is left
/// leaves the place to one that plunges, or to the next round.
/// @param missed where something is left. @param lowest_tip mm. @param gouge mm that a cutter may go into the
/// part
[[nodiscard]] std::vector<Operation> touch_up(const Job& job, const StandingPart& part, const Layer& layer,
                                              std::span<const MissedPlace> missed, double lowest_tip);

}  // namespace slabwright
