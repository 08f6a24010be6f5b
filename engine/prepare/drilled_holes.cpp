#include "engine/prepare/drilled_holes.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "kernels/features/rounded_holes.h"

namespace slabwright {

namespace {

constexpr double kChordShare = 0.5;   // of the gouge tolerance: what a drill may cut into chords
constexpr double kFinerShare = 0.15;  // of the same, of rounded holes

}  // namespace

DrillRule drill_rule(std::span<const Tool> tools, double gouge) {
    DrillRule rule{{}, gouge};
    for (const Tool& tool : tools)
        if (tool.kind == ToolKind::drill) rule.diameters.push_back(tool.diameter);
    std::sort(rule.diameters.begin(), rule.diameters.end());
    return rule;
}

std::optional<Mesh> rounded_for_drills(Context& context, MeshView pattern, const DrillRule& rule,
                                       std::vector<Diagnostic>* told) {
    if (rule.diameters.empty()) return std::nullopt;
    std::vector<RoundHole> holes;
    for (const RoundHole& hole : find_holes(context, pattern))
        if (std::optional<RoundHole> part = narrowest_part(hole)) holes.push_back(std::move(*part));
    std::erase_if(holes, [&](const RoundHole& hole) {
        return hole.chord_mm <= kChordShare * rule.gouge ||
               std::none_of(rule.diameters.begin(), rule.diameters.end(),
                            [&](double d) { return std::abs(d - hole.diameter_mm) <= kMeantFor; });
    });
    std::optional<RoundedMesh> rounded =
        with_rounded_holes(context, pattern, holes, kFinerShare * rule.gouge);
    if (!rounded) return std::nullopt;
    if (told != nullptr) {
        double most = 0;
        for (const std::size_t i : rounded->rounded) most = std::max(most, holes[i].chord_mm);
        const Point3& mouth = holes[rounded->rounded.front()].mouth;
        told->push_back(
            {Severity::note, "hole.rounded",
             fmt::format("{} hole{} of a drill's size {} made and proven round: the mesh's chords "
                         "lie up to {:.3f} mm within the circle through their corners",
                         rounded->rounded.size(), rounded->rounded.size() == 1 ? "" : "s",
                         rounded->rounded.size() == 1 ? "is" : "are", most),
             std::array<double, 3>{mouth[0], mouth[1], mouth[2]}});
    }
    return std::move(rounded->mesh);
}

}  // namespace slabwright
