// How much of the memory that is given back the command keeps for what it asks for next.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>

namespace slabwright {

/// While one lives, memory that is given back is kept, so that the system need not clear those pages again;
/// from the first time on that the process holds more than `bytes`, for kKeptMs only, as without one. A
/// thread of its own looks every 50 ms.
class KeptWithin {
public:
    explicit KeptWithin(std::uint64_t bytes);
    ~KeptWithin();
    KeptWithin(const KeptWithin&) = delete;
    KeptWithin& operator=(const KeptWithin&) = delete;

    static constexpr std::int64_t kKeptMs = 3000;  ///< as malloc_conf says

private:
    std::mutex mutex_;
    std::condition_variable ends_;
    bool ended_ = false;
    std::thread watch_;
};

}  // namespace slabwright
