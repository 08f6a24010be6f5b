#include "engine/forces/deep_runs.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "engine/tools/tools.h"

namespace slabwright {

namespace {

constexpr int kMostForTime = 16;        // passes, where that is faster than a lower feed
constexpr double kThinnerShell = 0.35;  // of a ball's lowest pass, from round to round
constexpr double kSide = 0.75;          // of the diameter: higher, a ball cuts with its side
constexpr double kLeastPass = 0.25;     // mm that a pass for the sake of time takes
constexpr double kWorthIt = 0.9;        // of the time at a lower feed, that passes may take
constexpr double kPassSeconds = 0.4;    // of stops and ways down to one more pass

// What a run is made of before it is known in how many passes it goes.
struct Wish {
    DeepRun run;
    double hardest = 0;  // of its stretches
};

// Of one operation and one round.
class Divider {
public:
    Divider(const std::vector<SeenStretch>& seen, const Operation& op, const Tool& tool, int round,
            const PassQuestions& ask)
        : seen_(seen),
          op_(op),
          tool_(tool),
          round_(round),
          ask_(ask),
          ball_(has_ball_tip(tool.kind)),
          for_time_(!ball_ && round == 0) {}

    [[nodiscard]] std::vector<DeepRun> runs() {
        // Wood that no passes save, as over a wide cavity, is not worth their time: neither where it breaks
        // nor, on levels above, where it will.
        for (const SeenStretch& s : seen_)
            if (s.overhang > 0 && ask_.load(s, 1).wood > 1 && passes_for_wood(s, 2) == 0)
                lost_.insert(column(s));
        std::vector<Wish> wishes;
        for (const SeenStretch& s : seen_) take(s, wishes);
        std::vector<DeepRun> result;
        std::size_t next = 0;
        for (Wish& wish : wishes) {
            if (!goes_by_feed(wish.run)) continue;
            if (for_time_) wish.run.passes = fastest(wish.run, next);
            if (wish.run.passes > 1) result.push_back(wish.run);
        }
        return result;
    }

private:
    using Column = std::pair<int, int>;

    [[nodiscard]] Column column(const SeenStretch& s) const {
        return {static_cast<int>(std::floor(s.at[0] / tool_.diameter)),
                static_cast<int>(std::floor(s.at[1] / tool_.diameter))};
    }

    // In how many passes the wood holds, from `least` on; 0 where it holds in none.
    [[nodiscard]] int passes_for_wood(const SeenStretch& s, int least) const {
        if (s.depth >= 4 * kLeastDepth)
            for (int n = std::max(2, least); n <= kMostPasses; ++n)
                if (ask_.load(s, n).wood <= 1) return n;
        return 0;
    }

    // What a ball cuts with its side is divided by height. Below that a raised pass leaves a shell as thick
    // as it is raised, which has thinner chips; what is too much still gets a thinner one.
    [[nodiscard]] bool shell(const SeenStretch& s) const {
        return ball_ && (s.depth < kSide * tool_.diameter || round_ > 1);
    }

    // That a stretch must have; 0: none.
    [[nodiscard]] int needed(const SeenStretch& s, const CutLoad& whole) const {
        int passes = 0;
        if (whole.side() > 1)
            passes = std::clamp(static_cast<int>(std::ceil(whole.side())) + (ball_ && !shell(s) ? 0 : round_),
                                2, kMostPasses);
        if (whole.wood > 1 && !lost_.contains(column(s)))
            passes = std::max(passes, passes_for_wood(s, passes));
        return passes;
    }

    [[nodiscard]] bool faster_in_passes(const SeenStretch& s) const {
        if (!for_time_ || s.feed >= op_.moves[s.last].feed) return false;
        const double whole = kWorthIt * ask_.pace(s, 1);
        for (int n = 2; n <= kMostForTime && s.depth >= n * kLeastPass; ++n)
            if (ask_.pace(s, n) < whole) return true;
        return false;
    }

    void take(const SeenStretch& s, std::vector<Wish>& wishes) const {
        if (!s.cuts || s.depth < 4 * kLeastDepth) return;
        const CutLoad whole = ask_.load(s, 1);
        int passes = needed(s, whole);
        if (passes == 0) {
            if (!faster_in_passes(s)) return;
            passes = 1;
        }
        const double thick = s.depth - s.low, depth = shell(s)
                                                          ? s.low + thick * std::pow(kThinnerShell, round_)
                                                      : ball_ ? thick
                                                              : s.depth;
        const PassShares shares = shell(s) ? PassShares::growing : PassShares::equal;
        if (wishes.empty() || s.first > wishes.back().run.last + 1) {
            wishes.push_back({{s.first, s.last, depth, passes, shares}, whole.side()});
            return;
        }
        auto& [run, hardest] = wishes.back();
        run.last = std::max(run.last, s.last);
        run.passes = std::max(run.passes, passes);
        // The hardest cut of a run says how it is divided.
        if (run.shares == shares) run.depth_mm = std::max(run.depth_mm, depth);
        else if (whole.side() > hardest) run.depth_mm = depth, run.shares = shares;
        hardest = std::max(hardest, whole.side());
    }

    // A run goes by feed and in the plane from end to end.
    [[nodiscard]] bool goes_by_feed(const DeepRun& run) const {
        for (std::uint32_t k = run.first; k <= run.last; ++k)
            if (k == 0 || op_.moves[k].feed == 0) return false;
        return true;
    }

    // In how many passes a run is done soonest, of those that it may have.
    // @param next stretches before it are of earlier runs
    [[nodiscard]] int fastest(const DeepRun& run, std::size_t& next) const {
        while (next < seen_.size() && seen_[next].last < run.first) ++next;
        const std::size_t begin = next;
        while (next < seen_.size() && seen_[next].first <= run.last) ++next;
        const Move &start = op_.moves[run.first - 1], &end = op_.moves[run.last];
        const bool closed = start.x == end.x && start.y == end.y && start.z == end.z,
                   by_turns = core_diameter_of(tool_) <= 0;
        int best = run.passes;
        double least = kUnbounded;
        for (int n = run.passes; n <= std::max(run.passes, kMostForTime); ++n) {
            if (n > run.passes && run.depth_mm < n * kLeastPass) break;
            const int back = closed ? 0 : by_turns ? (n + 1) % 2 : n - 1;
            double seconds = (n - 1) * kPassSeconds;
            for (std::size_t k = begin; k < next; ++k) {
                const SeenStretch& s = seen_[k];
                seconds += s.length * (ask_.pace(s, n) + back * 60.0 / op_.moves[s.last].feed);
            }
            if (n == 1) seconds *= kWorthIt;
            if (seconds < least) least = seconds, best = n;
        }
        return best;
    }

    const std::vector<SeenStretch>& seen_;
    const Operation& op_;
    const Tool& tool_;
    const int round_;
    const PassQuestions& ask_;
    const bool ball_, for_time_;
    std::set<Column> lost_;
};

}  // namespace

std::vector<DeepRun> deep_runs(const std::vector<SeenStretch>& seen, const Operation& op, const Tool& tool,
                               int round, const PassQuestions& ask) {
    return Divider(seen, op, tool, round, ask).runs();
}

}  // namespace slabwright
