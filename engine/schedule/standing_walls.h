// Walls and pins of the pattern that stand by themselves, and what the cutters' side force does to their feet
// (METHOD.md section 18).
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/plan.h"
#include "engine/schedule/joints.h"
#include "kernels/parallel/context.h"
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
};

/// @param piece one outer loop with its holes. @throws as offset()
[[nodiscard]] WallFoot wall_foot(const Loops& piece);

/// The parts of a region that are thinner than 12 mm, and thicker than what a round tool leaves of a corner.
/// @param contact_mm gets WallFoot::contact_mm of each
[[nodiscard]] std::vector<Loops> thin_parts(const Loops& region, std::vector<double>& contact_mm);

/// Warns, for each layer, of the wall or pin that the layer's cutting loads most, where its foot bears more
/// than material.strength_mpa ("wall.weak", with place, thickness, height, stress and remedy). A wall stands
/// as high over each of its feet as wood under it is thin, through the layers below too. Finishing pushes at
/// its top in the layer with its own heaviest cut of what roughing leaves; roughing, no more than a step over
/// the level that it cuts, and over feet in layers below at its top.
/// @param wood as wood_at_joints gave it
[[nodiscard]] std::vector<Diagnostic> weak_walls(Context& context, const Plan& plan,
                                                 std::span<const std::vector<JointWood>> wood);

}  // namespace slabwright
