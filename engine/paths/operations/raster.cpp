// Finishing by a projected raster: the ball is dropped on the surface along parallel lines wherever its
// contact lies on a slope under 45°. The step-over is chosen for every pass from the slopes under it (FINISH
// eq. 9).
#include "engine/paths/operations/raster.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>

#include <fmt/format.h>

#include "engine/moves/motion_time.h"
#include "engine/paths/operations/finish_slopes.h"
#include "engine/paths/operations/raster_lines.h"
#include "engine/paths/runs/chains.h"
#include "engine/paths/runs/feet.h"
#include "engine/paths/runs/layer_cut.h"
#include "engine/paths/runs/tolerances.h"
#include "kernels/cutting/cusp.h"
#include "kernels/geometry/vectors.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr double kOverFloor =
    1e-3;  // mm: a line this near to a floor's facets, seen from above, passes over them
constexpr double kOnFloor =
    1e-3;  // mm: a flat end mill that meets nothing this far over a floor stands on it
constexpr double kRounding = 1e-6;  // mm: what is nearer may be found by one question and missed by another
// Places of a line of which a wider end mill is asked before they are asked one by one.
constexpr std::array<std::int32_t, 2> kTogether{16, 4};

using Runs = std::vector<std::vector<PathPoint>>;

RasterFacets raster_facets(const LayerCut& cut) {
    RasterFacets facets;
    facets.slopes = finish_slopes(cut.job.cutting);
    facets.radius = cut.layer.tools.finish.diameter / 2;
    facets.top = cut.layer.z_top - 1.5 * kTopSheet;
    if (facets.slopes.projection_to < 0) return facets;
    const double keep_nz = std::cos(facets.slopes.projection_to);
    const auto is_floor = [&](const SolidFacet& f) {
        return std::any_of(cut.floors.begin(), cut.floors.end(),
                           [&](double z) { return lies_on_floor(f, z); });
    };
    for (const SolidFacet& f : cut.solid.facets) {
        if (f.nz < keep_nz || f.z_max <= cut.layer.z_bottom || f.z_min == cut.layer.z_top) continue;
        facets.shallow.push_back(f);
        if (f.z_min < facets.top && !is_floor(f)) facets.made.push_back(f);
    }
    return facets;
}

Slide raster_slide(const LayerCut& cut, const DropIndex& ball) {
    return {&ball, true, safe_chord_mm(ball.cutter().radius, cut.job.tolerances.gouge), cut.layer.z_top, 3};
}

// What the ball runs on these lines, the even raster first, then the lines between.
Runs raster_runs(const LayerCut& cut, const RasterFacets& facets, const RasterLines& raster,
                 const DropIndex& ball) {
    const double r = facets.radius, top = facets.top, gouge = cut.job.tolerances.gouge,
                 cusp = cut.job.tolerances.cusp;
    const FinishSlopes& slopes = facets.slopes;
    // Steeper than step_nz the cusp is kept by the level contours, where both cut everything.
    const double keep_nz = std::cos(slopes.projection_to), step_nz = std::cos(slopes.projection_keep) - 1e-9;
    const bool uniform = cut.job.cutting.uniform_steps,
               steeper = slopes.projection_keep < slopes.projection_to;
    // Places are named by u along the lines and v across them.
    const std::vector<std::int32_t>& lines = raster.across;
    const bool along_x = raster.along == Axis::x;
    const auto placed = [along_x](auto u, auto v) { return along_x ? std::array{u, v} : std::array{v, u}; };
    // The flat end mills that have finished floors; semi-roughing does so on contours only.
    std::vector<std::pair<double, std::unique_ptr<DropIndex>>> flats;
    auto add_flat = [&](const Tool& one) {
        const double flat_r = one.diameter / 2;
        flats.emplace_back(
            flat_r, std::make_unique<DropIndex>(cut.solid, Cutter{Cutter::Profile::flat, flat_r - 0.02}));
    };
    add_flat(cut.layer.tools.rough);
    if (clears_on_contours(cut.job))
        for (const Tool& semi : cut.layer.tools.semi_rough) add_flat(semi);
    const double chord = safe_chord_mm(r, gouge);
    // Samples stand on multiples of one step, so that those of neighbouring lines are neighbours.
    const std::int32_t step = safe_step(r, gouge);
    auto floor_done = [&](double z) {
        for (const double floor : cut.floors)
            if (z <= floor + 1e-6 && z >= floor - kSameFloor) return true;
        return false;
    };

    // Whether the flat end mill finishes a floor's place: from right over it, or with its rim from beside a
    // wall.
    auto flat_covers = [&](double x, double y, double z, MetPoints& met) {
        for (const auto& [flat_r, flat] : flats) {
            if (!flat->stands_over(x, y, z + kOnFloor, &met)) return true;
            for (int k = 0; k < 8; ++k) {
                const double turn = k * std::numbers::pi / 4, beside = 0.95 * flat_r;
                if (!flat->stands_over(x + beside * std::cos(turn), y + beside * std::sin(turn), z + kOnFloor,
                                       &met))
                    return true;
            }
        }
        return false;
    };

    // Where lines pass over floors, ascending by line: what most of a raster would only find to be finished.
    struct FloorSpan {
        double low, high, z;  // mm
    };
    std::vector<std::vector<FloorSpan>> floor_spans(lines.size());
    for (const double floor : cut.floors) {
        const Fibres over = covering(cut.context, floor_facets(cut, floor), kOverFloor, raster.along, lines);
        for (std::size_t l = 0; l < lines.size(); ++l)
            for (const Forbidden& f : over.line(l)) floor_spans[l].push_back({f.low, f.high, floor});
    }
    for (std::vector<FloorSpan>& spans : floor_spans)
        std::sort(spans.begin(), spans.end(),
                  [](const FloorSpan& a, const FloorSpan& b) { return a.low < b.low; });

    // A place of the ball on the surface: tip and contact.
    struct Sample {
        std::int32_t u = 0, z = 0;  // 0.1 µm
        double tip = 0;             // mm
        std::array<double, 3> contact{};
        bool wanted = false, reachable = false, cut = false;
        bool steep = false;  // the level contours keep the cusp here
    };
    using Line = std::vector<Sample>;
    // What the cutters met along a line.
    struct Met {
        MetPoints ball, flat;
    };
    auto sample = [&](std::int32_t u, std::int32_t v, Met& met) {
        const auto [x, y] = placed(to_mm(u), to_mm(v));
        const Rest rest = ball.drop(x, y, -std::numeric_limits<double>::infinity(), &met.ball);
        Sample s;
        s.u = u;
        s.steep = steeper && rest.nz < step_nz;
        s.contact = {x - r * rest.nx, y - r * rest.ny, rest.contact_z(r)};
        const double contact = s.contact[2];
        s.wanted = rest.nz >= keep_nz && !rest.on_cap && contact >= cut.layer.z_bottom - 0.02 &&
                   contact < top && rest.tip_z >= cut.layer.floor_below;
        // Nor is the rim of a finished floor worth a visit: floor and wall make it.
        if (s.wanted && floor_done(contact) && flat_covers(s.contact[0], s.contact[1], contact, met.flat))
            s.wanted = false;
        s.tip = rest.tip_z;
        s.reachable = s.tip >= cut.layer.floor_below && !rest.on_cap;
        if (s.reachable) s.z = to_units(s.tip) + 1;
        return s;
    };
    // Where a flat end mill no narrower than the ball has stood on a floor the ball would rest on that floor
    // as well (or on something less than kOnFloor higher), and has nothing to cut. Where an end mill that is
    // wider yet meets nothing, nor does this one anywhere around.
    struct FloorMill {
        const DropIndex* narrow;
        std::array<std::unique_ptr<DropIndex>, kTogether.size()> wide;
    };
    std::vector<FloorMill> floor_mills;
    for (const auto& [flat_r, flat] : flats) {
        if (flat->cutter().radius < r) continue;
        FloorMill& mill = floor_mills.emplace_back(FloorMill{flat.get(), {}});
        for (std::size_t w = 0; w < kTogether.size(); ++w) {
            const double wide = flat->cutter().radius + 0.5 * to_mm((kTogether[w] - 1) * step) + kRounding;
            if (wide <= FacetTree::kWidestCutter)
                mill.wide[w] = std::make_unique<DropIndex>(cut.solid, Cutter{Cutter::Profile::flat, wide});
        }
    }
    struct FloorWalk {
        double floor = 0;                // mm: the floor that the places before `stood` are finished on
        std::int32_t stood = INT32_MIN;  // in steps
        // In steps: where it is worth to ask for so many again.
        std::array<std::int32_t, kTogether.size()> ask{INT32_MIN, INT32_MIN};
        Met met{};
    };
    auto flat_stands = [&](FloorWalk& walk, std::int32_t k, std::int32_t v, double floor) {
        if (k < walk.stood && floor == walk.floor) return true;
        for (std::size_t w = 0; w < kTogether.size(); ++w) {
            if (k < walk.ask[w]) continue;
            const std::array<double, 2> at =
                placed(to_mm(k * step) + 0.5 * to_mm((kTogether[w] - 1) * step), to_mm(v));
            if (std::any_of(floor_mills.begin(), floor_mills.end(), [&](const FloorMill& mill) {
                    return mill.wide[w] && !mill.wide[w]->stands_over(
                                               at[0], at[1], floor + kOnFloor - kRounding, &walk.met.flat);
                })) {
                walk.floor = floor, walk.stood = k + kTogether[w];
                return true;
            }
            walk.ask[w] = k + kTogether[w];
        }
        const std::array<double, 2> at = placed(to_mm(k * step), to_mm(v));
        return std::any_of(floor_mills.begin(), floor_mills.end(), [&](const FloorMill& mill) {
            return !mill.narrow->stands_over(at[0], at[1], floor + kOnFloor, &walk.met.flat);
        });
    };
    auto finished = [&](FloorWalk& walk, std::int32_t k, std::int32_t v,
                        double floor) -> std::optional<Sample> {
        if (!flat_stands(walk, k, v, floor)) return std::nullopt;
        Sample s;
        s.u = k * step;
        const auto [x, y] = placed(to_mm(s.u), to_mm(v));
        s.contact = {x, y, floor};
        s.tip = floor + kOnFloor;
        s.reachable = floor >= cut.layer.floor_below;
        if (s.reachable) s.z = to_units(s.tip) + 1;
        return s;
    };
    // Between two places of the ball a cusp of about c·δ/(8r) stays, c the way between the contacts and δ the
    // way of the ball: on a plane both are the same, in a hollow the contacts run ahead of the ball.
    auto too_far = [&](const Sample& a, std::int32_t va, const Sample& b, std::int32_t vb) {
        if (!a.reachable || !b.reachable || (a.steep && b.steep) ||
            (a.contact[2] < cut.layer.z_bottom && b.contact[2] < cut.layer.z_bottom))
            return false;
        const double c =
            std::hypot(a.contact[0] - b.contact[0], a.contact[1] - b.contact[1], a.contact[2] - b.contact[2]);
        const double d = std::hypot(to_mm(a.u) - to_mm(b.u), to_mm(va) - to_mm(vb), a.tip - b.tip);
        return c * d > 8 * r * cusp * 1.5;
    };
    // Where walls are projected too, a line follows them in safe chords, down to the last place that the ball
    // reaches.
    const bool walls = cut.job.cutting.finish_strategy != FinishStrategy::split;
    const std::int32_t finest = to_units(walls ? 0.005 : 0.02);
    auto apart = [&](const Sample& a, const Sample& b) {
        if (!a.reachable || !b.reachable) return a.reachable != b.reachable;
        return std::hypot(to_mm(a.u) - to_mm(b.u), a.tip - b.tip) > chord;
    };
    auto append_between = [&](auto&& self, Line& line, Sample b, std::int32_t v, Met& met) -> void {
        if (!line.empty() && b.u - line.back().u <= step && b.u - line.back().u > 2 * finest &&
            (too_far(line.back(), v, b, v) || (walls && apart(line.back(), b)))) {
            const Sample middle = sample(line.back().u + (b.u - line.back().u) / 2, v, met);
            self(self, line, middle, v, met);
            self(self, line, b, v, met);
            return;
        }
        line.push_back(b);
    };

    const Fibres& reach = raster.reach;
    const int axis = along_x ? 0 : 1;
    const double low_limit = cut.low(axis, r) * kUnitsPerMm, high_limit = cut.high(axis, r) * kUnitsPerMm;
    std::vector<std::vector<std::array<std::int32_t, 2>>> unfinished(
        lines.size());  // places on floors, in steps, first and last of a row
    parallel_each(cut.context, lines.size(), [&](std::size_t l) {
        FloorWalk walk;
        std::int32_t next = INT32_MIN;
        for (const FloorSpan& span : floor_spans[l]) {
            const auto first = static_cast<std::int32_t>(
                           std::ceil(std::max(span.low * kUnitsPerMm, low_limit) / step)),
                       last = static_cast<std::int32_t>(
                           std::floor(std::min(span.high * kUnitsPerMm, high_limit) / step));
            for (std::int32_t k = std::max(first, next); k <= last; ++k) {
                next = k + 1;
                const auto [x, y] = placed(to_mm(k * step), to_mm(lines[l]));
                if (flat_stands(walk, k, lines[l], span.z) || flat_covers(x, y, span.z, walk.met.flat) ||
                    !sample(k * step, lines[l], walk.met).wanted)
                    continue;
                if (!unfinished[l].empty() && unfinished[l].back()[1] + 1 == k) unfinished[l].back()[1] = k;
                else unfinished[l].push_back({k, k});
            }
        }
    });

    std::vector<Line> samples(lines.size());
    parallel_each(cut.context, lines.size(), [&](std::size_t l) {
        // What the ball may make within its reach, with one step around.
        std::vector<Span> spans;
        for (const Forbidden& f : reach.line(l)) spans.push_back({f.low * kUnitsPerMm, f.high * kUnitsPerMm});
        const double reaches = r * kUnitsPerMm;
        auto near = std::lower_bound(lines.begin(), lines.end(), lines[l] - to_units(r)) - lines.begin();
        for (auto n = static_cast<std::size_t>(near); n < lines.size() && lines[n] <= lines[l] + to_units(r);
             ++n)
            for (const auto& [from, to] : unfinished[n])
                spans.push_back({from * step - reaches, to * step + reaches});
        std::sort(spans.begin(), spans.end(), [](const Span& a, const Span& b) { return a.low < b.low; });
        std::int32_t next = INT32_MIN;
        auto floor = floor_spans[l].begin();
        FloorWalk walk;
        for (const Span& span : spans) {
            const auto first =
                           static_cast<std::int32_t>(std::ceil(std::max(span.low - step, low_limit) / step)),
                       last = static_cast<std::int32_t>(
                           std::floor(std::min(span.high + step, high_limit) / step));
            for (std::int32_t k = std::max(first, next); k <= last; ++k) {
                next = k + 1;
                const double u = to_mm(k * step);
                while (floor != floor_spans[l].end() && floor->high < u) ++floor;
                const std::optional<Sample> done = floor != floor_spans[l].end() && floor->low < u
                                                       ? finished(walk, k, lines[l], floor->z)
                                                       : std::nullopt;
                append_between(append_between, samples[l],
                               done ? *done : sample(k * step, lines[l], walk.met), lines[l], walk.met);
            }
        }
    });
    auto at = [](const Line& line, std::int32_t u) -> const Sample* {
        const auto it = std::lower_bound(line.begin(), line.end(), u,
                                         [](const Sample& s, std::int32_t other) { return s.u < other; });
        return it != line.end() && it->u == u ? &*it : nullptr;
    };
    // One sample and one line beyond what is wanted, so that the cusp at its rim is cut as well.
    parallel_each(cut.context, lines.size(), [&](std::size_t l) {
        Line& line = samples[l];
        for (std::size_t i = 0; i < line.size(); ++i) {
            Sample& s = line[i];
            if (!s.reachable) continue;
            s.cut = s.wanted || (i > 0 && s.u - line[i - 1].u <= step && line[i - 1].wanted) ||
                    (i + 1 < line.size() && line[i + 1].u - s.u <= step && line[i + 1].wanted);
            for (const std::size_t n : {l - 1, l + 1}) {
                if (s.cut || n >= lines.size()) continue;
                const Sample* beside = at(samples[n], s.u);
                s.cut = beside && beside->wanted;
            }
        }
    });
    // Where the surface turns faster than the lines follow, lines in between, over those places only.
    struct Between {
        std::int32_t v = 0;
        Line line;
    };
    std::vector<std::vector<Between>> between(lines.size());
    parallel_each(cut.context, uniform ? 0 : lines.size() - 1, [&](std::size_t l) {
        auto refine = [&](auto&& self, const Line& a, std::int32_t va, const Line& b,
                          std::int32_t vb) -> void {
            if (vb - va < 2 * finest) return;
            const std::int32_t v = va + (vb - va) / 2;
            Line middle;
            Met met;
            std::int32_t done = INT32_MIN;
            for (const Sample& s : a) {
                if (s.u % step != 0) continue;
                const Sample* other = at(b, s.u);
                if (!other || !too_far(s, va, *other, vb)) continue;
                for (const std::int32_t u : {s.u - step, s.u, s.u + step}) {
                    if (u <= done) continue;
                    append_between(append_between, middle, sample(u, v, met), v, met);
                    done = u;
                }
            }
            if (middle.empty()) return;
            for (Sample& s : middle) s.cut = s.wanted;
            self(self, a, va, middle, v);
            between[l].push_back({v, middle});
            self(self, middle, v, b, vb);
        };
        if (raster.apart.empty() || !raster.apart[l])
            refine(refine, samples[l], lines[l], samples[l + 1], lines[l + 1]);
    });

    const Slide slide = raster_slide(cut, ball);
    Runs runs;
    auto append_runs = [&](const Line& line, std::int32_t v) {
        std::vector<PathPoint> points;
        std::size_t last_cut = 0;  // length of `points` up to the last one that cuts
        std::int32_t before = 0, last_cut_u = 0;
        auto close = [&] {
            points.resize(last_cut);
            if (points.size() >= 2) runs.push_back(simplify(points, simplify_tolerance_units(gouge)));
            points.clear();
            last_cut = 0;
        };
        for (const Sample& s : line) {
            if (!points.empty() && s.u - before > step) close();
            before = s.u;
            if (!s.cut && points.empty()) continue;
            // Short stretches between two that cut are travelled along the surface.
            if (!s.reachable || (!s.cut && s.u - last_cut_u > to_units(3))) {
                close();
                continue;
            }
            const auto [x, y] = placed(s.u, v);
            append_free(points, {x, y, s.z}, slide);
            if (s.cut) {
                last_cut = points.size();
                last_cut_u = s.u;
            }
        }
        close();
    };
    for (std::size_t l = 0; l < lines.size(); ++l) append_runs(samples[l], lines[l]);
    for (const auto& group : between)
        for (const Between& b : group) append_runs(b.line, b.v);
    return runs;
}

// Of the runs one by one, s, with what it takes to come to the next.
double seconds_of(const LayerCut& cut, const Runs& runs) {
    constexpr double to_the_next = 0.2;  // s
    const double speed = std::min(cut.job.cutting.finish_feed, cut.job.machine.max_feed) / 60;
    double sum = to_the_next * static_cast<double>(runs.size());
    for (const std::vector<PathPoint>& run : runs) {
        Travel travel(axis_limits(cut.job.machine));
        for (std::size_t k = 1; k < run.size(); ++k) {
            const PathPoint &a = run[k - 1], &b = run[k];
            const Vec3d way{to_mm(b.x - a.x), to_mm(b.y - a.y), to_mm(b.z - a.z)};
            const double mm = length(way);
            if (mm > 0) travel.add({.length = mm, .speed = speed, .direction = scaled(1 / mm, way)});
        }
        sum += travel.seconds();
    }
    return sum;
}

// Along x, or along y where that is shorter by more than the estimate is worth, and a sample of the lines
// takes less time too: a line along a fin is run faster than one across it.
RasterLines chosen_lines(const LayerCut& cut, const RasterFacets& facets, const DropIndex& ball) {
    constexpr double clearly = 0.95;
    constexpr std::size_t groups = 8, together = 5;
    RasterLines x = raster_lines(cut, facets, Axis::x);
    if (cut.job.cutting.uniform_steps) return x;
    RasterLines y = raster_lines(cut, facets, Axis::y);
    if (!(length_mm(y) < clearly * length_mm(x))) return x;
    const auto seconds = [&](const RasterLines& lines) {
        const RasterLines some = some_of(lines, groups, together);
        return seconds_of(cut, raster_runs(cut, facets, some, ball)) *
               static_cast<double>(lines.across.size()) / static_cast<double>(some.across.size());
    };
    return seconds(y) < clearly * seconds(x) ? y : x;
}

}  // namespace

Operation finish_raster(const LayerCut& cut, std::vector<Diagnostic>& diagnostics) {
    const Tool& tool = cut.layer.tools.finish;
    Operation op = cut.operation(OperationKind::finish, "projected raster", tool);
    const RasterFacets facets = raster_facets(cut);
    if (facets.shallow.empty()) return op;
    const DropIndex& ball = cut.drops({Cutter::Profile::ball, facets.radius});
    const RasterLines raster = chosen_lines(cut, facets, ball);
    op.stepover = raster.widest_mm;
    if (raster.kept_wide)
        diagnostics.push_back(
            {Severity::warning,
             "finish.stepover_floor",
             fmt::format(
                 "layer {}: the raster's step-over was kept at {:.2f} mm, cusps there exceed {:.3f} mm",
                 cut.layer.index, cut.job.cutting.min_stepover, cut.job.tolerances.cusp),
             {}});

    PathBuilder path(op, tool, std::min(cut.job.cutting.finish_feed, cut.job.machine.max_feed),
                     cut.layer.z_top + cut.job.machine.clearance, cut.layer.z_top + 2);
    path.set_surroundings(cut.around(tool, &ball));
    follow_nearest(path, chained(raster_runs(cut, facets, raster, ball), raster_slide(cut, ball)));
    path.finish();
    return op;
}

}  // namespace slabwright
