// The controls that programs are written for, and what the planner has to know of each. How a control's text
// is written and read stands in io/posts/dialect.cpp.
#pragma once

#include <cstddef>
#include <cstdint>

namespace slabwright {

/// The control that the programs are written for, and whose text is proven (io/posts/dialect.h).
enum class Post : std::uint8_t { linuxcnc, fanuc, haas, grbl, mach, iso, siemens, heidenhain };

struct Control {
    Post post = Post::linuxcnc;
    const char* word = "";      ///< by which a job names it
    const char* before = "";    ///< of a program's file name
    const char* ending = "";    ///< of the same, with its dot
    int highest_tool = 0;       ///< that its tool table, or its table of lengths, goes to
    bool says_rounding = true;  ///< its programs say by how much corners may be rounded
    bool keeps_lengths = true, changes_tools = true;
    const char* unsure_of_probing = "";  ///< why no probing program is written for it; "": one is
};

/// One for each Post, in the order of its enumerators.
inline constexpr Control kControls[] = {
    {Post::linuxcnc, "linuxcnc", "", ".ngc", 99999, true, true, true, ""},
    {Post::fanuc, "fanuc", "", ".nc", 999, false, true, true,
     "the skip block G31 goes on without an alarm where nothing is touched, and the macro variables that "
     "tell are an option of the control"},
    {Post::haas, "haas", "", ".nc", 200, true, true, true,
     "the words that switch the probe on before G31 differ from machine to machine"},
    {Post::grbl, "grbl", "", ".gcode", 255, false, false, false, ""},
    {Post::mach, "mach", "", ".tap", 254, false, true, true,
     "Mach's G31 goes on without an alarm where nothing is touched"},
    {Post::iso, "iso", "", ".nc", 999, false, true, true, "plain ISO has no word for a probing move"},
    {Post::siemens, "siemens", "_", ".mpf", 32000, true, true, true,
     "which input MEAS reads, and how a frame is set, differ from machine to machine"},
    {Post::heidenhain, "heidenhain", "", ".h", 32767, true, true, true,
     "its touch probe cycles take feeds and heights from a table of the control, which no program tells"},
};

/// What is known of a control.
[[nodiscard]] constexpr const Control& control_of(Post post) {
    return kControls[static_cast<std::size_t>(post)];
}

}  // namespace slabwright
