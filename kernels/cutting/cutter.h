// The cutting profile of a tool, as the geometry kernels see it.
#pragma once

#include <cstdint>

#include "kernels/geometry/cutter_shape.h"

namespace slabwright {

/// A ball of radius r under a shank of the same radius, or a flat-ended cylinder of radius r; positions are
/// its tip's.
struct Cutter {
    enum class Profile : std::uint8_t { flat, ball } profile = Profile::flat;
    double radius = 0;  ///< mm
};

/// @throws Error(usage, "tool.shape") for what is neither flat nor a ball
[[nodiscard]] Cutter cutter_of(const CutterShape& shape);

}  // namespace slabwright
