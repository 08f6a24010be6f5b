#include "engine/forces/op_forces.h"

#include <algorithm>
#include <cmath>

#include "engine/forces/bent_cutter.h"
#include "engine/forces/cuts.h"
#include "engine/forces/feeds.h"
#include "kernels/errors.h"
#include "kernels/forces/deflection.h"

namespace slabwright {

namespace {

/// The fastest feed of a move that travels in the plane; plunges drill, and are slower than they are heavy.
double fastest_feed(const Operation& operation) {
    std::uint32_t feed = 0;
    const Move* from = nullptr;
    for (const Move& to : operation.moves) {
        if (from != nullptr && (from->x != to.x || from->y != to.y)) feed = std::max(feed, to.feed);
        from = &to;
    }
    return feed;
}

}  // namespace

CutSegment heaviest_cut(const Operation& operation, const Tool& tool, const Job& job) {
    if (!mills(tool.kind)) return {};
    CutSegment s = idle_cut(job, tool);
    s.spindle_rpm = operation.spindle_rpm;
    const double feed = fastest_feed(operation);
    if (feed == 0) return s;
    if (!(operation.spindle_rpm > 0))
        throw Error(ErrorKind::usage, "forces.spindle", "an operation mills with its spindle at rest",
                    operation.purpose, "give the tool a speed");
    s.chip_load_mm = feed / (operation.spindle_rpm * tool.flutes);

    const double steps = has_ball_tip(tool.kind) ? job.tolerances.rough_cusp : 0, slot = 2 * s.radius_mm;
    double depth = operation.stepdown, width = operation.stepover;
    switch (operation.kind) {
        case OperationKind::rough:
        case OperationKind::semi_rough:
            width = slot;
            break;
        case OperationKind::face:
            break;
        default:
            if (depth > 0) width = job.cutting.wall_allowance + steps;
            break;
    }
    if (!(depth > 0)) depth = job.cutting.floor_allowance + steps;
    if (!(width > 0)) width = slot;
    s.high_mm = depth;
    s.arc = engagement_arc(radius_at(s, depth), width, MillingSense::up);
    return s;
}

void rate_operation(Operation& operation, const Tool& tool, const Job& job) {
    const CutSegment cut = heaviest_cut(operation, tool, job);
    operation.peak_force_n = operation.deflection_mm = operation.wall_error_mm = 0;
    operation.peak_torque_nmm = operation.peak_power_w = 0;
    operation.peak_at.reset();
    if (cut.high_mm <= 0) return;
    const CutForce force = peak_force(cut);
    operation.peak_force_n = force.peak_resultant_n;
    operation.deflection_mm = tip_bent_by(tool, force.peak_in_plane_n);
    operation.wall_error_mm = operation.deflection_mm;
    operation.peak_torque_nmm = force.torque_nmm;
    operation.peak_power_w = force.power_w;
}

bool slow_down(Operation& operation, const Tool& tool, const Job& job) {
    CutSegment cut = heaviest_cut(operation, tool, job);
    if (cut.high_mm <= 0) return false;
    const double planned = fastest_feed(operation), limit = bending_limit(operation, job);
    const auto holds = [&](double feed) {
        cut.chip_load_mm = feed / (cut.spindle_rpm * tool.flutes);
        const SegmentForces f = stated_forces(cut);
        return share_of_limits(bent_by(f, f.peak_in_plane_n, tool), limit, tool, job) <= 1;
    };
    if (holds(planned)) return false;
    std::uint32_t most = 0;
    for (int k = kFeedSteps - 1; k >= kFeedSteps * kLeastFeedShare && most == 0; --k)
        if (const double feed = std::floor(planned * k / kFeedSteps);
            holds(feed) || k - 1 < kFeedSteps * kLeastFeedShare)
            most = static_cast<std::uint32_t>(std::max(1.0, feed));
    for (Move& move : operation.moves) move.feed = std::min(move.feed, most);
    return true;
}

}  // namespace slabwright
