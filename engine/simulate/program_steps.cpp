#include "engine/simulate/program_steps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace slabwright {

void ProgramSteps::expect_layer(std::size_t layer) {
    if (layer < plan_.layers.size() && step().layer != plan_.layers[layer].index)
        complain("sequence.layer", fmt::format("belongs to layer {}", plan_.layers[layer].index));
}

std::optional<std::array<std::size_t, 2>> ProgramSteps::named_file() {
    const std::optional<std::string> file = word("program");
    if (!file) return std::nullopt;
    const std::vector<PlannedProgram>& all = plan_.programs;
    for (std::size_t p = 0; p < all.size(); ++p) {
        if (file_of(all[p].file) != *file) continue;
        std::size_t end = p + 1;
        while (end < all.size() && file_of(all[end].file) == *file) ++end;
        return std::array{p, end};
    }
    complain("sequence.program", fmt::format("{} is none of the plan's programs", *file));
    return std::nullopt;
}

std::optional<std::size_t> ProgramSteps::named_face_off() {
    const std::optional<std::string> file = word("program");
    if (!file) return std::nullopt;
    for (std::size_t p = 0; p < plan_.face_offs.size(); ++p)
        if (plan_.face_offs[p].file == *file) return p;
    complain("sequence.program", fmt::format("{} is none of the plan's programs", *file));
    return std::nullopt;
}

void ProgramSteps::check_file(std::size_t begin, std::size_t end) {
    const PlannedProgram& planned = plan_.programs[begin];
    const std::string file(file_of(planned.file));
    if (s_.ran_in[begin])
        complain("sequence.program",
                 fmt::format("{} has run already, in {}", file, title(*s_.ran_in[begin])));
    else if (begin != s_.next_program && s_.next_program < plan_.programs.size())
        complain("sequence.program", fmt::format("runs {} where {} is next", file,
                                                 file_of(plan_.programs[s_.next_program].file)));
    expect_layer(planned.layer);
    const bool faces = end - begin == 1 && planned.kind == OperationKind::face;
    if (faces != (step().action == "face"))
        complain("sequence.program",
                 fmt::format("{} is a program to {}", file, end - begin == 1 ? name(planned.kind) : "mill"));
    check_contents(begin, end);
    check_tool(planned);
    const std::optional<std::size_t> l = build_.whole_layer(s_);
    if (!l || *l != planned.layer)
        complain("sequence.order",
                 fmt::format("the slabs of layer {} are not placed and pressed, or lie under others",
                             plan_.layers[planned.layer].index));
    check_magazine({plan_.programs.data() + begin, end - begin});
    check_heights({plan_.programs.data() + begin, end - begin});
}

void ProgramSteps::check_contents(std::size_t begin, std::size_t end) {
    std::string purpose;
    double seconds = 0;
    bool timed = true;
    int changes = 0;
    for (std::size_t p = begin; p < end; ++p) {
        const PlannedProgram& planned = plan_.programs[p];
        purpose += (p == begin ? "" : ", ") + planned.purpose;
        if (p > begin && planned.tool != plan_.programs[p - 1].tool) ++changes;
        timed = timed && planned.minutes.has_value();
        seconds += planned.minutes.value_or(0) * 60;
    }
    const auto count = static_cast<double>(end - begin);
    if (!plan_.programs[begin].purpose.empty()) expect_word("sequence.program", "purpose", purpose);
    if (timed && (changes == 0 || plan_.job_stated))
        expect_seconds(seconds + changes * plan_.job.machine.tool_change_s, kSeconds * count);
    if (end - begin == 1) return;
    expect("sequence.program", "operations", count, 0);
    expect("sequence.tool", "tool_changes", changes, 0);
    expect("sequence.tool", "last_tool", plan_.programs[end - 1].tool, 0);
}

void ProgramSteps::check_tool(const PlannedProgram& planned) {
    const std::optional<int> tool = whole("tool");
    if (tool && !build_.tool_of(*tool))
        complain("sequence.tool", fmt::format("tool {} is not in the library", *tool));
    if (tool && *tool != planned.tool)
        complain("sequence.tool",
                 fmt::format("{} is made for tool {}, not {}", file_of(planned.file), planned.tool, *tool));
    if (s_.spindle_tool != planned.tool)
        complain("sequence.tool",
                 s_.spindle_tool == 0
                     ? fmt::format("no tool has been put into the spindle for {}", file_of(planned.file))
                     : fmt::format("tool {} is in the spindle, {} is made for tool {}", s_.spindle_tool,
                                   planned.file, planned.tool));
}

void ProgramSteps::wait_for(Cause cause) {
    if (cause && !full() && !order_.last_waits_for(*cause))
        complain("sequence.needs",
                 fmt::format("does not need {}, before which it must not begin", title(*cause)));
}

std::optional<std::size_t> ProgramSteps::place_of(int tool) const {
    const auto found = std::find(s_.magazine.begin(), s_.magazine.end(), tool);
    if (tool == 0 || found == s_.magazine.end()) return std::nullopt;
    return static_cast<std::size_t>(found - s_.magazine.begin());
}

void ProgramSteps::check_magazine(std::span<const PlannedProgram> programs) {
    if (s_.magazine.empty()) return;
    std::vector<int> told;
    for (const PlannedProgram& planned : programs) {
        if (std::find(told.begin(), told.end(), planned.tool) != told.end()) continue;
        told.push_back(planned.tool);
        const std::optional<std::size_t> place = place_of(planned.tool);
        if (place) wait_for(s_.magazine_set[*place]);
        else
            complain("sequence.magazine",
                     fmt::format("{} wants tool {}, which stands in no place of the magazine", planned.file,
                                 planned.tool));
    }
}

void ProgramSteps::check_heights(std::span<const PlannedProgram> programs) {
    const double origin = build_.origin_of(programs[0].layer);
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const PlannedProgram& planned : programs) {
        if (!planned.low || !planned.high) return;
        low = std::min(low, *planned.low);
        high = std::max(high, *planned.high);
    }
    expect("sequence.height", "z_low_mm", low - origin, kLength);
    expect("sequence.height", "z_high_mm", high - origin, kLength);
    for (const PlannedProgram& planned : programs) check_travel(planned);
}

void ProgramSteps::check_travel(const PlannedProgram& planned) {
    const Tool* tool = build_.tool_of(planned.tool);
    if (!tool || !plan_.job_stated) return;
    const double up = build_.bottom_at(planned.layer) + tool->stickout;
    s_.lowest = std::min(s_.lowest, up + *planned.low);
    s_.highest = std::max(s_.highest, up + *planned.high);
    const double over = s_.highest - s_.lowest - plan_.job.machine.travel_z;
    if (over > kLength && !spindle_told_) {
        spindle_told_ = true;
        complain("sequence.travel",
                 fmt::format("up to here the spindle goes over {:.1f} mm, tools' lengths included; it "
                             "travels {:.1f} mm",
                             s_.highest - s_.lowest, plan_.job.machine.travel_z),
                 over);
    }
}

}  // namespace slabwright
