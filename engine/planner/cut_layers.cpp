#include "engine/planner/cut_layers.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <optional>

#include <fmt/format.h>

#include "engine/forces/feeds.h"
#include "engine/forces/op_forces.h"
#include "engine/paths/operations/dowel_holes.h"
#include "engine/planner/drill_plan.h"
#include "engine/planner/layer_plan.h"
#include "engine/planner/rating.h"
#include "engine/schedule/fit.h"
#include "engine/schedule/keep_outs.h"
#include "engine/stock/layer_stock.h"
#include "engine/stock/standing.h"
#include "engine/tool_choice/foreseen_finish.h"
#include "engine/tool_choice/select.h"
#include "kernels/cutting/layer_solid.h"
#include "kernels/errors.h"
#include "kernels/forces/hardest.h"
#include "kernels/mesh/simplify.h"
#include "kernels/parallel/parallel.h"
#include "kernels/parallel/progress_part.h"

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
    double thinnest = 1e9;
    for (const Tool& t : plan.job.tools) thinnest = std::min(thinnest, t.diameter);
    constexpr std::uint64_t stands =
        3;  // what stands, and two earlier states of it while one way of cutting is held against another
    const ToolSelection& how = plan.job.selection;
    // One set of tools that leads, and one that is held against it.
    const bool races =
        selects_tools(plan.job) && how.compare && how.foresee && finish_is_foreseeable(plan.job);
    const std::uint64_t sets = races ? 2 : 1;
    return sets * held * (sizeof(SolidFacet) + 16 + 3 * sizeof(Index3)) +
           static_cast<std::uint64_t>(3 * plan_view_mm2(plan)) * (sizeof(Move) + 64) +
           sets *
               (stands * Standing::bytes(plan.stock_min, plan.stock_max, thinnest / 2) +
                LayerStock::bytes(plan.job, plan_view_mm2(plan))) *
               at_once;
}

// Whether flats cut deeper than where their push matters.
bool may_go_deep(const Job& job) {
    return std::any_of(job.tools.begin(), job.tools.end(), [](const Tool& tool) {
        return roughs_layers(tool.kind) && shallow_step(tool) < tool.stepdown_max;
    });
}

// What of a layer, in plan, its own programs may break off its glue.
double lost_mm2(const Layer& layer, std::span<const JointWood> wood, const Plan& plan) {
    double sum = 0;
    for (const WeakJoint& weak : joints_under_load(layer, wood, plan)) sum += weak.lost_mm2;
    return sum;
}

struct RatedLayer {
    Layer layer;
    std::vector<Diagnostic> planned, rated;
};

// Plans a layer that is planned already once more, with shallow cuts: they push less, and roughing bends what
// stands free by no more than a step over its joint.
RatedLayer plan_gently(Context& context, const LayerGround& ground, std::size_t i) {
    Plan one;
    one.job = ground.plan.job;
    one.stock_min = ground.plan.stock_min, one.stock_max = ground.plan.stock_max;
    ProgressPart none(context, 0);
    PlannedLayer planned = plan_layer(context, ground, i, none);
    one.layers.push_back(std::move(planned.layer));
    std::vector<std::vector<Diagnostic>> rated = rate_layers(context, one, {&planned.cuts, 1}, nullptr);
    return {std::move(one.layers.front()), std::move(planned.diagnostics), std::move(rated.front())};
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

}  // namespace

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
    const auto ground_under = [&](std::size_t i, bool shallow) {
        const Loops* const carried_by = i > 0 ? &joints[i].front().below : nullptr;
        return LayerGround{
            plan,       ground.pattern, ground.mesh, ground.gap,          scene ? &*scene : nullptr,
            carried_by, &stock_memory,  feet[i],     &drilling.layers[i], &known_cuts,
            shallow};
    };
    parallel_each(context, plan.layers.size(), [&](std::size_t task) {
        const std::size_t i = largest_first[task < half ? 2 * task : 2 * (task - half) + 1];
        ProgressPart progress(context, steps[i]);
        planned[i] = plan_layer(context, ground_under(i, false), i, progress);
        solver.expect(planned[i].cuts.cuts);
    });
    std::vector<LayerCuts> cuts;
    for (std::size_t i = 0; i < planned.size(); ++i) {
        plan.layers[i] = std::move(planned[i].layer);
        cuts.push_back(std::move(planned[i].cuts));
    }
    context.begin_phase("forces", share.at(0.96), share.at(0.99));
    std::vector<std::vector<Diagnostic>> rated(planned.size());
    if (job.cutting.engagement == Engagement::simulated) {
        rated = rate_layers(context, plan, cuts, solver.solver());
        if (may_go_deep(job))
            parallel_each(context, planned.size(), [&](std::size_t i) {
                const double lost = lost_mm2(plan.layers[i], joints[i], plan);
                if (lost == 0) return;
                RatedLayer gentle = plan_gently(context, ground_under(i, true), i);
                if (lost_mm2(gentle.layer, joints[i], plan) >= lost) return;
                plan.layers[i] = std::move(gentle.layer);
                planned[i].diagnostics = std::move(gentle.planned);
                rated[i] = std::move(gentle.rated);
            });
    }
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

}  // namespace slabwright
