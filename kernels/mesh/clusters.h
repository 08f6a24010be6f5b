// Clusters of indices [0, n): lock-free union towards the lowest member, and numbering of clusters by their
// lowest member. Both give the same result whatever the order of the calls, hence on any number of threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/parallel/parallel.h"

namespace slabwright {

/// The lowest member known so far of i's cluster. Shortens the path on the way; parents only ever move
/// towards the root.
inline std::uint32_t cluster_root(std::span<std::uint32_t> parent, std::uint32_t i) {
    for (;;) {
        const std::uint32_t p = std::atomic_ref(parent[i]).load(std::memory_order_relaxed);
        if (p == i) return i;
        const std::uint32_t grandparent = std::atomic_ref(parent[p]).load(std::memory_order_relaxed);
        if (grandparent != p) std::atomic_ref(parent[i]).store(grandparent, std::memory_order_relaxed);
        i = p;
    }
}

/// Joins the clusters of a and b. Only a root is ever linked, and only to a lower index, so no cycle can
/// arise and the final root of a cluster is its lowest member.
inline void join_clusters(std::span<std::uint32_t> parent, std::uint32_t a, std::uint32_t b) {
    for (;;) {
        a = cluster_root(parent, a);
        b = cluster_root(parent, b);
        if (a == b) return;
        if (a < b) std::swap(a, b);
        std::uint32_t expected = a;
        if (std::atomic_ref(parent[a]).compare_exchange_weak(expected, b, std::memory_order_relaxed)) return;
    }
}

/// Elements that number_by_first() numbers in one go.
inline constexpr std::size_t kNumberingChunk = 61440;

/// On entry first[i] is the lowest index of i's class (first[i] == i for the first of a class), or any lower
/// one of the class in the same chunk of kNumberingChunk; on exit it is the number of the class, counted by
/// first index. on_count(count) is called before any on_first(i, number), which is called once per class, in
/// parallel. Returns the count. Scratch: 12 bits an element.
template <class OnCount, class OnFirst>
std::uint32_t number_by_first(Context& context, std::span<std::uint32_t> first, OnCount&& on_count,
                              OnFirst&& on_first) {
    // The number of a class is how many firsts lie before its own. A bit for each first, and their count
    // before each 64 of them, are small enough for the cache, so that firsts far away are looked up quickly.
    const std::size_t n = first.size(), words = (n + 63) / 64;
    constexpr std::size_t grain = kNumberingChunk / 64;  // words
    const std::size_t chunks = (words + grain - 1) / grain;
    std::vector<std::uint64_t> is_first(words);
    std::vector<std::uint32_t> before(words), base(chunks + 1, 0);
    parallel_for(context, words, grain, [&](std::size_t begin, std::size_t end) {
        std::uint32_t count = 0;
        for (std::size_t w = begin; w < end; ++w) {
            std::uint64_t bits = 0;
            const std::size_t last = std::min(n, 64 * w + 64);
            for (std::size_t i = 64 * w; i < last; ++i) bits |= std::uint64_t{first[i] == i} << (i & 63);
            is_first[w] = bits;
            before[w] = count;
            count += static_cast<std::uint32_t>(std::popcount(bits));
        }
        base[begin / grain + 1] = count;
    });
    for (std::size_t c = 0; c < chunks; ++c) base[c + 1] += base[c];
    on_count(base[chunks]);
    parallel_for(context, words, grain, [&](std::size_t begin, std::size_t end) {
        // The firsts' own numbers follow one another.
        const std::size_t begin_index = 64 * begin, end_index = std::min(n, 64 * end);
        std::uint32_t next = base[begin / grain];
        for (std::size_t w = begin; w < end; ++w) {
            for (std::uint64_t bits = is_first[w]; bits != 0; bits &= bits - 1, ++next) {
                const std::size_t i = 64 * w + static_cast<std::size_t>(std::countr_zero(bits));
                on_first(i, next);
                first[i] = next;
            }
        }
        for (std::size_t i = begin_index; i < end_index; ++i) {
            // In the same chunk that member has its number already, and it stands where the index stood.
            const std::uint32_t mine =
                (is_first[i >> 6] >> (i & 63) & 1) != 0 ? static_cast<std::uint32_t>(i) : first[i];
            if (mine >= begin_index) {
                first[i] = first[mine];
                continue;
            }
            const std::uint64_t lower = is_first[mine >> 6] & ((std::uint64_t{1} << (mine & 63)) - 1);
            first[i] = base[(mine >> 6) / grain] + before[mine >> 6] +
                       static_cast<std::uint32_t>(std::popcount(lower));
        }
    });
    return base[chunks];
}

}  // namespace slabwright
