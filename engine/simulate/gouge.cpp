#include "engine/simulate/gouge.h"

#include <algorithm>
#include <cmath>

#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

GougeReport join(GougeReport a, const GougeReport& b) {
    auto deeper = [](GougePlace& x, const GougePlace& y) {
        if (y.depth > x.depth) x = y;  // of equals the first, in the order of the program
    };
    deeper(a.cutter, b.cutter);
    deeper(a.shank, b.shank);
    deeper(a.holder, b.holder);
    a.gouges += b.gouges;
    a.contacts += b.contacts;
    a.motions += b.motions;
    a.length_mm += b.length_mm;
    return a;
}

}  // namespace

GougeReport check_gouge(Context& context, const StandingPart& part, double z_top, const Tool& tool, const Program& program,
                        const GougeOptions& options) {
    const std::size_t n = program.steps.size();
    if (n < 2) return {};
    const double radius = tool.diameter / 2, shank = tool.shank_diameter / 2, nose = tool.holder_diameter / 2;
    return parallel_reduce(
        context, n - 1, 512, GougeReport{},
        [&](std::size_t begin, std::size_t end) {
            GougeReport r;
            StandingPart::Column last;
            // Once a chunk has a depth, only deeper ones can change its maximum; but every gouge is to be counted, so what is
            // beyond the tolerance is always looked for.
            auto floor = [&](const GougePlace& place) { return std::max(options.ignore, std::min(place.depth, options.tolerance)); };
            auto keep = [](GougePlace& place, const Penetration& p, std::uint32_t line) {
                if (p.found && p.depth > place.depth) place = {p.depth, line, p.tip};
            };
            for (std::size_t i = begin; i < end; ++i) {
                const ProgramStep &from = program.steps[i], &to = program.steps[i + 1];
                if (!from.known() || !to.known()) continue;
                const Point3 a{from.x, from.y, from.z}, b{to.x, to.y, to.z};
                ++r.motions;
                r.length_mm += std::sqrt((b[0] - a[0]) * (b[0] - a[0]) + (b[1] - a[1]) * (b[1] - a[1]) + (b[2] - a[2]) * (b[2] - a[2]));
                if (std::min(a[2], b[2]) >= z_top) continue;
                const Penetration p = tool.kind == ToolKind::ball ? part.ball(z_top, a, b, radius, floor(r.cutter), &last)
                                                                  : part.cylinder(z_top, a, b, radius, floor(r.cutter), &last);
                keep(r.cutter, p, to.line);
                r.gouges += p.found && p.depth > options.tolerance;
                bool touched = false;
                auto follow = [&](GougePlace& place, double thick, double above) {
                    if (thick <= 0 || std::min(a[2], b[2]) + above >= z_top) return;
                    const Penetration q = part.cylinder(z_top, {a[0], a[1], a[2] + above}, {b[0], b[1], b[2] + above}, thick, floor(place));
                    keep(place, q, to.line);
                    touched = touched || (q.found && q.depth > options.tolerance);
                };
                if (shank > radius) follow(r.shank, shank, tool.flute_length);
                if (nose > radius) follow(r.holder, nose, tool.stickout);
                r.contacts += touched;
            }
            return r;
        },
        join);
}

}  // namespace slabwright
