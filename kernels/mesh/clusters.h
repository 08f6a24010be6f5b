// Clusters of indices [0, n): lock-free union towards the lowest member, and numbering of clusters by their lowest
// member. Both give the same result whatever the order of the calls, hence on any number of threads.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/parallel/parallel.h"

namespace slabwright {

/// The lowest member known so far of i's cluster. Shortens the path on the way; parents only ever move towards the root.
inline std::uint32_t cluster_root(std::span<std::uint32_t> parent, std::uint32_t i) {
    for (;;) {
        const std::uint32_t p = std::atomic_ref(parent[i]).load(std::memory_order_relaxed);
        if (p == i) return i;
        const std::uint32_t grandparent = std::atomic_ref(parent[p]).load(std::memory_order_relaxed);
        if (grandparent != p) std::atomic_ref(parent[i]).store(grandparent, std::memory_order_relaxed);
        i = p;
    }
}

/// Joins the clusters of a and b. Only a root is ever linked, and only to a lower index, so no cycle can arise and the
/// final root of a cluster is its lowest member.
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

/// On entry first[i] is the lowest index of i's class (first[i] == i for the first of a class); on exit it is the number
/// of the class, counted by first index. on_first(i, number) is called once per class, in parallel. Returns the count.
template <class OnFirst>
std::uint32_t number_by_first(Context& context, std::span<std::uint32_t> first, OnFirst&& on_first) {
    constexpr std::size_t grain = std::size_t{1} << 16;
    const std::size_t n = first.size(), chunks = (n + grain - 1) / grain;
    std::vector<std::uint32_t> base(chunks + 1, 0);
    std::vector<std::uint8_t> is_first(n);
    parallel_for(context, n, grain, [&](std::size_t begin, std::size_t end) {
        std::uint32_t count = 0;
        for (std::size_t i = begin; i < end; ++i) {
            is_first[i] = first[i] == i;
            count += is_first[i];
        }
        base[begin / grain + 1] = count;
    });
    for (std::size_t c = 0; c < chunks; ++c) base[c + 1] += base[c];
    // First every class gets its number in the place of its first member; the others still point there and copy it after.
    parallel_for(context, n, grain, [&](std::size_t begin, std::size_t end) {
        std::uint32_t number = base[begin / grain];
        for (std::size_t i = begin; i < end; ++i) {
            if (!is_first[i]) continue;
            on_first(i, number);
            first[i] = number++;
        }
    });
    parallel_for(context, n, grain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            if (!is_first[i]) first[i] = first[first[i]];
    });
    return base[chunks];
}

}  // namespace slabwright
