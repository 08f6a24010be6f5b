// How long a program takes, from its text alone.

#include "engine/moves/motion_time.h"

#include <algorithm>
#include <cmath>

#include "engine/simulate/simulate.h"

namespace slabwright {

namespace {

// The first place of which x, y and z are known, and the last; none: nothing is known.
std::optional<std::array<double, 3>> first_place(const Program& program) {
    for (const ProgramStep& s : program.steps)
        if (s.known()) return std::array<double, 3>{s.x, s.y, s.z};
    return std::nullopt;
}

std::optional<std::array<double, 3>> last_place(const Program& program) {
    if (program.steps.empty() || !program.steps.back().known()) return std::nullopt;
    const ProgramStep& s = program.steps.back();
    return std::array<double, 3>{s.x, s.y, s.z};
}

}  // namespace

double program_seconds(const Program& program, const Machine& machine, const Program* before) {
    Travel travel(axis_limits(machine), program.blend);
    auto arc = program.arcs.begin();
    for (std::size_t i = 1; i < program.steps.size(); ++i) {
        if (arc != program.arcs.end() && arc->begin == i) {
            const LevelArc& a = arc->arc;
            travel.add(arc_leg(a.start, a.turn, a.radius, program.steps[i].feed, machine));
            i = arc->end - 1;
            ++arc;
            continue;
        }
        const ProgramStep &a = program.steps[i - 1], &b = program.steps[i];
        std::array<double, 3> from{a.x, a.y, a.z};
        std::array<double, 3> to{b.x, b.y, b.z};
        for (std::size_t k = 0; k < 3; ++k)
            if (!std::isfinite(to[k] - from[k])) from[k] = to[k] = 0;  // what it takes cannot be known
        travel.add(straight_leg(from, to, b.feed, machine));
    }
    double seconds = program.dwell_s + travel.seconds();
    if (!before || before->tool != program.tool) seconds += machine.tool_change_s;
    if (before) {
        const auto from = last_place(*before), to = first_place(program);
        if (from && to) seconds += approach_seconds(*from, *to, machine);
    }
    return seconds;
}

}  // namespace slabwright
