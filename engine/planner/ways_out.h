// What would make a pattern buildable that undercuts keep from it: other sides down, or halves.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "engine/job.h"
#include "engine/layers/layers.h"
#include "kernels/halves/halves.h"
#include "kernels/mesh/mesh.h"
#include "kernels/mesh/report.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// How a pattern builds as it lies, by its features and the job's layers; no paths are planned.
struct Lying {
    int layers = 0;
    double unmade_mm3 = 0;  ///< under overhangs thicker than tolerances.undercut
    double unmade_mm = 0;   ///< the tallest of it
    bool has_room = true;   ///< whether slab and layers hold it
};

/// That, and where the layers end, mm, ascending.
struct LayersOf {
    Lying lying;
    std::vector<double> tops;
};

/// What a plan would ask for its layers, but for the wood above a boundary, which is the job's or 5.08 mm.
/// @param mesh a solid on z = 0; it must outlive the request. @throws as find_features()
[[nodiscard]] LayerRequest quick_layer_request(Context& context, MeshView mesh, const Job& job);

/// Whether slab and layers hold a part on z = 0 of that box.
[[nodiscard]] bool has_room(const Box3& box, const Job& job);

/// @param mesh a solid on z = 0. @throws as find_features() and place_layers_optimal()
[[nodiscard]] LayersOf layers_of(Context& context, MeshView mesh, const Job& job);
[[nodiscard]] Lying lying(Context& context, MeshView mesh, const Job& job);

/// The mesh turned about the origin and set down on z = 0. @param degrees as PrepareJob::turn
[[nodiscard]] Mesh laid_down(MeshView mesh, const std::array<double, 3>& degrees);

/// One way: turned, or cut by a plane into halves that are built cut face down.
struct WayOut {
    std::optional<std::array<double, 3>> turn;  ///< degrees, as PrepareJob::turn
    std::optional<CutPlane> plane;              ///< in the frame of the mesh
    Lying outcome;                              ///< of both halves together
};

/// Tries the six sides down and planes halfway along each axis and through the widest level section, and
/// returns those that leave less than half of what the pattern as it lies does, the best first: least
/// unmade, then fewest layers; at most four. Each is looked at as a plan looks at it, so what it is said to
/// leave is what its plan leaves unmade. Planes that cannot be cut are left out. Deterministic. Some tenths
/// of a second a way.
/// @param as_it_lies of the mesh
[[nodiscard]] std::vector<WayOut> ways_out(Context& context, MeshView mesh, const MeshReport& report,
                                           const Job& job, const Lying& as_it_lies);

}  // namespace slabwright
