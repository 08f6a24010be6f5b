// Every edge of a mesh with all the facets that use it, fan by fan. The work behind adjacency and report.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "kernels/errors.h"
#include "kernels/mesh/mesh.h"
#include "kernels/mesh/raw_array.h"
#include "kernels/parallel/deal.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

/// One facet's use of an edge between the vertices low < high.
struct EdgeUse {
    std::uint32_t low, high;
    std::uint32_t code;  ///< 2·(3·facet + k) + (1 when the facet runs from high to low)

    [[nodiscard]] std::uint32_t facet() const noexcept { return code / 6; }
    [[nodiscard]] std::uint32_t corner() const noexcept {
        return code / 2 % 3;
    }  ///< k: the edge starts at this corner
    [[nodiscard]] bool reversed() const noexcept { return (code & 1u) != 0; }
};

/// The largest mesh whose edge uses and corners can be numbered in 32 bits.
inline constexpr std::size_t kMaxFacets = 0xFFFFFFFFu / 6;

[[nodiscard]] inline Error too_many_facets(std::size_t facets) {
    return {ErrorKind::input, "mesh.too_large",
            "a mesh may have " + std::to_string(kMaxFacets) + " facets at most",
            std::to_string(facets) + " facets", "reduce the mesh or split the pattern"};
}

/// Fans of more uses are sorted by other means, and not searched for what is odd about them.
inline constexpr std::size_t kPlainFan = 24;

/// Sorts eight numbers by comparisons that do not depend on one another's outcome: in a mesh without order a
/// branch would be foretold wrongly half of the time.
inline void sort_eight(std::span<std::uint64_t, 8> k) {
    const auto order = [&](std::size_t i, std::size_t j) {
        const std::uint64_t a = k[i], b = k[j];
        k[i] = a < b ? a : b;
        k[j] = a < b ? b : a;
    };
    order(0, 2);
    order(1, 3);
    order(4, 6);
    order(5, 7);
    order(0, 4);
    order(1, 5);
    order(2, 6);
    order(3, 7);
    order(0, 1);
    order(2, 3);
    order(4, 5);
    order(6, 7);
    order(2, 4);
    order(3, 5);
    order(1, 4);
    order(3, 6);
    order(1, 2);
    order(3, 4);
    order(5, 6);
}

/// Likewise sixteen: the halves, which then are merged.
inline void sort_sixteen(std::span<std::uint64_t, 16> k) {
    const auto order = [&](std::size_t i, std::size_t j) {
        const std::uint64_t a = k[i], b = k[j];
        k[i] = a < b ? a : b;
        k[j] = a < b ? b : a;
    };
    sort_eight(k.first<8>());
    sort_eight(k.last<8>());
    for (std::size_t i = 0; i < 8; ++i) order(i, 15 - i);
    for (const std::size_t step : {4, 2, 1})
        for (std::size_t i = 0; i < 16; ++i)
            if ((i & step) == 0) order(i, i + step);
}

/// Sorts the uses of one block, whose low vertices are [origin, origin + width), and hands out fan after fan
/// (see reduce_fans).
template <class OnFan>
void sort_fans(std::span<const EdgeUse> uses, std::uint32_t origin, std::size_t width, OnFan&& on_fan) {
    constexpr std::size_t few = 8;
    std::vector<std::uint32_t> place(width + 1, 0);
    for (const EdgeUse& use : uses) ++place[use.low - origin + 1];
    for (std::size_t v = 0; v < width; ++v) place[v + 1] += place[v];
    // Of a use the upper end and the code, which is what they are sorted by; and some more to be read behind
    // the last ones.
    RawArray<std::uint64_t> keys(uses.size() + few);
    for (const EdgeUse& use : uses)
        keys[place[use.low - origin]++] = std::uint64_t{use.high} << 32 | use.code;
    std::fill_n(keys.data() + uses.size(), few, 0);
    std::array<EdgeUse, kPlainFan> plain;
    std::vector<EdgeUse> many;
    for (std::size_t v = 0, begin = 0, end = 0; v < width; ++v, begin = end) {
        end = place[v];
        const std::size_t n = end - begin;
        if (n == 0) continue;
        std::uint64_t* const mine = keys.data() + begin;
        const auto use_of = [&](std::uint64_t key) {
            return EdgeUse{origin + static_cast<std::uint32_t>(v), static_cast<std::uint32_t>(key >> 32),
                           static_cast<std::uint32_t>(key)};
        };
        if (n <= few) {
            std::array<std::uint64_t, few> sorted;
            for (std::size_t i = 0; i < few; ++i) sorted[i] = i < n ? mine[i] : ~std::uint64_t{0};
            sort_eight(sorted);
            for (std::size_t i = 0; i < few; ++i) plain[i] = use_of(sorted[i]);
            on_fan(std::span<const EdgeUse>(plain.data(), n));
            continue;
        }
        if (n <= kPlainFan) {
            for (std::size_t i = 1; i < n; ++i) {
                const std::uint64_t key = mine[i];
                std::size_t j = i;
                for (; j > 0 && key < mine[j - 1]; --j) mine[j] = mine[j - 1];
                mine[j] = key;
            }
            std::transform(mine, mine + n, plain.begin(), use_of);
            on_fan(std::span<const EdgeUse>(plain.data(), n));
            continue;
        }
        std::sort(mine, mine + n);
        many.resize(n);
        std::transform(mine, mine + n, many.begin(), use_of);
        on_fan(std::span<const EdgeUse>(many));
    }
}

/// Sorts the uses of one block as sort_fans() does. Where every edge of a fan is shared by just two facets,
/// which run along it in opposite directions and share no other edge of the fan, calls on_pair(code, code)
/// for each, and on_fan(uses) for the fans that are left, ascending. No branch depends on what most fans look
/// like.
template <class OnPair, class OnFan>
void pair_fans(std::span<const EdgeUse> uses, std::uint32_t origin, std::size_t width, OnPair&& on_pair,
               OnFan&& on_fan) {
    constexpr std::size_t few = 8, some = 16;
    std::vector<std::uint32_t> place(width + 1, 0);
    for (const EdgeUse& use : uses) ++place[use.low - origin + 1];
    for (std::size_t v = 0; v < width; ++v) place[v + 1] += place[v];
    RawArray<std::uint64_t> keys(uses.size() + some);  // as in sort_fans()
    for (const EdgeUse& use : uses)
        keys[place[use.low - origin]++] = std::uint64_t{use.high} << 32 | use.code;
    std::fill_n(keys.data() + uses.size(), some, 0);
    // Behind a fan's own keys follow some that are above them and look like those of a plain fan.
    constexpr auto behind = [] {
        std::array<std::uint64_t, some> keys_behind{};
        for (std::uint64_t i = 0; i < some; ++i)
            keys_behind[i] = (0xFFFFFF00u + i / 2) << 32 | (12 * i + i % 2);
        return keys_behind;
    }();
    const auto sorted = [&](std::size_t begin, std::size_t n, auto&& sort, auto& k) {
        for (std::size_t i = 0; i < k.size(); ++i) k[i] = i < n ? keys[begin + i] : behind[i];
        sort(std::span(k));
        bool plain = true;
        for (std::size_t i = 0; i < k.size(); i += 2)
            plain &= ((k[i] ^ k[i + 1]) >> 32 == 0) & (((k[i] ^ k[i + 1]) & 1) != 0);
        for (std::size_t i = 2; i < k.size(); i += 2) plain &= (k[i] ^ k[i - 1]) >> 32 != 0;
        std::array<std::uint64_t, std::tuple_size_v<std::remove_reference_t<decltype(k)>> / 2> facets;
        for (std::size_t i = 0; i < facets.size(); ++i)
            facets[i] = std::uint64_t{static_cast<std::uint32_t>(k[2 * i]) / 6} << 32 |
                        static_cast<std::uint32_t>(k[2 * i + 1]) / 6;
        for (std::size_t i = 1; i < facets.size(); ++i)
            for (std::size_t j = 0; j < i; ++j) plain &= facets[i] != facets[j];
        return plain;
    };
    std::vector<std::uint32_t> larger(width + 1), odd(width + 1);
    std::size_t larger_count = 0, odd_count = 0;
    for (std::size_t v = 0, begin = 0, end = 0; v < width; ++v, begin = end) {
        end = place[v];
        const std::size_t n = end - begin;
        std::array<std::uint64_t, few> k;
        const bool plain = sorted(begin, n, sort_eight, k);
        const bool is_few = n <= few;
        for (std::size_t i = 0; i < few; ++i) keys[begin + i] = i < n && is_few ? k[i] : keys[begin + i];
        larger[larger_count] = static_cast<std::uint32_t>(v);
        larger_count += is_few ? 0 : 1;
        odd[odd_count] = static_cast<std::uint32_t>(v);
        odd_count += is_few && !plain ? 1 : 0;
    }
    const std::size_t odd_few = odd_count;
    for (std::size_t i = 0; i < larger_count; ++i) {
        const std::size_t v = larger[i], begin = v == 0 ? 0 : place[v - 1], n = place[v] - begin;
        std::array<std::uint64_t, some> k;
        if (n <= some && sorted(begin, n, sort_sixteen, k)) std::copy_n(k.begin(), n, keys.data() + begin);
        else odd[odd_count++] = static_cast<std::uint32_t>(v);
    }
    std::inplace_merge(odd.begin(), odd.begin() + static_cast<std::ptrdiff_t>(odd_few),
                       odd.begin() + static_cast<std::ptrdiff_t>(odd_count));
    std::size_t at = 0;
    const auto pairs_to = [&](std::size_t end) {
        for (; at < end; at += 2)
            on_pair(static_cast<std::uint32_t>(keys[at]), static_cast<std::uint32_t>(keys[at + 1]));
    };
    std::vector<EdgeUse> fan;
    for (std::size_t i = 0; i < odd_count; ++i) {
        const std::size_t v = odd[i], begin = v == 0 ? 0 : place[v - 1], end = place[v];
        pairs_to(begin);
        at = end;
        std::sort(keys.data() + begin, keys.data() + end);
        fan.resize(end - begin);
        std::transform(keys.data() + begin, keys.data() + end, fan.begin(), [&](std::uint64_t key) {
            return EdgeUse{origin + static_cast<std::uint32_t>(v), static_cast<std::uint32_t>(key >> 32),
                           static_cast<std::uint32_t>(key)};
        });
        on_fan(std::span<const EdgeUse>(fan));
    }
    pairs_to(uses.size());
}

/// Memory that one step after the other may use, so that the system clears its pages only once.
using EdgeScratch = RawArray<std::byte>;

/// Calls on_fan(T& part, uses) once for every vertex that is the lower end of an edge, with all uses of edges
/// whose lower end it is, sorted by the upper end and then by facet. The parts, one per block of vertices,
/// are joined in order. The uses are those of n sources, in chunks of `grain`: each_use(begin, end, take)
/// calls take(EdgeUse) for every one of these sources, some times over. Scratch: 12 bytes a use where there
/// are few, 20 bytes for three on an ordinary mesh, 36 at most; charged where `scratch` is too small.
template <class T, class Uses, class OnFan, class Join>
T reduce_dealt_fans(Context& context, std::size_t n, std::size_t grain, std::size_t uses_about,
                    std::size_t vertex_count, EdgeScratch& scratch, T identity, Uses&& each_use,
                    OnFan&& on_fan, Join&& join) {
    // Uses are brought together in two steps: first by block of low vertices, then inside each block, which
    // fits the cache, by low vertex and by (high, facet). Vertices are numbered by first use, so a block is a
    // piece of surface.
    const std::size_t uses_wanted = std::size_t{1} << 14, most_blocks = 2048;
    const std::size_t blocks_wanted = std::clamp<std::size_t>(uses_about / uses_wanted, 1, most_blocks);
    unsigned shift = 0;
    while ((vertex_count >> shift) + 1 > blocks_wanted && shift < 32) ++shift;
    const std::size_t blocks = (vertex_count >> shift) + 1;
    auto count = [&](std::size_t begin, std::size_t end, auto&& take) {
        each_use(begin, end, [&](const EdgeUse& use) { take(use.low >> shift); });
    };
    auto uses = [&](std::size_t begin, std::size_t end, auto&& take) {
        each_use(begin, end, [&](const EdgeUse& use) { take(use.low >> shift, use); });
    };
    // To bound memory, about half of the uses are dealt at a time.
    std::optional<MemoryCharge> charge;
    auto room = [&](std::uint64_t total, std::uint64_t largest) {
        const std::uint64_t most = std::min(total, std::max(total / 2 + 1, largest) + largest);
        if (scratch.size() < most * sizeof(EdgeUse)) {
            charge.emplace(context, most * sizeof(EdgeUse), "the edges of the mesh");
            scratch = {};
            scratch = EdgeScratch(most * sizeof(EdgeUse));
        }
        return std::pair(reinterpret_cast<EdgeUse*>(scratch.data()),
                         std::max<std::uint64_t>(most, scratch.size() / sizeof(EdgeUse)));
    };
    T all = identity;
    auto reduce = [&](std::size_t first, std::size_t last, std::span<const std::uint32_t> starts) {
        const EdgeUse* const dealt = reinterpret_cast<const EdgeUse*>(scratch.data());
        all = join(std::move(all),
                   parallel_reduce(
                       context, last - first, 1, identity,
                       [&](std::size_t i, std::size_t) {
                           T part = identity;
                           const std::span<const EdgeUse> mine(dealt + starts[i], starts[i + 1] - starts[i]);
                           sort_fans(mine, static_cast<std::uint32_t>((first + i) << shift),
                                     std::size_t{1} << shift,
                                     [&](std::span<const EdgeUse> fan) { on_fan(part, fan); });
                           return part;
                       },
                       join));
    };
    deal(context, n, grain, blocks, count, uses, room, reduce);
    return all;
}

/// The same for the edges of all facets whose lower end v wanted(v) says; edges of no length (both ends the
/// same vertex) are left out.
/// @throws Error(input, "mesh.too_large") over kMaxFacets
template <class T, class Wanted, class OnFan, class Join>
T reduce_fans(Context& context, std::span<const Index3> facets, std::size_t vertex_count,
              EdgeScratch& scratch, T identity, Wanted&& wanted, OnFan&& on_fan, Join&& join) {
    if (facets.size() > kMaxFacets) throw too_many_facets(facets.size());
    if (facets.empty()) return identity;
    const std::size_t grain = std::max<std::size_t>(std::size_t{1} << 14, (facets.size() + 63) / 64);
    auto each_use = [&](std::size_t begin, std::size_t end, auto&& take) {
        for (std::size_t f = begin; f < end; ++f) {
            const Index3 v = facets[f];
            for (std::uint32_t k = 0; k < 3; ++k) {
                const std::uint32_t a = v[k], b = v[k == 2 ? 0 : k + 1];
                const std::uint32_t low = std::min(a, b);
                if (a == b || !wanted(low)) continue;
                take(EdgeUse{low, std::max(a, b),
                             2 * (3 * static_cast<std::uint32_t>(f) + k) + (a > b ? 1u : 0u)});
            }
        }
    };
    return reduce_dealt_fans(context, facets.size(), grain, 3 * facets.size(), vertex_count, scratch,
                             std::move(identity), each_use, on_fan, join);
}

/// As the public function, with scratch memory that is at hand.
void pair_edges(Context& context, Mesh& mesh, EdgeScratch& scratch, std::vector<std::uint32_t>* odd);

/// Calls on_edge(uses) for every edge of a fan, with all its uses by ascending facet.
template <class OnEdge>
void each_edge(std::span<const EdgeUse> fan, OnEdge&& on_edge) {
    for (std::size_t i = 0, j = 0; i < fan.size(); i = j) {
        while (j < fan.size() && fan[j].high == fan[i].high) ++j;
        on_edge(fan.subspan(i, j - i));
    }
}

}  // namespace slabwright
