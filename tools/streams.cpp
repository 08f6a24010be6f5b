#include "tools/streams.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string>
#include <string_view>

#include "io/slabwright.h"

namespace slabwright {

int complain(const Error& error, bool as_json, std::span<const Error> also) {
    // One error, one line, whatever a file name or a parser's message holds.
    const std::string line = as_json
                                 ? error_json(error, also)
                                 : terminal_text(fmt::format("slabwright: {}", error.what()), true) + '\n';
    std::fwrite(line.data(), 1, line.size(), stderr);
    return static_cast<int>(error.kind());
}

void print(std::string_view text) {
    // Plain text goes as it is: where memory has ended, what was done can still be said.
    const bool plain =
        std::all_of(text.begin(), text.end(), [](char c) { return c == '\n' || (c >= ' ' && c <= '~'); });
    const std::string cleaned = plain ? std::string() : terminal_text(text, false);
    const std::string_view shown = plain ? text : cleaned;
    const bool written = std::fwrite(shown.data(), 1, shown.size(), stdout) == shown.size();
    if (written && std::fflush(stdout) == 0) return;
    throw Error(ErrorKind::input, "stdout.unwritable",
                fmt::format("standard output cannot be written: {}", std::strerror(errno)), "",
                "make room where it goes, or send it elsewhere");
}

}  // namespace slabwright
