// The programs of a plan's layers.
#pragma once

#include <array>
#include <vector>

#include "engine/plan.h"
#include "engine/schedule/joints.h"
#include "engine/schedule/standing_walls.h"
#include "kernels/mesh/mesh.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// A part [from, to] of the request's progress.
struct ProgressShare {
    double from = 0, to = 1;
    [[nodiscard]] double at(double part) const { return from + part * (to - from); }
};

/// The programs of all layers, with their diagnostics.
/// @param plan   its layers bonded
/// @param joints what each layer lies on is that of its first
/// @param feet   of each layer's thin walls
/// @param origin of the frame that places are told in
/// @throws as plan_layer() and check_travel(); Error(no_plan, "plan.empty") where nothing would be cut
void cut_layers(Context& context, Plan& plan, MeshView pattern,
                const std::vector<std::vector<JointWood>>& joints,
                const std::vector<std::vector<StandingFoot>>& feet, ProgressShare share,
                const std::array<double, 2>& origin);

}  // namespace slabwright
