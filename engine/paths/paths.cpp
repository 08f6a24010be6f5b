#include "engine/paths/paths.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "engine/moves/arcs.h"
#include "engine/moves/motion_time.h"
#include "engine/paths/operations/drilling.h"
#include "engine/paths/operations/facing.h"
#include "engine/paths/operations/floors.h"
#include "engine/paths/operations/levels.h"
#include "engine/paths/operations/offsets.h"
#include "engine/paths/operations/raster.h"
#include "engine/paths/operations/rest.h"
#include "engine/paths/operations/roughing.h"
#include "engine/paths/operations/semi_rough.h"
#include "engine/paths/runs/layer_cut.h"
#include "engine/paths/runs/rings.h"
#include "engine/paths/runs/tolerances.h"
#include "engine/stock/layer_stock.h"
#include "engine/stock/loose.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

// Of a ball's diameter, what its level contours sweep beside a wall: what it leaves at the far side of that
// on a floor, two tenths of its radius, is no more than one cut.
constexpr double kSwathShare = 0.5;

double minutes_of(const Operation& op, const Machine& machine) {
    return motion_time(op.moves, machine, op.blend).minutes;
}

// What is cut while it lives can be undone, in all that operations leave to each other.
class Attempt {
public:
    Attempt(const LayerCut& cut, LayerStock& stock)
        : cut_(cut), stood_(*cut.standing), no_ways_(cut.no_way_in.size()), trial_(stock) {}
    void undo() {
        *cut_.standing = std::move(stood_);
        cut_.no_way_in.resize(no_ways_);
        trial_.undo();
    }

private:
    const LayerCut& cut_;
    Standing stood_;
    std::size_t no_ways_;
    LayerStock::Trial trial_;
};

// Waste between walls. What lies within the swath of the level contours beside a wall may be left to them,
// which then meet more and go slower: it is left where that spares this operation most of its time, as along
// upright walls; where slopes are gentle it spares little or none.
// @param before minutes of the layer's operations so far: of those a small part is not worth a second look
Operation clear_between(const LayerCut& cut, LayerStock& stock, RestPass pass, double before) {
    constexpr double kSwath =
        0.35;  // of the cutter's radius: wider, and the contours meet more than they bear at a good feed
    constexpr double kLittle = 0.03;  // of the minutes before
    constexpr double kSpared = 0.6;   // of the time without
    const Tool& tool = cut.layer.tools.finish;
    pass.swath = kSwath * tool.diameter / 2;
    std::optional<Attempt> attempt(std::in_place, cut, stock);
    Operation some = cut_rest(cut, stock, tool, pass);
    const double minutes = minutes_of(some, cut.job.machine);
    if (minutes <= kLittle * before) return some;
    Standing stands = *cut.standing;
    std::vector<std::array<double, 3>> ways = cut.no_way_in;
    attempt->undo();
    attempt.reset();
    pass.swath = 0;
    attempt.emplace(cut, stock);
    Operation all = cut_rest(cut, stock, tool, pass);
    if (minutes > kSpared * minutes_of(all, cut.job.machine)) return all;
    attempt->undo();
    *cut.standing = std::move(stands), cut.no_way_in = std::move(ways);
    (void)stock.cut(cut.context, some, tool);
    return some;
}

// Whatever the order of the cuts was meant to do: what comes loose is found from sections and moves alone.
void report_loose(const LayerCut& cut, LayerResult& result) {
    const LayerJob& layer = cut.layer;
    HeldSlab slab{layer.stock_min, layer.stock_max, layer.z_bottom, layer.z_top, {}, {}};
    // Clearly beside the boundary, whose height is that of the vertices there but for rounding.
    const std::array<Plane, 2> planes{Plane{layer.z_bottom + 10 * kTopSheet, Side::above},
                                      Plane{layer.z_bottom - 10 * kTopSheet, Side::below}};
    const std::vector<Section> sections = slice(cut.context, layer.mesh, planes, {cut.job.tolerances.gap});
    slab.kept = simplify(sections[0].loops);
    slab.glued = simplify(sections[1].loops);
    if (!layer.opening.empty()) {
        slab.kept = unite(slab.kept, subtract(cut.stock_outline(), layer.opening));
    }
    for (const LoosePiece& piece : loose_pieces(cut.context, slab, result.operations, cut.job.tools))
        result.diagnostics.push_back({Severity::warning, "waste.loose",
                                      fmt::format("layer {}: a piece of waste of {:.0f} mm², up to {:.1f} mm "
                                                  "thick, comes loose while the {} are cut",
                                                  layer.index, piece.area_mm2, piece.thickness_mm,
                                                  result.operations[piece.operation].purpose),
                                      std::array<double, 3>{piece.x, piece.y, layer.z_bottom}});
}

void report_no_way_in(const LayerCut& cut, LayerResult& result) {
    if (cut.no_way_in.empty()) return;
    result.diagnostics.push_back(
        {Severity::note, "entry.no_room",
         fmt::format("layer {}: {} cut{} left to a tool that plunges: no room for a helix or a ramp",
                     cut.layer.index, cut.no_way_in.size(), cut.no_way_in.size() == 1 ? "" : "s"),
         cut.no_way_in.front()});
}

}  // namespace

LayerResult plan_layer_paths(Context& context, const LayerJob& layer) {
    LayerCut cut{context,
                 layer,
                 *layer.job,
                 layer_solid(context, layer.mesh, layer.floor_below, layer.z_top),
                 layer.z_bottom + layer.slab_thickness,
                 {},
                 alpha_map(context, layer.mesh, layer.floor_below, layer.z_top),
                 nullptr,
                 {}};
    for (const Flat& flat : layer.flats)
        if (flat.highest < layer.z_top) cut.floors.push_back(flat.highest);
    std::sort(cut.floors.begin(), cut.floors.end(), std::greater<>());
    cut.floors.erase(std::unique(cut.floors.begin(), cut.floors.end(),
                                 [](double a, double b) { return a - b < kSameFloor; }),
                     cut.floors.end());

    // What stands once the slab has been faced; every operation after that cuts its moves into it.
    Standing standing(layer.stock_min, layer.stock_max, std::min(cut.stock_top, layer.z_top));
    cut.standing = &standing;
    // Level contours take their time by the facets that a cutter meets, all else by moves and areas: `share`
    // of that is done.
    const double facets_mm2 =
        static_cast<double>(cut.solid.facets.size()) /
        std::max(1.0, (layer.stock_max[0] - layer.stock_min[0]) * (layer.stock_max[1] - layer.stock_min[1]));
    const double levels_against_rest = 0.25 + 0.6 * facets_mm2,
                 levels_share = levels_against_rest / (1 + levels_against_rest);
    bool levels_done = false;
    const auto reached = [&](double share) {
        if (layer.progress)
            layer.progress->reach(kPathsShare *
                                  ((1 - levels_share) * share + (levels_done ? levels_share : 0)));
    };

    LayerResult result;
    auto take = [&](Operation&& operation) {
        if (!operation.moves.empty()) result.operations.push_back(std::move(operation));
        context.throw_if_cancelled();
    };
    auto fit = [&](Operation& op) {
        ArcFit how{.tolerance = arc_tolerance_units(cut.job, op.kind), .arcs = cut.job.cutting.arcs};
        // Roughing may round more off its corners (Operation::blend): where an arc would be run slower, its
        // chords are not.
        if (op.kind == OperationKind::rough) how.acceleration = level_acceleration(cut.job.machine);
        fit_arcs(op.moves, how);
    };
    auto minutes = [&](std::span<const Operation> operations) {
        double sum = 0;
        for (const Operation& op : operations) sum += minutes_of(op, cut.job.machine);
        return sum;
    };
    // Whether the operations so far, which all stay, take too long. Arcs may be run faster than the straight
    // moves they are made of.
    auto hopeless = [&] {
        if (std::isinf(layer.most_minutes)) return false;
        if (minutes(result.operations) <= layer.most_minutes) return false;
        std::vector<Operation> fitted = result.operations;
        for (Operation& op : fitted) fit(op);
        if (minutes(fitted) <= layer.most_minutes) return false;
        result.operations = std::move(fitted);
        result.given_up = true;
        return true;
    };
    take(face_layer(cut));
    reached(0.01);
    for (Operation& op : rough_layer(cut)) take(std::move(op));
    reached(0.21);
    for (const bool floors : {!layer.walls_first, layer.walls_first})
        take(floors ? finish_floors(cut) : finish_walls(cut));
    reached(0.24);
    auto finish = [&](auto&& done) {
        Operation levels = finish_levels(cut, result.diagnostics);
        levels_done = true;
        reached(0.56);
        done(levels);
        take(std::move(levels));
        if (hopeless()) return;
        Operation projected = cut.job.cutting.projection == Projection::offset
                                  ? finish_offsets(cut, result.diagnostics)
                                  : finish_raster(cut, result.diagnostics);
        reached(0.75);
        done(projected);
        take(std::move(projected));
    };
    if (cut.job.cutting.uniform_steps) {
        finish([](const Operation&) {});
        if (result.given_up) return result;
    } else {
        // What stands now decides the rest: waste where the roughing cutter does not fit before the ball
        // finishes, and after it the corners that the ball leaves, by the flat end mill, and what is left of
        // the cusps' limit anywhere.
        const LayerTools& tools = layer.tools;
        ScratchPool<StockMemory> own;
        ScratchPool<StockMemory>& pool = layer.stock_memory != nullptr ? *layer.stock_memory : own;
        auto memory = pool.take([] { return std::make_unique<StockMemory>(); });
        LayerStock stock(cut.context, cut.layer, cut.solid, stock_cell(cut.layer), std::move(*memory));
        // Left to the next layer, however this one ends.
        struct Leaving {
            ScratchPool<StockMemory>& pool;
            std::unique_ptr<StockMemory> memory;
            LayerStock& stock;
            ~Leaving() { *memory = std::move(stock).release(), pool.give(std::move(memory)); }
        } const leaving{pool, std::move(memory), stock};
        std::vector<Operation> useful;
        for (Operation& op : result.operations) {
            const Tool& tool =
                op.tool == tools.rough.number ? tools.rough : tool_of_kind(cut.job, ToolKind::face);
            const bool idle = op.kind != OperationKind::face && stock.cut(cut.context, op, tool).nothing();
            // A floor's cutter may have taken the whole wall beside it, and the face mill all that roughing
            // would.
            if (!idle) useful.push_back(std::move(op));
        }
        result.operations = std::move(useful);
        const bool contours = clears_on_contours(cut.job);
        constexpr double kWaste = 1.0;  // mm: what is thicker is cut in steps
        const double finish_swath = kSwathShare * tools.finish.diameter;
        auto waste = [&](const Tool& tool, const char* purpose) {
            return RestPass{OperationKind::semi_rough,
                            purpose,
                            kWaste,
                            true,
                            0,
                            semi_rough_allowance(cut.job, tool, kWaste)};
        };
        auto semi_rough = [&](const Tool& tool, double swath) {
            constexpr const char* purpose = "waste beside the roughing cutter";
            if (contours)
                take(semi_rough_layer(cut, stock, tool,
                                      {purpose, kWaste, swath, cut.job.cutting.wall_allowance}));
            else take(cut_rest(cut, stock, tool, waste(tool, purpose)));
        };
        for (std::size_t s = 0; s < tools.semi_rough.size(); ++s)
            semi_rough(tools.semi_rough[s],
                       s + 1 < tools.semi_rough.size()
                           ? tools.semi_rough[s + 1].diameter + cut.job.cutting.wall_allowance
                           : finish_swath);
        // A tool between others is worth its change where much is left for it.
        constexpr double kWasteWorthAChange = 1000, kCornersWorthAChange = 150;  // mm²
        auto last_of_kind = [&](const Tool& tool) {
            return std::none_of(&tool + 1, tools.rest.data() + tools.rest.size(),
                                [&](const Tool& t) { return t.kind == tool.kind; });
        };
        for (const Tool& tool : tools.rest)
            if (tool.kind == ToolKind::flat && !last_of_kind(tool) && tools.semi_rough.empty() &&
                stock.area_over(context, 1.0) > kWasteWorthAChange)
                semi_rough(tool, finish_swath);
        const RestPass between = waste(tools.finish, "waste between walls");
        take(contours ? clear_between(cut, stock, between, minutes(result.operations))
                      : cut_rest(cut, stock, tools.finish, between));
        reached(0.56);
        if (hopeless()) return result;
        finish([&](Operation& op) {
            if (stock.cut(cut.context, op, tools.finish).few()) op.moves.clear();
        });
        if (result.given_up || hopeless()) return result;
        const double limit = cut.job.tolerances.cusp + 0.02;
        // A smaller flat reaches every corner that the roughing cutter reaches, so where one follows it cuts
        // them all.
        const bool smaller = std::any_of(tools.rest.begin(), tools.rest.end(),
                                         [](const Tool& t) { return t.kind == ToolKind::flat; });
        if (!smaller)
            take(cut_rest(cut, stock, tools.rough, {OperationKind::corner, "corners", limit, false}));
        take(cut_rest(cut, stock, tools.finish, {OperationKind::finish, "what is left", limit, false}));
        reached(0.94);
        for (const Tool& tool : tools.rest) {
            const double left = stock.area_over(context, limit);
            if (!last_of_kind(tool) && left < kCornersWorthAChange) continue;
            // What a tool between others is for is only seen when it has cut; where that is little it has
            // not.
            std::optional<Attempt> attempt;
            const std::size_t operations = result.operations.size();
            if (contours && !last_of_kind(tool)) attempt.emplace(cut, stock);
            if (contours && tool.kind == ToolKind::flat)
                take(semi_rough_layer(cut, stock, tool, {"waste in narrow places", kWaste, 0, 0}));
            else take(cut_rest(cut, stock, tool, waste(tool, "waste in narrow places")));
            if (tool.kind == ToolKind::flat)
                take(cut_rest(cut, stock, tool, {OperationKind::corner, "narrow corners", limit, false}));
            else
                take(cut_rest(cut, stock, tool,
                              {OperationKind::finish, "what is left in narrow places", limit, false}));
            if (!attempt || left - stock.area_over(context, limit) >= kCornersWorthAChange) continue;
            attempt->undo();
            result.operations.resize(operations);
        }
        result.left_mm2 = stock.area_over(context, limit);
    }
    report_no_way_in(cut, result);
    for (Operation& op : drill_holes(cut)) take(std::move(op));
    reached(0.95);
    report_loose(cut, result);
    // Last, so that everything before has straight moves only to think of.
    for (Operation& op : result.operations) {
        context.throw_if_cancelled();
        fit(op);
    }
    context.throw_if_cancelled();
    reached(1);
    return result;
}

}  // namespace slabwright
