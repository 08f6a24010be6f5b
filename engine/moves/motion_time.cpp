#include "engine/moves/motion_time.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace slabwright {

namespace {

constexpr double kLeastAngle = 0.0174524;  // sine of 1 degree: nearly back the way it came
constexpr double kLevel = 1e-6;            // rise per mm of what counts as level

// What of an acceleration is left along an arc that is run at a speed.
double along_arc(double speed, double radius, double acceleration) {
    const double across = speed * speed / (radius * acceleration);
    return acceleration * std::sqrt(std::max(0.0, 1 - across * across));
}

// The most that the axes bear in every direction of the plane of two directions.
double in_plane(const std::array<double, 3>& limits, const std::array<double, 3>& u,
                const std::array<double, 3>& v) {
    const std::array<double, 3> normal{u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2],
                                       u[0] * v[1] - u[1] * v[0]};
    const double size = std::hypot(normal[0], normal[1], normal[2]);
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < 3; ++k) {
        // Of the axis's unit vector, what lies in the plane.
        const double share = size > 0 ? std::sqrt(std::max(0.0, 1 - std::pow(normal[k] / size, 2))) : 1;
        if (share > kLevel) least = std::min(least, limits[k] / share);
    }
    return least;
}

}  // namespace

AxisLimits axis_limits(const Machine& machine) {
    const auto or_x = [](double own, double of_x) { return own > 0 ? own : of_x; };
    const double v = machine.rapid_feed / 60, a = machine.acceleration;
    return {{v, or_x(machine.rapid_y / 60, v), or_x(machine.rapid_z / 60, v)},
            {a, or_x(machine.acceleration_y, a), or_x(machine.acceleration_z, a)}};
}

double along_axes(const std::array<double, 3>& limits, const std::array<double, 3>& direction) {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < 3; ++k)
        if (direction[k] != 0) least = std::min(least, limits[k] / std::fabs(direction[k]));
    return least;
}

// How much of two legs the arc of their corner may take, mm.
struct Travel::Reach {
    double length = 0;
    double wider = 0;      // than half the turn, radians
    double curvature = 0;  // of both legs, to the side of the turn, 1/mm
    bool possible = true;
};

Travel::Reach Travel::reach(const Leg& from, const Leg& to, double turn) {
    Reach found{std::min(from.length, to.length) / 2};
    if (from.radius <= 0 && to.radius <= 0) return found;
    if (std::fabs(from.leaving[2]) > kLevel || std::fabs(to.direction[2]) > kLevel) {
        found.possible = false;  // out of the arc's plane
        return found;
    }
    const bool left = from.leaving[0] * to.direction[1] > from.leaving[1] * to.direction[0];
    const double quarter = std::numbers::pi / 2;
    const auto of = [&](const Leg& leg, double share) {
        if (leg.radius <= 0) return leg.length / 2;
        const bool same = leg.left == left;
        const double angle = std::min(leg.length / leg.radius * share, same ? quarter - turn / 2 : quarter);
        found.curvature += (same ? 1 : -1) / leg.radius;
        if (!same) return angle * leg.radius;
        found.wider = std::max(found.wider, angle / 4);
        return std::sin(angle / 4) * leg.radius;
    };
    found.length = std::min(of(from, 2.0 / 3), of(to, 1.0 / 3));
    return found;
}

Travel::Corner Travel::corner(const Leg& from, const Leg& to) const {
    Corner corner;
    if (from.rapid != to.rapid) return corner;
    // Run straight through, the velocity changes by `step`·v within one servo period.
    const double slower = std::min(from.speed, to.speed);
    const double jump = slower / kServoPeriod + std::max(from.acceleration, to.acceleration);
    double cosine = 0, kink = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        cosine += from.leaving[k] * to.direction[k];
        kink = std::max(kink, std::fabs(to.direction[k] - from.leaving[k]) * jump / limits_.acceleration[k]);
    }
    cosine = std::clamp(cosine, -1.0, 1.0);
    if (from.radius > 0 || to.radius > 0) kink *= 2;
    if (kink <= kKink) {
        corner.speed = slower;
        return corner;
    }
    const double turn = 2 * std::asin(std::sqrt((1 - cosine) / 2));
    if (std::cos(turn / 2) <= kLeastAngle || !(junction_mm_ > 0)) return corner;
    corner.speed = slower * kKink / kink;
    const Reach may = reach(from, to, turn);
    if (!may.possible) return corner;
    const double a = in_plane(limits_.acceleration, from.leaving, to.direction), normal = kNormalShare * a;
    const double c = std::cos(turn / 2 + may.wider), s = std::sin(turn / 2 + may.wider);
    const double touches = std::min(may.length, s * junction_mm_ / (1 - c));
    const double widest = touches * c / s;
    const double planned = std::min({std::max(from.speed, to.speed), std::sqrt(normal * widest),
                                     in_plane(limits_.speed, from.leaving, to.direction)});
    // Short legs are taken by wider arcs, in the time of a ramp of half the acceleration.
    const double half = a / 2;
    const double ramp = std::min(planned, std::sqrt(2 * half * touches)) / half * planned;
    const double radius =
        std::max(planned * planned / normal, std::min(ramp / (turn + 2 * may.wider), widest));
    // What it takes of arcs turns it further, or less.
    const double bent = 1 - radius * may.curvature / 2;
    if (bent <= 0) return corner;
    const double setback = radius * std::tan(turn / 2) / bent;
    const double length = radius * (turn + setback * may.curvature);
    const double speed = std::min(planned, length / (kLeastPeriods * kServoPeriod));
    if (speed <= corner.speed) return corner;
    return {speed, setback, length, along_arc(speed, radius, a)};
}

void Travel::push(double length, double speed, double acceleration, double entry) {
    // A stretch on which one can stop from the highest speed of its start is entered at that speed, whatever
    // follows.
    if (stretches_.size() >= kTogether && entry <= std::sqrt(2 * acceleration * length)) settle(entry);
    stretches_.push_back({length, speed, acceleration, entry});
}

Travel::Leg Travel::limited(const MotionLeg& told) const {
    Leg leg{told};
    leg.speed = std::min(leg.speed, leg.length / (kLeastPeriods * kServoPeriod));
    if (leg.radius > 0) {
        const double a = std::min(limits_.acceleration[0], limits_.acceleration[1]);
        // What is left along the arc is reckoned from the fastest that it could be run, whatever its feed.
        const double fastest =
            std::min({limits_.speed[0], limits_.speed[1], std::sqrt(kNormalShare * a * leg.radius)});
        leg.speed = std::min(leg.speed, fastest);
        leg.acceleration = along_arc(fastest, leg.radius, a);
    } else {
        leg.speed = std::min(leg.speed, along_axes(limits_.speed, leg.direction));
        leg.acceleration = along_axes(limits_.acceleration, leg.direction);
    }
    return leg;
}

void Travel::add(const MotionLeg& told) {
    if (told.length <= 0) return;
    const Leg leg = limited(told);
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
        if (!consumed) push(left, last_.speed, last_.acceleration, last_entry_);
        const double entry = std::min({met.speed, last_.speed, consumed ? last_entry_ : last_.speed});
        push(met.length + (consumed ? left : 0), met.speed, met.acceleration, entry);
        last_entry_ = std::min(met.speed, leg.speed);
    } else {
        push(left, last_.speed, last_.acceleration, last_entry_);
        last_entry_ = std::min({met.speed, last_.speed, leg.speed});
    }
    taken_ = met.setback;
    last_ = leg;
}

double Travel::seconds() {
    if (begun_) push(std::max(0.0, last_.length - taken_), last_.speed, last_.acceleration / 2, last_entry_);
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

double travel_seconds(std::span<const MotionLeg> legs, const AxisLimits& limits, double junction_mm) {
    Travel travel(limits, junction_mm);
    for (const MotionLeg& leg : legs) travel.add(leg);
    return travel.seconds();
}

MotionLeg straight_leg(const std::array<double, 3>& from, const std::array<double, 3>& to, double feed,
                       const Machine& machine) {
    std::array<double, 3> d{to[0] - from[0], to[1] - from[1], to[2] - from[2]};
    const double length = std::hypot(d[0], d[1], d[2]);
    if (length > 0)
        for (double& v : d) v /= length;
    const bool rapid = feed == 0;
    return {length, (rapid ? machine.rapid_feed : std::min(feed, machine.max_feed)) / 60, d, d, 0, rapid};
}

MotionLeg arc_leg(double start, double sweep, double radius, double feed, const Machine& machine) {
    const double side = sweep > 0 ? 1 : -1, end = start + sweep;
    return {radius * std::fabs(sweep),
            std::min(feed, machine.max_feed) / 60,
            {-side * std::sin(start), side * std::cos(start), 0},
            {-side * std::sin(end), side * std::cos(end), 0},
            radius,
            false,
            sweep > 0};
}

double approach_seconds(const std::array<double, 3>& from, const std::array<double, 3>& to,
                        const Machine& machine) {
    const AxisLimits limits = axis_limits(machine);
    const auto alone = [&](const MotionLeg& leg) {
        if (leg.length <= 0) return 0.0;
        const double v = std::min(leg.speed, along_axes(limits.speed, leg.direction)),
                     a = along_axes(limits.acceleration, leg.direction);
        return leg.length > v * v / a ? leg.length / v + v / a : 2 * std::sqrt(leg.length / a);
    };
    const std::array<double, 3> above{from[0], from[1], to[2]};
    return alone(straight_leg(from, above, 0, machine)) + alone(straight_leg(above, to, 0, machine));
}

std::array<double, 3> place_of(const Move& move) { return {to_mm(move.x), to_mm(move.y), to_mm(move.z)}; }

MotionTime motion_time(std::span<const Move> moves, const Machine& machine, double junction_mm) {
    MotionTime total;
    Travel travel(axis_limits(machine), junction_mm);
    for (std::size_t i = 1; i < moves.size(); ++i) {
        const Move &a = moves[i - 1], &b = moves[i];
        if (b.is_arc()) {
            const ArcShape arc = arc_shape(a, b);
            total.cutting_mm += arc.length();
            travel.add(arc_leg(arc.start, arc.sweep, arc.radius, b.feed, machine));
            continue;
        }
        const MotionLeg leg = straight_leg(place_of(a), place_of(b), b.feed, machine);
        (leg.rapid ? total.rapid_mm : total.cutting_mm) += leg.length;
        travel.add(leg);
    }
    total.minutes = travel.seconds() / 60;
    return total;
}

}  // namespace slabwright
