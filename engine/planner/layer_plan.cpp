#include "engine/planner/layer_plan.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include <fmt/format.h>

#include "engine/forces/min_material.h"
#include "engine/forces/op_forces.h"
#include "engine/moves/motion_time.h"
#include "engine/paths/paths.h"
#include "engine/schedule/standing_walls.h"
#include "engine/tool_choice/reach_ratio.h"
#include "engine/tool_choice/select.h"
#include "kernels/mesh/part.h"

namespace slabwright {

namespace {

constexpr double kSelectionShare = 0.3;  // of a layer's work, where its tools are chosen
constexpr double kStrained = 1.03;       // of a limit: within that, what a plan states may hold
constexpr double kFirstSetsShare =
    0.5;  // of what then remains, the sets of the choice; those that they lead to take the rest,
constexpr double kWiderFinishShare = 0.25;  // a wider finish tool this

// None may leave more than the first set, but for what differently fine cells see.
constexpr double kMore = 1.1, kFew = 5;  // mm²

bool same(const Tool& a, const Tool& b) {
    return a.number == b.number && a.stepdown_min == b.stepdown_min && a.stepdown_max == b.stepdown_max;
}
bool same(const std::vector<Tool>& a, const std::vector<Tool>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](const Tool& t, const Tool& u) { return same(t, u); });
}
// Of the job's tools.
bool same(const LayerTools& a, const LayerTools& b) {
    return same(a.rough, b.rough) && same(a.finish, b.finish) && same(a.semi_rough, b.semi_rough) &&
           same(a.rest, b.rest);
}

// A wider ball finishes in less than the tools ahead, and leaves more to the corners; a narrower roughing
// cutter leaves less to all that follow. After a wider one the same tools have as much to do, or more.
PaceAhead ahead_of(const LayerTools& tools, const LayerTools& best, const LayerPace& pace) {
    if (tools.rough.diameter < best.rough.diameter) return {pace, {0.2, 0.3, 0.5, 1}};
    if (same(tools.finish, best.finish)) return {pace, {1, 1, 1, 1}, 1.01};
    return {pace, {0.5, 0.6, 0.9, 1}};
}

// A layer as one set of tools makes it, with the forces of its programs and the feeds that they allow.
struct Trial {
    PlannedLayer planned;
    double minutes = 0;  // of its programs and the changes of tool between them, where it is asked for
    LayerPace pace{};    // where it is asked for
    bool floors_slowed = false;      // what thin walls bear made its floors take notably longer
    std::optional<double> left_mm2;  // none: given up before all its paths were planned
    bool leaves_more = false;        // than the first set
    bool whole = true;               // false: given up, its feeds were not adapted
    bool strained = false;           // cutter, spindle or a thin wall bear more than they may
};

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

std::vector<int> tools_in_order(const Layer& layer) {
    std::vector<int> tools;
    for (const Operation& op : layer.operations)
        if (std::find(tools.begin(), tools.end(), op.tool) == tools.end()) tools.push_back(op.tool);
    return tools;
}

class LayerPlanner {
public:
    LayerPlanner(Context& context, const LayerGround& ground, std::size_t index, ProgressPart& progress)
        : context_(context),
          ground_(ground),
          layer_(ground.plan.layers[index]),
          fitted_(with_tools_for(ground.plan.job, layer_.z_top - layer_.z_bottom)),
          overrun_(overrun_of(ground.plan.job)),
          progress_(progress) {
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

    PlannedLayer run() {
        const bool selecting = selects_tools(ground_.plan.job), compare = fitted_.selection.compare;
        // First, so that the others are measured by it.
        if (!selecting || compare) add("fixed", fixed_tools(fitted_));
        if (selecting) choose();
        const bool may_widen = selecting && compare && !selection_->vertical;
        const double chosen_at = selecting ? kSelectionShare : 0, rest = 1 - chosen_at,
                     finish_at = may_widen ? chosen_at + kFirstSetsShare * rest : 1,
                     rough_at = may_widen ? finish_at + kWiderFinishShare * rest : 1;
        progress_.reach(chosen_at);
        try_sets(0, chosen_at, finish_at);
        if (may_widen) {
            // Of the sets planned so far the best, with a wider finish tool, then with a wider roughing
            // cutter.
            std::size_t first = sets_.size();
            if (std::optional<LayerTools> tools = with_wider_finish(fitted_, sets_[chosen_].tools))
                add("wider", std::move(*tools));
            try_sets(first, finish_at, rough_at);
            first = sets_.size();
            for (LayerTools& tools : with_wider_rough(context_, work_, sets_[chosen_].tools))
                add("wider rough", std::move(tools));
            try_sets(first, rough_at, 1);
        }
        if (selecting && compare && best_->strained)
            if (std::optional<LayerTools> stiffer = stiffer_tools(fitted_, sets_[chosen_].tools)) {
                const std::size_t first = sets_.size();
                add("stiffer", std::move(*stiffer));
                try_sets(first, 1, 1);
            }
        if (selection_) give_reasons();
        best_->planned.layer.selection = std::move(selection_);
        progress_.reach(1);
        return std::move(best_->planned);
    }

private:
    struct NamedSet {
        std::string name;
        LayerTools tools;
    };

    // To be tried, unless it is among them.
    void add(const char* name, LayerTools tools) {
        if (std::none_of(sets_.begin(), sets_.end(), [&](const NamedSet& s) { return same(s.tools, tools); }))
            sets_.push_back({name, std::move(tools)});
    }

    // Flats between z and the layer's top.
    [[nodiscard]] std::vector<Flat> flats_between(double z) const {
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

    void choose() {
        ToolChoice choice = select_tools(context_, work_, reach_ratio(context_, work_, ground_.scene));
        add("selected", std::move(choice.tools));
        selection_ = std::move(choice.record);
    }

    // Plans the sets from `first` on; their share of the progress is [from, to].
    void try_sets(std::size_t first, double from, double to) {
        const double step = (to - from) / static_cast<double>(std::max<std::size_t>(1, sets_.size() - first));
        for (std::size_t s = first; s < sets_.size(); ++s) {
            const double at = from + step * static_cast<double>(s - first);
            ProgressPart part(progress_, at, at + step);
            judge(s, plan_with(sets_[s].tools, part));
            part.reach(1);
        }
    }

    // A floor's cutter takes what roughing has left on the walls beside it at once, up to their tops: for all
    // walls that bear it the quickest. Where thin ones do not, and its feed falls or it goes in several
    // passes, the walls are tried first: level by level, around them and so from both sides, and nothing of
    // them is left to the floors.
    Trial plan_with(const LayerTools& tools, ProgressPart& part) {
        Trial trial = plan_once(tools, part);
        if (!walls_ || !trial.floors_slowed) return trial;
        work_.walls_first = true;
        Trial other = plan_once(tools, part);
        work_.walls_first = false;
        if (!other.whole || other.leaves_more ||
            (other.left_mm2 && trial.left_mm2 && *other.left_mm2 > kMore * *trial.left_mm2 + kFew))
            return trial;
        return std::pair(other.strained, other.minutes) < std::pair(trial.strained, trial.minutes) ? other
                                                                                                   : trial;
    }

    // Where the best set so far is too far ahead, and holds, the paths are not followed any further.
    Trial plan_once(const LayerTools& tools, ProgressPart& part) {
        const Job& job = ground_.plan.job;
        work_.tools = tools;
        work_.progress = &part;
        const double below = tools.finish.diameter / 2;
        const double board =
            job.machine.base_board_cut >= 0 ? overrun_.board : std::min(below, overrun_.board);
        work_.floor_below = layer_.z_bottom - (ground_.carried_by ? below : board);
        work_.feet = flats_between(work_.floor_below);
        const bool compared = selection_ || sets_.size() > 1;  // else nobody asks for its time
        work_.paced = compared;
        work_.ahead.reset();
        if (best_ && !best_->strained) work_.ahead = ahead_of(tools, sets_[chosen_].tools, best_->pace);
        work_.last_steps =
            overhang_ ? last_rough_steps(job, tools.rough, overhang_->largest() + job.bonding.edge_setback,
                                         layer_.z_top - layer_.z_bottom)
                      : 0;
        LayerResult result = plan_layer_paths(context_, work_);
        Trial trial;
        Layer& layer = trial.planned.layer = layer_;
        layer.operations = std::move(result.operations);
        for (Operation& op : layer.operations) limit_feeds(op, job);
        trial.planned.diagnostics = std::move(result.diagnostics);
        if (!best_) allowed_left_ = kMore * result.left_mm2 + kFew;
        if (!result.given_up) trial.left_mm2 = result.left_mm2;
        trial.leaves_more = best_ && !result.given_up && result.left_mm2 > allowed_left_;
        if (job.cutting.engagement == Engagement::nominal && job.cutting.adapt_feed)
            for (Operation& op : layer.operations)
                slow_down(op,
                          *std::find_if(job.tools.begin(), job.tools.end(),
                                        [&](const Tool& t) { return t.number == op.tool; }),
                          job);
        if (compared) trial.minutes = minutes_of(layer, job.machine);
        trial.pace = result.pace;
        trial.whole = !result.given_up;
        if (!trial.whole || trial.leaves_more || job.cutting.engagement != Engagement::simulated)
            return trial;
        const double floors = walls_ ? floor_minutes(layer, job.machine) : 0;
        trial.planned.cuts = adapt_layer(context_, layer, ground_.plan,
                                         {overhang_ ? &*overhang_ : nullptr, walls_ ? &*walls_ : nullptr},
                                         trial.planned.diagnostics, ground_.known_cuts);
        constexpr double kSlowed = 1.1;
        trial.floors_slowed = walls_ && floor_minutes(layer, job.machine) > kSlowed * floors;
        if (compared || walls_) trial.minutes = minutes_of(layer, job.machine);
        trial.strained = trial.planned.cuts.strain > kStrained;
        return trial;
    }

    // Keeps the trial of set s where it is the best so far.
    void judge(std::size_t s, Trial trial) {
        if (selection_) {
            ToolSet& set = selection_->sets.emplace_back(ToolSet{sets_[s].name,
                                                                 tools_in_order(trial.planned.layer),
                                                                 trial.minutes,
                                                                 trial.left_mm2,
                                                                 false,
                                                                 {}});
            if (!trial.left_mm2)
                set.reason =
                    fmt::format("given up: {:.1f} min of it are too far behind the set of {:.1f} min",
                                trial.minutes, best_->minutes);
            else if (trial.leaves_more)
                set.reason = fmt::format("leaves {:.1f} mm² over the limit, the first set {:.1f} mm²",
                                         *trial.left_mm2, selection_->sets[0].left_mm2.value_or(0));
            else if (trial.strained)
                set.reason =
                    fmt::format("cutter, spindle or a thin wall would bear {:.2f} times what they may",
                                trial.planned.cuts.strain);
        }
        strained_.push_back(trial.strained);
        // What holds is better than what is fast.
        if (!best_ || (trial.whole && !trial.leaves_more &&
                       std::pair(trial.strained, trial.minutes) < std::pair(best_->strained, best_->minutes)))
            best_ = std::move(trial), chosen_ = s;
    }

    void give_reasons() {
        ToolSet& chosen = selection_->sets[chosen_];
        chosen.chosen = true;
        bool faster = false;  // one that does not hold
        for (std::size_t s = 0; s < strained_.size(); ++s)
            faster |= strained_[s] && s != chosen_ && selection_->sets[s].minutes < chosen.minutes;
        chosen.reason = sets_.size() == 1 ? "not compared"
                        : faster ? "takes the least time of those that leave no more and bear what they must"
                                 : "takes the least time of those that leave no more";
        for (ToolSet& set : selection_->sets)
            if (set.reason.empty())
                set.reason = fmt::format("takes {:.1f} min longer", set.minutes - chosen.minutes);
    }

    Context& context_;
    const LayerGround& ground_;
    const Layer& layer_;
    Job fitted_;  // a layer may be taller than the shortest tools make; the others make it then
    const Overrun overrun_;
    ProgressPart& progress_;
    Mesh near_;  // what of the ground the layer's cutters may meet
    LayerJob work_;
    std::optional<OverhangMap> overhang_;
    std::optional<WallMap> walls_;
    std::vector<NamedSet> sets_;
    std::optional<LayerSelection> selection_;
    std::vector<bool> strained_;  // of the sets that were tried
    std::optional<Trial> best_;
    std::size_t chosen_ = 0;
    double allowed_left_ = 0;  // mm²
};

}  // namespace

void limit_feeds(Operation& op, const Job& job) {
    const auto tool =
        std::find_if(job.tools.begin(), job.tools.end(), [&](const Tool& t) { return t.number == op.tool; });
    const double most =
        tool == job.tools.end() ? job.machine.max_feed : std::min(tool->max_feed, job.machine.max_feed);
    const auto fastest = static_cast<std::uint32_t>(std::max(1.0, std::floor(most)));
    for (Move& move : op.moves) move.feed = std::min(move.feed, fastest);
}

PlannedLayer plan_layer(Context& context, const LayerGround& ground, std::size_t index,
                        ProgressPart& progress) {
    return LayerPlanner(context, ground, index, progress).run();
}

}  // namespace slabwright
