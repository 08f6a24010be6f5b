// Numbers as decimal text, the same on every machine and in every locale, never with an exponent.
#pragma once

#include <charconv>
#include <cmath>
#include <cstdint>
#include <string>

#include "kernels/polygons/loops.h"

namespace slabwright {

/// Appends a length of 0.1 µm units in millimetres: exact, at most four decimals, no needless zeros.
inline void append_mm(std::string& text, std::int64_t units) {
    constexpr auto per_mm = static_cast<std::int64_t>(kUnitsPerMm);
    char digits[24];
    if (units < 0) text += '-';
    const std::int64_t size = units < 0 ? -units : units;
    text.append(digits, std::to_chars(digits, digits + sizeof digits, size / per_mm).ptr);
    std::int64_t rest = size % per_mm;
    if (rest == 0) return;
    text += '.';
    for (std::int64_t place = per_mm / 10; rest != 0; place /= 10) {
        text += static_cast<char>('0' + rest / place);
        rest %= place;
    }
}

/// Appends the shortest decimal that reads back as `value`, which must be finite.
inline void append_decimal(std::string& text, double value) {
    char digits[400];  // 1.8e308 has 309 digits before its point, the least denormal 325 and 17 more after it
    if (value == 0) value = 0;  // no "-0"
    text.append(digits, std::to_chars(digits, digits + sizeof digits, value, std::chars_format::fixed).ptr);
}

/// A height for names of groups and layers: to 0.1 µm where that fits.
inline std::string height_text(double z) {
    std::string text;
    if (std::abs(z) < 1e9) append_mm(text, std::llround(z * kUnitsPerMm));
    else append_decimal(text, z);
    return text;
}

}  // namespace slabwright
