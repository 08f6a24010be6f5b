// Walls and pins of the pattern that stand by themselves, found in the wood at the joints
// (METHOD.md section 18).
#pragma once

#include <span>
#include <vector>

#include "engine/forces/wall_map.h"
#include "engine/plan.h"
#include "engine/schedule/joints.h"
#include "kernels/parallel/context.h"
#include "kernels/polygons/loops.h"

namespace slabwright {

/// @param piece one outer loop with its holes. @throws as offset()
[[nodiscard]] WallFoot wall_foot(const Loops& piece);

/// The parts of a region that are thinner than 12 mm, and thicker than what a round tool leaves of a corner.
/// @param contact_mm gets WallFoot::contact_mm of each
[[nodiscard]] std::vector<Loops> thin_parts(const Loops& region, std::vector<double>& contact_mm);

/// The feet of the walls and pins that stand in each layer. A wall stands as high over each of its feet as
/// wood under it is thin, through the layers below too. A bump, or a web as short as three thicknesses, is
/// part of what it stands against, and not among them.
/// @param wood as wood_at_joints gave it
[[nodiscard]] std::vector<std::vector<StandingFoot>> standing_feet(
    Context& context, const Plan& plan, std::span<const std::vector<JointWood>> wood);

/// What WallMap needs of a job's cutters: the widest that pushes at walls, mm.
[[nodiscard]] double widest_beside_walls(const Job& job);

/// Where no stretch of a program is looked at (nominal engagement): warns, for each layer, of the wall or pin
/// that the layer's operations load most, where its foot bears more than material.strength_mpa ("wall.weak").
/// Finishing pushes at its top in the layer with its own heaviest cut of what roughing leaves; roughing, no
/// more than a step over the level that it cuts, and over feet in layers below at its top.
/// @param feet as standing_feet gave them
[[nodiscard]] std::vector<Diagnostic> weak_walls(const Plan& plan,
                                                 std::span<const std::vector<StandingFoot>> feet);

}  // namespace slabwright
