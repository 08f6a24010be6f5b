#include "engine/moves/motion_time.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace slabwright {

// What of the acceleration is left along an arc that is run at a speed.
double Travel::along_arc(double speed, double radius) const {
    const double across = speed * speed / (radius * acceleration_);
    return acceleration_ * std::sqrt(std::max(0.0, 1 - across * across));
}

Travel::Corner Travel::corner(const MotionLeg& from, const MotionLeg& to) const {
    Corner corner;
    if (from.rapid != to.rapid) return corner;
    double cosine = 0, step = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        cosine += from.leaving[k] * to.direction[k];
        step = std::max(step, std::fabs(to.direction[k] - from.leaving[k]));
    }
    cosine = std::clamp(cosine, -1.0, 1.0);
    // Run straight through, the velocity changes by `step`·v within one servo period.
    const double slower = std::min(from.speed, to.speed);
    const double kink = step * (slower / kServoPeriod + acceleration_) / acceleration_;
    if (kink <= kKink) {
        corner.speed = slower;
        return corner;
    }
    constexpr double least_angle = 0.0174524;  // sine of 1°: nearly back the way it came
    const double c = std::sqrt((1 + cosine) / 2), s = std::sqrt((1 - cosine) / 2);
    if (c <= least_angle || !(junction_mm_ > 0)) return corner;
    corner.speed = slower * kKink / kink;
    const double turn = 2 * std::asin(s), normal = kNormalShare * acceleration_;
    const double touches = std::min({from.length / 2, to.length / 2, s * junction_mm_ / (1 - c)});
    const double widest = touches * c / s;
    const double planned = std::min(std::max(from.speed, to.speed), std::sqrt(normal * widest));
    // Short legs are taken by wider arcs, in the time of a ramp of half the acceleration.
    const double half = acceleration_ / 2;
    const double ramp = std::min(planned, std::sqrt(2 * half * touches)) / half * planned;
    const double radius = std::max(planned * planned / normal, std::min(ramp / turn, widest));
    const double length = radius * turn;
    const double speed = std::min(planned, length / (kLeastPeriods * kServoPeriod));
    if (speed <= corner.speed) return corner;
    corner.speed = speed;
    corner.setback = radius * s / c;
    corner.length = length;
    corner.acceleration = along_arc(speed, radius);
    return corner;
}

void Travel::push(double length, double speed, double acceleration, double entry) {
    // A stretch on which one can stop from the highest speed of its start is entered at that speed, whatever
    // follows.
    if (stretches_.size() >= kTogether && entry <= std::sqrt(2 * acceleration * length)) settle(entry);
    stretches_.push_back({length, speed, acceleration, entry});
}

// What corners leave of the last leg.
void Travel::push_leg(double left) {
    const double acceleration = last_.radius > 0 ? along_arc(last_.speed, last_.radius) : acceleration_;
    push(left, last_.speed, acceleration, last_entry_);
}

void Travel::add(const MotionLeg& told) {
    if (told.length <= 0) return;
    MotionLeg leg = told;
    leg.speed = std::min(leg.speed, leg.length / (kLeastPeriods * kServoPeriod));
    if (leg.radius > 0) leg.speed = std::min(leg.speed, std::sqrt(kNormalShare * acceleration_ * leg.radius));
    if (!begun_) {
        begun_ = true;
        taken_ = 0;
        last_entry_ = 0;
        last_ = leg;
        return;
    }
    const Corner met = corner(last_, leg);
    const double left = std::max(0.0, last_.length - taken_ - met.setback);
    if (met.length > 0) {
        // So little of a leg is left between two arcs that it goes with the second.
        const bool consumed = left < kGapPeriods * kServoPeriod * met.speed;
        if (!consumed) push_leg(left);
        const double entry = std::min({met.speed, last_.speed, consumed ? last_entry_ : last_.speed});
        push(met.length + (consumed ? left : 0), met.speed, met.acceleration, entry);
        last_entry_ = std::min(met.speed, leg.speed);
    } else {
        push_leg(left);
        last_entry_ = std::min({met.speed, last_.speed, leg.speed});
    }
    taken_ = met.setback;
    last_ = leg;
}

double Travel::seconds() {
    if (begun_) push_leg(std::max(0.0, last_.length - taken_));
    settle(0);
    begun_ = false;
    speed_now_ = 0;
    return std::exchange(seconds_, 0.0);
}

// Backwards: nobody may enter a stretch faster than he can leave it. Forwards: nor faster than he can have
// become.
void Travel::settle(double next) {
    const double last = next;
    const std::size_t count = stretches_.size();
    // Squares of the speeds from which one stops before a stretch's end
    stops_.assign(count + 1, 0);
    for (std::size_t i = 0; i < count; ++i)
        stops_[i + 1] = stops_[i] + 2 * stretches_[i].acceleration * stretches_[i].length;
    for (std::size_t i = count; i-- > 0;) {
        next = std::min(stretches_[i].entry,
                        std::sqrt(next * next + 2 * stretches_[i].acceleration * stretches_[i].length));
        stretches_[i].entry = next;
    }
    for (std::size_t i = 0; i + kLookahead <= count; ++i)
        stretches_[i].entry = std::min(stretches_[i].entry, std::sqrt(stops_[i + kLookahead] - stops_[i]));
    double v = speed_now_;
    for (std::size_t i = 0; i < count; ++i) {
        const double length = stretches_[i].length, a = stretches_[i].acceleration;
        const double left_at = i + 1 < count ? stretches_[i + 1].entry : last;
        const double out = std::min(left_at, std::sqrt(v * v + 2 * a * length));
        const double peak = std::max(
            {v, out, std::min(stretches_[i].speed, std::sqrt((2 * a * length + v * v + out * out) / 2))});
        if (a > 0) {
            const double ramps = (2 * peak * peak - v * v - out * out) / (2 * a);
            seconds_ += (2 * peak - v - out) / a + std::max(0.0, length - ramps) / std::max(peak, 1e-9);
        } else {
            seconds_ += length / std::max(peak, 1e-9);
        }
        v = out;
    }
    speed_now_ = v;
    stretches_.clear();
}

double travel_seconds(std::span<const MotionLeg> legs, double acceleration, double junction_mm) {
    Travel travel(acceleration, junction_mm);
    for (const MotionLeg& leg : legs) travel.add(leg);
    return travel.seconds();
}

double approach_seconds(const std::array<double, 3>& from, const std::array<double, 3>& to,
                        const Machine& machine) {
    const auto alone = [&](double length) {
        const MotionLeg leg{length, machine.rapid_feed / 60, {1, 0, 0}, {1, 0, 0}, 0, true};
        return travel_seconds({&leg, 1}, machine.acceleration);
    };
    return alone(std::fabs(to[2] - from[2])) + alone(std::hypot(to[0] - from[0], to[1] - from[1]));
}

std::array<double, 3> place_of(const Move& move) { return {to_mm(move.x), to_mm(move.y), to_mm(move.z)}; }

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
            total.cutting_mm += arc.length();
            travel.add({arc.length(),
                        std::min<double>(b.feed, machine.max_feed) / 60,
                        {-side * std::sin(arc.start), side * std::cos(arc.start), 0},
                        {-side * std::sin(end), side * std::cos(end), 0},
                        arc.radius,
                        false});
            continue;
        }
        (rapid ? total.rapid_mm : total.cutting_mm) += length;
        const std::array<double, 3> direction{d[0] / length, d[1] / length, d[2] / length};
        travel.add({length, (rapid ? machine.rapid_feed : std::min<double>(b.feed, machine.max_feed)) / 60,
                    direction, direction, 0, rapid});
    }
    total.minutes = travel.seconds() / 60;
    return total;
}

}  // namespace slabwright
