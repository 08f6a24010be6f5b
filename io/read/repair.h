// What a repair does to a pattern, in words: what it did, and what it would do.
#pragma once

#include <string>
#include <vector>

#include "engine/job.h"
#include "engine/plan.h"
#include "kernels/mesh/mesh.h"
#include "kernels/mesh/report.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// A mesh after a repair that was asked for.
struct Repaired {
    Mesh mesh;  ///< empty where the mesh needed none
    MeshReport report;
    InputRepair told;
    std::vector<Diagnostic> diagnostics;  ///< a warning for each kind of defect: repair.crack, repair.hole …
};

/// Mends a mesh that is no solid, and rebuilds its surface where that was asked for and mending leaves it
/// open. Deterministic.
/// @param how mend or rebuild. @param path of the file, for errors
/// @throws Error(input, "repair.open") where mending leaves it no solid and nothing else was asked for: says
/// what is left, where, and what to do; Error(input, "repair.nothing") where its facets enclose nothing
[[nodiscard]] Repaired repair_mesh(Context& context, MeshView mesh, const MeshReport& report, Repair how,
                                   const std::string& path);

/// One line on what --repair would do to a mesh that is refused: "--repair would close 12 cracks of at most
/// 0.03 mm and turn 3 patches over", or that only rebuilding would, or neither. Found by trying.
[[nodiscard]] std::string repair_offer(Context& context, MeshView mesh, const MeshReport& report);

}  // namespace slabwright
