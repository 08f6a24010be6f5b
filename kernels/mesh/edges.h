// Every edge of a mesh with all the facets that use it. The work behind adjacency and report.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "kernels/errors.h"
#include "kernels/mesh/mesh.h"
#include "kernels/mesh/raw_array.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

/// One facet's use of an edge between the vertices low < high.
struct EdgeUse {
    std::uint32_t low, high;
    std::uint32_t code;  ///< 2·(3·facet + k) + (1 when the facet runs from high to low)

    [[nodiscard]] std::uint32_t facet() const noexcept { return code / 6; }
    [[nodiscard]] std::uint32_t corner() const noexcept { return code / 2 % 3; }  ///< k: the edge starts at this corner
    [[nodiscard]] bool reversed() const noexcept { return (code & 1u) != 0; }
};

/// The largest mesh whose edge uses and corners can be numbered in 32 bits.
inline constexpr std::size_t kMaxFacets = 0xFFFFFFFFu / 6;

/// Calls on_edge(T& part, uses) once for every edge; `uses` holds all uses of the edge, by ascending facet. Edges of no
/// length (both ends the same vertex) are left out. The parts, one per block of vertices, are joined in order.
/// Scratch: 36 bytes a facet, charged.
/// @throws Error(input, "mesh.too_large") over kMaxFacets
template <class T, class OnEdge, class Join>
T reduce_edges(Context& context, std::span<const Index3> facets, std::size_t vertex_count, T identity, OnEdge&& on_edge, Join&& join) {
    if (facets.size() > kMaxFacets)
        throw Error(ErrorKind::input, "mesh.too_large", "a mesh may have " + std::to_string(kMaxFacets) + " facets at most",
                    std::to_string(facets.size()) + " facets", "reduce the mesh or split the pattern");
    if (facets.empty()) return identity;
    // Uses are brought together in two steps: first by block of low vertices, then inside each block, which fits the
    // cache, by low vertex and by (high, facet). Vertices are numbered by first use, so a block is a piece of surface.
    const std::size_t uses_wanted = std::size_t{1} << 14, most_blocks = 1024;
    const std::size_t wanted = std::clamp<std::size_t>(3 * facets.size() / uses_wanted, 1, most_blocks);
    unsigned shift = 0;
    while ((vertex_count >> shift) + 1 > wanted && shift < 32) ++shift;
    const std::size_t blocks = (vertex_count >> shift) + 1;
    const std::size_t grain = std::max<std::size_t>(std::size_t{1} << 14, (facets.size() + 63) / 64);
    const std::size_t chunks = (facets.size() + grain - 1) / grain;

    auto each_use = [&](std::size_t begin, std::size_t end, auto&& take) {
        for (std::size_t f = begin; f < end; ++f) {
            const Index3 v = facets[f];
            for (std::uint32_t k = 0; k < 3; ++k) {
                const std::uint32_t a = v[k], b = v[k == 2 ? 0 : k + 1];
                if (a == b) continue;
                const std::uint32_t reversed = a > b ? 1u : 0u;
                take(EdgeUse{std::min(a, b), std::max(a, b), 2 * (3 * static_cast<std::uint32_t>(f) + k) + reversed});
            }
        }
    };

    std::vector<std::uint32_t> next(chunks * blocks, 0);
    parallel_for(context, facets.size(), grain, [&](std::size_t begin, std::size_t end) {
        std::uint32_t* count = &next[begin / grain * blocks];
        each_use(begin, end, [&](EdgeUse use) { ++count[use.low >> shift]; });
    });
    std::vector<std::uint32_t> starts(blocks + 1);
    std::uint32_t total = 0;
    for (std::size_t block = 0; block < blocks; ++block) {
        starts[block] = total;
        for (std::size_t chunk = 0; chunk < chunks; ++chunk) total += std::exchange(next[chunk * blocks + block], total);
    }
    starts[blocks] = total;
    const MemoryCharge charge(context, std::uint64_t{total} * sizeof(EdgeUse), "the edges of the mesh");
    RawArray<EdgeUse> uses(total);
    parallel_for(context, facets.size(), grain, [&](std::size_t begin, std::size_t end) {
        std::uint32_t* place = &next[begin / grain * blocks];
        each_use(begin, end, [&](EdgeUse use) { uses[place[use.low >> shift]++] = use; });
    });

    auto by_high = [](const EdgeUse& a, const EdgeUse& b) { return a.high != b.high ? a.high < b.high : a.code < b.code; };
    return parallel_reduce(
        context, blocks, 1, identity,
        [&](std::size_t block, std::size_t) {
            T part = identity;
            const std::span<const EdgeUse> mine = uses.span().subspan(starts[block], starts[block + 1] - starts[block]);
            const std::uint32_t origin = static_cast<std::uint32_t>(block << shift);
            std::vector<std::uint32_t> place((std::size_t{1} << shift) + 1, 0);
            for (const EdgeUse& use : mine) ++place[use.low - origin + 1];
            for (std::size_t v = 0; v + 1 < place.size(); ++v) place[v + 1] += place[v];
            RawArray<EdgeUse> sorted(mine.size());
            for (const EdgeUse& use : mine) sorted[place[use.low - origin]++] = use;
            for (std::size_t begin = 0, end = 0; begin < sorted.size(); begin = end) {
                while (end < sorted.size() && sorted[end].low == sorted[begin].low) ++end;
                if (end - begin <= 24) {
                    for (std::size_t i = begin + 1; i < end; ++i) {
                        const EdgeUse use = sorted[i];
                        std::size_t j = i;
                        for (; j > begin && by_high(use, sorted[j - 1]); --j) sorted[j] = sorted[j - 1];
                        sorted[j] = use;
                    }
                } else {
                    std::sort(sorted.data() + begin, sorted.data() + end, by_high);
                }
                for (std::size_t i = begin, j = begin; i < end; i = j) {
                    while (j < end && sorted[j].high == sorted[i].high) ++j;
                    on_edge(part, std::span<const EdgeUse>(sorted.data() + i, j - i));
                }
            }
            return part;
        },
        join);
}

}  // namespace slabwright
