// How far a command is, on a terminal's last line.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <string>

#include "kernels/parallel/context.h"

namespace slabwright {

/// A bar with phase and time left, redrawn at most ten times a second on a terminal's last line.
class ProgressBar {
public:
    void show(const Progress& progress) {
        const auto now = Clock::now();
        if (drawn_ && now - last_ < std::chrono::milliseconds(100)) return;
        last_ = now;
        drawn_ = true;
        constexpr int width = 30;
        const int full = std::clamp(static_cast<int>(progress.fraction * width), 0, width);
        std::string left;
        const double elapsed = std::chrono::duration<double>(now - start_).count();
        if (progress.fraction > 0.02 && elapsed > 1) {
            const long seconds =
                static_cast<long>(elapsed * (1 - progress.fraction) / progress.fraction + 0.5);
            left = fmt::format("{}:{:02} left", seconds / 60, seconds % 60);
        }
        const std::string line = fmt::format("\r\x1b[K[{:#<{}}{:.<{}}] {:3.0f} %  {}  {}", "", full, "",
                                             width - full, 100 * progress.fraction, progress.phase, left);
        std::fwrite(line.data(), 1, line.size(), stderr);
    }
    void clear() {
        if (drawn_) std::fputs("\r\x1b[K", stderr);
        drawn_ = false;
    }

private:
    using Clock = std::chrono::steady_clock;
    Clock::time_point start_ = Clock::now(), last_{};
    bool drawn_ = false;
};

}  // namespace slabwright
