// The machine's steps (RPM; METHOD.md section 12).
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "engine/plan.h"

namespace slabwright {

/// Says which tool a tool_change puts in; for a control that keeps no lengths (knows_tool_lengths) also
/// "length": "touch off", by which the operator brings the new tip to where the last one's was touched off.
/// @param place of the magazine that the tool stands in; 0: there is no magazine
void say_tool(SequenceStep& change, int tool, const Machine& machine, int place);

/// Tells a touch_off where the layer's slab must be found, as the programs count: its edges of least x and y
/// (slab_left_mm, slab_front_mm) and its top (slab_top_mm).
void say_touch_off(SequenceStep& touch, const Plan& plan, const Layer& layer, double top);

/// Names every operation's program (program_file), with widths such that the names sort in the order of
/// execution: "L003_02_rough_T2.ngc" of layer, order within it, kind and tool; where a program holds all that
/// a tool does between two changes "L003_02_T2.ngc", where it holds a layer "L003.ngc" (machine.programs).
/// Operations that share one are "L003.ngc#1", "L003.ngc#2" …, and have one number. The undersides' programs,
/// which have their names, get numbers that none of the plan's own and of each other's have.
void name_programs(Plan& plan);

/// The number of each program, by its file.
using ProgramNumbers = std::map<std::string, int, std::less<>>;
[[nodiscard]] ProgramNumbers program_numbers(const Plan& plan);

/// Notes the layers of which a program's text has another number than before: where programs are numbered
/// through, all behind a layer that gains or loses some.
/// @param other by layer; true is left true
void note_other_numbers(const Plan& plan, const ProgramNumbers& before, std::vector<bool>& other);

/// Names the programs and fills plan.sequence and plan.totals from the layers (part_volume_mm3 is left as it
/// is); every step names the steps it needs, so that an interrupted build can resume. The machine is taken to
/// start with no tool in the spindle. Operation::minutes is taken to hold the spindle's run-up already;
/// stack_mass_kg is that of the whole slabs and the base board, before anything is cut: what the table may
/// have to carry.
void schedule(Plan& plan);

}  // namespace slabwright
