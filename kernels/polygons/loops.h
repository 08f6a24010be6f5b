// Closed polygons in the plane, in integers of 0.1 µm.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/geometry/units.h"

namespace slabwright {

/// A set of closed loops: outer loops counter-clockwise, holes clockwise. Loop i has the points
/// points[starts[i]] … points[starts[i + 1] − 1], the last joined to the first (which is not repeated).
struct Loops {
    std::vector<Point2> points;
    std::vector<std::uint32_t> starts{0};  ///< one more than there are loops
    std::vector<std::int32_t> parents;  ///< the loop directly around loop i, or −1; empty when not nested yet

    [[nodiscard]] std::size_t size() const noexcept { return starts.size() - 1; }
    [[nodiscard]] bool empty() const noexcept { return size() == 0; }
    [[nodiscard]] std::span<const Point2> loop(std::size_t i) const {
        return std::span(points).subspan(starts[i], starts[i + 1] - starts[i]);
    }
    /// Closes the points appended since the last call into a loop.
    void close_loop() { starts.push_back(static_cast<std::uint32_t>(points.size())); }
};

/// Signed area of one loop in mm², positive counter-clockwise.
[[nodiscard]] double signed_area(std::span<const Point2> loop);
/// Sum of the signed areas in mm²: the area of the region when outer loops and holes are oriented as above.
[[nodiscard]] double area(const Loops& loops);
/// Winding number of the region's loops around p; points on the boundary count as either side.
[[nodiscard]] int winding(const Loops& loops, Point2 p);

/// Where lines run inside the region (winding number over 0): [low, high] in 0.1 µm, ascending.
struct Span {
    double low = 0, high = 0;
};
/// Of each of the lines at the heights y, ascending; in one pass over the region.
[[nodiscard]] std::vector<std::vector<Span>> line_spans(const Loops& region, std::span<const double> y);

/// Fills `parents` by containment: the smallest larger loop around each. Loops may touch in points and along
/// edges; where they cross (self-intersecting meshes) the answer is by one point inside each loop, and never
/// cyclic. O(n log n) in points, plus for every loop a comparison for each loop whose box holds one point
/// inside it, and the edge chains that one horizontal line meets of those that may be its parent.
void nest(Loops& loops);

/// Boolean operations and offsets on regions (non-zero winding), by polyclipping. Results are nested, outer
/// loops counter-clockwise and holes clockwise. @throws Error when a result would pass 214 m, or polyclipping
/// fails
[[nodiscard]] Loops unite(const Loops& a, const Loops& b);
[[nodiscard]] Loops intersect(const Loops& a, const Loops& b);
[[nodiscard]] Loops subtract(const Loops& a, const Loops& b);
/// The outline of what the loops cover: overlaps and crossings are gone.
[[nodiscard]] Loops simplify(const Loops& loops);
/// Grows (delta > 0) or shrinks a region by `delta_mm`, round joins; straight edges are exact to 0.1 µm, arcs
/// deviate by at most `tolerance_mm` (0.0001 or more), always to the side of the *larger* region, so that
/// what is kept clear is never understated.
[[nodiscard]] Loops offset(const Loops& region, double delta_mm, double tolerance_mm);
/// The same of a region whose loops neither cross nor overlap and are turned as these functions turn them,
/// which is not looked for. A region that grows may also be thinned: where its loops then cross by far less
/// than it grows, the result is the same.
[[nodiscard]] Loops offset_outline(const Loops& outline, double delta_mm, double tolerance_mm);

}  // namespace slabwright
