#include "engine/schedule/schedule.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "engine/schedule/glue_path.h"
#include "engine/schedule/heights.h"
#include "engine/schedule/magazine.h"
#include "engine/schedule/probes.h"
#include "engine/schedule/slab_steps.h"

namespace slabwright {

namespace {

constexpr int kTopNumbers = 50;  // of a layer's hundred; from there on its underside's

/// Digits of a number, at least `least`.
int width_of(std::size_t largest, int least) {
    return std::max(least, static_cast<int>(std::to_string(largest).size()));
}

/// Past the last of the operations that share a program with the one at place `begin`.
std::size_t span_end(const Layer& layer, std::size_t begin, ProgramSpan span) {
    const std::vector<Operation>& all = layer.operations;
    if (span == ProgramSpan::operation) return begin + 1;
    if (span == ProgramSpan::layer) return all.size();
    std::size_t end = begin + 1;
    while (end < all.size() && all[end].tool == all[begin].tool) ++end;
    return end;
}

/// Adds an operation to the totals, with the change of tool before it where the spindle holds another.
void count(Totals& totals, const Operation& operation, int& spindle_tool, const Machine& machine) {
    ++totals.operations;
    totals.cutting_mm += operation.cutting_mm;
    totals.rapid_mm += operation.rapid_mm;
    totals.cutting_minutes += operation.minutes;
    if (operation.tool == spindle_tool) return;
    spindle_tool = operation.tool;
    ++totals.tool_changes;
    totals.tool_change_minutes += machine.tool_change_s / 60;
}

/// What the step of a program says of the operations that it holds.
void say_program(SequenceStep& step, const Layer& layer, std::size_t begin, std::size_t end, double origin,
                 const Machine& machine) {
    const std::vector<Operation>& all = layer.operations;
    int changes = 0;
    std::string purpose;
    step.seconds = 0;
    for (std::size_t i = begin; i < end; ++i) {
        step.seconds += all[i].minutes * 60;
        purpose += (i == begin ? "" : ", ") + all[i].purpose;
        if (i > begin && all[i].tool != all[i - 1].tool) ++changes;
    }
    step.seconds += changes * machine.tool_change_s;
    step.numbers = {{"tool", all[begin].tool}};
    if (end - begin > 1) {
        step.numbers.emplace_back("last_tool", all[end - 1].tool);
        step.numbers.emplace_back("operations", static_cast<double>(end - begin));
        step.numbers.emplace_back("tool_changes", changes);
    }
    add_heights(step, {all.data() + begin, end - begin}, origin);
    step.words = {{"program", "nc/" + std::string(file_of(all[begin].file))}, {"purpose", purpose}};
}

/// The tools of every program, in the order of execution.
std::vector<ProgramTools> tools_of_programs(const Plan& plan) {
    std::vector<ProgramTools> programs;
    for (const Layer& layer : plan.layers)
        for (std::size_t begin = 0, end = 0; begin < layer.operations.size(); begin = end) {
            end = file_end(layer, begin);
            ProgramTools& program = programs.emplace_back();
            for (std::size_t i = begin; i < end; ++i) {
                program.last = layer.operations[i].tool;
                if (std::find(program.tools.begin(), program.tools.end(), program.last) ==
                    program.tools.end())
                    program.tools.push_back(program.last);
            }
        }
    return programs;
}

}  // namespace

void name_programs(Plan& plan) {
    const Machine& machine = plan.job.machine;
    std::size_t highest = 0, most = 0, most_below = 0;
    for (const Layer& layer : plan.layers) {
        highest = std::max(highest, static_cast<std::size_t>(std::max(0, layer.index)));
        most = std::max(most, layer.operations.size());
    }
    for (const Plan& under : plan.undersides)
        for (const Layer& layer : under.layers) most_below = std::max(most_below, layer.operations.size());
    // O0302 is layer 3's second and O0352 its underside's, where all numbers fit below those of what is faced
    // off again; else they are counted through. One control may hold all of them.
    const bool by_layer = highest < 80 && most < 100 && (most_below == 0 || most + most_below < 100);
    const int first_below =
        most <= kTopNumbers && most_below < 100 - kTopNumbers ? kTopNumbers : static_cast<int>(most);
    const int layer_width = width_of(highest, 3), file_width = width_of(most, 2);
    int running = 0;
    for (Layer& layer : plan.layers) {
        int files = 0;
        for (std::size_t begin = 0, end = 0; begin < layer.operations.size(); begin = end) {
            end = span_end(layer, begin, machine.programs);
            const Operation& first = layer.operations[begin];
            std::string stem = fmt::format("{}{:0{}}", plan.turned ? 'B' : 'L', layer.index, layer_width);
            ++files;
            if (machine.programs != ProgramSpan::layer) stem += fmt::format("_{:0{}}", files, file_width);
            if (machine.programs == ProgramSpan::operation) stem += fmt::format("_{}", name(first.kind));
            if (machine.programs != ProgramSpan::layer) stem += fmt::format("_T{}", first.tool);
            ++running;
            const int number = by_layer ? 100 * layer.index + files : running;
            for (std::size_t i = begin; i < end; ++i) {
                layer.operations[i].file = program_file(machine, stem);
                if (end - begin > 1) layer.operations[i].file += fmt::format("#{}", i - begin + 1);
                layer.operations[i].number = number;
            }
        }
    }
    for (Plan& under : plan.undersides)
        for (Layer& layer : under.layers) {
            int files = 0;
            for (std::size_t begin = 0, end = 0; begin < layer.operations.size(); begin = end) {
                end = file_end(layer, begin);
                ++files;
                ++running;
                const int number = by_layer ? 100 * layer.index + first_below + files : running;
                for (std::size_t i = begin; i < end; ++i) layer.operations[i].number = number;
            }
        }
}

ProgramNumbers program_numbers(const Plan& plan) {
    ProgramNumbers numbers;
    for (const Layer& layer : plan.layers)
        for (const Operation& operation : layer.operations)
            numbers.emplace(file_of(operation.file), operation.number);
    return numbers;
}

void note_other_numbers(const Plan& plan, const ProgramNumbers& before, std::vector<bool>& other) {
    for (std::size_t l = 0; l < plan.layers.size(); ++l)
        for (const Operation& operation : plan.layers[l].operations) {
            const auto found = before.find(file_of(operation.file));
            if (found != before.end() && found->second != operation.number) other[l] = true;
        }
}

void say_tool(SequenceStep& change, int tool, const Machine& machine, int place) {
    change.numbers = {{"tool", tool}};
    if (place != 0) change.numbers.emplace_back("place", place);
    if (!knows_tool_lengths(machine.post)) change.words = {{"length", "touch off"}};
}

void say_touch_off(SequenceStep& touch, const Plan& plan, const Layer& layer, double top) {
    const Blank slab = slab_of(plan, layer);
    const Point2 zero = work_zero(plan);
    touch.numbers = {{"slab_left_mm", slab.min[0] - to_mm(zero.x)},
                     {"slab_front_mm", slab.min[1] - to_mm(zero.y)},
                     {"slab_top_mm", top}};
}

namespace {

/// Adds the steps that run programs to plan.sequence, with the swaps and changes of tools before them, and
/// counts them.
class ProgramRuns {
public:
    /// @param plan, totals outlive this
    ProgramRuns(Plan& plan, Totals& totals)
        : plan_(plan),
          steps_(plan.sequence),
          machine_(plan.job.machine),
          totals_(totals),
          magazine_(steps_, machine_, tools_of_programs(plan)) {}

    void fill_magazine(int layer) { magazine_.fill(layer, {}); }
    [[nodiscard]] int swaps() const { return magazine_.swaps(); }

    /// The programs of a layer. @param origin mm, of their z = 0. @param last the step before them. @returns
    /// the last one's
    int run(const Layer& layer, double origin, int last) {
        int files = 0;
        for (std::size_t begin = 0, end = 0; begin < layer.operations.size(); begin = end) {
            end = file_end(layer, begin);
            const Operation& first = layer.operations[begin];
            std::set<int> needs{last};
            magazine_.load_for(program_++, layer.index, needs);
            if (first.tool != spindle_tool_) {
                // The program's own T and M6 then find the tool in the spindle, also when the build resumes
                // at the program.
                SequenceStep& change = add(layer, "tool_change", needs, machine_.tool_change_s);
                say_tool(change, first.tool, machine_, magazine_.place_of(first.tool));
                needs = {change.id};
                if (probes_each_tool_) change.words = {{"length", "probe"}};
            }
            if (probes_each_tool_ && (files == 0 || first.tool != spindle_tool_))
                needs = {add_probe(plan_, layer, first.tool, files, {needs.begin(), needs.end()})};
            ++files;
            for (std::size_t i = begin; i < end; ++i)
                count(totals_, layer.operations[i], spindle_tool_, machine_);
            const bool faces = end - begin == 1 && first.kind == OperationKind::face;
            SequenceStep& mill = add(layer, faces ? "face" : "mill", needs, 0);
            say_program(mill, layer, begin, end, origin, machine_);
            last = mill.id;
        }
        return last;
    }

    /// What finds z = 0 for a layer before its first program; nothing where each tool is probed.
    /// @param top of the raw slab, as the programs count @param last the step before @returns the last one's
    int find_zero(const Layer& layer, double top, int last) {
        if (probes_each_tool_) return last;
        if (machine_.probe == ProbeMode::none) {
            SequenceStep& touch = add(layer, "touch_off", {last}, 0);
            say_touch_off(touch, plan_, layer, top);
            return touch.id;
        }
        const int tool = plan_.job.probing.tool;
        if (tool != spindle_tool_) {
            SequenceStep& change = add(layer, "tool_change", {last}, machine_.tool_change_s);
            say_tool(change, tool, machine_, 0);
            last = change.id;
            spindle_tool_ = tool;
            ++totals_.tool_changes;
            totals_.tool_change_minutes += machine_.tool_change_s / 60;
        }
        return add_probe(plan_, layer, tool, 0, {last});
    }

private:
    SequenceStep& add(const Layer& layer, const char* action, const std::set<int>& needs, double seconds) {
        return add_step(steps_, layer.index, action, {needs.begin(), needs.end()}, seconds);
    }

    Plan& plan_;
    std::vector<SequenceStep>& steps_;
    const Machine& machine_;
    Totals& totals_;
    const bool probes_each_tool_ = machine_.probe == ProbeMode::cycle && !knows_tool_lengths(machine_.post);
    MagazineSteps magazine_;
    std::size_t program_ = 0;
    int spindle_tool_ = 0;
};

}  // namespace

void schedule(Plan& plan) {
    name_programs(plan);
    const Job& job = plan.job;
    Totals totals;
    totals.part_volume_mm3 = plan.totals.part_volume_mm3;
    const Blank stock{plan.stock_min, plan.stock_max};

    std::vector<SequenceStep>& steps = plan.sequence;
    steps.clear();
    plan.probes.clear();
    const auto add = [&](int layer, const char* action, std::vector<int> needs,
                         double seconds) -> SequenceStep& {
        return add_step(steps, layer, action, std::move(needs), seconds);
    };

    const int first_layer = plan.layers.empty() ? 0 : plan.layers.front().index;
    std::vector<int> slabs_turned;  // the step that turned the last of them
    for (const Plan& under : plan.undersides) {
        const double seconds = under.totals.build_minutes * 60, turning = job.bonding.handling_s / 3;
        SequenceStep& mill = add(under.turned->layer, "mill_underside", slabs_turned, seconds);
        mill.words = {{"sequence", underside_folder(under.turned->layer) + "/sequence.json"}};
        slabs_turned = {add(under.turned->layer, "turn_over", {mill.id}, turning).id};
        totals.underside_minutes += (seconds + turning) / 60;
    }
    SequenceStep& board = add(first_layer, "mount_board", slabs_turned, 0);
    board.numbers = {{"thickness_mm", job.machine.base_board_thickness},
                     {"length_mm", stock.length()},
                     {"width_mm", stock.width()},
                     {"mass_kg", board_mass_kg(plan)}};
    const int mounted = board.id;
    ProgramRuns runs(plan, totals);
    runs.fill_magazine(first_layer);
    SlabSteps slabs(plan);
    double table_height = 0;    // of the layer before
    int stack_ready = mounted;  // the step after which the stack's top is ready for the next slab

    for (const Layer& layer : plan.layers) {
        ++totals.layers;
        totals.stock_volume_mm3 += slab_of(plan, layer).mm2() * layer.slab_thickness;
        // A layer of several slabs: each is bonded to the one below before any is cut.
        int pressed = stack_ready;
        for (int k = 0; k < layer.slabs; ++k) pressed = slabs.bond(layer, k, pressed);

        // Where the table moves, it sinks until this layer's top will be cut where the first one's was.
        const LayerHeights heights = layer_heights(job.machine, plan.layers.front().z_top, layer.z_top);
        const double sinking =
            totals.layers == 1 ? 0 : table_seconds(job.machine, table_height, heights.table);
        table_height = heights.table;
        totals.table_minutes += sinking / 60;
        SequenceStep& table = add(layer.index, "table", {pressed}, sinking);
        table.numbers = {{"table_height_mm", heights.table}, {"work_offset_z_mm", heights.work_offset}};
        // What the touch-off has to find: the raw slab's top, in the programs' frame.
        const int set = table.id,
                  found = runs.find_zero(layer, layer.z_bottom + layer.slab_thickness - heights.origin, set);
        stack_ready = runs.run(layer, heights.origin, found);
    }
    const int last_layer = plan.layers.empty() ? 0 : plan.layers.back().index;
    const int unloaded = add(last_layer, "unload", {stack_ready}, 0).id;
    if (plan.flask) {
        // The frame around the pattern is the moulding box: sand goes between the two and leaves upwards with
        // the box's draft.
        SequenceStep& box = add(last_layer, "mould_box", {unloaded}, 0);
        box.numbers = {
            {"flask_mass_kg", plan.flask->volume_mm3 * 1e-9 * job.material.density_kg_m3},
            {"height_mm", plan.layers.empty() ? 0 : plan.layers.back().z_top},
            {"sand_litres", std::max(0.0, plan.flask->opening_mm3 - totals.part_volume_mm3) * 1e-6}};
    }

    totals.bonding_minutes = slabs.minutes();
    totals.magazine_swaps = runs.swaps();
    totals.magazine_minutes = runs.swaps() * job.machine.magazine_swap_s / 60;
    totals.build_minutes = totals.cutting_minutes + totals.bonding_minutes + totals.tool_change_minutes +
                           totals.table_minutes + totals.magazine_minutes + totals.underside_minutes;
    totals.stack_mass_kg = (totals.stock_volume_mm3 + stock.mm2() * job.machine.base_board_thickness) * 1e-9 *
                           job.material.density_kg_m3;
    plan.totals = totals;
    note_missed_glue(plan);
}

}  // namespace slabwright
