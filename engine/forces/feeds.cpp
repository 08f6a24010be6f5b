#include "engine/forces/feeds.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <memory>
#include <optional>
#include <set>
#include <unordered_set>
#include <utility>

#include <fmt/format.h>

#include "engine/forces/bent_cutter.h"
#include "engine/forces/cut_class.h"
#include "engine/forces/cuts.h"
#include "engine/forces/split_cuts.h"
#include "engine/tools/tools.h"
#include "kernels/errors.h"
#include "kernels/parallel/scratch_pool.h"

namespace slabwright {

namespace {

constexpr double kAccuracy = 0.01;  // of the peaks that feeds are chosen by (BentCutter::at)
constexpr double kClassSlack =
    0.9;  // a coarse class that bears less than this share of a limit stands for all its cuts
constexpr double kHolds = 1 - kAccuracy;  // of a limit, when the peaks are as rough as that
constexpr double kLeastRun = 20;          // mm that a faster feed must last
constexpr int kMostPasses = 4;            // into which a cut is divided at once
constexpr int kMostRounds = 6;            // of dividing
constexpr double kMostAdded = 2;          // of an operation's way, that rounds after the first may add
constexpr double kAlwaysAdded = 3000;     // mm that they may add in any case
constexpr double kThinnerShell = 0.35;    // of a ball's lowest pass, from round to round

/// A feed that a class of cuts may have, with what it bears there once that was asked.
struct FeedStep {
    std::uint32_t feed = 0;
    const Bent* bent = nullptr;
};

/// A stretch of an operation's way, as far as its feed and its forces depend on it.
struct Seen {
    CutClass coarse, fine;
    std::uint32_t first = 0, last = 0;
    bool cuts = false;
    float depth = 0;   ///< over the tip, mm
    float height = 0;  ///< of the cut's middle above the joint, mm
    float wood = 0,
          overhang =
              0;  ///< what carries the cut, and how far from what carries it; 0 where nothing hangs over
    std::array<float, 3> at{};
    std::uint32_t feed = 0;  ///< that was chosen for it; 0: none yet
    const Bent* bent =
        nullptr;           ///< what it bears at that feed, of its coarse class; null where nothing is cut
    double wood_load = 0;  ///< and the wood, as a share of what there is
    double stated = 0;     ///< the cutter's load as a plan states it, where feed alone does not settle it
    [[nodiscard]] std::array<double, 3> place() const { return {at[0], at[1], at[2]}; }
};

/// What a layer's stretches are kept in while they are looked at, of any content.
struct SeenMemory {
    std::vector<Seen> seen, anew, all;
};

}  // namespace

struct KnownCuts::Impl {
    SharedBents bents;
    ScratchPool<SeenMemory> memory;  // which layers leave to each other: to fill it is little against what
                                     // new memory of that size costs
};

KnownCuts::KnownCuts() : impl_(std::make_unique<Impl>()) {}
KnownCuts::~KnownCuts() = default;

namespace {

bool roughs(OperationKind kind) { return kind == OperationKind::rough || kind == OperationKind::face; }

/// Gives the moves of `level` the feeds that are wanted, faster ones only where they last.
void set_feeds(Context& context, Operation& op, std::vector<std::uint32_t> wanted,
               const std::vector<char>& level) {
    const std::size_t n = op.moves.size();
    std::vector<double> way(n, 0);  // up to and with each move
    for (std::size_t k = 1; k < n; ++k) {
        const Move &a = op.moves[k - 1], &b = op.moves[k];
        way[k] = way[k - 1] + (b.is_arc() ? arc_shape(a, b).length()
                                          : std::hypot(to_mm(b.x - a.x), to_mm(b.y - a.y), to_mm(b.z - a.z)));
    }
    std::vector<std::uint32_t> steps;
    for (std::size_t k = 1; k < n; ++k)
        if (level[k]) steps.push_back(wanted[k]);
    std::sort(steps.begin(), steps.end(), std::greater<>());
    steps.erase(std::unique(steps.begin(), steps.end()), steps.end());
    // From the fastest step down: a stretch at least that fast that is too short goes as fast as its faster
    // neighbour, which is slower. Where it has none, between rapids, it goes no faster than planned.
    for (const std::uint32_t step : steps) {
        context.throw_if_cancelled();
        for (std::size_t k = 1; k < n;) {
            if (!level[k] || wanted[k] < step) {
                ++k;
                continue;
            }
            std::size_t end = k;
            while (end < n && level[end] && wanted[end] >= step) ++end;
            if (way[end - 1] - way[k - 1] < kLeastRun) {
                std::uint32_t beside = 0;
                if (k > 1 && level[k - 1]) beside = wanted[k - 1];
                if (end < n && level[end]) beside = std::max(beside, wanted[end]);
                for (std::size_t m = k; m < end; ++m)
                    wanted[m] = beside > 0 ? beside : std::min(wanted[m], op.moves[m].feed);
            }
            k = end;
        }
    }
    for (std::size_t k = 1; k < n; ++k)
        if (level[k]) op.moves[k].feed = wanted[k];
}

/// @param seen  gets all stretches
/// @param parts only these moves; none: all
void run_through(Context& context, StandingSlab& slab, const Operation& op, const Tool& tool,
                 const Layer& layer, const OverhangMap* overhang, double setback, std::vector<Seen>& seen,
                 std::span<const MoveRange> parts = {}) {
    seen.clear();
    const auto see = [&](const CutStretch& s) {
        if (seen.size() % 1024 == 0) context.throw_if_cancelled();
        Seen now;
        now.first = s.first;
        now.last = s.last;
        now.cuts = s.cuts();
        for (std::size_t i = 0; i < 3; ++i) now.at[i] = static_cast<float>(s.at[i]);
        if (now.cuts) {
            now.coarse = class_of(s, tool, kCoarse);
            now.fine = class_of(s, tool, kFine);
            now.depth = static_cast<float>(s.high);
            now.height = static_cast<float>(std::max(0.0, s.at[2] - layer.z_bottom + (s.low + s.high) / 2));
            // Roughing is carried by the slab that stands, floors by what stays under them. Thinner than the
            // least step it is no slab but a sliver that tears off; and what a ball or a wall's finishing has
            // under its tip is not what carries it.
            const bool floor =
                op.kind == OperationKind::finish && tool.kind == ToolKind::flat && op.stepdown == 0;
            const double under = s.at[2] - layer.z_bottom, wood = roughs(op.kind) ? under + s.high
                                                                  : floor         ? under
                                                                                  : 0;
            const double beyond =
                overhang && wood >= (floor ? kLeastDepth : std::max(kLeastDepth, least_slab(tool)))
                    ? overhang->at(s.at[0], s.at[1])
                    : 0;
            if (beyond > 0)
                now.wood = static_cast<float>(wood), now.overhang = static_cast<float>(beyond + setback);
        }
        seen.push_back(now);
    };
    if (parts.empty()) slab.run(op, tool, see);
    else slab.run_parts(op, tool, parts, see);
}

/// Where runs lie when they are split (split_runs).
std::vector<MoveRange> split_parts(std::span<const DeepRun> runs) {
    std::vector<MoveRange> parts;
    std::uint32_t more = 0;
    for (const DeepRun& run : runs) {
        const std::uint32_t first = run.first + more, length = run.last - run.first + 1;
        more += static_cast<std::uint32_t>(run.passes - 1) * (1 + 2 * length) + 1;
        parts.push_back({first, run.last + more});
    }
    return parts;
}

/// Whether a stretch lies partly in a run.
bool any_halved(const std::vector<Seen>& seen, std::span<const DeepRun> runs) {
    std::size_t r = 0;
    for (const Seen& s : seen) {
        while (r < runs.size() && runs[r].last < s.first) ++r;
        if (r < runs.size() && runs[r].first <= s.last && (s.first < runs[r].first || s.last > runs[r].last))
            return true;
    }
    return false;
}

/// What was seen before runs were split, with `anew` in place of what was seen of the runs.
/// @param parts where the runs lie now
void replaced(const std::vector<Seen>& seen, std::span<const DeepRun> runs, std::span<const MoveRange> parts,
              const std::vector<Seen>& anew, std::vector<Seen>& all) {
    all.clear();
    all.reserve(seen.size() + anew.size());
    std::size_t r = 0, next = 0;  // runs passed, and of what was seen anew
    const auto take = [&] {
        for (; next < anew.size() && anew[next].last <= parts[r].last; ++next) all.push_back(anew[next]);
        ++r;
    };
    for (Seen s : seen) {
        while (r < runs.size() && runs[r].last < s.first) take();
        if (r < runs.size() && s.first >= runs[r].first) continue;
        const std::uint32_t more = r == 0 ? 0 : parts[r - 1].last - runs[r - 1].last;
        s.first += more;
        s.last += more;
        all.push_back(s);
    }
    while (r < runs.size()) take();
}

/// By how much a cut passes what it may do: its wall error, the cutter's stress and the wood's, the largest
/// as a share of its limit.
struct Load {
    double cutter = 0, wood = 0;
    [[nodiscard]] double worst() const { return std::max(cutter, wood); }
};

/// In how many passes the wood holds, from `least` on; 0 where it holds in none.
template <class LoadOf>
int passes_for_wood(const Seen& s, int least, LoadOf&& load) {
    if (s.depth >= 4 * kLeastDepth)
        for (int n = std::max(2, least); n <= kMostPasses; ++n)
            if (load(s, n).wood <= 1) return n;
    return 0;
}

/// Runs of stretches that no feed makes light enough and that several passes would.
/// @param load what a stretch bears in so many passes, in the lowest of them, which the least wood carries
template <class LoadOf>
std::vector<DeepRun> deep_runs(const std::vector<Seen>& seen, const Operation& op, const Tool& tool,
                               int round, LoadOf&& load) {
    const double diameter = tool.diameter;
    const bool ball = tool.kind == ToolKind::ball;
    // Wood that no passes save, as over a wide cavity, is not worth their time: neither where it breaks nor,
    // on levels above, where it will.
    const auto column = [&](const Seen& s) {
        return std::pair{static_cast<int>(std::floor(s.at[0] / diameter)),
                         static_cast<int>(std::floor(s.at[1] / diameter))};
    };
    std::set<std::pair<int, int>> lost;
    for (const Seen& s : seen)
        if (s.overhang > 0 && load(s, 1).wood > 1 && passes_for_wood(s, 2, load) == 0) lost.insert(column(s));
    std::vector<DeepRun> runs;
    for (const Seen& s : seen) {
        if (!s.cuts || s.depth < 4 * kLeastDepth) continue;
        const Load whole = load(s, 1);
        int passes = 0;
        if (whole.cutter > 1)
            passes = std::clamp(static_cast<int>(std::ceil(whole.cutter)) + round, 2, kMostPasses);
        if (whole.wood > 1 && !lost.contains(column(s)))
            passes = std::max(passes, passes_for_wood(s, passes, load));
        if (passes == 0) continue;
        // A ball takes a shell as thick as its lowest pass is raised: what is too much still gets a thinner
        // one.
        const double depth = ball ? s.depth * std::pow(kThinnerShell, round) : s.depth;
        if (!runs.empty() && s.first <= runs.back().last + 1) {
            DeepRun& run = runs.back();
            run.last = std::max(run.last, s.last);
            run.depth_mm = std::max(run.depth_mm, depth);
            run.passes = std::max(run.passes, passes);
        } else {
            runs.push_back({s.first, s.last, depth, passes, ball ? PassShares::growing : PassShares::equal});
        }
    }
    // A run goes by feed and in the plane from end to end.
    std::erase_if(runs, [&](const DeepRun& run) {
        for (std::uint32_t k = run.first; k <= run.last; ++k)
            if (k == 0 || op.moves[k].feed == 0) return true;
        return false;
    });
    return runs;
}

/// What the cuts of one operation bear, and the feeds that they may have.
class FeedChoice {
public:
    FeedChoice(Context& context, const Job& job, const Operation& op, const Tool& tool, SharedBents* shared,
               bool never_faster)
        : context_(context),
          job_(job),
          op_(op),
          tool_(tool),
          cutting_(job, op, tool, shared),
          limit_(bending_limit(op, job)),
          never_faster_(never_faster),
          fastest_(static_cast<std::uint32_t>(std::floor(std::min(tool.max_feed, job.machine.max_feed)))) {}

    [[nodiscard]] BentCutter& cutting() { return cutting_; }

    [[nodiscard]] double wood_load(const Seen& s, const Bent& bent) const {
        return s.overhang > 0 ? cutting_.needed_wood(bent, s.height, s.overhang) / s.wood : 0;
    }

    /// Of a cut whose feed is chosen, in the lowest of so many passes.
    Load load(const Seen& s, int passes) {
        if (passes == 1) return Load{s.stated > 0 ? s.stated : share(*s.bent), s.wood_load};
        Seen lowest = s;
        const float off = s.depth * static_cast<float>(passes - 1) / static_cast<float>(passes);
        lowest.coarse = shallower(s.coarse, passes);
        lowest.wood -= off;
        lowest.height = std::max(0.F, lowest.height - off / 2);
        return load_of(lowest, cutting_.at(lowest.coarse, s.feed));
    }

    void choose(Seen& s) {
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
            FeedStep* step = of.chosen;
            if (s.overhang > 0 || step == nullptr) step = slow_enough(s, of.steps);
            if (!(s.overhang > 0)) of.chosen = step;
            step = as_stated(s, of.steps, step);
            s.feed = step->feed;
            s.bent = &bent_at(s, *step);
        }
        // Where feed alone does not settle it.
        if (share(*s.bent) > kClassSlack) s.stated = stated_share(s, s.feed) / kHolds;
        s.wood_load = wood_load(s, *s.bent);
    }

private:
    /// The steps of a class, fastest first, are the same wherever it is met.
    struct ClassFeeds {
        std::vector<FeedStep> steps;
        FeedStep* chosen = nullptr;  // where nothing hangs over
    };

    [[nodiscard]] double share(const Bent& bent) const { return cutting_.share(bent, limit_); }
    Load load_of(const Seen& s, const Bent& bent) {
        if (++looked_at_ % 128 == 0) context_.throw_if_cancelled();
        return Load{share(bent), wood_load(s, bent)};
    }
    /// As the plan will state it.
    double stated_share(const Seen& s, double feed) { return share(cutting_.stated(s.fine, feed)); }
    // Entries on ramps and helices go at the plunge's feed, whether they meet wood yet or not.
    [[nodiscard]] std::uint32_t most_of(std::uint32_t planned) const {
        return never_faster_ || planned <= tool_.plunge_feed ? planned : fastest_;
    }

    ClassFeeds& feeds_of(const Seen& s, std::uint32_t planned) {
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
    const Bent& bent_at(const Seen& s, FeedStep& step) {
        if (step.bent == nullptr) step.bent = &cutting_.at(s.coarse, step.feed);
        return *step.bent;
    }
    /// The fastest step that all limits bear. Where none does: the slowest that is allowed, when it is the
    /// cutter that bears too much; the fastest that the cutter bears, when it is the wood.
    FeedStep* slow_enough(const Seen& s, std::vector<FeedStep>& steps) {
        FeedStep* for_cutter = nullptr;
        for (FeedStep& step : steps) {
            const Load l = load_of(s, bent_at(s, step));
            if (l.worst() <= 1) return &step;
            if (l.cutter <= 1 && for_cutter == nullptr) for_cutter = &step;
        }
        return for_cutter != nullptr ? for_cutter : &steps.back();
    }
    /// A coarse class may bear a little less than a cut of it does, and more than any: near the limit and
    /// beyond it, what the plan will state decides.
    FeedStep* as_stated(const Seen& s, std::vector<FeedStep>& steps, FeedStep* step) {
        const double bears = share(bent_at(s, *step));
        if (bears < kClassSlack) return step;
        const auto holds = [&](const FeedStep& f) { return stated_share(s, f.feed) <= kHolds; };
        if (bears > 1)
            return std::to_address(std::partition_point(steps.begin(), std::prev(steps.end()),
                                                        [&](const FeedStep& f) { return !holds(f); }));
        while (!holds(*step) && step != &steps.back()) ++step;
        return step;
    }

    Context& context_;
    const Job& job_;
    const Operation& op_;
    const Tool& tool_;
    BentCutter cutting_;
    const double limit_;  // mm, of the wall's error
    const bool never_faster_;
    const std::uint32_t fastest_;
    ByClassAndFeed<ClassFeeds> known_;
    ClassAndFeed last_key_;
    ClassFeeds* last_ = nullptr;
    std::size_t looked_at_ = 0;
};

double way_of(const Operation& op, std::uint32_t first, std::uint32_t last) {
    double way = 0;
    for (std::uint32_t k = first; k <= last; ++k) {
        const Move &a = op.moves[k - 1], &b = op.moves[k];
        way += b.is_arc() ? arc_shape(a, b).length()
                          : std::hypot(to_mm(b.x - a.x), to_mm(b.y - a.y), to_mm(b.z - a.z));
    }
    return way;
}

/// What the runs' passes add to the way, mm.
double way_added(const Operation& op, const std::vector<DeepRun>& runs) {
    double sum = 0;
    for (const DeepRun& run : runs) sum += (run.passes - 1) * way_of(op, run.first, run.last);
    return sum;
}

}  // namespace

CutSegment cut_of(const CutStretch& stretch, const Tool& tool, const Job& job, double feed) {
    return segment_of(class_of(stretch, tool, kFine), idle_cut(job, tool), tool, feed, kFine);
}

double bending_limit(const Operation& operation, const Job& job) {
    switch (operation.kind) {
        case OperationKind::face:
            return job.slabs.facing_allowance > 0 ? job.slabs.facing_allowance : job.tolerances.cusp;
        case OperationKind::semi_rough:
            return std::max(operation.spare, job.tolerances.cusp);
        case OperationKind::rough:
            return std::max(std::min(job.cutting.wall_allowance, job.cutting.floor_allowance) -
                                (operation.blend - kJunction) - rough_fit(job.cutting),
                            job.tolerances.cusp);
        default:
            return job.tolerances.cusp;
    }
}

LayerCuts adapt_layer(Context& context, Layer& layer, const Plan& plan, const OverhangMap* overhang,
                      std::vector<Diagnostic>& diagnostics, KnownCuts* known_cuts, FeedChange change) {
    const Job& job = plan.job;
    StandingSlab slab(plan.stock_min, plan.stock_max, layer.z_bottom, layer.z_bottom + layer.slab_thickness,
                      StandingSlab::cell_for(job, plan.stock_min, plan.stock_max));
    const MemoryCharge memory(context, 3 * slab.bytes(), "the stock that forces are computed from");
    LayerCuts result;
    // What one operation leaves to the next, for its memory only.
    StandingSlab before = slab, again = slab;
    const PooledScratch<SeenMemory> lent(known_cuts != nullptr ? &known_cuts->impl().memory : nullptr);
    auto& [seen, anew, all] = *lent;
    for (Operation& op : layer.operations) {
        context.throw_if_cancelled();
        op.peak_force_n = op.deflection_mm = op.wall_error_mm = op.peak_torque_nmm = op.peak_power_w = 0;
        op.peak_at.reset();
        op.peak_move.reset();
        result.starts.push_back(result.cuts.size());
        const Tool& tool = *std::find_if(job.tools.begin(), job.tools.end(),
                                         [&](const Tool& t) { return t.number == op.tool; });
        if (!mills(tool.kind)) continue;
        if (!(op.spindle_rpm > 0))
            throw Error(ErrorKind::usage, "forces.spindle", "an operation mills with its spindle at rest",
                        op.purpose, "give the tool a speed");
        FeedChoice choice(context, job, op, tool, known_cuts != nullptr ? &known_cuts->impl().bents : nullptr,
                          roughs(op.kind) || change == FeedChange::lower);
        const auto load = [&](const Seen& seen_here, int parted) { return choice.load(seen_here, parted); };

        std::size_t divided = 0, looked_at = 0;
        double divided_way = 0, deepest = 0, added = 0;
        const double whole =
            op.moves.empty() ? 0 : way_of(op, 1, static_cast<std::uint32_t>(op.moves.size() - 1));
        int passes = 0;
        std::optional<std::array<double, 3>> divided_at;
        before = slab;
        run_through(context, slab, op, tool, layer, overhang, job.bonding.edge_setback, seen);
        for (int round = 0;; ++round) {
            std::size_t asked = 0;
            for (Seen& s : seen) {
                if (++asked % 64 == 0) context.throw_if_cancelled();
                if (s.feed == 0) choice.choose(s);
            }
            if (!job.cutting.adapt_stepdown || round == kMostRounds) break;
            const std::vector<DeepRun> runs = deep_runs(seen, op, tool, round, load);
            context.throw_if_cancelled();
            // A slender ball in a narrow place would take hours to bend as little as it may: it is told.
            added += way_added(op, runs);
            if (runs.empty() || (round > 0 && added > kMostAdded * whole + kAlwaysAdded)) break;
            for (const DeepRun& run : runs) {
                ++divided;
                divided_way += way_of(op, run.first, run.last);
                if (run.depth_mm > deepest) {
                    deepest = run.depth_mm;
                    passes = run.passes;
                    const Move& end = op.moves[run.last];
                    divided_at = {to_mm(end.x), to_mm(end.y), to_mm(end.z)};
                }
            }
            op.moves = split_runs(
                op.moves, runs,
                static_cast<std::uint32_t>(std::max(1.0, std::min(tool.plunge_feed, job.machine.max_feed))));
            // After a run there stands what stood after it before, so only the runs themselves are looked at
            // anew.
            again = before;
            if (any_halved(seen, runs)) {
                run_through(context, again, op, tool, layer, overhang, job.bonding.edge_setback, seen);
            } else {
                const std::vector<MoveRange> parts = split_parts(runs);
                run_through(context, again, op, tool, layer, overhang, job.bonding.edge_setback, anew, parts);
                replaced(seen, runs, parts, anew, all);
                seen.swap(all);
            }
        }
        if (divided > 0)
            diagnostics.push_back({Severity::note, "stepdown.lowered",
                                   fmt::format("layer {}, {}: {} cut{} of {:.0f} mm in all {} taken in "
                                               "several passes, the deepest of {:.2f} mm in {}, where "
                                               "cutter or wood would bear too much at any feed",
                                               layer.index, op.purpose, divided, divided == 1 ? "" : "s",
                                               divided_way, divided == 1 ? "is" : "are", deepest, passes),
                                   divided_at});

        if (job.cutting.adapt_feed) {
            std::vector<std::uint32_t> wanted(op.moves.size(), 0);
            std::vector<char> level(op.moves.size(), 0);
            double lowest_share = 1, way = 0;
            const Seen* worst = nullptr;
            for (const Seen& s : seen) {
                const std::uint32_t planned = op.moves[s.last].feed, feed = s.feed;
                for (std::uint32_t k = s.first; k <= s.last; ++k) {
                    wanted[k] = wanted[k] == 0 ? feed : std::min(wanted[k], feed);
                    level[k] = 1;
                }
                if (feed < planned) {
                    ++way;
                    if (const double share = static_cast<double>(feed) / planned; share < lowest_share)
                        lowest_share = share, worst = &s;
                }
            }
            if (worst)
                diagnostics.push_back(
                    {Severity::note, "feed.lowered",
                     fmt::format("layer {}, {}: the feed is lowered in {:.1f} % of the way, to {:.0f} % of "
                                 "what was planned where cutter "
                                 "or wood would bear most",
                                 layer.index, op.purpose, 100 * way / static_cast<double>(seen.size()),
                                 100 * lowest_share),
                     worst->place()});
            set_feeds(context, op, std::move(wanted), level);
        }
        context.throw_if_cancelled();

        // Every cut that differs, with the place where it is met first; and where the wood would break.
        std::unordered_set<ClassAndFeed, HashClassAndFeed> listed;
        const Seen* breaks = nullptr;
        double most = 1, needed = 0;
        std::size_t broken = 0;
        for (const Seen& s : seen) {
            if (!s.cuts) continue;
            if (++looked_at % 128 == 0) context.throw_if_cancelled();
            std::uint32_t feed = 0;
            for (std::uint32_t k = s.first; k <= s.last; ++k) feed = std::max(feed, op.moves[k].feed);
            if (s.overhang > 0)
                if (const double wood = feed == s.feed
                                            ? s.wood_load
                                            : choice.wood_load(s, choice.cutting().at(s.coarse, feed));
                    wood > 1) {
                    ++broken;
                    if (wood > most) most = wood, breaks = &s, needed = wood * s.wood;
                }
            if (!listed.insert({s.fine, static_cast<double>(feed)}).second) continue;
            result.cuts.push_back(segment_of(s.fine, choice.cutting().idle(), tool, feed, kFine));
            result.places.push_back(s.at);
            result.moves.push_back(s.last);
        }
        if (breaks)
            diagnostics.push_back({Severity::warning, "cut.overhang",
                                   fmt::format("layer {}, {}: {:.2f} mm of wood hang over by {:.1f} mm where "
                                               "they are cut, and would need {:.2f} mm to hold "
                                               "({} such place{}); a flask would carry them",
                                               layer.index, op.purpose, breaks->wood, breaks->overhang,
                                               needed, broken, broken == 1 ? "" : "s"),
                                   breaks->place()});
    }
    result.starts.push_back(result.cuts.size());
    return result;
}

}  // namespace slabwright
