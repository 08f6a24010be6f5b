// AR of a tool in a layer, by the rule that the job names (LUO 5.5.1; METHOD.md section 6).
#pragma once

#include "engine/tool_choice/select.h"
#include "kernels/access/accessibility.h"

namespace slabwright {

/// A flat or ball end mill with its shank and holder.
[[nodiscard]] ToolShape shape_of(const Tool& tool);

/// How the engine asks for accessibility by the exact rule: up to tolerances.cusp, for what finish passes may
/// leave is no reason to call a place out of reach.
/// @param lowest_tip mm
[[nodiscard]] AccessOptions access_options(const Job& job, double lowest_tip);

/// None for the rule `sections`, which select_tools() measures itself. By the exact rule the AR of a ball is
/// that of its flat twin (as wide, in the job's library) where this is larger: the foot of a wall on a floor,
/// which no ball reaches, is cleaned by a flat end mill (LUO 5.3.2).
/// @param layer  outlives the result
/// @param scene  of the layer's mesh, and outlives the result; needed for the exact rule only
[[nodiscard]] ReachRatio reach_ratio(Context& context, const LayerJob& layer, const AccessScene* scene);

}  // namespace slabwright
