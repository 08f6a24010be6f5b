// Roughing: level by level from the top, in rings around what the shadow forbids or in zigzags and then once along its border. A
// level lies on every up-facing flat (plus allowance) and on the layer's bottom; between them the stepdowns of section 5. The
// last level cuts the slab through where nothing lies under it, so it goes in rings that leave what hangs over held to the end.
// Where the cutter meets more of its breadth than the job allows, the feed is lowered (engagement.h).
#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/paths/engagement.h"
#include "engine/paths/feet.h"
#include "engine/paths/layer_cut.h"
#include "engine/paths/rings.h"
#include "kernels/cutting/cusp.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

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
                if (const Rest rest = part.drop(x, y); rest.tip_z <= floor + 1e-3 && rest.tip_z >= floor - kSameFloor) return true;
    }
    return false;
}

}  // namespace

std::vector<RoughLevel> rough_levels(const LayerCut& cut, const Tool& tool, double floor) {
    const double bottom = cut.layer.z_bottom, top = cut.layer.z_top;
    std::vector<RoughLevel> fixed;
    for (const double z : cut.floors)
        if (z + floor < top && (!clears_on_contours(cut.job) || stands_on(cut, tool, z))) fixed.push_back({z + floor, z});
    fixed.push_back({bottom, bottom});
    std::sort(fixed.begin(), fixed.end(), [](const RoughLevel& a, const RoughLevel& b) { return a.tip > b.tip; });
    std::vector<RoughLevel> levels;
    double z = top;
    for (const RoughLevel& f : fixed) {
        if (!levels.empty() && levels.back().tip - f.tip < 1e-3) continue;
        while (z - f.tip > 1e-9) {
            // The flattest slope decides, within what the tool may take; the last steps before a fixed level are even.
            const double alpha = cut.least_slope(z - tool.stepdown_max, z, cut.job.cutting.steep_limit_deg * std::numbers::pi / 180);
            const double step = std::clamp(flat_level_stepdown(alpha, cut.job.tolerances.rough_cusp), tool.stepdown_min, tool.stepdown_max);
            const double count = std::ceil((z - f.tip) / step - 1e-9);
            if (count <= 1) break;
            z -= (z - f.tip) / count;
            levels.push_back({z, std::max(bottom, z - floor)});
        }
        levels.push_back(f);
        z = f.tip;
    }
    return levels;
}

Operation rough_layer(const LayerCut& cut) {
    const Tool& tool = cut.layer.tools.rough;
    const bool contour = cut.job.cutting.rough_pattern == RoughPattern::contour;
    Operation op = cut.operation(OperationKind::rough, contour ? "contour-parallel levels" : "zigzag levels", tool);
    op.blend = rough_blend(cut.job.cutting);
    const double r = tool.diameter / 2, clearance = cut.layer.z_top + cut.job.machine.clearance;
    const Cutter cutter{Cutter::Profile::flat, r + cut.job.cutting.wall_allowance};
    const std::vector<RoughLevel> levels = rough_levels(cut, tool, cut.job.cutting.floor_allowance);
    std::vector<double> spare;
    for (const RoughLevel& l : levels) spare.push_back(l.spare);
    const std::vector<Section> inside = cut.insides(cutter, spare);

    // Lines from edge to edge of the stock, evenly spaced.
    const double depth = cut.layer.stock_max[1] - cut.layer.stock_min[1];
    const int gaps = std::max(1, static_cast<int>(std::ceil(depth / (tool.stepover * tool.diameter) - 1e-9)));
    std::vector<std::int32_t> lines;
    for (int k = 0; k <= gaps; ++k) lines.push_back(to_units(cut.layer.stock_min[1] + depth * k / gaps));
    // Contours of the border may be coarser than a finish pass: what their chords miss must stay well inside the allowance.
    const std::int32_t pitch = safe_pitch(r, std::max(0.01, 0.2 * cut.job.cutting.wall_allowance));
    const FibreGrid grid = fibre_grid(cut.solid, cutter, pitch);
    const double from = cut.low(0, r + 2), to = cut.high(0, r + 2);

    struct Level {
        RingPlan rings;
        std::vector<std::vector<Stretch>> free;  // where no rings are cut
    };
    const bool flask = !cut.layer.opening.empty();
    const Loops room = flask ? flask_room(cut, r) : Loops{};
    std::vector<FibreLevel> heights;
    for (std::size_t i = 0; i < levels.size(); ++i) heights.push_back({levels[i].spare, &inside[i].loops});
    const std::vector<Contours> borders = level_contours(cut.context, cut.solid, heights, cutter, grid);
    std::vector<Level> cuts(levels.size());
    parallel_each(cut.context, levels.size(), [&](std::size_t i) {
        if (i + 1 == levels.size() || contour) {
            Loops forbidden = forbidden_region(borders[i]);
            if (flask) forbidden = unite(forbidden, beyond_room(cut, r, room));
            cuts[i].rings = plan_rings(cut, tool, forbidden, levels[i].tip, op.blend);
            if (!cuts[i].rings.pieces.empty()) return;
        }
        const Fibres forbidden =
            beside_flask(cut, room, fibres(cut.context, cut.solid, inside[i].loops, cutter, levels[i].spare, Axis::x, lines), Axis::x, lines);
        for (std::size_t l = 0; l < lines.size(); ++l) cuts[i].free.push_back(free_stretches(forbidden.line(l), from, to, 0.2));
    });

    PathBuilder path(op, tool, std::min(tool.max_feed, cut.job.machine.max_feed), clearance, cut.layer.z_top + 2);
    const DropIndex part(cut.solid, cutter);
    path.know(cut.around(tool, &part));
    double above = cut.layer.z_top;
    for (std::size_t i = 0; i < levels.size(); ++i) {
        op.stepdown = std::max(op.stepdown, above - levels[i].tip);
        if (!cuts[i].rings.pieces.empty()) {
            op.stepover = std::max(op.stepover, cuts[i].rings.step);
            clear_from_afar(path, cut, std::move(cuts[i].rings), i + 1 == levels.size());
            above = levels[i].tip;
            continue;
        }
        op.stepover = std::max(op.stepover, depth / gaps);
        zigzag(path, cut, tool, lines, cuts[i].free, levels[i].tip, [&](std::span<const std::int32_t> at) {
            return beside_flask(cut, room, fibres(cut.context, cut.solid, inside[i].loops, cutter, levels[i].spare, Axis::y, at), Axis::y, at);
        });
        // Along the border, begun where a zigzag line ends and the cutter has been already.
        const Contours& border = borders[i];
        const std::int32_t z = to_units(levels[i].tip);
        for (std::size_t c = 0; c < border.size(); ++c) {
            const auto points = std::span(border.points).subspan(border.starts[c], border.starts[c + 1] - border.starts[c]);
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
                in_stock |= to_mm(points[k].x) > cut.layer.stock_min[0] - r && to_mm(points[k].x) < cut.layer.stock_max[0] + r &&
                            to_mm(points[k].y) > cut.layer.stock_min[1] - r && to_mm(points[k].y) < cut.layer.stock_max[1] + r;
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
            path.sink(z);
            for (const PathPoint& p : ring) path.cut({p.x, p.y}, z);
        }
        // Along the flask, which is finished with that.
        for (std::size_t l = 0; l < room.size(); ++l) {
            std::vector<PathPoint> ring;
            for (const Point2 p : room.loop(l)) ring.push_back({p.x, p.y, z});
            ring.push_back(ring.front());
            path.go_above({ring[0].x, ring[0].y});
            cut_ring(path, ring, to_units(above), z, cut.job.cutting.ramp_deg);
        }
        above = levels[i].tip;
    }
    path.finish();
    if (cut.job.cutting.max_engagement < 1 && op.stepdown > 0) {
        EngagedStock stock(cut.layer.stock_min, cut.layer.stock_max, std::min(cut.stock_top, cut.layer.z_top), r);
        cap_engagement(cut.context, op.moves, stock, {cut.job.cutting.max_engagement, tool.diameter, op.stepdown});
    }
    return op;
}

}  // namespace slabwright
