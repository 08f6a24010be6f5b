// JSON out: keys in the order in which they are written, numbers without exponents, the same bytes
// everywhere.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace slabwright {

/// Length of the well-formed UTF-8 sequence at text[i], 0 when there is none (RFC 3629: no overlong forms, no
/// surrogates).
[[nodiscard]] std::size_t utf8_length(std::string_view text, std::size_t i);

/// Text that a terminal may be given, whatever names it holds: control characters become spaces, bytes that
/// are no UTF-8 question marks. @param one_line line breaks too
[[nodiscard]] std::string printable(std::string_view text, bool one_line);

/// A message that quotes a file: one printable line of at most some 400 bytes; what is longer is cut, with a
/// mark.
[[nodiscard]] std::string quoting_line(std::string_view message);

/// Appends `value` rounded to `decimals` (0…9) places, trailing zeros cut; never "-0". @throws Error(no_plan,
/// "number.not_finite"): no file of ours has a place for NaN or infinity
void append_rounded(std::string& text, double value, int decimals);

/// The same as a text of its own.
[[nodiscard]] std::string rounded_text(double value, int decimals);

/// Builds one JSON text. Containers opened with `line` are written on one line, others one element a line.
class JsonText {
public:
    enum class Shape { lines, line };

    JsonText& begin_object(Shape shape = Shape::lines) { return open('{', '}', shape); }
    JsonText& begin_array(Shape shape = Shape::lines) { return open('[', ']', shape); }
    JsonText& end();  ///< closes the innermost container

    JsonText& key(std::string_view name);
    JsonText& exact(double value);  ///< shortest text that reads back the same; @throws as append_rounded
    JsonText& rounded(double value,
                      int decimals);  ///< for measured and predicted quantities; @throws as append_rounded
    JsonText& units(std::int64_t tenths_of_micrometre);
    JsonText& integer(std::int64_t value);
    JsonText& count(std::uint64_t value);
    JsonText& boolean(bool value);
    JsonText& null();
    JsonText& string(
        std::string_view value);  ///< invalid UTF-8 becomes U+FFFD, so that every reader takes the file

    /// The finished text, with a line feed at its end.
    [[nodiscard]] std::string take();

private:
    struct Level {
        char close;
        Shape shape;
        bool empty;
    };
    JsonText& open(char first, char last, Shape shape);
    void before_value();
    void line_break();
    std::string text_;
    std::vector<Level> levels_;
    bool after_key_ = false;
};

}  // namespace slabwright
