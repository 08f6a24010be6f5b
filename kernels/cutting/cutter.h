// The cutting profile of a tool, as the geometry kernels see it.
#pragma once

#include <cstdint>

namespace slabwright {

/// A ball of radius r under a shank of the same radius, or a flat-ended cylinder of radius r; positions are
/// its tip's.
struct Cutter {
    enum class Profile : std::uint8_t { flat, ball } profile = Profile::flat;
    double radius = 0;  ///< mm
};

}  // namespace slabwright
