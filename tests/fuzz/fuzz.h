// What fuzz targets share: a target is a function of bytes, run by libFuzzer where clang built it and by
// replay_main.cpp over kept inputs everywhere else.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

#include "kernels/errors.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace slabwright::fuzz {

/// Ends the process with a line: libFuzzer then keeps the input.
[[noreturn]] inline void finding(const std::string& what) {
    std::fprintf(stderr, "finding: %s\n", what.c_str());
    std::abort();
}

inline void require(bool holds, const char* what) {
    if (!holds) finding(what);
}

/// Runs what may throw an Error and nothing else; the error must be one line that blames the input.
template <class Function>
void expect_clear_error(Function&& function) {
    try {
        function();
    } catch (const Error& error) {
        const std::string_view line = error.what();
        require(!line.empty() && line.size() < 4096, "an error that is empty or longer than a screen");
        require(!error.code().empty(), "an error without a code");
        for (const char c : line)
            require(static_cast<unsigned char>(c) >= 0x20 && c != 0x7f, "an error with a control character");
        // Our own words alone: the rest of the line may quote the input, which may say anything.
        require(error.remedy().find("report this") == std::string::npos, "an error that asks to be reported");
    }
}

inline std::string_view text(const std::uint8_t* data, std::size_t size) {
    return {reinterpret_cast<const char*>(data), size};
}

/// Takes numbers from the input's bytes, and zeros after their end.
class Draw {
public:
    Draw(const std::uint8_t* data, std::size_t size) : at_(data), end_(data + size) {}

    std::uint8_t byte() { return at_ == end_ ? std::uint8_t{0} : *at_++; }
    /// In [0, count).
    unsigned below(unsigned count) { return byte() % count; }
    /// One of 65 536 steps from low to high.
    double between(double low, double high) {
        const unsigned high_byte = byte();
        return low + (high - low) * (high_byte * 256u + byte()) / 65535.0;
    }
    [[nodiscard]] bool done() const { return at_ == end_; }

private:
    const std::uint8_t *at_, *end_;
};

}  // namespace slabwright::fuzz
