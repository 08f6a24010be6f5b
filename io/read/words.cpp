#include "io/read/words.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <limits>

namespace slabwright {

bool is_word(std::string_view word, std::string_view expected) {
    return word.size() == expected.size() && std::equal(word.begin(), word.end(), expected.begin(),
                                                        [](char a, char b) { return lower(a) == b; });
}

bool read_number(std::string_view word, double& value) {
    const std::string_view digits = !word.empty() && word[0] == '+' ? word.substr(1) : word;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (end != digits.data() + digits.size() || digits.empty() || (digits != word && digits[0] == '-'))
        return false;
    if (error == std::errc::result_out_of_range) {
        // Too small to be told from zero, or too large to be a length.
        const std::size_t exponent = digits.find_first_of("eE");
        const bool tiny = exponent != std::string_view::npos
                              ? digits.substr(exponent).find('-') != std::string_view::npos
                              : digits.find_first_of("123456789") > digits.find('.');
        value = tiny ? 0.0 : std::numeric_limits<double>::infinity();
        return true;
    }
    return error == std::errc{};
}

std::string quoted_word(std::string_view word) {
    if (word.empty()) return "the end of the file";
    std::string text = "'";
    for (const char c : word.substr(0, 40)) {
        if (c >= ' ' && c <= '~') text += c;
        else text += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
    }
    return text + (word.size() > 40 ? "…'" : "'");
}

std::size_t line_of(std::string_view text, std::size_t offset) {
    std::size_t line = 1;
    for (std::size_t i = 0; i < offset; ++i)
        line += text[i] == '\n' || (text[i] == '\r' && (i + 1 == text.size() || text[i + 1] != '\n'));
    return line;
}

}  // namespace slabwright
