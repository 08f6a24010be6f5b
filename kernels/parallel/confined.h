// For libraries that take threads on their own.
#pragma once

#include <type_traits>

#include "kernels/parallel/context.h"

namespace slabwright {

/// Runs fn(state) so that what it calls takes no more threads than the context has. Rethrows what it throws.
void run_confined(Context& context, void (*fn)(void*), void* state);

template <class F>
void run_confined(Context& context, F&& f) {
    run_confined(
        context, [](void* p) { (*static_cast<std::remove_reference_t<F>*>(p))(); }, &f);
}

}  // namespace slabwright
