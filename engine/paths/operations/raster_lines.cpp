#include "engine/paths/operations/raster_lines.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "engine/paths/runs/feet.h"
#include "kernels/cutting/cusp.h"
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
    FacingAcross(const std::vector<SolidFacet>& shallow, std::size_t across, double step_nz) {
        for (const SolidFacet& f : shallow)
            for (const Vec3d& p : f.p) low_ = std::min(low_, p[across]), high_ = std::max(high_, p[across]);
        facing_.assign(static_cast<std::size_t>((high_ - low_) / kStrip) + 1, -1);  // −1: nothing shallow
        for (const SolidFacet& f : shallow) {
            if (f.nz < step_nz) continue;
            const auto [from, to] = std::minmax({f.p[0][across], f.p[1][across], f.p[2][across]});
            for (auto s = static_cast<std::size_t>((from - low_) / kStrip),
                      e = static_cast<std::size_t>((to - low_) / kStrip);
                 s <= e; ++s)
                facing_[s] = std::max(facing_[s], static_cast<float>(std::abs(f.normal[across])));
        }
    }
    [[nodiscard]] double low() const { return low_; }
    [[nodiscard]] double high() const { return high_; }
    /// The most of all strips.
    [[nodiscard]] float most() const {
        return std::max(*std::max_element(facing_.begin(), facing_.end()), 0.0F);
    }
    /// The most of those that a ball at v touches.
    [[nodiscard]] float most(double v, double r) const {
        float most = 0;
        for (long s = index(v - r); s <= index(v + r); ++s)
            most = std::max(most, facing_[static_cast<std::size_t>(s)]);
        return most;
    }

private:
    [[nodiscard]] long index(double v) const {
        return std::clamp<long>(static_cast<long>(std::floor((v - low_) / kStrip)), 0,
                                static_cast<long>(facing_.size()) - 1);
    }
    double low_ = kUnbounded, high_ = -kUnbounded;
    std::vector<float> facing_;
};

}  // namespace

RasterLines raster_lines(const LayerCut& cut, const RasterFacets& facets, Axis along) {
    const FinishSlopes& slopes = facets.slopes;
    const double r = facets.radius;
    RasterLines result;
    result.along = along;
    // Steeper than this the cusp is kept by the level contours, where both cut everything.
    const double step_nz = std::cos(slopes.projection_keep) - 1e-9, keep_nz = std::cos(slopes.projection_to);
    const FacingAcross facing(facets.shallow, along == Axis::x ? 1 : 0, step_nz);
    const double reach_beside =
        r * std::sqrt(1 - keep_nz * keep_nz);  // how far the ball stands from its contact
    const Cutting& cutting = cut.job.cutting;
    for (double v = facing.low() - reach_beside; v <= facing.high() + reach_beside;) {
        result.across.push_back(to_units(v));
        // The ball at v touches within r of it; the pass must be near enough for the steepest face in
        // between.
        const float most = cutting.uniform_steps ? facing.most() : facing.most(v, r);
        double d = raster_stepover(r, cut.job.tolerances.cusp, most);
        if (d < cutting.min_stepover) d = cutting.min_stepover, result.kept_wide = true;
        result.widest_mm = std::max(result.widest_mm, d);
        v += d;
    }
    result.reach = covering(cut.context, facets.made, r, along, result.across);
    return result;
}

double length_mm(const RasterLines& lines) {
    double sum = kBegin * static_cast<double>(lines.reach.intervals.size());
    for (const Forbidden& interval : lines.reach.intervals) sum += interval.high - interval.low;
    return sum;
}

RasterLines some_of(const RasterLines& lines, std::size_t groups, std::size_t together) {
    const std::size_t count = lines.across.size();
    const std::size_t every = std::max(together, count / std::max<std::size_t>(1, groups));
    RasterLines some;
    some.along = lines.along;
    for (std::size_t l = 0; l < count; ++l) {
        const std::size_t in_group = l % every;
        if (in_group >= together) continue;
        some.across.push_back(lines.across[l]);
        some.apart.push_back(in_group + 1 == together && together < every);
        const auto reach = lines.reach.line(l);
        some.reach.intervals.insert(some.reach.intervals.end(), reach.begin(), reach.end());
        some.reach.starts.push_back(static_cast<std::uint32_t>(some.reach.intervals.size()));
    }
    return some;
}

}  // namespace slabwright
