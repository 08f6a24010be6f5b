// Programs that find z = 0 by touching (machine.probe), for the controls whose probing moves stop with an
// alarm where nothing is touched: LinuxCNC's and GRBL's G38.2.
#pragma once

#include <string>

#include "engine/plan.h"

namespace slabwright {

/// The text of a probing program. It begins where the operator or the sequence has brought the tip: over the
/// place, at most half of probing.search above what is touched. It goes down by probing moves only, twice,
/// the second time slowly; says which z that is (G10 L20 P1, G54); and goes up. The spindle stands still.
/// @param plan for a machine that check_probing() takes
[[nodiscard]] std::string probe_text(const Plan& plan, const ProbeProgram& probe);

}  // namespace slabwright
