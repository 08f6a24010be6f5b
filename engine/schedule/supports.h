// Supports (METHOD.md section 18): columns of stock that are left standing under what nothing of the pattern
// carries, and are sawn off by hand when the pattern is done. To everything that plans, cuts and proves they
// are part of the solid.
#pragma once

#include <span>
#include <vector>

#include "engine/plan.h"
#include "engine/schedule/joints.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// Columns for the joints that cannot hold: under pieces of a layer with nothing under them, and under what
/// newly hangs over above a joint that its load would break. They stand on the pattern where it reaches under
/// the whole of them, else on the board.
/// @param plan its layers, stock, flask; the supports that it has stand already
/// @param wood of every layer, with those supports
/// @return none where every joint holds, or nothing more can be done
[[nodiscard]] std::vector<Support> place_supports(const Plan& plan,
                                                  std::span<const std::vector<JointWood>> wood);

/// The pattern with its supports as further bodies. Facets and vertices of the pattern keep their numbers.
[[nodiscard]] Mesh with_supports(Context& context, MeshView pattern, std::span<const Support> supports);

}  // namespace slabwright
