#include "engine/schedule/schedule.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/schedule/heights.h"

namespace slabwright {

namespace {

/// The slabs in the feed chamber, in the order in which they are taken. Where they are laid by hand, none lie
/// there and nothing is loaded.
class FeedChamber {
public:
    explicit FeedChamber(const Plan& plan) : loads_(feed_loads(plan)), slabs_(feed_slabs(plan)) {}
    [[nodiscard]] bool is_empty() const { return left_ == 0 && next_load_ < loads_.size(); }
    /// Fills the chamber and says with what.
    std::vector<std::pair<std::string, double>> load() {
        left_ = loads_[next_load_++];
        height_ = 0;
        double kg = 0;
        for (int k = 0; k < left_; ++k) {
            const FeedSlab& slab = slabs_[next_slab_ + static_cast<std::size_t>(k)];
            height_ += slab.thickness;
            kg += slab.kg;
        }
        return {{"slabs", left_}, {"height_mm", height_}, {"mass_kg", kg}};
    }
    /// Takes the next slab. @returns the height of the stack that it lay on top of, itself included, mm
    double take() {
        const double stack = height_;
        if (left_ > 0) {
            --left_;
            height_ = left_ == 0 ? 0 : height_ - slabs_[next_slab_].thickness;
        }
        ++next_slab_;
        return stack;
    }
    int last_taken = 0;  ///< the step that took the slab before; 0: none

private:
    std::vector<int> loads_;
    std::vector<FeedSlab> slabs_;  // of the whole build
    std::size_t next_load_ = 0, next_slab_ = 0;
    int left_ = 0;
    double height_ = 0;
};

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

}  // namespace

void name_programs(Plan& plan) {
    const Machine& machine = plan.job.machine;
    std::size_t highest = 0, most = 0;
    for (const Layer& layer : plan.layers) {
        highest = std::max(highest, static_cast<std::size_t>(std::max(0, layer.index)));
        most = std::max(most, layer.operations.size());
    }
    const int layer_width = width_of(highest, 3), file_width = width_of(most, 2);
    int running = 0;
    for (Layer& layer : plan.layers) {
        int files = 0;
        for (std::size_t begin = 0, end = 0; begin < layer.operations.size(); begin = end) {
            end = span_end(layer, begin, machine.programs);
            const Operation& first = layer.operations[begin];
            std::string stem = fmt::format("L{:0{}}", layer.index, layer_width);
            ++files;
            if (machine.programs != ProgramSpan::layer) stem += fmt::format("_{:0{}}", files, file_width);
            if (machine.programs == ProgramSpan::operation) stem += fmt::format("_{}", name(first.kind));
            if (machine.programs != ProgramSpan::layer) stem += fmt::format("_T{}", first.tool);
            // O0302 is layer 3's second, where all numbers fit below those of what is faced off again.
            ++running;
            const int number = highest < 80 && most < 100 ? 100 * layer.index + files : running;
            for (std::size_t i = begin; i < end; ++i) {
                layer.operations[i].file = program_file(machine.post, stem);
                if (end - begin > 1) layer.operations[i].file += fmt::format("#{}", i - begin + 1);
                layer.operations[i].number = number;
            }
        }
    }
}

void say_tool(SequenceStep& change, int tool, const Machine& machine) {
    change.numbers = {{"tool", tool}};
    if (!knows_tool_lengths(machine.post)) change.words = {{"length", "touch off"}};
}

void say_touch_off(SequenceStep& touch, const Plan& plan, const Layer& layer, double top) {
    const Blank slab = slab_of(plan, layer);
    const Point2 zero = work_zero(plan);
    touch.numbers = {{"slab_left_mm", slab.min[0] - to_mm(zero.x)},
                     {"slab_front_mm", slab.min[1] - to_mm(zero.y)},
                     {"slab_top_mm", top}};
}

void schedule(Plan& plan) {
    name_programs(plan);
    const Job& job = plan.job;
    Totals totals;
    totals.part_volume_mm3 = plan.totals.part_volume_mm3;
    const Blank stock{plan.stock_min, plan.stock_max};

    std::vector<SequenceStep>& steps = plan.sequence;
    steps.clear();
    const auto add = [&](int layer, const char* action, std::vector<int> needs,
                         double seconds) -> SequenceStep& {
        SequenceStep step;
        step.id = static_cast<int>(steps.size()) + 1;
        step.layer = layer;
        step.action = action;
        step.needs = std::move(needs);
        step.seconds = seconds;
        steps.push_back(std::move(step));
        return steps.back();
    };

    const int first_layer = plan.layers.empty() ? 0 : plan.layers.front().index;
    SequenceStep& board = add(first_layer, "mount_board", {}, 0);
    board.numbers = {{"thickness_mm", job.machine.base_board_thickness},
                     {"length_mm", stock.length()},
                     {"width_mm", stock.width()},
                     {"mass_kg", board_mass_kg(plan)}};
    FeedChamber feed(plan);
    double carried_kg = board_mass_kg(plan);
    double table_height = 0;     // of the layer before
    int stack_ready = board.id;  // the step after which the stack's top is ready for the next slab
    int handler_free = 0;        // the step after which the material handler is free; 0: from the start
    int spindle_tool = 0;
    const double third = job.bonding.handling_s / 3;

    for (const Layer& layer : plan.layers) {
        ++totals.layers;
        const Blank blank = slab_of(plan, layer);
        totals.stock_volume_mm3 += blank.mm2() * layer.slab_thickness;

        // A layer of several slabs: each is bonded to the one below before any is cut.
        const double slab = layer.slab_thickness / layer.slabs;
        int pressed = 0;
        for (int k = 0; k < layer.slabs; ++k) {
            static const Joint kNone;  // of a layer that nobody has bonded
            const auto at = static_cast<std::size_t>(k);
            const Joint& joint = at < layer.joints.size() ? layer.joints[at] : kNone;
            const double area = joint.area_mm2;
            // Fetching the slab and clamping it only needs the handler; it may go on while the layer below is
            // being milled.
            std::vector<int> needs;
            if (feed.is_empty()) {
                SequenceStep& load =
                    add(layer.index, "load_feed",
                        feed.last_taken == 0 ? std::vector<int>{} : std::vector<int>{feed.last_taken}, 0);
                load.numbers = feed.load();
                needs.push_back(load.id);
            }
            if (handler_free != 0) needs.push_back(handler_free);
            SequenceStep& take = add(layer.index, "take_slab", std::move(needs), third);
            take.numbers = {{"thickness_mm", slab},
                            {"length_mm", blank.length()},
                            {"width_mm", blank.width()},
                            {"mass_kg", slab_mass_kg(plan, blank, slab)},
                            {"feed_stack_mm", feed.take()}};
            take.words = {{"material", job.material.name}};
            const int taken = feed.last_taken = take.id;
            const int clamped = add(layer.index, "clamp", {taken}, third).id;
            SequenceStep& glue = add(layer.index, "glue", {k == 0 ? stack_ready : pressed},
                                     job.bonding.glue_s_per_m2 * area * 1e-6);
            glue.numbers = {{"area_mm2", area}, {"setback_mm", k == 0 ? job.bonding.edge_setback : 0}};
            glue.words = {{"glue", job.bonding.glue}};
            const int glued = glue.id;
            SequenceStep& place = add(layer.index, "place", {clamped, glued}, third);
            carried_kg += slab_mass_kg(plan, blank, slab);
            place.numbers = {{"x_mm", blank.min[0]},
                             {"y_mm", blank.min[1]},
                             {"z_bottom_mm", layer.z_bottom + k * slab},
                             {"table_load_kg", carried_kg}};
            handler_free = place.id;
            SequenceStep& press = add(layer.index, "press", {handler_free}, job.bonding.press_time_s);
            press.numbers = {{"force_n", joint.force_n}, {"time_s", job.bonding.press_time_s}};
            pressed = press.id;
            totals.bonding_minutes += (job.bonding.handling_s + job.bonding.glue_s_per_m2 * area * 1e-6 +
                                       job.bonding.press_time_s) /
                                      60;
        }

        // Where the table moves, it sinks until this layer's top will be cut where the first one's was.
        const LayerHeights heights = layer_heights(job.machine, plan.layers.front().z_top, layer.z_top);
        const double sinking =
            totals.layers == 1 ? 0 : table_seconds(job.machine, table_height, heights.table);
        table_height = heights.table;
        totals.table_minutes += sinking / 60;
        SequenceStep& table = add(layer.index, "table", {pressed}, sinking);
        table.numbers = {{"table_height_mm", heights.table}, {"work_offset_z_mm", heights.work_offset}};
        // What the touch-off has to find: the raw slab's top, in the programs' frame.
        SequenceStep& touch = add(layer.index, "touch_off", {table.id}, 0);
        say_touch_off(touch, plan, layer, layer.z_bottom + layer.slab_thickness - heights.origin);
        int last = touch.id;

        for (std::size_t begin = 0, end = 0; begin < layer.operations.size(); begin = end) {
            end = file_end(layer, begin);
            const Operation& first = layer.operations[begin];
            if (first.tool != spindle_tool) {
                // The program's own T and M6 then find the tool in the spindle, also when the build resumes
                // at the program.
                SequenceStep& change = add(layer.index, "tool_change", {last}, job.machine.tool_change_s);
                say_tool(change, first.tool, job.machine);
                last = change.id;
            }
            for (std::size_t i = begin; i < end; ++i)
                count(totals, layer.operations[i], spindle_tool, job.machine);
            const bool faces = end - begin == 1 && first.kind == OperationKind::face;
            SequenceStep& mill = add(layer.index, faces ? "face" : "mill", {last}, 0);
            say_program(mill, layer, begin, end, heights.origin, job.machine);
            last = mill.id;
        }
        stack_ready = last;
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

    totals.build_minutes =
        totals.cutting_minutes + totals.bonding_minutes + totals.tool_change_minutes + totals.table_minutes;
    totals.stack_mass_kg = (totals.stock_volume_mm3 + stock.mm2() * job.machine.base_board_thickness) * 1e-9 *
                           job.material.density_kg_m3;
    plan.totals = totals;
}

}  // namespace slabwright
