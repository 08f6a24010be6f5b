// What is settled once a layer's programs are known: their times, and whether its joints bear them.
#pragma once

#include <array>
#include <vector>

#include "engine/plan.h"
#include "engine/schedule/joints.h"

namespace slabwright {

/// Sets lengths and minutes of an operation, without the way from the one before; its forces too where the
/// job takes cuts as nominal, with a diagnostic where the cutter bends too far.
void rate(const Job& job, const Layer& layer, Operation& operation, std::vector<Diagnostic>& diagnostics);

/// Adds to the operations' minutes the ways from the end of each to the begin of the next.
/// @param rated for each layer whether its operations have just been rated; empty: all have
void add_approaches(Plan& plan, const std::vector<bool>& rated = {});

/// The first joint that cannot hold is a refusal, unless the job accepts it; all others are warned of.
/// @param found by layer. @throws Error(no_plan) with the joint's own code
void settle_joints(Plan& plan, const std::vector<std::vector<WeakJoint>>& found,
                   const std::array<double, 2>& origin = {});

}  // namespace slabwright
