#include "kernels/repair/rebuild.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "kernels/access/standing_part.h"
#include "kernels/mesh/weld.h"
#include "kernels/parallel/parallel.h"
#include "kernels/repair/repair.h"
#include "kernels/repair/winding.h"
#include "kernels/repair/xyz.h"
#include "kernels/voxels/level_set.h"

namespace slabwright {

namespace {

constexpr double kCellsPerSquare = 20;  // sampled cells for a square cell of surface
constexpr double kFewestCells = 300;    // along the diagonal of a small part
constexpr double kBytesPerCell = 24;    // as surface_of_winding() charges them
constexpr double kBaseShare = 0.02;     // of a cell: what lies so near to the base plane lies in it
constexpr double kMemoryShare = 0.5;    // of what is left, for the cells

double cell_for(const Context& context, const MeshReport& report) {
    const double diagonal = length(minus(xyz(report.box.max), xyz(report.box.min)));
    const std::uint64_t limit = context.memory_limit(), charged = context.memory_charged();
    const double free_bytes = limit > charged ? static_cast<double>(limit - charged) : 0;
    const double cells =
        std::clamp(kMemoryShare * free_bytes / kBytesPerCell, 1e5, static_cast<double>(kMostCells) / 4);
    const double wished = std::min(kWishedCell, diagonal / kFewestCells);
    return std::max(wished, std::sqrt(kCellsPerSquare * report.area_mm2 / cells));
}

}  // namespace

Rebuilt rebuild(Context& context, MeshView mesh, MeshView given, const RebuildOptions& options) {
    Rebuilt result;
    const MeshReport report = report_mesh(context, mesh);
    result.cell_mm = options.cell_mm > 0 ? options.cell_mm : cell_for(context, report);
    const WindingTree tree(context, mesh.vertices, mesh.facets);
    result.mesh =
        surface_of_winding(context, mesh, [&](const std::array<double, 3>& p) { return tree.at(p); },
                           {.cell_mm = result.cell_mm, .most_cells = kMostCells});
    if (result.mesh.facets.empty()) return result;
    // The base is where the pattern stands: flat, whatever the last digits of its cells say.
    const float base = report.box.min.z;
    for (Vec3f& v : result.mesh.vertices)
        if (std::abs(double{v.z} - base) < kBaseShare * result.cell_mm) v.z = base;
    pair_edges(context, result.mesh);
    result.report = report_mesh(context, result.mesh.view());
    if (!is_solid(result.report)) {
        Mended mended = mend(context, result.mesh.view(), result.report);
        result.mesh = std::move(mended.mesh);
        result.report = std::move(mended.report);
    }
    result.solid = !result.mesh.facets.empty() && is_solid(result.report);
    const StandingPart rebuilt(context, result.mesh.view()), original(context, given);
    result.deviation_mm = rebuilt.farthest_from(context, original, 0);
    result.missed_mm = original.farthest_from(context, rebuilt, 0);
    return result;
}

}  // namespace slabwright
