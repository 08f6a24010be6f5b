// The cutting profile of a tool, as the geometry kernels see it.
#pragma once

#include <cstdint>

#include "kernels/cutting/tool_shape.h"
#include "kernels/geometry/cutter_shape.h"

namespace slabwright {

/// A ball of radius r under a shank of the same radius, a flat-ended cylinder of radius r, or another surface
/// of revolution whose height over the tip is a convex function of the distance from the axis: a bull-nose,
/// a tapered ball, a cone. Positions are its tip's. Balls and flats are met many facets at a time; the others
/// one by one, which takes longer.
struct Cutter {
    enum class Profile : std::uint8_t { flat, ball, other } profile = Profile::flat;
    double radius = 0;  ///< mm
    /// Of what is neither flat nor a ball, as CutterShape has them: mm, radians.
    double corner = 0, taper_rad = 0;

    friend bool operator==(const Cutter&, const Cutter&) = default;
};

/// @throws Error(usage, "tool.shape") for measures that make no cutter
[[nodiscard]] Cutter cutter_of(const CutterShape& shape);

/// The under side of any cutter.
[[nodiscard]] Envelope under_side(const Cutter& cutter);

}  // namespace slabwright
