#include "io/read/toml_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "kernels/errors.h"

namespace slabwright {

namespace {

constexpr std::size_t kMostKeyParts = 8;  ///< those of a job have two; a number or a date has one point

}  // namespace

std::size_t edit_distance(std::string_view a, std::string_view b) {
    const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
    std::vector<std::size_t> row(b.size() + 1);
    for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
    for (std::size_t i = 1; i <= a.size(); ++i) {
        std::size_t diagonal = row[0];
        row[0] = i;
        for (std::size_t j = 1; j <= b.size(); ++j) {
            const std::size_t change = diagonal + (lower(a[i - 1]) == lower(b[j - 1]) ? 0 : 1);
            diagonal = row[j];
            row[j] = std::min({row[j] + 1, row[j - 1] + 1, change});
        }
    }
    return row.back();
}

std::string nearest_word(std::string_view wanted, const std::vector<std::string>& known) {
    std::string best;
    std::size_t best_distance = ~std::size_t{0};
    for (const std::string& candidate : known) {
        const std::size_t distance = edit_distance(wanted, candidate);
        if (distance < best_distance) {
            best = candidate;
            best_distance = distance;
        }
    }
    return best;
}

void require_shallow_keys(std::string_view text, const std::string& file, const char* code) {
    std::size_t line = 1, points = 0;
    for (std::size_t at = 0; at < text.size(); ++at) {
        const char c = text[at];
        if (c == '#') {
            at = std::min(text.find('\n', at), text.size()) - 1;
        } else if (c == '"' || c == '\'') {
            // A text in one or three quotes, in which only " knows \. An unclosed one is the parser's to
            // tell.
            const std::string three(3, c);
            const std::size_t quotes = text.substr(at, 3) == three ? 3 : 1;
            std::size_t end = at + quotes;
            while (end < text.size() && text.substr(end, quotes) != three.substr(0, quotes) &&
                   (quotes == 3 || text[end] != '\n')) {
                if (c == '"' && text[end] == '\\') ++end;
                if (end < text.size() && text[end] == '\n') ++line;
                ++end;
            }
            at = end + quotes - 1;
            if (quotes == 3)  // two more may stand before the closing three
                while (at + 1 < text.size() && at < end + 4 && text[at + 1] == c) ++at;
            if (quotes == 1 && end < text.size() && text[end] == '\n') at = end - 1;
        } else if (c == '.') {
            if (++points < kMostKeyParts) continue;
            throw Error(ErrorKind::usage, code, fmt::format("a key of more than {} parts", kMostKeyParts),
                        fmt::format("{}:{}", file, line), "keys have two parts, as in machine.clearance");
        } else if (c == '\n' || c == '=' || c == ',' || c == '[' || c == ']' || c == '{' || c == '}') {
            points = 0;
            line += c == '\n' ? 1 : 0;
        }
    }
}

}  // namespace slabwright
