// How long a program takes on a machine that must accelerate and slow down in corners (METHOD.md section 12):
// by the rules of the trajectory planner of LinuxCNC 2.9, against which bench/motion measures it.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "engine/plan.h"

namespace slabwright {

/// A smooth stretch of a motion: its length in mm, the highest speed in mm/s, and its unit direction.
struct MotionLeg {
    double length = 0, speed = 0;
    std::array<double, 3> direction{};          ///< at its start
    std::array<double, 3> leaving = direction;  ///< at its end
    double radius = 0;                          ///< of a level arc, mm; 0: straight
    bool rapid = false;
    bool left = false;  ///< of an arc: it turns counterclockwise, seen from above
};

/// What x, y and z can do, each for itself.
struct AxisLimits {
    std::array<double, 3> speed{};         ///< mm/s
    std::array<double, 3> acceleration{};  ///< mm/s²
};

/// Of a machine; an axis without limits of its own has those of x.
[[nodiscard]] AxisLimits axis_limits(const Machine& machine);

/// How far an axis's own limits let a straight motion go: the least of limit / |direction| over the axes, in
/// the limits' unit. @param direction of unit length
[[nodiscard]] double along_axes(const std::array<double, 3>& limits, const std::array<double, 3>& direction);

/// The time of legs that are told one after the other, without keeping them all.
///
/// Every stretch has a trapezoid of speed under one acceleration: along a straight way the most that every
/// axis bears, a = min aₖ / |dₖ|; in a plane the same for the worst direction. Speeds keep to the axes in the
/// same way. What is turned takes at most kNormalShare·a across the path, and along it what is left of a: on
/// an arc v² ≤ kNormalShare·a·r.
///
/// Where two legs meet, an arc that touches both rounds the corner. It passes it by δ = `junction_mm` at
/// most and takes no more than half of either straight leg: r = min(δ·c / (1 − c), l / 2 · c / s), c and s
/// cosine and sine of half the change of direction, l the shorter leg. Of an arc it may take two thirds at
/// the end or one third at the start, in the plane of that arc only; where it turns to the same side, a
/// quarter of that as its half chord, and the change of direction is the wider by that angle. A turn too
/// slight to need it is run straight through, as far as the step of speed in one servo period allows; beside
/// an arc half as far. Between a rapid and a feed motion the machine stands still. Nobody is faster than he
/// can stop within kLookahead stretches. Starts and ends at rest, and the last leg, which waits for another
/// to blend into, has half of its acceleration. Legs without length are passed over.
class Travel {
public:
    static constexpr double kNormalShare =
        0.8660254037844386;                        ///< √¾: half of the acceleration is left along
    static constexpr double kServoPeriod = 0.001;  ///< s
    static constexpr double kLeastPeriods = 1.02;  ///< that a stretch lasts
    static constexpr double kKink = 0.1;           ///< of the acceleration, that a turn may ask for at once
    static constexpr double kGapPeriods =
        4;  ///< a shorter rest between two corners' arcs goes with the second
    static constexpr std::size_t kLookahead = 50;

    explicit Travel(const AxisLimits& limits, double junction_mm = kJunction)
        : limits_(limits), junction_mm_(junction_mm) {}
    void add(const MotionLeg& leg);
    /// Of all so far, s, at rest after the last; without legs then.
    [[nodiscard]] double seconds();

private:
    static constexpr std::size_t kTogether = 1024;
    struct Leg : MotionLeg {
        double acceleration = 0;  ///< along it, mm/s²
    };
    struct Stretch {
        double length, speed, acceleration;
        double entry;  ///< highest speed at its start
    };
    struct Corner {
        double speed = 0;
        double setback = 0;       ///< mm, what its arc takes of either leg
        double length = 0;        ///< mm, of its arc; 0: it has none
        double acceleration = 0;  ///< along its arc
    };
    struct Reach;
    [[nodiscard]] Leg limited(const MotionLeg& told) const;
    [[nodiscard]] static Reach reach(const Leg& from, const Leg& to, double turn);
    [[nodiscard]] Corner corner(const Leg& from, const Leg& to) const;
    void push(double length, double speed, double acceleration, double entry);
    void settle(double next);

    AxisLimits limits_;
    double junction_mm_;
    std::vector<Stretch> stretches_;  ///< whose speeds depend on what follows, or that few
    bool begun_ = false;
    Leg last_;                            ///< told, its end not yet known
    double taken_ = 0, last_entry_ = 0;   ///< off its start, mm; the highest speed at it
    double speed_now_ = 0, seconds_ = 0;  ///< where stretches_ begins
    std::vector<double> stops_;           ///< of settle()
};

/// All at once; see Travel.
[[nodiscard]] double travel_seconds(std::span<const MotionLeg> legs, const AxisLimits& limits,
                                    double junction_mm = kJunction);

/// A straight motion between two places as a leg, none of its coordinates unknown; one of no length has
/// length 0. @param feed mm/min; 0: rapid
[[nodiscard]] MotionLeg straight_leg(const std::array<double, 3>& from, const std::array<double, 3>& to,
                                     double feed, const Machine& machine);

/// A level arc as a leg. @param start radians, from its centre to where it begins @param sweep radians,
/// negative: clockwise @param radius mm @param feed mm/min
[[nodiscard]] MotionLeg arc_leg(double start, double sweep, double radius, double feed,
                                const Machine& machine);

/// From one program's end to where the next begins: up or down, then across, each from rest to rest, s.
/// @param from mm @param to mm
[[nodiscard]] double approach_seconds(const std::array<double, 3>& from, const std::array<double, 3>& to,
                                      const Machine& machine);

/// Where a move ends, mm.
[[nodiscard]] std::array<double, 3> place_of(const Move& move);

struct MotionTime {
    double cutting_mm = 0, rapid_mm = 0;
    double minutes = 0;
};

/// Of a program's moves, the first of which is where it starts. Corners are rounded by `junction_mm` at most.
[[nodiscard]] MotionTime motion_time(std::span<const Move> moves, const Machine& machine,
                                     double junction_mm = kJunction);

}  // namespace slabwright
