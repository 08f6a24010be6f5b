// How long a program takes, from its text alone.

#include <algorithm>
#include <cmath>

#include "engine/schedule/motion_time.h"
#include "engine/simulate/simulate.h"

namespace slabwright {

double program_seconds(const Program& program, const Machine& machine) {
    Travel travel(machine.acceleration, program.blend);
    auto arc = program.arcs.begin();
    for (std::size_t i = 1; i < program.steps.size(); ++i) {
        if (arc != program.arcs.end() && arc->begin == i) {  // as in motion_time()
            const LevelArc& a = arc->arc;
            const double side = a.turn > 0 ? 1 : -1, end = a.start + a.turn,
                         speed = std::min(std::min(program.steps[i].feed, machine.max_feed) / 60,
                                          std::sqrt(machine.acceleration * a.radius));
            travel.add({a.length(),
                        speed,
                        {-side * std::sin(a.start), side * std::cos(a.start), 0},
                        {-side * std::sin(end), side * std::cos(end), 0}});
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
        travel.add({length,
                    (to.rapid() ? machine.rapid_feed : std::min(to.feed, machine.max_feed)) / 60,
                    {d[0] / length, d[1] / length, d[2] / length}});
    }
    return program.dwell_s + machine.tool_change_s + travel.seconds();
}

}  // namespace slabwright
