// RS-274 out (METHOD.md section 11): a program for each operation, or for several of a layer, judged by
// LinuxCNC's interpreter in the tests.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/plan.h"

namespace slabwright {

/// Takes the next piece of a program's text.
using TextSink = std::function<void(std::string_view)>;

/// Writes the program of one operation: comment header, G21 G17 G90 G94 G40 G49 G80, G8 G97 (x as it is,
/// speeds in revolutions, whatever a lathe's program has left in force), G64, G54, tool and length offset,
/// spindle with dwell, the moves as G0 and G1 (arcs as G2 and G3 with I and J, after G91.1), M5, M2.
/// Coordinates are exact from the integers of 0.1 µm: at most four decimals, no exponent. Words are modal.
/// The first and the last motion are Z-only G0 to the clearance height. With the frame layer-top, z counts
/// from the layer's top.
///
/// Of an operation that shares its program with others (part_of) that is its part of the text: only the first
/// has the head, only the last the end. The next begins at clearance height: with M5, T and M6 where the tool
/// is another, then S and M3, G64 and the dwell. Every part begins with its M3 as readers take it
/// (read_operations).
/// @param sink is given pieces of about a megabyte, so that a program of any length takes little memory
/// @throws Error(no_plan, "program.unsafe") when the operation does not begin and end with a rapid to its
/// clearance height,
///         the last one Z-only, has no tool of the job's library, or an arc is none (Move); nothing has been
///         given to the sink then
void write_program(const Plan& plan, const Layer& layer, const Operation& operation, const TextSink& sink);

/// The program that the layer's operation at place `begin` is the first of, whole. @throws as write_program
void write_file(const Plan& plan, const Layer& layer, std::size_t begin, const TextSink& sink);

/// How many lines a program has before an operation's part of it, and how many that part has.
/// @throws as write_program
[[nodiscard]] std::uint32_t lines_before(const Plan& plan, const Layer& layer, const Operation& operation);
[[nodiscard]] std::uint32_t line_count(const Plan& plan, const Layer& layer, const Operation& operation,
                                       std::uint32_t lines_before);

/// Of each move of an operation the line of its program (1 …) that makes it; 0 where none does.
/// @throws as write_program
[[nodiscard]] std::vector<std::uint32_t> move_lines(const Plan& plan, const Layer& layer,
                                                    const Operation& operation);

/// The same text as one string.
[[nodiscard]] std::string program_text(const Plan& plan, const Layer& layer, const Operation& operation);

/// The line (from 1) of its program which makes the operation's move `move`; 0 when the text has no line of
/// its own for it. @param lines_before as above
[[nodiscard]] std::size_t program_line(const Plan& plan, const Layer& layer, const Operation& operation,
                                       std::size_t move, std::uint32_t lines_before = 0);

/// Makes a text fit for a G-code comment: ASCII, no parentheses, one line, at most 200 characters (LinuxCNC
/// reads lines of 255).
[[nodiscard]] std::string comment_text(std::string_view text);

}  // namespace slabwright
