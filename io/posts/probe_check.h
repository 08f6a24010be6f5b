// Probing programs, read back: what their text does with the tip, word by word, held against what the plan
// says of it. Nothing of how they are written is used here.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "engine/job.h"
#include "engine/simulate/simulate.h"

namespace slabwright {

/// What a probing program must do.
struct ProbeTask {
    int tool = 0;        ///< in the spindle
    double touch_z = 0;  ///< mm that the tip's z is said to be where it touches, as the programs count
};

/// Codes: probe.word (a word or an order of words that these programs do not have), probe.spindle (it is
/// started), probe.tool (another tool or length), probe.descent (down by another move than a probing move),
/// probe.feed (faster than the job says), probe.search (down farther than it says), probe.offset (z set to
/// another height, not at all, elsewhere than at the touch, or in another work offset), probe.retract (the
/// tip is left on what it touched). Each has its line.
/// @param file its name in messages
[[nodiscard]] std::vector<Violation> check_probe(std::string_view text, const std::string& file,
                                                 const ProbeTask& task, const Job& job);

}  // namespace slabwright
