#include "engine/planner/layer_plan.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <string>

#include <fmt/format.h>

#include "engine/moves/motion_time.h"
#include "engine/paths/paths.h"
#include "engine/planner/layer_trials.h"
#include "engine/tool_choice/foreseen_finish.h"
#include "engine/tool_choice/reach_ratio.h"
#include "engine/tool_choice/select.h"
#include "kernels/mesh/bulk_memory.h"

namespace slabwright {

namespace {

// Shares of a layer's work, where its tools are chosen: of all,
constexpr double kSelectionShare = 0.3;
// of what then remains, where all sets are planned: the sets of the choice, then one with a wider finish
// tool;
constexpr double kFirstSetsShare = 0.5, kWiderFinishShare = 0.25;
// and where the best is foreseen: a ball with all roughing cutters, and of that clearing by each.
constexpr double kRaceShare = 0.9, kClearingShare = 0.55;

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

std::vector<int> tools_in_order(const std::vector<Operation>& operations) {
    std::vector<int> tools;
    for (const Operation& op : operations)
        if (std::find(tools.begin(), tools.end(), op.tool) == tools.end()) tools.push_back(op.tool);
    return tools;
}

class LayerPlanner {
public:
    LayerPlanner(Context& context, const LayerGround& ground, std::size_t index, ProgressPart& progress)
        : context_(context), ground_(ground), trials_(context, ground, index), progress_(progress) {}

    PlannedLayer run() {
        const bool selecting = selects_tools(ground_.plan.job);
        const ToolSelection& how = trials_.job().selection;
        if (!selecting) {
            add("fixed", fixed_tools(trials_.job()));
            try_sets(0, 0, 1);
        } else {
            trials_.compare();
            ToolChoice choice = select_tools(context_, trials_.layer(),
                                             reach_ratio(context_, trials_.layer(), ground_.scene));
            selection_ = std::move(choice.record);
            progress_.reach(kSelectionShare);
            if (!how.compare) {
                add("selected", std::move(choice.tools));
                try_sets(0, kSelectionShare, 1);
            } else if (how.foresee && finish_is_foreseeable(trials_.job())) {
                follow_the_foreseen(choice.tools);
                hold();
            } else {
                plan_all(std::move(choice.tools));
                hold();
            }
            give_reasons();
        }
        best_->planned.layer.selection = std::move(selection_);
        progress_.reach(1);
        return std::move(best_->planned);
    }

private:
    struct NamedSet {
        std::string name;
        LayerTools tools;
        bool tried = false, strained = false;
        ToolSet record{};  // of what was tried
    };

    // To be tried, unless it is among them.
    void add(const char* name, LayerTools tools) {
        if (std::none_of(sets_.begin(), sets_.end(), [&](const NamedSet& s) { return same(s.tools, tools); }))
            sets_.push_back({name, std::move(tools)});
    }

    // Every set whole, unless it falls behind: the fixed one first, so that the others are measured by it.
    void plan_all(LayerTools selected) {
        const double rest = 1 - kSelectionShare;
        const bool may_widen = !selection_->vertical;
        const double finish_at = may_widen ? kSelectionShare + kFirstSetsShare * rest : 1,
                     rough_at = may_widen ? finish_at + kWiderFinishShare * rest : 1;
        add("fixed", fixed_tools(trials_.job()));
        add("selected", std::move(selected));
        try_sets(0, kSelectionShare, finish_at);
        if (!may_widen) return;
        // Of the sets planned so far the best, with a wider finish tool, then with a wider roughing cutter.
        std::size_t first = sets_.size();
        if (std::optional<LayerTools> tools = with_wider_finish(trials_.job(), sets_[chosen_].tools))
            add("wider", std::move(*tools));
        try_sets(first, finish_at, rough_at);
        first = sets_.size();
        add_wider_rough(sets_[chosen_].tools);
        try_sets(first, rough_at, 1);
    }

    void add_wider_rough(const LayerTools& base) {
        for (LayerTools& tools : with_wider_rough(context_, trials_.layer(), base))
            add("wider rough", std::move(tools));
    }

    // The ball that is foreseen to finish first, with the roughing cutters that clear the waste first; where
    // that bears more than it may, the next ball. By what it took other balls are foreseen again, and only
    // one that should take less is tried, too. Where it is thin walls that would break under the first, the
    // set that pushes least is asked next: where they break under that, none is looked for that saves them.
    void follow_the_foreseen(const LayerTools& selected) {
        const ForeseenFinish finish(context_, trials_.layer(), selected.finish);
        for (ToolCandidate& candidate : selection_->candidates)
            if (candidate.purpose == "finish") candidate.minutes = finish.minutes(candidate.tool);
        constexpr std::size_t kRaces = 3;
        double at = kSelectionShare;
        std::vector<int> tried;
        for (const Tool& ball : finish.ranked()) {
            const double to = at + kRaceShare * (1 - at);
            race(ball, selected, at, to);
            at = to;
            tried.push_back(ball.number);
            if (tried.size() == 1 && best_->only_walls) {
                gentlest_ = try_the_gentlest(finish, selected, at);
                if (sets_[*gentlest_].strained) return;
            }
            if (!slow_or_strained() || tried.size() == kRaces) break;
        }
        if (best_->strained) return;
        if (slow_or_strained()) {
            try_sets(0, at, 1);
            return;
        }
        // After one that was not faster, another only where it should be clearly so.
        for (const double share : {1.0, 0.96}) {
            const LayerTools& best = sets_[chosen_].tools;
            const std::optional<Tool> other = finish.better_than(best.finish, best_->pace, share, tried);
            if (!other) break;
            tried.push_back(other->number);
            const std::size_t first = sets_.size();
            add(other->diameter > best.finish.diameter ? "wider" : "narrower", with_finish(best, *other));
            constexpr double kBehind = 1.05;  // what was foreseen to be faster is given up sooner
            const double to = (at + 1) / 2;
            try_sets(first, at, to, kBehind);
            at = to;
        }
    }
    // Whether there is no better one than that which pushes least, or none that holds.
    [[nodiscard]] bool slow_or_strained() const { return best_->strained || chosen_ == gentlest_; }
    // The smallest ball, after the narrowest roughing cutter.
    std::size_t try_the_gentlest(const ForeseenFinish& finish, const LayerTools& selected, double at) {
        const std::vector<Tool> balls = finish.ranked();
        const Tool& ball = *std::min_element(
            balls.begin(), balls.end(), [](const Tool& a, const Tool& b) { return a.diameter < b.diameter; });
        LayerTools tools = with_finish(fixed_tools(trials_.job()), ball);
        if (same(selected.finish, ball) && selected.rough.diameter < tools.rough.diameter) tools = selected;
        add("gentlest", tools);
        std::size_t s = 0;
        while (!same(sets_[s].tools, tools)) ++s;
        ProgressPart none(progress_, at, at);
        if (!sets_[s].tried) try_set(s, none, PaceAhead{}.times);
        return s;
    }
    void race(const Tool& ball, const LayerTools& selected, double from, double to) {
        const LayerTools fixed = fixed_tools(trials_.job()), base = with_finish(fixed, ball);
        const std::size_t first = sets_.size();
        add(same(base, fixed) ? "fixed" : "foreseen", base);
        if (same(selected.finish, base.finish)) add("selected", selected);
        if (!selection_->vertical) add_wider_rough(base);
        finish_the_first(first, from, from + kClearingShare * (to - from), to);
    }
    [[nodiscard]] LayerTools with_finish(LayerTools tools, const Tool& ball) const {
        tools.finish = ball;
        tools.rest = rest_tools(trials_.job(), tools.rough, ball.diameter);
        return tools;
    }

    // All sets from `begin` on clear the waste; what then follows is alike, and only the first to be there
    // goes on. One narrower than all cutters that cleared it leaves less to corners: where these take longer
    // than it was behind it is planned, too.
    void finish_the_first(std::size_t begin, double from, double cleared_at, double to) {
        if (begin == sets_.size()) return;
        // Wide cutters mostly win, and the sooner narrower ones are behind, the less is laid of them.
        std::vector<std::size_t> order(sets_.size() - begin);
        std::iota(order.begin(), order.end(), begin);
        std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
            return std::pair(sets_[a].tools.rough.diameter, a) > std::pair(sets_[b].tools.rough.diameter, b);
        });
        std::optional<LayerPaths> leading;
        std::size_t leader = order.front();
        std::vector<double> cleared(sets_.size(), 0);  // minutes; 0: it fell behind
        const double step = (cleared_at - from) / static_cast<double>(order.size());
        for (std::size_t k = 0; k < order.size(); ++k) {
            const std::size_t s = order[k];
            const double at = from + step * static_cast<double>(k);
            ProgressPart part(progress_, at, at + step);
            std::optional<PaceAhead> ahead;
            if (leading) {
                constexpr double kCornersMayGain = 1.25;  // by a narrower cutter
                const double minutes = cleared[leader];
                const bool narrower = sets_[s].tools.rough.diameter < sets_[leader].tools.rough.diameter;
                ahead = PaceAhead{
                    {minutes, minutes, minutes, minutes}, {1, 1, 1, 1}, narrower ? kCornersMayGain : 1};
            }
            LayerPaths paths = trials_.begin(sets_[s].tools);
            const bool keeps_up = paths.clear(&part, ahead);
            const LayerResult& so_far = paths.so_far();
            sets_[s].record.minutes = so_far.pace[0];
            sets_[s].record.tools = tools_in_order(so_far.operations);
            part.reach(1);
            if (!keeps_up) continue;
            cleared[s] = so_far.pace[0] + kWasteMinutes * paths.waste_mm3();
            if (leading && cleared[s] >= cleared[leader]) continue;
            leading.emplace(std::move(paths));
            leader = s;
        }
        ProgressPart part(progress_, cleared_at, to);
        TrialLimits limits;
        if (best_) limits.left_mm2 = allowed_left_;
        judge(leader, trials_.plan(sets_[leader].tools, limits, part, &*leading));
        leading.reset();
        const double corners = chosen_ == leader && !best_->strained ? corner_minutes() : 0;
        for (std::size_t s = begin; s < sets_.size(); ++s) {
            NamedSet& set = sets_[s];
            if (s == leader) continue;
            // One as wide as the narrowest of these reaches the same corners and only leaves less beside
            // walls: worth a trial where corners take a minute more than it was behind.
            constexpr double kWorthATrial = 1;  // min
            const LayerTools& led = sets_[leader].tools;
            const double gain = set.tools.rough.diameter < narrowest_rough(led) ? corners
                                : set.tools.rough.diameter < led.rough.diameter ? corners - kWorthATrial
                                                                                : 0;
            if (cleared[s] > 0 && cleared[s] - cleared[leader] < gain) {
                ProgressPart none(progress_, to, to);
                try_set(s, none, PaceAhead{}.times);
            } else {
                set.record.reason =
                    cleared[s] > 0
                        ? fmt::format(
                              "given up: clearing, and what then still stands, take it {:.1f} min, "
                              "set {} {:.1f} min",
                              cleared[s], leader + 1, cleared[leader])
                        : fmt::format(
                              "given up: clearing takes it {:.1f} min or more, set {} {:.1f} min "
                              "with what then still stands",
                              set.record.minutes, leader + 1, cleared[leader]);
            }
        }
    }
    // mm, of the cutters that clear waste before the finish tool does.
    static double narrowest_rough(const LayerTools& tools) {
        double narrowest = tools.rough.diameter;
        for (const Tool& semi : tools.semi_rough) narrowest = std::min(narrowest, semi.diameter);
        return narrowest;
    }
    // Of the best set.
    [[nodiscard]] double corner_minutes() const {
        double minutes = 0;
        for (const Operation& op : best_->planned.layer.operations)
            if (op.kind == OperationKind::corner)
                minutes += motion_time(op.moves, ground_.plan.job.machine, op.blend).minutes;
        return minutes;
    }

    // Where what is best bears more than it may, all that was given up is planned whole, and then stiffer
    // tools.
    void hold() {
        if (!best_->strained || (gentlest_ && sets_[*gentlest_].strained)) return;
        add("fixed", fixed_tools(trials_.job()));
        try_sets(0, 1, 1);
        if (!best_->strained) return;
        if (std::optional<LayerTools> stiffer = stiffer_tools(trials_.job(), sets_[chosen_].tools)) {
            const std::size_t first = sets_.size();
            add("stiffer", std::move(*stiffer));
            try_sets(first, 1, 1);
        }
    }

    // Plans the sets from `first` on that were not tried; their share of the progress is [from, to].
    // They are given up where they take `behind` times as long as the best, or longer.
    void try_sets(std::size_t first, double from, double to, double behind = PaceAhead{}.times) {
        const double step = (to - from) / static_cast<double>(std::max<std::size_t>(1, sets_.size() - first));
        for (std::size_t s = first; s < sets_.size(); ++s) {
            if (sets_[s].tried) continue;
            const double at = from + step * static_cast<double>(s - first);
            ProgressPart part(progress_, at, at + step);
            try_set(s, part, behind);
            part.reach(1);
        }
    }

    // Where the best set so far is too far ahead, and holds, the paths are not followed any further.
    void try_set(std::size_t s, ProgressPart& part, double behind) {
        TrialLimits limits;
        if (best_) limits.left_mm2 = allowed_left_;
        if (best_ && !best_->strained) {
            limits.ahead = ahead_of(sets_[s].tools, sets_[chosen_].tools, best_->pace);
            limits.ahead->times = std::min(limits.ahead->times, behind);
        }
        judge(s, trials_.plan(sets_[s].tools, limits, part));
    }

    // Keeps the trial of set s where it is the best so far.
    void judge(std::size_t s, Trial trial) {
        NamedSet& tried = sets_[s];
        ToolSet& set = tried.record;
        tried.tried = true;
        tried.strained = trial.strained;
        set.tools = tools_in_order(trial.planned.layer.operations);
        set.minutes = trial.minutes;
        set.left_mm2 = trial.left_mm2;
        if (!best_) allowed_left_ = kMoreLeft * trial.left_mm2.value_or(0) + kFewLeft, first_ = s;
        if (!trial.left_mm2)
            set.reason = fmt::format("given up: {:.1f} min of it are too far behind the set of {:.1f} min",
                                     trial.minutes, best_->minutes);
        else if (trial.leaves_more)
            set.reason = fmt::format("leaves {:.1f} mm² over the limit, the first set {:.1f} mm²",
                                     *trial.left_mm2, sets_[first_].record.left_mm2.value_or(0));
        else if (trial.strained)
            set.reason = fmt::format("cutter, spindle or a thin wall would bear {:.2f} times what they may",
                                     trial.planned.cuts.strain);
        // What holds is better than what is fast.
        if (!best_ || (trial.whole && !trial.leaves_more &&
                       std::pair(trial.strained, trial.minutes) < std::pair(best_->strained, best_->minutes)))
            best_ = std::move(trial), chosen_ = s;
    }

    void give_reasons() {
        const double least = sets_[chosen_].record.minutes;
        bool faster = false;  // one that does not hold
        for (const NamedSet& set : sets_) faster |= set.strained && set.record.minutes < least;
        for (NamedSet& set : sets_) {
            ToolSet& record = selection_->sets.emplace_back(std::move(set.record));
            record.name = std::move(set.name);
            record.chosen = &set == &sets_[chosen_];
            if (record.chosen)
                record.reason =
                    sets_.size() == 1 ? "not compared"
                    : faster ? "takes the least time of those that leave no more and bear what they must"
                             : "takes the least time of those that leave no more";
            else if (record.reason.empty())
                record.reason = fmt::format("takes {:.1f} min longer", record.minutes - least);
        }
        const std::vector<int>& cut_with = selection_->sets[chosen_].tools;
        for (ToolCandidate& candidate : selection_->candidates)
            if (candidate.chosen &&
                std::find(cut_with.begin(), cut_with.end(), candidate.tool) == cut_with.end())
                candidate.reason += "; the set that cuts the layer does without it";
    }

    Context& context_;
    const LayerGround& ground_;
    LayerTrials trials_;
    ProgressPart& progress_;
    std::vector<NamedSet> sets_;
    std::optional<LayerSelection> selection_;
    std::optional<Trial> best_;
    std::size_t chosen_ = 0, first_ = 0;   // of the sets: the best; the first that was planned whole
    std::optional<std::size_t> gentlest_;  // where thin walls asked for it
    double allowed_left_ = 0;              // mm²
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
    const KeptMemory kept;  // one set of tools leaves it to the next
    return LayerPlanner(context, ground, index, progress).run();
}

}  // namespace slabwright
