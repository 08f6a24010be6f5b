#include "io/read/toml_text.h"

#include <fmt/format.h>

#include <algorithm>

#include "kernels/errors.h"

namespace slabwright {

namespace {

constexpr std::size_t kMostKeyParts = 8;  ///< those of a job have two; a number or a date has one point

}  // namespace

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
