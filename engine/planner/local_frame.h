// The frame in which a plan is made: beside the pattern, wherever that lies. Far from the origin a float
// tells less, and lines at multiples of a step would meet the pattern elsewhere after every move of it.
#pragma once

#include <array>
#include <vector>

#include "engine/plan.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// Where x and y count from while a pattern in this box is planned, mm: the box's lower corner, rounded down
/// to a sixteenth of a millimetre, which is exact in binary and in 0.1 µm.
/// @throws Error(no_plan, "input.far") where paths could not be told in 0.1 µm of 32 bits
[[nodiscard]] std::array<double, 2> local_origin(const Box3& box);

/// Vertices counted from an origin, mm. Exact for every float that is no farther from there than from zero.
[[nodiscard]] BulkVector<Vec3f> in_local_frame(Context& context, MeshView mesh,
                                               const std::array<double, 2>& origin);

/// Gives all places of a plan, which count from an origin, in the frame that the origin is told in.
void leave_local_frame(Plan& plan, const std::array<double, 2>& origin);

}  // namespace slabwright
