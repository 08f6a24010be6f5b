// Words and numbers of text formats, whatever the locale.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace slabwright {

[[nodiscard]] inline bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }
[[nodiscard]] inline char lower(char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

/// `word` in any case; `expected` in lower case.
[[nodiscard]] bool is_word(std::string_view word, std::string_view expected);

/// Words separated by white space.
struct Words {
    std::string_view text;
    std::size_t at = 0;

    void skip_space() {
        while (at < text.size() && is_space(text[at])) ++at;
    }
    /// The next word, empty at the end of the text; `at` then stands behind it.
    std::string_view next() {
        skip_space();
        const std::size_t begin = at;
        while (at < text.size() && !is_space(text[at])) ++at;
        return text.substr(begin, at - begin);
    }
    void skip_line() {
        while (at < text.size() && text[at] != '\n' && text[at] != '\r') ++at;
    }
};

/// Reads one number. What is too small to be told from zero is 0, what is too large to be a length infinite.
/// @return false when `word` is none
[[nodiscard]] bool read_number(std::string_view word, double& value);

/// A word as it can be printed, in quotes, 40 bytes of it at most; "the end of the file" where it is empty.
[[nodiscard]] std::string quoted_word(std::string_view word);

/// The line of a text (from 1) in which an offset lies. Lines end with \n, \r\n or \r.
[[nodiscard]] std::size_t line_of(std::string_view text, std::size_t offset);

}  // namespace slabwright
