// What Embree takes for its trees, on the context's account of memory.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <cstdint>
#include <optional>

#include "kernels/parallel/context.h"

namespace slabwright {

/// Hears of every allocation of a device of Embree, and refuses those that the context's limit has no room
/// for; what is left after building is charged until the end. Must outlive the device, and the context must
/// outlive this.
class TreeMemory {
public:
    explicit TreeMemory(Context& context);

    /// For rtcSetDeviceMemoryMonitorFunction, with this as the pointer.
    static bool monitor(void* memory, ssize_t bytes, bool post);

    /// To be called when a tree has been built, or could not be.
    /// @throws Error(no_plan, "memory.limit") if something was refused, or other charges leave no room any
    /// more
    void charge();

private:
    Context& context_;
    std::int64_t room_;
    std::atomic<std::int64_t> taken_{0};
    std::atomic<bool> refused_{false};
    std::optional<MemoryCharge> charged_;
};

}  // namespace slabwright
