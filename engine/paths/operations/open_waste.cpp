#include "engine/paths/operations/open_waste.h"

#include <algorithm>
#include <cmath>

#include "engine/paths/operations/facing.h"
#include "engine/paths/runs/kept_off.h"

namespace slabwright {

namespace {

constexpr double kCollar = 1.5;        // mm that stay of the waste beside what the end mill spares, less
                                       // ring_tolerance(): one light cut of it
constexpr double kOverlap = 0.1;       // mm: more than a border ring and offsets may leave their lines by
constexpr double kOffsetError = 0.01;  // mm
constexpr double kWorth = 1;           // minutes

double feed_of(const LayerCut& cut, const Tool& tool) {
    return std::min(tool.max_feed, cut.job.machine.max_feed);
}

// A region without its holes, and without what lies in them.
Loops filled(const Loops& region) {
    Loops outer;
    for (std::size_t l = 0; l < region.size(); ++l) {
        const std::span<const Point2> loop = region.loop(l);
        if (signed_area(loop) <= 0) continue;
        outer.points.insert(outer.points.end(), loop.begin(), loop.end());
        outer.close_loop();
    }
    return outer.size() == region.size() ? outer : simplify(outer);
}

RingPlan lifted(const RingPlan& plan, double by) {
    RingPlan result = plan;
    const std::int32_t up = to_units(by);
    result.z += up;
    for (RingPlan::Piece& piece : result.pieces)
        for (PathPoint& p : piece.points) p.z += up;
    for (std::vector<PathPoint>& strip : result.strips)
        for (PathPoint& p : strip) p.z += up;
    return result;
}

}  // namespace

const Tool* open_waste_tool(const LayerCut& cut) {
    if (!cut.job.cutting.open_waste || cut.job.cutting.rough_pattern != RoughPattern::contour ||
        !cut.layer.opening.empty())
        return nullptr;
    const Tool& face = tool_of_kind(cut.job, ToolKind::face);
    const double deep = cut.layer.z_top - cut.layer.z_bottom;
    // Its shank goes down beside what stands; its holder does not.
    const double holder = face.stickout - cut.job.cutting.holder_clearance,
                 shank = face.shank_diameter > face.diameter ? face.flute_length : holder;
    return face.diameter > cut.layer.tools.rough.diameter && deep <= std::min(holder, shank) ? &face
                                                                                             : nullptr;
}

OpenLevel plan_open_level(const LayerCut& cut, const Tool& face, const Tool& tool, const Loops& forbidden,
                          double tip_z, double above_z, bool hold) {
    OpenLevel level;
    level.whole = true;
    level.above = above_z;
    if (forbidden.empty()) return level;
    const double wider = (face.diameter - tool.diameter) / 2;
    const double blend = rough_blend(cut.job);
    const Loops kept = simplify(
        thinned_rings(cut, face, filled(offset_outline(forbidden, wider + kCollar, kOffsetError)), blend));
    level.left = offset_outline(kept, kOverlap - wider, kOffsetError);
    const double open = area(subtract(cut.stock_outline(), level.left)),
                 passes = std::ceil((above_z - tip_z) / face_step(cut.job, face) - 1e-9);
    level.saved = open / (ring_step(tool) * feed_of(cut, tool)) -
                  passes * open / (ring_step(face) * feed_of(cut, face));
    if (level.saved > 0)
        level.rings = plan_rings(cut, face, kept, tip_z, blend, hold),
        level.rings.from_open = !hold && level.rings.strips.empty();
    if (level.rings.pieces.empty()) level.left = {};
    return level;
}

void leave_below_first_gap(std::span<OpenLevel> levels) {
    bool gap = false;
    for (OpenLevel& level : levels) {
        if (!level.whole) continue;
        gap |= level.rings.pieces.empty();
        if (gap) level = {};
    }
}

namespace {

// Cuts levels until one has a run that has no way in. Returns how many levels were cut whole.
std::size_t cut_open_levels(const LayerCut& cut, const Tool& face, std::span<const OpenLevel> levels,
                            const DropIndex& part, Operation& op) {
    PathBuilder path(op, face, feed_of(cut, face), cut.layer.z_top + cut.job.machine.clearance,
                     cut.layer.z_top + 2);
    Surroundings around = cut.around(face, &part);
    around.from_side = true;
    path.set_surroundings(around);
    for (std::size_t l = 0; l < levels.size(); ++l) {
        const OpenLevel& level = levels[l];
        if (level.rings.pieces.empty()) continue;
        const double deep = level.above - to_mm(level.rings.z);
        const int passes = std::max(1, static_cast<int>(std::ceil(deep / face_step(cut.job, face) - 1e-9)));
        op.stepdown = std::max(op.stepdown, deep / passes);
        op.stepover = std::max(op.stepover, level.rings.widest_step());
        for (int pass = 1; pass <= passes; ++pass) {
            clear_from_afar(path, cut, lifted(level.rings, deep * (passes - pass) / passes));
            if (path.left_out() > 0) return l;
        }
    }
    path.finish();
    return levels.size();
}

}  // namespace

Operation clear_open_waste(const LayerCut& cut, const Tool& face, std::span<OpenLevel> levels,
                           EngagedStock* stock) {
    Operation op;
    const bool in_spindle = to_units(cut.stock_top - cut.layer.z_top) > 0;
    const DropIndex part(cut.solid, flat_cutter(face.diameter / 2 + kept_off_walls(cut.job.cutting)));
    const Standing stood = *cut.standing;
    const std::size_t no_ways = cut.no_way_in.size();
    for (;;) {
        op = cut.operation(OperationKind::rough, "open waste", face);
        op.blend = rough_blend(cut.job);
        double saved = in_spindle ? 0 : -cut.job.machine.tool_change_s / 60;
        for (const OpenLevel& level : levels)
            if (!level.rings.pieces.empty()) saved += level.saved;
        if (saved < kWorth) return op;
        const std::size_t whole = cut_open_levels(cut, face, levels, part, op);
        if (whole == levels.size()) break;
        // What it leaves out of a level the end mill would not know of: it takes the level, and all below.
        *cut.standing = stood, cut.no_way_in.resize(no_ways);
        for (OpenLevel& level : levels.subspan(whole)) level = {};
    }
    if (stock != nullptr && !op.moves.empty()) {
        stock->change_cutter(face.diameter / 2);
        cap_engagement(cut.context, op.moves, *stock,
                       {cut.job.cutting.max_engagement, face.diameter, op.stepdown});
    }
    return op;
}

}  // namespace slabwright
