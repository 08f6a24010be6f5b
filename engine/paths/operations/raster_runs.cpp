#include "engine/paths/operations/raster_runs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>

#include "engine/paths/operations/finish_slopes.h"
#include "engine/paths/runs/feet.h"
#include "engine/paths/runs/tolerances.h"
#include "kernels/cutting/fibres.h"
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

using Steps = std::array<std::int32_t, 2>;  // first and last of a row of places

// What the cutters met along a line.
struct Met {
    MetPoints ball, flat;
};

// The flat end mills that have finished floors, and where they have.
class FloorMills {
public:
    // @param ball_radius mm. @param step between places, 0.1 µm
    FloorMills(const LayerCut& cut, double ball_radius, std::int32_t step) : step_(step) {
        add(cut, cut.layer.tools.rough);
        if (clears_on_contours(cut.job))  // else semi-roughing does so on contours only
            for (const Tool& semi : cut.layer.tools.semi_rough) add(cut, semi);
        for (const Flat& flat : flats_) {
            if (flat.drops->cutter().radius < ball_radius) continue;
            Mill& mill = mills_.emplace_back(Mill{flat.drops.get(), {}});
            for (std::size_t w = 0; w < kTogether.size(); ++w) {
                const double wide =
                    flat.drops->cutter().radius + 0.5 * to_mm((kTogether[w] - 1) * step_) + kRounding;
                if (wide <= FacetTree::kWidestCutter)
                    mill.wide[w] = std::make_unique<DropIndex>(cut.solid, flat_cutter(wide));
            }
        }
    }

    // Whether an end mill finishes a floor's place: from right over it, or with its rim from beside a wall.
    [[nodiscard]] bool cover(double x, double y, double z, MetPoints& met) const {
        for (const Flat& flat : flats_) {
            if (!flat.drops->stands_over(x, y, z + kOnFloor, &met)) return true;
            for (int k = 0; k < 8; ++k) {
                const double turn = k * std::numbers::pi / 4, beside = 0.95 * flat.radius;
                if (!flat.drops->stands_over(x + beside * std::cos(turn), y + beside * std::sin(turn),
                                             z + kOnFloor, &met))
                    return true;
            }
        }
        return false;
    }

    struct Walk {
        double floor = 0;                // mm: the floor that the places before `stood` are finished on
        std::int32_t stood = INT32_MIN;  // in steps
        // In steps: where it is worth to ask for so many again.
        std::array<std::int32_t, kTogether.size()> ask{INT32_MIN, INT32_MIN};
        Met met{};
    };
    // Where a flat end mill no narrower than the ball has stood on a floor the ball would rest on that floor
    // as well (or on something less than kOnFloor higher), and has nothing to cut. Where an end mill that is
    // wider yet meets nothing, nor does this one anywhere around.
    // @param place(u) the place of a line, mm, at u mm along it. @param k in steps along the line
    template <class Place>
    [[nodiscard]] bool stand(Walk& walk, std::int32_t k, double floor, Place&& place) const {
        if (k < walk.stood && floor == walk.floor) return true;
        for (std::size_t w = 0; w < kTogether.size(); ++w) {
            if (k < walk.ask[w]) continue;
            const std::array<double, 2> at =
                place(to_mm(k * step_) + 0.5 * to_mm((kTogether[w] - 1) * step_));
            if (std::any_of(mills_.begin(), mills_.end(), [&](const Mill& mill) {
                    return mill.wide[w] && !mill.wide[w]->stands_over(
                                               at[0], at[1], floor + kOnFloor - kRounding, &walk.met.flat);
                })) {
                walk.floor = floor, walk.stood = k + kTogether[w];
                return true;
            }
            walk.ask[w] = k + kTogether[w];
        }
        const std::array<double, 2> at = place(to_mm(k * step_));
        return std::any_of(mills_.begin(), mills_.end(), [&](const Mill& mill) {
            return !mill.narrow->stands_over(at[0], at[1], floor + kOnFloor, &walk.met.flat);
        });
    }

private:
    void add(const LayerCut& cut, const Tool& tool) {
        const double radius = tool.diameter / 2;
        flats_.push_back({radius, std::make_unique<DropIndex>(cut.solid, flat_cutter(radius - 0.02))});
    }

    struct Flat {
        double radius;
        std::unique_ptr<DropIndex> drops;
    };
    struct Mill {
        const DropIndex* narrow;
        std::array<std::unique_ptr<DropIndex>, kTogether.size()> wide;
    };
    std::int32_t step_;
    std::vector<Flat> flats_;
    std::vector<Mill> mills_;  // no narrower than the ball
};

// A place of the ball on the surface: tip and contact.
struct Sample {
    std::int32_t u = 0, z = 0;  // 0.1 µm
    double tip = 0;             // mm
    std::array<double, 3> contact{};
    bool wanted = false, reachable = false, cut = false;
    bool steep = false;  // the level contours keep the cusp here
};
using SampledLine = std::vector<Sample>;

// Places are named by u along the lines and v across them.
class ProjectedRaster {
public:
    ProjectedRaster(const LayerCut& cut, const RasterFacets& facets, const RasterLines& raster,
                    const DropIndex& ball, const LineDirections* directions)
        : cut_(cut),
          facets_(facets),
          raster_(raster),
          ball_(ball),
          directions_(directions),
          lines_(raster.across),
          r_(facets.radius),
          step_(safe_step(r_, cut.job.tolerances.gouge)),
          mills_(cut, r_, step_) {}

    RasterRuns run() {
        find_ends();
        list_floor_spans();
        if (directions_ == nullptr) find_unfinished();  // else among their targets
        lay_samples();
        mark_cut();
        if (!cut_.job.cutting.uniform_steps) lay_between();
        RasterRuns runs;
        for (std::size_t l = 0; l < lines_.size(); ++l) append_runs(samples_[l], lines_[l], runs);
        for (const auto& group : between_)
            for (const Between& b : group) append_runs(b.line, b.v, runs);
        return runs;
    }

private:
    // x, y, mm
    [[nodiscard]] std::array<double, 2> placed(double u, double v) const {
        const LineDirection& d = raster_.direction;
        return {d.c * u - d.s * v, d.s * u + d.c * v};
    }
    [[nodiscard]] Vec3d turned(const Vec3d& p) const {
        const LineDirection& d = raster_.direction;
        return {d.c * p[0] + d.s * p[1], d.c * p[1] - d.s * p[0], p[2]};
    }

    // Where lines lie within the machine's travel.
    void find_ends() {
        const std::array<double, 2> x{cut_.low(0, r_), cut_.high(0, r_)},
            y{cut_.low(1, r_), cut_.high(1, r_)};
        for (const std::int32_t v : lines_) ends_.push_back(raster_.direction.within(to_mm(v), x, y));
    }

    // Where lines pass over floors, ascending by line: what most of a raster would only find to be finished.
    void list_floor_spans() {
        floor_spans_.resize(lines_.size());
        for (const double floor : cut_.floors) {
            std::vector<SolidFacet> facets = floor_facets(cut_, floor);
            for (SolidFacet& f : facets)
                for (Vec3d& p : f.p) p = turned(p);
            const Fibres over = covering(cut_.context, facets, kOverFloor, Axis::x, lines_);
            for (std::size_t l = 0; l < lines_.size(); ++l)
                for (const Forbidden& f : over.line(l)) floor_spans_[l].push_back({f.low, f.high, floor});
        }
        for (std::vector<FloorSpan>& spans : floor_spans_)
            std::sort(spans.begin(), spans.end(),
                      [](const FloorSpan& a, const FloorSpan& b) { return a.low < b.low; });
    }

    [[nodiscard]] bool is_floor(double z) const {
        return std::any_of(cut_.floors.begin(), cut_.floors.end(),
                           [&](double floor) { return z <= floor + 1e-6 && z >= floor - kSameFloor; });
    }

    Sample sample(std::int32_t u, std::int32_t v, Met& met) const {
        const std::array<std::int32_t, 2> place = raster_.direction.place(u, v);
        const double x = to_mm(place[0]), y = to_mm(place[1]);
        const Rest rest = ball_.drop(x, y, -std::numeric_limits<double>::infinity(), &met.ball);
        Sample s;
        s.u = u;
        s.steep = steeper_ && rest.nz < step_nz_;
        s.contact = {x - r_ * rest.nx, y - r_ * rest.ny, rest.contact_z(r_)};
        const double contact = s.contact[2];
        s.wanted =
            rest.nz >= keep_nz_ && !rest.on_cap && contact >= cut_.layer.z_bottom - 0.02 &&
            contact < facets_.top && rest.tip_z >= cut_.layer.floor_below &&
            !(directions_ != nullptr && directions_->is_another(raster_.number, s.contact[0], s.contact[1]));
        // Nor is the rim of a finished floor worth a visit: floor and wall make it.
        if (s.wanted && is_floor(contact) && mills_.cover(s.contact[0], s.contact[1], contact, met.flat))
            s.wanted = false;
        s.tip = rest.tip_z;
        s.reachable = s.tip >= cut_.layer.floor_below && !rest.on_cap;
        if (s.reachable) s.z = to_units(s.tip) + 1;
        return s;
    }

    // Of a line where flat end mills have stood on a floor.
    [[nodiscard]] bool flat_stands(FloorMills::Walk& walk, std::int32_t k, std::int32_t v,
                                   double floor) const {
        return mills_.stand(walk, k, floor, [&](double u) { return placed(u, to_mm(v)); });
    }
    std::optional<Sample> finished(FloorMills::Walk& walk, std::int32_t k, std::int32_t v,
                                   double floor) const {
        if (!flat_stands(walk, k, v, floor)) return std::nullopt;
        Sample s;
        s.u = k * step_;
        const auto [x, y] = placed(to_mm(s.u), to_mm(v));
        s.contact = {x, y, floor};
        s.tip = floor + kOnFloor;
        s.reachable = floor >= cut_.layer.floor_below;
        if (s.reachable) s.z = to_units(s.tip) + 1;
        return s;
    }

    // Between two places of the ball a cusp of about c·δ/(8r) stays, c the way between the contacts and δ the
    // way of the ball: on a plane both are the same, in a hollow the contacts run ahead of the ball.
    [[nodiscard]] bool too_far(const Sample& a, std::int32_t va, const Sample& b, std::int32_t vb) const {
        if (!a.reachable || !b.reachable || (a.steep && b.steep) ||
            (a.contact[2] < cut_.layer.z_bottom && b.contact[2] < cut_.layer.z_bottom))
            return false;
        const double c =
            std::hypot(a.contact[0] - b.contact[0], a.contact[1] - b.contact[1], a.contact[2] - b.contact[2]);
        const double d = std::hypot(to_mm(a.u) - to_mm(b.u), to_mm(va) - to_mm(vb), a.tip - b.tip);
        return c * d > 8 * r_ * cut_.job.tolerances.cusp * 1.5;
    }
    [[nodiscard]] bool apart(const Sample& a, const Sample& b) const {
        if (!a.reachable || !b.reachable) return a.reachable != b.reachable;
        return std::hypot(to_mm(a.u) - to_mm(b.u), a.tip - b.tip) > chord_;
    }

    void append_between(SampledLine& line, Sample b, std::int32_t v, Met& met) const {
        if (!line.empty() && b.u - line.back().u <= step_ && b.u - line.back().u > 2 * finest_ &&
            (too_far(line.back(), v, b, v) || (walls_ && apart(line.back(), b)))) {
            const Sample middle = sample(line.back().u + (b.u - line.back().u) / 2, v, met);
            append_between(line, middle, v, met);
            append_between(line, b, v, met);
            return;
        }
        line.push_back(b);
    }

    // The places from one end to the other, 0.1 µm, that the cutter may go to on a line, in steps.
    [[nodiscard]] Steps steps_within(std::size_t l, double low, double high) const {
        return {static_cast<std::int32_t>(std::ceil(std::max(low, ends_[l][0] * kUnitsPerMm) / step_)),
                static_cast<std::int32_t>(std::floor(std::min(high, ends_[l][1] * kUnitsPerMm) / step_))};
    }

    // Places on floors that no flat end mill has finished.
    void find_unfinished() {
        unfinished_.resize(lines_.size());
        parallel_each(cut_.context, lines_.size(), [&](std::size_t l) {
            FloorMills::Walk walk;
            std::int32_t next = INT32_MIN;
            std::vector<Steps>& own = unfinished_[l];
            for (const FloorSpan& span : floor_spans_[l]) {
                const auto [first, last] = steps_within(l, span.low * kUnitsPerMm, span.high * kUnitsPerMm);
                for (std::int32_t k = std::max(first, next); k <= last; ++k) {
                    next = k + 1;
                    const auto [x, y] = placed(to_mm(k * step_), to_mm(lines_[l]));
                    if (flat_stands(walk, k, lines_[l], span.z) ||
                        mills_.cover(x, y, span.z, walk.met.flat) ||
                        !sample(k * step_, lines_[l], walk.met).wanted)
                        continue;
                    if (!own.empty() && own.back()[1] + 1 == k) own.back()[1] = k;
                    else own.push_back({k, k});
                }
            }
        });
    }

    // What the ball may make within its reach of a line, 0.1 µm along it.
    [[nodiscard]] std::vector<Span> spans_of(std::size_t l) const {
        std::vector<Span> spans;
        for (const auto& [low, high] : raster_.reach[l])
            spans.push_back({static_cast<double>(low), static_cast<double>(high)});
        if (directions_ != nullptr) return spans;
        const double reaches = r_ * kUnitsPerMm;
        const auto near =
            std::lower_bound(lines_.begin(), lines_.end(), lines_[l] - to_units(r_)) - lines_.begin();
        for (auto n = static_cast<std::size_t>(near);
             n < lines_.size() && lines_[n] <= lines_[l] + to_units(r_); ++n)
            for (const auto& [from, to] : unfinished_[n])
                spans.push_back({from * step_ - reaches, to * step_ + reaches});
        std::sort(spans.begin(), spans.end(), [](const Span& a, const Span& b) { return a.low < b.low; });
        return spans;
    }

    // What the ball may make, with one step around.
    void lay_samples() {
        samples_.resize(lines_.size());
        parallel_each(cut_.context, lines_.size(), [&](std::size_t l) {
            std::int32_t next = INT32_MIN;
            auto floor = floor_spans_[l].begin();
            const auto end = floor_spans_[l].end();
            FloorMills::Walk walk;
            for (const Span& span : spans_of(l)) {
                const auto [first, last] = steps_within(l, span.low - step_, span.high + step_);
                for (std::int32_t k = std::max(first, next); k <= last; ++k) {
                    next = k + 1;
                    const double u = to_mm(k * step_);
                    while (floor != end && floor->high < u) ++floor;
                    const std::optional<Sample> done = floor != end && floor->low < u
                                                           ? finished(walk, k, lines_[l], floor->z)
                                                           : std::nullopt;
                    append_between(samples_[l], done ? *done : sample(k * step_, lines_[l], walk.met),
                                   lines_[l], walk.met);
                }
            }
        });
    }

    static const Sample* at(const SampledLine& line, std::int32_t u) {
        const auto it = std::lower_bound(line.begin(), line.end(), u,
                                         [](const Sample& s, std::int32_t other) { return s.u < other; });
        return it != line.end() && it->u == u ? &*it : nullptr;
    }

    // One sample and one line beyond what is wanted, so that the cusp at its rim is cut as well.
    void mark_cut() {
        parallel_each(cut_.context, lines_.size(), [&](std::size_t l) {
            SampledLine& line = samples_[l];
            for (std::size_t i = 0; i < line.size(); ++i) {
                Sample& s = line[i];
                if (!s.reachable) continue;
                s.cut = s.wanted || (i > 0 && s.u - line[i - 1].u <= step_ && line[i - 1].wanted) ||
                        (i + 1 < line.size() && line[i + 1].u - s.u <= step_ && line[i + 1].wanted);
                for (const std::size_t n : {l - 1, l + 1}) {
                    if (s.cut || n >= lines_.size()) continue;
                    const Sample* beside = at(samples_[n], s.u);
                    s.cut = beside && beside->wanted;
                }
            }
        });
    }

    struct Between {
        std::int32_t v = 0;
        SampledLine line;
    };
    // Where the surface turns faster than the lines follow, lines in between, over those places only.
    void lay_between() {
        between_.resize(lines_.size());
        parallel_each(cut_.context, lines_.size() - 1, [&](std::size_t l) {
            if (raster_.apart.empty() || !raster_.apart[l])
                refine(samples_[l], lines_[l], samples_[l + 1], lines_[l + 1], between_[l]);
        });
    }
    void refine(const SampledLine& a, std::int32_t va, const SampledLine& b, std::int32_t vb,
                std::vector<Between>& between) const {
        if (vb - va < 2 * finest_) return;
        const std::int32_t v = va + (vb - va) / 2;
        SampledLine middle;
        Met met;
        std::int32_t done = INT32_MIN;
        for (const Sample& s : a) {
            if (s.u % step_ != 0) continue;
            const Sample* other = at(b, s.u);
            if (!other || !too_far(s, va, *other, vb)) continue;
            for (const std::int32_t u : {s.u - step_, s.u, s.u + step_}) {
                if (u <= done) continue;
                append_between(middle, sample(u, v, met), v, met);
                done = u;
            }
        }
        if (middle.empty()) return;
        for (Sample& s : middle) s.cut = s.wanted;
        refine(a, va, middle, v, between);
        between.push_back({v, middle});
        refine(middle, v, b, vb, between);
    }

    void append_runs(const SampledLine& line, std::int32_t v, RasterRuns& runs) const {
        std::vector<PathPoint> points;
        std::size_t last_cut = 0;  // length of `points` up to the last one that cuts
        std::int32_t before = 0, last_cut_u = 0;
        auto close = [&] {
            points.resize(last_cut);
            if (points.size() >= 2)
                runs.push_back(simplify(points, simplify_tolerance_units(cut_.job.tolerances.gouge)));
            points.clear();
            last_cut = 0;
        };
        for (const Sample& s : line) {
            if (!points.empty() && s.u - before > step_) close();
            before = s.u;
            if (!s.cut && points.empty()) continue;
            // Short stretches between two that cut are travelled along the surface.
            if (!s.reachable || (!s.cut && s.u - last_cut_u > to_units(3))) {
                close();
                continue;
            }
            const auto [x, y] = raster_.direction.place(s.u, v);
            append_free(points, {x, y, s.z}, slide_);
            if (s.cut) {
                last_cut = points.size();
                last_cut_u = s.u;
            }
        }
        close();
    }

    struct FloorSpan {
        double low, high, z;  // mm
    };
    const LayerCut& cut_;
    const RasterFacets& facets_;
    const RasterLines& raster_;
    const DropIndex& ball_;
    const LineDirections* directions_;
    const std::vector<std::int32_t>& lines_;
    const double r_;           // mm
    const std::int32_t step_;  // samples stand on multiples of it, so that those of neighbouring lines are
                               // neighbours
    const FloorMills mills_;
    // Steeper than step_nz_ the cusp is kept by the level contours, where both cut everything.
    const double keep_nz_ = std::cos(facets_.slopes.projection_to),
                 step_nz_ = std::cos(facets_.slopes.projection_keep) - 1e-9;
    const bool steeper_ = facets_.slopes.projection_keep < facets_.slopes.projection_to;
    // Where walls are projected too, a line follows them in safe chords, down to the last place that the ball
    // reaches.
    const bool walls_ = cut_.job.cutting.finish_strategy != FinishStrategy::split;
    const std::int32_t finest_ = to_units(walls_ ? 0.005 : 0.02);
    const double chord_ = safe_chord_mm(r_, cut_.job.tolerances.gouge);
    const Slide slide_ = raster_slide(cut_, ball_);
    std::vector<std::array<double, 2>> ends_;  // of each line, mm along it
    std::vector<std::vector<FloorSpan>> floor_spans_;
    std::vector<std::vector<Steps>> unfinished_;  // by line
    std::vector<SampledLine> samples_;
    std::vector<std::vector<Between>> between_;  // by the line before
};

}  // namespace

Slide raster_slide(const LayerCut& cut, const DropIndex& ball) {
    return {.part = &ball,
            .chord = safe_chord_mm(ball.cutter().radius, cut.job.tolerances.gouge),
            .top = cut.layer.z_top,
            .hops = true};
}

RasterRuns raster_runs(const LayerCut& cut, const RasterFacets& facets, const RasterLines& raster,
                       const DropIndex& ball, const LineDirections* directions) {
    return ProjectedRaster(cut, facets, raster, ball, directions).run();
}

}  // namespace slabwright
