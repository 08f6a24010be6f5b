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
    Travel travel(machine.acceleration, program.blend);
    auto arc = program.arcs.begin();
    for (std::size_t i = 1; i < program.steps.size(); ++i) {
        if (arc != program.arcs.end() && arc->begin == i) {  // as in motion_time()
            const LevelArc& a = arc->arc;
            const double side = a.turn > 0 ? 1 : -1, end = a.start + a.turn;
            travel.add({a.length(),
                        std::min(program.steps[i].feed, machine.max_feed) / 60,
                        {-side * std::sin(a.start), side * std::cos(a.start), 0},
                        {-side * std::sin(end), side * std::cos(end), 0},
                        a.radius,
                        false});
            i = arc->end - 1;
            ++arc;
            continue;
        }
        const ProgramStep &from = program.steps[i - 1], &to = program.steps[i];
        std::array<double, 3> d{to.x - from.x, to.y - from.y, to.z - from.z};
        for (double& v : d)
            if (!std::isfinite(v)) v = 0;  // from an unknown place: what it takes cannot be known
        const double length = std::hypot(d[0], d[1], d[2]);
        if (length <= 0) continue;
        for (double& v : d) v /= length;
        travel.add({length, (to.rapid() ? machine.rapid_feed : std::min(to.feed, machine.max_feed)) / 60, d,
                    d, 0, to.rapid()});
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
