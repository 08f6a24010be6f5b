// How deep a facet goes into an under side of any form, a cutter's or a holder's, over a straight piece of a
// motion. Internal to this folder.
#pragma once

#include "kernels/access/piece_depth.h"
#include "kernels/cutting/tool_shape.h"

namespace slabwright {

/// Depth of a point within the surface of what lies above an under side, mm: its distance from the nearer of
/// flank, floor, rounding and the upright side; no more than 0 outside.
/// @param from_axis mm @param height mm over the tip
[[nodiscard]] double depth_within(const Envelope& under, double from_axis, double height);

/// Largest depth_within() of a triangle's points over a piece of the tip's way from a to b, if above `best`,
/// and where on the piece. Seen from the cutter the triangle sweeps a prism, so that the one place of the
/// cutter is asked for the prism's faces, and depths are halved (Envelope::eroded) to kNumericalError.
[[nodiscard]] Deepest revolved_piece_depth(const Point3& a, const Point3& b, const Triangle& triangle,
                                           const Envelope& under, double best);

}  // namespace slabwright
