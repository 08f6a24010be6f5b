// How long a program takes on a machine that cannot change its speed at once.

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/simulate/simulate.h"

namespace slabwright {

double program_seconds(const Program& program, const Machine& machine, double corner) {
    struct Piece {
        double length, speed;  // mm, mm/s
        Point3 direction;
        double entry = 0;  // highest speed at its start, mm/s
    };
    std::vector<Piece> pieces;
    const double a = machine.acceleration;
    for (std::size_t i = 1; i < program.steps.size(); ++i) {
        const ProgramStep &from = program.steps[i - 1], &to = program.steps[i];
        Point3 d{to.x - from.x, to.y - from.y, to.z - from.z};
        for (double& v : d)
            if (!std::isfinite(v)) v = 0;  // from an unknown place: what it takes cannot be known
        const double length = std::hypot(d[0], d[1], d[2]);
        if (length <= 0) continue;
        for (double& v : d) v /= length;
        const double speed = (to.rapid() ? machine.rapid_feed : std::min(to.feed, machine.max_feed)) / 60;
        Piece piece{length, speed, d};
        if (!pieces.empty()) {
            const Piece& before = pieces.back();
            // The corner of angle θ between the ways (0 straight on): an arc that leaves it by `corner` has the radius
            // corner·c/(1 − c) with c = cos(θ/2), and bears the speed √(a·radius).
            const double cosine = std::clamp(before.direction[0] * d[0] + before.direction[1] * d[1] + before.direction[2] * d[2], -1.0, 1.0);
            const double half = std::sqrt((1 + cosine) / 2);
            const double through = half >= 1 - 1e-12 ? 1e9 : std::sqrt(a * corner * half / (1 - half));
            piece.entry = std::min({through, before.speed, speed});
        }
        pieces.push_back(piece);
    }
    // Backwards: nobody may enter a piece faster than he can leave it. Forwards: nor faster than he can have become.
    double next = 0;
    for (std::size_t i = pieces.size(); i-- > 0;) {
        pieces[i].entry = std::min(pieces[i].entry, std::sqrt(next * next + 2 * a * pieces[i].length));
        next = pieces[i].entry;
    }
    double seconds = program.dwell_s + machine.tool_change_s, v = 0;
    for (std::size_t i = 0; i < pieces.size(); ++i) {
        const Piece& p = pieces[i];
        double out = i + 1 < pieces.size() ? pieces[i + 1].entry : 0;
        out = std::min(out, std::sqrt(v * v + 2 * a * p.length));
        const double peak = std::min(p.speed, std::sqrt((2 * a * p.length + v * v + out * out) / 2));
        const double ramps = (2 * peak * peak - v * v - out * out) / (2 * a);
        seconds += (2 * peak - v - out) / a + std::max(0.0, p.length - ramps) / std::max(peak, 1e-9);
        v = out;
    }
    return seconds;
}

}  // namespace slabwright
