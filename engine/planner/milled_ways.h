// What of a pattern stays unmade on each of its six sides, its slabs milled from above or on both sides.
#pragma once

#include <array>
#include <vector>

#include "engine/job.h"
#include "kernels/features/unmade_air.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// Layers, and what they leave.
struct MilledLayers {
    std::vector<double> tops;  ///< mm, ascending, from the pattern's bottom as it lies
    UnmadeAir air;             ///< its places count as those of the mesh that was asked about
};

/// A side down.
struct MilledWay {
    std::array<double, 3> turn{};  ///< degrees, as PrepareJob::turn
    std::array<double, 3> size{};  ///< of the pattern as it then lies, mm
    bool has_room = true;          ///< whether slab and layers hold it
    MilledLayers above;            ///< layers as the job's strategy has them, milled from above
    MilledLayers both_sides;       ///< layers of place_layers_both_sides(), of the job's slabs
};

/// The six sides down, as it lies first. All that stays is counted, however thin; `combined` counts as
/// `optimal`. No tool sizes: a tool may reach less. Deterministic; some tenths of a second each for a million
/// facets.
/// @param mesh a solid. @throws as lying()
[[nodiscard]] std::vector<MilledWay> milled_ways(Context& context, MeshView mesh, const Job& job);

/// One of them.
[[nodiscard]] MilledWay milled_way(Context& context, MeshView mesh, const Job& job,
                                   const std::array<double, 3>& turn);

}  // namespace slabwright
