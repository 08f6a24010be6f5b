// Points and vectors in double precision, as the repair of meshes reckons with them.
#pragma once

#include <array>
#include <cmath>

#include "kernels/mesh/mesh.h"

namespace slabwright {

using Xyz = std::array<double, 3>;  ///< mm

[[nodiscard]] inline Xyz xyz(const Vec3f& v) { return {v.x, v.y, v.z}; }
[[nodiscard]] inline Xyz minus(const Xyz& a, const Xyz& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
[[nodiscard]] inline Xyz plus(const Xyz& a, const Xyz& b, double share = 1) {
    return {a[0] + share * b[0], a[1] + share * b[1], a[2] + share * b[2]};
}
[[nodiscard]] inline double inner(const Xyz& a, const Xyz& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
[[nodiscard]] inline Xyz outer(const Xyz& a, const Xyz& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
[[nodiscard]] inline double length(const Xyz& a) { return std::sqrt(inner(a, a)); }

/// Twice the vector area of the triangle a, b, c, mm².
[[nodiscard]] inline Xyz twice_area(const Xyz& a, const Xyz& b, const Xyz& c) {
    return outer(minus(b, a), minus(c, a));
}

}  // namespace slabwright
