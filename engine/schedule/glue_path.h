// The way of the machine's glue head over a joint, and what it takes: time, glue, the handler's travel.
//
// The beads run along x in rows a pitch apart, counted from the stock's edge of least y. Where the head lies
// under the handler's way (RPM) it has an outlet for each row, and one pass of the slab lays all of them;
// beside the spindle it has one, and goes from row to row, to and fro.
#pragma once

#include <vector>

#include "engine/plan.h"

namespace slabwright {

/// Shorter beads are not laid, mm.
inline constexpr double kShortestBead = 1;

/// The beads of a joint in the order in which they are laid, each as long as the row runs inside `glue`; none
/// where the job has no glue head. Under the handler's way a bead begins at its greatest x, which comes
/// first.
[[nodiscard]] std::vector<GlueRun> glue_beads(const Plan& plan, const Loops& glue);

/// mm² of the pieces of `glue` that lie between two rows, where no bead goes.
[[nodiscard]] double glue_between_rows(const Plan& plan, const Loops& glue);

/// Tells, in the plan's diagnostics, where beads miss some of a joint's glue: glue.missed. What was told so
/// before is told anew.
void note_missed_glue(Plan& plan);

/// What laying a joint's beads takes.
struct GluePass {
    double bead_mm = 0;     ///< of all beads
    double grams = 0;       ///< bonding.glue_g_per_m2 on a pitch beside each bead
    double speed = 0;       ///< mm/min along the beads: the head's, or what its pump can feed
    double pump_g_min = 0;  ///< at the most outlets that are open at once
    double handler_begin = 0, handler_end = 0;  ///< mm from the feed chamber's middle; only under its way
    double seconds = 0;                         ///< the ways between beads at the router's rapid included
};
[[nodiscard]] GluePass glue_pass(const Plan& plan, const std::vector<GlueRun>& beads);

/// Seconds of the handler from one place to another.
[[nodiscard]] double handler_seconds(const Machine& machine, double from, double to);

/// Seconds to bond one slab as a quote reckons them: fetch, glue, place and press.
/// @param glue_mm2 of its joint, @param length of it along x, mm
[[nodiscard]] double bonding_seconds(const Job& job, double glue_mm2, double length);

/// @throws Error(no_plan, "machine.handler_travel") where a slab is longer than its way over the glue head
void check_handler(const Plan& plan);

}  // namespace slabwright
