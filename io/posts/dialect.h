// What tells one control's programs from another's, as a value: how a program begins and ends, how numbers
// and comments are written, what the control knows of tools, dwells and rounded corners, and which words it
// takes. The writer and the readers go by it; io/FORMATS.md tells the grammar of each.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/job.h"

namespace slabwright {

struct Dialect {
    /// How long the control dwells: which word of G4 says it, in what.
    enum class Dwell {
        p_seconds,
        p_milliseconds,  ///< P takes no decimal point
        p_by_point,      ///< P3. is seconds, P3000 milliseconds
        x_seconds,       ///< X3.
        f_seconds,       ///< F3
        cycle            ///< CYCL DEF 9
    };
    /// What puts a tool's length into force.
    enum class Length {
        g43,       ///< G43 H, with the tool's number
        edge,      ///< D1
        call,      ///< TOOL CALL
        touch_off  ///< nothing in the program: the operator, at each change
    };
    /// What says how far the control may leave the path.
    enum class Rounding {
        g64_p,    ///< G64 P Q
        g187,     ///< G187 P E
        adis,     ///< G641 ADIS= ADISPOS=
        cycle,    ///< CYCL DEF 32
        setting,  ///< G64 alone: the control's own setting, kJunction
        exact     ///< G61 alone: it slows down by a setting, kJunction
    };
    enum class Percent { none, may, must };

    Post post = Post::linuxcnc;
    std::string name = "LinuxCNC";  ///< in messages
    bool own = false;               ///< a post of the user's own, based on `post`
    LengthUnit units = LengthUnit::mm;
    bool conversational = false;  ///< HEIDENHAIN's L, CC and C in numbered blocks in place of G words

    // How numbers are written.
    int decimals = 4;             ///< of a coordinate
    bool point = false;           ///< whole lengths and feeds are written with it: X29.
    bool needs_point = false;     ///< lengths and feeds without their decimal point are increments
    bool trailing_zeros = false;  ///< of coordinates: X29.000
    double feed_unit = 1;         ///< mm/min that F1 is
    int feed_decimals = 0;        ///< of a feed

    // How text is written.
    bool parentheses = true, semicolon = false;  ///< comments that it knows; the first is written
    bool capitals = false;                       ///< comments in capitals, digits and plain signs only
    std::size_t longest_comment = 200, longest_line = 252;
    std::string forbidden;          ///< characters that it acts on wherever they stand, in comments too
    int line_numbers = 0;           ///< from each line's number N to the next one's; 0: none
    bool carriage_returns = false;  ///< before each line feed

    // What a program says: templates for fmt, with unit, number, tool, speed, dwell, dwell_ms, blend, name,
    // z.
    std::string begin;   ///< before the comments
    std::string head;    ///< after them
    std::string change;  ///< within a program: another tool, from a spindle that turns
    std::string again;   ///< within a program: the same tool for the next operation
    std::string next;    ///< after either: what the next operation turns at and how it rounds corners
    std::string first;   ///< the first motion, to the height z
    std::string end;
    std::string notes;                ///< comments on what the operator sets
    std::string centres;              ///< before the first motion of a program with arcs
    bool radius_arcs = false;         ///< arcs by R in place of I and J
    bool repeat_motion = false;       ///< G0 to G3 in every line, not only where it changes
    bool centres_incremental = true;  ///< I and J count from where the arc begins, whatever ran before

    // What the reader takes and asks for.
    Percent percent = Percent::none;
    bool numbered = false;  ///< O0302 before the first word
    bool changes_tools = true;
    bool lathe_words = false;  ///< G8 and G97 must be said: the control is a lathe's too
    Dwell dwell = Dwell::p_seconds;
    Length length = Length::g43;
    Rounding rounding = Rounding::g64_p;
    std::span<const int> g, m;  ///< the numbers that it knows, in tenths
    std::string letters;        ///< the others of its words
    bool named_words = false;   ///< ADIS=0.02
    std::vector<int> switches;  ///< M words that switch something which no motion depends on: M10, M11

    [[nodiscard]] bool inch() const { return units == LengthUnit::inch; }
    /// mm in which a program's lengths count: 1 or 25.4.
    [[nodiscard]] double unit_mm() const { return inch() ? kInch : 1; }
};

/// A post of the user's own (io/read/own_post.h), ready to write and to read by.
struct OwnDialect final : OwnPost {
    Post base = Post::linuxcnc;
    Dialect mm, inch;
};

/// The name of its file in a plan's folder.
inline constexpr const char* kOwnPostFile = "post.toml";

/// What the names of program files may end in.
inline constexpr std::array<std::string_view, 16> kProgramEndings{
    ".ngc", ".nc",  ".gcode", ".tap", ".mpf", ".h",   ".cnc", ".txt",
    ".eia", ".iso", ".min",   ".din", ".anc", ".fnc", ".pim", ".g"};

/// The dialect of a control, in mm or inch. Inch has five decimals (0.254 µm), and feeds three.
[[nodiscard]] Dialect dialect_of(Post post, LengthUnit units = LengthUnit::mm);
/// That of a job's machine, its own post's where it has one.
[[nodiscard]] Dialect dialect_of(const Machine& machine);

/// A job's word for a post, as messages name it: "linuxcnc", in inch "linuxcnc in inch".
[[nodiscard]] std::string in_words(Post post, LengthUnit units);
/// The same of a dialect; a post of the user's own by its name.
[[nodiscard]] std::string in_words(const Dialect& dialect);

}  // namespace slabwright
