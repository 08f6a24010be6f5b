#include "kernels/mesh/bulk_memory.h"

#include <sys/mman.h>

#include <algorithm>
#include <cstdint>
#include <new>
#include <optional>
#include <vector>

namespace slabwright {

namespace {

constexpr std::size_t kPage = std::size_t{1} << 21;  ///< bytes of a huge page
constexpr std::size_t kLarge = std::size_t{1}
                               << 22;  ///< bytes from which on memory may be kept, and has a head

/// Before the data of large pieces, which begin with a page.
struct alignas(64) Head {
    std::size_t mapped;  ///< bytes of whole pages, head included; 0: from the heap
};

/// Whole pages that nobody uses.
struct Pages {
    char* data;
    std::size_t bytes;
};

// A page of 2 MB is cleared in one go and found in one step, where its 512 small ones are a fault each, of 2
// to 10 µs on a virtual machine: a plan of 10 M facets takes a tenth less time. Where the system has none to
// give, or is set not to, it gives small ones. To have small ones made many at a time (MADV_POPULATE_WRITE)
// gains nothing.
void ask_for_huge_pages(char* data, std::size_t bytes) {
    ::madvise(data, bytes / kPage * kPage, MADV_HUGEPAGE);
}

char* map_pages(std::size_t bytes) {
    // The system maps where it likes: what lies before the first whole page and after the last goes back.
    void* const mapped =
        ::mmap(nullptr, bytes + kPage, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (mapped == MAP_FAILED) throw std::bad_alloc();
    char* const begin = static_cast<char*>(mapped);
    const std::size_t before = (kPage - reinterpret_cast<std::uintptr_t>(begin) % kPage) % kPage;
    if (before > 0) ::munmap(begin, before);
    ::munmap(begin + before + bytes, kPage - before);
    ask_for_huge_pages(begin + before, bytes);
    return begin + before;
}

thread_local std::optional<std::vector<Pages>> kept_pages;

std::size_t whole_pages(std::size_t bytes) { return (bytes + sizeof(Head) + kPage - 1) / kPage * kPage; }

char* take_pages(std::size_t bytes) {
    // Of the pieces that are large enough the smallest.
    auto best = kept_pages->end();
    for (auto piece = kept_pages->begin(); piece != kept_pages->end(); ++piece)
        if (piece->bytes >= bytes && (best == kept_pages->end() || piece->bytes < best->bytes)) best = piece;
    if (best != kept_pages->end()) {
        char* const data = best->data;
        best->data += bytes;
        best->bytes -= bytes;
        if (best->bytes == 0) kept_pages->erase(best);
        return data;
    }
    return map_pages(bytes);
}

// Together with the pieces that lie before and after it.
void keep_pages(Pages pages) {
    for (std::size_t k = 0; k < kept_pages->size();) {
        const Pages& piece = (*kept_pages)[k];
        const bool before = piece.data + piece.bytes == pages.data,
                   after = pages.data + pages.bytes == piece.data;
        if (!before && !after) {
            ++k;
            continue;
        }
        if (before) pages.data = piece.data;
        pages.bytes += piece.bytes;
        (*kept_pages)[k] = kept_pages->back();
        kept_pages->pop_back();
    }
    kept_pages->push_back(pages);
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

void* take_bulk(std::size_t bytes) {
    if (bytes < kLarge) return ::operator new(bytes);
    const bool mapped = kept_pages.has_value();
    char* const all =
        mapped ? take_pages(whole_pages(bytes))
               : static_cast<char*>(::operator new (bytes + sizeof(Head), std::align_val_t{kPage}));
    if (!mapped) ask_for_huge_pages(all, bytes + sizeof(Head));
    return ::new (all) Head{mapped ? whole_pages(bytes) : 0} + 1;
}

void release_bulk(void* data, std::size_t bytes) noexcept {
    if (bytes < kLarge) {
        ::operator delete(data);
        return;
    }
    Head* const head = static_cast<Head*>(data) - 1;
    if (head->mapped == 0) {
        ::operator delete (head, std::align_val_t{kPage});
        return;
    }
    const Pages pages{reinterpret_cast<char*>(head), head->mapped};
    if (kept_pages) {
        try {
            keep_pages(pages);
            return;
        } catch (const std::bad_alloc&) {}
    }
    ::munmap(pages.data, pages.bytes);
}

}  // namespace slabwright
