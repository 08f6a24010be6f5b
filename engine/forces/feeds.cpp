#include "engine/forces/feeds.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <unordered_set>
#include <utility>

#include <fmt/format.h>

#include "engine/forces/cuts.h"
#include "engine/forces/deep_runs.h"
#include "engine/forces/feed_choice.h"
#include "engine/forces/seen_stretches.h"
#include "engine/forces/split_cuts.h"
#include "engine/tools/tools.h"
#include "kernels/errors.h"
#include "kernels/parallel/scratch_pool.h"

namespace slabwright {

namespace {

constexpr double kLeastRun = 20;       // mm that a faster feed must last
constexpr int kMostRounds = 6;         // of dividing
constexpr double kMostAdded = 2;       // of an operation's way, that rounds after the first may add
constexpr double kAlwaysAdded = 3000;  // mm that they may add in any case

/// What a layer's stretches are kept in while they are looked at, of any content.
struct SeenMemory {
    std::vector<SeenStretch> seen, anew, all;
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

/// The cut of a layer that loads a thin wall most, as a share of what its foot bears.
struct HardestPush {
    double load = 0, force_n = 0;
    WallPush push{};
    bool lost = false;
};

/// One operation of a layer: how it is divided, the feeds that it gets, and what its cuts then are.
class OperationFeeds {
public:
    OperationFeeds(Context& context, const Plan& plan, const Layer& layer, Operation& op, const Tool& tool,
                   const WoodLimits& limits, KnownCuts* known, FeedChange change, SeenMemory& memory)
        : context_(context),
          job_(plan.job),
          layer_(layer),
          op_(op),
          tool_(tool),
          limits_(limits),
          memory_(memory),
          choice_(context, plan.job, op, tool, known != nullptr ? &known->impl().bents : nullptr,
                  roughs(op.kind) || change == FeedChange::lower) {}

    /// Chooses feeds, and divides what holds at none.
    /// @param slab gets what the operation leaves; @param before, again are memory like it
    void choose(StandingSlab& slab, StandingSlab& before, StandingSlab& again,
                std::vector<Diagnostic>& diagnostics) {
        const double whole =
            op_.moves.empty() ? 0 : way_of(op_, 1, static_cast<std::uint32_t>(op_.moves.size() - 1));
        double added = 0;
        Divided divided;
        before = slab;
        see(slab);
        slow_plunges(slab);
        for (int round = 0;; ++round) {
            std::size_t asked = 0;
            for (SeenStretch& s : memory_.seen) {
                if (++asked % 64 == 0) context_.throw_if_cancelled();
                if (s.feed == 0) choice_.choose(s);
            }
            if (!job_.cutting.adapt_stepdown || round == kMostRounds) break;
            const std::vector<DeepRun> runs = deep_runs(
                memory_.seen, op_, tool_, round,
                {[&](const SeenStretch& s, int passes) { return choice_.load(s, passes); },
                 [&](const SeenStretch& s, int passes) { return choice_.pace(s, passes, limits_.walls); }});
            context_.throw_if_cancelled();
            // A slender ball in a narrow place would take hours to bend as little as it may: it is told.
            added += way_added(op_, runs);
            if (runs.empty() || (round > 0 && added > kMostAdded * whole + kAlwaysAdded)) break;
            divide(runs, before, again, divided);
        }
        divided.tell(layer_, op_, diagnostics);
    }

    void set(std::vector<Diagnostic>& diagnostics) {
        if (!job_.cutting.adapt_feed) return;
        const std::vector<SeenStretch>& seen = memory_.seen;
        std::vector<std::uint32_t> wanted(op_.moves.size(), 0);
        std::vector<char> level(op_.moves.size(), 0);
        double lowest_share = 1, way = 0;
        const SeenStretch* worst = nullptr;
        for (const SeenStretch& s : seen) {
            const std::uint32_t planned = op_.moves[s.last].feed, feed = s.feed;
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
                 fmt::format("layer {}, {}: the feed is lowered in {:.1f} % of the way, to "
                             "{:.0f} % of what was planned where cutter or wood would bear "
                             "most",
                             layer_.index, op_.purpose, 100 * way / static_cast<double>(seen.size()),
                             100 * lowest_share),
                 worst->place()});
        set_feeds(context_, op_, std::move(wanted), level);
    }

    /// Adds every cut that differs, with the place where it is met first, and tells where the wood would
    /// break.
    /// @param hardest on a wall of the layer, so far
    void list(LayerCuts& cuts, HardestPush& hardest, std::vector<Diagnostic>& diagnostics) {
        std::unordered_set<ClassAndFeed, HashClassAndFeed> listed;
        const SeenStretch* breaks = nullptr;
        double most = 1, needed = 0;
        std::size_t broken = 0, looked_at = 0;
        for (const SeenStretch& s : memory_.seen) {
            if (!s.cuts) continue;
            if (++looked_at % 128 == 0) context_.throw_if_cancelled();
            std::uint32_t feed = 0;
            for (std::uint32_t k = s.first; k <= s.last; ++k) feed = std::max(feed, op_.moves[k].feed);
            const auto bent = [&]() -> const Bent& {
                return feed == s.feed ? *s.bent : choice_.cutting().at(s.coarse, feed);
            };
            if (s.overhang > 0)
                if (const double wood = feed == s.feed ? s.wood_load : choice_.wood_load(s, bent());
                    wood > 1) {
                    ++broken;
                    if (wood > most) most = wood, breaks = &s, needed = wood * s.wood;
                }
            if (s.wall_n > 0)
                if (const double wall = s.wall_load(bent()); wall > hardest.load)
                    hardest = {wall, bent().in_plane_n, wall_push(s, op_, tool_), s.wall_lost};
            if (feed == s.feed) {
                const CutLoad load = choice_.load(s, 1);
                cuts.strain = std::max(cuts.strain, load.side());
                cuts.cutter_strain = std::max(cuts.cutter_strain, load.cutter);
            }
            if (!listed.insert({s.fine, static_cast<double>(feed)}).second) continue;
            cuts.cuts.push_back(segment_of(s.fine, choice_.cutting().idle(), tool_, feed, kFine));
            cuts.places.push_back(s.at);
            cuts.moves.push_back(s.last);
        }
        if (breaks)
            diagnostics.push_back({Severity::warning, "cut.overhang",
                                   fmt::format("layer {}, {}: {:.2f} mm of wood hang over by {:.1f} mm where "
                                               "they are cut, and would need {:.2f} mm to hold "
                                               "({} such place{}); a flask would carry them",
                                               layer_.index, op_.purpose, breaks->wood, breaks->overhang,
                                               needed, broken, broken == 1 ? "" : "s"),
                                   breaks->place()});
    }

private:
    /// What is cut in several passes.
    struct Divided {
        std::size_t cuts = 0;
        double way = 0, deepest = 0;
        int passes = 0;
        std::optional<std::array<double, 3>> at{};

        void tell(const Layer& layer, const Operation& op, std::vector<Diagnostic>& diagnostics) const {
            if (cuts == 0) return;
            diagnostics.push_back({Severity::note, "stepdown.lowered",
                                   fmt::format("layer {}, {}: {} cut{} of {:.0f} mm in all {} taken in "
                                               "several passes, the deepest of {:.2f} mm in {}, where "
                                               "cutter or wood would bear too much at once",
                                               layer.index, op.purpose, cuts, cuts == 1 ? "" : "s", way,
                                               cuts == 1 ? "is" : "are", deepest, passes),
                                   at});
        }
    };

    void see(StandingSlab& slab, std::span<const MoveRange> parts = {}) {
        run_through(context_, slab, op_, tool_, layer_, limits_, job_.bonding.edge_setback,
                    parts.empty() ? memory_.seen : memory_.anew, parts);
    }
    // What was thought to be air, beside the cutter's middle, may have a strip of wood in it.
    void slow_plunges(const StandingSlab& slab) {
        for (const std::uint32_t k : slab.plunges())
            op_.moves[k].feed = std::min(op_.moves[k].feed, plunge_feed());
    }
    [[nodiscard]] std::uint32_t plunge_feed() const {
        return static_cast<std::uint32_t>(std::max(1.0, std::min(tool_.plunge_feed, job_.machine.max_feed)));
    }

    // @param before what stood before the operation
    void divide(const std::vector<DeepRun>& runs, const StandingSlab& before, StandingSlab& again,
                Divided& divided) {
        for (const DeepRun& run : runs) {
            ++divided.cuts;
            divided.way += way_of(op_, run.first, run.last);
            if (run.depth_mm > divided.deepest) {
                divided.deepest = run.depth_mm;
                divided.passes = run.passes;
                const Move& end = op_.moves[run.last];
                divided.at = {to_mm(end.x), to_mm(end.y), to_mm(end.z)};
            }
        }
        std::vector<Passes> passes;
        for (const DeepRun& run : runs) passes.push_back(passes_of(run));
        const std::vector<Move> whole = op_.moves;
        const bool by_turns = core_diameter_of(tool_) <= 0;
        SplitMoves split = split_runs(whole, passes, plunge_feed(), by_turns);
        // After a run there stands what stood after it before, so only the runs themselves are looked at
        // anew.
        const bool halved = any_halved(memory_.seen, passes);
        const auto look = [&] {
            op_.moves = std::move(split.moves);
            std::vector<MoveRange> parts;
            if (!halved)
                for (const SplitRun& run : split.runs) parts.push_back(run.all);
            again = before;
            see(again, parts);
            return parts;
        };
        std::vector<MoveRange> parts = look();
        // What earlier rounds have taken away is not gone over again.
        if (without_idle(passes, split.runs, halved ? memory_.seen : memory_.anew)) {
            split = split_runs(whole, passes, plunge_feed(), by_turns);
            parts = look();
        }
        if (halved) return;
        replaced(memory_.seen, passes, parts, memory_.anew, memory_.all);
        memory_.seen.swap(memory_.all);
    }

    Context& context_;
    const Job& job_;
    const Layer& layer_;
    Operation& op_;
    const Tool& tool_;
    const WoodLimits& limits_;
    SeenMemory& memory_;
    FeedChoice choice_;
};

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

LayerCuts adapt_layer(Context& context, Layer& layer, const Plan& plan, const WoodLimits& limits,
                      std::vector<Diagnostic>& diagnostics, KnownCuts* known_cuts, FeedChange change) {
    const Job& job = plan.job;
    const Blank blank = slab_of(plan, layer);
    StandingSlab slab(blank.min, blank.max, layer.z_bottom, layer.z_bottom + layer.slab_thickness,
                      StandingSlab::cell_for(job, blank.min, blank.max));
    const MemoryCharge memory(context, 3 * slab.bytes(), "the stock that forces are computed from");
    LayerCuts result;
    // What one operation leaves to the next, for its memory only.
    StandingSlab before = slab, again = slab;
    const PooledScratch<SeenMemory> lent(known_cuts != nullptr ? &known_cuts->impl().memory : nullptr);
    HardestPush hardest;
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
        OperationFeeds feeds(context, plan, layer, op, tool, limits, known_cuts, change, *lent);
        feeds.choose(slab, before, again, diagnostics);
        feeds.set(diagnostics);
        context.throw_if_cancelled();
        feeds.list(result, hardest, diagnostics);
    }
    result.starts.push_back(result.cuts.size());
    if (hardest.load > 1 + kBentAccuracy) {
        const WallBears wall = limits.walls->bears(hardest.push);
        diagnostics.push_back(
            weak_wall(layer.index,
                      {wall.foot, wall.height_mm, hardest.force_n, hardest.load * job.material.strength_mpa},
                      job.material.strength_mpa,
                      hardest.lost                                           ? WallCare::lost
                      : job.cutting.adapt_feed && job.cutting.adapt_stepdown ? WallCare::feeds
                                                                             : WallCare::none));
    }
    return result;
}

}  // namespace slabwright
