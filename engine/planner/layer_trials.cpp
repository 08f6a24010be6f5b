#include "engine/planner/layer_trials.h"

#include <algorithm>
#include <string>
#include <utility>

#include "engine/forces/op_forces.h"
#include "engine/moves/motion_time.h"
#include "engine/schedule/standing_walls.h"
#include "kernels/mesh/part.h"

namespace slabwright {

namespace {

constexpr double kStrained = 1.03;  // of a limit: within that, what a plan states may hold

// Of the programs of finish_floors.
double floor_minutes(const Layer& layer, const Machine& machine) {
    double minutes = 0;
    for (const Operation& op : layer.operations)
        if (op.purpose == "floors") minutes += motion_time(op.moves, machine, op.blend).minutes;
    return minutes;
}

double minutes_of(const Layer& layer, const Machine& machine) {
    double minutes = 0;
    const Operation* before = nullptr;
    for (const Operation& op : layer.operations) {
        minutes += motion_time(op.moves, machine, op.blend).minutes + machine.spindle_dwell_s / 60;
        if (before && before->tool != op.tool) minutes += machine.tool_change_s / 60;
        if (before && !before->moves.empty() && !op.moves.empty())
            minutes +=
                approach_seconds(place_of(before->moves.back()), place_of(op.moves.front()), machine) / 60;
        before = &op;
    }
    return minutes;
}

// The job's tool, no deeper than one of a set, whose stepdowns may have been narrowed.
Tool in_full(const Job& job, const Tool& of_set) {
    Tool tool = *std::find_if(job.tools.begin(), job.tools.end(),
                              [&](const Tool& t) { return t.number == of_set.number; });
    tool.stepdown_max = of_set.stepdown_max;
    tool.stepdown_min = std::min(tool.stepdown_min, tool.stepdown_max);
    return tool;
}

void make_shallow(const Job& job, LayerTools& tools) {
    const auto lower = [&](Tool& tool) {
        if (!roughs_layers(tool.kind)) return;
        tool.stepdown_max = shallow_step(in_full(job, tool));
        tool.stepdown_min = std::min(tool.stepdown_min, tool.stepdown_max);
    };
    lower(tools.rough);
    for (Tool& tool : tools.semi_rough) lower(tool);
    for (Tool& tool : tools.rest) lower(tool);
}

}  // namespace

LayerTrials::LayerTrials(Context& context, const LayerGround& ground, std::size_t index)
    : context_(context),
      ground_(ground),
      layer_(ground.plan.layers[index]),
      fitted_(with_tools_for(ground.plan.job, layer_.z_top - layer_.z_bottom)),
      overrun_(overrun_of(ground.plan.job)) {
    const Plan& plan = ground.plan;
    near_ = part_between(context, ground.mesh, layer_.z_bottom - std::max(overrun_.below, overrun_.board),
                         layer_.z_top);
    work_.mesh = near_.view();
    work_.job = &fitted_;
    work_.z_bottom = layer_.z_bottom;
    work_.z_top = layer_.z_top;
    work_.slab_thickness = layer_.slab_thickness;
    const Blank slab = slab_of(plan, layer_);
    work_.stock_min = slab.min;
    work_.stock_max = slab.max;
    work_.index = layer_.index;
    work_.stock_memory = ground.stock_memory;
    if (ground.drilled != nullptr) work_.drilled = *ground.drilled;
    if (plan.flask) work_.opening = plan.flask->inner[index];
    fitted_.tolerances.gouge -= ground.mesh_gap;
    work_.flats = flats_between(layer_.z_bottom);
    work_.floor_below = layer_.z_bottom - (ground.carried_by ? overrun_.below : overrun_.board);
    if (ground.carried_by) overhang_ = overhang_map({&ground.carried_by, 1}, slab.min, slab.max);
    if (!ground.walls.empty())
        walls_.emplace(ground.walls, plan.job.material.strength_mpa, widest_beside_walls(plan.job),
                       plan.job.cutting.wall_allowance);
}

// Flats between z and the layer's top.
std::vector<Flat> LayerTrials::flats_between(double z) const {
    std::vector<Flat> flats;
    for (const Feature& f : ground_.plan.features) {
        if (f.type != FeatureType::up_flat || f.area < fitted_.cutting.min_flat_area ||
            f.z_low >= layer_.z_top || f.z_low <= z)
            continue;
        Flat& flat = flats.emplace_back(Flat{f.z_low, f.z_low});
        for (const std::uint32_t facet : f.facets)
            for (const std::uint32_t v : ground_.pattern.facets[facet])
                flat.highest = std::max(flat.highest, static_cast<double>(ground_.pattern.vertices[v].z));
    }
    return flats;
}

void LayerTrials::set_tools(const LayerTools& tools) {
    const Job& job = ground_.plan.job;
    work_.tools = tools;
    if (ground_.shallow) make_shallow(job, work_.tools);
    const double below = tools.finish.diameter / 2;
    const double board = job.machine.base_board_cut >= 0 ? overrun_.board : std::min(below, overrun_.board);
    work_.floor_below = layer_.z_bottom - (ground_.carried_by ? below : board);
    work_.feet = flats_between(work_.floor_below);
    work_.paced = compared_;
    work_.rough_steps = rough_steps(job, in_full(job, work_.tools.rough),
                                    overhang_ ? overhang_->largest() + job.bonding.edge_setback : 0,
                                    layer_.z_top - layer_.z_bottom);
}

LayerPaths LayerTrials::begin(const LayerTools& tools) {
    set_tools(tools);
    return {context_, work_};
}

Trial LayerTrials::plan(const LayerTools& tools, const TrialLimits& limits, ProgressPart& part,
                        LayerPaths* cleared) {
    Trial trial = cleared != nullptr ? with_forces(cleared->finish(&part, limits.ahead), limits)
                                     : plan_once(tools, limits, part);
    if (!walls_ || !trial.floors_slowed) return trial;
    work_.walls_first = true;
    Trial other = plan_once(tools, limits, part);
    work_.walls_first = false;
    if (!other.whole || other.leaves_more ||
        (other.left_mm2 && trial.left_mm2 && *other.left_mm2 > kMoreLeft * *trial.left_mm2 + kFewLeft))
        return trial;
    return std::pair(other.strained, other.minutes) < std::pair(trial.strained, trial.minutes) ? other
                                                                                               : trial;
}

Trial LayerTrials::plan_once(const LayerTools& tools, const TrialLimits& limits, ProgressPart& part) {
    const auto paths = [&] {  // whose stock is given back before forces are looked at
        LayerPaths begun = begin(tools);
        return begun.clear(&part, limits.ahead) ? begun.finish(&part, limits.ahead) : begun.so_far();
    };
    return with_forces(paths(), limits);
}

Trial LayerTrials::with_forces(LayerResult result, const TrialLimits& limits) {
    const Job& job = ground_.plan.job;
    Trial trial;
    Layer& layer = trial.planned.layer = layer_;
    layer.operations = std::move(result.operations);
    for (Operation& op : layer.operations) limit_feeds(op, job);
    trial.planned.diagnostics = std::move(result.diagnostics);
    if (!result.given_up) trial.left_mm2 = result.left_mm2;
    trial.leaves_more = trial.left_mm2 && result.left_mm2 > limits.left_mm2;
    if (job.cutting.engagement == Engagement::nominal && job.cutting.adapt_feed)
        for (Operation& op : layer.operations)
            slow_down(op,
                      *std::find_if(job.tools.begin(), job.tools.end(),
                                    [&](const Tool& t) { return t.number == op.tool; }),
                      job);
    if (compared_) trial.minutes = minutes_of(layer, job.machine);
    trial.pace = result.pace;
    trial.whole = !result.given_up;
    if (!trial.whole || trial.leaves_more || job.cutting.engagement != Engagement::simulated) return trial;
    const double floors = walls_ ? floor_minutes(layer, job.machine) : 0;
    trial.planned.cuts = adapt_layer(context_, layer, ground_.plan,
                                     {overhang_ ? &*overhang_ : nullptr, walls_ ? &*walls_ : nullptr},
                                     trial.planned.diagnostics, ground_.known_cuts);
    constexpr double kSlowed = 1.1;
    trial.floors_slowed = walls_ && floor_minutes(layer, job.machine) > kSlowed * floors;
    if (compared_ || walls_) trial.minutes = minutes_of(layer, job.machine);
    trial.strained = trial.planned.cuts.strain > kStrained;
    trial.only_walls = trial.strained && trial.planned.cuts.cutter_strain <= kStrained;
    return trial;
}

}  // namespace slabwright
