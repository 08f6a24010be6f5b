#include "engine/planner/replan.h"

#include <algorithm>

#include <fmt/format.h>

#include "engine/forces/feeds.h"
#include "engine/forces/min_material.h"
#include "engine/mend/mend_layer.h"
#include "engine/planner/rating.h"
#include "engine/schedule/fit.h"
#include "engine/schedule/heights.h"
#include "engine/schedule/joints.h"
#include "engine/schedule/keep_outs.h"
#include "engine/schedule/schedule.h"
#include "engine/schedule/standing_walls.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

// What was said of a layer's forces, which are found anew: by the code's family and the layer's number.
bool tells_forces(const Diagnostic& d, int layer) {
    return (d.code.starts_with("cut.") && d.message.starts_with(fmt::format("layer {}, ", layer))) ||
           (d.code == "wall.weak" && d.message.starts_with(fmt::format("layer {}:", layer)));
}

// Forces of a mended layer, and feeds where they are too high; none is made faster again.
// @param carried_by what stays of the slab below; null: the board
// @param feet       of thin walls that stand in the layer
std::vector<Diagnostic> load(Context& context, const Plan& plan, Layer& layer, const Loops* carried_by,
                             std::span<const StandingFoot> feet) {
    std::vector<Diagnostic> found;
    Plan alone;
    alone.job = plan.job;
    alone.stock_min = plan.stock_min, alone.stock_max = plan.stock_max;
    std::optional<OverhangMap> overhang;
    const Blank slab = slab_of(plan, layer);
    if (carried_by != nullptr) overhang = overhang_map({&carried_by, 1}, slab.min, slab.max);
    alone.layers.push_back(std::move(layer));
    const WallMap walls(feet, plan.job.material.strength_mpa, widest_beside_walls(plan.job),
                        plan.job.cutting.wall_allowance);
    const LayerCuts cuts = adapt_layer(context, alone.layers[0], alone,
                                       {overhang ? &*overhang : nullptr, feet.empty() ? nullptr : &walls},
                                       found, nullptr, FeedChange::lower);
    const std::vector<std::vector<Diagnostic>> rated = rate_layers(context, alone, {&cuts, 1}, nullptr);
    layer = std::move(alone.layers[0]);
    found.insert(found.end(), rated[0].begin(), rated[0].end());
    std::erase_if(found, [&](const Diagnostic& d) { return !tells_forces(d, layer.index); });
    return found;
}

}  // namespace

Replanner::Replanner(Context& context, MeshView pattern, const StandingPart& part)
    : context_(context), pattern_(pattern), part_(part) {}
Replanner::~Replanner() = default;

std::vector<bool> Replanner::mend(Plan& plan, std::span<const LayerFaults> faults, int round) {
    const Job& job = plan.job;
    if (!joints_) {
        joints_ = wood_at_joints(context_, pattern_, plan);
        feet_ = standing_feet(context_, plan, *joints_);
    }
    std::vector<MendedLayer> mended(faults.size());
    std::vector<std::vector<Diagnostic>> told(faults.size());
    parallel_each(context_, faults.size(), [&](std::size_t k) {
        const std::size_t l = faults[k].layer;
        const Layer& layer = plan.layers[l];
        mended[k] = mend_layer(context_, job, part_, layer, faults[k], round);
        told[k].push_back({Severity::note,
                           "proof.round",
                           fmt::format("layer {}, round {}: {}: {}", layer.index, round, faults[k].found,
                                       mended[k].changed ? mended[k].done : "nothing helps"),
                           {}});
        if (!mended[k].changed || job.cutting.engagement != Engagement::simulated) return;
        const std::vector<Diagnostic> found =
            load(context_, plan, mended[k].layer, l > 0 ? &(*joints_)[l].front().below : nullptr, feet_[l]);
        told[k].insert(told[k].end(), found.begin(), found.end());
    });
    // A layer after a mended one begins elsewhere, so its first program takes another time.
    std::vector<bool> other(plan.layers.size());
    for (std::size_t k = 0; k < faults.size(); ++k) {
        const std::size_t l = faults[k].layer;
        if (mended[k].changed) {
            std::erase_if(plan.diagnostics,
                          [&](const Diagnostic& d) { return tells_forces(d, plan.layers[l].index); });
            plan.layers[l] = std::move(mended[k].layer);
            ++plan.layers[l].rounds;
            other[l] = true;
            if (l + 1 < other.size()) other[l + 1] = true;
        }
        plan.diagnostics.insert(plan.diagnostics.end(), told[k].begin(), told[k].end());
    }
    if (std::none_of(other.begin(), other.end(), [](bool b) { return b; })) return {};
    keep_clear(plan, {}, other);
    std::vector<std::vector<WeakJoint>> weak(plan.layers.size());
    for (std::size_t l = 0; l < plan.layers.size(); ++l) {
        if (!other[l]) continue;
        for (Operation& op : plan.layers[l].operations) rate(job, plan.layers[l], op, plan.diagnostics);
        weak[l] = joints_under_load(plan.layers[l], (*joints_)[l], plan);
    }
    add_approaches(plan, other);
    settle_joints(plan, weak);
    if (std::all_of(plan.layers.begin(), plan.layers.end(),
                    [](const Layer& layer) { return layer.operations.empty(); }))
        throw refusal("plan.empty", "nothing would be cut", plan.input.file, "check the units and the slabs");
    check_travel(plan);
    schedule(plan);
    check_spindle(plan);
    check_mass(plan);
    return other;
}

}  // namespace slabwright
