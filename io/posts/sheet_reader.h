// Programs of stock sheets read back for the proof (io/FORMATS.md, "Sheets").
#pragma once

#include <string>
#include <string_view>

#include "engine/sheet_proof/sheet_proof.h"

namespace slabwright {

/// What the text of such a program says. @param file for errors
/// @throws Error(verification, "gcode.…") with file:line for what is none of these words, a cut that no
/// comment names, a rapid with the jet on or the cutter in the sheet, and a program without its head or end
[[nodiscard]] ReadSheetProgram read_sheet_program(std::string_view text, const std::string& file);

}  // namespace slabwright
