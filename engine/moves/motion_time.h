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
};

/// The time of legs that are told one after the other, without keeping them all.
///
/// Every stretch has a trapezoid of speed under one acceleration a. What is turned takes at most
/// kNormalShare·a across the path, and along it what is left of a: on an arc v² ≤ kNormalShare·a·r.
/// Where two legs meet, an arc that touches both rounds the corner. It passes it by δ = `junction_mm` at
/// most and takes no more than half of either leg: r = min(δ·c / (1 − c), l / 2 · c / s), c and s cosine
/// and sine of half the change of direction, l the shorter leg. A turn too slight to need it is run
/// straight through, as far as the step of speed in one servo period allows. Between a rapid and a feed
/// motion the machine stands still. Nobody is faster than he can stop within kLookahead stretches. Starts and
/// ends at rest. Legs without length are passed over.
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

    explicit Travel(double acceleration, double junction_mm = kJunction)
        : acceleration_(acceleration), junction_mm_(junction_mm) {}
    void add(const MotionLeg& leg);
    /// Of all so far, s, at rest after the last; without legs then.
    [[nodiscard]] double seconds();

private:
    static constexpr std::size_t kTogether = 1024;
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
    [[nodiscard]] double along_arc(double speed, double radius) const;
    [[nodiscard]] Corner corner(const MotionLeg& from, const MotionLeg& to) const;
    void push(double length, double speed, double acceleration, double entry);
    void push_leg(double left);
    void settle(double next);

    double acceleration_, junction_mm_;
    std::vector<Stretch> stretches_;  ///< whose speeds depend on what follows, or that few
    bool begun_ = false;
    MotionLeg last_;                      ///< told, its end not yet known
    double taken_ = 0, last_entry_ = 0;   ///< off its start, mm; the highest speed at it
    double speed_now_ = 0, seconds_ = 0;  ///< where stretches_ begins
    std::vector<double> stops_;           ///< of settle()
};

/// All at once; see Travel. @param acceleration mm/s²
[[nodiscard]] double travel_seconds(std::span<const MotionLeg> legs, double acceleration,
                                    double junction_mm = kJunction);

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
