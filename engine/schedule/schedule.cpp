#include "engine/schedule/schedule.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/forces/cuts.h"
#include "engine/paths/path_builder.h"
#include "engine/schedule/heights.h"
#include "kernels/polygons/hull.h"

namespace slabwright {

namespace {

/// Area, centroid and second moments about the centroid of a plane region, by Green's theorem over its loops,
/// and how far it reaches from the centroid. Millimetres.
struct AreaMoments {
    double area = 0, x = 0, y = 0;
    double ix = 0, iy = 0;            ///< ∫(x − cx)² dA and ∫(y − cy)² dA
    double reach_x = 0, reach_y = 0;  ///< largest |x − cx| and |y − cy|
};

AreaMoments moments(const Loops& loops) {
    AreaMoments m;
    if (loops.points.empty()) return m;
    // Coordinates count from the first point: far from the origin the second moments would cancel otherwise.
    const double ox = to_mm(loops.points[0].x), oy = to_mm(loops.points[0].y);
    double a2 = 0, sx = 0, sy = 0, sxx = 0, syy = 0;
    for (std::size_t l = 0; l < loops.size(); ++l) {
        const auto loop = loops.loop(l);
        for (std::size_t i = 0; i < loop.size(); ++i) {
            const Point2 p = loop[i], q = loop[i + 1 < loop.size() ? i + 1 : 0];
            const double x0 = to_mm(p.x) - ox, y0 = to_mm(p.y) - oy, x1 = to_mm(q.x) - ox,
                         y1 = to_mm(q.y) - oy;
            const double cross = x0 * y1 - x1 * y0;
            a2 += cross;
            sx += cross * (x0 + x1);
            sy += cross * (y0 + y1);
            sxx += cross * (x0 * x0 + x0 * x1 + x1 * x1);
            syy += cross * (y0 * y0 + y0 * y1 + y1 * y1);
        }
    }
    if (!(a2 > 0)) return m;
    m.area = a2 / 2;
    const double cx = sx / 6 / m.area, cy = sy / 6 / m.area;
    m.x = cx + ox;
    m.y = cy + oy;
    m.ix = std::max(0.0, sxx / 12 - m.area * cx * cx);
    m.iy = std::max(0.0, syy / 12 - m.area * cy * cy);
    for (const Point2 p : loops.points) {
        m.reach_x = std::max(m.reach_x, std::fabs(to_mm(p.x) - m.x));
        m.reach_y = std::max(m.reach_y, std::fabs(to_mm(p.y) - m.y));
    }
    return m;
}

/// How far (x, y) lies outside a convex polygon, mm; 0 inside.
double outside_by(const std::vector<Point2>& hull, double x, double y) {
    double nearest = INFINITY;
    bool inside = hull.size() >= 3;
    for (std::size_t i = 0; i < hull.size(); ++i) {
        const Point2 a = hull[i], b = hull[i + 1 < hull.size() ? i + 1 : 0];
        const double ax = to_mm(a.x), ay = to_mm(a.y), dx = to_mm(b.x) - ax, dy = to_mm(b.y) - ay;
        const double length2 = dx * dx + dy * dy;
        if (dx * (y - ay) - dy * (x - ax) < 0) inside = false;
        const double t = length2 > 0 ? std::clamp(((x - ax) * dx + (y - ay) * dy) / length2, 0.0, 1.0) : 0.0;
        nearest = std::min(nearest, std::hypot(x - ax - t * dx, y - ay - t * dy));
    }
    return inside ? 0 : nearest;
}

struct Box2 {
    Point2 min{INT32_MAX, INT32_MAX}, max{INT32_MIN, INT32_MIN};
    void grow(Point2 p) {
        min = {std::min(min.x, p.x), std::min(min.y, p.y)};
        max = {std::max(max.x, p.x), std::max(max.y, p.y)};
    }
    [[nodiscard]] bool holds(Point2 p) const {
        return p.x >= min.x && p.x <= max.x && p.y >= min.y && p.y <= max.y;
    }
};

/// The sideways force of the hardest cut this job makes, N: of every end mill at its largest stepdown.
double sideways_force(const Job& job) {
    double force = 0;
    for (const Tool& tool : job.tools)
        if (tool.kind == ToolKind::flat || tool.kind == ToolKind::ball)
            force = std::max(force, peak_force(hardest_cut(job, tool, tool.stepdown_max)).peak_in_plane_n);
    return force;
}

/// A piece of `below` that no glue reaches is held by nothing once it has been cut loose from the rest of its
/// slab.
void report_islands(const Layer& layer, const Loops& below, double setback,
                    std::vector<Diagnostic>& diagnostics) {
    std::vector<Point2> glued;  // one point of every glued loop
    for (std::size_t i = 0; i < layer.glue.size(); ++i) glued.push_back(layer.glue.loop(i)[0]);
    for (std::size_t i = 0; i < below.size(); ++i) {
        const auto loop = below.loop(i);
        const double loop_area = signed_area(loop);
        if (loop_area <= 0) continue;  // a hole
        Box2 box;
        for (const Point2 p : loop) box.grow(p);
        Loops alone;
        alone.points.assign(loop.begin(), loop.end());
        alone.close_loop();
        // An island in a hole of a larger piece is a loop of its own and is asked for itself.
        if (std::any_of(glued.begin(), glued.end(),
                        [&](Point2 p) { return box.holds(p) && winding(alone, p) != 0; }))
            continue;
        diagnostics.push_back(
            {Severity::warning, "schedule.island_without_glue",
             fmt::format("layer {}: a piece of {:.0f} mm2, {:.1f} x {:.1f} mm, gets no glue, being "
                         "everywhere within {} mm of an edge",
                         layer.index, loop_area, to_mm(std::int64_t{box.max.x} - box.min.x),
                         to_mm(std::int64_t{box.max.y} - box.min.y), setback),
             std::array<double, 3>{to_mm((std::int64_t{box.min.x} + box.max.x) / 2),
                                   to_mm((std::int64_t{box.min.y} + box.max.y) / 2), layer.z_bottom}});
    }
}

/// The slabs in the feed chamber, in the order in which they are taken. Where they are laid by hand, none lie
/// there and nothing is loaded.
class FeedChamber {
public:
    explicit FeedChamber(const Plan& plan) : plan_(plan), loads_(feed_loads(plan)) {
        for (const Layer& layer : plan.layers)
            for (int k = 0; k < layer.slabs; ++k) thicknesses_.push_back(layer.slab_thickness / layer.slabs);
    }
    [[nodiscard]] bool is_empty() const { return left_ == 0 && next_load_ < loads_.size(); }
    /// Fills the chamber and says with what.
    std::vector<std::pair<std::string, double>> load() {
        left_ = loads_[next_load_++];
        height_ = 0;
        for (int k = 0; k < left_; ++k) height_ += thicknesses_[next_slab_ + static_cast<std::size_t>(k)];
        return {{"slabs", left_}, {"height_mm", height_}, {"mass_kg", slab_mass_kg(plan_, height_)}};
    }
    /// Takes the next slab. @returns the height of the stack that it lay on top of, itself included, mm
    double take() {
        const double stack = height_;
        if (left_ > 0) {
            --left_;
            height_ = left_ == 0 ? 0 : height_ - thicknesses_[next_slab_];
        }
        ++next_slab_;
        return stack;
    }
    int last_taken = 0;  ///< the step that took the slab before; 0: none

private:
    const Plan& plan_;
    std::vector<int> loads_;
    std::vector<double> thicknesses_;  // of every slab of the build
    std::size_t next_load_ = 0, next_slab_ = 0;
    int left_ = 0;
    double height_ = 0;
};

/// The lowest and the highest z of a program, as it counts them.
void add_heights(SequenceStep& step, const Operation& operation, double origin) {
    if (operation.moves.empty()) return;
    const auto [low, high] = std::minmax_element(operation.moves.begin(), operation.moves.end(),
                                                 [](const Move& a, const Move& b) { return a.z < b.z; });
    const std::int32_t zero = to_units(origin);
    step.numbers.emplace_back("z_low_mm", to_mm(std::int64_t{low->z} - zero));
    step.numbers.emplace_back("z_high_mm", to_mm(std::int64_t{high->z} - zero));
}

/// Digits of a number, at least `least`.
int width_of(std::size_t largest, int least) {
    return std::max(least, static_cast<int>(std::to_string(largest).size()));
}

}  // namespace

void bond_layer(Layer& layer, const Loops& below, const Plan& plan, std::vector<Diagnostic>& diagnostics) {
    const Bonding& bonding = plan.job.bonding;
    // A section has a point at every facet that it cuts, more than where glue goes needs. Thinned it may be
    // too wide by as much as it is thinned, and offset() errs towards the larger region by up to its
    // tolerance; that much more setback keeps the promised distance.
    constexpr double thinned_by = 0.05, tolerance = 0.05;
    if (below.empty()) layer.glue = {};
    else if (bonding.edge_setback > 0)
        layer.glue =
            offset(thinned(below, thinned_by), -(bonding.edge_setback + thinned_by + tolerance), tolerance);
    else layer.glue = below;
    const AreaMoments m = moments(layer.glue);
    layer.glue_area_mm2 = m.area;
    layer.glue_centroid = {m.x, m.y};
    layer.press_force_n = 0;

    const double middle_x = (plan.stock_min[0] + plan.stock_max[0]) / 2,
                 middle_y = (plan.stock_min[1] + plan.stock_max[1]) / 2;
    const auto report = [&](const char* code, std::string message, double x, double y) {
        diagnostics.push_back(
            {Severity::warning, code, std::move(message), std::array<double, 3>{x, y, layer.z_bottom}});
    };
    if (!(m.area > 0)) {
        report(
            "schedule.no_glue",
            below.empty()
                ? fmt::format("layer {}: nothing lies under its slab, so nothing can be glued", layer.index)
                : fmt::format("layer {}: no place under its slab is {} mm from an edge, so nothing is glued",
                              layer.index, bonding.edge_setback),
            middle_x, middle_y);
        layer.glue_centroid = {middle_x, middle_y};
        return;
    }

    // The platen presses on the whole slab, so its resultant acts in the slab's middle, off the glue's
    // centroid by (ex, ey). On a rigid slab the pressure in the joint is then linear: p = F/A · (1 +
    // ex·x·A/Ix + ey·y·A/Iy). The allowed pressure holds at the most loaded edge, and where p would turn
    // negative at the far edge (the resultant has left the joint's kern, for a rectangle its middle third)
    // the joint gapes there.
    const double ex = middle_x - m.x, ey = middle_y - m.y;
    const double uneven = (m.ix > 0 ? std::fabs(ex) * m.reach_x * m.area / m.ix : 0) +
                          (m.iy > 0 ? std::fabs(ey) * m.reach_y * m.area / m.iy : 0);
    layer.press_force_n = std::min(bonding.press_force, m.area * bonding.max_pressure_mpa / (1 + uneven));

    const double overhang = outside_by(convex_hull(below.points), middle_x, middle_y);
    if (overhang > 0)
        report("schedule.tips",
               fmt::format("layer {}: the slab's middle overhangs what it lies on by {:.1f} mm; support it "
                           "until it is glued",
                           layer.index, overhang),
               middle_x, middle_y);
    else if (uneven > 1)
        report("schedule.uneven_press",
               fmt::format("layer {}: the glue's centroid lies {:.1f} mm off the slab's middle, outside the "
                           "part of the joint where the press closes "
                           "it everywhere; "
                           "the press is held to {:.0f} N",
                           layer.index, std::hypot(ex, ey), layer.press_force_n),
               m.x, m.y);

    // The cutter pushes at the layer's top with F, so it bends the joint with F·h; the tension at the joint's
    // edge, F·h·c/I along its weaker direction, must stay under what the material bears across its faces. For
    // MDF that internal bond is 0.55 to 0.65 MPa (EN 622-5), near the pressure that the job allows on the
    // joint, which is taken for it.
    const double bending = sideways_force(plan.job) * (layer.z_top - layer.z_bottom);
    const double weakest =
        std::min(m.reach_x > 0 ? m.ix / m.reach_x : 0, m.reach_y > 0 ? m.iy / m.reach_y : 0);
    const double tension = weakest > 0 ? bending / weakest : INFINITY;
    if (tension > bonding.max_pressure_mpa)
        report(
            "schedule.weak_joint",
            fmt::format("layer {}: {:.0f} mm2 of glue under {:.1f} mm of height may not hold: cutting can "
                        "load the joint with {:.2f} MPa, over {} MPa",
                        layer.index, m.area, layer.z_top - layer.z_bottom, tension, bonding.max_pressure_mpa),
            m.x, m.y);
    report_islands(layer, below, bonding.edge_setback, diagnostics);
}

void name_programs(Plan& plan) {
    std::size_t highest = 0, most = 0;
    for (const Layer& layer : plan.layers) {
        highest = std::max(highest, static_cast<std::size_t>(std::max(0, layer.index)));
        most = std::max(most, layer.operations.size());
    }
    const int layer_width = width_of(highest, 3), operation_width = width_of(most, 2);
    for (Layer& layer : plan.layers)
        for (std::size_t i = 0; i < layer.operations.size(); ++i) {
            Operation& operation = layer.operations[i];
            operation.file = fmt::format("L{:0{}}_{:0{}}_{}_T{}.ngc", layer.index, layer_width, i + 1,
                                         operation_width, name(operation.kind), operation.tool);
        }
}

void schedule(Plan& plan) {
    name_programs(plan);
    const Job& job = plan.job;
    Totals totals;
    totals.part_volume_mm3 = plan.totals.part_volume_mm3;
    const double stock_x = plan.stock_max[0] - plan.stock_min[0],
                 stock_y = plan.stock_max[1] - plan.stock_min[1];

    std::vector<SequenceStep>& steps = plan.sequence;
    steps.clear();
    const auto add = [&](int layer, const char* action, std::vector<int> needs,
                         double seconds) -> SequenceStep& {
        SequenceStep step;
        step.id = static_cast<int>(steps.size()) + 1;
        step.layer = layer;
        step.action = action;
        step.needs = std::move(needs);
        step.seconds = seconds;
        steps.push_back(std::move(step));
        return steps.back();
    };

    const int first_layer = plan.layers.empty() ? 0 : plan.layers.front().index;
    SequenceStep& board = add(first_layer, "mount_board", {}, 0);
    board.numbers = {{"thickness_mm", job.machine.base_board_thickness},
                     {"length_mm", stock_x},
                     {"width_mm", stock_y},
                     {"mass_kg", slab_mass_kg(plan, job.machine.base_board_thickness)}};
    FeedChamber feed(plan);
    double carried_kg = slab_mass_kg(plan, job.machine.base_board_thickness);
    double table_height = 0;     // of the layer before
    int stack_ready = board.id;  // the step after which the stack's top is ready for the next slab
    int handler_free = 0;        // the step after which the material handler is free; 0: from the start
    int spindle_tool = 0;
    const double third = job.bonding.handling_s / 3;

    for (const Layer& layer : plan.layers) {
        ++totals.layers;
        totals.stock_volume_mm3 += stock_x * stock_y * layer.slab_thickness;

        // A layer of several slabs: each is bonded to the one below before any is cut. Between two whole
        // slabs glue goes everywhere, so that no piece of the waste above a joint comes loose.
        const double slab = layer.slab_thickness / layer.slabs, whole = stock_x * stock_y;
        int pressed = 0;
        for (int k = 0; k < layer.slabs; ++k) {
            const double area = k == 0 ? layer.glue_area_mm2 : whole;
            // Fetching the slab and clamping it only needs the handler; it may go on while the layer below is
            // being milled.
            std::vector<int> needs;
            if (feed.is_empty()) {
                SequenceStep& load =
                    add(layer.index, "load_feed",
                        feed.last_taken == 0 ? std::vector<int>{} : std::vector<int>{feed.last_taken}, 0);
                load.numbers = feed.load();
                needs.push_back(load.id);
            }
            if (handler_free != 0) needs.push_back(handler_free);
            SequenceStep& take = add(layer.index, "take_slab", std::move(needs), third);
            take.numbers = {{"thickness_mm", slab},
                            {"length_mm", stock_x},
                            {"width_mm", stock_y},
                            {"mass_kg", slab_mass_kg(plan, slab)},
                            {"feed_stack_mm", feed.take()}};
            take.words = {{"material", job.material.name}};
            const int taken = feed.last_taken = take.id;
            const int clamped = add(layer.index, "clamp", {taken}, third).id;
            SequenceStep& glue = add(layer.index, "glue", {k == 0 ? stack_ready : pressed},
                                     job.bonding.glue_s_per_m2 * area * 1e-6);
            glue.numbers = {{"area_mm2", area}, {"setback_mm", k == 0 ? job.bonding.edge_setback : 0}};
            glue.words = {{"glue", job.bonding.glue}};
            const int glued = glue.id;
            SequenceStep& place = add(layer.index, "place", {clamped, glued}, third);
            carried_kg += slab_mass_kg(plan, slab);
            place.numbers = {{"x_mm", plan.stock_min[0]},
                             {"y_mm", plan.stock_min[1]},
                             {"z_bottom_mm", layer.z_bottom + k * slab},
                             {"table_load_kg", carried_kg}};
            handler_free = place.id;
            SequenceStep& press = add(layer.index, "press", {handler_free}, job.bonding.press_time_s);
            // Every press goes through the joint under the layer.
            press.numbers = {{"force_n", layer.press_force_n}, {"time_s", job.bonding.press_time_s}};
            pressed = press.id;
            totals.bonding_minutes += (job.bonding.handling_s + job.bonding.glue_s_per_m2 * area * 1e-6 +
                                       job.bonding.press_time_s) /
                                      60;
        }

        // Where the table moves, it sinks until this layer's top will be cut where the first one's was.
        const LayerHeights heights = layer_heights(job.machine, plan.layers.front().z_top, layer.z_top);
        const double sinking =
            totals.layers == 1 ? 0 : table_seconds(job.machine, table_height, heights.table);
        table_height = heights.table;
        totals.table_minutes += sinking / 60;
        SequenceStep& table = add(layer.index, "table", {pressed}, sinking);
        table.numbers = {{"table_height_mm", heights.table}, {"work_offset_z_mm", heights.work_offset}};
        // What the touch-off has to find: the raw slab's top, in the programs' frame.
        SequenceStep& touch = add(layer.index, "touch_off", {table.id}, 0);
        touch.numbers = {{"slab_top_mm", layer.z_bottom + layer.slab_thickness - heights.origin}};
        int last = touch.id;

        for (const Operation& operation : layer.operations) {
            ++totals.operations;
            totals.cutting_mm += operation.cutting_mm;
            totals.rapid_mm += operation.rapid_mm;
            totals.cutting_minutes += operation.minutes;
            if (operation.tool != spindle_tool) {
                // The program's own T and M6 then find the tool in the spindle, also when the build resumes
                // at the program.
                SequenceStep& change = add(layer.index, "tool_change", {last}, job.machine.tool_change_s);
                change.numbers = {{"tool", operation.tool}};
                last = change.id;
                spindle_tool = operation.tool;
                ++totals.tool_changes;
                totals.tool_change_minutes += job.machine.tool_change_s / 60;
            }
            SequenceStep& mill = add(layer.index, operation.kind == OperationKind::face ? "face" : "mill",
                                     {last}, operation.minutes * 60);
            mill.numbers = {{"tool", operation.tool}};
            add_heights(mill, operation, heights.origin);
            mill.words = {{"program", "nc/" + operation.file}, {"purpose", operation.purpose}};
            last = mill.id;
        }
        stack_ready = last;
    }
    const int last_layer = plan.layers.empty() ? 0 : plan.layers.back().index;
    const int unloaded = add(last_layer, "unload", {stack_ready}, 0).id;
    if (plan.flask) {
        // The frame around the pattern is the moulding box: sand goes between the two and leaves upwards with
        // the box's draft.
        SequenceStep& box = add(last_layer, "mould_box", {unloaded}, 0);
        box.numbers = {
            {"flask_mass_kg", plan.flask->volume_mm3 * 1e-9 * job.material.density_kg_m3},
            {"height_mm", plan.layers.empty() ? 0 : plan.layers.back().z_top},
            {"sand_litres", std::max(0.0, plan.flask->opening_mm3 - totals.part_volume_mm3) * 1e-6}};
    }

    totals.build_minutes =
        totals.cutting_minutes + totals.bonding_minutes + totals.tool_change_minutes + totals.table_minutes;
    totals.stack_mass_kg = (totals.stock_volume_mm3 + stock_x * stock_y * job.machine.base_board_thickness) *
                           1e-9 * job.material.density_kg_m3;
    plan.totals = totals;
}

}  // namespace slabwright
