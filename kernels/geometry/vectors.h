// Places and directions, and what is reckoned with them. Each function rounds in the order in which it is
// written; nothing is fused, so results are the same on every machine.
#pragma once

#include <array>
#include <cmath>

namespace slabwright {

/// Beyond every coordinate: where a least or a largest one begins. Finite, so that differences are numbers.
inline constexpr double kUnbounded = 1e300;

/// A place in millimetres, as meshes keep it.
struct Vec3f {
    float x = 0, y = 0, z = 0;
    friend bool operator==(const Vec3f&, const Vec3f&) = default;
};

/// A direction, or a place in double precision.
using Vec3d = std::array<double, 3>;
using Point3 = Vec3d;  ///< a place, mm

[[nodiscard]] inline Vec3d to_double(const Vec3f& v) { return {v.x, v.y, v.z}; }
[[nodiscard]] inline Vec3d minus(const Vec3d& a, const Vec3d& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
/// a + share · b
[[nodiscard]] inline Vec3d plus(const Vec3d& a, const Vec3d& b, double share = 1) {
    return {a[0] + share * b[0], a[1] + share * b[1], a[2] + share * b[2]};
}
[[nodiscard]] inline Vec3d scaled(double s, const Vec3d& a) { return {s * a[0], s * a[1], s * a[2]}; }
[[nodiscard]] inline double dot(const Vec3d& a, const Vec3d& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
[[nodiscard]] inline Vec3d cross(const Vec3d& a, const Vec3d& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
[[nodiscard]] inline double length(const Vec3d& a) { return std::sqrt(dot(a, a)); }
[[nodiscard]] inline double squared_distance(const Vec3d& a, const Vec3d& b) {
    const Vec3d d = minus(a, b);
    return dot(d, d);
}
/// The place at share t of the way from a to b; a at t = 0.
[[nodiscard]] inline Vec3d between(const Vec3d& a, const Vec3d& b, double t) {
    return {a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t, a[2] + (b[2] - a[2]) * t};
}

/// The same in the plane.
struct Vec2d {
    double x = 0, y = 0;
    friend Vec2d operator-(const Vec2d& a, const Vec2d& b) { return {a.x - b.x, a.y - b.y}; }
};
[[nodiscard]] inline double dot(const Vec2d& a, const Vec2d& b) { return a.x * b.x + a.y * b.y; }
[[nodiscard]] inline double cross(const Vec2d& a, const Vec2d& b) { return a.x * b.y - a.y * b.x; }
[[nodiscard]] inline double length(const Vec2d& a) { return std::sqrt(dot(a, a)); }

}  // namespace slabwright
