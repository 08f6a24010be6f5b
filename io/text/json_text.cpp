#include "io/text/json_text.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

#include "io/text/decimal.h"
#include "kernels/errors.h"

namespace slabwright {

namespace {

void require_finite(double value) {
    if (!std::isfinite(value))
        throw Error(ErrorKind::no_plan, "number.not_finite", "a quantity of the plan is not a finite number",
                    "", "report this with the pattern and the job");
}

}  // namespace

std::size_t utf8_length(std::string_view text, std::size_t i) {
    const auto byte = [&](std::size_t k) {
        return k < text.size() ? static_cast<unsigned char>(text[k]) : 0u;
    };
    const auto tail = [&](std::size_t k) { return (byte(k) & 0xC0u) == 0x80u; };
    const unsigned a = byte(i), b = byte(i + 1);
    if (a < 0x80) return 1;
    if (a >= 0xC2 && a <= 0xDF) return tail(i + 1) ? 2 : 0;
    if (a >= 0xE0 && a <= 0xEF) {
        if (!tail(i + 1) || !tail(i + 2) || (a == 0xE0 && b < 0xA0) || (a == 0xED && b > 0x9F)) return 0;
        return 3;
    }
    if (a >= 0xF0 && a <= 0xF4) {
        if (!tail(i + 1) || !tail(i + 2) || !tail(i + 3) || (a == 0xF0 && b < 0x90) ||
            (a == 0xF4 && b > 0x8F))
            return 0;
        return 4;
    }
    return 0;
}

std::string printable(std::string_view text, bool one_line) {
    std::string shown;
    for (std::size_t i = 0; i < text.size();) {
        const std::size_t length = utf8_length(text, i);
        const auto byte = static_cast<unsigned char>(text[i]);
        const bool control = length == 1 ? byte < 0x20 || byte == 0x7F
                                         : byte == 0xC2 && static_cast<unsigned char>(text[i + 1]) < 0xA0;
        const bool breaks = !one_line && byte == '\n';
        if (length == 0) shown += '?';
        else if (control && !breaks) shown += ' ';
        else shown.append(text.substr(i, length));
        i += std::max<std::size_t>(1, length);
    }
    return shown;
}

std::string quoting_line(std::string_view message) {
    constexpr std::size_t most = 400;
    std::string line = printable(message.substr(0, most), true);
    if (message.size() > most) line += " …";
    return line;
}

void append_rounded(std::string& text, double value, int decimals) {
    require_finite(value);
    char buffer[400];
    const auto result =
        std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::fixed, decimals);
    const char* end = result.ptr;
    if (decimals > 0) {
        while (end[-1] == '0') --end;
        if (end[-1] == '.') --end;
    }
    const std::string_view digits(buffer, static_cast<std::size_t>(end - buffer));
    text += digits == "-0" ? std::string_view("0") : digits;
}

std::string rounded_text(double value, int decimals) {
    std::string text;
    append_rounded(text, value, decimals);
    return text;
}

void JsonText::line_break() {
    text_ += '\n';
    text_.append(levels_.size() * 2, ' ');
}

void JsonText::before_value() {
    if (after_key_) {
        after_key_ = false;
        return;
    }
    if (levels_.empty()) return;
    Level& level = levels_.back();
    if (!level.empty) text_ += level.shape == Shape::line ? ", " : ",";
    level.empty = false;
    if (level.shape == Shape::lines) line_break();
}

JsonText& JsonText::open(char first, char last, Shape shape) {
    before_value();
    if (!levels_.empty() && levels_.back().shape == Shape::line) shape = Shape::line;
    text_ += first;
    levels_.push_back({last, shape, true});
    return *this;
}

JsonText& JsonText::end() {
    const Level level = levels_.back();
    levels_.pop_back();
    if (level.shape == Shape::lines && !level.empty) line_break();
    text_ += level.close;
    return *this;
}

JsonText& JsonText::key(std::string_view name) {
    string(name);
    text_ += ": ";
    after_key_ = true;
    return *this;
}

JsonText& JsonText::exact(double value) {
    before_value();
    require_finite(value);
    append_decimal(text_, value);
    return *this;
}

JsonText& JsonText::rounded(double value, int decimals) {
    before_value();
    append_rounded(text_, value, decimals);
    return *this;
}

JsonText& JsonText::units(std::int64_t value) {
    before_value();
    append_mm(text_, value);
    return *this;
}

JsonText& JsonText::integer(std::int64_t value) {
    before_value();
    text_ += std::to_string(value);
    return *this;
}

JsonText& JsonText::count(std::uint64_t value) {
    before_value();
    text_ += std::to_string(value);
    return *this;
}

JsonText& JsonText::boolean(bool value) {
    before_value();
    text_ += value ? "true" : "false";
    return *this;
}

JsonText& JsonText::null() {
    before_value();
    text_ += "null";
    return *this;
}

JsonText& JsonText::string(std::string_view value) {
    static constexpr char hex[] = "0123456789abcdef";
    before_value();
    text_ += '"';
    for (std::size_t i = 0; i < value.size();) {
        const std::size_t length = utf8_length(value, i);
        if (length == 0) {
            text_ += "\xEF\xBF\xBD";
            ++i;
            continue;
        }
        const char c = value[i];
        const auto second = length == 2 ? static_cast<unsigned char>(value[i + 1]) : 0u;
        if (c == '\xC2' && second < 0xA0)  // a control of the second set, which terminals obey too
            ((text_ += "\\u00") += hex[second >> 4]) += hex[second & 15];
        else if (length > 1) text_.append(value.substr(i, length));
        else if (c == '"' || c == '\\') (text_ += '\\') += c;
        else if (c == '\n') text_ += "\\n";
        else if (c == '\t') text_ += "\\t";
        else if (c == '\r') text_ += "\\r";
        else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F)
            ((text_ += "\\u00") += hex[c >> 4]) += hex[c & 15];
        else text_ += c;
        i += length;
    }
    text_ += '"';
    return *this;
}

std::string JsonText::take() {
    text_ += '\n';
    return std::move(text_);
}

}  // namespace slabwright
