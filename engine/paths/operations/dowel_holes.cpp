#include "engine/paths/operations/dowel_holes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "engine/moves/path_builder.h"
#include "engine/paths/operations/drilling.h"
#include "kernels/errors.h"

namespace slabwright {

namespace {

constexpr double kChords = 0.0048;  // of a turn's radius, within which its chords lie

bool reaches(const Job& job, const Tool& tool, double depth) {
    const double deep = depth + point_below(tool);
    return tool.flute_length >= deep && tool.stickout - job.cutting.holder_clearance >= deep;
}

/// The tool of the library that makes dowel holes as wide and as deep, mm: a drill, else the widest end mill
/// that bores them. None: nullptr.
const Tool* maker_of(const Job& job, double hole, double depth) {
    const Tool* widest = nullptr;
    for (const Tool& tool : job.tools) {
        if (!reaches(job, tool, depth)) continue;
        // The wood that is kept around dowels is for points no longer than those of 118 degrees.
        const bool is_short = tool.point_deg >= Tool{}.point_deg;
        if (tool.kind == ToolKind::drill && is_short && std::abs(tool.diameter - hole) <= kSameDowel)
            return &tool;
        if (can_bore(tool, hole) && (widest == nullptr || tool.diameter > widest->diameter)) widest = &tool;
    }
    return widest;
}

/// Which dowels the library has a tool for, in words; "" for none.
std::string dowels_that_can_be(const Job& job, double depth) {
    const std::optional<double> size = dowel_size(job, depth);
    return size ? fmt::format("; or take dowels.diameter = {}, whose holes T{} makes", *size,
                              maker_of(job, *size, depth)->number)
                : "";
}

}  // namespace

double point_below(const Tool& tool) {
    return tool.kind == ToolKind::drill ? tool.diameter / 2 / std::tan(cutter_shape(tool).taper_rad) : 0;
}

const Tool& dowel_tool(const Job& job, double depth) {
    const double hole = job.dowels.diameter;
    if (const Tool* const tool = maker_of(job, hole, depth)) return *tool;
    throw Error(ErrorKind::usage, "dowel.tool",
                fmt::format("no tool makes dowel holes of {:g} mm, {:.1f} mm deep", hole, depth), "tool",
                fmt::format("add a drill of {0:g} mm with flutes and stick-out for that depth, or a flat end "
                            "mill between {1:g} and {0:g} mm, narrower by more than its core_diameter{2}",
                            hole, hole / 2, dowels_that_can_be(job, depth)));
}

std::optional<double> dowel_size(const Job& job, double depth) {
    for (const double diameter : {job.dowels.diameter, 8.0, 10.0, 6.0, 12.0, 14.0, 16.0, 18.0, 20.0, 5.0})
        if (maker_of(job, diameter, depth) != nullptr) return diameter;
    return std::nullopt;
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
        holes.push_back({dowel.x, dowel.y, layer.z_top, layer.z_top - dowel.below - point_below(tool),
                         tool.number,
                         tool.kind == ToolKind::drill ? 0 : (job.dowels.diameter - tool.diameter) / 2});
    for (const DrilledHole& hole : in_order(std::move(holes)))
        if (tool.kind == ToolKind::drill) peck(path, op, tool, hole);
        else bore(path, op, tool, hole, kChords * hole.around);
    if (!path.finish()) op.moves.clear();
    return op;
}

}  // namespace slabwright
