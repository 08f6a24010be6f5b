// Points and vectors in double precision, as the repair of meshes reckons with them.
#pragma once

#include <array>
#include <cmath>

#include "kernels/mesh/mesh.h"

namespace slabwright {

using Xyz = Vec3d;  ///< mm

[[nodiscard]] inline Xyz xyz(const Vec3f& v) { return to_double(v); }
[[nodiscard]] inline double inner(const Xyz& a, const Xyz& b) { return dot(a, b); }
[[nodiscard]] inline Xyz outer(const Xyz& a, const Xyz& b) { return cross(a, b); }

/// Twice the vector area of the triangle a, b, c, mm².
[[nodiscard]] inline Xyz twice_area(const Xyz& a, const Xyz& b, const Xyz& c) {
    return outer(minus(b, a), minus(c, a));
}

}  // namespace slabwright
