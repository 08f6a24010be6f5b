// Whether slab, chamber and machine have room for a pattern.
#pragma once

#include <string>

#include "engine/plan.h"
#include "kernels/errors.h"
#include "kernels/mesh/mesh.h"

namespace slabwright {

/// The Error(no_plan) of a part that cannot be made.
[[nodiscard]] Error refusal(const char* code, std::string message, std::string place, std::string remedy);

/// Sets the plan's stock: the pattern's outline and the job's margin around it, no larger than a slab, and
/// such that the machine reaches all of it.
/// @param box of the pattern, mm
/// @throws Error(no_plan) "fit.slab", "fit.travel", "fit.flask" or "fit.chamber", saying by how many mm it is
/// too large
void place_stock(Plan& plan, const Box3& box);

/// @throws Error(no_plan, "fit.travel") where a program leaves the machine's travel, arcs included
void check_travel(const Plan& plan);

/// @throws Error(no_plan, "fit.mass") where the stack is heavier than the build platform carries
void check_mass(const Plan& plan);

}  // namespace slabwright
