#include "engine/paths/operations/drilling.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

namespace slabwright {

namespace {

constexpr double kHelixShare = 0.15;     // of the cusp, by which a helix's chords lie within the circle
constexpr int kLeastChords = 32;         // of a turn
constexpr double kOverCore = 1.02;       // of a core's diameter: by so much a hole is wider than its end mill
constexpr double kLeastClearance = 0.1;  // mm, the same of one without a core

std::vector<PathPoint> turn(Point2 middle, double radius, int chords) {
    std::vector<PathPoint> ring;
    for (int k = 0; k <= chords; ++k) {
        const double angle = 2 * std::numbers::pi * (k % chords) / chords;
        ring.push_back({middle.x + to_units(radius * std::cos(angle)),
                        middle.y + to_units(radius * std::sin(angle)), 0});
    }
    return ring;
}

// Of a turn whose chords lie no more than `within` mm inside it; a hair less than the least number is it.
int chords_of(double radius, double within) {
    const double half = std::acos(std::clamp(1 - within / radius, -1.0, 1.0));
    return std::max(kLeastChords, static_cast<int>(std::ceil(std::numbers::pi / half - 0.2)));
}

Operation drill_with(const LayerCut& cut, const Tool& tool, const std::vector<DrilledHole>& holes) {
    const bool drills = tool.kind == ToolKind::drill;
    Operation op = cut.operation(OperationKind::drill, drills ? "holes" : "bored holes", tool);
    PathBuilder path(op, tool, std::min(tool.plunge_feed, cut.job.machine.max_feed),
                     cut.layer.z_top + cut.job.machine.clearance, cut.layer.z_top + kLinkOverHoles);
    for (const DrilledHole& hole : in_order(holes))
        if (drills) peck(path, op, tool, hole);
        else bore(path, op, tool, hole, kHelixShare * cut.job.tolerances.cusp);
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

bool can_bore(const Tool& tool, double diameter) {
    const double wider = diameter - tool.diameter;
    return tool.kind == ToolKind::flat && tool.diameter >= diameter / 2 && wider >= kLeastClearance &&
           wider >= kOverCore * core_diameter_of(tool);
}

void bore(PathBuilder& path, Operation& op, const Tool& tool, const DrilledHole& hole, double chord_mm) {
    const Point2 middle{to_units(hole.x), to_units(hole.y)};
    const int chords = chords_of(hole.around, chord_mm);
    const std::vector<PathPoint> ring = turn(middle, hole.around, chords);
    const double around = 2 * std::numbers::pi * hole.around,
                 pitch = std::min(tool.stepdown_max, path.slope_around(ring) * around),
                 deep = hole.top - hole.tip;
    const int turns = std::max(1, static_cast<int>(std::ceil(deep / pitch - 1e-9)));
    op.stepdown = std::max(op.stepdown, deep / turns);
    const Point2 begin{ring.front().x, ring.front().y};
    path.go_above(begin);
    path.sink(to_units(hole.top + kAirOverHole));
    path.plunge(to_units(hole.top));
    for (int k = 1; k <= turns * chords; ++k) {
        const PathPoint& at = ring[static_cast<std::size_t>(k % chords)];
        path.cut({at.x, at.y}, to_units(hole.top - deep * k / (turns * chords)));
    }
    for (int k = 1; k <= chords; ++k) {
        const PathPoint& at = ring[static_cast<std::size_t>(k % chords)];
        path.cut({at.x, at.y}, to_units(hole.tip));
    }
    path.cut(middle, to_units(hole.tip));
    path.retract();
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
