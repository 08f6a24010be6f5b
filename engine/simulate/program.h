// A program as the machine would run it: straight motions of the tool's tip, in the order of their lines, and
// which of them are arcs.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "engine/plan.h"
#include "kernels/stock/sweep.h"

namespace slabwright {

inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// The tip goes straight to (x, y, z), mm, from wherever the step before ended. A coordinate that no line has
/// set yet is kUnknown: a program begins wherever the machine stood.
struct ProgramStep {
    double x = kUnknown, y = kUnknown, z = kUnknown;
    double feed = 0;  ///< mm/min; 0: rapid
    std::uint32_t line = 0;
    bool spindle = false;  ///< turning clockwise, as cutters here need

    [[nodiscard]] bool rapid() const { return feed == 0; }
    [[nodiscard]] bool known() const { return std::isfinite(x) && std::isfinite(y) && std::isfinite(z); }
};

/// Steps [begin, end) are chords of a level arc, which starts where step begin − 1 ended: their ends lie on
/// it, and no point of it is farther from them than Program::chord_error. What can, takes the arc itself, or
/// as many chords as it wants of it.
struct ProgramArc {
    std::size_t begin = 0, end = 0;
    LevelArc arc;
    std::size_t close =
        0;  ///< even chords that lie within GcodeLimits::arc_error of it; fewer than its steps: those do

    [[nodiscard]] std::size_t close_chords() const { return std::max(close, end - begin); }
    /// Where it is after a share of its way.
    [[nodiscard]] std::array<double, 2> at(double share) const {
        const double angle = arc.start + arc.turn * share;
        return {arc.x + arc.radius * std::cos(angle), arc.y + arc.radius * std::sin(angle)};
    }
};

/// Something that a program says, and its line; 0 where it does not say it.
struct ProgramWord {
    double value = 0;
    std::uint32_t line = 0;
};

/// One program and what it says of itself.
struct Program {
    std::string file;  ///< its name under nc/
    int number = 0;    ///< by which a control knows it that numbers programs (O0302); 0: it has none
    int layer = 0;     ///< index into the layers
    OperationKind kind{};
    int tool = 0;                                  ///< that the program loads (T … M6)
    int planned_tool = 0;                          ///< that the plan names for it
    double planned_stepdown = 0;                   ///< mm, that the plan names for it; 0: none
    double spindle_rpm = 0;                        ///< highest
    ProgramWord slowest_spindle, fastest_spindle;  ///< rpm from its first feed motion to its last retract; 0
                                                   ///< rpm: it stands
    double dwell_s = 0;                            ///< of all G4 together
    ProgramWord longest_dwell;                     ///< s, of one G4
    ProgramWord shortest_spin_up;  ///< s of dwell between the spindle's start, or a change of its speed, and
                                   ///< the next feed motion; the line is that motion's
    double blend = kJunction;   ///< mm by which the machine may round the corners (G64 P; 0: G61), the least
                                ///< that the program names
    double strays = kJunction;  ///< mm by which it may leave the path at most: P, and Q for points that it
                                ///< leaves out (P where no Q is given)
    std::uint32_t strays_line = 0;  ///< that says so
    std::vector<ProgramStep> steps;
    std::vector<ProgramArc> arcs;  ///< in the order of their steps
    double chord_error = 0;        ///< mm: how far any arc is from its steps at most
    double arc_error = 0;          ///< mm: the same where close chords stand for level arcs

    /// Its steps, but for close chords in place of those of arcs.
    [[nodiscard]] std::size_t close_steps() const {
        std::size_t count = steps.size();
        for (const ProgramArc& a : arcs) count += a.close_chords() - (a.end - a.begin);
        return count;
    }
};

/// Between which feeds a program cuts, mm/min: in the plane, and the fastest straight down; 0 where it never
/// does.
struct CuttingFeeds {
    double low = 0, high = 0, plunge = 0;
};
[[nodiscard]] CuttingFeeds cutting_feeds(const Program& program);

}  // namespace slabwright
