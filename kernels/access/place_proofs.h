// What is deep in a tool at a place, and at all places near it at once.
#pragma once

#include "kernels/access/poke.h"
#include "kernels/geometry/triangle.h"

namespace slabwright {

/// A patch of places: its middle, and how the tool moves from there to the others: by up to `dl` along one
/// direction and `ds` along another, and by `second` in any direction besides.
struct ToolPlaces {
    double x = 0, y = 0, tip = 0;
    Point3 along{}, around{};
    double dl = 0, ds = 0, second = 0;
    double spread = 0;  ///< no place is farther from the middle
    double lift = 0;    ///< nor higher or lower by more
    double tolerance = 0;
};

/// How deep a point of the part is in a part of the tool, and how that changes as the tool moves: by the
/// motion's component along `gradient` at least, less its square over 2·`bend`. No bend: only that depth
/// changes by no more than the tool moves.
struct PlaceDepth {
    double mm;
    Point3 gradient;
    double bend;
};

/// The tool part is a core, which is a cone on a disc, grown by the rounding. A ball of that radius about the
/// core's point nearest to q belongs to the tool wherever the tool goes, so the depth in that ball is a lower
/// bound.
[[nodiscard]] PlaceDepth depth_of(const Point3& q, const ToolPlaces& at, const Envelope& e);

/// What one obstacle proves about a patch: depth is at least floor + by_l·(−1 … 1) + by_s·(−1 … 1).
struct DepthProof {
    double floor = 0, by_l = 0, by_s = 0;
};
[[nodiscard]] DepthProof proof_of(const PlaceDepth& depth, const ToolPlaces& at);

/// Whether one obstacle is deeper than the tolerance all over the patch.
[[nodiscard]] bool rules_out(const PlaceDepth& depth, const ToolPlaces& at);

/// Whether two obstacles on different sides of the tool leave no room between them: the deeper of two depths
/// is at least any weighted mean of them, and the weights may let their changes cancel.
[[nodiscard]] bool rule_out(const DepthProof& a, const DepthProof& b, double tolerance);

}  // namespace slabwright
