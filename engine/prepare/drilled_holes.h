// Holes that a drill makes are taken for as round as they were drawn, not for the polygons that a mesh has.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "engine/job.h"
#include "engine/plan.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// A drill that differs by no more from a hole was meant for it, mm.
inline constexpr double kMeantFor = 0.25;

/// What of a job decides which holes are taken for round.
struct DrillRule {
    std::vector<double> diameters;  ///< mm, of the library's drills, ascending; none: nothing is rounded
    double gouge = 0;               ///< mm
    friend bool operator==(const DrillRule&, const DrillRule&) = default;
};
[[nodiscard]] DrillRule drill_rule(std::span<const Tool> tools, double gouge);

/// The pattern with every upright hole of a drill's size made round in its narrowest part, where its
/// chords lie farther within the circle than half of `gouge`. Plan and proof both take this for the pattern.
/// @param told gets a note of how many holes were rounded, and by how much the pattern grew at most
/// @return none where nothing is rounded
[[nodiscard]] std::optional<Mesh> rounded_for_drills(Context& context, MeshView pattern,
                                                     const DrillRule& rule,
                                                     std::vector<Diagnostic>* told = nullptr);

}  // namespace slabwright
