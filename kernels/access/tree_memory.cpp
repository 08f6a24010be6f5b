#include "kernels/access/tree_memory.h"

#include <algorithm>
#include <limits>

namespace slabwright {

namespace {

constexpr std::string_view kWhat = "Embree's tree of the facets";

}  // namespace

TreeMemory::TreeMemory(Context& context)
    : context_(context),
      room_(static_cast<std::int64_t>(std::min<std::uint64_t>(
          context.memory_limit() - std::min(context.memory_charged(), context.memory_limit()),
          std::numeric_limits<std::int64_t>::max()))) {}

// Embree says what it is about to take or, if `post`, has just taken (bytes over 0), and what it has given
// back. What is refused beforehand is not taken; what is refused afterwards is given back, which is said too.
bool TreeMemory::monitor(void* memory, ssize_t bytes, bool post) {
    auto& self = *static_cast<TreeMemory*>(memory);
    const std::int64_t taken = self.taken_.fetch_add(bytes) + bytes;
    if (bytes <= 0 || taken <= self.room_) return true;
    if (!post) self.taken_.fetch_sub(bytes);
    self.refused_ = true;
    return false;
}

void TreeMemory::charge() {
    charged_.reset();
    // What was refused is more than there is room for: so is this.
    const auto taken = static_cast<std::uint64_t>(std::max<std::int64_t>(0, taken_));
    if (refused_) MemoryCharge(context_, static_cast<std::uint64_t>(room_) + 1, kWhat);
    charged_.emplace(context_, taken, kWhat);
}

}  // namespace slabwright
