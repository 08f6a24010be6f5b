#include "engine/planner/planner.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <optional>

#include <fmt/format.h>

#include "engine/flask/flask.h"
#include "engine/forces/min_material.h"
#include "engine/layers/candidates.h"
#include "engine/layers/layers.h"
#include "engine/planner/cut_layers.h"
#include "engine/planner/local_frame.h"
#include "engine/planner/rating.h"
#include "engine/planner/underside.h"
#include "engine/prepare/drilled_holes.h"
#include "engine/schedule/blanks.h"
#include "engine/schedule/cut_list.h"
#include "engine/schedule/dowels.h"
#include "engine/schedule/fit.h"
#include "engine/schedule/heights.h"
#include "engine/schedule/joints.h"
#include "engine/schedule/keep_outs.h"
#include "engine/schedule/probes.h"
#include "engine/schedule/schedule.h"
#include "engine/schedule/standing_walls.h"
#include "engine/schedule/supports.h"
#include "kernels/errors.h"
#include "kernels/features/filled_columns.h"
#include "kernels/features/section_areas.h"
#include "kernels/features/unmade_air.h"
#include "kernels/parallel/parallel.h"
#include "kernels/slicing/slicing.h"

namespace slabwright {

namespace {

constexpr double kTopShare = 0.6;  // of the planning of a build whose slabs are milled on both sides

// How many slabs of the stock make a layer's thickness; one where it is in stock, or no stock is named.
int slabs_of(const Job& job, double thickness) {
    double thickest = 0;
    for (const double t : job.slabs.thicknesses) thickest = std::max(thickest, t);
    return thickest > 0 ? std::max(1, static_cast<int>(std::lround(thickness / thickest))) : 1;
}

// Says where a boundary leaves more of a slab unsupported than any layer's thickness can bear.
void warn_of_overhang(Plan& plan, const LayerRequest& request, const std::vector<Boundary>& boundaries) {
    if (!request.min_material_at) return;
    double most = 0, where = 0;
    for (std::size_t i = 0; i + 1 < boundaries.size(); ++i)
        if (const double z = boundaries[i].z, least = request.min_material_at(z); least > most)
            most = least, where = z;
    if (most > request.max_layer)
        plan.diagnostics.push_back({Severity::warning,
                                    "layers.overhang",
                                    fmt::format("the slab glued at {:.2f} mm hangs over so far that {:.1f} "
                                                "mm of it would be needed to bear the cutters, more than the "
                                                "tallest layer's {:.1f} mm; a flask would carry it",
                                                where, most, request.max_layer),
                                    {}});
}

std::vector<Layer> layers_between(const Job& job, const std::vector<Boundary>& boundaries) {
    std::vector<Layer> layers;
    double bottom = 0;
    for (const Boundary& b : boundaries) {
        Layer& layer = layers.emplace_back();
        layer.index = static_cast<int>(layers.size());
        layer.z_bottom = bottom;
        layer.z_top = bottom = b.z;
        layer.slab_thickness = b.slab_thickness;
        layer.slabs = slabs_of(job, b.slab_thickness);
        layer.reason = b.reason;
    }
    return layers;
}

// 1 cm³ is a cube as large as a thumbnail: less is told in mm³.
std::string volume_words(double mm3) {
    return mm3 < 1000 ? fmt::format("{:.0f} mm³", std::max(1.0, mm3)) : fmt::format("{:.1f} cm³", mm3 / 1000);
}

// @param origin of the frame that the place is told in (local_frame.h)
std::string place_text(const std::array<double, 2>& origin, double x, double y, double z) {
    return fmt::format("x {:.2f} y {:.2f} z {:.2f} mm", x + origin[0], y + origin[1], z);
}

// Says which undercuts stay filled with these layers, and refuses those that the job does not accept.
void settle_undercuts(Context& context, Plan& plan, MeshView mesh, const std::array<double, 2>& origin) {
    const Job& job = plan.job;
    std::vector<double> tops;
    for (const Layer& layer : plan.layers) tops.push_back(layer.z_top);
    const std::vector<UnmadeUndercut> unmade = measure_undercuts(context, mesh, tops, feature_options(job));
    if (unmade.empty()) return;
    // The thickest comes first; the tallest is what a pattern maker would measure.
    const UnmadeUndercut& tallest = *std::max_element(
        unmade.begin(), unmade.end(),
        [](const UnmadeUndercut& a, const UnmadeUndercut& b) { return a.height_mm < b.height_mm; });
    double area = 0, volume = 0;
    std::size_t count = 0;
    for (const UnmadeUndercut& u : unmade) {
        area += u.area_mm2;
        volume += u.volume_mm3;
        if (u.thickness_mm > job.tolerances.undercut) ++count;
    }
    if (count == 0) {
        plan.diagnostics.push_back(
            {Severity::note, "undercut.shallow",
             fmt::format("{} undercut patch{} of {:.1f} mm² stay{} filled, at most {:.3f} mm thick",
                         unmade.size(), unmade.size() == 1 ? "" : "es", area, unmade.size() == 1 ? "s" : "",
                         unmade.front().thickness_mm),
             std::array{unmade.front().x, unmade.front().y, unmade.front().z}});
        return;
    }
    for (const UnmadeUndercut& u : unmade)
        if (u.thickness_mm > job.tolerances.undercut)
            plan.diagnostics.push_back(
                {job.allow_undercut ? Severity::warning : Severity::error, "undercut.unmade",
                 fmt::format("under an overhang of {:.1f} mm² {} stay filled, up to {:.2f} mm high",
                             u.area_mm2, volume_words(u.volume_mm3), u.height_mm),
                 std::array{u.x, u.y, u.z}});
    if (!job.allow_undercut)
        throw refusal("undercut.unmade",
                      fmt::format("{} undercut{} cannot be milled from above; {} would stay filled, up to "
                                  "{:.2f} mm high",
                                  count, count == 1 ? "" : "s", volume_words(volume), tallest.height_mm),
                      place_text(origin, tallest.x, tallest.y, tallest.z),
                      "turn or split the pattern, or accept it with --allow-undercut");
}

// Glue and press of every joint.
void bond_layers(Context& context, Plan& plan, const std::vector<std::vector<JointWood>>& joints,
                 const std::array<double, 2>& origin) {
    std::vector<std::vector<WeakJoint>> weak(plan.layers.size());
    std::vector<std::vector<Diagnostic>> notes(plan.layers.size());
    parallel_each(context, plan.layers.size(),
                  [&](std::size_t i) { weak[i] = bond_layer(plan.layers[i], joints[i], plan, notes[i]); });
    for (const std::vector<Diagnostic>& found : notes)
        plan.diagnostics.insert(plan.diagnostics.end(), found.begin(), found.end());
    settle_joints(plan, weak, origin);
    settle_joints(plan, slabs_that_tip(plan, joints, plan.diagnostics), origin);
}

// Whether the joints bear the programs' forces.
void load_joints(Context& context, Plan& plan, const std::vector<std::vector<JointWood>>& joints,
                 const std::array<double, 2>& origin) {
    std::vector<std::vector<WeakJoint>> weak(plan.layers.size());
    parallel_each(context, plan.layers.size(),
                  [&](std::size_t i) { weak[i] = joints_under_load(plan.layers[i], joints[i], plan); });
    settle_joints(plan, weak, origin);
}

// Places supports where joints cannot hold, until they do or no more can be done.
// @param joints of the pattern; with its supports when it returns
// @return the pattern with them; none where it needs none
std::optional<Mesh> prop(Context& context, Plan& plan, MeshView pattern,
                         std::vector<std::vector<JointWood>>& joints) {
    std::optional<Mesh> propped;
    constexpr int kRounds = 3;
    for (int round = 0; round < kRounds && plan.job.layers.supports == SupportRule::automatic; ++round) {
        const std::vector<Support> more = place_supports(plan, joints);
        if (more.empty()) break;
        plan.supports.insert(plan.supports.end(), more.begin(), more.end());
        propped = with_supports(context, pattern, plan.supports);
        saw_blanks(context, propped->view(), plan);
        joints = wood_at_joints(context, propped->view(), plan);
    }
    for (const Support& s : plan.supports)
        plan.diagnostics.push_back(
            {Severity::warning, "support.stands",
             fmt::format(
                 "layer {}: a column of stock, {:.1f} x {:.1f} mm, stands under it from {:.2f} to {:.2f} "
                 "mm; saw it off when the pattern is done",
                 s.layer, s.width, s.width, s.z_low,
                 plan.layers[static_cast<std::size_t>(s.layer - 1)].z_bottom),
             std::array<double, 3>{s.x, s.y, s.z_low}});
    return propped;
}

// From layers on. `begun` is a plan with its stock and features.
// @param gaps of a pattern whose slabs may be milled on both sides; null: from above
Plan plan_layers(Context& context, MeshView pattern, const Plan& begun, const LayerRequest& request,
                 const LayerPlacement& placement, ProgressShare share, const std::array<double, 2>& origin,
                 const AirGaps* gaps = nullptr) {
    Plan plan = begun;
    plan.diagnostics.insert(plan.diagnostics.end(), placement.diagnostics.begin(),
                            placement.diagnostics.end());
    warn_of_overhang(plan, request, placement.boundaries);
    plan.layers = layers_between(plan.job, placement.boundaries);
    std::vector<MilledLayer> milled;
    if (gaps == nullptr) settle_undercuts(context, plan, pattern, origin);
    if (plan.job.flask.enabled) plan.flask = place_flask(context, pattern, plan);
    saw_blanks(context, pattern, plan);
    if (gaps != nullptr) {
        milled = milled_layers(context, plan, pattern, *gaps);
        settle_unmade(context, plan, *gaps, milled, origin);
    }
    check_chambers(plan);
    std::vector<std::vector<JointWood>> joints = wood_at_joints(context, pattern, plan);
    const std::optional<Mesh> propped = prop(context, plan, pattern, joints);
    place_dowels(context, pattern, plan);
    if (propped) pattern = propped->view();
    place_keep_outs(plan, origin);
    check_probed_place(plan, origin);
    check_boards(plan);
    bond_layers(context, plan, joints, origin);
    const std::vector<std::vector<StandingFoot>> feet = standing_feet(context, plan, joints);
    const double cut = gaps == nullptr ? 1 : kTopShare;
    cut_layers(context, plan, pattern, joints, feet, {share.from, share.at(cut)}, origin);
    if (gaps != nullptr) {
        warn_of_floors(context, plan, pattern, *gaps, milled);
        plan_undersides(context, plan, pattern, milled, {share.at(cut), share.to}, origin);
    }

    context.begin_phase("schedule", share.at(0.99), share.at(1));
    load_joints(context, plan, joints, origin);
    if (plan.job.cutting.engagement == Engagement::nominal)
        for (Diagnostic& weak : weak_walls(plan, feet)) plan.diagnostics.push_back(std::move(weak));
    context.throw_if_cancelled();
    schedule(plan);
    check_spindle(plan);
    check_mass(plan);
    return plan;
}

// Every placement planned whole; the one that is built in the least time stays.
Plan fastest_plan(Context& context, MeshView pattern, const Plan& begun, const LayerRequest& request,
                  const std::vector<LayerCandidate>& tried, ProgressShare share,
                  const std::array<double, 2>& origin) {
    std::optional<Plan> best;
    std::exception_ptr refused;  // the first
    std::string words;
    std::string name;
    for (std::size_t i = 0; i < tried.size(); ++i) {
        const double step = 1.0 / static_cast<double>(tried.size()), at = static_cast<double>(i) * step;
        LayerRequest asked = request;
        asked.max_layer = tried[i].max_layer;
        try {
            Plan plan = plan_layers(context, pattern, begun, asked, tried[i].placement,
                                    {share.at(at), share.at(at + step)}, origin);
            words += fmt::format("{}{} {:.1f} min", words.empty() ? "" : ", ", tried[i].name,
                                 plan.totals.build_minutes);
            if (!best || plan.totals.build_minutes < best->totals.build_minutes)
                best = std::move(plan), name = tried[i].name;
        } catch (const Error& e) {
            if (e.kind() != ErrorKind::no_plan || e.code().starts_with("memory")) throw;
            words += fmt::format("{}{} refused ({})", words.empty() ? "" : ", ", tried[i].name, e.code());
            if (!refused) refused = std::current_exception();
        }
    }
    if (!best) std::rethrow_exception(refused);
    best->diagnostics.push_back({Severity::note,
                                 "layers.combined",
                                 fmt::format("of {} placement{} {} is built fastest: {}", tried.size(),
                                             tried.size() == 1 ? "" : "s", name, words),
                                 {}});
    return std::move(*best);
}

// @param view     in the frame that counts from `origin`; so is what is returned
// @param plan     knows its input and its job
Plan plan_from(Context& context, MeshView view, Plan plan, const std::array<double, 2>& origin) {
    const Job& job = plan.job;
    if (job.layers.sides != SlabSides::one) check_two_sided(job, view);
    const Box3 box = bounds(context, view);
    const double height = box.max.z;
    place_stock(plan, box);
    context.begin_phase("features", 0.01, 0.015);
    const FeatureOptions options = feature_options(job);
    FeatureSet found = find_features(context, view, options);
    plan.features = std::move(found.features);
    for (const FinderDisagreement& d : found.disagreements)
        plan.diagnostics.push_back(
            {Severity::note, "features.finders_disagree",
             fmt::format("only the {} finder sees a {} at {:.3f} mm", name(d.found_by), name(d.type), d.z),
             std::array{d.x, d.y, d.z}});

    context.begin_phase("layers", 0.015, 0.02);
    LayerRequest request;
    request.height = height;
    request.max_layer = max_layer_thickness(job);
    request.min_layer = job.layers.min_layer;
    request.min_material = job.material.min_thickness;
    if (job.material.min_thickness == 0) request.min_material_at = min_material(context, view, plan);
    request.alpha = job.layers.alpha;
    request.beta = job.layers.beta;
    request.slab_thicknesses = job.slabs.thicknesses;
    request.facing_allowance = job.slabs.facing_allowance;
    request.saddles_constrain = job.layers.saddles_constrain;
    request.filled_underside = job.tolerances.undercut;
    request.features = plan.features;
    request.section_area = SectionAreas(context, view);
    if (job.layers.strategy == LayerStrategy::combined) {
        const std::vector<LayerCandidate> tried = layer_candidates(context, view, job, request);
        request.section_area = {};  // nobody asks again, and it is large
        return fastest_plan(context, view, plan, request, tried, {0.02, 0.985}, origin);
    }
    LayerPlacement placement = place_layers(job.layers.strategy, request);
    if (job.layers.sides == SlabSides::one) {
        request.section_area = {};
        return plan_layers(context, view, plan, request, placement, {0.02, 0.985}, origin);
    }
    const AirGaps gaps = air_gaps(context, view, filled_cell(view));
    placement = place_two_sided(context, job, request, gaps, placement);
    request.section_area = {};
    return plan_layers(context, view, plan, request, placement, {0.02, 0.985}, origin, &gaps);
}

// Where feeds and speeds come from, tool by tool; nothing where the job asks for no cutting data.
void note_cutting_data(Plan& plan) {
    const Job& job = plan.job;
    if (job.material.cutting.empty() && job.material.chart == CuttingChart::none) return;
    std::vector<int> without;
    for (const Tool& tool : job.tools) {
        const CuttingData* const data = cutting_data_of(job.material, tool);
        if (data == nullptr) {
            without.push_back(tool.number);
            continue;
        }
        plan.diagnostics.push_back(
            {Severity::note,
             "feeds.cutting_data",
             fmt::format("tool {}: at most {:.0f} turns and {:.0f} mm a minute, by {:.4g} mm a tooth ({})",
                         tool.number, std::min(tool.max_rpm, job.machine.max_rpm),
                         std::min(tool.max_feed, job.machine.max_feed), data->chip_load, data->source),
             {}});
    }
    if (without.empty()) return;
    plan.diagnostics.push_back(
        {Severity::note,
         "feeds.no_source",
         fmt::format("tool{} {}: no cutting data is stated for such tools in {}, their own max_rpm and "
                     "max_feed stand",
                     without.size() == 1 ? "" : "s", fmt::join(without, ", "), job.material.name),
         {}});
}

}  // namespace

Plan make_plan(Context& context, const Mesh& mesh, const InputInfo& input, const Job& asked) {
    validate(asked);
    check_probing(asked);
    const Job job = with_cutting_data(asked);
    Plan plan;
    plan.input = input;
    plan.totals.part_volume_mm3 = input.volume_mm3;
    plan.job = job;
    note_cutting_data(plan);
    if (mesh.facets.empty())
        throw refusal("input.empty", "there is nothing to make: the mesh has no facets", input.file,
                      "export the pattern again");
    const MemoryCharge mesh_memory(
        context, mesh.vertices.size() * 2 * sizeof(Vec3f) + mesh.facets.size() * 2 * sizeof(Index3),
        "the mesh");
    const std::array<double, 2> origin = local_origin(bounds(context, mesh.view()));
    const std::optional<Mesh> rounded = rounded_for_drills(
        context, mesh.view(), drill_rule(job.tools, job.tolerances.gouge), &plan.diagnostics);
    // What is told so far counts from the mesh's own origin.
    for (Diagnostic& told : plan.diagnostics)
        for (std::size_t k = 0; told.where && k < 2; ++k) (*told.where)[k] -= origin[k];
    MeshView view = rounded ? rounded->view() : mesh.view();
    const BulkVector<Vec3f> vertices = in_local_frame(context, view, origin);
    view.vertices = vertices;
    plan = plan_from(context, view, std::move(plan), origin);
    leave_local_frame(plan, origin);
    return plan;
}

}  // namespace slabwright
