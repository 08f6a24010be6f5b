// How long a program takes, from its text alone.

#include <algorithm>
#include <cmath>

#include "engine/schedule/motion_time.h"
#include "engine/simulate/simulate.h"

namespace slabwright {

double program_seconds(const Program& program, const Machine& machine) {
    Travel travel(machine.acceleration, program.blend);
    for (std::size_t i = 1; i < program.steps.size(); ++i) {
        const ProgramStep &from = program.steps[i - 1], &to = program.steps[i];
        std::array<double, 3> d{to.x - from.x, to.y - from.y, to.z - from.z};
        for (double& v : d)
            if (!std::isfinite(v)) v = 0;  // from an unknown place: what it takes cannot be known
        const double length = std::hypot(d[0], d[1], d[2]);
        if (length <= 0) continue;
        travel.add(
            {length, (to.rapid() ? machine.rapid_feed : std::min(to.feed, machine.max_feed)) / 60, {d[0] / length, d[1] / length, d[2] / length}});
    }
    return program.dwell_s + machine.tool_change_s + travel.seconds();
}

}  // namespace slabwright
