// Floors over what was milled from below, and what they bear until the build is done (METHOD.md section 16).
//
// Once a slab is laid, what its underside was milled to is a floor over air: cutters push at it from above,
// and where the next slab is glued onto it, the press does. It is carried by the wood beside it that stands
// down to the layer's bottom.
#pragma once

#include <optional>
#include <vector>

#include "engine/plan.h"
#include "kernels/features/unmade_air.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// What pushes at the floors of a layer.
struct FloorLoads {
    double push_n = 0;        ///< of a cutter, along its axis, anywhere
    double pressure_mpa = 0;  ///< of the press that lays the next slab, where that is glued on
};

/// The floor of a layer that bears most.
struct LoadedFloor {
    double thickness_mm = 0;
    double reach_mm = 0;   ///< of its farthest place from what carries it
    Point3 at{};           ///< that place, on its underside
    double push_mpa = 0;   ///< bending stress under the cutter
    double press_mpa = 0;  ///< under the press
    [[nodiscard]] double stress_mpa() const { return push_mpa > press_mpa ? push_mpa : press_mpa; }
};

/// The wood over the gaps of a part.
class FloorMap {
public:
    /// @param pattern that the gaps are of. @throws as air_gaps()
    FloorMap(Context& context, MeshView pattern, const AirGaps& gaps);

    /// The floor of a layer milled on both sides that bears most, the thinner of two that bear alike: along
    /// the gaps' lines, where the four beside it are floor too. A point force at a plate that is carried from
    /// one side bends its foot by .51 N·mm a millimetre and N (Jaramillo 1950), at one carried all round by
    /// less: σ = 6 · .51 F / t². Under a pressure p, at a place that is a from what carries it, σ = 2 p
    /// (a/t)², a strip held at both sides, or 3 p (a/t)² where open air is nearer than that. What reaches
    /// less than three thicknesses is part of what carries it.
    /// @param layer as milled. @param bottom of it, mm
    [[nodiscard]] std::optional<LoadedFloor> weakest(Context& context, const MilledLayer& layer,
                                                     double bottom, const FloorLoads& loads) const;

private:
    [[nodiscard]] double top_of(std::size_t row, std::uint32_t column) const;

    const AirGaps& gaps_;
    std::vector<std::vector<double>> tops_;  // of the part, by row and column
};

/// "floor.weak", with place, thickness, reach, stress and remedy. @param layer index
[[nodiscard]] Diagnostic weak_floor(int layer, const LoadedFloor& floor, const FloorLoads& loads,
                                    double strength_mpa);

}  // namespace slabwright
