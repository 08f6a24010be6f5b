// Finishing by a projected raster: the ball is dropped on the surface along parallel lines wherever its contact lies on
// a slope under 45°. The step-over is chosen for every pass from the slopes under it (FINISH eq. 9).
#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "engine/paths/layer_cut.h"
#include "kernels/cutting/cusp.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

struct Run {
    std::vector<PathPoint> points;
    bool done = false;
};

// The chord between two rests is short enough to stay out of the part, or goes over the corner above the lower one:
// straight up is always free, and so is level travel at the height of the higher rest.
void append(std::vector<PathPoint>& line, PathPoint p, double chord) {
    if (!line.empty()) {
        const PathPoint& q = line.back();
        const double dx = static_cast<double>(p.x) - q.x, dy = static_cast<double>(p.y) - q.y, dz = static_cast<double>(p.z) - q.z;
        if (dx * dx + dy * dy + dz * dz > chord * chord) {
            const PathPoint corner = dz > 0 ? PathPoint{q.x, q.y, p.z} : PathPoint{p.x, p.y, q.z};
            if (!(corner == q) && !(corner == p)) line.push_back(corner);
        }
    }
    line.push_back(p);
}

}  // namespace

Operation finish_raster(const LayerCut& cut, std::vector<Diagnostic>& diagnostics) {
    const Tool& tool = tool_of_kind(cut.job, ToolKind::ball);
    Operation op = cut.operation(OperationKind::finish, "projected raster", tool);
    const double r = tool.diameter / 2, gouge = cut.job.tolerances.gouge, cusp = cut.job.tolerances.cusp;
    const double keep_nz = std::cos((cut.job.cutting.steep_limit_deg + cut.job.cutting.overlap_deg) * std::numbers::pi / 180);
    constexpr double level_nz = 0.999999;

    std::vector<SolidFacet> shallow;
    for (const SolidFacet& f : cut.solid.facets)
        if (f.nz >= keep_nz && f.z_max > cut.layer.z_bottom && !(f.z_min == cut.layer.z_top)) shallow.push_back(f);
    if (shallow.empty()) return op;

    // How far the shallow facets face along y, by strips of y: that decides the step-over of the passes over them.
    double y_low = 1e300, y_high = -1e300;
    for (const SolidFacet& f : shallow)
        for (const Vec3d& p : f.p) y_low = std::min(y_low, p[1]), y_high = std::max(y_high, p[1]);
    constexpr double strip = 0.5;
    std::vector<float> facing(static_cast<std::size_t>((y_high - y_low) / strip) + 1, -1);  // −1: nothing shallow there
    for (const SolidFacet& f : shallow) {
        const auto [low, high] = std::minmax({f.p[0][1], f.p[1][1], f.p[2][1]});
        for (auto s = static_cast<std::size_t>((low - y_low) / strip), e = static_cast<std::size_t>((high - y_low) / strip); s <= e; ++s)
            facing[s] = std::max(facing[s], static_cast<float>(std::abs(f.normal[1])));
    }
    std::vector<std::int32_t> lines;
    bool floor_bites = false;
    for (double y = y_low - 0.5 * r; y <= y_high + 0.5 * r;) {
        lines.push_back(to_units(y));
        // The ball at y touches within r of it; the pass must be near enough for the steepest face in between.
        const auto index = [&](double v) {
            return std::clamp<long>(static_cast<long>(std::floor((v - y_low) / strip)), 0, static_cast<long>(facing.size()) - 1);
        };
        float most = 0;
        for (long s = index(y - r); s <= index(y + r); ++s) most = std::max(most, facing[static_cast<std::size_t>(s)]);
        double d = raster_stepover(r, cusp, most);
        if (d < cut.job.cutting.min_stepover) d = cut.job.cutting.min_stepover, floor_bites = true;
        op.stepover = std::max(op.stepover, d);
        y += d;
    }
    if (floor_bites)
        diagnostics.push_back({Severity::warning,
                               "finish.stepover_floor",
                               fmt::format("layer {}: the raster's step-over was kept at {:.2f} mm, cusps there exceed {:.3f} mm", cut.layer.index,
                                           cut.job.cutting.min_stepover, cusp),
                               {}});

    const DropIndex ball(cut.context, cut.solid, {Cutter::Profile::ball, r});
    const double flat_r = tool_of_kind(cut.job, ToolKind::flat).diameter / 2;
    const DropIndex flat(cut.context, cut.solid, {Cutter::Profile::flat, flat_r - 0.02});
    const Fibres reach = covering(cut.context, shallow, r, Axis::x, lines);
    const double chord = safe_chord_mm(r, gouge), step = 0.75 * chord;
    auto floor_done = [&](double z) {
        for (const Feature* f : cut.layer.flats)
            if (f->area >= cut.job.cutting.min_flat_area && std::abs(f->z_low - z) < 1e-6) return true;
        return false;
    };

    std::vector<std::vector<Run>> runs(lines.size());
    parallel_each(cut.context, lines.size(), [&](std::size_t l) {
        const double y = to_mm(lines[l]);
        for (const Forbidden& span : reach.line(l)) {
            const double low = std::max(span.low, cut.low(0, r)), high = std::min(span.high, cut.high(0, r));
            if (low >= high) continue;
            const auto n = static_cast<std::size_t>(std::ceil((high - low) / step)) + 1;
            std::vector<PathPoint> points;
            std::size_t last_wanted = 0;  // length of `points` up to the last wanted one
            std::size_t idle = 0;
            auto close = [&] {
                points.resize(last_wanted);
                if (points.size() >= 2) runs[l].push_back({simplify(points, simplify_tolerance_units(gouge)), false});
                points.clear();
                last_wanted = idle = 0;
            };
            for (std::size_t k = 0; k < n; ++k) {
                const std::int32_t ux = to_units(low + (high - low) * static_cast<double>(k) / static_cast<double>(n - 1));
                const double x = to_mm(ux);
                const Rest rest = ball.drop(x, y);
                const double contact = rest.contact_z(r);
                bool wanted = rest.nz >= keep_nz && !rest.on_cap && contact >= cut.layer.z_bottom - 0.02 && contact < cut.layer.z_top - 1e-6 &&
                              rest.tip_z >= cut.layer.floor_below;
                if (wanted && rest.nz > level_nz && floor_done(contact) && flat.drop(x, y).tip_z <= contact + 1e-3) wanted = false;
                if (!wanted && points.empty()) continue;
                // Short stretches between two wanted ones are travelled along the surface.
                if (rest.tip_z < cut.layer.floor_below || (!wanted && static_cast<double>(++idle) * step > 3)) {
                    close();
                    continue;
                }
                append(points, {ux, lines[l], to_units(rest.tip_z) + 1}, chord * kUnitsPerMm);
                if (wanted) {
                    last_wanted = points.size();
                    idle = 0;
                }
            }
            close();
        }
    });

    PathBuilder path(op, tool, std::min(cut.job.cutting.finish_feed, cut.job.machine.max_feed), cut.layer.z_top + cut.job.machine.clearance,
                     cut.layer.z_top + 2);
    auto follow = [&](const std::vector<PathPoint>& points) {
        for (const PathPoint& p : points) path.cut({p.x, p.y}, p.z);
    };
    const double near = 3.0 * kUnitsPerMm;
    for (std::size_t first = 0; first < lines.size(); ++first)
        for (std::size_t k = 0; k < runs[first].size(); ++k) {
            if (runs[first][k].done) continue;
            Run* run = &runs[first][k];
            bool reversed = false;
            for (std::size_t l = first;;) {
                run->done = true;
                std::vector<PathPoint> points = run->points;
                if (reversed) std::reverse(points.begin(), points.end());
                if (!path.is_down()) {
                    path.go_above({points[0].x, points[0].y});
                    path.plunge(points[0].z);
                }
                follow(points);
                // On to a run of the next line that begins or ends nearby, along the surface.
                if (++l == lines.size()) break;
                Run* next = nullptr;
                double best = near;
                bool next_reversed = false;
                for (Run& candidate : runs[l]) {
                    if (candidate.done) continue;
                    for (const bool back : {false, true}) {
                        const PathPoint& p = back ? candidate.points.back() : candidate.points.front();
                        const double d = std::hypot(static_cast<double>(p.x) - path.at().x, static_cast<double>(p.y) - path.at().y);
                        if (d < best) best = d, next = &candidate, next_reversed = back;
                    }
                }
                if (!next) break;
                const PathPoint from{path.at().x, path.at().y, path.z()}, to = next_reversed ? next->points.back() : next->points.front();
                std::vector<PathPoint> link{from};
                const auto n = static_cast<std::size_t>(std::ceil(best / (step * kUnitsPerMm)));
                for (std::size_t i = 1; i < n; ++i) {
                    const double t = static_cast<double>(i) / static_cast<double>(n);
                    PathPoint p{static_cast<std::int32_t>(from.x + t * (static_cast<double>(to.x) - from.x)),
                                static_cast<std::int32_t>(from.y + t * (static_cast<double>(to.y) - from.y)), 0};
                    const double lerp = from.z + t * (static_cast<double>(to.z) - from.z);
                    const double rest = ball.drop(to_mm(p.x), to_mm(p.y)).tip_z;
                    p.z = static_cast<std::int32_t>(std::ceil(std::max(lerp, rest * kUnitsPerMm)));
                    append(link, p, chord * kUnitsPerMm);
                }
                append(link, to, chord * kUnitsPerMm);
                follow(link);
                run = next;
                reversed = next_reversed;
            }
            path.retract();
        }
    path.finish();
    return op;
}

}  // namespace slabwright
