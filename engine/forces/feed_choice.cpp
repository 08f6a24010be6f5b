#include "engine/forces/feed_choice.h"

#include <cmath>
#include <functional>
#include <iterator>
#include <memory>

#include "engine/forces/feeds.h"

namespace slabwright {

namespace {

constexpr double kClassSlack =
    0.9;  // a coarse class that bears less than this share of a limit stands for all its cuts
constexpr double kLost = 2;                   // of what a wall bears, that the least of forces may be
constexpr double kHolds = 1 - kBentAccuracy;  // of a limit, when the peaks are as rough as that

}  // namespace

WallPush wall_push(const SeenStretch& s, const Operation& op, const Tool& tool) {
    return {s.at[0], s.at[1], s.at[2] + s.low, s.at[2] + s.depth, tool.diameter / 2, op.kind};
}

FeedChoice::FeedChoice(Context& context, const Job& job, const Operation& op, const Tool& tool,
                       SharedBents* shared, bool never_faster)
    : context_(context),
      job_(job),
      op_(op),
      tool_(tool),
      cutting_(job, op, tool, shared),
      limit_(bending_limit(op, job)),
      never_faster_(never_faster),
      fastest_(static_cast<std::uint32_t>(std::floor(std::min(tool.max_feed, job.machine.max_feed)))) {}

double FeedChoice::wood_load(const SeenStretch& s, const Bent& bent) const {
    return s.overhang > 0 ? cutting_.needed_wood(bent, s.height, s.overhang) / s.wood : 0;
}

CutLoad FeedChoice::load(const SeenStretch& s, int passes) {
    if (passes == 1)
        return {s.stated > 0 ? s.stated : share(*s.bent), s.saved_wall_load(*s.bent), s.wood_load};
    SeenStretch lowest = s;
    const float off = s.depth * static_cast<float>(passes - 1) / static_cast<float>(passes);
    lowest.coarse = shallower(s.coarse, passes, kCoarse);
    lowest.wood -= off;
    lowest.height = std::max(0.F, lowest.height - off / 2);
    return load_of(lowest, cutting_.at(lowest.coarse, s.feed));
}

double FeedChoice::pace(const SeenStretch& s, int passes, const WallMap* walls) {
    if (passes == 1 || !s.cuts) return passes * 60.0 / s.feed;
    const float depth = s.depth / static_cast<float>(passes);
    double sum = 0;
    for (int k = 0; k < passes; ++k) {
        SeenStretch pass = s;
        pass.coarse = shallower(s.coarse, passes, kCoarse);
        pass.fine = shallower(s.fine, passes, kFine);
        pass.at[2] += static_cast<float>(k) * depth;
        pass.low = 0;
        pass.depth = depth;
        pass.wood -= static_cast<float>(passes - 1 - k) * depth;
        if (s.wall_n > 0)
            if (const WallBears bears = walls->bears(wall_push(pass, op_, tool_)); bears.foot)
                pass.wall_n = static_cast<float>(bears.force_n);
        choose(pass);
        sum += 60.0 / pass.feed;
    }
    return sum;
}

void FeedChoice::choose(SeenStretch& s) {
    const std::uint32_t planned = op_.moves[s.last].feed;
    if (!s.cuts) {
        s.feed = job_.cutting.adapt_feed ? most_of(planned) : planned;
        return;
    }
    if (!job_.cutting.adapt_feed) {
        s.feed = planned;
        s.bent = &cutting_.at(s.coarse, planned);
    } else {
        ClassFeeds& of = feeds_of(s, planned);
        s.wall_lost = wall_is_lost(s, of.steps.back().feed);
        const bool by_class = !(s.overhang > 0) && !(s.wall_n > 0 && !s.wall_lost);
        FeedStep* step = by_class ? of.chosen : nullptr;
        if (step == nullptr) step = slow_enough(s, of.steps);
        if (by_class) of.chosen = step;
        step = as_stated(s, of.steps, step);
        s.feed = step->feed;
        s.bent = &bent_at(s, *step);
    }
    // Where feed alone does not settle it.
    if (share(*s.bent) > kClassSlack) s.stated = stated_share(s, s.feed) / kHolds;
    s.wood_load = wood_load(s, *s.bent);
}

CutLoad FeedChoice::load_of(const SeenStretch& s, const Bent& bent) {
    if (++looked_at_ % 128 == 0) context_.throw_if_cancelled();
    return {share(bent), s.saved_wall_load(bent), wood_load(s, bent)};
}

// As the plan will state it.
double FeedChoice::stated_share(const SeenStretch& s, double feed) {
    return share(cutting_.stated(s.fine, feed));
}

// Entries on ramps and helices go at the plunge's feed, whether they meet wood yet or not.
std::uint32_t FeedChoice::most_of(std::uint32_t planned) const {
    return never_faster_ || planned <= tool_.plunge_feed ? planned : fastest_;
}

FeedChoice::ClassFeeds& FeedChoice::feeds_of(const SeenStretch& s, std::uint32_t planned) {
    const ClassAndFeed key{s.coarse, static_cast<double>(planned)};
    if (last_ != nullptr && key == last_key_) return *last_;
    const auto [it, fresh] = known_.try_emplace(key);
    if (fresh) {
        const double chip = std::min<double>(
            most_of(planned), std::max<double>(planned, planned / cutting_.thickest_chip(s.coarse)));
        std::vector<FeedStep>& steps = it->second.steps;
        // What is planned is a step too, so that a cut that needs no other feed keeps its own.
        steps.push_back({planned, nullptr});
        for (int k = 1; k <= kFeedSteps; ++k)
            steps.push_back({fastest_ * static_cast<std::uint32_t>(k) / kFeedSteps, nullptr});
        std::erase_if(steps, [&](const FeedStep& f) {
            return f.feed > chip || f.feed < 1 || f.feed < kLeastFeedShare * planned;
        });
        if (steps.empty()) steps.push_back({planned, nullptr});
        std::sort(steps.begin(), steps.end(),
                  [](const FeedStep& x, const FeedStep& y) { return x.feed > y.feed; });
    }
    last_key_ = key;
    last_ = &it->second;
    return *last_;
}
const Bent& FeedChoice::bent_at(const SeenStretch& s, FeedStep& step) {
    if (step.bent == nullptr) step.bent = &cutting_.at(s.coarse, step.feed);
    return *step.bent;
}
// What breaks even at the least feed and in many passes is not worth their time.
bool FeedChoice::wall_is_lost(const SeenStretch& s, double least_feed) {
    if (!(s.wall_n > 0)) return false;
    const int passes = job_.cutting.adapt_stepdown ? kMostPasses : 1;
    return s.wall_load(cutting_.at(shallower(s.coarse, passes, kCoarse), least_feed)) > kLost;
}
/// The fastest step that all limits bear. Where none does: the slowest that is allowed, when it is the
/// cutter that bears too much; the fastest that the cutter bears, when it is the wood.
FeedChoice::FeedStep* FeedChoice::slow_enough(const SeenStretch& s, std::vector<FeedStep>& steps) {
    FeedStep* for_cutter = nullptr;
    for (FeedStep& step : steps) {
        const CutLoad l = load_of(s, bent_at(s, step));
        if (l.worst() <= 1) return &step;
        if (l.side() <= 1 && for_cutter == nullptr) for_cutter = &step;
    }
    return for_cutter != nullptr ? for_cutter : &steps.back();
}
/// A coarse class may bear a little less than a cut of it does, and more than any: near the limit and
/// beyond it, what the plan will state decides.
FeedChoice::FeedStep* FeedChoice::as_stated(const SeenStretch& s, std::vector<FeedStep>& steps,
                                            FeedStep* step) {
    const double bears = share(bent_at(s, *step));
    if (bears < kClassSlack) return step;
    const auto holds = [&](const FeedStep& f) { return stated_share(s, f.feed) <= kHolds; };
    if (bears > 1)
        return std::to_address(std::partition_point(steps.begin(), std::prev(steps.end()),
                                                    [&](const FeedStep& f) { return !holds(f); }));
    while (!holds(*step) && step != &steps.back()) ++step;
    return step;
}

}  // namespace slabwright
