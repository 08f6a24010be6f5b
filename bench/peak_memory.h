// How much memory a piece of work takes at its most: a figure of the benchmarks beside their times.
#pragma once

#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <thread>

namespace slabwright {

/// The most anonymous memory (resident, not of a file) while this lives, over what there was before; looked
/// at every millisecond.
class PeakMemory {
public:
    PeakMemory() {
        ::malloc_trim(0);  // what earlier runs left in the heap would be used again and not be seen
        before_ = now();
        watcher_ = std::thread([this] { watch(); });
    }
    ~PeakMemory() { (void)finish(); }
    PeakMemory(const PeakMemory&) = delete;
    PeakMemory& operator=(const PeakMemory&) = delete;
    /// Bytes. The first call ends the watch.
    [[nodiscard]] double finish() {
        if (watcher_.joinable()) {
            done_ = true;
            watcher_.join();
        }
        return static_cast<double>(std::max(0L, peak_ - before_)) *
               static_cast<double>(::sysconf(_SC_PAGESIZE));
    }

private:
    static long now() {
        long size = 0, resident = 0, shared = 0;
        std::FILE* file = std::fopen("/proc/self/statm", "r");
        if (file == nullptr || std::fscanf(file, "%ld %ld %ld", &size, &resident, &shared) != 3) {
            std::fprintf(stderr, "/proc/self/statm cannot be read\n");
            std::exit(1);
        }
        std::fclose(file);
        return resident - shared;
    }
    void watch() {
        while (!done_) {
            peak_ = std::max(peak_, now());
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
    }
    long before_ = 0, peak_ = 0;
    std::atomic<bool> done_{false};
    std::thread watcher_;
};

}  // namespace slabwright
