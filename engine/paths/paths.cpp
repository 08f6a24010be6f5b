#include "engine/paths/paths.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <numbers>
#include <optional>

#include <fmt/format.h>

#include "engine/moves/arcs.h"
#include "engine/moves/motion_time.h"
#include "engine/paths/operations/drilling.h"
#include "engine/paths/operations/edges.h"
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
#include "kernels/slicing/silhouette.h"

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

// Of what is left over the limit, the share that no wall within the swath (mm) rises as high as; by every
// fourth cell of every fourth row.
double share_off_walls(const LayerCut& cut, const LayerStock& stock, double limit, double swath) {
    constexpr int each = 4;
    constexpr std::size_t grain = 16;  // of these rows
    const CellGrid& grid = stock.grid();
    const DropIndex& wall = cut.drops(flat_cutter(swath));
    struct Height {
        double off = 0, all = 0;  // mm, summed over cells
    };
    const auto of_rows = [&](std::size_t begin, std::size_t end) {
        Height height;
        MetPoints met;
        for (std::size_t r = begin; r < end; ++r)
            stock.each_left(static_cast<int>(r) * each, limit, [&, j = static_cast<int>(r) * each](int i) {
                if (i % each != 0) return;
                const std::size_t c = grid.index(i, j);
                const double stands = stock.height(c), lowest = stock.surface(c), bottom = stock.z_bottom();
                height.all += stands - lowest;
                if (const std::optional<Rest> rest =
                        wall.drop_within(grid.x(i), grid.y(j), bottom + lowest, bottom + stands, &met))
                    height.off += stands - std::clamp(rest->tip_z - bottom, lowest, stands);
            });
        return height;
    };
    const auto rows = static_cast<std::size_t>((grid.ny + each - 1) / each);
    const Height sum = parallel_reduce(cut.context, rows, grain, Height{}, of_rows, [](Height a, Height b) {
        return Height{a.off + b.off, a.all + b.all};
    });
    return sum.all > 0 ? sum.off / sum.all : 0;
}

// Waste between walls. What lies within the swath of the level contours beside a wall may be left to them,
// which then meet more and go slower: it is left where that spares this operation most of its time, as along
// upright walls; where slopes are gentle it spares little or none.
// @param before minutes of the layer's operations so far: of those a small part is not worth a second look
Operation clear_between(const LayerCut& cut, LayerStock& stock, RestPass pass, double before) {
    constexpr double kSwath =
        0.35;  // of the cutter's radius: wider, and the contours meet more than they bear at a good feed
    constexpr double kLittle = 0.03;  // of the minutes before
    constexpr double kSpared = 0.6;   // of the time without
    // Of the waste: where more is far from walls, little is spared; where less is, sparing it is tried first.
    constexpr double kMostOff = 0.5, kLittleOff = 0.1;
    constexpr double kSoon = 8.5e-4;  // min/mm²: no layer of 14 parts whose waste went as soon gained by it
    const Tool& tool = cut.layer.tools.finish;
    const double swath = kSwath * tool.diameter / 2,
                 off_walls = share_off_walls(cut, stock, pass.limit, swath);
    if (off_walls > kMostOff) return cut_rest(cut, stock, tool, pass);
    const bool sparing_first = off_walls < kLittleOff;
    const double soon = sparing_first ? 0 : kSoon * stock.area_over(cut.context, pass.limit);
    pass.swath = sparing_first ? swath : 0;
    std::optional<Attempt> attempt(std::in_place, cut, stock);
    Operation first = cut_rest(cut, stock, tool, pass);
    const double minutes = minutes_of(first, cut.job.machine);
    if (minutes <= std::max(soon, kLittle * before)) return first;
    Standing stands = *cut.standing;
    std::vector<std::array<double, 3>> ways = cut.no_way_in;
    attempt->undo();
    attempt.reset();
    pass.swath = sparing_first ? 0 : swath;
    attempt.emplace(cut, stock);
    Operation second = cut_rest(cut, stock, tool, pass);
    const double others = minutes_of(second, cut.job.machine);
    const bool spare = sparing_first ? minutes <= kSpared * others : others <= kSpared * minutes;
    if (spare != sparing_first) return second;
    attempt->undo();
    *cut.standing = std::move(stands), cut.no_way_in = std::move(ways);
    (void)stock.cut(cut.context, first, tool);
    return first;
}

// Whatever the order of the cuts was meant to do: what comes loose is found from sections and moves alone.
void report_loose(const LayerCut& cut, LayerResult& result) {
    const LayerJob& layer = cut.layer;
    // What stays filled under an overhang is kept, too, and where it has wood or the board under it, glued.
    // It begins clearly beside the boundary, whose height is that of the vertices there but for rounding.
    const HeightRange kept{layer.z_bottom + 10 * kTopSheet, layer.z_top - 2 * kTopSheet};
    HeldSlab slab{layer.stock_min, layer.stock_max, layer.z_bottom, layer.z_top,
                  shadows(cut.context, layer.mesh, {&kept, 1}).front()};
    if (!layer.opening.empty()) {
        slab.kept = unite(slab.kept, subtract(cut.stock_outline(), layer.opening));
    }
    constexpr double kLight = 100;  // mm³, .07 g of MDF: a film or a splinter that the extraction takes
    for (const LoosePiece& piece : loose_pieces(cut.context, slab, result.operations, cut.job.tools))
        result.diagnostics.push_back(
            {piece.area_mm2 * piece.thickness_mm < kLight ? Severity::note : Severity::warning, "waste.loose",
             fmt::format("layer {}: a piece of waste of {:.0f} mm², up to {:.1f} mm "
                         "thick, comes loose in \"{}\"",
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

// mm, of the cutters that work in a layer.
double thinnest_radius(const LayerTools& tools) {
    double thinnest = std::min(tools.rough.diameter, tools.finish.diameter);
    for (const std::vector<Tool>* more : {&tools.semi_rough, &tools.rest})
        for (const Tool& t : *more) thinnest = std::min(thinnest, t.diameter);
    return thinnest / 2;
}

// mm: waste that is thicker is cut in steps.
constexpr double kWaste = 1.0;

std::vector<double> floors_of(const LayerJob& layer) {
    std::vector<double> floors;
    for (const Flat& flat : layer.flats)
        if (flat.highest < layer.z_top) floors.push_back(flat.highest);
    std::sort(floors.begin(), floors.end(), std::greater<>());
    floors.erase(
        std::unique(floors.begin(), floors.end(), [](double a, double b) { return a - b < kSameFloor; }),
        floors.end());
    return floors;
}

// After which a set of tools may be given up; places in its LayerPace.
enum Stage : std::size_t { waste_cleared, levels_cut, projected_cut, all_cut };

}  // namespace

// The operations of one layer, one after the other.
class LayerPaths::Steps {
public:
    Steps(Context& context, LayerJob layer)
        : context_(context),
          layer_(std::move(layer)),
          tools_(layer_.tools),
          cut_{context,
               layer_,
               *layer_.job,
               layer_solid(context, layer_.mesh, layer_.floor_below, layer_.z_top),
               layer_.z_bottom + layer_.slab_thickness,
               floors_of(layer_),
               alpha_map(context, layer_.mesh, layer_.floor_below, layer_.z_top),
               nullptr,
               {}},
          standing_(layer_.stock_min, layer_.stock_max, std::min(cut_.stock_top, layer_.z_top),
                    thinnest_radius(tools_)) {
        cut_.standing = &standing_;
        const double facets_mm2 = static_cast<double>(cut_.solid.facets.size()) /
                                  std::max(1.0, (layer_.stock_max[0] - layer_.stock_min[0]) *
                                                    (layer_.stock_max[1] - layer_.stock_min[1]));
        const double levels_against_rest = 0.25 + 0.6 * facets_mm2;
        levels_share_ = levels_against_rest / (1 + levels_against_rest);
    }

    bool clear(ProgressPart* progress, const std::optional<PaceAhead>& ahead) {
        layer_.progress = progress, layer_.ahead = ahead;
        if (!cut_.job.cutting.uniform_steps) take_stock();
        take(face_layer(cut_));
        reached(0.01);
        for (Operation& op : rough_layer(cut_)) take(std::move(op));
        drop_idle();
        reached(0.21);
        for (const bool floors : {!layer_.walls_first, layer_.walls_first}) {
            take(floors ? finish_floors(cut_) : finish_walls(cut_));
            drop_idle();
        }
        reached(0.24);
        constexpr double kAtLeast = 0.45;  // of kWasteMinutes: what is easiest to clear took
        return !hopeless(waste_cleared, layer_.ahead ? kAtLeast * waste_mm3() : 0) &&
               (!stock_ || clear_waste(*stock_)) && !hopeless(waste_cleared);
    }

    LayerResult finish(ProgressPart* progress, const std::optional<PaceAhead>& ahead) {
        layer_.progress = progress, layer_.ahead = ahead;
        if (stock_) finish_by_what_stands(*stock_);
        else finish_slopes([](const Operation&) {});
        if (result_.given_up) return std::move(result_);
        report_no_way_in(cut_, result_);
        for (Operation& op : drill_holes(cut_)) take(std::move(op));
        reached(0.95);
        if (hopeless(all_cut)) return std::move(result_);
        report_loose(cut_, result_);
        // Last, so that everything before has straight moves only to think of.
        for (Operation& op : result_.operations) {
            context_.throw_if_cancelled();
            fit(op);
        }
        context_.throw_if_cancelled();
        reached(1);
        return std::move(result_);
    }

    [[nodiscard]] const LayerResult& so_far() const { return result_; }
    [[nodiscard]] double waste_mm3() const { return stock_ ? stock_->volume_over(context_, kWaste) : 0; }

    Steps(const Steps&) = delete;
    Steps& operator=(const Steps&) = delete;
    ~Steps() {
        if (!stock_) return;
        *memory_ = std::move(*stock_).release();  // left to the next layer, however this one ends
        if (layer_.stock_memory != nullptr) layer_.stock_memory->give(std::move(memory_));
    }

private:
    // Level contours take their time by the facets that a cutter meets, all else by moves and areas: `share`
    // of that is done.
    void reached(double share) const {
        if (layer_.progress)
            layer_.progress->reach(kPathsShare *
                                   ((1 - levels_share_) * share + (levels_done_ ? levels_share_ : 0)));
    }
    void take(Operation&& operation) {
        if (!operation.moves.empty()) result_.operations.push_back(std::move(operation));
        context_.throw_if_cancelled();
    }
    void fit(Operation& op) const {
        ArcFit how{.tolerance = arc_tolerance_units(cut_.job, op.kind), .arcs = cut_.job.cutting.arcs};
        // Roughing may round more off its corners (Operation::blend): where an arc would be run slower, its
        // chords are not.
        if (op.kind == OperationKind::rough) how.acceleration = level_acceleration(cut_.job.machine);
        fit_arcs(op.moves, how);
    }
    [[nodiscard]] double minutes(std::span<const Operation> operations) const {
        double sum = 0;
        for (const Operation& op : operations) sum += minutes_of(op, cut_.job.machine);
        return sum;
    }
    // Notes the pace of the operations so far, which all stay. Whether other tools are too far ahead of them,
    // who have no waste left to clear where there is some here.
    bool hopeless(Stage stage, double waste = 0) {
        if (!layer_.paced) return false;
        const Machine& machine = cut_.job.machine;
        const std::vector<Operation>& operations = result_.operations;
        for (; paced_ < operations.size(); ++paced_) {
            so_far_ += minutes_of(operations[paced_], machine) + machine.spindle_dwell_s / 60;
            if (paced_ > 0 && operations[paced_].tool != operations[paced_ - 1].tool)
                so_far_ += machine.tool_change_s / 60;
        }
        result_.pace[stage] = so_far_;
        if (!layer_.ahead) return false;
        const auto& [ahead, least, times] = *layer_.ahead;
        const double still = least[stage] * (ahead.back() - ahead[stage]);
        result_.given_up = so_far_ + kWasteMinutes * waste + still > times * ahead.back();
        return result_.given_up;
    }

    // Slopes by level contours and by lines projected on them. @param done(operation) may strike its moves
    template <class Done>
    void finish_slopes(Done&& done) {
        Operation levels = finish_levels(cut_, result_.diagnostics);
        levels_done_ = true;
        reached(0.56);
        done(levels);
        take(std::move(levels));
        if (hopeless(levels_cut)) return;
        Operation projected = cut_.job.cutting.projection == Projection::offset
                                  ? finish_offsets(cut_, result_.diagnostics)
                                  : finish_raster(cut_, result_.diagnostics);
        reached(0.75);
        done(projected);
        take(std::move(projected));
        (void)hopeless(projected_cut);
    }

    // What stands decides the rest: after the ball the corners that it leaves, by the flat end mill, and what
    // is left of the cusps' limit anywhere.
    void finish_by_what_stands(LayerStock& stock) {
        finish_slopes([&](Operation& op) {
            if (stock.cut(context_, op, tools_.finish).few()) op.moves.clear();
        });
        if (!result_.given_up) cut_corners(stock);
    }

    void take_stock() {
        const auto make = [] { return std::make_unique<StockMemory>(); };
        memory_ = layer_.stock_memory != nullptr ? layer_.stock_memory->take(make) : make();
        stock_.emplace(context_, layer_, cut_.solid, stock_cell(layer_), std::move(*memory_));
        cut_.stock = &*stock_;
    }

    // Takes the operations that came since the last call off the stock, and drops those that take nothing: a
    // floor's cutter may have taken the whole wall beside it, and the face mill all that roughing would.
    void drop_idle() {
        if (!stock_) return;
        std::vector<Operation>& operations = result_.operations;
        std::vector<Operation> useful;
        for (std::size_t k = off_stock_; k < operations.size(); ++k) {
            Operation& op = operations[k];
            const Tool& tool =
                op.tool == tools_.rough.number ? tools_.rough : tool_of_kind(cut_.job, ToolKind::face);
            const bool idle = op.kind != OperationKind::face && stock_->cut(context_, op, tool).nothing();
            if (!idle) useful.push_back(std::move(op));
        }
        operations.resize(off_stock_);
        std::move(useful.begin(), useful.end(), std::back_inserter(operations));
        off_stock_ = operations.size();
    }

    [[nodiscard]] RestPass waste(const Tool& tool, const char* purpose) const {
        return {OperationKind::semi_rough,
                purpose,
                kWaste,
                true,
                0,
                semi_rough_allowance(cut_.job, tool, kWaste),
                0,
                followed(tool)};
    }
    [[nodiscard]] bool followed(const Tool& tool) const {
        return std::any_of(tools_.rest.begin(), tools_.rest.end(), [&](const Tool& t) {
            return has_ball_tip(t.kind) == has_ball_tip(tool.kind) && tip_diameter(t) < tip_diameter(tool);
        });
    }
    void semi_rough(LayerStock& stock, const Tool& tool, double swath) {
        constexpr const char* purpose = "waste beside the roughing cutter";
        if (contours_)
            take(semi_rough_layer(cut_, stock, tool,
                                  {purpose, kWaste, swath, cut_.job.cutting.wall_allowance}));
        else take(cut_rest(cut_, stock, tool, waste(tool, purpose)));
    }
    [[nodiscard]] bool last_of_kind(const Tool& tool) const {
        return std::none_of(&tool + 1, tools_.rest.data() + tools_.rest.size(),
                            [&](const Tool& t) { return has_ball_tip(t.kind) == has_ball_tip(tool.kind); });
    }

    // A flat end mill takes many lines to a fillet that a ball as wide or less sweeps in few.
    [[nodiscard]] bool ball_follows(const Tool& tool) const {
        return std::any_of(&tool + 1, tools_.rest.data() + tools_.rest.size(),
                           [](const Tool& t) { return has_ball_tip(t.kind); });
    }

    // Waste where the roughing cutter does not fit. @returns false where it was given up
    bool clear_waste(LayerStock& stock) {
        constexpr double worth_a_change = 1000;  // mm² left, for a tool between others
        const double finish_swath = kSwathShare * tools_.finish.diameter;
        for (std::size_t s = 0; s < tools_.semi_rough.size(); ++s)
            semi_rough(stock, tools_.semi_rough[s],
                       s + 1 < tools_.semi_rough.size()
                           ? tools_.semi_rough[s + 1].diameter + cut_.job.cutting.wall_allowance
                           : finish_swath);
        for (const Tool& tool : tools_.rest)
            if (tool.kind == ToolKind::flat && !last_of_kind(tool) && tools_.semi_rough.empty() &&
                stock.area_over(context_, kWaste) > worth_a_change)
                semi_rough(stock, tool, finish_swath);
        if (hopeless(waste_cleared)) return false;
        const RestPass between = waste(tools_.finish, "waste between walls");
        take(contours_ ? clear_between(cut_, stock, between, minutes(result_.operations))
                       : cut_rest(cut_, stock, tools_.finish, between));
        reached(0.56);
        return true;
    }

    // Corners, what is left, and narrow places, by ever smaller tools.
    void cut_corners(LayerStock& stock) {
        const double limit = cut_.job.tolerances.cusp + 0.02;
        // A smaller flat reaches every corner that the roughing cutter reaches, so where one follows it cuts
        // them all.
        const bool smaller = std::any_of(tools_.rest.begin(), tools_.rest.end(),
                                         [](const Tool& t) { return t.kind == ToolKind::flat; });
        if (!smaller)
            take(cut_rest(cut_, stock, tools_.rough, {OperationKind::corner, "corners", limit, false}));
        // Where much is left the ball did not fit, and a narrower one comes anyway, which takes the little
        // that this one passed by.
        if (!followed(tools_.finish) || stock.area_over(context_, limit) < kWorthAChange)
            take(cut_rest(cut_, stock, tools_.finish,
                          {.kind = OperationKind::finish,
                           .purpose = "what is left",
                           .limit = limit,
                           .followed = followed(tools_.finish)}));
        reached(0.94);
        for (const Tool& tool : tools_.rest) cut_narrow(stock, tool, limit);
        // On slopes what no ball reaches: creases, mostly nothing.
        for (const Tool& tool : tools_.rest)
            if (tool.kind == ToolKind::flat && last_of_kind(tool) && ball_follows(tool))
                where_worth(stock, limit, kNothing, [&] { narrow_corners(stock, tool, limit, true); });
        if (cut_.job.cutting.edges)
            for (Operation& op : follow_edges(cut_, stock)) take(std::move(op));
        result_.left_mm2 = stock.area_over(context_, limit);
    }
    void narrow_corners(LayerStock& stock, const Tool& flat, double limit, bool on_slopes) {
        take(cut_rest(cut_, stock, flat,
                      {.kind = OperationKind::corner,
                       .purpose = "narrow corners",
                       .limit = limit,
                       .followed = followed(flat),
                       .on_slopes = on_slopes}));
    }
    static constexpr double kWorthAChange = 150;  // mm² left, for a tool between others
    static constexpr double kNothing = 2;         // mm² in a layer that no tool is taken for
    void cut_narrow(LayerStock& stock, const Tool& tool, double limit) {
        where_worth(stock, limit, last_of_kind(tool) ? kNothing : kWorthAChange, [&] {
            if (contours_ && tool.kind == ToolKind::flat)
                take(semi_rough_layer(cut_, stock, tool, {"waste in narrow places", kWaste, 0, 0}));
            else take(cut_rest(cut_, stock, tool, waste(tool, "waste in narrow places")));
            if (tool.kind == ToolKind::flat) narrow_corners(stock, tool, limit, !ball_follows(tool));
            else
                take(cut_rest(cut_, stock, tool,
                              {.kind = OperationKind::finish,
                               .purpose = "what is left in narrow places",
                               .limit = limit,
                               .followed = followed(tool)}));
        });
    }
    // Cuts where `worth` mm² and more are left over the limit, and takes the cuts back where they were for
    // less: what a tool is for is only seen when it has cut.
    template <class Cut>
    void where_worth(LayerStock& stock, double limit, double worth, Cut&& cut) {
        const double left = stock.area_over(context_, limit);
        if (left < worth) return;
        const std::size_t operations = result_.operations.size();
        std::optional<Attempt> attempt;
        if (contours_) attempt.emplace(cut_, stock);
        cut();
        if (!attempt || left - stock.area_over(context_, limit) >= worth) return;
        attempt->undo();
        result_.operations.resize(operations);
    }

    Context& context_;
    LayerJob layer_;
    const LayerTools& tools_;
    LayerCut cut_;
    std::unique_ptr<StockMemory> memory_;
    std::optional<LayerStock> stock_;  // none where steps are uniform, whatever stands
    std::size_t off_stock_ = 0;        // operations that have been taken off it
    std::size_t paced_ = 0;            // operations that so_far_ (minutes) counts
    double so_far_ = 0;
    Standing standing_;  // once the slab has been faced; every operation after that cuts its moves into it
    const bool contours_ = clears_on_contours(cut_.job);
    double levels_share_ = 0;
    bool levels_done_ = false;
    LayerResult result_;
};

LayerPaths::LayerPaths(Context& context, LayerJob layer)
    : steps_(std::make_unique<Steps>(context, std::move(layer))) {}
LayerPaths::LayerPaths(LayerPaths&&) noexcept = default;
LayerPaths& LayerPaths::operator=(LayerPaths&&) noexcept = default;
LayerPaths::~LayerPaths() = default;

bool LayerPaths::clear(ProgressPart* progress, const std::optional<PaceAhead>& ahead) {
    return steps_->clear(progress, ahead);
}
const LayerResult& LayerPaths::so_far() const { return steps_->so_far(); }
double LayerPaths::waste_mm3() const { return steps_->waste_mm3(); }
LayerResult LayerPaths::finish(ProgressPart* progress, const std::optional<PaceAhead>& ahead) {
    return steps_->finish(progress, ahead);
}

LayerResult plan_layer_paths(Context& context, const LayerJob& layer) {
    LayerPaths paths(context, layer);
    if (!paths.clear(layer.progress, layer.ahead)) return paths.so_far();
    return paths.finish(layer.progress, layer.ahead);
}

}  // namespace slabwright
