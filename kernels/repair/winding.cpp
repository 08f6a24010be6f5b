#include "kernels/repair/winding.h"

#include <algorithm>
#include <numbers>
#include <numeric>

#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr std::uint32_t kLeafFacets = 8;
/// A cluster counts as one dipole from this many of its radii on.
constexpr double kFar = 2.3;

}  // namespace

double winding_of(const Xyz& a, const Xyz& b, const Xyz& c, const Xyz& p) {
    const Xyz u = minus(a, p), v = minus(b, p), w = minus(c, p);
    const double lu = length(u), lv = length(v), lw = length(w);
    const double above = inner(u, outer(v, w));
    const double below = lu * lv * lw + inner(u, v) * lw + inner(v, w) * lu + inner(w, u) * lv;
    if (above == 0 && below <= 0) return 0;  // in the facet itself
    return std::atan2(above, below) / (2 * std::numbers::pi);
}

WindingTree::WindingTree(Context& context, std::span<const Vec3f> vertices, std::span<const Index3> facets) {
    if (facets.empty()) return;
    const MemoryCharge charge(context, facets.size() * 96, "the winding number of the mesh");
    std::vector<Xyz> middles(facets.size());
    std::vector<std::uint32_t> order(facets.size());
    std::iota(order.begin(), order.end(), 0u);
    for (std::size_t f = 0; f < facets.size(); ++f)
        for (const std::uint32_t v : facets[f]) middles[f] = plus(middles[f], xyz(vertices[v]), 1.0 / 3);
    nodes_.push_back({});
    nodes_[0].end = static_cast<std::uint32_t>(facets.size());
    for (std::uint32_t n = 0; n < nodes_.size(); ++n) {
        if (n % 4096 == 0) context.throw_if_cancelled();
        split(n, order, middles);
    }
    facets_.resize(facets.size());
    for (std::size_t i = 0; i < order.size(); ++i)
        for (std::size_t k = 0; k < 3; ++k) facets_[i][k] = vertices[facets[order[i]][k]];
    // From the leaves up, for a node comes before its halves; the sums are those of the facets in their
    // order.
    parallel_for(context, nodes_.size(), 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t n = begin; n < end; ++n) {
            Node& node = nodes_[n];
            double area = 0;
            for (std::uint32_t i = node.begin; i < node.end; ++i) {
                const Xyz a = xyz(facets_[i][0]);
                const Xyz twice = twice_area(a, xyz(facets_[i][1]), xyz(facets_[i][2]));
                const double mine = length(twice) / 2;
                node.dipole = plus(node.dipole, twice, 0.5);
                node.middle = plus(node.middle, middles[order[i]], mine);
                area += mine;
            }
            if (area > 0)
                for (double& x : node.middle) x /= area;
            else node.middle = xyz(facets_[node.begin][0]);
            for (std::uint32_t i = node.begin; i < node.end; ++i)
                for (const Vec3f& v : facets_[i])
                    node.radius = std::max(node.radius, length(minus(xyz(v), node.middle)));
        }
    });
}

void WindingTree::split(std::uint32_t n, std::vector<std::uint32_t>& order, const std::vector<Xyz>& middles) {
    const Node node = nodes_[n];
    if (node.end - node.begin <= kLeafFacets) return;
    Xyz low = middles[order[node.begin]], high = low;
    for (std::uint32_t i = node.begin; i < node.end; ++i)
        for (std::size_t k = 0; k < 3; ++k) {
            low[k] = std::min(low[k], middles[order[i]][k]);
            high[k] = std::max(high[k], middles[order[i]][k]);
        }
    std::size_t axis = 0;
    for (std::size_t k = 1; k < 3; ++k)
        if (high[k] - low[k] > high[axis] - low[axis]) axis = k;
    const std::uint32_t middle = node.begin + (node.end - node.begin) / 2;
    const auto begin = order.begin();
    std::nth_element(
        begin + node.begin, begin + middle, begin + node.end, [&](std::uint32_t a, std::uint32_t b) {
            return middles[a][axis] != middles[b][axis] ? middles[a][axis] < middles[b][axis] : a < b;
        });
    nodes_[n].left = static_cast<std::uint32_t>(nodes_.size());
    nodes_.push_back({});
    nodes_.back().begin = node.begin, nodes_.back().end = middle;
    nodes_.push_back({});
    nodes_.back().begin = middle, nodes_.back().end = node.end;
}

double WindingTree::at(const Xyz& p) const {
    if (nodes_.empty()) return 0;
    double sum = 0;
    std::array<std::uint32_t, 128> open;  // a tree halved to leaves is no deeper than 32
    std::size_t count = 1;
    open[0] = 0;
    while (count > 0) {
        const Node& node = nodes_[open[--count]];
        const Xyz away = minus(node.middle, p);
        const double square = inner(away, away);
        if (square > kFar * kFar * node.radius * node.radius) {
            sum += inner(away, node.dipole) / (4 * std::numbers::pi * square * std::sqrt(square));
        } else if (node.left == 0) {
            for (std::uint32_t i = node.begin; i < node.end; ++i)
                sum += winding_of(xyz(facets_[i][0]), xyz(facets_[i][1]), xyz(facets_[i][2]), p);
        } else {
            open[count++] = node.left;
            open[count++] = node.left + 1;
        }
    }
    return sum;
}

}  // namespace slabwright
