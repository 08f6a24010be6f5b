#include "engine/schedule/magazine.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <tuple>
#include <utility>

#include "engine/schedule/slab_steps.h"
#include "kernels/errors.h"

namespace slabwright {

namespace {

constexpr std::size_t kNever = std::numeric_limits<std::size_t>::max();

/// When tools are needed: of each the programs, ascending.
class Demand {
public:
    explicit Demand(std::span<const ProgramTools> programs) {
        for (std::size_t i = 0; i < programs.size(); ++i)
            for (const int tool : programs[i].tools) uses_[tool].push_back(i);
    }
    /// The first program from `begin` on that needs the tool.
    [[nodiscard]] std::size_t next(int tool, std::size_t begin) const {
        const auto found = uses_.find(tool);
        if (found == uses_.end()) return kNever;
        const auto use = std::lower_bound(found->second.begin(), found->second.end(), begin);
        return use == found->second.end() ? kNever : *use;
    }

private:
    std::map<int, std::vector<std::size_t>> uses_;
};

bool holds(const std::vector<int>& tools, int tool) {
    return std::find(tools.begin(), tools.end(), tool) != tools.end();
}

/// Puts the tools that are needed first into the empty places.
std::vector<ToolLoad> fill_places(std::span<const ProgramTools> programs, std::vector<int>& loaded) {
    const auto empty = static_cast<std::size_t>(std::count(loaded.begin(), loaded.end(), 0));
    std::vector<int> next;
    for (const ProgramTools& program : programs)
        for (const int tool : program.tools)
            if (next.size() < empty && !holds(loaded, tool) && !holds(next, tool)) next.push_back(tool);
    std::sort(next.begin(), next.end());
    std::vector<ToolLoad> loads;
    for (std::size_t place = 0; place < loaded.size() && loads.size() < next.size(); ++place) {
        if (loaded[place] != 0) continue;
        loaded[place] = next[loads.size()];
        loads.push_back({static_cast<int>(place) + 1, loaded[place], 0});
    }
    return loads;
}

}  // namespace

std::vector<std::vector<ToolLoad>> plan_tool_loads(std::span<const ProgramTools> programs,
                                                   std::vector<int> loaded, int spindle) {
    std::vector<std::vector<ToolLoad>> loads(programs.size());
    if (programs.empty()) return loads;
    const Demand demand(programs);
    loads[0] = fill_places(programs, loaded);
    for (std::size_t i = 0; i < programs.size(); ++i) {
        for (const int tool : programs[i].tools) {
            if (holds(loaded, tool)) continue;
            // Later needed goes before sooner, then what is not in the spindle, then the lower number.
            const auto rank = [&](int held) {
                return std::tuple(demand.next(held, i), held != spindle, -held);
            };
            const auto out = std::max_element(loaded.begin(), loaded.end(),
                                              [&](int a, int b) { return rank(a) < rank(b); });
            loads[i].push_back({static_cast<int>(out - loaded.begin()) + 1, tool, *out});
            if (*out == spindle) spindle = 0;
            *out = tool;
        }
        spindle = programs[i].last;
    }
    return loads;
}

std::vector<int> magazine_at_start(std::span<const SequenceStep> steps, int places) {
    std::vector<int> tools(static_cast<std::size_t>(std::max(0, places)), 0);
    for (const SequenceStep& step : steps) {
        if (step.action != "load_tool") continue;
        double place = 0, tool = 0, out = 0;
        for (const auto& [key, value] : step.numbers) {
            if (key == "place") place = value;
            if (key == "tool") tool = value;
            if (key == "tool_out") out = value;
        }
        if (out == 0 && place >= 1 && place <= places)
            tools[static_cast<std::size_t>(place) - 1] = static_cast<int>(tool);
    }
    return tools;
}

MagazineSteps::MagazineSteps(std::vector<SequenceStep>& steps, const Machine& machine,
                             std::vector<ProgramTools> programs, std::vector<int> loaded, int spindle)
    : steps_(steps), machine_(machine), programs_(std::move(programs)), spindle_(spindle) {
    if (machine.magazine == 0) return;
    for (const ProgramTools& program : programs_)
        if (program.tools.size() > static_cast<std::size_t>(machine.magazine))
            throw Error(ErrorKind::no_plan, "machine.magazine",
                        fmt::format("a program changes between {} tools, the magazine has {} places",
                                    program.tools.size(), machine.magazine),
                        "machine.magazine",
                        "give machine.programs = \"tool\", so that tools can be swapped between its "
                        "programs; or fewer tools");
    in_place_ = std::move(loaded);
    in_place_.resize(static_cast<std::size_t>(machine.magazine), 0);
    loads_ = plan_tool_loads(programs_, in_place_, spindle);
}

SequenceStep& MagazineSteps::load(int layer, const ToolLoad& load, const std::set<int>& needs) {
    const bool swaps = load.tool_out != 0;
    SequenceStep& step = add_step(steps_, layer, "load_tool", {needs.begin(), needs.end()},
                                  swaps ? machine_.magazine_swap_s : 0);
    step.numbers = {{"place", load.place}, {"tool", load.tool}};
    if (swaps) step.numbers.emplace_back("tool_out", load.tool_out);
    if (swaps && load.tool_out == spindle_) {
        step.words = {{"from", "spindle"}};
        spindle_ = 0;
    }
    if (swaps) ++swaps_;
    in_place_[static_cast<std::size_t>(load.place) - 1] = load.tool;
    unused_[load.tool] = step.id;
    return step;
}

void MagazineSteps::fill(int layer, const std::set<int>& needs) {
    if (loads_.empty()) return;
    for (const ToolLoad& each : loads_[0])
        if (each.tool_out == 0) load(layer, each, needs);
}

void MagazineSteps::load_for(std::size_t program, int layer, std::set<int>& needs) {
    if (loads_.empty()) return;
    for (const ToolLoad& each : loads_[program]) {
        if (each.tool_out == 0) continue;
        if (const auto unused = unused_.extract(each.tool_out)) needs.insert(unused.mapped());
        needs = {load(layer, each, needs).id};
    }
    for (const int tool : programs_[program].tools)
        if (const auto unused = unused_.extract(tool)) needs.insert(unused.mapped());
    spindle_ = programs_[program].last;
}

int MagazineSteps::place_of(int tool) const {
    const auto found = std::find(in_place_.begin(), in_place_.end(), tool);
    return found == in_place_.end() ? 0 : static_cast<int>(found - in_place_.begin()) + 1;
}

}  // namespace slabwright
