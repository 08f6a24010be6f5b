#include "engine/paths/runs/layer_cut.h"

#include <algorithm>

#include "engine/paths/runs/flask_room.h"
#include "engine/paths/runs/tolerances.h"
#include "kernels/slicing/slicing.h"

namespace slabwright {

// The machine's travel is centred on the stock; the planner has made sure that the stock lies within it.
double LayerCut::low(int axis, double beyond) const {
    const double travel = axis == 0 ? job.machine.travel_x : job.machine.travel_y;
    return std::max(layer.stock_min[axis] - beyond,
                    0.5 * (layer.stock_min[axis] + layer.stock_max[axis] - travel));
}
double LayerCut::high(int axis, double beyond) const {
    const double travel = axis == 0 ? job.machine.travel_x : job.machine.travel_y;
    return std::min(layer.stock_max[axis] + beyond,
                    0.5 * (layer.stock_min[axis] + layer.stock_max[axis] + travel));
}

Loops LayerCut::stock_outline() const {
    Loops outline;
    const Point2 low{to_units(layer.stock_min[0]), to_units(layer.stock_min[1])},
        high{to_units(layer.stock_max[0]), to_units(layer.stock_max[1])};
    outline.points = {low, {high.x, low.y}, high, {low.x, high.y}};
    outline.close_loop();
    return outline;
}

std::vector<Section> LayerCut::insides(const CutterShape& cutter, std::span<const double> tip_z) const {
    std::vector<Plane> planes;
    for (const double z : tip_z) planes.push_back(inside_plane(solid, cutter, z));
    return slice(context, layer.mesh, planes, {job.tolerances.gap});
}

std::vector<Contours> LayerCut::contours(const CutterShape& cutter, std::span<const double> tip_z,
                                         std::int32_t pitch) const {
    const std::vector<Section> inside = insides(cutter, tip_z);
    std::vector<FibreLevel> levels;
    for (std::size_t i = 0; i < tip_z.size(); ++i) levels.push_back({tip_z[i], &inside[i].loops});
    return level_contours(context, solid, levels, cutter, fibre_grid(solid, cutter, pitch));
}

const DropIndex& LayerCut::drops(const CutterShape& cutter) const {
    for (const auto& [of, index] : made_drops)
        if (of == cutter) return *index;
    made_drops.emplace_back(cutter, std::make_unique<DropIndex>(solid, cutter));
    return *made_drops.back().second;
}

Surroundings LayerCut::around(const Tool& tool, const DropIndex* part) const {
    const CutterShape cutter = cutter_shape(tool);
    Surroundings around{standing, part, cutter};
    // Where the places are those of a wider cutter, half of what it is wider by may go.
    const double wider = part != nullptr ? part->cutter().radius - cutter.radius : 0;
    // Of a tip that is rounder or sharper than the cutter is wide, what goes into its chords is that.
    constexpr double kSharpest = 0.05;  // mm
    const double round = cutter.taper_rad > 0 ? std::max(cutter.corner, kSharpest) : cutter.radius;
    around.chord = safe_chord_mm(round, std::max(job.tolerances.gouge, wider / 2));
    around.under = has_ball_tip(tool.kind) ? wider : 0;
    around.ramp_deg = job.cutting.ramp_deg;
    around.no_way_in = &no_way_in;
    around.lowest_rapid = layer.z_bottom + PathBuilder::kStop;
    for (const int axis : {0, 1}) {
        const auto a = static_cast<std::size_t>(axis);
        around.reach_min[a] = low(axis, 1e9);
        around.reach_max[a] = high(axis, 1e9);
    }
    if (!layer.opening.empty()) around.room = std::make_shared<const Loops>(flask_room(*this, cutter.radius));
    return around;
}

Operation LayerCut::operation(OperationKind kind, const char* purpose, const Tool& tool) const {
    Operation op;
    op.kind = kind;
    op.purpose = purpose;
    op.tool = tool.number;
    op.spindle_rpm = std::min(tool.max_rpm, job.machine.max_rpm);
    return op;
}

}  // namespace slabwright
