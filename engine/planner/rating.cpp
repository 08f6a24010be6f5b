#include "engine/planner/rating.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "engine/forces/cut_class.h"
#include "engine/forces/feeds.h"
#include "engine/forces/op_forces.h"
#include "engine/moves/motion_time.h"
#include "engine/schedule/fit.h"

namespace slabwright {

namespace {

// No motion asks an axis for more than it can do: where the machine slows down by itself, nobody has planned
// for it.
void limit_to_axes(Operation& op, const Machine& machine) {
    const AxisLimits limits = axis_limits(machine);
    const double least = *std::min_element(limits.speed.begin(), limits.speed.end());
    if (least * 60 >= machine.max_feed) return;
    const double level = std::min(limits.speed[0], limits.speed[1]);
    for (std::size_t i = 1; i < op.moves.size(); ++i) {
        Move& move = op.moves[i];
        if (move.feed == 0) continue;
        const MotionLeg leg = straight_leg(place_of(op.moves[i - 1]), place_of(move), move.feed, machine);
        if (leg.length <= 0) continue;
        const double most = move.is_arc() ? level : along_axes(limits.speed, leg.direction);
        if (move.feed > most * 60)
            move.feed = static_cast<std::uint32_t>(std::max(1.0, std::floor(most * 60)));
    }
}

}  // namespace

void rate(const Job& job, const Layer& layer, Operation& op, std::vector<Diagnostic>& diagnostics) {
    limit_to_axes(op, job.machine);
    const MotionTime time = motion_time(op.moves, job.machine, op.blend);
    op.cutting_mm = time.cutting_mm;
    op.rapid_mm = time.rapid_mm;
    op.minutes = time.minutes + job.machine.spindle_dwell_s / 60;
    if (job.cutting.engagement == Engagement::simulated) return;
    const auto tool =
        std::find_if(job.tools.begin(), job.tools.end(), [&](const Tool& t) { return t.number == op.tool; });
    rate_operation(op, *tool, job);
    const double allowance = bending_limit(op, job);
    if (const bool rough = op.kind == OperationKind::rough;
        op.deflection_mm > (1 + kFineRounding) * allowance)
        diagnostics.push_back(
            {Severity::warning,
             rough ? "rough.deflection" : "cut.deflection",
             fmt::format("layer {}, {}: the cutter T{} may bend by {:.3f} mm, more than the "
                         "{:.3f} mm {}; use a shorter, thicker or stiffer tool or a smaller stepdown",
                         layer.index, op.purpose, op.tool, op.deflection_mm, allowance,
                         rough ? "it leaves for finishing" : "allowed"),
             {}});
}

void add_approaches(Plan& plan, const std::vector<bool>& rated) {
    const Move* end = nullptr;
    for (std::size_t l = 0; l < plan.layers.size(); ++l)
        for (Operation& op : plan.layers[l].operations) {
            if (op.moves.empty()) continue;
            if (end && (rated.empty() || rated[l]))
                op.minutes +=
                    approach_seconds(place_of(*end), place_of(op.moves.front()), plan.job.machine) / 60;
            end = &op.moves.back();
        }
}

void settle_joints(Plan& plan, const std::vector<std::vector<WeakJoint>>& found,
                   const std::array<double, 2>& origin) {
    for (const std::vector<WeakJoint>& of_layer : found)
        for (const WeakJoint& weak : of_layer) {
            if (weak.refused && !plan.job.bonding.accept_weak)
                throw refusal(weak.code.c_str(), weak.message,
                              fmt::format("x {:.2f} y {:.2f} z {:.2f} mm", weak.where[0] + origin[0],
                                          weak.where[1] + origin[1], weak.where[2]),
                              weak.remedy + ", or accept it with --accept-weak-joints");
            Diagnostic told{Severity::warning, weak.code, weak.message, weak.where};
            if (std::find(plan.diagnostics.begin(), plan.diagnostics.end(), told) == plan.diagnostics.end())
                plan.diagnostics.push_back(std::move(told));
        }
}

}  // namespace slabwright
