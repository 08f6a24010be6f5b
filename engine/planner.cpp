#include "engine/planner.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <numbers>
#include <numeric>
#include <optional>

#include <fmt/format.h>

#include "engine/flask/flask.h"
#include "engine/forces/feeds.h"
#include "engine/forces/min_material.h"
#include "engine/layers/candidates.h"
#include "engine/layers/layers.h"
#include "engine/paths/paths.h"
#include "engine/paths/standing.h"
#include "engine/schedule/motion_time.h"
#include "engine/schedule/op_forces.h"
#include "engine/schedule/schedule.h"
#include "engine/tools/reach_ratio.h"
#include "engine/tools/select.h"
#include "kernels/cutting/layer_solid.h"
#include "kernels/errors.h"
#include "kernels/features/section_areas.h"
#include "kernels/parallel/parallel.h"
#include "kernels/parallel/progress_part.h"
#include "kernels/slicing/slicing.h"

namespace slabwright {

namespace {

constexpr double kSlabShare = 0.05;      // of a slab's area, against the surface cut in it: what a layer's work is estimated by
constexpr double kSelectionShare = 0.3;  // of a layer's work, where its tools are chosen

Error refuse(const char* code, std::string message, std::string place, std::string remedy) {
    return Error(ErrorKind::no_plan, code, std::move(message), std::move(place), std::move(remedy));
}

// The stock: the pattern's outline and the job's margin around it, no larger than a slab, and such that the machine
// reaches all of it.
void place_stock(Plan& plan, const Box3& box) {
    const Job& job = plan.job;
    const std::array<double, 2> lo{box.min.x, box.min.y}, hi{box.max.x, box.max.y}, slab{job.slabs.length, job.slabs.width};
    const std::array<double, 2> travel{job.machine.travel_x, job.machine.travel_y};
    constexpr const char* axis[] = {"x", "y"};
    for (int k = 0; k < 2; ++k) {
        const double size = hi[k] - lo[k];
        if (size > slab[k])
            throw refuse(
                "fit.slab",
                fmt::format("the pattern is {:.1f} mm in {}, {:.1f} mm more than the slab's {:.1f} mm", size, axis[k], size - slab[k], slab[k]),
                axis[k], "use larger slabs, turn or split the pattern");
        if (size > travel[k])
            throw refuse("fit.travel",
                         fmt::format("the pattern is {:.1f} mm in {}, {:.1f} mm more than the machine's travel of {:.1f} mm", size, axis[k],
                                     size - travel[k], travel[k]),
                         axis[k], "use a larger machine, turn or split the pattern");
        // A flask needs its room; without one the stock takes what the slab leaves.
        const double room = std::min((slab[k] - size) / 2, (travel[k] - size) / 2);
        const double needed = job.flask.enabled ? flask_margin(job.flask, box.max.z) : 0;
        if (needed > room)
            throw refuse("fit.flask",
                         fmt::format("the flask needs {:.1f} mm on either side of the pattern in {}, {:.1f} mm more than the {} leaves", needed,
                                     axis[k], needed - room, slab[k] <= travel[k] ? "slab" : "machine's travel"),
                         axis[k], "use larger slabs, a smaller flask.gap or flask.wall, or turn the pattern");
        const double margin = std::min(std::max(job.slabs.margin, needed), room);
        plan.stock_min[k] = lo[k] - margin;
        plan.stock_max[k] = hi[k] + margin;
    }
    if (box.max.z > job.machine.build_height)
        throw refuse("fit.chamber",
                     fmt::format("the pattern is {:.1f} mm high, {:.1f} mm more than the build chamber's {:.1f} mm", box.max.z,
                                 box.max.z - job.machine.build_height, job.machine.build_height),
                     "z", "split the pattern");
}

void check_travel(const Plan& plan) {
    const Machine& machine = plan.job.machine;
    const double cx = 0.5 * (plan.stock_min[0] + plan.stock_max[0]), cy = 0.5 * (plan.stock_min[1] + plan.stock_max[1]);
    for (const Layer& layer : plan.layers)
        for (const Operation& op : layer.operations) {
            double over_x = 0, over_y = 0, low = 1e300, high = -1e300;
            auto reach = [&](double x, double y) {
                over_x = std::max(over_x, std::abs(x - cx) - machine.travel_x / 2);
                over_y = std::max(over_y, std::abs(y - cy) - machine.travel_y / 2);
            };
            for (std::size_t i = 0; i < op.moves.size(); ++i) {
                const Move& m = op.moves[i];
                reach(to_mm(m.x), to_mm(m.y));
                if (m.is_arc()) {
                    const std::array<double, 4> box = arc_shape(op.moves[i - 1], m).box();
                    reach(box[0], box[1]);
                    reach(box[2], box[3]);
                }
                low = std::min(low, to_mm(m.z));
                high = std::max(high, to_mm(m.z));
            }
            const double over_z = high - low - machine.travel_z;
            for (const auto& [over, axis] : {std::pair{over_x, "x"}, {over_y, "y"}, {over_z, "z"}})
                if (over > 1e-4)
                    throw refuse(
                        "fit.travel",
                        fmt::format("the {} program of layer {} leaves the machine's travel in {} by {:.1f} mm", op.purpose, layer.index, axis, over),
                        fmt::format("layer {}", layer.index), "use a smaller margin, a larger machine, or turn the pattern");
        }
}

// A layer as one set of tools makes it, with the forces of its programs and the feeds that they allow.
struct Trial {
    Layer layer;
    std::vector<Diagnostic> diagnostics;
    double minutes = 0;  // of its programs and the changes of tool between them
    double left_mm2 = 0;
    bool whole = true;  // false: given up, its feeds were not adapted
    LayerCuts cuts{};   // of its programs, for their peaks
};

double minutes_of(const Layer& layer, const Machine& machine) {
    double minutes = 0;
    const Operation* before = nullptr;
    for (const Operation& op : layer.operations) {
        minutes += motion_time(op.moves, machine).minutes + machine.spindle_dwell_s / 60;
        if (before && before->tool != op.tool) minutes += machine.tool_change_s / 60;
        before = &op;
    }
    return minutes;
}

// @param overhang of the layer's slab; null: it lies on the board
// @param most     minutes: where the paths alone take longer at the feeds they are planned with, they are not followed any further
Trial plan_layer(Context& context, const Plan& plan, const Layer& layer, const LayerJob& work, const OverhangMap* overhang, double most) {
    Trial trial{layer, {}, 0};
    LayerResult result = plan_layer_paths(context, work);
    trial.layer.operations = std::move(result.operations);
    trial.diagnostics = std::move(result.diagnostics);
    trial.left_mm2 = result.left_mm2;
    trial.minutes = minutes_of(trial.layer, plan.job.machine);
    if (trial.minutes > most) {
        trial.whole = false;
        return trial;
    }
    if (plan.job.cutting.engagement == Engagement::simulated) trial.cuts = adapt_layer(context, trial.layer, plan, overhang, trial.diagnostics);
    trial.minutes = minutes_of(trial.layer, plan.job.machine);
    return trial;
}

std::vector<int> tools_in_order(const Layer& layer) {
    std::vector<int> tools;
    for (const Operation& op : layer.operations)
        if (std::find(tools.begin(), tools.end(), op.tool) == tools.end()) tools.push_back(op.tool);
    return tools;
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
    double area_mm2 = 0;       ///< of the surface that is cut in it
};

// @param layers ascending; @param overrun how far below its bottom a layer's cutters may reach, mm
std::vector<LayerShare> shares_of_layers(Context& context, MeshView mesh, std::span<const Layer> layers, double overrun) {
    return parallel_reduce(
        context, mesh.facets.size(), std::size_t{1} << 16, std::vector<LayerShare>(layers.size()),
        [&](std::size_t begin, std::size_t end) {
            std::vector<LayerShare> shares(layers.size());
            for (std::size_t f = begin; f < end; ++f) {
                const Vec3f &a = mesh.vertices[mesh.facets[f][0]], &b = mesh.vertices[mesh.facets[f][1]], &c = mesh.vertices[mesh.facets[f][2]];
                const double low = std::min({a.z, b.z, c.z}), high = std::max({a.z, b.z, c.z});
                const double ux = double{b.x} - a.x, uy = double{b.y} - a.y, uz = double{b.z} - a.z, vx = double{c.x} - a.x, vy = double{c.y} - a.y,
                             vz = double{c.z} - a.z;
                const double nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
                const double area = nz < 0 ? 0 : std::sqrt(nx * nx + ny * ny + nz * nz) / 2;
                auto layer = std::partition_point(layers.begin(), layers.end(), [&](const Layer& l) { return l.z_top <= low; });
                for (; layer != layers.end() && layer->z_bottom - overrun < high; ++layer) {
                    LayerShare& share = shares[static_cast<std::size_t>(layer - layers.begin())];
                    ++share.facets;
                    const double within = std::min(high, layer->z_top) - std::max(low, layer->z_bottom);
                    if (within >= 0) share.area_mm2 += high > low ? area * within / (high - low) : area;
                }
            }
            return shares;
        },
        [](std::vector<LayerShare> a, const std::vector<LayerShare>& b) {
            for (std::size_t i = 0; i < a.size(); ++i) a[i].facets += b[i].facets, a[i].area_mm2 += b[i].area_mm2;
            return a;
        });
}

// From layers on. `ground` is a plan with its stock and features.
Plan plan_layers(Context& context, const Mesh& mesh, const Plan& ground, const LayerRequest& request, const LayerPlacement& placement,
                 ProgressShare share) {
    Plan plan = ground;
    const Job& job = plan.job;
    const MeshView view = mesh.view();
    const FeatureOptions options = feature_options(job);
    plan.diagnostics.insert(plan.diagnostics.end(), placement.diagnostics.begin(), placement.diagnostics.end());
    if (request.min_material_at) {
        double most = 0, where = 0;
        for (std::size_t i = 0; i + 1 < placement.boundaries.size(); ++i)
            if (const double z = placement.boundaries[i].z, least = request.min_material_at(z); least > most) most = least, where = z;
        if (most > request.max_layer)
            plan.diagnostics.push_back(
                {Severity::warning,
                 "layers.overhang",
                 fmt::format("the slab glued at {:.2f} mm hangs over so far that {:.1f} mm of it would be needed to bear the cutters, more than the "
                             "tallest layer's {:.1f} mm; a flask would carry it",
                             where, most, request.max_layer),
                 {}});
    }
    std::vector<double> tops;
    for (const Boundary& b : placement.boundaries) {
        Layer layer;
        layer.index = static_cast<int>(plan.layers.size()) + 1;
        layer.z_bottom = tops.empty() ? 0 : tops.back();
        layer.z_top = b.z;
        layer.slab_thickness = b.slab_thickness;
        layer.slabs = slabs_of(job, b.slab_thickness);
        layer.reason = b.reason;
        tops.push_back(b.z);
        plan.layers.push_back(std::move(layer));
    }

    const std::vector<UnmadeUndercut> unmade = measure_undercuts(context, view, tops, options);
    double worst = 0;
    const UnmadeUndercut* deepest = nullptr;
    for (const UnmadeUndercut& u : unmade) {
        if (u.depth_mm > worst) worst = u.depth_mm, deepest = &u;
        if (u.depth_mm > job.tolerances.undercut)
            plan.diagnostics.push_back({job.allow_undercut ? Severity::warning : Severity::error, "undercut.unmade",
                                        fmt::format("an undercut of {:.1f} mm² stays filled up to {:.2f} mm deep", u.area_mm2, u.depth_mm),
                                        std::array{u.x, u.y, u.z}});
    }
    if (worst > job.tolerances.undercut && !job.allow_undercut) {
        const auto count = std::count_if(unmade.begin(), unmade.end(), [&](const UnmadeUndercut& u) { return u.depth_mm > job.tolerances.undercut; });
        throw refuse("undercut.unmade",
                     fmt::format("{} undercut{} cannot be milled from above; the deepest, of {:.1f} mm², would stay filled {:.2f} mm deep", count,
                                 count == 1 ? "" : "s", deepest->area_mm2, deepest->depth_mm),
                     fmt::format("x {:.2f} y {:.2f} z {:.2f} mm", deepest->x, deepest->y, deepest->z),
                     "turn or split the pattern, or accept it with --allow-undercut");
    }
    if (!unmade.empty() && worst <= job.tolerances.undercut) {
        double total = 0;
        for (const UnmadeUndercut& u : unmade) total += u.area_mm2;
        plan.diagnostics.push_back({Severity::note, "undercut.shallow",
                                    fmt::format("{} undercut patches ({:.1f} mm²) stay filled, at most {:.3f} mm deep", unmade.size(), total, worst),
                                    std::array{deepest->x, deepest->y, deepest->z}});
    }

    if (job.flask.enabled) plan.flask = place_flask(context, view, plan);

    // A gap in the mesh shows as an open chain; sections at every boundary and feature would miss one in between, so the
    // loader has refused all open edges but those in the base plane already. What is left here is proof by section.
    const LayerTools fixed = fixed_tools(job);
    double overrun = fixed.finish.diameter / 2;
    const bool selecting = selects_tools(job);
    std::optional<AccessScene> scene;
    if (selecting) {
        for (const Tool& tool : job.tools)
            if (tool.kind == ToolKind::ball) overrun = std::max(overrun, tool.diameter / 2);
        if (job.selection.accessibility == AccessRule::exact) scene.emplace(context, view);
    }
    const double board = job.machine.base_board_cut >= 0 ? std::min(job.machine.base_board_cut, job.machine.base_board_thickness)
                                                         : std::min(overrun, job.machine.base_board_thickness);
    // What the layers in work hold at once: their facets with an index of them, and the moves of all layers, of which a
    // raster over the whole stock has about three a square millimetre.
    const std::vector<LayerShare> shares = shares_of_layers(context, view, plan.layers, overrun);
    std::vector<std::uint64_t> reach;
    for (const LayerShare& s : shares) reach.push_back(s.facets);
    std::sort(reach.begin(), reach.end(), std::greater<>());
    const std::uint64_t held =
        std::accumulate(reach.begin(), reach.begin() + std::min<std::ptrdiff_t>(std::ssize(reach), context.threads()), std::uint64_t{0});
    const double plane = (plan.stock_max[0] - plan.stock_min[0]) * (plan.stock_max[1] - plan.stock_min[1]);
    const std::uint64_t standing = Standing::bytes(plan.stock_min, plan.stock_max) * std::min<std::uint64_t>(reach.size(), context.threads());
    const MemoryCharge path_memory(context, held * (sizeof(SolidFacet) + 16) + static_cast<std::uint64_t>(3 * plane) * (sizeof(Move) + 64) + standing,
                                   "the paths");
    // A slab lies on the flask below as on the pattern, and is glued to what of it stays in this layer.
    std::vector<Plane> joints;
    for (const Layer& layer : plan.layers) joints.push_back({layer.z_bottom, layer.index == 1 ? Side::above : Side::below});
    std::vector<Section> sections = slice(context, view, joints, {job.tolerances.gap});
    std::vector<Loops> carried;
    for (std::size_t i = 0; i < plan.layers.size(); ++i)
        carried.push_back(plan.flask ? unite(sections[i].loops, flask_frame(*plan.flask, i)) : std::move(sections[i].loops));
    // A layer's work grows with the surface that is cut in it, and with the slab that is faced and roughed.
    std::vector<std::uint64_t> steps;
    for (const LayerShare& s : shares) steps.push_back(static_cast<std::uint64_t>(std::ceil(s.area_mm2 + kSlabShare * plane)));
    context.begin_phase("paths", share.at(0), share.at(0.98), std::accumulate(steps.begin(), steps.end(), std::uint64_t{0}));
    std::vector<LayerCuts> cuts(plan.layers.size());
    std::vector<std::vector<Diagnostic>> found_in(plan.layers.size());
    parallel_each(context, plan.layers.size(), [&](std::size_t i) {
        const Layer& layer = plan.layers[i];
        ProgressPart progress(context, steps[i]);
        // A layer may be taller than the shortest tools make; the others make it then.
        const Job fitted = with_tools_for(plan.job, layer.z_top - layer.z_bottom);
        LayerJob work;
        work.mesh = view;
        work.job = &fitted;
        work.z_bottom = layer.z_bottom;
        work.z_top = layer.z_top;
        work.slab_thickness = layer.slab_thickness;
        work.stock_min = plan.stock_min;
        work.stock_max = plan.stock_max;
        work.index = layer.index;
        if (plan.flask) work.opening = plan.flask->inner[i];
        for (const Feature& f : plan.features) {
            if (f.type != FeatureType::up_flat || f.area < job.cutting.min_flat_area || f.z_low >= layer.z_top) continue;
            if (f.z_low > layer.z_bottom) work.flats.push_back(&f);
        }
        work.floor_below = layer.z_bottom - (i == 0 ? board : overrun);
        std::vector<std::pair<std::string, LayerTools>> sets;
        std::optional<LayerSelection> selection;
        if (selecting) {
            ToolChoice choice = select_tools(context, work, reach_ratio(context, work, scene ? &*scene : nullptr));
            // One narrow place may have decided for the whole layer: the next wider finish tool, with smaller ones in that place only.
            if (const auto wider = next_wider_ball(fitted, choice.tools.finish); wider && job.selection.compare && !choice.record.vertical)
                sets.emplace_back("wider", select_tools(context, work, {}, wider).tools);
            sets.emplace(sets.begin(), "selected", std::move(choice.tools));
            selection = std::move(choice.record);
        }
        // First, so that the others are measured by it.
        if (!selecting || job.selection.compare) sets.emplace(sets.begin(), "fixed", fixed_tools(fitted));
        const double chosen_at = selecting ? kSelectionShare : 0;
        progress.reach(chosen_at);
        std::optional<OverhangMap> overhang;
        const Loops* const regions[] = {&carried[i]};
        if (i > 0) overhang = overhang_map(regions, plan.stock_min, plan.stock_max);
        std::optional<Trial> best;
        std::size_t chosen = 0;
        const std::size_t first_sets = sets.size();
        const bool may_widen = selection && job.selection.compare && !selection->vertical;
        bool widened = false;
        LayerTools best_tools;
        for (std::size_t s = 0;; ++s) {
            if (s == sets.size()) {
                // Of the sets planned so far the best, with a wider roughing cutter.
                if (widened || !may_widen) break;
                widened = true;
                for (LayerTools& tools : with_wider_rough(context, work, best_tools)) sets.emplace_back("wider rough", std::move(tools));
                if (s == sets.size()) break;
            }
            work.tools = sets[s].second;
            const double below = work.tools.finish.diameter / 2;
            work.floor_below = layer.z_bottom - (i > 0 ? below : job.machine.base_board_cut >= 0 ? board : std::min(below, board));
            work.feet.clear();
            for (const Feature& f : plan.features)
                if (f.type == FeatureType::up_flat && f.area >= job.cutting.min_flat_area && f.z_low < layer.z_top && f.z_low > work.floor_below)
                    work.feet.push_back(&f);
            // The sets of the choice, then those that are known once they are planned.
            const double middle = may_widen ? 0.6 * chosen_at + 0.4 : 1, from = s < first_sets ? chosen_at : middle, to = s < first_sets ? middle : 1;
            const std::size_t before = s < first_sets ? 0 : first_sets, count = s < first_sets ? first_sets : sets.size() - first_sets;
            const double step = (to - from) / static_cast<double>(count), at = from + step * static_cast<double>(s - before);
            ProgressPart part(progress, at, at + step);
            work.progress = &part;
            // Adapted feeds seldom make a plan faster by so much; a set that is given up for it is not proven slower.
            constexpr double kHopeless = 1.5;
            Trial trial = plan_layer(context, plan, layer, work, overhang ? &*overhang : nullptr, best ? kHopeless * best->minutes : 1e300);
            part.reach(1);
            // The first is the fixed set where sets are compared; none may leave more than that, but for what differently fine cells see.
            constexpr double kMore = 1.1, kFew = 5;  // mm²
            const bool leaves_more = s > 0 && trial.left_mm2 > kMore * selection->sets[0].left_mm2 + kFew;
            if (selection) {
                ToolSet& set =
                    selection->sets.emplace_back(ToolSet{sets[s].first, tools_in_order(trial.layer), trial.minutes, trial.left_mm2, false, {}});
                if (leaves_more)
                    set.reason = fmt::format("leaves {:.1f} mm² over the limit, the first set {:.1f} mm²", set.left_mm2, selection->sets[0].left_mm2);
                else if (!trial.whole) set.reason = fmt::format("its paths alone take {:.1f} min, against {:.1f} min", trial.minutes, best->minutes);
            }
            if (!best || (trial.whole && !leaves_more && trial.minutes < best->minutes))
                best = std::move(trial), chosen = s, best_tools = sets[s].second;
        }
        if (selection) {
            selection->sets[chosen].chosen = true;
            selection->sets[chosen].reason = sets.size() > 1 ? "takes the least time of those that leave no more" : "not compared";
            for (ToolSet& set : selection->sets)
                if (set.reason.empty()) set.reason = fmt::format("takes {:.1f} min longer", set.minutes - selection->sets[chosen].minutes);
        }
        plan.layers[i] = std::move(best->layer);
        plan.layers[i].selection = std::move(selection);
        found_in[i] = std::move(best->diagnostics);
        cuts[i] = std::move(best->cuts);
        progress.reach(1);
    });
    if (job.cutting.engagement == Engagement::simulated) {
        const std::vector<std::vector<Diagnostic>> rated = rate_layers(context, plan, cuts);
        for (std::size_t i = 0; i < rated.size(); ++i) found_in[i].insert(found_in[i].end(), rated[i].begin(), rated[i].end());
    }
    std::size_t operations = 0;
    for (const Layer& layer : plan.layers) operations += layer.operations.size();
    for (std::size_t i = 0; i < found_in.size(); ++i) {
        plan.diagnostics.insert(plan.diagnostics.end(), found_in[i].begin(), found_in[i].end());
        for (Operation& op : plan.layers[i].operations) {
            const MotionTime time = motion_time(op.moves, job.machine);
            op.cutting_mm = time.cutting_mm;
            op.rapid_mm = time.rapid_mm;
            op.minutes = time.minutes + job.machine.spindle_dwell_s / 60;
            if (job.cutting.engagement == Engagement::simulated) continue;
            const auto tool = std::find_if(job.tools.begin(), job.tools.end(), [&](const Tool& t) { return t.number == op.tool; });
            rate_operation(op, *tool, job);
            const double allowance = std::min(job.cutting.wall_allowance, job.cutting.floor_allowance);
            if (op.kind == OperationKind::rough && op.deflection_mm > allowance)
                plan.diagnostics.push_back(
                    {Severity::warning,
                     "rough.deflection",
                     fmt::format("layer {}: the roughing cutter may bend by {:.3f} mm, more than the {:.3f} mm it leaves for finishing",
                                 plan.layers[i].index, op.deflection_mm, allowance),
                     {}});
        }
    }
    if (operations == 0) throw refuse("plan.empty", "nothing would be cut", plan.input.file, "check the units and the slabs");
    check_travel(plan);

    context.begin_phase("schedule", share.at(0.98), share.at(1));
    for (std::size_t i = 0; i < plan.layers.size(); ++i) bond_layer(plan.layers[i], carried[i], plan, plan.diagnostics);
    schedule(plan);
    if (plan.totals.stack_mass_kg > job.machine.build_mass_kg)
        throw refuse("fit.mass",
                     fmt::format("the stack weighs {:.0f} kg, {:.0f} kg more than the build platform carries", plan.totals.stack_mass_kg,
                                 plan.totals.stack_mass_kg - job.machine.build_mass_kg),
                     {}, "split the pattern or use a smaller margin");
    return plan;
}

// Every placement planned whole; the one that is built in the least time stays.
Plan fastest_plan(Context& context, const Mesh& mesh, const Plan& ground, const LayerRequest& request, const std::vector<LayerCandidate>& tried,
                  ProgressShare share) {
    std::optional<Plan> best;
    std::exception_ptr refused;  // the first
    std::string words;
    std::string name;
    for (std::size_t i = 0; i < tried.size(); ++i) {
        const double step = 1.0 / static_cast<double>(tried.size()), at = static_cast<double>(i) * step;
        LayerRequest asked = request;
        asked.max_layer = tried[i].max_layer;
        try {
            Plan plan = plan_layers(context, mesh, ground, asked, tried[i].placement, {share.at(at), share.at(at + step)});
            words += fmt::format("{}{} {:.1f} min", words.empty() ? "" : ", ", tried[i].name, plan.totals.build_minutes);
            if (!best || plan.totals.build_minutes < best->totals.build_minutes) best = std::move(plan), name = tried[i].name;
        } catch (const Error& e) {
            if (e.kind() != ErrorKind::no_plan || e.code().starts_with("memory")) throw;
            words += fmt::format("{}{} refused ({})", words.empty() ? "" : ", ", tried[i].name, e.code());
            if (!refused) refused = std::current_exception();
        }
    }
    if (!best) std::rethrow_exception(refused);
    best->diagnostics.push_back({Severity::note,
                                 "layers.combined",
                                 fmt::format("of {} placement{} {} is built fastest: {}", tried.size(), tried.size() == 1 ? "" : "s", name, words),
                                 {}});
    return std::move(*best);
}

}  // namespace

Plan make_plan(Context& context, const Mesh& mesh, const InputInfo& input, const Job& job) {
    validate(job);
    Plan plan;
    plan.input = input;
    plan.totals.part_volume_mm3 = input.volume_mm3;
    plan.job = job;
    if (mesh.facets.empty()) throw refuse("input.empty", "there is nothing to make: the mesh has no facets", input.file, "export the pattern again");
    const MeshView view = mesh.view();
    const Box3 box = bounds(view);
    const double height = box.max.z;
    place_stock(plan, box);

    const MemoryCharge mesh_memory(context, mesh.vertices.size() * sizeof(Vec3f) + mesh.facets.size() * 2 * sizeof(Index3), "the mesh");
    context.begin_phase("features", 0.02, 0.03);
    const FeatureOptions options = feature_options(job);
    FeatureSet found = find_features(context, view, options);
    plan.features = std::move(found.features);
    for (const FinderDisagreement& d : found.disagreements)
        plan.diagnostics.push_back({Severity::note, "features.finders_disagree",
                                    fmt::format("only the {} finder sees a {} at {:.3f} mm", name(d.found_by), name(d.type), d.z),
                                    std::array{d.x, d.y, d.z}});

    context.begin_phase("layers", 0.03, 0.04);
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
    request.features = plan.features;
    request.section_area = SectionAreas(context, view);
    if (job.layers.strategy == LayerStrategy::combined)
        return fastest_plan(context, mesh, plan, request, layer_candidates(context, view, job, request), {0.04, 0.98});
    return plan_layers(context, mesh, plan, request,
                       job.layers.strategy == LayerStrategy::printed ? place_layers_printed(request) : place_layers_optimal(request), {0.04, 0.98});
}

}  // namespace slabwright
