#include "engine/tool_choice/select.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include <fmt/format.h>

#include "engine/base_board.h"
#include "kernels/cutting/cusp.h"
#include "kernels/features/alpha_map.h"
#include "kernels/slicing/slicing.h"
#include "kernels/voxels/voxels.h"

namespace slabwright {

namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kSectionStep = 1;    // mm between the sections on which reach is measured
constexpr double kFinestStep = 0.05;  // mm to which halving brings a stepdown

template <class Is>
std::vector<Tool> falling(const Job& job, Is&& is) {
    std::vector<Tool> tools;
    for (const Tool& tool : job.tools)
        if (is(tool.kind)) tools.push_back(tool);
    std::stable_sort(tools.begin(), tools.end(),
                     [](const Tool& a, const Tool& b) { return a.diameter > b.diameter; });
    return tools;
}
std::vector<Tool> falling(const Job& job, ToolKind kind) {
    return falling(job, [&](ToolKind k) { return k == kind; });
}

// What the facets that are machined in a layer say of its slopes.
struct Slopes {
    double least = std::numbers::pi / 2;  // of the steep ones
    bool vertical = true;                 // nothing between upright and level
};

Slopes slopes_of(Context& context, const LayerJob& layer) {
    const Cutting& cutting = layer.job->cutting;
    AlphaOptions options;
    options.step = layer.z_top - layer.z_bottom;  // one bin
    options.upright = cutting.vertical_deg * kDegree;
    options.steep = cutting.steep_limit_deg * kDegree;
    constexpr double kJoint = 1e-3;  // mm: what reaches no higher over the joint belongs to the layer below
    const AlphaMap map = alpha_map(context, layer.mesh, layer.z_bottom + kJoint, layer.z_top, options);
    return {map.least_steep, map.vertical_area == map.area};
}

double perimeter(const Loops& loops) {
    double sum = 0;
    for (std::size_t l = 0; l < loops.size(); ++l) {
        const auto loop = loops.loop(l);
        for (std::size_t i = 0; i < loop.size(); ++i) {
            const Point2 a = loop[i], b = loop[(i + 1) % loop.size()];
            sum += std::hypot(static_cast<double>(b.x) - a.x, static_cast<double>(b.y) - a.y);
        }
    }
    return sum / kUnitsPerMm;
}

class Chooser {
public:
    Chooser(Context& context, const LayerJob& layer, const ReachRatio& ratio)
        : context_(context),
          layer_(layer),
          job_(*layer.job),
          ratio_(ratio),
          flats_(falling(job_, roughs_layers)),
          balls_(falling(job_, ToolKind::ball)) {
        for (const Flat& flat : layer.flats) floors_.push_back(flat.z);
    }

    ToolChoice run() {
        choice_.tools = fixed_tools(job_);  // also refuses a library that lacks a flat or a ball
        const Slopes slopes = slopes_of(context_, layer_);
        LayerSelection& record = choice_.record;
        record.least_slope_deg = slopes.least / kDegree;
        record.vertical = slopes.vertical;
        measure();
        if (slopes.vertical) {
            choose_one_flat();
        } else {
            choose_finish(slopes.least);
            choose_rough(slopes.least);
        }
        LayerTools& tools = choice_.tools;
        tools.rest = rest_tools(job_, tools.rough, tools.finish.diameter);
        return std::move(choice_);
    }

    std::vector<LayerTools> wider_rough(const LayerTools& base) {
        std::vector<LayerTools> sets;
        measure();
        const double height = layer_.z_top - layer_.z_bottom, swath = base.finish.diameter;
        const double allowed = std::min(
            flat_level_stepdown(slopes_of(context_, layer_).least, base.finish.diameter / 2), height);
        for (const Tool& rough : flats_) {
            if (rough.diameter < base.rough.diameter - 1e-9) break;
            constexpr double kMuchNarrower = 0.7;
            constexpr double kDeeper = 1.2;  // times as deep: less hardly makes a level fewer
            if (rough.diameter <= base.rough.diameter + 1e-9 &&
                rough.stepdown_max < kDeeper * base.rough.stepdown_max)
                break;
            LayerTools& tools = sets.emplace_back();
            tools.finish = base.finish;
            tools.rough = rough;
            tools.rest = rest_tools(job_, rough, base.finish.diameter);
            // What it leaves is asked for with stairs as high as the finish tool may follow.
            const double stairs =
                std::clamp(allowed, std::min(rough.stepdown_min, height), rough.stepdown_max);
            if (left(rough, stairs, swath).nothing(job_.selection.voxel)) continue;
            const auto semi = std::find_if(flats_.begin(), flats_.end(), [&](const Tool& flat) {
                return flat.diameter <= kMuchNarrower * rough.diameter;
            });
            if (semi != flats_.end() && semi->diameter >= base.finish.diameter / 2 - 1e-9)
                tools.semi_rough = {*semi};
        }
        return sets;
    }

private:
    ToolCandidate& note(const char* purpose, const Tool& tool) {
        choice_.record.candidates.push_back({purpose, tool.number, false, {}, {}, {}, {}, ""});
        return choice_.record.candidates.back();
    }

    // Asks for AR from the largest tool down until one has enough.
    const Tool& first_that_reaches(const std::vector<Tool>& tools, const char* purpose,
                                   const std::function<double(const Tool&)>& stepdown) {
        const double threshold = job_.selection.threshold;
        for (const Tool& tool : tools) {
            const double ar = ratio_
                                  ? ratio_(tool)
                                  : voxels_->reached_share(
                                        context_, tool.diameter / 2,
                                        std::max(1, static_cast<int>(kSectionStep / job_.selection.voxel)));
            ToolCandidate& candidate = note(purpose, tool);
            candidate.accessibility = ar;
            candidate.stepdown = stepdown(tool);
            const bool last = &tool == &tools.back();
            candidate.chosen = ar >= threshold || last;
            if (ar >= threshold) candidate.reason = "the largest that reaches enough";
            else if (last)
                candidate.reason =
                    fmt::format("none reaches the share of {:.4g}; this is the smallest", threshold);
            else
                candidate.reason =
                    fmt::format("reaches {:.4g} of the surface, less than {:.4g}", ar, threshold);
            if (candidate.chosen) return tool;
        }
        return tools.back();
    }

    void choose_one_flat() {
        // A bull-nose leaves its corners at the foot of every wall: where there is a flat, that does it all.
        const std::vector<Tool> sharp = falling(job_, ToolKind::flat);
        Tool flat = first_that_reaches(sharp.empty() ? flats_ : sharp, "rough",
                                       [](const Tool& t) { return t.stepdown_max; });
        flat.stepdown_min = flat.stepdown_max;
        choice_.record.candidates.back().reason +=
            "; every wall is upright, so it cuts all, at its largest stepdown";
        choice_.tools.rough = flat;
        // What little a flat leaves anywhere is for a ball that goes where the flat goes.
        choice_.tools.finish = balls_.back();
        for (const Tool& ball : balls_)
            if (ball.diameter <= flat.diameter + 1e-9) {
                choice_.tools.finish = ball;
                break;
            }
    }

    void choose_finish(double least) {
        auto stepdown = [&](const Tool& ball) {
            return std::min(ball_level_stepdown(ball.diameter / 2, least, job_.tolerances.cusp),
                            ball.stepdown_max);
        };
        choice_.tools.finish = first_that_reaches(balls_, "finish", stepdown);
        const double r = choice_.tools.finish.diameter / 2;
        choice_.record.finish_stepdown = stepdown(choice_.tools.finish);
        choice_.record.finish_stepdown_printed = ball_level_stepdown_printed(r, least, job_.tolerances.cusp);
    }

    // The voxels of the layer, and the length of its sections by height.
    void measure() {
        const VoxelBox box =
            voxel_box({layer_.stock_min[0], layer_.stock_min[1], layer_.z_bottom},
                      {layer_.stock_max[0], layer_.stock_max[1], layer_.z_top}, job_.selection.voxel);
        std::vector<Plane> planes;
        for (int k = 0; k < box.nz; ++k) planes.push_back({std::min(box.z(k), layer_.z_top), Side::below});
        std::vector<Section> sections = slice(context_, layer_.mesh, planes, {job_.tolerances.gap});
        std::vector<Loops> loops;
        for (Section& section : sections) loops.push_back(std::move(section.loops));
        for (const Loops& l : loops) length_.push_back(perimeter(l));
        if (!layer_.opening.empty()) {
            Loops stock;
            const Point2 low{to_units(layer_.stock_min[0]), to_units(layer_.stock_min[1])},
                high{to_units(layer_.stock_max[0]), to_units(layer_.stock_max[1])};
            stock.points = {low, {high.x, low.y}, high, {low.x, high.y}};
            stock.close_loop();
            const Loops frame = subtract(stock, layer_.opening);
            for (Loops& l : loops) l = unite(l, frame);
        }
        voxels_.emplace(context_, box, loops, flats_.front().diameter / 2 + job_.cutting.wall_allowance);
    }

    [[nodiscard]] RoughLeft left(const Tool& flat, double stepdown, double swath) {
        LayerVoxels::Roughing roughing{flat.diameter / 2,
                                       job_.cutting.wall_allowance,
                                       even_levels(layer_.z_top, layer_.z_bottom, floors_, stepdown),
                                       {}};
        for (const Tool& wider : flats_)
            if (wider.diameter > flat.diameter + 1e-9) roughing.wider.push_back(wider.diameter / 2);
        return voxels_->left(context_, roughing, swath);
    }

    // The largest stepdown of [low, high] at which nothing is left, when nothing is at `low` and something at
    // `high`.
    [[nodiscard]] double halve(const Tool& flat, double low, double high, double swath) {
        while (high - low > kFinestStep) {
            const double middle = (low + high) / 2;
            (left(flat, middle, swath).nothing(job_.selection.voxel) ? low : high) = middle;
        }
        return low;
    }

    // t_r = Σ A_i / (2R·f) (LUO eq. 3), in minutes.
    [[nodiscard]] double rough_minutes(const Tool& flat, double stepdown) const {
        double area = 0;
        for (const double tip : even_levels(layer_.z_top, layer_.z_bottom, floors_, stepdown))
            area += voxels_->area_to_clear(tip);
        return area / (flat.diameter * std::min(flat.max_feed, job_.machine.max_feed));
    }
    // t_f = L_c / f (LUO eq. 4) of a contour along every section, and the change of tool, in minutes.
    [[nodiscard]] double semi_minutes(const Tool& flat, double stepdown) const {
        double contours = 0;
        for (const double tip : even_levels(layer_.z_top, layer_.z_bottom, floors_, stepdown)) {
            const auto k = static_cast<std::size_t>(std::clamp((tip - layer_.z_bottom) / job_.selection.voxel,
                                                               0.0, static_cast<double>(length_.size() - 1)));
            contours += length_[k];
        }
        return contours / std::min(flat.max_feed, job_.machine.max_feed) +
               (job_.machine.tool_change_s + job_.machine.spindle_dwell_s) / 60;
    }

    // LUO 5.5.3.3: whether a flat leaves nothing outside the swath at some stepdown of its range; sets it.
    // Print also looks past what the slopes allow; its example does not, nor does this.
    bool fits(Tool& flat, double allowed, double swath, ToolCandidate& candidate) {
        if (flat.stepdown_min > allowed + 1e-9) {
            candidate.reason =
                fmt::format("its least stepdown is {:.3f} mm, more than the {:.3f} mm that the slopes allow",
                            flat.stepdown_min, allowed);
            return false;
        }
        const double first = std::min(allowed, flat.stepdown_max);
        const RoughLeft there = left(flat, first, swath);
        candidate.stepdown = first;
        candidate.semi_rough_mm2 = there.area;
        double stepdown = first;
        if (!there.nothing(job_.selection.voxel)) {
            const double least = std::max(flat.stepdown_min, std::min(first, job_.cutting.min_stepdown));
            const RoughLeft at_least = left(flat, least, swath);
            if (!at_least.nothing(job_.selection.voxel)) {
                candidate.semi_rough_mm2 = at_least.area;
                candidate.stepdown = least;
                candidate.reason = fmt::format(
                    "leaves {:.1f} mm² that the next cutter's swath of {:.2f} mm does not take, as at x "
                    "{:.1f} y {:.1f} z {:.1f}",
                    at_least.area, swath, at_least.where[0], at_least.where[1], at_least.where[2]);
                return false;
            }
            stepdown = halve(flat, least, first, swath);
        }
        candidate.stepdown = stepdown;
        candidate.semi_rough_mm2 = 0;
        flat.stepdown_min = flat.stepdown_max = stepdown;
        return true;
    }

    void choose_rough(double least) {
        LayerTools& tools = choice_.tools;
        const double finish_r = tools.finish.diameter / 2;
        double cusp = job_.tolerances.rough_cusp;
        if (job_.selection.rough_limit == RoughLimit::finish_radius) cusp = finish_r;
        if (job_.selection.rough_limit == RoughLimit::smaller) cusp = std::min(cusp, finish_r);
        const double unlimited = flat_level_stepdown(least, cusp), height = layer_.z_top - layer_.z_bottom;
        choice_.record.rough_stepdown = std::isfinite(unlimited) ? unlimited : 0;

        // Where the slopes allow no wider flat its least stepdown, that of L = R_f does, and last the least
        // stepdowns themselves: steps under what a tool is made for only waste time, and the swath tells what
        // may be left.
        std::optional<Tool> rough;
        double allowed = 0;
        std::vector<std::pair<Tool, std::size_t>> waiting;  // with the place of its note
        for (const Tool& flat : flats_)
            if (flat.diameter > tools.finish.diameter + 1e-9) {
                waiting.emplace_back(flat, choice_.record.candidates.size());
                note("rough", flat).reason = "a larger one was chosen";
            }
        for (const double limit :
             {unlimited, std::max(unlimited, flat_level_stepdown(least, finish_r)), height}) {
            allowed = std::min(limit, height);
            for (std::size_t w = 0; w < waiting.size() && !rough;) {
                Tool flat = waiting[w].first;
                ToolCandidate& candidate = choice_.record.candidates[waiting[w].second];
                if (!fits(flat, allowed, tools.finish.diameter, candidate)) {
                    if (candidate.semi_rough_mm2)
                        waiting.erase(waiting.begin() + static_cast<std::ptrdiff_t>(w));
                    else ++w;
                    continue;
                }
                candidate.chosen = true;
                candidate.minutes = rough_minutes(flat, flat.stepdown_max);
                candidate.reason = "the largest of which nothing is left for a semi-roughing";
                rough = flat;
            }
            if (rough || waiting.empty()) break;
        }
        if (!rough) {
            // The twin of the finish tool, or the next smaller flat.
            const auto twin = std::find_if(flats_.begin(), flats_.end(), [&](const Tool& t) {
                return t.diameter <= tools.finish.diameter + 1e-9;
            });
            rough = twin != flats_.end() ? *twin : flats_.back();
            rough->stepdown_min = rough->stepdown_max = std::min(allowed, rough->stepdown_max);
            ToolCandidate& candidate = note("rough", *rough);
            candidate.chosen = true;
            candidate.stepdown = rough->stepdown_max;
            candidate.semi_rough_mm2 = left(*rough, rough->stepdown_max, tools.finish.diameter).area;
            candidate.minutes = rough_minutes(*rough, rough->stepdown_max);
            candidate.reason =
                "no larger flat leaves so little that the finish tool's swath takes it; as wide as the "
                "finish tool";
        }
        tools.rough = *rough;
        if (job_.selection.semi_rough) choose_semi_rough(allowed);
    }

    // LUO 5.5.3.4, with the roughing tool as the one that follows. It keeps the wall allowance as roughing
    // does, so its swath reaches that much farther than its diameter.
    void choose_semi_rough(double allowed) {
        LayerTools& tools = choice_.tools;
        const Tool semi = tools.rough;
        const double before = rough_minutes(semi, semi.stepdown_max),
                     after = semi_minutes(semi, semi.stepdown_max);
        for (Tool flat : flats_) {
            if (flat.diameter <= semi.diameter + 1e-9) break;
            ToolCandidate& candidate = note("semi_rough", flat);
            if (!fits(flat, allowed, semi.diameter + job_.cutting.wall_allowance, candidate)) continue;
            const double minutes = rough_minutes(flat, flat.stepdown_max) + after;
            candidate.minutes = minutes;
            if (minutes >= before) {
                candidate.reason = fmt::format(
                    "with tool {} after it, it takes {:.2f} min, no less than the {:.2f} min of that tool "
                    "alone",
                    semi.number, minutes, before);
                continue;
            }
            candidate.chosen = true;
            candidate.reason =
                fmt::format("roughs, and tool {} follows where it did not fit: {:.2f} min in place of {:.2f}",
                            semi.number, minutes, before);
            tools.rough = flat;
            tools.semi_rough = {semi};
            return;
        }
    }

    Context& context_;
    const LayerJob& layer_;
    const Job& job_;
    const ReachRatio ratio_;
    std::vector<Tool> flats_, balls_;  // flats_: bull-noses too, which rough as the flats around them
    std::vector<double> floors_;
    std::optional<LayerVoxels> voxels_;
    std::vector<double> length_;  // of the sections, by slice of voxels
    ToolChoice choice_;
};

}  // namespace

bool selects_tools(const Job& job) {
    return job.selection.mode == SelectionMode::select &&
           (falling(job, roughs_layers).size() > 1 || falling(job, ToolKind::ball).size() > 1);
}

Overrun overrun_of(const Job& job) {
    Overrun overrun{fixed_tools(job).finish.diameter / 2, 0};
    if (selects_tools(job))
        for (const Tool& tool : job.tools)
            if (tool.kind == ToolKind::ball) overrun.below = std::max(overrun.below, tool.diameter / 2);
    const Machine& machine = job.machine;
    overrun.board = board_cut_limit(machine, job.tools);
    if (machine.base_board_cut < 0) overrun.board = std::min(overrun.board, overrun.below);
    return overrun;
}

std::optional<LayerTools> with_wider_finish(const Job& job, LayerTools tools) {
    std::optional<Tool> wider;
    for (const Tool& ball : falling(job, ToolKind::ball))
        if (ball.diameter > tools.finish.diameter + 1e-9) wider = ball;
    if (!wider) return std::nullopt;
    tools.finish = *wider;
    tools.rest = rest_tools(job, tools.rough, wider->diameter);
    return tools;
}

ToolChoice select_tools(Context& context, const LayerJob& layer, const ReachRatio& ratio) {
    return Chooser(context, layer, ratio).run();
}

std::vector<LayerTools> with_wider_rough(Context& context, const LayerJob& layer, const LayerTools& tools) {
    return Chooser(context, layer, {}).wider_rough(tools);
}

std::vector<double> even_levels(double z_top, double z_bottom, std::span<const double> floors,
                                double stepdown) {
    std::vector<double> fixed(floors.begin(), floors.end());
    fixed.push_back(z_bottom);
    std::sort(fixed.begin(), fixed.end(), std::greater<>());
    std::vector<double> tips;
    double z = z_top;
    for (const double f : fixed) {
        if (f >= z - 1e-3 || f < z_bottom) continue;
        const int count = std::max(1, static_cast<int>(std::ceil((z - f) / stepdown - 1e-9)));
        for (int k = 1; k <= count; ++k) tips.push_back(k == count ? f : z - (z - f) * k / count);
        z = f;
    }
    return tips;
}

}  // namespace slabwright
