#include "engine/schedule/motion_time.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace slabwright {

double travel_seconds(std::span<const MotionLeg> legs, double acceleration, double junction_mm) {
    const double a = acceleration;
    std::vector<double> entry(legs.size() + 1, 0);  // highest speed at a leg's start
    const MotionLeg* before = nullptr;
    for (std::size_t i = 0; i < legs.size(); ++i) {
        const MotionLeg& leg = legs[i];
        if (leg.length <= 0) continue;
        if (before) {
            const auto &u = before->leaving, &v = leg.direction;
            const double cosine = std::clamp(u[0] * v[0] + u[1] * v[1] + u[2] * v[2], -1.0, 1.0), half = std::sqrt((1 + cosine) / 2);
            const double corner = half >= 1 - 1e-12 ? 1e9 : std::sqrt(a * junction_mm * half / (1 - half));
            entry[i] = std::min({corner, before->speed, leg.speed});
        }
        before = &leg;
    }
    // Backwards: nobody may enter a leg faster than he can leave it. Forwards: nor faster than he can have become.
    double next = 0;
    for (std::size_t i = legs.size(); i-- > 0;) {
        if (legs[i].length > 0) next = std::min(entry[i], std::sqrt(next * next + 2 * a * legs[i].length));
        entry[i] = next;
    }
    double seconds = 0, v = 0;
    for (std::size_t i = 0; i < legs.size(); ++i) {
        const double length = legs[i].length;
        if (length <= 0) continue;
        const double out = std::min(entry[i + 1], std::sqrt(v * v + 2 * a * length));
        const double peak = std::min(legs[i].speed, std::sqrt((2 * a * length + v * v + out * out) / 2));
        const double ramps = (2 * peak * peak - v * v - out * out) / (2 * a);
        seconds += (2 * peak - v - out) / a + std::max(0.0, length - ramps) / std::max(peak, 1e-9);
        v = out;
    }
    return seconds;
}

MotionTime motion_time(std::span<const Move> moves, const Machine& machine) {
    MotionTime total;
    std::vector<MotionLeg> legs;
    for (std::size_t i = 1; i < moves.size(); ++i) {
        const Move &a = moves[i - 1], &b = moves[i];
        const std::array<double, 3> d{to_mm(std::int64_t{b.x} - a.x), to_mm(std::int64_t{b.y} - a.y), to_mm(std::int64_t{b.z} - a.z)};
        const double length = std::hypot(d[0], d[1], d[2]);
        if (length == 0) continue;
        const bool rapid = b.feed == 0;
        if (b.is_arc()) {
            const ArcShape arc = arc_shape(a, b);
            const double side = arc.sweep > 0 ? 1 : -1, end = arc.start + arc.sweep;
            const double speed = std::min(std::min<double>(b.feed, machine.max_feed) / 60, std::sqrt(machine.acceleration * arc.radius));
            total.cutting_mm += arc.length();
            legs.push_back({arc.length(),
                            speed,
                            {-side * std::sin(arc.start), side * std::cos(arc.start), 0},
                            {-side * std::sin(end), side * std::cos(end), 0}});
            continue;
        }
        (rapid ? total.rapid_mm : total.cutting_mm) += length;
        legs.push_back(
            {length, (rapid ? machine.rapid_feed : std::min<double>(b.feed, machine.max_feed)) / 60, {d[0] / length, d[1] / length, d[2] / length}});
    }
    total.minutes = travel_seconds(legs, machine.acceleration) / 60;
    return total;
}

}  // namespace slabwright
