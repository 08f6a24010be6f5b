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
    const DropIndex& part = cut.drops({Cutter::Profile::flat, r});
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

// Where a level must lie: a floor of the flat end mill, or the bottom of what is cut, from which `floor` is
// kept (mm).
std::vector<RoughLevel> fixed_levels(const LayerCut& cut, const Tool& tool, double floor) {
    const double bottom = cut.layer.z_bottom;
    std::vector<RoughLevel> fixed;
    for (const double z : cut.floors)
        if (z + floor < cut.layer.z_top && (!clears_on_contours(cut.job) || stands_on(cut, tool, z)))
            fixed.push_back({z + floor, z});
    fixed.push_back({bottom, bottom});
    std::sort(fixed.begin(), fixed.end(),
              [](const RoughLevel& a, const RoughLevel& b) { return a.tip > b.tip; });
    return fixed;
}

// From `top` down to fixed levels (descending) the steps that slopes and the tool allow.
std::vector<RoughLevel> stepped(const LayerCut& cut, const Tool& tool, double floor, double top,
                                std::span<const RoughLevel> fixed) {
    std::vector<RoughLevel> levels;
    double z = top;
    for (const RoughLevel& f : fixed) {
        if (!levels.empty() && levels.back().tip - f.tip < 1e-3) continue;
        while (z - f.tip > 1e-9) {
            // The flattest slope decides, within what the tool may take; the last steps before a fixed level
            // are even.
            const double alpha = cut.least_slope(z - tool.stepdown_max, z,
                                                 cut.job.cutting.steep_limit_deg * std::numbers::pi / 180);
            const double step = std::clamp(flat_level_stepdown(alpha, cut.job.tolerances.rough_cusp),
                                           tool.stepdown_min, tool.stepdown_max);
            const double count = std::ceil((z - f.tip) / step - 1e-9);
            if (count <= 1) break;
            z -= (z - f.tip) / count;
            levels.push_back({z, std::max(cut.layer.z_bottom, z - floor)});
        }
        levels.push_back(f);
        z = f.tip;
    }
    return levels;
}

}  // namespace

std::vector<RoughLevel> rough_levels(const LayerCut& cut, const Tool& tool, double floor) {
    return stepped(cut, tool, floor, cut.layer.z_top, fixed_levels(cut, tool, floor));
}

namespace {

// A level, and what has been cleared when it is cut.
struct RoughStep {
    RoughLevel level;
    double above = 0;  // mm: what stands there stands this high
    std::size_t floor =
        0;  // of a terrace: the step that has cleared what is free at a lower height; of others: itself
};

// Every level clears all that is free at its height.
std::vector<RoughStep> level_steps(const LayerCut& cut, const Tool& tool, double floor) {
    std::vector<RoughStep> steps;
    double above = cut.layer.z_top;
    for (const RoughLevel& level : rough_levels(cut, tool, floor)) {
        steps.push_back({level, above, steps.size()});
        above = level.tip;
    }
    return steps;
}

// Even levels, as deep as the tool may cut (but see LayerJob::last_steps), and over each of them terraces
// where stepped() puts levels, from below: what is cut there are only the slopes and floors that the level
// has left standing.
std::vector<RoughStep> terraced_steps(const LayerCut& cut, const Tool& tool, double floor) {
    const std::vector<RoughLevel> fixed = fixed_levels(cut, tool, floor);
    const double top = cut.layer.z_top, bottom = cut.layer.z_bottom;
    std::vector<double> tips{bottom};
    if (const double shallow = cut.layer.last_steps; shallow > 0)
        for (int k = 0; k < 2 && top - tips.back() > 1.5 * shallow; ++k)
            tips.push_back(tips.back() + shallow);
    const double rest = top - tips.back();
    const int count = static_cast<int>(std::ceil(rest / tool.stepdown_max - 1e-9));
    for (int k = 1; k < count; ++k) tips.push_back(top - rest * (count - k) / count);
    std::vector<RoughStep> steps;
    double above = top;
    for (std::size_t k = tips.size(); k-- > 0;) {
        const double z = tips[k];
        std::vector<RoughLevel> between;
        for (const RoughLevel& f : fixed)
            if (f.tip < above - 1e-3 && f.tip > z + 1e-3) between.push_back(f);
        between.push_back({z, std::max(bottom, z - floor)});
        const std::vector<RoughLevel> levels = stepped(cut, tool, floor, above, between);
        const std::size_t lowest = steps.size();
        for (std::size_t i = levels.size(); i-- > 0;) steps.push_back({levels[i], above, lowest});
        above = z;
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

}  // namespace

std::vector<Operation> rough_layer(const LayerCut& cut) {
    const Tool& tool = cut.layer.tools.rough;
    const bool contour = cut.job.cutting.rough_pattern == RoughPattern::contour;
    Operation op =
        cut.operation(OperationKind::rough, contour ? "contour-parallel levels" : "zigzag levels", tool);
    op.blend = rough_blend(cut.job);
    const double r = tool.diameter / 2, clearance = cut.layer.z_top + cut.job.machine.clearance;
    const Cutter cutter{Cutter::Profile::flat, r + kept_off_walls(cut.job.cutting)};
    const double allowance = cut.job.cutting.floor_allowance;
    const std::vector<RoughStep> steps =
        contour ? terraced_steps(cut, tool, allowance) : level_steps(cut, tool, allowance);
    const std::size_t last = steps.back().floor;  // cuts the slab through
    std::vector<double> spare;
    for (const RoughStep& s : steps) spare.push_back(s.level.spare);
    const std::vector<Section> inside = cut.insides(cutter, spare);

    // Lines from edge to edge of the stock, evenly spaced.
    const double depth = cut.layer.stock_max[1] - cut.layer.stock_min[1];
    const int gaps = std::max(1, static_cast<int>(std::ceil(depth / clearing_step(tool) - 1e-9)));
    std::vector<std::int32_t> lines;
    for (int k = 0; k <= gaps; ++k) lines.push_back(to_units(cut.layer.stock_min[1] + depth * k / gaps));
    // Contours of the border may be coarser than a finish pass: what their chords miss must stay well inside
    // the allowance.
    const std::int32_t pitch = safe_pitch(r, std::max(0.01, 0.2 * cut.job.cutting.wall_allowance));
    const FibreGrid grid = fibre_grid(cut.solid, cutter, pitch);
    const double from = cut.low(0, r + 2), to = cut.high(0, r + 2);

    struct Level {
        RingPlan rings;
        std::vector<std::vector<Stretch>> free;  // where no rings are cut
    };
    const bool flask = !cut.layer.opening.empty();
    // A ring may leave its border, and an arc the ring.
    const double off_flask = r + kOnBorder + arc_tolerance_units(cut.job, OperationKind::rough) / kUnitsPerMm;
    const Loops room = flask ? flask_room(cut, off_flask) : Loops{};
    std::vector<FibreLevel> heights;
    for (std::size_t i = 0; i < steps.size(); ++i)
        heights.push_back({steps[i].level.spare, &inside[i].loops});
    const std::vector<Contours> borders = level_contours(cut.context, cut.solid, heights, cutter, grid);
    std::vector<Loops> forbidden_at(steps.size());
    const Loops beyond = flask ? beyond_room(cut, off_flask, room) : Loops{};
    parallel_each(cut.context, steps.size(), [&](std::size_t i) {
        forbidden_at[i] = simplify(forbidden_region(borders[i]));
        if (flask) forbidden_at[i] = unite(forbidden_at[i], beyond);
    });
    std::optional<EngagedStock> stock;
    if (cut.job.cutting.max_engagement < 1)
        stock.emplace(cut.layer.stock_min, cut.layer.stock_max, std::min(cut.stock_top, cut.layer.z_top), r);
    std::vector<OpenLevel> open(steps.size());
    Operation cleared;
    if (const Tool* face = open_waste_tool(cut)) {
        parallel_each(cut.context, steps.size(), [&](std::size_t i) {
            if (steps[i].floor == i)
                open[i] = plan_open_level(cut, *face, tool, forbidden_at[i], steps[i].level.tip,
                                          steps[i].above, i == last);
        });
        leave_below_first_gap(open);
        cleared = clear_open_waste(cut, *face, open, stock ? &*stock : nullptr);
    }
    std::vector<Level> cuts(steps.size());
    parallel_each(cut.context, steps.size(), [&](std::size_t i) {
        const double tip = steps[i].level.tip;
        if (const std::size_t floor = steps[i].floor; floor != i) {
            const double width = least_width(steps[i], steps[floor], cut.job.tolerances.rough_cusp);
            cuts[i].rings = plan_terrace(
                cut, tool, forbidden_at[i], offset_outline(forbidden_at[floor], -width, kOffsetError),
                offset_outline(forbidden_at[i - 1], -kMoreThanStep, kOffsetError), tip, op.blend);
            return;
        }
        if (!cleared.moves.empty() && !open[i].left.empty()) {
            cuts[i].rings =
                plan_terrace(cut, tool, forbidden_at[i], open[i].left, open[i].left, tip, op.blend);
            return;
        }
        if (i == last || contour) {
            cuts[i].rings = plan_rings(cut, tool, forbidden_at[i], tip, op.blend, i == last);
            if (!cuts[i].rings.pieces.empty()) return;
        }
        const Fibres forbidden = beside_flask(
            cut, room,
            fibres(cut.context, cut.solid, inside[i].loops, cutter, steps[i].level.spare, Axis::x, lines),
            Axis::x, lines);
        for (std::size_t l = 0; l < lines.size(); ++l)
            cuts[i].free.push_back(free_stretches(forbidden.line(l), from, to, 0.2));
    });

    PathBuilder path(op, tool, std::min(tool.max_feed, cut.job.machine.max_feed), clearance,
                     cut.layer.z_top + 2);
    const DropIndex part(cut.solid, cutter);
    Surroundings around = cut.around(tool, &part);
    for (std::size_t i = 0; i < steps.size(); ++i)
        if (!cuts[i].rings.pieces.empty() || !cuts[i].free.empty())
            around.deepest = std::max(around.deepest, steps[i].above - steps[i].level.tip);
    path.set_surroundings(around);
    for (std::size_t i = 0; i < steps.size(); ++i) {
        const double above = steps[i].above, tip = steps[i].level.tip;
        if (!cuts[i].rings.pieces.empty()) {
            op.stepdown = std::max(op.stepdown, above - tip);
            op.stepover = std::max(op.stepover, cuts[i].rings.widest_step());
            clear_from_afar(path, cut, std::move(cuts[i].rings));
            continue;
        }
        if (cuts[i].free.empty()) continue;  // rings, of which none were of use
        op.stepdown = std::max(op.stepdown, above - tip);
        op.stepover = std::max(op.stepover, depth / gaps);
        zigzag(path, cut, tool, lines, cuts[i].free, tip, [&](std::span<const std::int32_t> at) {
            return beside_flask(
                cut, room,
                fibres(cut.context, cut.solid, inside[i].loops, cutter, steps[i].level.spare, Axis::y, at),
                Axis::y, at);
        });
        // Along the border, begun where a zigzag line ends and the cutter has been already.
        const Contours& border = borders[i];
        const std::int32_t z = to_units(tip);
        for (std::size_t c = 0; c < border.size(); ++c) {
            const auto points =
                std::span(border.points).subspan(border.starts[c], border.starts[c + 1] - border.starts[c]);
            if (points.size() < 3) continue;
            std::size_t start = 0;
            std::int64_t nearest = INT64_MAX;
            bool in_stock = false;
            for (std::size_t k = 0; k < points.size(); ++k) {
                const auto it = std::lower_bound(lines.begin(), lines.end(), points[k].y);
                for (const auto l : {it, it == lines.begin() ? it : std::prev(it)}) {
                    if (l == lines.end()) continue;
                    const std::int64_t d = std::abs(std::int64_t{*l} - points[k].y);
                    if (d < nearest) nearest = d, start = k;
                }
                in_stock |= to_mm(points[k].x) > cut.layer.stock_min[0] - r &&
                            to_mm(points[k].x) < cut.layer.stock_max[0] + r &&
                            to_mm(points[k].y) > cut.layer.stock_min[1] - r &&
                            to_mm(points[k].y) < cut.layer.stock_max[1] + r;
            }
            if (!in_stock) continue;
            std::vector<PathPoint> line;
            for (std::size_t k = 0; k <= points.size(); ++k) {
                const Point2 p = points[(start + k) % points.size()];
                line.push_back({p.x, p.y, z});
            }
            const std::vector<PathPoint> ring = simplify(line, 0.02 * kUnitsPerMm);
            path.go_above({ring[0].x, ring[0].y});
            if (nearest > 2 * std::int64_t{pitch}) {  // a pocket that no line met
                cut_ring(path, ring, to_units(above), z, cut.job.cutting.ramp_deg);
                continue;
            }
            path.follow(ring);
        }
        // Along the flask, which is finished with that.
        for (std::size_t l = 0; l < room.size(); ++l) {
            std::vector<PathPoint> ring;
            for (const Point2 p : room.loop(l)) ring.push_back({p.x, p.y, z});
            ring.push_back(ring.front());
            path.go_above({ring[0].x, ring[0].y});
            cut_ring(path, ring, to_units(above), z, cut.job.cutting.ramp_deg);
        }
    }
    path.finish();
    if (stock && op.stepdown > 0) {
        stock->change_cutter(r);
        cap_engagement(cut.context, op.moves, *stock,
                       {cut.job.cutting.max_engagement, tool.diameter, op.stepdown});
    }
    std::vector<Operation> operations;
    if (!cleared.moves.empty()) operations.push_back(std::move(cleared));
    operations.push_back(std::move(op));
    return operations;
}

}  // namespace slabwright
