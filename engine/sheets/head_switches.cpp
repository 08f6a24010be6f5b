#include "engine/sheets/head_switches.h"

#include <charconv>
#include <optional>

namespace slabwright {

namespace {

struct SwitchWord {
    int m = 0;
    int p = -1;  // of an output or a machine's own word; negative: none
    [[nodiscard]] bool is_spindle() const { return m >= 3 && m <= 5; }
    [[nodiscard]] bool is_coolant() const { return m >= 7 && m <= 9; }
    [[nodiscard]] bool is_output() const { return m >= 62 && m <= 65; }
    [[nodiscard]] bool is_own() const { return m >= 100 && m <= 199; }
};

// One to three digits at a text's beginning, taken off it; "0" alone begins with a zero.
std::optional<int> number_at(std::string_view& text) {
    constexpr std::size_t digits = 3;
    const std::string_view head = text.substr(0, digits);
    if (head.empty() || head[0] < '0' || head[0] > '9') return std::nullopt;
    int value = 0;
    const auto [end, error] = std::from_chars(head.data(), head.data() + head.size(), value);
    const auto length = static_cast<std::size_t>(end - head.data());
    if (error != std::errc() || (head[0] == '0' && length > 1)) return std::nullopt;
    text.remove_prefix(length);
    return value;
}

std::optional<SwitchWord> switch_word(std::string_view text) {
    SwitchWord word;
    if (text.empty() || text[0] != 'M') return std::nullopt;
    text.remove_prefix(1);
    const std::optional<int> m = number_at(text);
    if (!m) return std::nullopt;
    word.m = *m;
    if (!word.is_spindle() && !word.is_coolant() && !word.is_output() && !word.is_own()) return std::nullopt;
    if (text.starts_with(" P")) {
        text.remove_prefix(2);
        const std::optional<int> p = number_at(text);
        if (!p || !(word.is_output() || word.is_own())) return std::nullopt;
        word.p = *p;
    } else if (word.is_output()) {
        return std::nullopt;
    }
    if (!text.empty()) return std::nullopt;
    return word;
}

}  // namespace

bool is_switch(std::string_view text) { return switch_word(text).has_value(); }

bool is_switch_pair(std::string_view on, std::string_view off) {
    const std::optional<SwitchWord> first = switch_word(on), second = switch_word(off);
    if (!first || !second) return false;
    if (first->is_spindle()) return first->m != 5 && second->m == 5;
    if (first->is_coolant()) return first->m != 9 && second->m == 9;
    if (first->is_output())
        return second->is_output() && first->p == second->p && first->m % 2 == 0 && second->m % 2 == 1;
    return second->is_own() && on != off;
}

bool switches_head(std::string_view word, std::string_view on, std::string_view off) {
    const std::optional<SwitchWord> asked = switch_word(word), head = switch_word(on);
    if (!asked) return false;
    if (asked->is_spindle() || word == on || word == off) return true;
    return head && head->is_output() && asked->is_output() && asked->p == head->p;
}

}  // namespace slabwright
