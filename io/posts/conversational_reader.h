// HEIDENHAIN's conversational programs in: numbered blocks of L, CC, C, TOOL CALL, CYCL DEF 9 and 32.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "io/posts/gcode_reader.h"

namespace slabwright {

/// What a program of a HEIDENHAIN control (TNC) commands.
///
/// Understands BEGIN PGM and END PGM with name and MM or INCH, comments (; to the end), L with X Y Z R0 F
/// FMAX M, CC X Y, C X Y DR+ or DR- F, TOOL CALL with axis Z and S, CYCL DEF 9 (dwell) and CYCL DEF 32
/// (tolerance), M3, M5, M2, M30 alone in a block. FMAX holds for its block only, F from block to block.
/// Coordinates are absolute; in inches F counts tenths of an inch a minute.
/// @throws Error(verification): gcode.block for blocks that are not numbered one after another, gcode.begin,
///   gcode.no_end, gcode.units for another unit than the dialect's, gcode.unknown_word, gcode.number,
///   gcode.twice, gcode.tool, gcode.unset, gcode.feed, gcode.arc, gcode.spindle, gcode.unknown_place,
///   gcode.path_mode, gcode.dwell, gcode.after_end and those of check_characters()
/// @param several it may hold one operation after another, as read_operations() takes them; else the list has
///   one program
[[nodiscard]] std::vector<Program> read_conversational(std::string_view text, const std::string& file,
                                                       const Dialect& dialect, const GcodeLimits& limits,
                                                       bool several);

}  // namespace slabwright
