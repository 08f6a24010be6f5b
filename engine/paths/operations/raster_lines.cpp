#include "engine/paths/operations/raster_lines.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "engine/paths/runs/feet.h"
#include "engine/stock/layer_stock.h"
#include "kernels/cutting/cusp.h"
#include "kernels/cutting/fibres.h"
#include "kernels/geometry/vectors.h"

namespace slabwright {

namespace {

constexpr double kStrip = 0.5;  // mm: the slopes are told by strips so wide
/// What it costs to begin another line, mm of cutting: two ramps of the feed and the way over.
constexpr double kBegin = 4;

// How far the shallow facets face across the lines, strip by strip: that decides the step-over of the passes
// over them.
class FacingAcross {
public:
    FacingAcross(const LineDirection& direction, double low, double high)
        : c_(direction.c),
          s_(direction.s),
          low_(low),
          facing_(static_cast<std::size_t>((high - low) / kStrip) + 1, 0) {}

    [[nodiscard]] std::array<double, 2> extent(const SolidFacet& f) const {
        const std::array<double, 3> v{across(f.p[0]), across(f.p[1]), across(f.p[2])};
        const auto [low, high] = std::minmax_element(v.begin(), v.end());
        return {*low, *high};
    }
    void add(const SolidFacet& f) {
        const auto [from, to] = extent(f);
        for (long s = index(from), e = index(to); s <= e; ++s) {
            float& most = facing_[static_cast<std::size_t>(s)];
            most = std::max(most, static_cast<float>(std::abs(across(f.normal))));
        }
    }
    /// The most of all strips.
    [[nodiscard]] float most() const { return *std::max_element(facing_.begin(), facing_.end()); }
    /// The most of those that a ball at v touches.
    [[nodiscard]] float most(double v, double r) const {
        float most = 0;
        for (long s = index(v - r); s <= index(v + r); ++s)
            most = std::max(most, facing_[static_cast<std::size_t>(s)]);
        return most;
    }

private:
    [[nodiscard]] double across(const Vec3d& p) const { return c_ * p[1] - s_ * p[0]; }
    [[nodiscard]] long index(double v) const {
        return std::clamp<long>(static_cast<long>(std::floor((v - low_) / kStrip)), 0,
                                static_cast<long>(facing_.size()) - 1);
    }
    double c_, s_, low_;
    std::vector<float> facing_;
};

// Steeper than this the cusp is kept by the level contours, where both cut everything.
double step_nz(const RasterFacets& facets) { return std::cos(facets.slopes.projection_keep) - 1e-9; }

// mm: how far the ball stands from its contact.
double reach_beside(const RasterFacets& facets) {
    const double keep_nz = std::cos(facets.slopes.projection_to);
    return facets.radius * std::sqrt(1 - keep_nz * keep_nz);
}

// The ball at v touches within r of it; the pass must be near enough for the steepest face in between.
void lay(RasterLines& lines, const LayerCut& cut, const FacingAcross& facing, double r, double low,
         double high) {
    const Cutting& cutting = cut.job.cutting;
    for (double v = low; v <= high;) {
        lines.across.push_back(to_units(v));
        const float most = cutting.uniform_steps ? facing.most() : facing.most(v, r);
        double d = raster_stepover(r, cut.job.tolerances.cusp, most);
        if (d < cutting.min_stepover) d = cutting.min_stepover, lines.kept_wide = true;
        lines.widest_mm = std::max(lines.widest_mm, d);
        v += d;
    }
}

}  // namespace

RasterLines raster_lines(const LayerCut& cut, const RasterFacets& facets) {
    RasterLines result;
    double low = kUnbounded, high = -kUnbounded;
    for (const SolidFacet& f : facets.shallow)
        for (const Vec3d& p : f.p) low = std::min(low, p[1]), high = std::max(high, p[1]);
    FacingAcross facing(result.direction, low, high);
    for (const SolidFacet& f : facets.shallow)
        if (f.nz >= step_nz(facets)) facing.add(f);
    lay(result, cut, facing, facets.radius, low - reach_beside(facets), high + reach_beside(facets));
    const Fibres reach = covering(cut.context, facets.made, facets.radius, Axis::x, result.across);
    for (std::size_t l = 0; l < result.across.size(); ++l) {
        Spans& spans = result.reach.emplace_back();
        for (const Forbidden& f : reach.line(l)) spans.push_back({to_units(f.low), to_units(f.high)});
    }
    return result;
}

RasterLines raster_lines(const LayerCut& cut, const RasterFacets& facets, const LineDirections& directions,
                         std::size_t number) {
    RasterLines result;
    result.number = number;
    result.direction = directions.all()[number];
    const auto [low, high] = directions.across(number);
    if (low > high) return result;
    FacingAcross facing(result.direction, low, high);
    const std::vector<std::uint32_t> counts = directions.counts(number);
    const double beside = reach_beside(facets), r = facets.radius;
    for (const SolidFacet& f : facets.shallow) {
        if (f.nz < step_nz(facets)) continue;
        const auto [x0, x1] = std::minmax({f.p[0][0], f.p[1][0], f.p[2][0]});
        const auto [y0, y1] = std::minmax({f.p[0][1], f.p[1][1], f.p[2][1]});
        const auto [from, to] = facing.extent(f);
        if (to >= low && from <= high && directions.has_some(counts, {x0, y0}, {x1, y1})) facing.add(f);
    }
    lay(result, cut, facing, r, low - beside, high + beside);
    const std::array<double, 2> x{cut.low(0, r), cut.high(0, r)}, y{cut.low(1, r), cut.high(1, r)};
    const double covers = beside + cut.stock->grid().cell;
    for (const std::int32_t v : result.across)
        result.reach.push_back(
            directions.around(number, to_mm(v), covers, result.direction.within(to_mm(v), x, y)));
    return result;
}

double length_mm(const RasterLines& lines) {
    double sum = 0;
    for (const Spans& spans : lines.reach)
        for (const auto& [low, high] : spans) sum += kBegin + to_mm(high - low);
    return sum;
}

RasterLines some_of(const RasterLines& lines, std::size_t groups, std::size_t together) {
    const std::size_t count = lines.across.size();
    const std::size_t every = std::max(together, count / std::max<std::size_t>(1, groups));
    RasterLines some;
    some.number = lines.number;
    some.direction = lines.direction;
    for (std::size_t l = 0; l < count; ++l) {
        const std::size_t in_group = l % every;
        if (in_group >= together) continue;
        some.across.push_back(lines.across[l]);
        some.apart.push_back(in_group + 1 == together && together < every);
        some.reach.push_back(lines.reach[l]);
    }
    return some;
}

}  // namespace slabwright
