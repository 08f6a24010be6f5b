#include "engine/planner/underside.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "engine/forces/op_forces.h"
#include "engine/layers/both_sides.h"
#include "engine/schedule/dowels.h"
#include "engine/schedule/fit.h"
#include "engine/schedule/heights.h"
#include "engine/schedule/keep_outs.h"
#include "engine/schedule/probes.h"
#include "engine/schedule/schedule.h"
#include "engine/undersides/floors.h"
#include "engine/undersides/loose_pieces.h"
#include "engine/undersides/underside_target.h"

namespace slabwright {

namespace {

constexpr double kWorthMilling = 1;  // mm³
constexpr double kNoMore = 1.01;     // of what stays filled
constexpr double kOverWeb = 1;       // mm that a layer is taller than its web, to be worth turning

std::string volume_words(double mm3) {
    return mm3 < 1000 ? fmt::format("{:.0f} mm³", std::max(1.0, mm3)) : fmt::format("{:.1f} cm³", mm3 / 1000);
}

// The job as it is for one slab that lies upside down on a spoil board, where the base board lies later.
Job underside_job(const Plan& plan, double slab_thickness, const std::array<double, 2>& origin) {
    Job own = plan.job;
    own.machine.keep_outs = keep_outs_below(plan, origin);
    own.allow_undercut = true;
    own.layers.sides = SlabSides::one;
    own.layers.supports = SupportRule::none;
    own.slabs.thicknesses = {slab_thickness};
    own.slabs.facing_allowance = 0;
    own.slabs.blanks = Blanks::pattern;
    own.machine.zero = WorkZero::corner;
    own.machine.handler_speed = 0;
    own.machine.feed_height = 0;
    own.machine.glue_head = GlueHead::none;
    return own;
}

void check_tools(const Plan& plan, const TurnedSlab& slab) {
    const double tallest = max_layer_of_longest(plan.job);
    if (tallest >= slab.slab_thickness) return;
    throw refusal("underside.tall",
                  fmt::format("its slab is {:.2f} mm thick, and the tools make {:.2f} mm from below",
                              slab.slab_thickness, tallest),
                  fmt::format("layer {}", slab.layer),
                  "take thinner slabs or tools with longer flutes, or layers.sides = \"one\"");
}

Plan plan_underside(Context& context, const Plan& plan, MeshView pattern, const Layer& layer, double web,
                    ProgressShare share, const std::array<double, 2>& origin) {
    const TurnedSlab slab = turned_slab(plan, layer, web);
    check_tools(plan, slab);
    const Mesh target = underside_target(context, pattern, slab);
    Plan under;
    under.input = plan.input;
    under.job = underside_job(plan, slab.slab_thickness, origin);
    under.turned = slab;
    under.stock_max = {slab.blank.length(), slab.blank.width()};
    under.features = find_features(context, target.view(), feature_options(under.job)).features;
    Layer& only = under.layers.emplace_back();
    only.index = layer.index;
    only.z_top = only.slab_thickness = slab.slab_thickness;
    only.reason = fmt::format("the underside of layer {}'s slab", layer.index);
    only.dowels = turned_dowels(slab, dowels_under(plan, layer));
    place_keep_outs(under);
    check_probed_place(under);
    const std::vector<std::vector<JointWood>> joints = wood_at_joints(context, target.view(), under);
    const std::vector<std::vector<StandingFoot>> feet = standing_feet(context, under, joints);
    cut_layers(context, under, target.view(), joints, feet, share, {});
    schedule(under);
    check_spindle(under);
    check_mass(under);
    return under;
}

}  // namespace

TurnedSlab turned_slab(const Plan& plan, const Layer& layer, double web) {
    return {layer.index, layer.z_bottom,          layer.z_top, layer.slab_thickness, slab_of(plan, layer),
            web,         underside_room(plan.job)};
}

void check_two_sided(const Job& job, MeshView pattern) {
    const auto refuse = [](const char* what, const char* remedy) {
        throw refusal("layers.sides", fmt::format("slabs milled on both sides cannot yet go with {}", what),
                      "layers.sides", fmt::format("{}, or layers.sides = \"one\"", remedy));
    };
    if (job.flask.enabled) refuse("a flask", "plan without flask");
    if (job.layers.strategy == LayerStrategy::combined)
        refuse("layers.strategy = \"combined\"", "take another strategy");
    for (const Index3& n : pattern.neighbours)
        if (std::find(n.begin(), n.end(), kNoFacet) != n.end())
            throw refusal("underside.open", "the pattern is open at its base, so it has no underside to mill",
                          "layers.sides", "close the pattern, or layers.sides = \"one\"");
}

LayerPlacement place_two_sided(Context& context, const Job& job, const LayerRequest& request,
                               const AirGaps& gaps, const LayerPlacement& from_above) {
    const auto place = [&](double min_layer) {
        LayerRequest asked = request;
        asked.min_layer = std::max(asked.min_layer, min_layer);
        return place_layers_both_sides(asked, gaps, {.filled_gap = job.tolerances.undercut, .step_mm3 = 0});
    };
    const auto left_by = [&](const LayerPlacement& placement, MilledFrom milled) {
        std::vector<double> tops;
        for (const Boundary& b : placement.boundaries) tops.push_back(b.z);
        return unmade_air(context, gaps, tops, milled);
    };
    LayerPlacement both = place(0);
    UnmadeAir left = left_by(both, MilledFrom::both_sides);
    // Layers with room for dowels, where they leave no more.
    LayerPlacement dowelled = place(least_layer_for_dowels(job.dowels));
    if (const UnmadeAir same = left_by(dowelled, MilledFrom::both_sides);
        same.volume_mm3 <= kNoMore * left.volume_mm3 + kWorthMilling) {
        both = std::move(dowelled);
        left = same;
    }
    if (job.layers.sides == SlabSides::two) return both;
    const UnmadeAir above = left_by(from_above, MilledFrom::above);
    const bool enough = above.height_mm <= job.tolerances.undercut || above.volume_mm3 <= left.volume_mm3;
    return enough ? from_above : both;
}

std::vector<MilledLayer> milled_layers(Context& context, const Plan& plan, MeshView pattern,
                                       const AirGaps& gaps) {
    std::vector<MilledLayer> milled;
    for (const Layer& layer : plan.layers) milled.push_back({layer.z_top, MilledFrom::above, 0});
    const std::vector<MilledLayer> from_above = milled;
    const UnmadeAir above = unmade_air(context, gaps, from_above);
    std::vector<double> heights(plan.layers.size(), 0);
    for (const UnmadePocket& p : above.pockets) heights[p.layer] = std::max(heights[p.layer], p.height_mm);
    for (std::size_t i = 0; i < milled.size(); ++i) {
        const Layer& layer = plan.layers[i];
        if (heights[i] <= plan.job.tolerances.undercut || layer.slabs != 1) continue;
        const double height = layer.z_top - layer.z_bottom;
        for (const double web : {film_web(height, layer.slab_thickness), kStripWeb, kWholeWeb}) {
            if (height < web + kOverWeb) break;
            const TurnedSlab slab = turned_slab(plan, layer, web);
            if (underside_region(context, pattern, slab).empty()) break;
            std::vector<MilledLayer> with = from_above;
            with[i] = milled_layer(slab);
            if (above.of_layers[i] - unmade_air(context, gaps, with).of_layers[i] < kWorthMilling) break;
            if (web < kWholeWeb && !hangs_together(context, underside_target(context, pattern, slab), slab))
                continue;
            milled[i] = with[i];
            break;
        }
    }
    return milled;
}

void settle_unmade(Context& context, Plan& plan, const AirGaps& gaps, const std::vector<MilledLayer>& milled,
                   const std::array<double, 2>& origin) {
    const Job& job = plan.job;
    const UnmadeAir left = unmade_air(context, gaps, milled);
    std::vector<UnmadePocket> high;
    for (const UnmadePocket& p : left.pockets)
        if (p.height_mm > job.tolerances.undercut) high.push_back(p);
    if (high.empty()) {
        if (!left.pockets.empty())
            plan.diagnostics.push_back(
                {Severity::note, "undercut.shallow",
                 fmt::format(
                     "{} stay filled between solid and solid of the same layer, at most {:.3f} mm high",
                     volume_words(left.volume_mm3), left.height_mm),
                 left.pockets.front().at});
        return;
    }
    double volume = 0;
    for (const UnmadePocket& p : high) {
        volume += p.volume_mm3;
        plan.diagnostics.push_back(
            {job.allow_undercut ? Severity::warning : Severity::error, "undercut.unmade",
             fmt::format("milled from both sides, {} in layer {} stay filled, up to {:.2f} mm high",
                         volume_words(p.volume_mm3), p.layer + 1, p.height_mm),
             p.at});
    }
    if (job.allow_undercut) return;
    const UnmadePocket& tallest = *std::max_element(
        high.begin(), high.end(),
        [](const UnmadePocket& a, const UnmadePocket& b) { return a.height_mm < b.height_mm; });
    throw refusal(
        "undercut.unmade",
        fmt::format("{} cannot be milled even from both sides; they would stay filled, up to {:.2f} "
                    "mm high",
                    volume_words(volume), tallest.height_mm),
        fmt::format("x {:.2f} y {:.2f} z {:.2f} mm", tallest.at[0] + origin[0], tallest.at[1] + origin[1],
                    tallest.at[2]),
        "turn or split the pattern, or accept it with --allow-undercut");
}

namespace {

/// What is told of the only layer of an underside's plan, but for that it is the first.
std::string_view without_layer(std::string_view message) {
    for (const std::string_view head : {"layer 1, ", "layer 1: "})
        if (message.starts_with(head)) message.remove_prefix(head.size());
    return message;
}

}  // namespace

void plan_undersides(Context& context, Plan& plan, MeshView pattern, const std::vector<MilledLayer>& milled,
                     ProgressShare share, const std::array<double, 2>& origin) {
    std::vector<std::size_t> turned;
    for (std::size_t i = 0; i < milled.size(); ++i)
        if (milled[i].milled == MilledFrom::both_sides) turned.push_back(i);
    for (std::size_t k = 0; k < turned.size(); ++k) {
        const double step = 1.0 / static_cast<double>(turned.size()), at = static_cast<double>(k) * step;
        const Layer& layer = plan.layers[turned[k]];
        try {
            plan.undersides.push_back(plan_underside(context, plan, pattern, layer, milled[turned[k]].web,
                                                     {share.at(at), share.at(at + step)}, origin));
        } catch (const Error& e) {
            // Its place counts on the slab as it lies there.
            if (!e.code().starts_with("keep_out.")) throw;
            throw Error(e.kind(), e.code(),
                        fmt::format("underside of layer {}: {}", layer.index, e.message()), e.place(),
                        e.remedy());
        }
        for (Diagnostic& told : plan.undersides.back().diagnostics) told.where.reset();
        for (const Diagnostic& told : plan.undersides.back().diagnostics)
            if (told.severity != Severity::note)
                plan.diagnostics.push_back(
                    {told.severity,
                     told.code,
                     fmt::format("underside of layer {}: {}", plan.layers[turned[k]].index,
                                 without_layer(told.message)),
                     {}});
    }
}

namespace {

/// How hard a layer's cutters push along their axes at most, N.
double push_of(const Layer& layer, const Job& job) {
    double most = 0;
    for (const Operation& op : layer.operations) {
        const auto tool = std::find_if(job.tools.begin(), job.tools.end(),
                                       [&](const Tool& t) { return t.number == op.tool; });
        if (tool == job.tools.end() || !mills(tool->kind)) continue;
        const CutSegment cut = heaviest_cut(op, *tool, job);
        if (cut.high_mm > 0) most = std::max(most, std::min(op.peak_force_n, peak_force(cut).peak_axial_n));
    }
    return most;
}

}  // namespace

void warn_of_floors(Context& context, Plan& plan, MeshView pattern, const AirGaps& gaps,
                    const std::vector<MilledLayer>& milled) {
    const auto is_turned = [](const MilledLayer& layer) { return layer.milled == MilledFrom::both_sides; };
    if (std::none_of(milled.begin(), milled.end(), is_turned)) return;
    const FloorMap floors(context, pattern, gaps);
    const double strength = plan.job.material.strength_mpa;
    for (std::size_t l = 0; l < milled.size(); ++l) {
        if (!is_turned(milled[l])) continue;
        FloorLoads loads{push_of(plan.layers[l], plan.job), 0};
        if (l + 1 < plan.layers.size() && !plan.layers[l + 1].joints.empty())
            loads.pressure_mpa = plan.layers[l + 1].joints.front().pressure_mpa;
        const auto floor = floors.weakest(context, milled[l], plan.layers[l].z_bottom, loads);
        if (floor && floor->stress_mpa() > strength)
            plan.diagnostics.push_back(weak_floor(plan.layers[l].index, *floor, loads, strength));
    }
}

}  // namespace slabwright
