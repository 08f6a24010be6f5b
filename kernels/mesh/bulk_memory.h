// Memory for arrays of millions of elements, which std::vector would first fill with zeros on one thread:
// that costs as much as the parallel work that follows.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "kernels/export.h"

namespace slabwright {

/// `bytes` of indeterminate content, aligned for any element.
/// @throws std::bad_alloc
[[nodiscard]] SLABWRIGHT_API void* take_bulk(std::size_t bytes);
/// `bytes` as they were asked for.
SLABWRIGHT_API void release_bulk(void* data, std::size_t bytes) noexcept;

/// While one lives, bulk memory that its thread gives back is kept for what that thread takes next, so that
/// the system clears those pages once; what is left goes back to the system with it. Inside another it does
/// nothing.
class SLABWRIGHT_API KeptMemory {
public:
    KeptMemory();
    ~KeptMemory();
    KeptMemory(const KeptMemory&) = delete;
    KeptMemory& operator=(const KeptMemory&) = delete;

private:
    bool outermost_;
};

/// Elements that are made without arguments keep indeterminate values: whoever sizes the array writes all of
/// it.
template <class T>
struct BulkAllocator {
    using value_type = T;
    BulkAllocator() = default;
    template <class U>
    BulkAllocator(const BulkAllocator<U>&) noexcept {
    }  // NOLINT(google-explicit-constructor): allocators convert
    [[nodiscard]] T* allocate(std::size_t n) { return static_cast<T*>(take_bulk(n * sizeof(T))); }
    void deallocate(T* data, std::size_t n) noexcept { release_bulk(data, n * sizeof(T)); }
    template <class U, class... Arguments>
    void construct(U* place, Arguments&&... arguments) {
        if constexpr (sizeof...(Arguments) > 0)
            ::new (static_cast<void*>(place)) U(std::forward<Arguments>(arguments)...);
    }
    friend bool operator==(const BulkAllocator&, const BulkAllocator&) noexcept { return true; }
};

/// T is a plain aggregate. resize() leaves the new elements indeterminate.
template <class T>
using BulkVector = std::vector<T, BulkAllocator<T>>;

}  // namespace slabwright
