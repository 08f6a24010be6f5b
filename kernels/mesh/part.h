// What of a mesh lies between two heights.
#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <span>
#include <vector>

#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// The facets that reach into [low, high] (mm), those that only touch it and those beside any of them
/// included, in their order, with the vertices that they name in theirs: between the heights, and in what is
/// asked of facets there and across their edges, it is as good as the whole. A facet beside one that is left
/// out is open there.
/// @param mesh with neighbours
/// @throws Error(cancelled)
[[nodiscard]] Mesh part_between(Context& context, MeshView mesh, double low, double high);

/// A rectangle seen from above, mm; empty until it has a point.
struct PlanBox {
    std::array<double, 2> min{std::numeric_limits<double>::infinity(),
                              std::numeric_limits<double>::infinity()},
        max{-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
    [[nodiscard]] bool is_empty() const { return !(max[0] >= min[0]); }
    void grow(double x, double y) {
        min = {std::min(min[0], x), std::min(min[1], y)};
        max = {std::max(max[0], x), std::max(max[1], y)};
    }
    friend bool operator==(const PlanBox&, const PlanBox&) = default;
};

/// What the surface covers between each two heights, both included, seen from above: of a facet that reaches
/// beyond them what lies between. All sections of a solid at heights between lie in it.
/// @param ranges {low, high} of each, mm; the lows ascend, and so do the highs
/// @throws Error(cancelled)
[[nodiscard]] std::vector<PlanBox> boxes_between(Context& context, MeshView mesh,
                                                 std::span<const std::array<double, 2>> ranges);

}  // namespace slabwright
