#include "engine/schedule/probes.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "engine/schedule/fit.h"
#include "engine/schedule/keep_outs.h"
#include "engine/schedule/slab_steps.h"
#include "kernels/errors.h"

namespace slabwright {

namespace {

constexpr const char* kByHand =
    "leave machine.probe at \"none\": the sequence asks the operator to touch off";

/// What may be in the spindle while z 0 is found.
std::vector<Tool> probing_tools(const Job& job) {
    if (!knows_tool_lengths(job.machine.post)) return job.tools;
    if (const std::optional<Tool> probe = probe_of(job)) return {*probe};
    const auto tool =
        std::ranges::find_if(job.tools, [&](const Tool& t) { return t.number == job.probing.tool; });
    return {*tool};
}

/// The radius of the widest part of a tool that begins less than so far above its tip, mm; negative: none.
double widest_below(const Tool& tool, double height) {
    double radius = -1;
    if (height > 0) radius = tool.diameter / 2;
    for (const ToolSection& s : cylinders_of(tool))
        if (height > s.above) radius = std::max(radius, s.radius);
    return radius;
}

[[noreturn]] void refuse(const std::string& message, const std::string& remedy) {
    throw Error(ErrorKind::usage, "job.probe", message, "machine.probe", remedy);
}

}  // namespace

void check_probing(const Job& job) {
    const Machine& machine = job.machine;
    if (machine.probe == ProbeMode::none) return;
    if (const std::string_view why = control_of(machine.post).unsure_of_probing; !why.empty())
        refuse(fmt::format("no probing program is written for this machine.post: {}", why), kByHand);
    if (machine.own_post) refuse("a post of your own has no probing program", kByHand);
    if (machine.magazine > 0)
        refuse("machine.probe is \"cycle\", and the probe has no place in the magazine",
               "give machine.magazine = 0, or leave machine.probe at \"none\"");
    if (machine.table == BuildTable::moving)
        refuse("probing.reference lies on the machine's table, which moves away with the stack",
               "z 0 moves by work_offset_z_mm of the sequence; leave machine.probe at \"none\"");
    // A raw slab's thickness is known to some tenths of a millimetre. Were z 0 found on it, each slab would
    // carry what it is thicker or thinner into its own layer and all above.
    if (job.probing.reference.empty())
        refuse(
            "there is no probing.reference, and a raw slab is no place to find z 0: it may be thicker than "
            "it says",
            "give probing.reference, a pad or plate on a table that stays (machine.table = \"fixed\")");
}

std::optional<Tool> probe_of(const Job& job) {
    if (job.machine.probe == ProbeMode::none || !knows_tool_lengths(job.machine.post)) return std::nullopt;
    for (const Tool& tool : job.tools)
        if (tool.number == job.probing.tool) return std::nullopt;
    Tool probe;
    probe.number = job.probing.tool;
    probe.name = "probe";
    probe.diameter = job.probing.tip_diameter;
    return probe;
}

std::array<double, 3> probed_place(const Plan& plan, const Layer& layer) {
    const Machine& machine = plan.job.machine;
    const Probing& probing = plan.job.probing;
    const Point2 zero = work_zero(plan);
    return {plan.stock_min[0] + probing.reference[0] - to_mm(zero.x),
            plan.stock_min[1] + probing.reference[1] - to_mm(zero.y),
            probing.reference[2] - machine.base_board_thickness + probing.plate -
                zero_height(machine, layer.z_top)};
}

void check_probed_place(const Plan& plan, const std::array<double, 2>& origin) {
    const Job& job = plan.job;
    if (job.machine.probe == ProbeMode::none || job.machine.keep_outs.empty()) return;
    const std::array<double, 2> at{plan.stock_min[0] + job.probing.reference[0],
                                   plan.stock_min[1] + job.probing.reference[1]};
    const double lowest = job.probing.reference[2] - job.machine.base_board_thickness + job.probing.plate -
                          job.probing.search / 2;
    const std::vector<Tool> tools = probing_tools(job);
    for (const Layer& layer : plan.layers)
        for (const KeepOutZone& zone : keep_outs_in(plan, layer, origin)) {
            const double away = distance_to(zone, at, at);
            for (const Tool& tool : tools) {
                const double radius = widest_below(tool, zone.top - lowest);
                if (!(radius >= 0) || away >= radius + zone.clearance) continue;
                throw refusal(
                    "keep_out.probe",
                    fmt::format(
                        "T{} finds z 0 {:.2f} mm from \"{}\": it is {:.2f} mm wide there, and {:.2f} mm "
                        "must stay clear",
                        tool.number, away, zone.name, 2 * radius, zone.clearance),
                    fmt::format("layer {}, x {:.2f} y {:.2f} mm", layer.index, at[0] + origin[0],
                                at[1] + origin[1]),
                    "move probing.reference, or the keep-out");
            }
        }
}

int add_probe(Plan& plan, const Layer& layer, int tool, int files, std::vector<int> needs) {
    const Probing& probing = plan.job.probing;
    ProbeProgram& probe = plan.probes.emplace_back();
    probe.layer = layer.index;
    probe.tool = tool;
    probe.touches = probed_place(plan, layer);
    // "L003_02z_…" sorts behind the layer's second program and before its third; "L003-0_…" before
    // "L003.ngc".
    const std::string stem = fmt::format("{}{:03}", plan.turned ? 'B' : 'L', layer.index);
    probe.file = program_file(plan.job.machine, plan.job.machine.programs == ProgramSpan::layer
                                                    ? fmt::format("{}-0_probe_T{}", stem, tool)
                                                    : fmt::format("{}_{:02}{}_probe_T{}", stem, files,
                                                                  files == 0 ? "" : "z", tool));
    SequenceStep& step = add_step(plan.sequence, layer.index, "probe", std::move(needs), 0);
    step.numbers = {{"tool", tool},
                    {"touch_x_mm", probe.touches[0]},
                    {"touch_y_mm", probe.touches[1]},
                    {"touch_z_mm", probe.touches[2]},
                    {"start_z_mm", probe.touches[2] + probing.search / 2}};
    step.words = {{"program", "nc/" + probe.file}};
    return step.id;
}

}  // namespace slabwright
