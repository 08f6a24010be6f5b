#include "kernels/mesh/bulk_memory.h"

#include <sys/mman.h>

#include <cstdint>
#include <limits>
#include <new>

namespace slabwright {

namespace {

constexpr std::size_t kHugePage = std::size_t{1} << 21;
/// Under this, what lies unused behind the end of the last huge page would weigh.
constexpr std::size_t kLeastBulk = 2 * kHugePage;

std::size_t whole_pages(std::size_t bytes) { return (bytes + kHugePage - 1) / kHugePage * kHugePage; }

}  // namespace

void* take_bulk(std::size_t bytes) {
    if (bytes < kLeastBulk) return ::operator new(bytes);
    if (bytes > std::numeric_limits<std::size_t>::max() / 2) throw std::bad_alloc();
    // Huge pages need an address that is a multiple of their size, so a page more is mapped and the ends are given back.
    const std::size_t size = whole_pages(bytes), mapped = size + kHugePage;
    void* address = ::mmap(nullptr, mapped, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (address == MAP_FAILED) throw std::bad_alloc();
    const auto start = reinterpret_cast<std::uintptr_t>(address), begin = whole_pages(start);
    char* data = static_cast<char*>(address) + (begin - start);
    if (begin > start) ::munmap(address, begin - start);
    ::munmap(data + size, kHugePage - (begin - start));
    ::madvise(data, size, MADV_HUGEPAGE);  // only a wish: without huge pages all works as well, more slowly
    return data;
}

void release_bulk(void* data, std::size_t bytes) noexcept {
    if (bytes < kLeastBulk) ::operator delete(data);
    else ::munmap(data, whole_pages(bytes));
}

}  // namespace slabwright
