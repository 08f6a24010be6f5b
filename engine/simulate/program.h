// A program as the machine would run it: straight motions of the tool's tip, in the order of their lines.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "engine/plan.h"

namespace slabwright {

inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// The tip goes straight to (x, y, z), mm, from wherever the step before ended. A coordinate that no line has set
/// yet is kUnknown: a program begins wherever the machine stood.
struct ProgramStep {
    double x = kUnknown, y = kUnknown, z = kUnknown;
    double feed = 0;  ///< mm/min; 0: rapid
    std::uint32_t line = 0;
    bool spindle = false;  ///< turning clockwise, as cutters here need

    [[nodiscard]] bool rapid() const { return feed == 0; }
    [[nodiscard]] bool known() const { return std::isfinite(x) && std::isfinite(y) && std::isfinite(z); }
};

/// One program and what it says of itself.
struct Program {
    std::string file;  ///< its name under nc/
    int layer = 0;     ///< index into the layers
    OperationKind kind{};
    int tool = 0;                 ///< that the program loads (T … M6)
    int planned_tool = 0;         ///< that the plan names for it
    double planned_stepdown = 0;  ///< mm, that the plan names for it; 0: none
    double spindle_rpm = 0;       ///< highest
    double dwell_s = 0;           ///< of all G4 together
    std::vector<ProgramStep> steps;
};

}  // namespace slabwright
