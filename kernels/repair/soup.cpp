#include "kernels/repair/soup.h"

#include <algorithm>
#include <tuple>

#include "kernels/parallel/parallel.h"

namespace slabwright {

void FacetSoup::drop(const std::vector<bool>& dropped) {
    std::size_t kept = 0;
    for (std::size_t f = 0; f < facets.size(); ++f)
        if (!dropped[f]) facets[kept++] = facets[f];
    facets.resize(kept);
}

std::vector<EdgeUse> sorted_uses(Context& context, const FacetSoup& soup, const std::vector<bool>& wanted) {
    if (soup.facets.size() > kMaxFacets) throw too_many_facets(soup.facets.size());
    std::vector<EdgeUse> uses;
    if (wanted.empty()) uses.reserve(3 * soup.facets.size());
    for (std::size_t f = 0; f < soup.facets.size(); ++f) {
        if (f % (std::size_t{1} << 20) == 0) context.throw_if_cancelled();
        const Index3& v = soup.facets[f];
        if (has_equal_corners(v)) continue;
        for (std::uint32_t k = 0; k < 3; ++k) {
            const std::uint32_t a = v[k], b = v[(k + 1) % 3];
            if (!wanted.empty() && !(wanted[a] && wanted[b])) continue;
            uses.push_back({std::min(a, b), std::max(a, b),
                            2 * (3 * static_cast<std::uint32_t>(f) + k) + (a > b ? 1u : 0u)});
        }
    }
    const MemoryCharge charge(context, 2 * uses.size() * sizeof(EdgeUse), "the edges of the mesh");
    parallel_sort(context, uses.begin(), uses.end(), [](const EdgeUse& a, const EdgeUse& b) {
        return std::tie(a.low, a.high, a.code) < std::tie(b.low, b.high, b.code);
    });
    return uses;
}

std::vector<bool> rim_vertices(std::span<const EdgeUse> uses, std::size_t vertex_count) {
    std::vector<bool> rim(vertex_count, false);
    for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
        if (edge.size() % 2 != 0) rim[edge[0].low] = rim[edge[0].high] = true;
    });
    return rim;
}

}  // namespace slabwright
