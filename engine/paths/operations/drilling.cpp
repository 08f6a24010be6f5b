#include "engine/paths/operations/drilling.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace slabwright {

namespace {

Operation drill_with(const LayerCut& cut, const Tool& tool, const std::vector<DrilledHole>& holes) {
    Operation op = cut.operation(OperationKind::drill, "holes", tool);
    PathBuilder path(op, tool, std::min(tool.plunge_feed, cut.job.machine.max_feed),
                     cut.layer.z_top + cut.job.machine.clearance, cut.layer.z_top + kLinkOverHoles);
    for (const DrilledHole& hole : in_order(holes)) peck(path, op, tool, hole);
    if (!path.finish()) op.moves.clear();
    return op;
}

}  // namespace

std::vector<DrilledHole> in_order(std::vector<DrilledHole> holes) {
    for (std::size_t i = 0; i < holes.size(); ++i) {
        const auto rank = [&](const DrilledHole& h) {
            const double far = i == 0 ? h.x : std::hypot(h.x - holes[i - 1].x, h.y - holes[i - 1].y);
            return std::tuple(far, h.x, h.y);
        };
        const auto from = holes.begin() + static_cast<std::ptrdiff_t>(i);
        std::iter_swap(from, std::min_element(from, holes.end(), [&](const auto& a, const auto& b) {
                           return rank(a) < rank(b);
                       }));
    }
    return holes;
}

void peck(PathBuilder& path, Operation& op, const Tool& drill, const DrilledHole& hole) {
    const Point2 at{to_units(hole.x), to_units(hole.y)};
    const double deep = hole.top - hole.tip;
    const int pecks = std::max(1, static_cast<int>(std::ceil(deep / drill.stepdown_max - 1e-9)));
    op.stepdown = std::max(op.stepdown, deep / pecks);
    for (int k = 1; k <= pecks; ++k) {
        path.go_above(at);
        path.sink(to_units(hole.top - deep * (k - 1) / pecks + kAirOverHole));
        path.plunge(to_units(hole.top - deep * k / pecks));
        path.retract();
    }
}

std::vector<Operation> drill_holes(const LayerCut& cut) {
    std::vector<Operation> operations;
    for (const Tool& tool : cut.job.tools) {
        std::vector<DrilledHole> holes;
        for (const DrilledHole& hole : cut.layer.drilled)
            if (hole.tool == tool.number) holes.push_back(hole);
        if (!holes.empty()) operations.push_back(drill_with(cut, tool, holes));
    }
    return operations;
}

}  // namespace slabwright
