// Bonding of each layer and the machine's steps (RPM; method.md section 12).
#pragma once

#include "engine/plan.h"
#include "kernels/parallel/context.h"
#include "kernels/slicing/slicing.h"

namespace slabwright {

/// Where the slab of `layer` is glued: on `below` (the section just under z_bottom; for the first layer the section just
/// above it, on the base board), held back from its edges; fills glue, glue_area_mm2, glue_centroid, press_force_n.
/// Reports a glued area too small for its layer, and a centroid from which the press would tip the slab.
void bond_layer(Layer& layer, const Loops& below, const Plan& plan, std::vector<Diagnostic>& diagnostics);

/// Fills plan.sequence and plan.totals from the layers; every step names the steps it needs, so that an interrupted
/// build can resume.
void schedule(Plan& plan);

}  // namespace slabwright
