// The programs that find z = 0 by touching (machine.probe): which there are, in which order they run, and
// what each touches.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "engine/plan.h"

namespace slabwright {

/// @throws Error(usage, "job.probe") where machine.probe asks for programs that are not written for this
/// machine or control, with the reason
void check_probing(const Job& job);

/// The probe, where the job's library does not hold its tool; none where nothing is probed with it.
[[nodiscard]] std::optional<Tool> probe_of(const Job& job);

/// What a probing program of a layer touches: x and y of the place and z that the tip then has, mm, as the
/// programs count: of probing.reference, the plate's thickness added.
[[nodiscard]] std::array<double, 3> probed_place(const Plan& plan, const Layer& layer);

/// Holds the place that is probed against the keep-outs of every layer, before any path is made: what goes
/// down there (the probe; where the control keeps no lengths, each tool of the job) to half of probing.search
/// under the touch stays the clearance away, seen from above, wherever it is lower than a keep-out's top. Of
/// the probe only its tip is known.
/// @param origin that the plan's x and y count from, mm
/// @throws Error(no_plan, "keep_out.probe")
void check_probed_place(const Plan& plan, const std::array<double, 2>& origin = {});

/// Adds a probing program to plan.probes and its step, which stands for touch_off, to plan.sequence.
/// @param tool in the spindle, @param files of the layer's programs that run before it
/// @param needs of the step @returns its id
int add_probe(Plan& plan, const Layer& layer, int tool, int files, std::vector<int> needs);

}  // namespace slabwright
