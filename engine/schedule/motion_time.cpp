#include "engine/schedule/motion_time.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace slabwright {

MotionTime motion_time(std::span<const Move> moves, const Machine& machine, double junction_mm) {
    MotionTime total;
    if (moves.size() < 2) return total;
    const double a = machine.acceleration;  // mm/s²
    struct Leg {
        double length = 0, speed = 0, entry = 0;  // mm, mm/s
    };
    std::vector<Leg> legs;
    std::array<double, 3> before{};
    for (std::size_t i = 1; i < moves.size(); ++i) {
        const std::array<double, 3> d{to_mm(std::int64_t{moves[i].x} - moves[i - 1].x), to_mm(std::int64_t{moves[i].y} - moves[i - 1].y),
                                      to_mm(std::int64_t{moves[i].z} - moves[i - 1].z)};
        const double length = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        if (length == 0) continue;
        const bool rapid = moves[i].feed == 0;
        (rapid ? total.rapid_mm : total.cutting_mm) += length;
        Leg leg{length, std::min(rapid ? machine.rapid_feed : static_cast<double>(moves[i].feed), rapid ? machine.rapid_feed : machine.max_feed) / 60,
                0};
        const std::array<double, 3> unit{d[0] / length, d[1] / length, d[2] / length};
        if (!legs.empty()) {
            const double cosine = -(unit[0] * before[0] + unit[1] * before[1] + unit[2] * before[2]);  // of the angle between the legs
            const double half = std::sqrt(std::clamp((1 - cosine) / 2, 0.0, 1.0));
            const double corner = half > 0.999999 ? 1e9 : std::sqrt(a * junction_mm * half / (1 - half));
            leg.entry = std::min({corner, leg.speed, legs.back().speed});
        }
        before = unit;
        legs.push_back(leg);
    }
    // What the next corner allows, seen backwards, then what has been reached, seen forwards.
    double next = 0;
    for (std::size_t i = legs.size(); i-- > 0;) {
        legs[i].entry = std::min(legs[i].entry, std::sqrt(next * next + 2 * a * legs[i].length));
        next = legs[i].entry;
    }
    double seconds = 0, entry = 0;
    for (std::size_t i = 0; i < legs.size(); ++i) {
        const double exit = std::min(i + 1 < legs.size() ? legs[i + 1].entry : 0.0, std::sqrt(entry * entry + 2 * a * legs[i].length));
        const double peak = std::min(legs[i].speed, std::sqrt((entry * entry + exit * exit + 2 * a * legs[i].length) / 2));
        const double ramps = (2 * peak * peak - entry * entry - exit * exit) / (2 * a);
        seconds += (2 * peak - entry - exit) / a + std::max(0.0, legs[i].length - ramps) / peak;
        entry = exit;
    }
    total.minutes = seconds / 60;
    return total;
}

}  // namespace slabwright
