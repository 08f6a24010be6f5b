// How long a program takes on a machine that must accelerate and slow down in corners.
#pragma once

#include <array>
#include <span>

#include "engine/plan.h"

namespace slabwright {

/// A smooth stretch of a motion: its length in mm, the highest speed in mm/s, and its unit direction.
struct MotionLeg {
    double length = 0, speed = 0;
    std::array<double, 3> direction{};          ///< at its start
    std::array<double, 3> leaving = direction;  ///< at its end
};

/// How near a path may pass by its corners, mm.
inline constexpr double kJunction = 0.02;

/// Every leg is a trapezoid of speed under one acceleration (mm/s²); where two legs meet, the speed is limited to what an
/// arc that passes the corner by `junction_mm` bears: v² = a·δ·c / (1 − c), c = cos(θ/2), θ the change of direction. Starts and
/// ends at rest. Legs without length are passed over.
[[nodiscard]] double travel_seconds(std::span<const MotionLeg> legs, double acceleration, double junction_mm = kJunction);

struct MotionTime {
    double cutting_mm = 0, rapid_mm = 0;
    double minutes = 0;
};

/// Of a program's moves, the first of which is where it starts. On an arc the speed is also limited to what its radius bears
/// under the machine's acceleration: v² = a·r.
[[nodiscard]] MotionTime motion_time(std::span<const Move> moves, const Machine& machine);

}  // namespace slabwright
