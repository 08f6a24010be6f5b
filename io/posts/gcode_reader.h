// Programs in: those that this project emits, in the dialect of their control, and no more of its language
// than a router's operator would expect.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "engine/simulate/program.h"
#include "io/posts/dialect.h"

namespace slabwright {

struct GcodeLimits {
    double arc_error = 1e-4;  ///< mm: chords that stand for an arc lie this near to it
    double level_arc_error =
        0;  ///< mm: those of arcs that Program::arcs holds need be no nearer than this; 0: than arc_error
    double arc_radius_error = 0.005;  ///< mm: the two radii of an arc may differ by this
};

/// What a LinuxCNC program commands, line by line, arcs as chords; Program::arcs holds the level ones whose
/// two radii agree to twice arc_error, or to what rounding to the dialect's last decimal does.
///
/// Understands comments, line numbers, a % before and after the program, G0–G3 (centre I J K, in planes G17
/// G18 G19, or radius R), G4, G8, G17–G19, G20/G21, G40, G43 (length offset of the tool that is loaded: taken
/// as measured), G49, G54, G61, G64 P (Q), G80, G90/G91, G90.1/G91.1, G94, G97, M2, M3, M5, M6, M9, M30, M48,
/// F, S, T, H, and modal motion. Words of a line act in LinuxCNC's order.
///
/// Nothing is taken for granted of what the machine was left in (ModalState): before its first motion a
/// program must state tool, length offset, work offset, units, plane, distances, feed mode, G40, G8, G97 and
/// the path mode.
/// @throws Error(verification, "gcode.…") with file:line for any other word, number or byte, and for every
///   program that LinuxCNC refuses or runs by what is not in its text: a word twice on a line, a line too
///   long, a motion before what decides where it goes, a motion without feed (G1 with no F), a feed motion
///   from or to an unknown place, an arc that is none, a tool change that names no tool, a second one, words
///   after M2 or M30 or none of them at the end, inches or increments left in force, a coordinate beyond 214
///   m
[[nodiscard]] Program read_gcode(std::string_view text, const std::string& file,
                                 const GcodeLimits& limits = {});

/// The same of a program in any dialect (io/FORMATS.md has each one's words): the modal state of its control
/// is known at every motion, and what the control does not know is refused.
/// @throws Error(verification, "gcode.…") with file:line as read_gcode(); also gcode.decimal_point,
///   gcode.program_number, gcode.block for HEIDENHAIN's numbered blocks
[[nodiscard]] Program read_program_text(std::string_view text, const std::string& file,
                                        const Dialect& dialect, const GcodeLimits& limits = {});

/// The same of a program that holds one operation after another: each begins where the spindle is started,
/// or started again (M3), and is a Program of its own, with lines counted from the text's first. What is in
/// force stays so from one to the next; a tool may be changed between them while the spindle stands. The
/// first motion of each is taken to come from anywhere.
/// @throws as read_program_text(); gcode.tool for a change while the spindle turns, gcode.spindle for a
///   motion between a change and the start of the spindle
[[nodiscard]] std::vector<Program> read_operations(std::string_view text, const std::string& file,
                                                   const Dialect& dialect, const GcodeLimits& limits = {});

/// Which other control's dialect takes the whole text, as the job's words name it ("haas", "fanuc in inch");
/// "" where none does.
[[nodiscard]] std::string other_dialect(std::string_view text, const Dialect& expected);

}  // namespace slabwright
