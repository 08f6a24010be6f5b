// Programs of stock sheets as RS-274 (io/FORMATS.md, "Sheets").
#pragma once

#include <string>

#include "engine/sheets/sheet_plan.h"

namespace slabwright {

/// One program, for LinuxCNC: z = 0 at the sheet's top, x and y from its corner, millimetres. A router turns
/// its spindle and cuts every loop in depths; laser and jet are switched by M3 and M5 and dwell at each
/// pierce. A and C turn the head about the point where its axis meets the sheet's top; where they change, G93
/// gives each move its time. Comments say which stock it is for, where pieces lie and which cut follows.
/// @param index of SheetsPlan::programs
[[nodiscard]] std::string sheet_program_text(const SheetsPlan& plan, std::size_t index);

}  // namespace slabwright
