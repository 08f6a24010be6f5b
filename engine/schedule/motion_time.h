// How long a program takes on a machine that must accelerate and slow down in corners.
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
};

/// The time of legs that are told one after the other, without keeping them all: see travel_seconds.
class Travel {
public:
    explicit Travel(double acceleration, double junction_mm = kJunction)
        : acceleration_(acceleration), junction_mm_(junction_mm) {}
    void add(const MotionLeg& leg);
    /// Of all so far, s, at rest after the last; without legs then.
    [[nodiscard]] double seconds();

private:
    static constexpr std::size_t kTogether = 1024;
    struct Leg {
        double length, speed;
        double entry;  ///< highest speed at its start
    };
    void settle(double next);
    double acceleration_, junction_mm_;
    std::vector<Leg> legs_;  ///< whose speeds depend on what follows, or that few
    bool begun_ = false;
    double length_ = 0, speed_ = 0;  ///< of the last leg; the highest on it
    std::array<double, 3> leaving_{};
    double speed_now_ = 0, seconds_ = 0;  ///< where legs_ begins
};

/// Every leg is a trapezoid of speed under one acceleration (mm/s²); where two legs meet, the speed is
/// limited to what the widest arc bears that touches both, each no farther off than its middle, and passes
/// the corner by δ = `junction_mm` at most: v² = a·r, r = min(δ·c / (1 − c), l / 2 · c / s), c and s cosine
/// and sine of θ/2, θ the change of direction, l the shorter leg. So chords of a circle are run no faster
/// than the circle. Starts and ends at rest. Legs without length are passed over.
[[nodiscard]] double travel_seconds(std::span<const MotionLeg> legs, double acceleration,
                                    double junction_mm = kJunction);

struct MotionTime {
    double cutting_mm = 0, rapid_mm = 0;
    double minutes = 0;
};

/// Of a program's moves, the first of which is where it starts. On an arc the speed is also limited to what
/// its radius bears under the machine's acceleration: v² = a·r. Corners are rounded by `junction_mm` at most,
/// as in travel_seconds.
[[nodiscard]] MotionTime motion_time(std::span<const Move> moves, const Machine& machine,
                                     double junction_mm = kJunction);

}  // namespace slabwright
