#include "engine/simulate/probe_steps.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/simulate/planned_build.h"

namespace slabwright {

void ProbeSteps::probe() {
    require(s_.table_at, "the table is not at this layer's height");
    wait_for(s_.tool_in);
    wait_for(s_.last_cut);
    if (s_.touched) complain("sequence.order", "z 0 has been found already");
    expect_seconds(0, kSeconds);
    s_.unused_change = false;
    s_.touched = here();
    const std::optional<std::string> program = word("program");
    const auto planned = std::find_if(plan_.probes.begin(), plan_.probes.end(),
                                      [&](const PlannedProbe& p) { return p.file == program; });
    if (planned == plan_.probes.end()) {
        complain("sequence.program", "names no probing program of the plan");
        return;
    }
    expect_layer(planned->layer);
    expect("sequence.tool", "tool", planned->tool, 0);
    if (s_.spindle_tool != planned->tool)
        complain("sequence.tool", fmt::format("{} wants tool {} in the spindle, where tool {} is",
                                              planned->file, planned->tool, s_.spindle_tool));
    if (s_.placed == 0) return;
    const DueSlab& slab = build_.slabs()[s_.placed - 1];
    const std::array<double, 3> at = build_.probed_at(slab);
    expect("sequence.probe", "touch_x_mm", at[0], kLength);
    expect("sequence.probe", "touch_y_mm", at[1], kLength);
    expect("sequence.probe", "touch_z_mm", at[2], kLength);
    expect("sequence.probe", "start_z_mm", at[2] + plan_.job.probing.search / 2, kLength);
}

void ProbeSteps::find_length() {
    if (!plan_.probes.empty() && is_for_probe() && has_word("length") && word("length") == "probe")
        s_.touched.reset();
    else expect_word("sequence.tool_length", "length", "touch off");
}

bool ProbeSteps::is_for_probe() const {
    for (std::size_t i = here() + 1; i < list_.size(); ++i) {
        const std::string& action = list_[i].action;
        if (action == "probe") return true;
        if (action == "face" || action == "mill" || action == "face_off" || action == "clear") return false;
    }
    return false;
}

bool ProbeSteps::probes_with(int tool) const {
    return std::any_of(plan_.probes.begin(), plan_.probes.end(),
                       [&](const PlannedProbe& p) { return p.tool == tool; });
}

}  // namespace slabwright
