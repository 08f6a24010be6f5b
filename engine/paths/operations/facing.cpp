// Face milling: from the bonded slab down to the layer's top, in rectangles from outside in, clockwise, so
// that the cutter always climbs and never lifts an edge that hangs over.
#include "engine/paths/operations/facing.h"

#include <algorithm>
#include <cmath>

#include "engine/paths/runs/layer_cut.h"

namespace slabwright {

double face_step(const Job& job, const Tool& face) {
    return face.stepdown_max > 0 ? std::min(job.cutting.face_depth, face.stepdown_max)
                                 : job.cutting.face_depth;
}

Operation face_layer(const LayerCut& cut) {
    const Tool& tool = tool_of_kind(cut.job, ToolKind::face);
    Operation op = cut.operation(OperationKind::face, "face to the layer's top", tool);
    const double depth = cut.stock_top - cut.layer.z_top;
    if (to_units(depth) <= 0) return op;  // no more than the text says
    const int steps = std::max(1, static_cast<int>(std::ceil(depth / face_step(cut.job, tool) - 1e-9)));
    const double r = tool.diameter / 2, stepover = tool.stepover * tool.diameter;
    op.stepdown = depth / steps;
    op.stepover = stepover;
    const double clearance = cut.stock_top + cut.job.machine.clearance;
    PathBuilder path(op, tool, std::min(tool.max_feed, cut.job.machine.max_feed), clearance,
                     cut.stock_top + 2);
    const auto &lo = cut.layer.stock_min, &hi = cut.layer.stock_max;
    // Where the machine's travel does not let it go down beside the stock, it goes down on a ramp.
    const bool beside = cut.low(1, r + 2) <= lo[1] - r;
    Standing standing(lo, hi, cut.stock_top);
    if (!beside) {
        Surroundings around{&standing, nullptr, flat_cutter(r)};
        around.ramp_deg = cut.job.cutting.ramp_deg;
        path.set_surroundings(around);
    }
    for (int step = 1; step <= steps; ++step) {
        const std::int32_t z = to_units(step == steps ? cut.layer.z_top : cut.stock_top - op.stepdown * step);
        double inset = stepover - r;  // of the cutter's centre from the stock's edge
        const double x0 = std::max(lo[0] + inset, cut.low(0, r)), y_out = cut.low(1, r + 2);
        const PathPoint begin{to_units(std::min(x0, hi[0])), to_units(y_out), z};
        if (!beside) {
            const std::int32_t north = to_units(std::min(hi[1] - inset, cut.high(1, r)));
            path.follow(std::array<PathPoint, 2>{begin, PathPoint{begin.x, std::max(begin.y, north), z}});
        }
        if (beside || path.z() != z) path.go_above({begin.x, begin.y}), path.sink(z);
        for (;; inset += stepover) {
            const double w = hi[0] - lo[0] - 2 * inset, d = hi[1] - lo[1] - 2 * inset;
            const double left = std::max(lo[0] + inset, cut.low(0, r)),
                         right = std::min(hi[0] - inset, cut.high(0, r));
            const double south = std::max(lo[1] + inset, cut.low(1, r)),
                         north = std::min(hi[1] - inset, cut.high(1, r));
            if (w <= 0 || d <= 0) {  // what is left is narrower than two step-overs: along its middle, if
                                     // only to its centre
                const double cx = 0.5 * (lo[0] + hi[0]), cy = 0.5 * (lo[1] + hi[1]);
                if (w > d) {
                    path.cut({to_units(std::min(left, cx)), to_units(cy)}, z);
                    path.cut({to_units(std::max(right, cx)), to_units(cy)}, z);
                } else {
                    path.cut({to_units(cx), to_units(std::min(south, cy))}, z);
                    path.cut({to_units(cx), to_units(std::max(north, cy))}, z);
                }
                break;
            }
            path.cut({to_units(left), to_units(south)}, z);
            path.cut({to_units(left), to_units(north)}, z);
            path.cut({to_units(right), to_units(north)}, z);
            path.cut({to_units(right), to_units(south)}, z);
            path.cut({to_units(left), to_units(south)}, z);
            if (std::min(w, d) <= 2 * r) break;  // the ring has reached the middle
        }
        path.retract();
    }
    path.finish();
    return op;
}

}  // namespace slabwright
