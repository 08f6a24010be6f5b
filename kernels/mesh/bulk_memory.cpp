#include "kernels/mesh/bulk_memory.h"

#include <sys/mman.h>

#include <algorithm>
#include <new>
#include <optional>
#include <vector>

namespace slabwright {

namespace {

constexpr std::size_t kPage = 4096;
constexpr std::size_t kLarge = std::size_t{1} << 22;  ///< bytes from which on memory may be kept, and has a head

/// Before the data of large pieces.
struct alignas(64) Head {
    std::size_t mapped;  ///< bytes of whole pages, head included; 0: from the heap
};

/// Whole pages that nobody uses.
struct Pages {
    char* data;
    std::size_t bytes;
};

thread_local std::optional<std::vector<Pages>> kept_pages;

std::size_t whole_pages(std::size_t bytes) { return (bytes + sizeof(Head) + kPage - 1) / kPage * kPage; }

char* take_pages(std::size_t bytes) {
    // Of the pieces that are large enough the smallest.
    auto best = kept_pages->end();
    for (auto piece = kept_pages->begin(); piece != kept_pages->end(); ++piece)
        if (piece->bytes >= bytes && (best == kept_pages->end() || piece->bytes < best->bytes)) best = piece;
    if (best != kept_pages->end()) {
        char* const data = best->data;
        best->data += bytes, best->bytes -= bytes;
        if (best->bytes == 0) kept_pages->erase(best);
        return data;
    }
    void* const data = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (data == MAP_FAILED) throw std::bad_alloc();
    return static_cast<char*>(data);
}

}  // namespace

KeptMemory::KeptMemory() : outermost_(!kept_pages) {
    if (outermost_) kept_pages.emplace();
}

KeptMemory::~KeptMemory() {
    if (!outermost_) return;
    for (const Pages& piece : *kept_pages) ::munmap(piece.data, piece.bytes);
    kept_pages.reset();
}

// Huge pages were tried (MADV_HUGEPAGE): on a virtual machine whose host takes free memory back, as most do, touching them for the first
// time costs two to five times what small pages cost, far more than the quicker look-ups save. So the system decides. Nor does it gain to have
// small ones made many at a time (MADV_POPULATE_WRITE).
void* take_bulk(std::size_t bytes) {
    if (bytes < kLarge) return ::operator new(bytes);
    const bool mapped = kept_pages.has_value();
    void* const all = mapped ? take_pages(whole_pages(bytes)) : ::operator new (bytes + sizeof(Head), std::align_val_t{alignof(Head)});
    return ::new (all) Head{mapped ? whole_pages(bytes) : 0} + 1;
}

void release_bulk(void* data, std::size_t bytes) noexcept {
    if (bytes < kLarge) {
        ::operator delete(data);
        return;
    }
    Head* const head = static_cast<Head*>(data) - 1;
    if (head->mapped == 0) {
        ::operator delete (head, std::align_val_t{alignof(Head)});
        return;
    }
    const Pages pages{reinterpret_cast<char*>(head), head->mapped};
    if (kept_pages) {
        try {
            kept_pages->push_back(pages);
            return;
        } catch (const std::bad_alloc&) {}
    }
    ::munmap(pages.data, pages.bytes);
}

}  // namespace slabwright
