// Stock sheets as drawings: DXF for a cutter's own program, SVG for people.
#pragma once

#include <string>

#include "engine/sheets/sheet_plan.h"

namespace slabwright {

/// R12 DXF, millimetres, from the stock's corner. Layers: CUT and HOLE hold the closed ways of the axis at
/// the sheet's top, of outlines and holes; LABEL the pieces' numbers, TAB the tabs and necks that
/// are cut off later.
/// @param index of SheetsPlan::programs
[[nodiscard]] std::string sheet_dxf(const SheetsPlan& plan, std::size_t index);

/// A region in the same layers, labelled.
[[nodiscard]] std::string loops_dxf(const Loops& loops, const std::string& label);

/// The same, with the stock's edge and the ways in.
[[nodiscard]] std::string sheet_svg(const SheetsPlan& plan, std::size_t index);

}  // namespace slabwright
