// Where a vertex goes when its facets move along their normals.
#pragma once

#include <optional>
#include <span>

#include "kernels/geometry/vectors.h"

namespace slabwright {

/// A plane through a vertex, and how far it moves along its unit normal, in units of the skin.
struct OffsetPlane {
    Vec3d normal{};
    double move = 1;
};

/// The shortest V with N·V ≥ move for every plane, so that no facet at the vertex ends nearer than asked; it
/// corrects eq. 3 of FINISH 2.2, whose equal weights let some facets end nearer (METHOD.md section 15). A
/// quadratic program in three unknowns, solved exactly on the at most three planes that bind. Among them the
/// cube corner's (1, 1, 1). O(n) a step, a few steps. None where no V exists: the normals do not lie in one
/// half-space. Deterministic in the planes' order.
/// @param planes unit normals; equal ones cost nothing
[[nodiscard]] std::optional<Vec3d> offset_vertex(std::span<const OffsetPlane> planes);

}  // namespace slabwright
