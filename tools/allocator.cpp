// How the command and the benchmarks take memory from the system: by jemalloc, in huge pages. A plan of 10 M
// facets touches new pages half a million times less, which on a virtual machine is a sixth of its time. The
// library leaves this to the program that embeds it.
#include "tools/allocator.h"

#include <fcntl.h>
#include <jemalloc/jemalloc.h>
#include <sys/types.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <system_error>

// jemalloc reads it as it starts; the environment's MALLOC_CONF goes before. Its rule that large pieces go
// back to the system at once (oversize_threshold) would have every array of a layer cleared anew for the next
// one.
extern "C" {
__attribute__((visibility("default"))) const char* malloc_conf =
    "thp:always,oversize_threshold:0,dirty_decay_ms:3000";
}

namespace slabwright {

namespace {

constexpr std::int64_t kForever = -1;

/// Says something to one of jemalloc's arenas. Nothing is allocated: there may be no memory left.
void tell_arena(unsigned arena, const char* what, void* value, std::size_t size) noexcept {
    char name[64];
    std::snprintf(name, sizeof name, "arena.%u.%s", arena, what);
    mallctl(name, nullptr, nullptr, value, size);
}

// For arenas that are there and those that are to come. An arena that nobody uses yet has none of its own to
// set.
void keep_given_back(std::int64_t ms) noexcept {
    ssize_t value = ms;
    mallctl("arenas.dirty_decay_ms", nullptr, nullptr, &value, sizeof value);
    unsigned arenas = 0;
    std::size_t size = sizeof arenas;
    mallctl("arenas.narenas", &arenas, &size, nullptr, 0);
    for (unsigned i = 0; i < arenas; ++i) tell_arena(i, "dirty_decay_ms", &value, sizeof value);
}

// Bytes of the process that lie in the machine's memory, but for those of mapped files, as /proc/self/statm
// says; 0 where it does not.
std::uint64_t held(int statm) {
    char text[128];
    const ssize_t got = ::pread(statm, text, sizeof text - 1, 0);
    if (got <= 0) return 0;
    text[got] = 0;
    unsigned long long resident = 0, of_files = 0;
    if (std::sscanf(text, "%*u %llu %llu", &resident, &of_files) != 2) return 0;
    return (resident - of_files) * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

}  // namespace

KeptWithin::KeptWithin(std::uint64_t bytes) {
    const int statm = ::open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
    if (statm < 0) return;  // nobody could tell when it is too much
    const auto watch = [this, bytes, statm] {
        std::unique_lock lock(mutex_);
        while (!ends_.wait_for(lock, std::chrono::milliseconds(50), [&] { return ended_; })) {
            if (held(statm) <= bytes) continue;
            keep_given_back(kKeptMs);
            tell_arena(MALLCTL_ARENAS_ALL, "purge", nullptr, 0);
            break;
        }
        ::close(statm);
    };
    try {
        keep_given_back(kForever);
        watch_ = std::thread(watch);
    } catch (const std::system_error&) {  // there is no thread to be had, and so nobody to watch
        keep_given_back(kKeptMs);
        ::close(statm);
    }
}

KeptWithin::~KeptWithin() {
    if (!watch_.joinable()) return;
    {
        const std::lock_guard lock(mutex_);
        ended_ = true;
    }
    ends_.notify_one();
    watch_.join();
    keep_given_back(kKeptMs);
}

}  // namespace slabwright
