// Which of many points lie near a segment.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "kernels/repair/xyz.h"

namespace slabwright {

/// A tree of boxes over points, halved along the longest side until eight are left. Build: n log n.
class PointTree {
public:
    /// @param points borrowed: the tree must not outlive them
    /// @param chosen indices of those that are to be found
    PointTree(std::span<const Vec3f> points, std::vector<std::uint32_t> chosen);

    /// Calls visit(index) for every chosen point that may lie within `reach` (mm) of the segment a b, and for
    /// some more, in no order that depends on anything but the points.
    template <class Visit>
    void near_segment(const Xyz& a, const Xyz& b, double reach, Visit&& visit) const {
        if (nodes_.empty()) return;
        std::vector<std::uint32_t> open{0};
        while (!open.empty()) {
            const Node& node = nodes_[open.back()];
            open.pop_back();
            if (!may_touch(node, a, b, reach)) continue;
            if (node.left == 0) {
                for (std::uint32_t i = node.begin; i < node.end; ++i) visit(chosen_[i]);
            } else {
                open.push_back(node.left);
                open.push_back(node.left + 1);
            }
        }
    }

private:
    struct Node {
        Xyz low, high;
        std::uint32_t begin, end, left;  // left == 0: a leaf
    };
    static bool may_touch(const Node& node, const Xyz& a, const Xyz& b, double reach);
    void split(std::uint32_t node);

    std::span<const Vec3f> points_;
    std::vector<std::uint32_t> chosen_;
    std::vector<Node> nodes_;
};

}  // namespace slabwright
