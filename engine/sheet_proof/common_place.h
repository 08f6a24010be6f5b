// Whether two regions have a place in common, told without clipping where that is plain.
#pragma once

#include "kernels/polygons/loops.h"

namespace slabwright {

/// Whether the intersection of two regions has an area. Regions whose boxes lie apart have none; where a
/// level line through both runs inside of both at once, they have one; else they are clipped. O(n) but for
/// the last.
/// @param a, b outer loops counter-clockwise, holes clockwise
[[nodiscard]] bool have_common_place(const Loops& a, const Loops& b);

}  // namespace slabwright
