#include "kernels/polygons/farthest.h"

#include <cstdint>
#include <cstring>

#include "kernels/geometry/wide.h"

namespace slabwright {

namespace {

constexpr std::size_t kLanes = 8;

struct Segment {
    double ax, ay, az, dx, dy, dz, l2;
};

// The square of the distance of one point, or of eight.
template <class T>
[[gnu::always_inline]] inline void distance2(const Segment& s, const T& x, const T& y, const T& z, T& d2) {
    const T wx = x - s.ax, wy = y - s.ay, wz = z - s.az;
    T t = (wx * s.dx + wy * s.dy + wz * s.dz) / s.l2;
    t = t < 0.0 ? T{} : t;
    t = t > 1.0 ? T{} + 1.0 : t;
    const T ex = wx - t * s.dx, ey = wy - t * s.dy, ez = wz - t * s.dz;
    d2 = ex * ex + ey * ey + ez * ez;
}

[[gnu::always_inline]] inline void one_by_one(const PointRows& p, const Segment& s, std::size_t first,
                                              std::size_t last, Farthest& best) {
    for (std::size_t i = first; i < last; ++i) {
        double d2 = 0;
        distance2(s, p.x[i], p.y[i], p.z[i], d2);
        if (d2 > best.distance2) best = {d2, i};
    }
}

SLABWRIGHT_WIDE Farthest by_eights(const PointRows& p, const Segment& s, std::size_t first,
                                   std::size_t last) {
    constexpr Longs8 lane{0, 1, 2, 3, 4, 5, 6, 7};
    Doubles8 most = Doubles8{} - 1.0;
    Longs8 at{};
    std::size_t i = first;
    for (; i + kLanes <= last; i += kLanes) {
        Doubles8 x, y, z, d2;
        std::memcpy(&x, p.x.data() + i, sizeof x), std::memcpy(&y, p.y.data() + i, sizeof y),
            std::memcpy(&z, p.z.data() + i, sizeof z);
        distance2(s, x, y, z, d2);
        const Longs8 farther = d2 > most, here = lane + static_cast<std::int64_t>(i);
        most = farther ? d2 : most;
        at = farther ? here : at;
    }
    Farthest best{-1, first};
    for (std::size_t k = 0; k < kLanes; ++k)
        if (const auto of_lane = static_cast<std::size_t>(at[k]);
            most[k] > best.distance2 || (most[k] == best.distance2 && of_lane < best.at))
            best = {most[k], of_lane};
    one_by_one(p, s, i, last, best);
    return best;
}

}  // namespace

Farthest farthest_between(const PointRows& p, std::size_t first, std::size_t last) {
    Segment s{p.x[first],
              p.y[first],
              p.z[first],
              p.x[last] - p.x[first],
              p.y[last] - p.y[first],
              p.z[last] - p.z[first],
              0};
    s.l2 = s.dx * s.dx + s.dy * s.dy + s.dz * s.dz;
    if (!(s.l2 > 0)) s.l2 = 1;  // a point: nothing is along it
    if (last - first > kLanes) return by_eights(p, s, first + 1, last);
    Farthest best{-1, first};
    one_by_one(p, s, first + 1, last, best);
    return best;
}

}  // namespace slabwright
