#include "kernels/cutting/flat_way.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace slabwright {

namespace {

constexpr double kOutside = 3;  // units of the tree: what rounding places to them may take from a distance

struct Span {
    double low, high;
    void clip(double from, double to) {
        low = std::max(low, from);
        high = std::min(high, to);
    }
    [[nodiscard]] bool empty() const { return !(low <= high); }
};

class FlatWay {
public:
    FlatWay(double radius, const Vec3d& a, const Vec3d& b, double over)
        : a_(a), radius_(radius), length_(std::hypot(b[0] - a[0], b[1] - a[1])), over_(over) {
        ux_ = (b[0] - a[0]) / length_;
        uy_ = (b[1] - a[1]) / length_;
        slope_ = (b[2] - a[2]) / length_;
    }

    // Whether anything in a box may stand over the cutter's face.
    [[nodiscard]] bool may_meet(double x_low, double x_high, double y_low, double y_high,
                                double z_max) const {
        const Span along = range(ux_, uy_, x_low, x_high, y_low, y_high),
                   across = range(-uy_, ux_, x_low, x_high, y_low, y_high);
        return across.low < radius_ && across.high > -radius_ && along.high > -radius_ &&
               along.low < length_ + radius_ &&
               z_max - a_[2] - slope_ * std::max(0.0, along.low - radius_) > over_;
    }

    // Whether any of an edge stands over it.
    [[nodiscard]] bool meets(const Vec3d& p, const Vec3d& q) const {
        const double u = along(p), w = across(p), z = p[2] - a_[2];
        const double du = along(q) - u, dw = across(q) - w, dz = q[2] - p[2];
        Span k{0, 1};
        within_reach(k, u, du, w, dw);
        if (k.empty()) return false;
        // Where it stands over the lower end.
        if (dz > 0) k.clip((over_ - z) / dz, 1);
        else if (dz < 0) k.clip(0, (over_ - z) / dz);
        else if (z <= over_) return false;
        if (k.empty()) return false;
        if (slope_ == 0) return true;
        // A + B·k + s·√(r² − (w + k·dw)²) is greatest where B = s·dw·v / √(r² − v²) with v = w + k·dw.
        const double rise = dz - slope_ * du;
        double best = rise > 0 ? k.high : k.low;
        if (dw != 0) {
            const double m = rise / (slope_ * dw);
            best = std::clamp((radius_ * m / std::sqrt(1 + m * m) - w) / dw, k.low, k.high);
        }
        const double v = w + best * dw, root = std::sqrt(std::max(0.0, radius_ * radius_ - v * v));
        return z + best * dz - slope_ * (u + best * du - root) > over_;
    }

private:
    [[nodiscard]] double along(const Vec3d& p) const { return ux_ * (p[0] - a_[0]) + uy_ * (p[1] - a_[1]); }
    [[nodiscard]] double across(const Vec3d& p) const { return ux_ * (p[1] - a_[1]) - uy_ * (p[0] - a_[0]); }

    [[nodiscard]] Span range(double x, double y, double x_low, double x_high, double y_low,
                             double y_high) const {
        const double x0 = x * (x_low - a_[0]), x1 = x * (x_high - a_[0]), y0 = y * (y_low - a_[1]),
                     y1 = y * (y_high - a_[1]);
        return {std::min(x0, x1) + std::min(y0, y1), std::max(x0, x1) + std::max(y0, y1)};
    }

    // What of an edge the cutter's rim comes to: a stretch of it, for what the cutter covers on its way is
    // convex.
    void within_reach(Span& k, double u, double du, double w, double dw) const {
        if (dw > 0) k.clip((-radius_ - w) / dw, (radius_ - w) / dw);
        else if (dw < 0) k.clip((radius_ - w) / dw, (-radius_ - w) / dw);
        else if (std::abs(w) >= radius_) k = {1, 0};
        if (k.empty()) return;
        // In the rectangle between the ends, or in one of the discs around them.
        Span all{2, -1};
        Span between = k;
        if (du > 0) between.clip(-u / du, (length_ - u) / du);
        else if (du < 0) between.clip((length_ - u) / du, -u / du);
        else if (u < 0 || u > length_) between = {1, 0};
        if (!between.empty()) all = between;
        for (const double end : {0.0, length_}) {
            const double squared = du * du + dw * dw, half = (u - end) * du + w * dw,
                         outside = (u - end) * (u - end) + w * w - radius_ * radius_;
            if (squared == 0) {
                if (outside < 0) all = k;
                continue;
            }
            const double under = half * half - squared * outside;
            if (under <= 0) continue;
            const double root = std::sqrt(under);
            Span disc = k;
            disc.clip((-half - root) / squared, (-half + root) / squared);
            if (disc.empty()) continue;
            all.low = std::min(all.low, disc.low);
            all.high = std::max(all.high, disc.high);
        }
        k = all;
    }

    Vec3d a_;
    double radius_, length_, over_;
    double ux_ = 1, uy_ = 0, slope_ = 0;
};

bool tier_is_free(const LayerSolid& solid, const FacetTree::Tier& tier, const FlatWay& way) {
    constexpr std::size_t k_all = FacetTree::kTogether;
    struct Waiting {
        std::uint32_t level, node;
    };
    std::array<Waiting, 12 * k_all> waiting;
    std::size_t count = 1;
    waiting[0] = {static_cast<std::uint32_t>(tier.starts.size() - 2), 0};
    const FacetTree& tree = solid.tree;
    while (count > 0) {
        const Waiting now = waiting[--count];
        const FacetTree::Node& node = tier.nodes[tier.starts[now.level] + now.node];
        for (std::size_t k = 0; k < k_all; ++k) {
            if (std::isinf(node.z_max[k])) break;
            if (!way.may_meet(tree.x0 + (node.x_low[k] - kOutside) * tree.unit,
                              tree.x0 + (node.x_high[k] + kOutside) * tree.unit,
                              tree.y0 + (node.y_low[k] - kOutside) * tree.unit,
                              tree.y0 + (node.y_high[k] + kOutside) * tree.unit, double{node.z_max[k]}))
                continue;
            const auto child = static_cast<std::uint32_t>(k_all * now.node + k);
            if (now.level > 0) {
                waiting[count++] = {now.level - 1, child};
                continue;
            }
            const SolidFacet& facet = solid.facets[tier.facets[child]];
            for (std::size_t e = 0; e < 3; ++e)
                if ((facet.edges >> e & 1) != 0 && way.meets(facet.p[e], facet.p[(e + 1) % 3])) return false;
        }
    }
    return true;
}

}  // namespace

bool flat_way_is_free(const LayerSolid& solid, double radius, Vec3d a, Vec3d b, double over) {
    if (a[2] > b[2]) std::swap(a, b);
    if (a[0] == b[0] && a[1] == b[1]) return true;  // straight up or down between free ends
    const FlatWay way(radius, a, b, over);
    return std::all_of(solid.tree.tiers.begin(), solid.tree.tiers.end(),
                       [&](const FacetTree::Tier& tier) { return tier_is_free(solid, tier, way); });
}

}  // namespace slabwright
