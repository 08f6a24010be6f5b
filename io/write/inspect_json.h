// What `slabwright inspect` finds in a file: the mesh report, features, undercuts, sharp edges, narrow
// cavities; no plan.
#pragma once

#include <string>
#include <vector>

#include "engine/planner/milled_ways.h"
#include "engine/tool_choice/cavity_tools.h"
#include "io/read/pattern_mesh.h"
#include "io/slabwright.h"
#include "kernels/features/draw.h"
#include "kernels/features/edge_chains.h"
#include "kernels/features/features.h"
#include "kernels/features/holes.h"

namespace slabwright {

struct Inspection {
    InputInfo input;
    MeshReport report;
    std::vector<Diagnostic> diagnostics;
    bool solid = false;  ///< whether a planner may use the mesh; features, holes and undercuts are looked for
                         ///< only then
    std::string unusable;  ///< why not, in one line
    std::vector<Feature> features;
    std::vector<FinderDisagreement> disagreements;
    /// What would stay unmade if the pattern were one layer; layer boundaries can only make it less.
    std::vector<UnmadeUndercut> undercuts;
    std::vector<RoundHole> holes;
    /// Of the job's layers; not looked for where none can be placed.
    std::vector<CavityAdvice> cavities;
    CavityOptions cavity_limits;
    std::vector<EdgeChain> edges;
    double edge_limit_deg = 0;
    /// What the job's layers would leave as it lies, and where that is anything, on its other five sides too.
    std::vector<MilledWay> ways;
    DrawReport draw;
};

/// Reads the file and looks at it. @throws Error(input | usage | cancelled) as read_pattern_mesh; a mesh that
/// is read but not solid is a finding; Error(usage, "draw.limits"), and where the map cannot be written
/// Error(input)
[[nodiscard]] Inspection inspect_pattern(Context& context, const PatternSource& source, const Job& job,
                                         const InspectionOptions& options = {});

/// Schema slabwright.inspect/1.
[[nodiscard]] std::string inspection_json(const Inspection& inspection);

/// The same for people: a few lines of plain text.
[[nodiscard]] std::string inspection_text(const Inspection& inspection);

}  // namespace slabwright
