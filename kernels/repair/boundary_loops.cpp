#include "kernels/repair/boundary_loops.h"

#include <algorithm>
#include <tuple>
#include <utility>

namespace slabwright {

namespace {

/// An edge that is missing, from one vertex to another.
struct Missing {
    std::uint32_t from, to, beside;
};

std::vector<Missing> missing_edges(std::span<const EdgeUse> uses) {
    std::vector<Missing> missing;
    for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
        const int surplus = excess(edge);
        if (surplus == 0) return;
        const auto beside = std::find_if(edge.begin(), edge.end(),
                                         [&](const EdgeUse& use) { return use.reversed() == (surplus < 0); });
        for (int i = 0; i < std::abs(surplus); ++i) {
            if (surplus > 0) missing.push_back({edge[0].high, edge[0].low, beside->facet()});
            else missing.push_back({edge[0].low, edge[0].high, beside->facet()});
        }
    });
    std::sort(missing.begin(), missing.end(), [](const Missing& a, const Missing& b) {
        return std::tie(a.from, a.to, a.beside) < std::tie(b.from, b.to, b.beside);
    });
    return missing;
}

/// Newell's normal, and what follows from it.
void measure(const FacetSoup& soup, BoundaryLoop& loop) {
    const std::size_t n = loop.vertices.size();
    Xyz low = soup.at(loop.vertices[0]), high = low, normal{};
    const Xyz origin = low;
    for (std::size_t i = 0; i < n; ++i) {
        const Xyz p = soup.at(loop.vertices[i]), q = soup.at(loop.vertices[(i + 1) % n]);
        loop.middle = plus(loop.middle, p, 1.0 / static_cast<double>(n));
        loop.length_mm += length(minus(q, p));
        normal = plus(normal, outer(minus(p, origin), minus(q, origin)));
        for (std::size_t k = 0; k < 3; ++k) {
            low[k] = std::min(low[k], p[k]);
            high[k] = std::max(high[k], p[k]);
        }
    }
    loop.diagonal_mm = length(minus(high, low));
    const double twice = length(normal);
    loop.area_mm2 = twice / 2;
    if (twice > 0) loop.normal = {normal[0] / twice, normal[1] / twice, normal[2] / twice};
    for (const std::uint32_t v : loop.vertices)
        loop.flatness_mm =
            std::max(loop.flatness_mm, std::abs(inner(minus(soup.at(v), loop.middle), loop.normal)));
}

}  // namespace

std::vector<BoundaryLoop> boundary_loops(const FacetSoup& soup, std::span<const EdgeUse> uses) {
    const std::vector<Missing> missing = missing_edges(uses);
    std::vector<bool> gone(missing.size(), false);
    std::vector<std::uint32_t> on_path(soup.vertices.size(), kNoFacet);  // place in the path
    const auto next_from = [&](std::uint32_t previous, std::uint32_t v) {
        const Xyz p = soup.at(v), back = minus(soup.at(previous), p);
        const double back_length = length(back);
        std::size_t best = missing.size();
        double sharpest = -2;
        const auto [first, last] =
            std::equal_range(missing.begin(), missing.end(), Missing{v, 0, 0},
                             [](const Missing& a, const Missing& b) { return a.from < b.from; });
        for (auto edge = first; edge != last; ++edge) {
            const auto i = static_cast<std::size_t>(edge - missing.begin());
            if (gone[i]) continue;
            const Xyz ahead = minus(soup.at(edge->to), p);
            const double lengths = length(ahead) * back_length;
            const double cosine = lengths > 0 ? inner(ahead, back) / lengths : 1;
            if (best == missing.size() || cosine > sharpest) best = i, sharpest = cosine;
        }
        return best;
    };
    std::vector<BoundaryLoop> loops;
    std::vector<std::uint32_t> path, edges;  // vertices, and the edge that leads away from each
    for (std::size_t start = 0; start < missing.size(); ++start) {
        if (gone[start]) continue;
        path.assign(1, missing[start].from);
        edges.clear();
        on_path[path[0]] = 0;
        std::size_t edge = start;
        while (!path.empty()) {
            gone[edge] = true;
            edges.push_back(static_cast<std::uint32_t>(edge));
            const std::uint32_t v = missing[edge].to;
            if (on_path[v] != kNoFacet) {
                const std::uint32_t from = on_path[v];
                BoundaryLoop loop;
                loop.vertices.assign(path.begin() + from, path.end());
                loop.beside = missing[edges[from]].beside;
                for (std::size_t i = from + 1; i < path.size(); ++i) on_path[path[i]] = kNoFacet;
                path.resize(from + 1);
                edges.resize(from);
                measure(soup, loop);
                loops.push_back(std::move(loop));
            } else {
                on_path[v] = static_cast<std::uint32_t>(path.size());
                path.push_back(v);
            }
            const std::uint32_t previous = missing[edge].from;
            edge = next_from(previous, path.back());
            if (edge == missing.size()) break;
        }
        for (const std::uint32_t v : path) on_path[v] = kNoFacet;
    }
    return loops;
}

}  // namespace slabwright
