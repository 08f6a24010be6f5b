#include "engine/paths/operations/dowel_holes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "engine/moves/path_builder.h"
#include "engine/paths/operations/drilling.h"
#include "kernels/errors.h"

namespace slabwright {

namespace {

constexpr int kChords = 32;              // of a turn: they lie within .5 % of its radius
constexpr double kOverCore = 1.02;       // of a core's diameter: by so much a hole is wider than its end mill
constexpr double kLeastClearance = 0.1;  // mm, the same of one without a core

bool reaches(const Job& job, const Tool& tool, double depth) {
    const double deep = depth + point_below(tool);
    return tool.flute_length >= deep && tool.stickout - job.cutting.holder_clearance >= deep;
}

bool can_bore(const Tool& tool, double hole) {
    const double wider = hole - tool.diameter;
    return tool.kind == ToolKind::flat && tool.diameter >= hole / 2 && wider >= kLeastClearance &&
           wider >= kOverCore * core_diameter_of(tool);
}

std::vector<PathPoint> turn(Point2 middle, double radius, std::int32_t z) {
    std::vector<PathPoint> ring;
    for (int k = 0; k <= kChords; ++k) {
        const double angle = 2 * std::numbers::pi * (k % kChords) / kChords;
        ring.push_back({middle.x + to_units(radius * std::cos(angle)),
                        middle.y + to_units(radius * std::sin(angle)), z});
    }
    return ring;
}

/// Down on a helix, a level turn at the bottom, out in the middle.
void bore(PathBuilder& path, Operation& op, const Tool& tool, const DrilledHole& hole, double radius) {
    const Point2 middle{to_units(hole.x), to_units(hole.y)};
    const std::vector<PathPoint> ring = turn(middle, radius, 0);
    const double around = 2 * std::numbers::pi * radius,
                 pitch = std::min(tool.stepdown_max, path.slope_around(ring) * around),
                 deep = hole.top - hole.tip;
    const int turns = std::max(1, static_cast<int>(std::ceil(deep / pitch - 1e-9)));
    op.stepdown = std::max(op.stepdown, deep / turns);
    const Point2 begin{ring.front().x, ring.front().y};
    path.go_above(begin);
    path.sink(to_units(hole.top + kAirOverHole));
    path.plunge(to_units(hole.top));
    for (int k = 1; k <= turns * kChords; ++k) {
        const PathPoint& at = ring[static_cast<std::size_t>(k % kChords)];
        path.cut({at.x, at.y}, to_units(hole.top - deep * k / (turns * kChords)));
    }
    for (int k = 1; k <= kChords; ++k) {
        const PathPoint& at = ring[static_cast<std::size_t>(k % kChords)];
        path.cut({at.x, at.y}, to_units(hole.tip));
    }
    path.cut(middle, to_units(hole.tip));
    path.retract();
}

}  // namespace

double point_below(const Tool& tool) {
    return tool.kind == ToolKind::drill ? tool.diameter / 2 / std::tan(cutter_shape(tool).taper_rad) : 0;
}

const Tool& dowel_tool(const Job& job, double depth) {
    const double hole = job.dowels.diameter;
    const Tool* widest = nullptr;
    for (const Tool& tool : job.tools) {
        if (!reaches(job, tool, depth)) continue;
        if (tool.kind == ToolKind::drill && std::abs(tool.diameter - hole) <= kSameDowel) return tool;
        if (can_bore(tool, hole) && (widest == nullptr || tool.diameter > widest->diameter)) widest = &tool;
    }
    if (widest != nullptr) return *widest;
    throw Error(ErrorKind::usage, "dowel.tool",
                fmt::format("no tool makes dowel holes of {:g} mm, {:.1f} mm deep", hole, depth), "tool",
                fmt::format("add a drill of {0:g} mm with flutes and stick-out for that depth, or a flat end "
                            "mill between {1:g} and {0:g} mm, narrower by more than its core_diameter",
                            hole, hole / 2));
}

Operation dowel_holes(const Job& job, const Layer& layer, const Tool& tool) {
    Operation op;
    op.kind = OperationKind::drill;
    op.purpose = "dowel holes";
    op.tool = tool.number;
    op.spindle_rpm = std::min(tool.max_rpm, job.machine.max_rpm);
    PathBuilder path(op, tool, std::min(tool.plunge_feed, job.machine.max_feed),
                     layer.z_top + job.machine.clearance, layer.z_top + kLinkOverHoles);
    std::vector<DrilledHole> holes;
    for (const JointDowel& dowel : layer.dowels)
        holes.push_back(
            {dowel.x, dowel.y, layer.z_top, layer.z_top - dowel.below - point_below(tool), tool.number});
    for (const DrilledHole& hole : in_order(std::move(holes)))
        if (tool.kind == ToolKind::drill) peck(path, op, tool, hole);
        else bore(path, op, tool, hole, (job.dowels.diameter - tool.diameter) / 2);
    if (!path.finish()) op.moves.clear();
    return op;
}

}  // namespace slabwright
