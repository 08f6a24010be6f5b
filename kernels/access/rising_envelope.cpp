#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <tuple>

#include "kernels/access/standing_part.h"
#include "kernels/access/standing_walk.h"
#include "kernels/geometry/triangle.h"

namespace slabwright {

namespace {
constexpr double kInfinity = std::numeric_limits<double>::infinity();
}

// fn(point, winding, height) for all points that facets come over which may be as high as z_low and lower
// than z_high.
template <class Fn>
void RisingEnvelope::for_each_point(double z_low, double z_high, Fn&& fn) const {
    const double x1 = x0_ + cell_ * (nx_ - 1), y1 = y0_ + cell_ * (ny_ - 1), per_cell = 1 / cell_;
    // Points from `low` to `high`, and one beside them where rounding does not tell: facet_winding() decides,
    // this only saves asking it.
    constexpr double hair = 1e-6;
    const auto first_of = [](double low) { return low > 0 ? static_cast<int>(low + (1 - hair)) : 0; };
    const auto last_of = [](double high, int n) {
        return high < -hair ? -1 : high < n - 1 ? static_cast<int>(high + hair) : n - 1;
    };
    part_->walk_within(StandingPart::Within({x0_, y0_, z_low}, {x1, y1, z_high}), [&](const auto& facet) {
        const auto& [a, b, c] = facet.v;
        if (std::max({a.z, b.z, c.z}) < z_low || std::min({a.z, b.z, c.z}) >= z_high) return;
        const double fx0 = (std::min({a.x, b.x, c.x}) - x0_) * per_cell,
                     fx1 = (std::max({a.x, b.x, c.x}) - x0_) * per_cell;
        const double fy0 = (std::min({a.y, b.y, c.y}) - y0_) * per_cell,
                     fy1 = (std::max({a.y, b.y, c.y}) - y0_) * per_cell;
        if (fx0 > nx_ || fy0 > ny_) return;
        const int i0 = first_of(fx0), i1 = last_of(fx1, nx_), j0 = first_of(fy0), j1 = last_of(fy1, ny_);
        for (int j = j0; j <= j1; ++j) {
            const double y = y0_ + j * cell_;
            int begin = i0, last = i1;
            if (constexpr int few = 3; last - begin >= few) {  // where the row crosses the outline
                double low = fx1, high = fx0;
                for (int k = 0; k < 3; ++k) {
                    const Vec3f &p = facet.v[static_cast<std::size_t>(k)],
                                &q = facet.v[static_cast<std::size_t>((k + 1) % 3)];
                    if ((p.y <= y) == (q.y <= y)) continue;
                    const double x =
                        p.x + (y - p.y) / (static_cast<double>(q.y) - p.y) * (static_cast<double>(q.x) - p.x);
                    low = std::min(low, (x - x0_) * per_cell);
                    high = std::max(high, (x - x0_) * per_cell);
                }
                begin = first_of(low);
                last = last_of(high, nx_);
            }
            for (int i = begin; i <= last; ++i) {
                const double x = x0_ + i * cell_;
                if (const int w = facet_winding(facet.v, x, y); w != 0)
                    fn(static_cast<std::size_t>(j) * static_cast<std::size_t>(nx_) +
                           static_cast<std::size_t>(i),
                       w, facet_height(facet.v, x, y));
            }
        }
    });
}

RisingEnvelope::RisingEnvelope(const StandingPart& part, double x0, double y0, double cell, int nx, int ny)
    : part_(&part),
      x0_(x0),
      y0_(y0),
      cell_(cell),
      nx_(nx),
      ny_(ny),
      passed_(-kInfinity),
      above_(static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny), 0),
      below_(above_.size(), -std::numeric_limits<float>::infinity()) {
    // Over a closed mesh what is at all heights together winds around nothing.
    if (!part.closed_)
        for_each_point(-kInfinity, kInfinity, [&](std::size_t k, int w, double) { above_[k] += w; });
}

void RisingEnvelope::at(double z_top, float none, float* out) {
    const double top = z_top - StandingPart::kSheet;
    crossings_.clear();
    for_each_point(passed_, top, [&](std::size_t k, int w, double z) {
        if (z < passed_ || z >= top) return;
        crossings_.push_back({static_cast<std::uint32_t>(k), w, z});
        above_[k] -= w;
        below_[k] = std::max(below_[k], static_cast<float>(z));
    });
    passed_ = std::max(passed_, top);
    for (std::size_t k = 0; k < above_.size(); ++k)
        out[k] = above_[k] != 0                                         ? static_cast<float>(z_top)
                 : below_[k] == -std::numeric_limits<float>::infinity() ? none
                                                                        : below_[k];
}

void RisingEnvelope::covered_air(double z_bottom, float* out) {
    std::fill(out, out + above_.size(), 0.0F);
    if (crossings_.empty()) return;
    // By column, of which most have one or two: column c has [ends[c], ends[c + 1]).
    std::vector<std::uint32_t> ends(above_.size() + 2, 0);
    for (const Crossing& c : crossings_) ++ends[c.column + 2];
    for (std::size_t c = 2; c < ends.size(); ++c) ends[c] += ends[c - 1];
    std::vector<Crossing> sorted(crossings_.size());
    for (const Crossing& c : crossings_) sorted[ends[c.column + 1]++] = c;
    for (std::size_t column = 0; column < above_.size(); ++column) {
        const auto first = sorted.begin() + ends[column], end = sorted.begin() + ends[column + 1];
        if (first == end) continue;
        std::sort(first, end, [](const Crossing& a, const Crossing& b) {
            return std::tie(a.z, a.winding) < std::tie(b.z, b.winding);
        });
        // From above: the winding number over the highest crossing is known.
        std::int32_t winding = above_[column];
        bool under_part = winding != 0;
        double air = 0, upper = 0;
        for (auto c = std::make_reverse_iterator(end); c != std::make_reverse_iterator(first); ++c) {
            if (winding == 0 && under_part) air += std::max(0.0, upper - std::max(c->z, z_bottom));
            winding += c->winding;
            under_part = under_part || winding != 0;
            upper = c->z;
        }
        if (winding == 0 && under_part) air += std::max(0.0, upper - z_bottom);
        out[column] = static_cast<float>(air);
    }
}

}  // namespace slabwright
