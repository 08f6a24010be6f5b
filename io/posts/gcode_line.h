// One line of RS-274: which words it has, spelled as the dialect's control reads them. What they mean is
// ModalState's and the reader's matter.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "io/posts/dialect.h"

namespace slabwright {

/// Where a program is being read: every refusal names it.
struct GcodePlace {
    std::string file;
    std::uint32_t line = 0;

    /// @throws Error(verification, code, message, "file:line", remedy)
    [[noreturn]] void fail(const char* code, const std::string& message,
                           const char* remedy = "plan again") const;
};

/// G or M words of one line by their numbers in tenths (G43.1 is 431), in the order of the line.
struct GcodeNumbers {
    std::array<int, 16> tenths;  // count of them
    std::size_t count = 0;
    [[nodiscard]] const int* begin() const { return tenths.data(); }
    [[nodiscard]] const int* end() const { return tenths.data() + count; }
    [[nodiscard]] bool has(int number) const;
};

/// The words of one line. Letters other than G, M and N stand once at most.
class GcodeLine {
public:
    GcodeNumbers g, m;

    [[nodiscard]] bool has(char letter) const { return (given_ >> (letter - 'A') & 1u) != 0; }
    /// The word's number; 0 where the line has none.
    [[nodiscard]] double operator[](char letter) const {
        return has(letter) ? values_[static_cast<std::size_t>(letter - 'A')] : 0;
    }
    /// Whether the line has a word beside that of a letter.
    [[nodiscard]] bool has_beside(char letter) const {
        return (given_ & ~(1u << (letter - 'A'))) != 0 || g.count > 0 || m.count > 0;
    }
    /// Whether it has another letter than that, G, M and N aside.
    [[nodiscard]] bool has_letter_beside(char letter) const {
        return (given_ & ~(1u << (letter - 'A'))) != 0;
    }
    /// Whether its number has a decimal point.
    [[nodiscard]] bool pointed(char letter) const { return (pointed_ >> (letter - 'A') & 1u) != 0; }
    /// Whether it says nothing: blank, or a comment.
    [[nodiscard]] bool empty() const { return given_ == 0 && g.count == 0 && m.count == 0; }
    /// A % alone: where a program may begin and end.
    bool percent = false;

    void clear() {
        given_ = pointed_ = 0;
        g.count = m.count = 0;
        percent = false;
    }
    void set(char letter, double value, bool pointed = false) {
        given_ |= 1u << (letter - 'A');
        if (pointed) pointed_ |= 1u << (letter - 'A');
        values_[static_cast<std::size_t>(letter - 'A')] = value;
    }

private:
    std::uint32_t given_ = 0, pointed_ = 0;
    std::array<double, 26> values_;  // of given letters only
};

/// The letters under which ADIS and ADISPOS of a Siemens line are kept.
inline constexpr char kAdis = 'A', kAdisPos = 'B';

/// Reads a line without its line feed; a carriage return may end it. Comments are those of the dialect: ( … )
/// and ; to the end; a comment that LinuxCNC or Mach acts on ("MSG, …", "LOGOPEN, …", any word and a comma)
/// is refused in all of them.
/// @throws Error(verification): gcode.line_length over Dialect::longest_line characters, gcode.character
/// beyond
///   printing ASCII and tabs or that the control acts on, gcode.comment, gcode.percent, gcode.unknown_word
///   for a letter or number that names nothing here, gcode.number, gcode.decimal_point for a length or feed
///   without the point that the dialect needs, gcode.twice
/// @param words are those of the line afterwards; one object serves for all lines of a program
void read_gcode_line(std::string_view line, const GcodePlace& place, const Dialect& dialect,
                     GcodeLine& words);

/// What is wrong with a line as text, whatever its words: its length and its characters. A carriage return at
/// its end is cut off. @throws Error(verification): gcode.line_length, gcode.character
void check_characters(std::string_view& line, const GcodePlace& place, const Dialect& dialect);

/// What LinuxCNC or Mach would act on, of a comment without its brackets: "MSG, …", "LOGOPEN, …", any word
/// and a comma. @throws Error(verification, "gcode.comment")
void check_comment(std::string_view inside, const GcodePlace& place);

/// A G or M number as it is written: 431 is "43.1".
[[nodiscard]] std::string gcode_number(int tenths);

}  // namespace slabwright
