#include "kernels/parallel/confined.h"

#include <algorithm>
#include <thread>

#if !defined(SLABWRIGHT_STD_THREADS)
#include <oneapi/tbb/task_arena.h>
#endif

namespace slabwright {

void run_confined([[maybe_unused]] Context& context, void (*fn)(void*), void* state) {
#if defined(SLABWRIGHT_STD_THREADS)
    fn(state);
#else
    // oneTBB warns on stderr of more threads than the machine has.
    const int machine = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
    tbb::task_arena arena(std::min(context.threads(), machine));
    arena.execute([&] { fn(state); });
#endif
}

}  // namespace slabwright
