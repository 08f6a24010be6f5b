// How long a program takes on a machine that must accelerate and slow down in corners.
#pragma once

#include <span>

#include "engine/plan.h"

namespace slabwright {

struct MotionTime {
    double cutting_mm = 0, rapid_mm = 0;
    double minutes = 0;
};

/// Every move is a trapezoid of speed under the machine's acceleration (the same on all axes); between two moves the
/// speed is limited to what turns the corner within `junction_mm` of it at that acceleration
/// (v² = a·δ·sin(θ/2) / (1 − sin(θ/2)), θ the angle between the moves). Starts and ends at rest.
[[nodiscard]] MotionTime motion_time(std::span<const Move> moves, const Machine& machine, double junction_mm = 0.05);

}  // namespace slabwright
