// The whole tool as it turns: cutter, shank and holder, for questions of what it reaches.
#pragma once

#include <vector>

#include "kernels/geometry/cutter_shape.h"

namespace slabwright {

/// A tool about a vertical axis; its position is that of its tip.
struct ToolShape {
    CutterShape cutter;
    double flute_length = 0;   ///< mm, from the tip to where the shank begins; 0: the flutes have no end
    double shank_radius = 0;   ///< mm
    double stickout = 0;       ///< mm, from the tip to the holder's nose; 0: there is no holder
    double holder_radius = 0;  ///< mm
    /// Where the holder widens above its nose, from the lowest up: a disc from that height over the tip on.
    struct Disc {
        double height = 0, radius = 0;  ///< mm
    };
    std::vector<Disc> holder{};
};

/// @throws Error(usage, "tool.shape") for measures that make no cutter, as under_side() has it, a cone, a
/// length that is negative or not finite, or flutes that end below the top of the tip's rounding
void check_tool_shape(const ToolShape& tool);

/// The under side of a part of a tool: a level disc of radius `core`, a rounding of radius `rounding`, then
/// the flank, at a slope or upright, out to `radius`. What lies above it belongs to the tool. Convex:
/// height() is, as a function of the distance.
struct Envelope {
    double low = 0;  ///< mm, the disc's height over the tip
    double core = 0, rounding = 0;
    double sin_taper = 0, cos_taper = 1;
    double radius = 0;

    /// Height of the under side over the tip at a distance from the axis, mm; infinite beyond `radius`.
    [[nodiscard]] double height(double distance) const;
    /// Its derivative by the distance.
    [[nodiscard]] double slope(double distance) const;
    /// The inverse of height(): the distance from the axis within which the under side is no higher than
    /// `height` over the tip, mm; negative where it is higher everywhere.
    [[nodiscard]] double width(double height) const;
    /// What is deeper in the tool than `depth`, mm: that part's under side. Its radius is negative when
    /// nothing is.
    [[nodiscard]] Envelope eroded(double depth) const;
};

/// The under side of a cutter of any form, without shank and holder.
/// @throws Error(usage, "tool.shape") for a radius that is not positive, a corner larger than the cutter or a
/// taper outside [0°, 90°)
[[nodiscard]] Envelope under_side(const CutterShape& cutter);

/// The cutter's under side first, then those of shank and holder where they stand out over what is below
/// them.
[[nodiscard]] std::vector<Envelope> envelopes(const ToolShape& tool);

}  // namespace slabwright
