#include "engine/schedule/motion_time.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace slabwright {

void Travel::add(const MotionLeg& leg) {
    if (leg.length <= 0) return;
    double entry = 0;
    if (begun_) {
        const auto &u = leaving_, &v = leg.direction;
        const double cosine = std::clamp(u[0] * v[0] + u[1] * v[1] + u[2] * v[2], -1.0, 1.0),
                     half = std::sqrt((1 + cosine) / 2);
        double corner = 1e9;
        if (half < 1 - 1e-12) {
            const double touches = std::min(length_, leg.length) / 2;
            corner = std::sqrt(acceleration_ * std::min(junction_mm_ * half / (1 - half),
                                                        touches * half / std::sqrt(1 - half * half)));
        }
        entry = std::min({corner, speed_, leg.speed});
    }
    begun_ = true, length_ = leg.length, speed_ = leg.speed, leaving_ = leg.leaving;
    // A leg on which one can stop from the highest speed of its start is entered at that speed, whatever
    // follows.
    if (legs_.size() >= kTogether && entry <= std::sqrt(2 * acceleration_ * leg.length)) settle(entry);
    legs_.push_back({leg.length, leg.speed, entry});
}

double Travel::seconds() {
    settle(0);
    begun_ = false;
    speed_now_ = 0;
    return std::exchange(seconds_, 0.0);
}

// Backwards: nobody may enter a leg faster than he can leave it. Forwards: nor faster than he can have
// become.
void Travel::settle(double next) {
    const double a = acceleration_, last = next;
    for (std::size_t i = legs_.size(); i-- > 0;) {
        next = std::min(legs_[i].entry, std::sqrt(next * next + 2 * a * legs_[i].length));
        legs_[i].entry = next;
    }
    double v = speed_now_;
    for (std::size_t i = 0; i < legs_.size(); ++i) {
        const double length = legs_[i].length, left_at = i + 1 < legs_.size() ? legs_[i + 1].entry : last;
        const double out = std::min(left_at, std::sqrt(v * v + 2 * a * length));
        const double peak = std::min(legs_[i].speed, std::sqrt((2 * a * length + v * v + out * out) / 2));
        const double ramps = (2 * peak * peak - v * v - out * out) / (2 * a);
        seconds_ += (2 * peak - v - out) / a + std::max(0.0, length - ramps) / std::max(peak, 1e-9);
        v = out;
    }
    speed_now_ = v;
    legs_.clear();
}

double travel_seconds(std::span<const MotionLeg> legs, double acceleration, double junction_mm) {
    Travel travel(acceleration, junction_mm);
    for (const MotionLeg& leg : legs) travel.add(leg);
    return travel.seconds();
}

MotionTime motion_time(std::span<const Move> moves, const Machine& machine, double junction_mm) {
    MotionTime total;
    Travel travel(machine.acceleration, junction_mm);
    for (std::size_t i = 1; i < moves.size(); ++i) {
        const Move &a = moves[i - 1], &b = moves[i];
        const std::array<double, 3> d{to_mm(std::int64_t{b.x} - a.x), to_mm(std::int64_t{b.y} - a.y),
                                      to_mm(std::int64_t{b.z} - a.z)};
        const double length = std::hypot(d[0], d[1], d[2]);
        if (length == 0) continue;
        const bool rapid = b.feed == 0;
        if (b.is_arc()) {
            const ArcShape arc = arc_shape(a, b);
            const double side = arc.sweep > 0 ? 1 : -1, end = arc.start + arc.sweep;
            const double speed = std::min(std::min<double>(b.feed, machine.max_feed) / 60,
                                          std::sqrt(machine.acceleration * arc.radius));
            total.cutting_mm += arc.length();
            travel.add({arc.length(),
                        speed,
                        {-side * std::sin(arc.start), side * std::cos(arc.start), 0},
                        {-side * std::sin(end), side * std::cos(end), 0}});
            continue;
        }
        (rapid ? total.rapid_mm : total.cutting_mm) += length;
        travel.add({length,
                    (rapid ? machine.rapid_feed : std::min<double>(b.feed, machine.max_feed)) / 60,
                    {d[0] / length, d[1] / length, d[2] / length}});
    }
    total.minutes = travel.seconds() / 60;
    return total;
}

}  // namespace slabwright
