#include "kernels/cutting/facet_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/cutting/layer_solid.h"
#include "kernels/geometry/vectors.h"
#include "kernels/geometry/wide.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr double kSteepest = 2;   // slope: what is steeper is bounded by its highest point alone
constexpr float kOutside = 3.0F;  // units: what rounding places to them may take from a distance
constexpr std::size_t kLeaf = FacetTree::kTogether;
constexpr std::uint64_t kSizes = 3;  // of facets, each in a tier
constexpr std::size_t kGrain = std::size_t{1} << 14;
constexpr float kNowhere = -std::numeric_limits<float>::infinity();

float rounded_up(double v) {
    const auto f = static_cast<float>(v);
    return static_cast<double>(f) < v ? std::nextafter(f, std::numeric_limits<float>::infinity()) : f;
}

// How far along a Hilbert curve over 2^15 × 2^15 cells a place lies.
std::uint32_t hilbert(std::uint32_t x, std::uint32_t y) {
    std::uint32_t along = 0;
    for (std::uint32_t s = std::uint32_t{1} << 14; s > 0; s /= 2) {
        const std::uint32_t rx = (x & s) != 0, ry = (y & s) != 0;
        along += s * s * ((3 * rx) ^ ry);
        if (ry != 0) continue;
        if (rx != 0) x = ~x, y = ~y;
        std::swap(x, y);
    }
    return along;
}

FacetTree::Node empty_node() {
    FacetTree::Node node;
    node.x_low.fill(0), node.x_high.fill(0), node.y_low.fill(0), node.y_high.fill(0);
    node.z_max.fill(kNowhere), node.z_mid.fill(kNowhere), node.gx.fill(0), node.gy.fill(0);
    return node;
}

std::int32_t middle(std::int32_t low, std::int32_t high) { return low + (high - low) / 2; }

std::array<double, 2> extent(const SolidFacet& f, std::size_t axis) {
    const auto [low, high] = std::minmax({f.p[0][axis], f.p[1][axis], f.p[2][axis]});
    return {low, high};
}

// The tree of the facets that keys name in their lower halves, in that order.
FacetTree::Tier tier(Context& context, std::span<const SolidFacet> facets, const FacetTree& tree,
                     std::span<const std::uint64_t> keys) {
    FacetTree::Tier tier;
    const std::size_t n = keys.size();
    tier.facets.resize(n);
    parallel_for(context, n, kGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) tier.facets[i] = static_cast<std::uint32_t>(keys[i]);
    });
    tier.starts = {0};
    for (std::size_t level = (n + kLeaf - 1) / kLeaf;; level = (level + kLeaf - 1) / kLeaf) {
        tier.starts.push_back(tier.starts.back() + static_cast<std::uint32_t>(level));
        if (level == 1) break;
    }
    tier.nodes.resize(tier.starts.back());

    auto low_units = [&](double v, double from) {
        return static_cast<std::int32_t>(std::floor((v - from) / tree.unit));
    };
    auto high_units = [&](double v, double from) {
        return static_cast<std::int32_t>(std::ceil((v - from) / tree.unit));
    };
    parallel_for(context, tier.starts[1], kGrain / kLeaf, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            FacetTree::Node node = empty_node();
            for (std::size_t k = 0; k < kLeaf && kLeaf * i + k < n; ++k) {
                const SolidFacet& f = facets[tier.facets[kLeaf * i + k]];
                const auto [xl, xh] = extent(f, 0);
                const auto [yl, yh] = extent(f, 1);
                node.x_low[k] = low_units(xl, tree.x0), node.x_high[k] = high_units(xh, tree.x0);
                node.y_low[k] = low_units(yl, tree.y0), node.y_high[k] = high_units(yh, tree.y0);
                node.z_max[k] = node.z_mid[k] = rounded_up(f.z_max);
                const Vec3d& m = f.normal;
                if (m[2] <= 0 || m[0] * m[0] + m[1] * m[1] > kSteepest * kSteepest * m[2] * m[2]) continue;
                node.gx[k] = static_cast<float>(-m[0] / m[2]), node.gy[k] = static_cast<float>(-m[1] / m[2]);
                const double cx = tree.x0 + tree.unit * middle(node.x_low[k], node.x_high[k]),
                             cy = tree.y0 + tree.unit * middle(node.y_low[k], node.y_high[k]);
                double z = -kUnbounded;
                for (const Vec3d& p : f.p)
                    z = std::max(z, p[2] - node.gx[k] * (p[0] - cx) - node.gy[k] * (p[1] - cy));
                node.z_mid[k] = rounded_up(z);
            }
            tier.nodes[i] = node;
        }
    });
    for (std::size_t level = 1; level + 1 < tier.starts.size(); ++level) {
        const std::size_t below = tier.starts[level - 1], first = tier.starts[level],
                          children = first - below;
        parallel_for(
            context, tier.starts[level + 1] - first, kGrain / kLeaf, [&](std::size_t begin, std::size_t end) {
                for (std::size_t i = begin; i < end; ++i) {
                    FacetTree::Node node = empty_node();
                    for (std::size_t k = 0; k < kLeaf && kLeaf * i + k < children; ++k) {
                        const FacetTree::Node& child = tier.nodes[below + kLeaf * i + k];
                        std::int32_t xl = INT32_MAX, xh = INT32_MIN, yl = INT32_MAX, yh = INT32_MIN;
                        double z_max = kNowhere, weight = 0, gx = 0, gy = 0;
                        for (std::size_t c = 0; c < kLeaf && child.z_max[c] > kNowhere; ++c) {
                            xl = std::min(xl, child.x_low[c]), xh = std::max(xh, child.x_high[c]);
                            yl = std::min(yl, child.y_low[c]), yh = std::max(yh, child.y_high[c]);
                            z_max = std::max<double>(z_max, child.z_max[c]);
                            // Each as much as its box is large, for what is wide is seldom missed by a
                            // cutter.
                            const double area = (1.0 + child.x_high[c] - child.x_low[c]) *
                                                (1.0 + child.y_high[c] - child.y_low[c]);
                            weight += area, gx += area * child.gx[c], gy += area * child.gy[c];
                        }
                        node.x_low[k] = xl, node.x_high[k] = xh, node.y_low[k] = yl, node.y_high[k] = yh;
                        node.z_max[k] = static_cast<float>(z_max);
                        node.gx[k] = static_cast<float>(gx / weight),
                        node.gy[k] = static_cast<float>(gy / weight);
                        // Over each child's box both its plane and its z_max bound it; over this plane they
                        // are highest at a corner.
                        double z = -kUnbounded;
                        for (std::size_t c = 0; c < kLeaf && child.z_max[c] > kNowhere; ++c) {
                            const std::int32_t mx = middle(child.x_low[c], child.x_high[c]),
                                               my = middle(child.y_low[c], child.y_high[c]);
                            const double hx = tree.unit * (1.0 + child.x_high[c] - mx),
                                         hy = tree.unit * (1.0 + child.y_high[c] - my);
                            const double at = node.gx[k] * tree.unit * (mx - middle(xl, xh)) +
                                              node.gy[k] * tree.unit * (my - middle(yl, yh));
                            const double ax = node.gx[k], ay = node.gy[k];
                            const double level_most =
                                child.z_max[c] - at + std::abs(ax) * hx + std::abs(ay) * hy;
                            const double plane_most = child.z_mid[c] - at + std::abs(child.gx[c] - ax) * hx +
                                                      std::abs(child.gy[c] - ay) * hy;
                            z = std::max(z, std::min(level_most, plane_most));
                        }
                        node.z_mid[k] = rounded_up(z);
                    }
                    tier.nodes[first + i] = node;
                }
            });
    }
    return tier;
}

}  // namespace

FacetTree facet_tree(Context& context, std::span<const SolidFacet> facets, const std::array<double, 2>& min,
                     const std::array<double, 2>& max) {
    FacetTree tree;
    const std::size_t n = facets.size();
    if (n == 0) return tree;
    const double width = max[0] - min[0], depth = max[1] - min[1];
    tree.x0 = min[0], tree.y0 = min[1];
    tree.unit = (std::max(width, depth) + 2 * FacetTree::kWidestCutter) / (1 << 29);

    // The facets along the curve; those that are larger than a mesh as fine as the mean has them apart, so
    // that they do not widen the others' nodes.
    const double mean = std::sqrt(std::max(width * depth, 1e-12) / static_cast<double>(n));
    const double to_curve = ((1 << 15) - 1) / std::max({width, depth, 1e-9});
    BulkVector<std::uint64_t> keys(n);
    parallel_for(context, n, kGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const auto [xl, xh] = extent(facets[i], 0);
            const auto [yl, yh] = extent(facets[i], 1);
            const double widest = std::max(xh - xl, yh - yl);
            const std::uint64_t size = widest <= 8 * mean ? 0 : widest <= 64 * mean ? 1 : 2;
            const std::uint32_t along =
                hilbert(static_cast<std::uint32_t>((0.5 * (xl + xh) - min[0]) * to_curve),
                        static_cast<std::uint32_t>((0.5 * (yl + yh) - min[1]) * to_curve));
            keys[i] = size << 62 | static_cast<std::uint64_t>(along) << 32 | i;
        }
    });
    parallel_sort(context, keys.begin(), keys.end(), std::less<>());
    for (std::uint64_t size = 0; size < kSizes; ++size) {
        const auto begin = std::lower_bound(keys.begin(), keys.end(), size << 62),
                   end = std::lower_bound(begin, keys.end(), (size + 1) << 62);
        if (begin != end) tree.tiers.push_back(tier(context, facets, tree, std::span(begin, end)));
    }
    return tree;
}

namespace {

/// Where the probe is as one of the eight boxes sees it, in the tree's units: past each of its sides, from
/// its middle, and outside of it.
struct FromBox {
    float left, right, below, above, mx, my, dx, dy;
};
[[gnu::always_inline]] inline FromBox from_box(const FacetTree::Node& node, const DropProbe& probe,
                                               std::size_t i) {
    const std::int32_t xl = node.x_low[i], xh = node.x_high[i], yl = node.y_low[i], yh = node.y_high[i];
    FromBox from{static_cast<float>(xl - probe.x),
                 static_cast<float>(probe.x - xh),
                 static_cast<float>(yl - probe.y),
                 static_cast<float>(probe.y - yh),
                 static_cast<float>(probe.x - middle(xl, xh)),
                 static_cast<float>(probe.y - middle(yl, yh)),
                 0,
                 0};
    from.dx = from.left > from.right ? from.left : from.right;
    from.dy = from.below > from.above ? from.below : from.above;
    from.dx = (from.dx > kOutside ? from.dx : kOutside) - kOutside;
    from.dy = (from.dy > kOutside ? from.dy : kOutside) - kOutside;
    return from;
}

}  // namespace

// Every step is the same for all eight, so that a compiler does them at once. Distances are shortened and
// heights raised by more than float takes from them.
SLABWRIGHT_WIDE std::uint32_t ball_bounds(const FacetTree::Node& node, const DropProbe& probe, float least,
                                          float* __restrict bounds) {
    std::uint32_t over = 0;
    const float r = probe.radius, r2 = r * r, unit = probe.unit, bend = probe.inverse * unit * unit;
    for (int k = 0; k < FacetTree::kTogether; ++k) {
        const auto i = static_cast<std::size_t>(k);
        const auto [left, right, below, above, mx, my, dx, dy] = from_box(node, probe, i);
        const float room2 = r2 - (dx * dx + dy * dy);
        const float over_box = node.z_max[i] + (std::sqrt(room2 > 0 ? room2 : 0.0F) - r) * unit;
        const float gx = node.gx[i], gy = node.gy[i], w = std::sqrt(1 + gx * gx + gy * gy), px = r * gx / w,
                    py = r * gy / w;
        float ex = left - px > right + px ? left - px : right + px,
              ey = below - py > above + py ? below - py : above + py;
        ex = (ex > kOutside ? ex : kOutside) - kOutside;
        ey = (ey > kOutside ? ey : kOutside) - kOutside;
        const float far = (mx < 0 ? -mx : mx) + (my < 0 ? -my : my);
        const float over_plane = node.z_mid[i] + (gx * mx + gy * my + r * (w - 1) + 1e-6F * far) * unit -
                                 (ex * ex + ey * ey) * bend;
        const float bound = (over_box < over_plane ? over_box : over_plane) + probe.spare;
        bounds[i] = room2 > 0 ? bound : kNowhere;
        over |= bounds[i] > least ? std::uint32_t{1} << k : 0;
    }
    return over;
}

SLABWRIGHT_WIDE std::uint32_t flat_bounds(const FacetTree::Node& node, const DropProbe& probe, float least,
                                          float* __restrict bounds) {
    std::uint32_t over = 0;
    const float r = probe.radius, r2 = r * r, unit = probe.unit;
    for (int k = 0; k < FacetTree::kTogether; ++k) {
        const auto i = static_cast<std::size_t>(k);
        const FromBox box = from_box(node, probe, i);
        const float mx = box.mx, my = box.my, dx = box.dx, dy = box.dy;
        const float gx = node.gx[i], gy = node.gy[i], far = (mx < 0 ? -mx : mx) + (my < 0 ? -my : my);
        const float rim = node.z_mid[i] +
                          (gx * mx + gy * my + r * std::sqrt(gx * gx + gy * gy) + 1e-6F * far) * unit +
                          probe.spare;
        const float bound = node.z_max[i] < rim ? node.z_max[i] : rim;
        bounds[i] = dx * dx + dy * dy < r2 * 1.000001F ? bound : kNowhere;
        over |= bounds[i] > least ? std::uint32_t{1} << k : 0;
    }
    return over;
}

}  // namespace slabwright
