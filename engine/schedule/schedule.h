// Bonding of each layer and the machine's steps (RPM; method.md section 12).
#pragma once

#include "engine/plan.h"
#include "kernels/parallel/context.h"
#include "kernels/slicing/slicing.h"

namespace slabwright {

/// Where the slab of `layer` is glued: on `below` (the section just under z_bottom; for the first layer the
/// section just above it, on the base board), held back from its edges by the job's setback; fills glue,
/// glue_area_mm2, glue_centroid, press_force_n. The force is the press's own unless the glued area would see
/// more than its allowed pressure, at its most loaded edge when the slab's middle (of plan.stock_min …
/// stock_max) lies off the glue's centroid. Reports schedule.no_glue, schedule.island_without_glue,
/// schedule.weak_joint (the joint yields to the cutting force), schedule.tips (the slab's middle overhangs
/// what it lies on) and schedule.uneven_press.
void bond_layer(Layer& layer, const Loops& below, const Plan& plan, std::vector<Diagnostic>& diagnostics);

/// Names every operation's program, "L003_02_rough_T2.ngc": layer, order within it, kind and tool, with
/// widths such that the names sort in the order of execution.
void name_programs(Plan& plan);

/// Names the programs and fills plan.sequence and plan.totals from the layers (part_volume_mm3 is left as it
/// is); every step names the steps it needs, so that an interrupted build can resume. The machine is taken to
/// start with no tool in the spindle. Operation::minutes is taken to hold the spindle's run-up already;
/// stack_mass_kg is that of the whole slabs and the base board, before anything is cut: what the table may
/// have to carry.
void schedule(Plan& plan);

}  // namespace slabwright
