#include "engine/planner/remake.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>

#include "engine/forces/feeds.h"
#include "engine/moves/motion_time.h"
#include "engine/paths/operations/facing.h"
#include "engine/paths/runs/layer_cut.h"
#include "engine/planner/layer_plan.h"
#include "engine/schedule/glue_path.h"
#include "engine/schedule/heights.h"
#include "engine/schedule/keep_outs.h"
#include "engine/schedule/magazine.h"
#include "engine/schedule/schedule.h"
#include "engine/schedule/slab_steps.h"
#include "engine/simulate/planned_build.h"
#include "kernels/errors.h"

namespace slabwright {

namespace {

constexpr int kFaceOffNumbers = 8000;  // above those of the plan's own programs

[[noreturn]] void refuse(ErrorKind kind, const char* code, const std::string& message,
                         const std::string& remedy) {
    throw Error(kind, code, message, "--remake", remedy);
}

/// What of a plan its programs are made and written with.
Plan bare_plan(const BuildPlan& build) {
    Plan plan;
    plan.job = build.job;
    plan.job.tools = build.tools;
    plan.input.file = build.pattern;
    plan.input.sha256 = build.sha256;
    plan.stock_min = build.stock_min;
    plan.stock_max = build.stock_max;
    for (const LayerToBuild& from : build.layers) {
        Layer& layer = plan.layers.emplace_back();
        layer.index = from.index;
        layer.z_bottom = from.z_bottom;
        layer.z_top = from.z_top;
        layer.slab_thickness = from.slab_thickness;
        layer.slabs = from.slabs;
        layer.blank = from.blank;
    }
    return plan;
}

/// The index of the layer asked for and of the one on top, which is whole.
struct Spoilt {
    std::size_t layer = 0, top = 0;
};

Spoilt spoilt_layers(const RemakeRequest& request, const PlannedBuild& build) {
    const std::vector<LayerToBuild>& layers = request.plan.layers;
    const BuildState& state = request.state;
    if (!request.plan.job_stated)
        refuse(ErrorKind::no_plan, "resume.job", "plan.json states no job, so no program can be made",
               "plan again");
    const auto at = std::find_if(layers.begin(), layers.end(),
                                 [&](const LayerToBuild& l) { return l.index == request.layer; });
    if (at == layers.end())
        refuse(ErrorKind::usage, "resume.layer", fmt::format("the plan has no layer {}", request.layer),
               fmt::format("give {} to {}", layers.front().index, layers.back().index));
    if (state.unloaded)
        refuse(ErrorKind::usage, "resume.unloaded", "the stack is off the machine",
               "plan again, or mount the stack again and say --after the step before the unloading");
    const auto l = static_cast<std::size_t>(at - layers.begin());
    if (state.placed == 0 || build.slabs()[state.placed - 1].layer < l)
        refuse(ErrorKind::usage, "resume.layer",
               fmt::format("no slab of layer {} is on the stack yet", request.layer),
               "take another slab if one is spoilt, and go on with the sequence");
    const std::size_t top = build.slabs()[state.placed - 1].layer;
    if (state.to_press)
        refuse(ErrorKind::usage, "resume.unpressed",
               fmt::format("a slab of layer {} lies on its glue and is not pressed yet", layers[top].index),
               "press it and say --after that step; or lift it off, wipe the glue off, and say --after the "
               "step before the glue");
    for (std::size_t k = l; k <= top; ++k)
        if (mills_underside(request.plan, layers[k].index))
            refuse(
                ErrorKind::usage, "resume.underside",
                fmt::format("layer {} would be faced off, and its slab is milled from below before it is "
                            "laid: another one cannot be while the stack lies on the machine",
                            layers[k].index),
                "plan again, or take the stack off, mill another slab by the layer's folder in undersides, "
                "and go on by hand");
    if (build.whole_layer(state) != top)
        refuse(ErrorKind::usage, "resume.incomplete",
               fmt::format("layer {} has not all of its {} slabs yet", layers[top].index, layers[top].slabs),
               "bond the others first, say --after the last press, and remake then");
    return {l, top};
}

/// The program that faces one layer off, with feeds and time. @param top mm, what it stands up to
Operation face_off(Context& context, const Plan& plan, const Layer& layer, double top) {
    LayerJob job;
    job.job = &plan.job;
    job.index = layer.index;
    job.z_bottom = job.z_top = job.floor_below = layer.z_bottom;
    job.slab_thickness = top - layer.z_bottom;
    job.stock_min = plan.stock_min;
    job.stock_max = plan.stock_max;
    const LayerCut cut{context, job, plan.job, LayerSolid{}, top, {}, {}};
    Layer faced = layer;
    faced.slab_thickness = job.slab_thickness;
    faced.operations.push_back(face_layer(cut));
    faced.operations[0].purpose = fmt::format("face off layer {} to the joint under it", layer.index);
    limit_feeds(faced.operations[0], plan.job);
    std::vector<Diagnostic> unused;  // of feeds that were lowered
    if (plan.job.cutting.engagement == Engagement::simulated) rate_layer(context, faced, plan, unused);
    Operation operation = std::move(faced.operations[0]);
    keep_clear(plan, faced, top, operation, keep_outs_in(plan, faced));
    const MotionTime time = motion_time(operation.moves, plan.job.machine, operation.blend);
    operation.cutting_mm = time.cutting_mm;
    operation.rapid_mm = time.rapid_mm;
    operation.minutes = time.minutes + plan.job.machine.spindle_dwell_s / 60;
    return operation;
}

/// The tools of the programs to come, in the order of execution: those that face layers off, and the plan's
/// own from a layer on.
std::vector<ProgramTools> tools_to_come(const RemakeRequest& request, const Spoilt& spoilt, int face_mill) {
    std::vector<ProgramTools> programs(spoilt.top - spoilt.layer + 1, {{face_mill}, face_mill});
    const std::vector<PlannedProgram>& all = request.plan.programs;
    for (std::size_t p = 0; p < all.size(); ++p) {
        if (all[p].layer < spoilt.layer) continue;
        if (p == 0 || file_of(all[p].file) != file_of(all[p - 1].file)) programs.emplace_back();
        ProgramTools& program = programs.back();
        program.last = all[p].tool;
        if (std::find(program.tools.begin(), program.tools.end(), program.last) == program.tools.end())
            program.tools.push_back(program.last);
    }
    return programs;
}

/// The steps of the new sequence, one after another.
class RemadeSteps {
public:
    RemadeSteps(const RemakeRequest& request, const Plan& plan, std::vector<ProgramTools> programs)
        : request_(request),
          plan_(plan),
          machine_(plan.job.machine),
          magazine_(steps_, machine_, std::move(programs), request.state.magazine,
                    request.state.spindle_tool),
          spindle_tool_(request.state.spindle_tool),
          table_(request.state.table),
          handler_(request.state.handler) {
        const auto done = request.sequence.steps.begin() + static_cast<std::ptrdiff_t>(request.state.done);
        steps_.assign(request.sequence.steps.begin(), done);
        std::set<int> open;  // steps that no other one needs: all is done when these are
        for (const SequenceStep& step : steps_) open.insert(step.id);
        for (const SequenceStep& step : steps_)
            for (const int need : step.needs) open.erase(need);
        last_ = add(plan.layers[0].index, "clear", {open.begin(), open.end()}, 0).id;
    }

    void clear_for(const Layer& layer) {
        steps_.back().layer = layer.index;
        magazine_.fill(layer.index, {last_});
    }

    /// @param set whether the table is at the layer's height already, @param touched and its top found
    void face_off(const Layer& layer, const Operation& operation, double top, bool set, bool touched) {
        const LayerHeights heights = layer_heights(machine_, plan_.layers.front().z_top, layer.z_top);
        if (!set) {
            SequenceStep& table = follow(layer.index, "table", table_time(heights.table));
            table.numbers = {{"table_height_mm", heights.table}, {"work_offset_z_mm", heights.work_offset}};
        }
        if (!set || !touched)
            say_touch_off(follow(layer.index, "touch_off", 0), plan_, layer, top - heights.origin);
        std::set<int> needs{last_};
        magazine_.load_for(next_program_++, layer.index, needs);
        if (spindle_tool_ != operation.tool) change_tool(layer.index, operation.tool, needs);
        SequenceStep& step =
            add(layer.index, "face_off", {needs.begin(), needs.end()}, operation.minutes * 60);
        last_ = step.id;
        step.numbers = {{"tool", operation.tool}};
        add_heights(step, {&operation, 1}, heights.origin);
        step.words = {{"program", request_.folder + operation.file}, {"purpose", operation.purpose}};
    }

    /// The plan's own steps from a layer on.
    void build_from(std::size_t layer) {
        base_ = last_;
        std::map<int, std::size_t> place;
        for (std::size_t l = 0; l < plan_.layers.size(); ++l) place[plan_.layers[l].index] = l;
        const std::vector<FeedSlab> slabs = feed_slabs(plan_, layer);
        feed_ = FeedChamber(feed_loads(machine_, slabs), slabs);
        for (const SequenceStep& step : request_.own.steps)
            if (const auto at = place.find(step.layer); at != place.end() && at->second >= layer) build(step);
    }

    [[nodiscard]] std::vector<SequenceStep> take() { return std::move(steps_); }

private:
    SequenceStep& add(int layer, const char* action, std::vector<int> needs, double seconds) {
        SequenceStep& step = steps_.emplace_back();
        step.id = static_cast<int>(steps_.size());
        step.layer = layer;
        step.action = action;
        step.needs = std::move(needs);
        step.seconds = seconds;
        return step;
    }
    /// A step after the one before.
    SequenceStep& follow(int layer, const char* action, double seconds) {
        SequenceStep& step = add(layer, action, {last_}, seconds);
        last_ = step.id;
        return step;
    }
    /// @param needs of the step, then of what follows it
    void change_tool(int layer, int tool, std::set<int>& needs) {
        SequenceStep& change =
            add(layer, "tool_change", {needs.begin(), needs.end()}, machine_.tool_change_s);
        say_tool(change, tool, machine_, magazine_.place_of(tool));
        spindle_tool_ = tool;
        needs = {change.id};
    }
    double table_time(double to) {
        const double seconds = table_ ? table_seconds(machine_, *table_, to) : 0;
        table_ = to;
        return seconds;
    }

    /// A plan's own step, with its needs in the new numbers. Loads and changes of tool are made anew.
    void build(const SequenceStep& own) {
        std::set<int> needs;
        for (const int need : own.needs) {
            const auto known = now_.find(need);
            if (known == now_.end()) needs.insert(base_);  // of what was faced off, or lies under it
            else needs.insert(known->second.begin(), known->second.end());
        }
        // The slabs of layers to come are milled from below and turned already.
        if (own.action == "mill_underside" || own.action == "turn_over" || own.action == "mount_board" ||
            own.action == "load_feed" || own.action == "load_tool" || own.action == "tool_change") {
            if (needs.empty()) needs.insert(base_);
            now_[own.id] = {needs.begin(), needs.end()};
            return;
        }
        if (needs.empty()) needs.insert(base_);
        SequenceStep step = own;
        if (own.action == "face" || own.action == "mill")
            magazine_.load_for(next_program_++, own.layer, needs);
        for (auto& [key, value] : step.numbers) {
            if (key == "table_height_mm") step.seconds = table_time(value);
            if (key == "feed_stack_mm") {
                if (feed_.is_empty()) needs.insert(load(own.layer));
                value = feed_.take();
            }
            if (key == "stack") value = feed_.stack();
            if (key == "handler_mm") {
                // Only where the first slab is fetched from is not as it was.
                if (own.action == "take_slab") step.seconds = handler_seconds(machine_, handler_, value);
                handler_ = value;
            }
            if (key != "tool" || static_cast<int>(value) == spindle_tool_) continue;
            change_tool(own.layer, static_cast<int>(value), needs);
            // The new tip is not touched off, for it is probed.
            if (own.action == "probe" && !knows_tool_lengths(machine_.post))
                steps_.back().words = {{"length", "probe"}};
        }
        for (const auto& [key, value] : step.numbers)
            if (key == "last_tool") spindle_tool_ = static_cast<int>(value);  // its program changes it
        step.id = static_cast<int>(steps_.size()) + 1;
        step.needs = {needs.begin(), needs.end()};
        now_[own.id] = {step.id};
        if (own.action == "take_slab") last_taken_ = step.id;
        steps_.push_back(std::move(step));
    }

    int load(int layer) {
        SequenceStep& step = add(layer, "load_feed", {last_taken_ == 0 ? base_ : last_taken_}, 0);
        feed_.load(step, machine_);
        return step.id;
    }

    const RemakeRequest& request_;
    const Plan& plan_;
    const Machine& machine_;
    std::vector<SequenceStep> steps_;
    MagazineSteps magazine_;
    std::size_t next_program_ = 0;
    int spindle_tool_ = 0, last_ = 0, base_ = 0, last_taken_ = 0;
    std::optional<double> table_;
    std::map<int, std::vector<int>> now_;  // what a step of the plan's own sequence is now
    FeedChamber feed_{{}, {}};
    double handler_;  // mm, where it stands
};

}  // namespace

Remake remake_layer(Context& context, const RemakeRequest& request) {
    const PlannedBuild build(request.plan);
    const Spoilt spoilt = spoilt_layers(request, build);
    Remake remake;
    Plan& plan = remake.plan = bare_plan(request.plan);
    validate(plan.job);
    const Tool& face_mill = tool_of_kind(plan.job, ToolKind::face);
    remake.most_mm = face_step(plan.job, face_mill);
    RemadeSteps steps(request, plan, tools_to_come(request, spoilt, face_mill.number));
    steps.clear_for(plan.layers[spoilt.top]);
    for (std::size_t l = spoilt.top + 1; l-- > spoilt.layer;) {
        Layer& layer = plan.layers[l];
        const bool on_top = l == spoilt.top;
        const double top = on_top ? build.stack_top(request.state) : layer.z_top;
        Operation operation = face_off(context, plan, layer, top);
        operation.file = program_file(
            plan.job.machine,
            fmt::format("F{:03}_L{:03}_face_off_T{}", remake.layers.size() + 1, layer.index, operation.tool));
        operation.number = kFaceOffNumbers + static_cast<int>(remake.layers.size()) + 1;
        steps.face_off(layer, operation, top, on_top && request.state.table_at.has_value(),
                       on_top && request.state.touched.has_value());
        remake.layers.push_back(l);
        remake.tops.push_back(top);
        layer.operations.push_back(std::move(operation));
    }
    steps.build_from(spoilt.layer);
    remake.steps = steps.take();
    return remake;
}

}  // namespace slabwright
