#include "kernels/repair/duplicates.h"

#include <algorithm>
#include <tuple>

#include "kernels/mesh/clusters.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

Index3 sorted(Index3 f) {
    std::sort(f.begin(), f.end());
    return f;
}

void tell(DroppedFacets& dropped, const FacetSoup& soup, std::size_t facet) {
    const Index3& f = soup.facets[facet];
    const double area = length(soup.twice_area_of(facet)) / 2;
    if (dropped.count++ > 0 && area <= dropped.area_mm2) return;
    dropped.area_mm2 = area;
    dropped.where = {};
    for (const std::uint32_t v : f) dropped.where = plus(dropped.where, soup.at(v), 1.0 / 3);
}

/// first[f]: the lowest facet with the vertices of f. @return whether any but f itself is.
bool find_equals(Context& context, const FacetSoup& soup, std::vector<std::uint32_t>& first) {
    std::vector<std::uint32_t> order(soup.facets.size());
    first.resize(order.size());
    for (std::size_t f = 0; f < order.size(); ++f) first[f] = order[f] = static_cast<std::uint32_t>(f);
    std::vector<Index3> keys(order.size());
    for (std::size_t f = 0; f < order.size(); ++f) keys[f] = sorted(soup.facets[f]);
    parallel_sort(context, order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        return std::tie(keys[a], a) < std::tie(keys[b], b);
    });
    bool any = false;
    for (std::size_t i = 1; i < order.size(); ++i) {
        if (keys[order[i]] != keys[order[i - 1]] || has_equal_corners(keys[order[i]])) continue;
        first[order[i]] = first[order[i - 1]];
        any = true;
    }
    return any;
}

}  // namespace

DroppedFacets drop_duplicates(Context& context, FacetSoup& soup) {
    DroppedFacets result;
    const MemoryCharge charge(context, soup.facets.size() * 28, "facets given twice");
    std::vector<std::uint32_t> first;
    if (!find_equals(context, soup, first)) return result;
    std::vector<bool> several(first.size(), false);
    for (std::size_t f = 0; f < first.size(); ++f)
        if (first[f] != f) several[first[f]] = true;
    // Patches of facets that are there more than once, and what borders each.
    std::vector<std::uint32_t> patch(first);
    std::vector<std::int64_t> votes(first.size(), 0);  // by patch: edges bordered by an odd number
    const std::vector<EdgeUse> uses = sorted_uses(context, soup);
    const auto each = [&](auto&& on_border) {
        for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
            std::uint32_t a_several = kNoFacet;
            std::size_t others = 0;
            bool inside = false;
            for (const EdgeUse& use : edge) {
                const std::uint32_t f = first[use.facet()];
                if (!several[f]) {
                    ++others;
                } else if (a_several == kNoFacet) {
                    a_several = f;
                } else if (f != a_several) {
                    join_clusters(patch, a_several, f);
                    inside = true;
                }
            }
            if (a_several != kNoFacet && !inside) on_border(a_several, others);
        });
    };
    each([](std::uint32_t, std::size_t) {});
    each([&](std::uint32_t f, std::size_t others) {
        votes[cluster_root(patch, f)] += others % 2 != 0 || others == 0 ? 1 : -1;
    });
    std::vector<bool> dropped(first.size(), false);
    for (std::size_t f = 0; f < first.size(); ++f) {
        if (first[f] == f || votes[cluster_root(patch, first[f])] <= 0) continue;
        dropped[f] = true;
        tell(result, soup, f);
    }
    soup.drop(dropped);
    return result;
}

DroppedFacets drop_degenerates(Context& context, FacetSoup& soup) {
    DroppedFacets result;
    std::vector<bool> dropped(soup.facets.size(), false), flat(soup.facets.size(), false);
    bool any_flat = false;
    for (std::size_t f = 0; f < soup.facets.size(); ++f) {
        if (has_equal_corners(soup.facets[f])) {
            dropped[f] = true;
            tell(result, soup, f);
        } else if (const Xyz area = soup.twice_area_of(f); inner(area, area) == 0) {
            flat[f] = any_flat = true;
        }
    }
    if (any_flat)
        for_each_edge(sorted_uses(context, soup), [&](std::span<const EdgeUse> edge) {
            const std::uint32_t f = edge[0].facet();
            if (edge.size() != 1 || !flat[f] || dropped[f]) return;
            dropped[f] = true;
            tell(result, soup, f);
        });
    if (result.count > 0) soup.drop(dropped);
    return result;
}

}  // namespace slabwright
