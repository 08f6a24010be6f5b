// The volume of the solid that a mesh means, where its bodies overlap, are nested or inside out: each point
// of it counts once, whatever its winding number.
#pragma once

#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

struct SolidVolume {
    double mm3 = 0;
    /// How far two halves of the sections that it is made of lie apart, mm³: 0 where nothing overlaps.
    double uncertain_mm3 = 0;
};

/// V = V₀ + ∫ (A(z) − A₀(z)) dz: V₀ and A₀ count winding numbers as they are, A counts 1 where they are not
/// zero. V₀ is exact, and so what the sum over sections misses is a share of the overlaps alone. Where all
/// facets are surface it is V₀. Deterministic.
/// @param mesh with neighbours and roles
/// @param signed_mm3 V₀, MeshReport::volume_mm3
/// @throws Error(cancelled), Error(no_plan, "memory.limit")
[[nodiscard]] SolidVolume solid_volume(Context& context, MeshView mesh, double signed_mm3);

}  // namespace slabwright
