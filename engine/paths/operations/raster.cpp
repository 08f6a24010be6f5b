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

#include "engine/paths/operations/finish_slopes.h"
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

}  // namespace

Operation finish_raster(const LayerCut& cut, std::vector<Diagnostic>& diagnostics) {
    const Tool& tool = cut.layer.tools.finish;
    Operation op = cut.operation(OperationKind::finish, "projected raster", tool);
    const double r = tool.diameter / 2, gouge = cut.job.tolerances.gouge, cusp = cut.job.tolerances.cusp;
    const FinishSlopes slopes = finish_slopes(cut.job.cutting);
    if (slopes.projection_to < 0) return op;
    // Steeper than step_nz the cusp is kept by the level contours, where both cut everything.
    const double keep_nz = std::cos(slopes.projection_to), step_nz = std::cos(slopes.projection_keep) - 1e-9;
    const bool uniform = cut.job.cutting.uniform_steps,
               steeper = slopes.projection_keep < slopes.projection_to;

    std::vector<SolidFacet> shallow;
    for (const SolidFacet& f : cut.solid.facets)
        if (f.nz >= keep_nz && f.z_max > cut.layer.z_bottom && !(f.z_min == cut.layer.z_top))
            shallow.push_back(f);
    if (shallow.empty()) return op;

    // How far the shallow facets face along y, by strips of y: that decides the step-over of the passes over
    // them.
    double y_low = kUnbounded, y_high = -kUnbounded;
    for (const SolidFacet& f : shallow)
        for (const Vec3d& p : f.p) y_low = std::min(y_low, p[1]), y_high = std::max(y_high, p[1]);
    constexpr double strip = 0.5;
    std::vector<float> facing(static_cast<std::size_t>((y_high - y_low) / strip) + 1,
                              -1);  // −1: nothing shallow there
    for (const SolidFacet& f : shallow) {
        if (f.nz < step_nz) continue;
        const auto [low, high] = std::minmax({f.p[0][1], f.p[1][1], f.p[2][1]});
        for (auto s = static_cast<std::size_t>((low - y_low) / strip),
                  e = static_cast<std::size_t>((high - y_low) / strip);
             s <= e; ++s)
            facing[s] = std::max(facing[s], static_cast<float>(std::abs(f.normal[1])));
    }
    std::vector<std::int32_t> lines;
    bool floor_bites = false;
    const float worst = *std::max_element(facing.begin(), facing.end());
    const double reach_beside =
        r * std::sqrt(1 - keep_nz * keep_nz);  // how far the ball stands from its contact
    for (double y = y_low - reach_beside; y <= y_high + reach_beside;) {
        lines.push_back(to_units(y));
        // The ball at y touches within r of it; the pass must be near enough for the steepest face in
        // between.
        const auto index = [&](double v) {
            return std::clamp<long>(static_cast<long>(std::floor((v - y_low) / strip)), 0,
                                    static_cast<long>(facing.size()) - 1);
        };
        float most = uniform ? std::max(worst, 0.0F) : 0;
        for (long s = index(y - r); s <= index(y + r); ++s)
            most = std::max(most, facing[static_cast<std::size_t>(s)]);
        double d = raster_stepover(r, cusp, most);
        if (d < cut.job.cutting.min_stepover) d = cut.job.cutting.min_stepover, floor_bites = true;
        op.stepover = std::max(op.stepover, d);
        y += d;
    }
    if (floor_bites)
        diagnostics.push_back(
            {Severity::warning,
             "finish.stepover_floor",
             fmt::format(
                 "layer {}: the raster's step-over was kept at {:.2f} mm, cusps there exceed {:.3f} mm",
                 cut.layer.index, cut.job.cutting.min_stepover, cusp),
             {}});

    const DropIndex& ball = cut.drops({Cutter::Profile::ball, r});
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
    auto is_floor = [&](const SolidFacet& f) {
        return std::any_of(cut.floors.begin(), cut.floors.end(),
                           [&](double z) { return lies_on_floor(f, z); });
    };
    auto floor_done = [&](double z) {
        for (const double floor : cut.floors)
            if (z <= floor + 1e-6 && z >= floor - kSameFloor) return true;
        return false;
    };

    // The rim of the layer's flat top, where the facets end (kTopSheet), is made by the walls under it.
    const double top = cut.layer.z_top - 1.5 * kTopSheet;

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
        const Fibres over = covering(cut.context, floor_facets(cut, floor), kOverFloor, Axis::x, lines);
        for (std::size_t l = 0; l < lines.size(); ++l)
            for (const Forbidden& f : over.line(l)) floor_spans[l].push_back({f.low, f.high, floor});
    }
    for (std::vector<FloorSpan>& spans : floor_spans)
        std::sort(spans.begin(), spans.end(),
                  [](const FloorSpan& a, const FloorSpan& b) { return a.low < b.low; });

    // A place of the ball on the surface: tip and contact.
    struct Sample {
        std::int32_t x = 0, z = 0;  // 0.1 µm
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
    auto sample = [&](std::int32_t ux, std::int32_t uy, Met& met) {
        const double x = to_mm(ux), y = to_mm(uy);
        const Rest rest = ball.drop(x, y, -std::numeric_limits<double>::infinity(), &met.ball);
        Sample s;
        s.x = ux;
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
    auto flat_stands = [&](FloorWalk& walk, std::int32_t k, std::int32_t uy, double floor) {
        if (k < walk.stood && floor == walk.floor) return true;
        const double y = to_mm(uy);
        for (std::size_t w = 0; w < kTogether.size(); ++w) {
            if (k < walk.ask[w]) continue;
            const double middle = to_mm(k * step) + 0.5 * to_mm((kTogether[w] - 1) * step);
            if (std::any_of(floor_mills.begin(), floor_mills.end(), [&](const FloorMill& mill) {
                    return mill.wide[w] && !mill.wide[w]->stands_over(middle, y, floor + kOnFloor - kRounding,
                                                                      &walk.met.flat);
                })) {
                walk.floor = floor, walk.stood = k + kTogether[w];
                return true;
            }
            walk.ask[w] = k + kTogether[w];
        }
        return std::any_of(floor_mills.begin(), floor_mills.end(), [&](const FloorMill& mill) {
            return !mill.narrow->stands_over(to_mm(k * step), y, floor + kOnFloor, &walk.met.flat);
        });
    };
    auto finished = [&](FloorWalk& walk, std::int32_t k, std::int32_t uy,
                        double floor) -> std::optional<Sample> {
        if (!flat_stands(walk, k, uy, floor)) return std::nullopt;
        Sample s;
        s.x = k * step;
        s.contact = {to_mm(s.x), to_mm(uy), floor};
        s.tip = floor + kOnFloor;
        s.reachable = floor >= cut.layer.floor_below;
        if (s.reachable) s.z = to_units(s.tip) + 1;
        return s;
    };
    // Between two places of the ball a cusp of about c·δ/(8r) stays, c the way between the contacts and δ the
    // way of the ball: on a plane both are the same, in a hollow the contacts run ahead of the ball.
    auto too_far = [&](const Sample& a, std::int32_t ya, const Sample& b, std::int32_t yb) {
        if (!a.reachable || !b.reachable || (a.steep && b.steep) ||
            (a.contact[2] < cut.layer.z_bottom && b.contact[2] < cut.layer.z_bottom))
            return false;
        const double c =
            std::hypot(a.contact[0] - b.contact[0], a.contact[1] - b.contact[1], a.contact[2] - b.contact[2]);
        const double d = std::hypot(to_mm(a.x) - to_mm(b.x), to_mm(ya) - to_mm(yb), a.tip - b.tip);
        return c * d > 8 * r * cusp * 1.5;
    };
    // Where walls are projected too, a line follows them in safe chords, down to the last place that the ball
    // reaches.
    const bool walls = cut.job.cutting.finish_strategy != FinishStrategy::split;
    const std::int32_t finest = to_units(walls ? 0.005 : 0.02);
    auto apart = [&](const Sample& a, const Sample& b) {
        if (!a.reachable || !b.reachable) return a.reachable != b.reachable;
        return std::hypot(to_mm(a.x) - to_mm(b.x), a.tip - b.tip) > chord;
    };
    auto append_between = [&](auto&& self, Line& line, Sample b, std::int32_t y, Met& met) -> void {
        if (!line.empty() && b.x - line.back().x <= step && b.x - line.back().x > 2 * finest &&
            (too_far(line.back(), y, b, y) || (walls && apart(line.back(), b)))) {
            const Sample middle = sample(line.back().x + (b.x - line.back().x) / 2, y, met);
            self(self, line, middle, y, met);
            self(self, line, b, y, met);
            return;
        }
        line.push_back(b);
    };

    // What the ball may make: the shallow surface, but for floors. Of these it makes the places where no flat
    // end mill stood.
    std::vector<SolidFacet> made;
    for (const SolidFacet& f : shallow)
        if (f.z_min < top && !is_floor(f)) made.push_back(f);
    const Fibres reach = covering(cut.context, made, r, Axis::x, lines);
    const double low_limit = cut.low(0, r) * kUnitsPerMm, high_limit = cut.high(0, r) * kUnitsPerMm;
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
                if (flat_stands(walk, k, lines[l], span.z) ||
                    flat_covers(to_mm(k * step), to_mm(lines[l]), span.z, walk.met.flat) ||
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
                const double x = to_mm(k * step);
                while (floor != floor_spans[l].end() && floor->high < x) ++floor;
                const std::optional<Sample> done = floor != floor_spans[l].end() && floor->low < x
                                                       ? finished(walk, k, lines[l], floor->z)
                                                       : std::nullopt;
                append_between(append_between, samples[l],
                               done ? *done : sample(k * step, lines[l], walk.met), lines[l], walk.met);
            }
        }
    });
    auto at = [](const Line& line, std::int32_t x) -> const Sample* {
        const auto it = std::lower_bound(line.begin(), line.end(), x,
                                         [](const Sample& s, std::int32_t v) { return s.x < v; });
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
    parallel_each(cut.context, uniform ? 0 : lines.size() - 1, [&](std::size_t l) {
        auto refine = [&](auto&& self, const Line& a, std::int32_t ya, const Line& b,
                          std::int32_t yb) -> void {
            if (yb - ya < 2 * finest) return;
            const std::int32_t y = ya + (yb - ya) / 2;
            Line middle;
            Met met;
            std::int32_t done = INT32_MIN;
            for (const Sample& s : a) {
                if (s.x % step != 0) continue;
                const Sample* other = at(b, s.x);
                if (!other || !too_far(s, ya, *other, yb)) continue;
                for (const std::int32_t x : {s.x - step, s.x, s.x + step}) {
                    if (x <= done) continue;
                    append_between(append_between, middle, sample(x, y, met), y, met);
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

    const Slide slide{&ball, true, chord, cut.layer.z_top, 3};
    std::vector<std::vector<PathPoint>> runs;
    auto append_runs = [&](const Line& line, std::int32_t y) {
        std::vector<PathPoint> points;
        std::size_t last_cut = 0;  // length of `points` up to the last one that cuts
        std::int32_t before = 0, last_cut_x = 0;
        auto close = [&] {
            points.resize(last_cut);
            if (points.size() >= 2) runs.push_back(simplify(points, simplify_tolerance_units(gouge)));
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
            append_free(points, {s.x, y, s.z}, slide);
            if (s.cut) {
                last_cut = points.size();
                last_cut_x = s.x;
            }
        }
        close();
    };
    // First the even raster, then the lines between.
    for (std::size_t l = 0; l < lines.size(); ++l) append_runs(samples[l], lines[l]);
    for (const auto& group : between)
        for (const Between& b : group) append_runs(b.line, b.y);

    PathBuilder path(op, tool, std::min(cut.job.cutting.finish_feed, cut.job.machine.max_feed),
                     cut.layer.z_top + cut.job.machine.clearance, cut.layer.z_top + 2);
    path.set_surroundings(cut.around(tool, &ball));
    follow_nearest(path, chained(std::move(runs), slide));
    path.finish();
    return op;
}

}  // namespace slabwright
