// Roughing: level by level from the top, in rings around what the shadow forbids or in zigzags and then once
// along its border. A level or, in rings, a terrace lies on every up-facing flat (plus allowance) and on the
// layer's bottom; between them the stepdowns of section 5. The last level cuts the slab through where nothing
// lies under it, so it goes in rings that leave what hangs over held to the end. What lies open goes to the
// face mill (open_waste.h). Where a cutter meets more of its breadth than the job allows, the feed is lowered
// (engagement.h).
#include "engine/paths/operations/roughing.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "engine/paths/operations/open_waste.h"
#include "engine/paths/runs/feet.h"
#include "engine/paths/runs/kept_off.h"
#include "engine/paths/runs/layer_cut.h"
#include "engine/paths/runs/rings.h"
#include "engine/paths/runs/tolerances.h"
#include "engine/paths/runs/zigzag.h"
#include "engine/stock/engagement.h"
#include "kernels/cutting/cusp.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr double kContourError =
    0.03;  // mm by which the contours of two levels may stand apart on a vertical wall
constexpr double kOffsetError = 0.01;  // mm
constexpr double kOnBorder =
    0.02;  // mm by which the ring next to what is forbidden keeps to its border (plan_rings)
constexpr double kMoreThanStep =
    1.0;  // mm that a terrace's border ring may meet beyond the step between rings

// Whether a flat end mill comes down to a floor anywhere, by places a third of its radius apart.
bool stands_on(const LayerCut& cut, const Tool& tool, double floor) {
    const double r = tool.diameter / 2, step = r / 3;
    const DropIndex& part = cut.drops(flat_cutter(r));
    for (const SolidFacet& f : floor_facets(cut, floor)) {
        const auto [x0, x1] = std::minmax({f.p[0][0], f.p[1][0], f.p[2][0]});
        const auto [y0, y1] = std::minmax({f.p[0][1], f.p[1][1], f.p[2][1]});
        // Also beside the facet, for most of a small one's cutter stands over others.
        for (double y = std::floor(y0 / step) * step; y <= y1 + step; y += step)
            for (double x = std::floor(x0 / step) * step; x <= x1 + step; x += step)
                if (const Rest rest = part.drop(x, y);
                    rest.tip_z <= floor + 1e-3 && rest.tip_z >= floor - kSameFloor)
                    return true;
    }
    return false;
}

// The layer's bottom, or what the flat that the boundary lies on shows above it by rounding: where that
// forbade the bottom's level all of the slab over the flat would be left standing, and no glue holds it.
double lowest_level(const LayerCut& cut) {
    const double bottom = cut.layer.z_bottom;
    double lowest = bottom;
    for (const SolidFacet& f : cut.solid.facets)
        if (f.z_max < bottom + kSameFloor) lowest = std::max(lowest, f.z_max);
    return lowest;
}

// Where a level must lie: a floor of the flat end mill, or the bottom of what is cut, from which `floor` is
// kept (mm).
std::vector<RoughLevel> fixed_levels(const LayerCut& cut, const Tool& tool, double floor) {
    const double bottom = lowest_level(cut);
    std::vector<RoughLevel> fixed;
    for (const double z : cut.floors)
        if (z > bottom && z + floor < cut.layer.z_top &&
            (!clears_on_contours(cut.job) || stands_on(cut, tool, z)))
            fixed.push_back({z + floor, z});
    fixed.push_back({bottom, bottom});
    std::sort(fixed.begin(), fixed.end(),
              [](const RoughLevel& a, const RoughLevel& b) { return a.tip > b.tip; });
    return fixed;
}

// From `top` down to fixed levels (descending) the steps that slopes and the tool allow.
// Nothing below `lowest` is spared.
std::vector<RoughLevel> stepped(const LayerCut& cut, const Tool& tool, double floor, double top,
                                std::span<const RoughLevel> fixed, double lowest, double cusp) {
    std::vector<RoughLevel> levels;
    double z = top;
    for (const RoughLevel& f : fixed) {
        if (!levels.empty() && levels.back().tip - f.tip < 1e-3) continue;
        while (z - f.tip > 1e-9) {
            // The flattest slope decides, within what the tool may take; the last steps before a fixed level
            // are even.
            const double alpha = cut.least_slope(z - tool.stepdown_max, z,
                                                 cut.job.cutting.steep_limit_deg * std::numbers::pi / 180);
            const double step =
                std::clamp(flat_level_stepdown(alpha, cusp), tool.stepdown_min, tool.stepdown_max);
            const double count = std::ceil((z - f.tip) / step - 1e-9);
            if (count <= 1) break;
            z -= (z - f.tip) / count;
            levels.push_back({z, std::max(lowest, z - floor)});
        }
        levels.push_back(f);
        z = f.tip;
    }
    return levels;
}

}  // namespace

std::vector<RoughLevel> rough_levels(const LayerCut& cut, const Tool& tool, double floor, double cusp) {
    const std::vector<RoughLevel> fixed = fixed_levels(cut, tool, floor);
    return stepped(cut, tool, floor, cut.layer.z_top, fixed, fixed.back().tip, cusp);
}

std::vector<RoughStep> terraced_steps(const LayerCut& cut, const Tool& tool, double floor, double cusp,
                                      const RoughSteps& wood) {
    const std::vector<RoughLevel> fixed = fixed_levels(cut, tool, floor);
    const double top = cut.layer.z_top, bottom = fixed.back().tip;
    std::vector<double> tips{bottom};
    for (int k = 0; k < wood.last_count && top - tips.back() > 1.5 * wood.last; ++k)
        tips.push_back(tips.back() + wood.last);
    const double rest = top - tips.back();
    const double deepest = wood.deepest > 0 ? std::min(tool.stepdown_max, wood.deepest) : tool.stepdown_max;
    const int count = static_cast<int>(std::ceil(rest / deepest - 1e-9));
    for (int k = 1; k < count; ++k) tips.push_back(top - rest * (count - k) / count);
    std::vector<RoughStep> steps;
    double above = top;
    for (std::size_t k = tips.size(); k-- > 0;) {
        const double z = tips[k];
        std::vector<RoughLevel> between;
        for (const RoughLevel& f : fixed)
            if (f.tip < above - 1e-3 && f.tip > z + 1e-3) between.push_back(f);
        between.push_back({z, std::max(bottom, z - floor)});
        const std::vector<RoughLevel> levels = stepped(cut, tool, floor, above, between, bottom, cusp);
        const std::size_t lowest = steps.size();
        for (std::size_t i = levels.size(); i-- > 0;) steps.push_back({levels[i], above, lowest});
        above = z;
    }
    return steps;
}

namespace {

// Every level clears all that is free at its height.
std::vector<RoughStep> level_steps(const LayerCut& cut, const Tool& tool, double floor) {
    std::vector<RoughStep> steps;
    double above = cut.layer.z_top;
    for (const RoughLevel& level : rough_levels(cut, tool, floor, cut.job.tolerances.rough_cusp)) {
        steps.push_back({level, above, steps.size()});
        above = level.tip;
    }
    return steps;
}

// How far inside what is forbidden at its floor a terrace's border must lie for a terrace to be of use, mm:
// on slopes so steep that the whole depth of cut leaves less than the cusp of roughing, it is nearer.
double least_width(const RoughStep& terrace, const RoughStep& floor, double cusp) {
    const double share =
        cusp / (floor.above - floor.level.tip);  // cos α of the steepest slope that needs terraces
    return kContourError +
           (share < 1 ? (terrace.level.tip - floor.level.tip) * share / std::sqrt(1 - share * share) : 1e3);
}

// The levels of one layer, from their borders to moves.
class Roughing {
public:
    explicit Roughing(const LayerCut& cut)
        : cut_(cut),
          tool_(cut.layer.tools.rough),
          contour_(cut.job.cutting.rough_pattern == RoughPattern::contour),
          r_(tool_.diameter / 2),
          cutter_(flat_cutter(r_ + kept_off_walls(cut.job.cutting))),
          op_(cut.operation(OperationKind::rough, contour_ ? "contour-parallel levels" : "zigzag levels",
                            tool_)),
          steps_(contour_ ? terraced_steps(cut, tool_, cut.job.cutting.floor_allowance,
                                           cut.job.tolerances.rough_cusp, cut.layer.rough_steps)
                          : level_steps(cut, tool_, cut.job.cutting.floor_allowance)),
          last_(steps_.back().floor) {
        op_.blend = rough_blend(cut.job);
        if (cut.job.cutting.max_engagement < 1)
            stock_.emplace(cut.layer.stock_min, cut.layer.stock_max, std::min(cut.stock_top, cut.layer.z_top),
                           r_);
    }

    std::vector<Operation> run() {
        lay_lines();
        find_borders();
        clear_open();
        std::vector<Level> cuts(steps_.size());
        parallel_each(cut_.context, steps_.size(), [&](std::size_t i) { cuts[i] = plan_level(i); });
        lay_paths(cuts);
        if (stock_ && op_.stepdown > 0) {
            stock_->change_cutter(r_);
            cap_engagement(cut_.context, op_.moves, *stock_,
                           {cut_.job.cutting.max_engagement, tool_.diameter, op_.stepdown});
        }
        std::vector<Operation> operations;
        if (!cleared_.moves.empty()) operations.push_back(std::move(cleared_));
        operations.push_back(std::move(op_));
        return operations;
    }

private:
    struct Level {
        RingPlan rings;
        std::vector<std::vector<Stretch>> free;  // where no rings are cut
    };

    // Lines from edge to edge of the stock, evenly spaced.
    void lay_lines() {
        const double low = cut_.layer.stock_min[1], depth = cut_.layer.stock_max[1] - low;
        const int gaps = std::max(1, static_cast<int>(std::ceil(depth / clearing_step(tool_) - 1e-9)));
        for (int k = 0; k <= gaps; ++k) lines_.push_back(to_units(low + depth * k / gaps));
        between_lines_ = depth / gaps;
    }

    // What each level may not enter.
    void find_borders() {
        std::vector<double> spare;
        for (const RoughStep& s : steps_) spare.push_back(s.level.spare);
        inside_ = cut_.insides(cutter_, spare);
        const FibreGrid grid = fibre_grid(cut_.solid, cutter_, pitch_);
        const bool flask = !cut_.layer.opening.empty();
        // A ring may leave its border, and an arc the ring.
        const double off_flask =
            r_ + kOnBorder + arc_tolerance_units(cut_.job, OperationKind::rough) / kUnitsPerMm;
        if (flask) room_ = flask_room(cut_, off_flask);
        std::vector<FibreLevel> heights;
        for (std::size_t i = 0; i < steps_.size(); ++i)
            heights.push_back({steps_[i].level.spare, &inside_[i].loops});
        borders_ = level_contours(cut_.context, cut_.solid, heights, cutter_, grid);
        forbidden_at_.resize(steps_.size());
        const Loops beyond = flask ? beyond_room(cut_, off_flask, room_) : Loops{};
        parallel_each(cut_.context, steps_.size(), [&](std::size_t i) {
            forbidden_at_[i] = simplify(forbidden_region(borders_[i]));
            if (flask) forbidden_at_[i] = unite(forbidden_at_[i], beyond);
        });
    }

    // What lies open goes to the face mill.
    void clear_open() {
        open_.resize(steps_.size());
        const Tool* face = open_waste_tool(cut_);
        if (face == nullptr) return;
        parallel_each(cut_.context, steps_.size(), [&](std::size_t i) {
            if (steps_[i].floor == i)
                open_[i] = plan_open_level(cut_, *face, tool_, forbidden_at_[i], steps_[i].level.tip,
                                           steps_[i].above, i == last_);
        });
        leave_below_first_gap(open_);
        cleared_ = clear_open_waste(cut_, *face, open_, stock_ ? &*stock_ : nullptr);
    }

    [[nodiscard]] Level plan_level(std::size_t i) const {
        Level level;
        const double tip = steps_[i].level.tip;
        if (const std::size_t floor = steps_[i].floor; floor != i) {
            const double width = least_width(steps_[i], steps_[floor], cut_.job.tolerances.rough_cusp);
            level.rings = plan_terrace(
                cut_, tool_, forbidden_at_[i], offset_outline(forbidden_at_[floor], -width, kOffsetError),
                offset_outline(forbidden_at_[i - 1], -kMoreThanStep, kOffsetError), tip, op_.blend);
            return level;
        }
        if (!cleared_.moves.empty() && !open_[i].left.empty()) {
            level.rings =
                plan_terrace(cut_, tool_, forbidden_at_[i], open_[i].left, open_[i].left, tip, op_.blend);
            return level;
        }
        if (i == last_ || contour_) {
            level.rings = plan_rings(cut_, tool_, forbidden_at_[i], tip, op_.blend, i == last_);
            if (!level.rings.pieces.empty()) return level;
        }
        const Fibres forbidden = forbidden_on(i, Axis::x, lines_);
        const double from = cut_.low(0, r_ + 2), to = cut_.high(0, r_ + 2);
        for (std::size_t l = 0; l < lines_.size(); ++l)
            level.free.push_back(free_stretches(forbidden.line(l), from, to, 0.2));
        return level;
    }
    [[nodiscard]] Fibres forbidden_on(std::size_t i, Axis axis, std::span<const std::int32_t> lines) const {
        return beside_flask(
            cut_, room_,
            fibres(cut_.context, cut_.solid, inside_[i].loops, cutter_, steps_[i].level.spare, axis, lines),
            axis, lines);
    }

    void lay_paths(std::vector<Level>& cuts) {
        PathBuilder path(op_, tool_, std::min(tool_.max_feed, cut_.job.machine.max_feed),
                         cut_.layer.z_top + cut_.job.machine.clearance, cut_.layer.z_top + 2);
        const DropIndex part(cut_.solid, cutter_);
        Surroundings around = cut_.around(tool_, &part);
        for (std::size_t i = 0; i < steps_.size(); ++i)
            if (!cuts[i].rings.pieces.empty() || !cuts[i].free.empty())
                around.deepest = std::max(around.deepest, steps_[i].above - steps_[i].level.tip);
        path.set_surroundings(around);
        for (std::size_t i = 0; i < steps_.size(); ++i) {
            const double down = steps_[i].above - steps_[i].level.tip;
            if (!cuts[i].rings.pieces.empty()) {
                op_.stepdown = std::max(op_.stepdown, down);
                op_.stepover = std::max(op_.stepover, cuts[i].rings.widest_step());
                clear_from_afar(path, cut_, std::move(cuts[i].rings));
                continue;
            }
            if (cuts[i].free.empty()) continue;  // rings, of which none were of use
            op_.stepdown = std::max(op_.stepdown, down);
            op_.stepover = std::max(op_.stepover, between_lines_);
            zigzag(path, cut_, tool_, lines_, cuts[i].free, steps_[i].level.tip,
                   [&](std::span<const std::int32_t> at) { return forbidden_on(i, Axis::y, at); });
            follow_border(path, i);
            follow_flask(path, i);
        }
        path.finish();
    }

    // Where along a loop of a border a zigzag line has come nearest, and how near, 0.1 µm.
    struct Nearest {
        std::size_t point = 0;
        std::int64_t away = INT64_MAX;
    };
    [[nodiscard]] Nearest nearest_line(std::span<const Point2> points) const {
        Nearest nearest;
        for (std::size_t k = 0; k < points.size(); ++k) {
            const auto it = std::lower_bound(lines_.begin(), lines_.end(), points[k].y);
            for (const auto l : {it, it == lines_.begin() ? it : std::prev(it)}) {
                if (l == lines_.end()) continue;
                const std::int64_t d = std::abs(std::int64_t{*l} - points[k].y);
                if (d < nearest.away) nearest = {k, d};
            }
        }
        return nearest;
    }
    [[nodiscard]] bool in_stock(Point2 p) const {
        return to_mm(p.x) > cut_.layer.stock_min[0] - r_ && to_mm(p.x) < cut_.layer.stock_max[0] + r_ &&
               to_mm(p.y) > cut_.layer.stock_min[1] - r_ && to_mm(p.y) < cut_.layer.stock_max[1] + r_;
    }

    // Along the border, begun where a zigzag line ends and the cutter has been already.
    void follow_border(PathBuilder& path, std::size_t i) const {
        const Contours& border = borders_[i];
        const std::int32_t z = to_units(steps_[i].level.tip);
        for (std::size_t c = 0; c < border.size(); ++c) {
            const auto points =
                std::span(border.points).subspan(border.starts[c], border.starts[c + 1] - border.starts[c]);
            if (points.size() < 3) continue;
            if (std::none_of(points.begin(), points.end(), [&](Point2 p) { return in_stock(p); })) continue;
            const Nearest nearest = nearest_line(points);
            std::vector<PathPoint> line;
            for (std::size_t k = 0; k <= points.size(); ++k) {
                const Point2 p = points[(nearest.point + k) % points.size()];
                line.push_back({p.x, p.y, z});
            }
            const std::vector<PathPoint> ring = simplify(line, 0.02 * kUnitsPerMm);
            path.go_above({ring[0].x, ring[0].y});
            if (nearest.away > 2 * std::int64_t{pitch_})  // a pocket that no line met
                cut_ring(path, ring, to_units(steps_[i].above), z, cut_.job.cutting.ramp_deg);
            else path.follow(ring);
        }
    }

    // Along the flask, which is finished with that.
    void follow_flask(PathBuilder& path, std::size_t i) const {
        const std::int32_t z = to_units(steps_[i].level.tip);
        for (std::size_t l = 0; l < room_.size(); ++l) {
            std::vector<PathPoint> ring;
            for (const Point2 p : room_.loop(l)) ring.push_back({p.x, p.y, z});
            ring.push_back(ring.front());
            path.go_above({ring[0].x, ring[0].y});
            cut_ring(path, ring, to_units(steps_[i].above), z, cut_.job.cutting.ramp_deg);
        }
    }

    const LayerCut& cut_;
    const Tool& tool_;
    const bool contour_;
    const double r_;
    const CutterShape cutter_;
    Operation op_;
    const std::vector<RoughStep> steps_;
    const std::size_t last_;  // cuts the slab through
    std::vector<std::int32_t> lines_;
    double between_lines_ = 0;  // mm
    // Contours of the border may be coarser than a finish pass: what their chords miss must stay well inside
    // the allowance.
    const std::int32_t pitch_ = safe_pitch(r_, std::max(0.01, 0.2 * cut_.job.cutting.wall_allowance));
    std::optional<EngagedStock> stock_;
    Loops room_;  // beside the flask
    std::vector<Section> inside_;
    std::vector<Contours> borders_;
    std::vector<Loops> forbidden_at_;
    std::vector<OpenLevel> open_;
    Operation cleared_;  // by the face mill
};

}  // namespace

std::vector<Operation> rough_layer(const LayerCut& cut) { return Roughing(cut).run(); }

}  // namespace slabwright
