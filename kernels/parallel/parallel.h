// All parallelism of the project. Work is cut into chunks whose borders depend on sizes only, never on the
// number of threads, and results are joined in the order of their index: the same bytes come out on any
// number of threads. Below one chunk everything runs on the calling thread. Cancel is checked before every
// chunk.
#pragma once

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <type_traits>
#include <utility>
#include <vector>

#include "kernels/parallel/context.h"

namespace slabwright {

/// Runs fn(state, i) for i in [0, chunks), in any order and in parallel; rethrows the exception of the lowest
/// chunk that threw. The one function behind all others here; the only one that knows the thread library.
void run_chunks(Context& context, std::size_t chunks, void (*fn)(void*, std::size_t), void* state);

/// f(begin, end) over [0, n) in chunks of `grain` elements.
template <class F>
void parallel_for(Context& context, std::size_t n, std::size_t grain, F&& f) {
    if (n == 0) return;
    if (grain == 0) grain = 1;
    struct State {
        std::remove_reference_t<F>* f;
        std::size_t n, grain;
    } state{&f, n, grain};
    run_chunks(
        context, (n + grain - 1) / grain,
        [](void* p, std::size_t chunk) {
            auto& s = *static_cast<State*>(p);
            const std::size_t begin = chunk * s.grain;
            (*s.f)(begin, std::min(s.n, begin + s.grain));
        },
        &state);
}

/// f(i) for every i in [0, n), one task each: for work that is large and uneven (a layer, a level, a plane).
template <class F>
void parallel_each(Context& context, std::size_t n, F&& f) {
    parallel_for(context, n, 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) f(i);
    });
}

/// join(join(map(0, g), map(g, 2g)), …): the chunks are joined from left to right, so sums are reproducible.
template <class T, class Map, class Join>
T parallel_reduce(Context& context, std::size_t n, std::size_t grain, T identity, Map&& map, Join&& join) {
    if (n == 0) return identity;
    if (grain == 0) grain = 1;
    const std::size_t chunks = (n + grain - 1) / grain;
    struct Slot {
        T value;
    };  // keeps T = bool from becoming a packed vector
    std::vector<Slot> parts(chunks, Slot{identity});
    parallel_for(context, n, grain,
                 [&](std::size_t begin, std::size_t end) { parts[begin / grain].value = map(begin, end); });
    T total = std::move(identity);
    for (Slot& part : parts) total = join(std::move(total), std::move(part.value));
    return total;
}

/// Sorts [first, last). `less` must be a strict *total* order (break ties by id): equal elements may be
/// exchanged.
template <class It, class Less>
void parallel_sort(Context& context, It first, It last, Less less) {
    using T = typename std::iterator_traits<It>::value_type;
    const std::size_t n = static_cast<std::size_t>(last - first);
    constexpr std::size_t serial = std::size_t{1} << 14;
    if (n <= serial) {
        std::sort(first, last, less);
        return;
    }
    // Runs of a power of two many, merged pairwise; every merge is itself cut into equal shares along its
    // merge path.
    std::size_t runs = 1;
    while (n / runs > serial && runs < 64) runs *= 2;
    auto border = [&](std::size_t run) { return n / runs * run + std::min(run, n % runs); };
    parallel_each(context, runs, [&](std::size_t r) {
        std::sort(first + static_cast<std::ptrdiff_t>(border(r)),
                  first + static_cast<std::ptrdiff_t>(border(r + 1)), less);
    });
    std::vector<T> buffer(n);
    T* from = &*first;
    T* to = buffer.data();
    for (std::size_t width = 1; width < runs; width *= 2) {
        const std::size_t pairs = runs / (2 * width), shares = runs / pairs;
        parallel_each(context, pairs * shares, [&](std::size_t task) {
            const std::size_t pair = task / shares, share = task % shares;
            const std::size_t a0 = border(2 * width * pair), b0 = border(2 * width * pair + width),
                              b1 = border(2 * width * (pair + 1));
            const std::size_t na = b0 - a0, nb = b1 - b0;
            auto split =
                [&](std::size_t diagonal) {  // how many of the first `diagonal` merged elements come from a
                    std::size_t low = diagonal > nb ? diagonal - nb : 0, high = std::min(diagonal, na);
                    while (low < high) {
                        const std::size_t i = (low + high) / 2;
                        if (less(from[b0 + diagonal - i - 1], from[a0 + i])) high = i;
                        else low = i + 1;
                    }
                    return low;
                };
            const std::size_t d0 = (na + nb) * share / shares, d1 = (na + nb) * (share + 1) / shares;
            const std::size_t i0 = split(d0), i1 = split(d1);
            std::merge(from + a0 + i0, from + a0 + i1, from + b0 + (d0 - i0), from + b0 + (d1 - i1),
                       to + a0 + d0, less);
        });
        std::swap(from, to);
    }
    if (from != &*first)
        parallel_for(context, n, serial, [&](std::size_t begin, std::size_t end) {
            std::copy(from + begin, from + end, to + begin);
        });
}

}  // namespace slabwright
