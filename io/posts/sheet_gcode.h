// Programs of stock sheets: RS-274 out, and back in for the proof (io/FORMATS.md, "Sheets").
#pragma once

#include <string>
#include <string_view>

#include "engine/sheet_proof/sheet_proof.h"
#include "engine/sheets/sheet_plan.h"

namespace slabwright {

/// One program, for LinuxCNC: z = 0 at the sheet's top, x and y from its corner, millimetres. A router turns
/// its spindle and cuts every loop in depths; laser and jet are switched by M3 and M5 and dwell at each
/// pierce. A and C turn the head about the point where its axis meets the sheet's top; where they change, G93
/// gives each move its time. Comments say which stock it is for, where pieces lie and which cut follows.
/// @param index of SheetsPlan::programs
[[nodiscard]] std::string sheet_program_text(const SheetsPlan& plan, std::size_t index);

/// What such a text says. @param file for errors
/// @throws Error(verification, "gcode.…") with file:line for what is none of these words, a cut that no
/// comment names, a rapid with the jet on or the cutter in the sheet, and a program without its head or end
[[nodiscard]] ReadSheetProgram read_sheet_program(std::string_view text, const std::string& file);

}  // namespace slabwright
