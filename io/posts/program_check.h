// Whether a program is the one that the plan speaks of: begin and end, spindle, dwells, path mode, and how
// far it goes at each feed. What it does to the wood is the simulation's matter.
#pragma once

#include <optional>
#include <vector>

#include "engine/job.h"
#include "engine/moves/feed_lengths.h"
#include "engine/simulate/simulate.h"

namespace slabwright {

/// What plan.json says of one operation's program, as far as it does.
struct ProgramPlan {
    std::optional<double> spindle_rpm;
    std::optional<double> blend;  ///< mm (G64 P)
    std::optional<std::vector<FeedLength>> feeds;
};

/// Violations of one program, in a fixed order:
/// program.begin, program.end: its first and its last motion are not G0 in z alone, or it ends lower than it
///   began, so that the next tool change finds the cutter in the work;
/// program.spindle: from its first feed motion to its last retract the spindle turns at another speed than
///   planned, above the tool's or the machine's, or not at all;
/// program.spin_up: it feeds before the spindle has had the machine's time to start;
/// program.dwell: it dwells longer than that in all, which burns wood where it cuts;
/// program.feed: above the tool's or the machine's feed;
/// program.axis: faster along an axis than that does;
/// program.path_mode: it lets the machine leave its path by more, or round corners by less, than planned;
/// program.lengths: at some feed, or in rapids, it goes another length than planned, or elsewhere.
/// @param program with z from the pattern's bottom
/// @param tool that the program loads; none where the library has no such tool
[[nodiscard]] std::vector<Violation> check_program(const Program& program, const ProgramPlan& planned,
                                                   const Tool* tool, const Machine& machine);

}  // namespace slabwright
