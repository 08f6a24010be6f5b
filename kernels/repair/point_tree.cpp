#include "kernels/repair/point_tree.h"

#include <algorithm>
#include <utility>

namespace slabwright {

namespace {

constexpr std::uint32_t kLeafPoints = 8;

}  // namespace

PointTree::PointTree(std::span<const Vec3f> points, std::vector<std::uint32_t> chosen)
    : points_(points), chosen_(std::move(chosen)) {
    if (chosen_.empty()) return;
    nodes_.push_back({{}, {}, 0, static_cast<std::uint32_t>(chosen_.size()), 0});
    for (std::uint32_t n = 0; n < nodes_.size(); ++n) split(n);
}

void PointTree::split(std::uint32_t n) {
    Node node = nodes_[n];
    node.low = node.high = xyz(points_[chosen_[node.begin]]);
    for (std::uint32_t i = node.begin; i < node.end; ++i) {
        const Xyz p = xyz(points_[chosen_[i]]);
        for (std::size_t k = 0; k < 3; ++k) {
            node.low[k] = std::min(node.low[k], p[k]);
            node.high[k] = std::max(node.high[k], p[k]);
        }
    }
    if (node.end - node.begin > kLeafPoints) {
        std::size_t axis = 0;
        for (std::size_t k = 1; k < 3; ++k)
            if (node.high[k] - node.low[k] > node.high[axis] - node.low[axis]) axis = k;
        const std::uint32_t middle = node.begin + (node.end - node.begin) / 2;
        const auto begin = chosen_.begin();
        std::nth_element(begin + node.begin, begin + middle, begin + node.end,
                         [&](std::uint32_t a, std::uint32_t b) {
                             const double pa = xyz(points_[a])[axis], pb = xyz(points_[b])[axis];
                             return pa != pb ? pa < pb : a < b;
                         });
        node.left = static_cast<std::uint32_t>(nodes_.size());
        nodes_.push_back({{}, {}, node.begin, middle, 0});
        nodes_.push_back({{}, {}, middle, node.end, 0});
    }
    nodes_[n] = node;
}

/// Clips the segment to the box that is larger by `reach` all around (slabs).
bool PointTree::may_touch(const Node& node, const Xyz& a, const Xyz& b, double reach) {
    double from = 0, to = 1;
    for (std::size_t k = 0; k < 3; ++k) {
        const double low = node.low[k] - reach, high = node.high[k] + reach, step = b[k] - a[k];
        if (step == 0) {
            if (a[k] < low || a[k] > high) return false;
            continue;
        }
        double t0 = (low - a[k]) / step, t1 = (high - a[k]) / step;
        if (t0 > t1) std::swap(t0, t1);
        from = std::max(from, t0);
        to = std::min(to, t1);
        if (from > to) return false;
    }
    return true;
}

}  // namespace slabwright
