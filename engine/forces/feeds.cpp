#include "engine/forces/feeds.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "engine/forces/cuts.h"
#include "kernels/errors.h"
#include "kernels/forces/deflection.h"

namespace slabwright {

namespace {

constexpr double kLeastDepth = 0.01;   // mm: shallower cuts are taken as this deep
constexpr double kDepthSteps = 8;      // to a doubling
constexpr double kWidthSteps = 24;     // of the diameter
constexpr double kAccuracy = 0.01;     // of peaks, as a share: far finer than the classes are
constexpr double kLeastShare = 0.125;  // of the planned feed: slower, a cutter rubs
constexpr double kLeastRun = 20;       // mm that a faster feed must last

/// A cut's class: what its forces depend on but the feed.
struct CutClass {
    std::int16_t low = 0, depth = 0, width = 0;
    bool left = false;
    friend auto operator<=>(const CutClass&, const CutClass&) = default;
};

double depth_of(int depth) { return kLeastDepth * std::exp2(depth / kDepthSteps); }

CutClass class_of(const CutStretch& s, const Tool& tool) {
    CutClass c;
    if (tool.kind == ToolKind::ball) c.low = static_cast<std::int16_t>(std::floor(std::min(s.low, tool.diameter / 2) / (tool.diameter / 2) * 16));
    const double low = c.low * tool.diameter / 32, depth = std::clamp(s.high - low, kLeastDepth, 30 * tool.diameter);
    c.depth = static_cast<std::int16_t>(std::ceil(std::log2(depth / kLeastDepth) * kDepthSteps - 1e-9));
    // The class is deeper than the cut; its width is that of the same cross-section.
    const double width = s.width * (s.high - s.low) / (s.high - low);
    c.width = static_cast<std::int16_t>(std::clamp(std::ceil(width / tool.diameter * kWidthSteps - 1e-9), 1.0, kWidthSteps));
    c.left = s.left;
    return c;
}

CutSegment segment_of(const CutClass& c, const CutSegment& idle, const Tool& tool, double feed) {
    CutSegment cut = idle;
    const double r = tool.diameter / 2;
    cut.low_mm = c.low * r / 16;
    cut.high_mm = cut.low_mm + depth_of(c.depth);
    const bool cap = cut.profile == CutterProfile::ball && cut.high_mm < r;
    const double circle = cap ? std::sqrt(cut.high_mm * (2 * r - cut.high_mm)) : r;
    cut.arc = engagement_arc(circle, c.width * tool.diameter / kWidthSteps, c.left ? MillingSense::up : MillingSense::down);
    cut.chip_load_mm = feed / (cut.spindle_rpm * tool.flutes);
    return cut;
}

/// What a cut does to the tool.
struct Bent {
    double force_n = 0, tip_mm = 0, wall_mm = 0;
};

class BentCutter {
public:
    BentCutter(const Job& job, const Operation& operation, const Tool& tool) : tool_(tool), idle_(idle_cut(job, tool)) {
        idle_.spindle_rpm = operation.spindle_rpm;
    }

    const Bent& at(const CutClass& c, double feed) {
        const auto [it, fresh] = known_.try_emplace({c, feed});
        if (fresh) {
            const CutSegment cut = segment_of(c, idle_, tool_, feed);
            const SegmentForces f = cut.profile == CutterProfile::flat ? closed_form_forces(cut, kAccuracy) : reference_forces(cut, kAccuracy);
            it->second = {f.peak_resultant_n, cutter_deflection(f.peak_in_plane_n, tool_.stickout, tool_.diameter),
                          cutter_deflection(f.peak_y_n, tool_.stickout, tool_.diameter)};
        }
        return it->second;
    }

    /// The thickest chip, as a share of the feed per tooth.
    [[nodiscard]] double thickest_chip(const CutClass& c) const {
        const EngagementArc arc = segment_of(c, idle_, tool_, 1).arc;
        const double middle = std::clamp(std::numbers::pi / 2, arc.entry_rad, arc.exit_rad);
        return std::max(1e-3, std::sin(middle));
    }

private:
    const Tool& tool_;
    CutSegment idle_;
    std::map<std::pair<CutClass, double>, Bent> known_;
};

bool roughs(OperationKind kind) { return kind == OperationKind::rough || kind == OperationKind::face; }

/// Gives the moves of `level` the feeds that are wanted, faster ones only where they last.
void set_feeds(Operation& op, std::vector<std::uint32_t> wanted, const std::vector<char>& level) {
    const std::size_t n = op.moves.size();
    std::vector<double> way(n, 0);  // up to and with each move
    for (std::size_t k = 1; k < n; ++k) {
        const Move &a = op.moves[k - 1], &b = op.moves[k];
        way[k] = way[k - 1] + (b.is_arc() ? arc_shape(a, b).length() : std::hypot(to_mm(b.x - a.x), to_mm(b.y - a.y), to_mm(b.z - a.z)));
    }
    std::vector<std::uint32_t> steps;
    for (std::size_t k = 1; k < n; ++k)
        if (level[k]) steps.push_back(wanted[k]);
    std::sort(steps.begin(), steps.end(), std::greater<>());
    steps.erase(std::unique(steps.begin(), steps.end()), steps.end());
    // From the fastest step down: a stretch at least that fast that is too short goes as fast as its faster neighbour, which
    // is slower. Where it has none, between rapids, it goes no faster than planned.
    for (const std::uint32_t step : steps)
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
                for (std::size_t m = k; m < end; ++m) wanted[m] = beside > 0 ? beside : std::min(wanted[m], op.moves[m].feed);
            }
            k = end;
        }
    for (std::size_t k = 1; k < n; ++k)
        if (level[k]) op.moves[k].feed = wanted[k];
}

}  // namespace

CutSegment cut_of(const CutStretch& stretch, const Tool& tool, const Job& job, double feed) {
    return segment_of(class_of(stretch, tool), idle_cut(job, tool), tool, feed);
}

double bending_limit(const Operation& operation, const Job& job) {
    switch (operation.kind) {
        case OperationKind::face:
            return job.slabs.facing_allowance > 0 ? job.slabs.facing_allowance : job.tolerances.cusp;
        case OperationKind::rough:
        case OperationKind::semi_rough:
            return std::max(std::min(job.cutting.wall_allowance, job.cutting.floor_allowance), job.tolerances.cusp);
        default:
            return job.tolerances.cusp;
    }
}

void rate_layer(Context& context, Layer& layer, const Plan& plan, std::vector<Diagnostic>& diagnostics) {
    const Job& job = plan.job;
    StandingSlab slab(plan.stock_min, plan.stock_max, layer.z_bottom, layer.z_bottom + layer.slab_thickness,
                      StandingSlab::cell_for(job, plan.stock_min, plan.stock_max));
    const MemoryCharge memory(context, slab.bytes(), "the stock that forces are computed from");
    for (Operation& op : layer.operations) {
        context.throw_if_cancelled();
        op.peak_force_n = op.deflection_mm = op.wall_error_mm = 0;
        op.peak_at.reset();
        const Tool& tool = *std::find_if(job.tools.begin(), job.tools.end(), [&](const Tool& t) { return t.number == op.tool; });
        if (tool.kind == ToolKind::drill) continue;
        if (!(op.spindle_rpm > 0))
            throw Error(ErrorKind::usage, "forces.spindle", "an operation mills with its spindle at rest", op.purpose, "give the tool a speed");
        struct Seen {
            CutClass cut;
            std::uint32_t first = 0, last = 0;
            bool cuts = false;
            std::array<float, 3> at{};
        };
        std::vector<Seen> seen;
        slab.run(op, tool, [&](const CutStretch& s) {
            if (seen.size() % 1024 == 0) context.throw_if_cancelled();
            Seen now;
            now.first = s.first, now.last = s.last, now.cuts = s.cuts();
            if (now.cuts) now.cut = class_of(s, tool);
            for (std::size_t i = 0; i < 3; ++i) now.at[i] = static_cast<float>(s.at[i]);
            seen.push_back(now);
        });
        BentCutter cutting(job, op, tool);
        const double limit = bending_limit(op, job);
        const auto place = [](const Seen& s) { return std::array<double, 3>{s.at[0], s.at[1], s.at[2]}; };

        if (job.cutting.adapt_feed) {
            const auto fastest = static_cast<std::uint32_t>(std::floor(std::min(tool.max_feed, job.machine.max_feed)));
            std::map<std::pair<CutClass, std::uint32_t>, std::uint32_t> chosen;
            // The fastest step that both limits bear; the slowest that is allowed, where none does.
            const auto choose = [&](const Seen& s, std::uint32_t planned) -> std::uint32_t {
                // Entries on ramps and helices go at the plunge's feed, whether they meet wood yet or not.
                const double most = roughs(op.kind) || planned <= tool.plunge_feed ? planned : fastest;
                if (!s.cuts) return static_cast<std::uint32_t>(most);
                const auto [it, fresh] = chosen.try_emplace({s.cut, planned}, planned);
                if (!fresh) return it->second;
                const double chip = std::min(most, std::max<double>(planned, planned / cutting.thickest_chip(s.cut)));
                // What is planned is a step too, so that a cut that needs no other feed keeps its own.
                std::vector<std::uint32_t> steps{planned};
                for (int k = 1; k <= kFeedSteps; ++k) steps.push_back(fastest * static_cast<std::uint32_t>(k) / kFeedSteps);
                std::sort(steps.begin(), steps.end(), std::greater<>());
                for (const std::uint32_t step : steps) {
                    if (step > chip || step < 1) continue;
                    if (step < kLeastShare * planned) break;
                    it->second = step;
                    if (cutting.at(s.cut, step).wall_mm <= limit) break;
                }
                return it->second;
            };
            std::vector<std::uint32_t> wanted(op.moves.size(), 0);
            std::vector<char> level(op.moves.size(), 0);
            double lowest_share = 1, way = 0;
            const Seen* worst = nullptr;
            for (const Seen& s : seen) {
                const std::uint32_t planned = op.moves[s.last].feed, feed = choose(s, planned);
                for (std::uint32_t k = s.first; k <= s.last; ++k) {
                    wanted[k] = wanted[k] == 0 ? feed : std::min(wanted[k], feed);
                    level[k] = 1;
                }
                if (feed < planned) {
                    ++way;
                    if (const double share = static_cast<double>(feed) / planned; share < lowest_share) lowest_share = share, worst = &s;
                }
            }
            if (worst)
                diagnostics.push_back(
                    {Severity::note, "feed.lowered",
                     fmt::format(
                         "layer {}, {}: the feed is lowered in {:.1f} % of the way, to {:.0f} % of what was planned where the cutter would bend most",
                         layer.index, op.purpose, 100 * way / static_cast<double>(seen.size()), 100 * lowest_share),
                     place(*worst)});
            set_feeds(op, std::move(wanted), level);
        }

        const Seen *hardest = nullptr, *furthest = nullptr;
        for (const Seen& s : seen) {
            if (!s.cuts) continue;
            std::uint32_t feed = 0;
            for (std::uint32_t k = s.first; k <= s.last; ++k) feed = std::max(feed, op.moves[k].feed);
            const Bent& bent = cutting.at(s.cut, feed);
            if (bent.force_n > op.peak_force_n) op.peak_force_n = bent.force_n, hardest = &s;
            if (bent.wall_mm > op.wall_error_mm) op.wall_error_mm = bent.wall_mm, furthest = &s;
            op.deflection_mm = std::max(op.deflection_mm, bent.tip_mm);
        }
        if (hardest) op.peak_at = place(*hardest);
        if (op.wall_error_mm > limit)
            diagnostics.push_back(
                {Severity::warning, "cut.deflection",
                 fmt::format("layer {}, {}: the cutter may bend by {:.4f} mm, more than the {:.4f} mm allowed; use a shorter or thicker tool "
                             "or a smaller stepdown",
                             layer.index, op.purpose, op.wall_error_mm, limit),
                 place(*furthest)});
    }
}

}  // namespace slabwright
