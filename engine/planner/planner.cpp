#include "engine/planner/planner.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <numeric>
#include <optional>

#include <fmt/format.h>

#include "engine/flask/flask.h"
#include "engine/forces/feeds.h"
#include "engine/forces/min_material.h"
#include "engine/forces/op_forces.h"
#include "engine/layers/candidates.h"
#include "engine/layers/layers.h"
#include "engine/moves/motion_time.h"
#include "engine/paths/operations/dowel_holes.h"
#include "engine/planner/drill_plan.h"
#include "engine/planner/layer_plan.h"
#include "engine/planner/local_frame.h"
#include "engine/planner/rating.h"
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
#include "engine/stock/layer_stock.h"
#include "engine/stock/standing.h"
#include "engine/tool_choice/select.h"
#include "kernels/cutting/layer_solid.h"
#include "kernels/errors.h"
#include "kernels/features/section_areas.h"
#include "kernels/forces/hardest.h"
#include "kernels/mesh/simplify.h"
#include "kernels/parallel/parallel.h"
#include "kernels/parallel/progress_part.h"
#include "kernels/slicing/slicing.h"

namespace slabwright {

namespace {

constexpr std::size_t kManyFacets =
    200'000;  // from here on fewer facets are worth their gap; the job file says so

// The pattern, and what the paths are laid on: fewer facets where a share of the gouge tolerance allows it.
struct PathGround {
    MeshView pattern, mesh;
    double gap = 0;  // mm between them at most
    std::optional<Mesh> lighter{};
};

// @param plan has its layers: where nearly level surfaces cross their tops, nothing may move
PathGround ground_of(Context& context, Plan& plan, MeshView pattern) {
    const Tolerances& tolerances = plan.job.tolerances;
    PathGround ground{pattern, pattern};
    // Facets whose sides are not all alike are left as they are.
    if (tolerances.simplify <= 0 || pattern.size() < kManyFacets || !pattern.roles.empty()) return ground;
    ground.gap = tolerances.simplify * tolerances.gouge;
    std::vector<double> tops;
    for (const Layer& layer : plan.layers) tops.push_back(layer.z_top);
    ground.mesh = ground.lighter.emplace(simplify(context, pattern, ground.gap, tops)).view();
    plan.diagnostics.push_back(
        {Severity::note,
         "paths.simplified",
         fmt::format("the paths are laid on {} facets that lie within {:.4g} mm of the pattern's {}",
                     ground.mesh.size(), ground.gap, pattern.size()),
         {}});
    return ground;
}

// How many slabs of the stock make a layer's thickness; one where it is in stock, or no stock is named.
int slabs_of(const Job& job, double thickness) {
    double thickest = 0;
    for (const double t : job.slabs.thicknesses) thickest = std::max(thickest, t);
    return thickest > 0 ? std::max(1, static_cast<int>(std::lround(thickness / thickest))) : 1;
}

/// A part [from, to] of the request's progress.
struct ProgressShare {
    double from = 0, to = 1;
    [[nodiscard]] double at(double part) const { return from + part * (to - from); }
};

/// What of the pattern a layer's work meets.
struct LayerShare {
    std::uint64_t facets = 0;  ///< within reach of its cutters
    double work = 0;           ///< of its paths, against a square millimetre of slab that is roughed away
};

/// The work of a square millimetre of surface, by how steep it is, and of a facet, against one of slab that
/// is roughed away. First fitted to the processor time of 44 layers of six patterns; since roughing costs
/// less, set by what bench/time_left_bench says of seven.
struct PathWork {
    static constexpr double kFlat = 4, kSlope = 24, kUpright = 4, kFacet = 100;
    static constexpr double kFlatNz = 0.9998, kUprightNz = 0.05;  ///< from here on up, and from here on down

    static double of_area(double nz) { return nz > kFlatNz ? kFlat : nz > kUprightNz ? kSlope : kUpright; }
};

// @param layers ascending; @param overrun how far below its bottom a layer's cutters may reach, mm; @param
// slab_mm2 plan view
std::vector<LayerShare> shares_of_layers(Context& context, MeshView mesh, std::span<const Layer> layers,
                                         double overrun, double slab_mm2) {
    struct Sums {
        std::vector<LayerShare> shares;
        std::vector<double> above_mm2;  // of the part's section in the middle of each layer, seen in plan:
                                        // what lies above it up to the next one's
    };
    const Sums none{std::vector<LayerShare>(layers.size()), std::vector<double>(layers.size() + 1)};
    Sums sums = parallel_reduce(
        context, mesh.facets.size(), std::size_t{1} << 16, none,
        [&](std::size_t begin, std::size_t end) {
            Sums part = none;
            for (std::size_t f = begin; f < end; ++f) {
                const Vec3f &a = mesh.vertices[mesh.facets[f][0]], &b = mesh.vertices[mesh.facets[f][1]],
                            &c = mesh.vertices[mesh.facets[f][2]];
                const double low = std::min({a.z, b.z, c.z}), high = std::max({a.z, b.z, c.z});
                const double ux = double{b.x} - a.x, uy = double{b.y} - a.y, uz = double{b.z} - a.z,
                             vx = double{c.x} - a.x, vy = double{c.y} - a.y, vz = double{c.z} - a.z;
                const double nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
                const double length = std::sqrt(nx * nx + ny * ny + nz * nz), area = nz < 0 ? 0 : length / 2;
                const double work = length > 0 ? area * PathWork::of_area(nz / length) : 0;
                const double centre = (double{a.z} + b.z + c.z) / 3;
                const auto middles = std::partition_point(layers.begin(), layers.end(), [&](const Layer& l) {
                    return (l.z_bottom + l.z_top) / 2 < centre;
                });
                part.above_mm2[static_cast<std::size_t>(middles - layers.begin())] += nz / 2;
                auto layer = std::partition_point(layers.begin(), layers.end(),
                                                  [&](const Layer& l) { return l.z_top <= low; });
                for (; layer != layers.end() && layer->z_bottom - overrun < high; ++layer) {
                    LayerShare& share = part.shares[static_cast<std::size_t>(layer - layers.begin())];
                    ++share.facets;
                    const double within = std::min(high, layer->z_top) - std::max(low, layer->z_bottom);
                    if (within >= 0 && nz >= 0)
                        share.work += PathWork::kFacet + (high > low ? work * within / (high - low) : work);
                }
            }
            return part;
        },
        [](Sums a, const Sums& b) {
            for (std::size_t i = 0; i < a.shares.size(); ++i)
                a.shares[i].facets += b.shares[i].facets, a.shares[i].work += b.shares[i].work;
            for (std::size_t i = 0; i < a.above_mm2.size(); ++i) a.above_mm2[i] += b.above_mm2[i];
            return a;
        });
    double section = sums.above_mm2[layers.size()];
    for (std::size_t i = layers.size(); i-- > 0; section += sums.above_mm2[i])
        sums.shares[i].work += std::clamp(slab_mm2 - section, 0.0, slab_mm2);
    return std::move(sums.shares);
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

double plan_view_mm2(const Plan& plan) {
    return (plan.stock_max[0] - plan.stock_min[0]) * (plan.stock_max[1] - plan.stock_min[1]);
}

// What the layers in work hold at once: their facets with an index of them and what stands of them, and the
// moves of all layers, of which a raster over the whole stock has about three a square millimetre.
std::uint64_t bytes_of_paths(const Context& context, const Plan& plan,
                             const std::vector<LayerShare>& shares) {
    std::vector<std::uint64_t> reach;
    for (const LayerShare& s : shares) reach.push_back(s.facets);
    std::sort(reach.begin(), reach.end(), std::greater<>());
    const std::size_t at_once = std::min<std::size_t>(reach.size(), context.threads());
    const std::uint64_t held = std::accumulate(
        reach.begin(), reach.begin() + static_cast<std::ptrdiff_t>(at_once), std::uint64_t{0});
    constexpr std::uint64_t stands =
        3;  // what stands, and two earlier states of it while one way of cutting is held against another
    return held * (sizeof(SolidFacet) + 16 + 3 * sizeof(Index3)) +
           static_cast<std::uint64_t>(3 * plan_view_mm2(plan)) * (sizeof(Move) + 64) +
           (stands * Standing::bytes(plan.stock_min, plan.stock_max) +
            LayerStock::bytes(plan.job, plan_view_mm2(plan))) *
               at_once;
}

// Adds the programs of dowel holes, last in their layers. Their forces are not reckoned, as no drill's are.
void drill_dowels(Plan& plan) {
    double deepest = 0;
    for (const Layer& layer : plan.layers)
        for (const JointDowel& dowel : layer.dowels) deepest = std::max(deepest, dowel.below);
    if (deepest == 0) return;
    const Tool& tool = dowel_tool(plan.job, deepest);
    for (Layer& layer : plan.layers) {
        if (layer.dowels.empty()) continue;
        layer.operations.push_back(dowel_holes(plan.job, layer, tool));
        limit_feeds(layer.operations.back(), plan.job);
    }
}

// The programs of all layers, with their diagnostics.
// @param joints what each layer lies on is that of its first
// @param feet   of each layer's thin walls
// @param origin of the frame that places are told in
void cut_layers(Context& context, Plan& plan, MeshView pattern,
                const std::vector<std::vector<JointWood>>& joints,
                const std::vector<std::vector<StandingFoot>>& feet, ProgressShare share,
                const std::array<double, 2>& origin) {
    const Job& job = plan.job;
    const DrillPlan drilling = plan_drilling(context, pattern, plan);
    plan.diagnostics.insert(plan.diagnostics.end(), drilling.diagnostics.begin(), drilling.diagnostics.end());
    PathGround ground = ground_of(context, plan, drilling.closed ? drilling.closed->view() : pattern);
    ground.pattern = pattern;
    std::optional<AccessScene> scene;
    if (selects_tools(job) && job.selection.accessibility == AccessRule::exact)
        scene.emplace(context, ground.mesh);
    const std::vector<LayerShare> shares =
        shares_of_layers(context, ground.mesh, plan.layers, overrun_of(job).below, plan_view_mm2(plan));
    const MemoryCharge path_memory(context, bytes_of_paths(context, plan, shares), "the paths");
    std::vector<std::uint64_t> steps;
    for (const LayerShare& s : shares) steps.push_back(static_cast<std::uint64_t>(std::ceil(s.work)));
    context.begin_phase("paths", share.at(0), share.at(0.96),
                        std::accumulate(steps.begin(), steps.end(), std::uint64_t{0}));
    std::vector<PlannedLayer> planned(plan.layers.size());
    // Threads begin at the first and in the middle of what there is to do: from either place on it becomes
    // smaller, so that none is left with a large layer in the end.
    std::vector<std::size_t> largest_first(plan.layers.size());
    std::iota(largest_first.begin(), largest_first.end(), std::size_t{0});
    std::stable_sort(largest_first.begin(), largest_first.end(),
                     [&](std::size_t a, std::size_t b) { return steps[a] > steps[b]; });
    const std::size_t half = (plan.layers.size() + 1) / 2;
    ScratchPool<StockMemory> stock_memory;
    KnownCuts known_cuts;
    SolverAhead solver(context);
    parallel_each(context, plan.layers.size(), [&](std::size_t task) {
        const std::size_t i = largest_first[task < half ? 2 * task : 2 * (task - half) + 1];
        ProgressPart progress(context, steps[i]);
        const Loops* const carried_by = i > 0 ? &joints[i].front().below : nullptr;
        planned[i] = plan_layer(context,
                                {plan, ground.pattern, ground.mesh, ground.gap, scene ? &*scene : nullptr,
                                 carried_by, &stock_memory, feet[i], &drilling.layers[i], &known_cuts},
                                i, progress);
        solver.expect(planned[i].cuts.cuts);
    });
    std::vector<LayerCuts> cuts;
    for (std::size_t i = 0; i < planned.size(); ++i) {
        plan.layers[i] = std::move(planned[i].layer);
        cuts.push_back(std::move(planned[i].cuts));
    }
    context.begin_phase("forces", share.at(0.96), share.at(0.99));
    std::vector<std::vector<Diagnostic>> rated(planned.size());
    if (job.cutting.engagement == Engagement::simulated)
        rated = rate_layers(context, plan, cuts, solver.solver());
    drill_dowels(plan);
    keep_clear(plan, origin);
    parallel_each(context, planned.size(), [&](std::size_t i) {
        for (Operation& op : plan.layers[i].operations) {
            context.throw_if_cancelled();
            rate(job, plan.layers[i], op, rated[i]);
        }
    });
    add_approaches(plan);
    for (std::size_t i = 0; i < planned.size(); ++i)
        for (const auto* found : {&planned[i].diagnostics, &rated[i]})
            plan.diagnostics.insert(plan.diagnostics.end(), found->begin(), found->end());
    if (std::all_of(plan.layers.begin(), plan.layers.end(),
                    [](const Layer& layer) { return layer.operations.empty(); }))
        throw refusal("plan.empty", "nothing would be cut", plan.input.file, "check the units and the slabs");
    check_travel(plan);
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
Plan plan_layers(Context& context, MeshView pattern, const Plan& begun, const LayerRequest& request,
                 const LayerPlacement& placement, ProgressShare share, const std::array<double, 2>& origin) {
    Plan plan = begun;
    plan.diagnostics.insert(plan.diagnostics.end(), placement.diagnostics.begin(),
                            placement.diagnostics.end());
    warn_of_overhang(plan, request, placement.boundaries);
    plan.layers = layers_between(plan.job, placement.boundaries);
    settle_undercuts(context, plan, pattern, origin);
    if (plan.job.flask.enabled) plan.flask = place_flask(context, pattern, plan);
    saw_blanks(context, pattern, plan);
    check_chambers(plan);
    std::vector<std::vector<JointWood>> joints = wood_at_joints(context, pattern, plan);
    const std::optional<Mesh> propped = prop(context, plan, pattern, joints);
    place_dowels(context, pattern, plan);
    if (propped) pattern = propped->view();
    place_keep_outs(plan, origin);
    (void)cut_list(plan);  // every slab is on a board
    bond_layers(context, plan, joints, origin);
    const std::vector<std::vector<StandingFoot>> feet = standing_feet(context, plan, joints);
    cut_layers(context, plan, pattern, joints, feet, share, origin);

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
    const LayerPlacement placement = place_layers(job.layers.strategy, request);
    request.section_area = {};
    return plan_layers(context, view, plan, request, placement, {0.02, 0.985}, origin);
}

}  // namespace

Plan make_plan(Context& context, const Mesh& mesh, const InputInfo& input, const Job& job) {
    validate(job);
    check_probing(job);
    Plan plan;
    plan.input = input;
    plan.totals.part_volume_mm3 = input.volume_mm3;
    plan.job = job;
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
