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
    const double chord = safe_chord_mm(r, gouge);
    // Samples stand on multiples of one step, so that those of neighbouring lines are neighbours.
    const auto step = static_cast<std::int32_t>(0.75 * chord * kUnitsPerMm);
    auto floor_done = [&](double z) {
        for (const double floor : cut.floors)
            if (z <= floor + 1e-6 && z >= floor - kSameFloor) return true;
        return false;
    };

    // A place of the ball on the surface: tip and contact.
    struct Sample {
        std::int32_t x = 0, z = 0;  // 0.1 µm
        double tip = 0;             // mm
        std::array<double, 3> contact{};
        bool wanted = false, reachable = false, cut = false;
    };
    using Line = std::vector<Sample>;
    auto sample = [&](std::int32_t ux, std::int32_t uy) {
        const double x = to_mm(ux), y = to_mm(uy);
        const Rest rest = ball.drop(x, y);
        Sample s;
        s.x = ux;
        s.contact = {x - r * rest.nx, y - r * rest.ny, rest.contact_z(r)};
        const double contact = s.contact[2];
        s.wanted = rest.nz >= keep_nz && !rest.on_cap && contact >= cut.layer.z_bottom - 0.02 && contact < cut.layer.z_top - 1e-6 &&
                   rest.tip_z >= cut.layer.floor_below;
        if (s.wanted && rest.nz > level_nz && floor_done(contact) && flat.drop(x, y).tip_z <= contact + 1e-3) s.wanted = false;
        s.tip = rest.tip_z;
        s.reachable = s.tip >= cut.layer.floor_below && !rest.on_cap;
        if (s.reachable) s.z = to_units(s.tip) + 1;
        return s;
    };
    // Between two places of the ball a cusp of about c·δ/(8r) stays, c the way between the contacts and δ the way of the
    // ball: on a plane both are the same, in a hollow the contacts run ahead of the ball.
    auto too_far = [&](const Sample& a, std::int32_t ya, const Sample& b, std::int32_t yb) {
        if (!a.reachable || !b.reachable || (a.contact[2] < cut.layer.z_bottom && b.contact[2] < cut.layer.z_bottom)) return false;
        const double c = std::hypot(a.contact[0] - b.contact[0], a.contact[1] - b.contact[1], a.contact[2] - b.contact[2]);
        const double d = std::hypot(to_mm(a.x) - to_mm(b.x), to_mm(ya) - to_mm(yb), a.tip - b.tip);
        return c * d > 8 * r * cusp * 1.5;
    };
    const std::int32_t finest = to_units(0.02);
    auto append_between = [&](auto&& self, Line& line, Sample b, std::int32_t y) -> void {
        if (!line.empty() && b.x - line.back().x <= step && b.x - line.back().x > 2 * finest && too_far(line.back(), y, b, y)) {
            const Sample middle = sample(line.back().x + (b.x - line.back().x) / 2, y);
            self(self, line, middle, y);
            self(self, line, b, y);
            return;
        }
        line.push_back(b);
    };

    std::vector<Line> samples(lines.size());
    const Fibres reach = covering(cut.context, shallow, r, Axis::x, lines);
    parallel_each(cut.context, lines.size(), [&](std::size_t l) {
        // The surface within reach of the ball, with one step around.
        std::vector<Span> spans;
        for (const Forbidden& f : reach.line(l)) spans.push_back({f.low * kUnitsPerMm, f.high * kUnitsPerMm});
        std::sort(spans.begin(), spans.end(), [](const Span& a, const Span& b) { return a.low < b.low; });
        const double low_limit = cut.low(0, r) * kUnitsPerMm, high_limit = cut.high(0, r) * kUnitsPerMm;
        std::int32_t next = INT32_MIN;
        for (const Span& span : spans) {
            const auto first = static_cast<std::int32_t>(std::ceil(std::max(span.low - step, low_limit) / step)),
                       last = static_cast<std::int32_t>(std::floor(std::min(span.high + step, high_limit) / step));
            for (std::int32_t k = std::max(first, next); k <= last; ++k) {
                next = k + 1;
                append_between(append_between, samples[l], sample(k * step, lines[l]), lines[l]);
            }
        }
    });
    auto at = [](const Line& line, std::int32_t x) -> const Sample* {
        const auto it = std::lower_bound(line.begin(), line.end(), x, [](const Sample& s, std::int32_t v) { return s.x < v; });
        return it != line.end() && it->x == x ? &*it : nullptr;
    };
    // One sample and one line beyond what is wanted, so that the cusp at its rim is cut as well.
    parallel_each(cut.context, lines.size(), [&](std::size_t l) {
        Line& line = samples[l];
        for (std::size_t i = 0; i < line.size(); ++i) {
            Sample& s = line[i];
            if (!s.reachable) continue;
            s.cut = s.wanted || (i > 0 && s.x - line[i - 1].x <= step && line[i - 1].wanted) ||
                    (i + 1 < line.size() && line[i + 1].x - s.x <= step && line[i + 1].wanted);
            for (const std::size_t n : {l - 1, l + 1}) {
                if (s.cut || n >= lines.size()) continue;
                const Sample* beside = at(samples[n], s.x);
                s.cut = beside && beside->wanted;
            }
        }
    });
    // Where the surface turns faster than the lines follow, lines in between, over those places only.
    struct Between {
        std::int32_t y = 0;
        Line line;
    };
    std::vector<std::vector<Between>> between(lines.size());
    parallel_each(cut.context, lines.size() - 1, [&](std::size_t l) {
        auto refine = [&](auto&& self, const Line& a, std::int32_t ya, const Line& b, std::int32_t yb) -> void {
            if (yb - ya < 2 * finest) return;
            const std::int32_t y = ya + (yb - ya) / 2;
            Line middle;
            std::int32_t done = INT32_MIN;
            for (const Sample& s : a) {
                if (s.x % step != 0) continue;
                const Sample* other = at(b, s.x);
                if (!other || !too_far(s, ya, *other, yb)) continue;
                for (const std::int32_t x : {s.x - step, s.x, s.x + step}) {
                    if (x <= done) continue;
                    append_between(append_between, middle, sample(x, y), y);
                    done = x;
                }
            }
            if (middle.empty()) return;
            for (Sample& s : middle) s.cut = s.wanted;
            self(self, a, ya, middle, y);
            between[l].push_back({y, middle});
            self(self, middle, y, b, yb);
        };
        refine(refine, samples[l], lines[l], samples[l + 1], lines[l + 1]);
    });

    auto runs_of = [&](const Line& line, std::int32_t y) {
        std::vector<Run> runs;
        std::vector<PathPoint> points;
        std::size_t last_cut = 0;  // length of `points` up to the last one that cuts
        std::int32_t before = 0, last_cut_x = 0;
        auto close = [&] {
            points.resize(last_cut);
            if (points.size() >= 2) runs.push_back({simplify(points, simplify_tolerance_units(gouge)), false});
            points.clear();
            last_cut = 0;
        };
        for (const Sample& s : line) {
            if (!points.empty() && s.x - before > step) close();
            before = s.x;
            if (!s.cut && points.empty()) continue;
            // Short stretches between two that cut are travelled along the surface.
            if (!s.reachable || (!s.cut && s.x - last_cut_x > to_units(3))) {
                close();
                continue;
            }
            append(points, {s.x, y, s.z}, chord * kUnitsPerMm);
            if (s.cut) {
                last_cut = points.size();
                last_cut_x = s.x;
            }
        }
        close();
        return runs;
    };
    // First the even raster, then the lines between.
    std::vector<std::int32_t> run_y;
    std::vector<std::vector<Run>> runs;
    for (std::size_t l = 0; l < lines.size(); ++l) {
        run_y.push_back(lines[l]);
        runs.push_back(runs_of(samples[l], lines[l]));
    }
    for (const auto& group : between)
        for (const Between& b : group) {
            run_y.push_back(b.y);
            runs.push_back(runs_of(b.line, b.y));
        }

    PathBuilder path(op, tool, std::min(cut.job.cutting.finish_feed, cut.job.machine.max_feed), cut.layer.z_top + cut.job.machine.clearance,
                     cut.layer.z_top + 2);
    auto follow = [&](const std::vector<PathPoint>& points) {
        for (const PathPoint& p : points) path.cut({p.x, p.y}, p.z);
    };
    const double near = 3.0 * kUnitsPerMm;
    constexpr std::size_t look_ahead = 8;  // lines between may have nothing to cut here
    for (std::size_t first = 0; first < runs.size(); ++first)
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
                // On to a run of a next line that begins or ends nearby, along the surface.
                Run* next = nullptr;
                std::size_t next_line = l;
                double best = near;
                bool next_reversed = false;
                for (std::size_t m = l + 1; m < std::min(runs.size(), l + 1 + look_ahead) && std::abs(run_y[m] - run_y[l]) < near; ++m)
                    for (Run& candidate : runs[m]) {
                        if (candidate.done) continue;
                        for (const bool back : {false, true}) {
                            const PathPoint& p = back ? candidate.points.back() : candidate.points.front();
                            const double d = std::hypot(static_cast<double>(p.x) - path.at().x, static_cast<double>(p.y) - path.at().y);
                            if (d < best) best = d, next = &candidate, next_reversed = back, next_line = m;
                        }
                    }
                if (!next) break;
                const PathPoint from{path.at().x, path.at().y, path.z()}, to = next_reversed ? next->points.back() : next->points.front();
                std::vector<PathPoint> link{from};
                const auto n = static_cast<std::size_t>(std::ceil(best / step));
                bool free = true;
                for (std::size_t i = 1; i < n; ++i) {
                    const double t = static_cast<double>(i) / static_cast<double>(n);
                    PathPoint p{static_cast<std::int32_t>(from.x + t * (static_cast<double>(to.x) - from.x)),
                                static_cast<std::int32_t>(from.y + t * (static_cast<double>(to.y) - from.y)), 0};
                    const double lerp = from.z + t * (static_cast<double>(to.z) - from.z);
                    const double rest = ball.drop(to_mm(p.x), to_mm(p.y)).tip_z;
                    free &= rest < cut.layer.z_top - 1e-3;  // not over the finished top
                    p.z = static_cast<std::int32_t>(std::ceil(std::max(lerp, rest * kUnitsPerMm))) + 1;
                    append(link, p, chord * kUnitsPerMm);
                }
                if (!free) break;
                append(link, to, chord * kUnitsPerMm);
                follow(link);
                run = next;
                reversed = next_reversed;
                l = next_line;
            }
            path.retract();
        }
    path.finish();
    return op;
}

}  // namespace slabwright
