#include "kernels/mesh/bulk_memory.h"

#include <new>

namespace slabwright {

// Huge pages were tried (MADV_HUGEPAGE): on a virtual machine whose host takes free memory back, as most do, touching them for the first
// time costs two to five times what small pages cost, far more than the quicker look-ups save. So the system decides.
void* take_bulk(std::size_t bytes) { return ::operator new(bytes); }

void release_bulk(void* data, std::size_t /*bytes*/) noexcept { ::operator delete(data); }

}  // namespace slabwright
