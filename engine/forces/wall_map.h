// Walls and pins of the pattern that stand by themselves, and the side force that each bears, place by place
// (METHOD.md section 18).
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "engine/forces/min_material.h"
#include "engine/plan.h"
#include "kernels/geometry/units.h"
#include "kernels/polygons/loops.h"

namespace slabwright {

/// The foot of a wall or a pin.
struct WallFoot {
    double thickness_mm = 0;  ///< of its thickest place
    double length_mm = 0;     ///< its area over that
    double weakest_mm3 =
        0;  ///< the section modulus of the whole in its weakest direction: π·d³/32, near b·t²/6
    double contact_mm = 0;  ///< of its border, along thicker wood; 0: it stands free

    /// The bending stress by a side force at a height over the foot, MPa: F·h/W. A long wall does not carry
    /// the force over its whole length: the largest moment at the foot of a long plate under a point force at
    /// its free edge is 0.51·F a millimetre (Jaramillo 1950), as if 1.96·h of it bent. So W is that of the
    /// whole, or of a strip 1.96·h long if that is less. Thicker wood carries a wall from its ends: where
    /// these are nearer than the foot, the same with reach_mm() for h, over no more than the wall's height.
    /// @param force_n, height_mm not negative. @returns 0 for no height
    [[nodiscard]] double stress_mpa(double force_n, double height_mm) const;
    /// How far its farthest place is from thicker wood, by how many ends (or sides) lie against that, mm; 0
    /// where it stands free.
    [[nodiscard]] double reach_mm() const;
    /// With so much more wood on either side.
    [[nodiscard]] WallFoot thicker_by(double mm) const;
};

/// A foot, and what stands on it within one layer.
struct StandingFoot {
    WallFoot foot;
    std::shared_ptr<const Loops> outline;  ///< of the foot
    double z = 0;                          ///< mm
    double top = 0;                        ///< of what stands on it, mm
    bool in_layer = false;                 ///< it lies in the layer that is cut; else in one below
    std::array<double, 2> middle{};        ///< mm
};

/// A cut that pushes sideways.
struct WallPush {
    double x = 0, y = 0;       ///< mm, the cutter's axis
    double low = 0, high = 0;  ///< mm, between which wood is taken away
    double radius = 0;         ///< mm, of the cutter
    OperationKind kind = OperationKind::finish;
};

/// What the weakest of the walls beside a cut bears.
struct WallBears {
    double force_n = kUnbounded;         ///< at which its foot's stress is the wood's strength
    const StandingFoot* foot = nullptr;  ///< null: no thin wall stands there
    double height_mm = 0;                ///< at which the cut pushes, over the foot
};

/// A foot that bears too much.
struct LoadedWall {
    const StandingFoot* foot = nullptr;
    double height_mm = 0, force_n = 0, stress_mpa = 0;
};

/// What was done so that a wall does not break.
enum class WallCare : std::uint8_t {
    none,
    feeds,  ///< the least feed and several passes
    lost    ///< nothing: neither would save it
};

/// "wall.weak", with place, thickness, height, stress and remedy.
[[nodiscard]] Diagnostic weak_wall(int layer, const LoadedWall& wall, double strength_mpa, WallCare care);

/// The thin walls of one layer.
class WallMap {
public:
    /// @param feet outlive the map
    /// @param widest_mm the radius of the widest cutter that asks
    /// @param allowance_mm what roughing leaves on either side of a wall
    WallMap(std::span<const StandingFoot> feet, double strength_mpa, double widest_mm, double allowance_mm);

    /// Finishing pushes at the middle of its cut. Roughing pushes a step's height over the level that it
    /// cuts, where the foot lies in this layer, for below that level all wood stands; at the middle of its
    /// cut over feet in layers below. Facing pushes at no wall. A wall stands beside a cutter that comes as
    /// near as half a radius: a stretch is that long.
    [[nodiscard]] WallBears bears(const WallPush& push) const;

private:
    struct Near {
        const StandingFoot* foot = nullptr;
        std::array<double, 2> low{}, high{};  // of the map, mm
        OverhangMap distance;                 // from the outline
    };
    std::vector<Near> feet_;
    double strength_mpa_, allowance_mm_;
};

}  // namespace slabwright
