// Four places at once, as simplify() asks all around a vertex. Internal to it: the functions that return such
// vectors are called in simplify_block.cpp alone.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "kernels/geometry/wide.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"

namespace slabwright::simplifying {

inline constexpr std::size_t kLanes = 4;

template <class Real>
struct Space {
    Real x{}, y{}, z{};
    friend Space operator-(const Space& a, const Space& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
};
using Place = Space<double>;
using Places = Space<Doubles4>;

template <class A, class B>
auto dot(const Space<A>& a, const Space<B>& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class A, class B>
auto turn(const Space<A>& a, const Space<B>& b) {  // of the plan views
    return a.x * b.y - a.y * b.x;
}
template <class Real>
Space<Real> cross(const Space<Real>& a, const Space<Real>& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, turn(a, b)};
}

inline Doubles4 larger(const Doubles4& a, const Doubles4& b) { return a < b ? b : a; }
inline Doubles4 smaller(const Doubles4& a, const Doubles4& b) { return b < a ? b : a; }
inline double smallest(const Doubles4& a) { return std::min(std::min(a[0], a[1]), std::min(a[2], a[3])); }
inline Doubles4 root(const Doubles4& a) {
    return Doubles4{std::sqrt(a[0]), std::sqrt(a[1]), std::sqrt(a[2]), std::sqrt(a[3])};
}
inline std::uint64_t joined_bits(const Longs4& s) {
    return static_cast<std::uint64_t>(s[0] | s[1] | s[2] | s[3]);
}
inline constexpr Longs4 kOwn{1, 2, 4, 8};  // bits
inline unsigned bits(const Longs4& s) { return static_cast<unsigned>(joined_bits(s & kOwn)); }

/// Heights of facets with one corner at the origin over their longest edges.
inline Doubles4 heights(const Places& p, const Places& q, const Doubles4& square) {
    const Places third = q - p;
    return root(square) / root(larger(larger(dot(p, p), dot(q, q)), dot(third, third)));
}

}  // namespace slabwright::simplifying

#pragma GCC diagnostic pop
