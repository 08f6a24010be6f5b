#include "kernels/repair/inner_walls.h"

#include <algorithm>
#include <numeric>
#include <tuple>

#include "kernels/mesh/clusters.h"

namespace slabwright {

namespace {

constexpr double kMostArea = 0.05;    // of all area, that a wall may have
constexpr double kLeastShared = 0.5;  // of its border, that others share

/// An edge that more or fewer than two facets use.
struct BorderEdge {
    double length;
    int excess;
    std::uint32_t uses;
};
/// That edge as one piece sees it.
struct PieceBorder {
    std::uint32_t piece, edge;
    int excess;
    std::uint32_t uses;
};

struct Walls {
    std::vector<std::uint32_t> of;  ///< by facet: its piece, named by its lowest facet
    std::vector<double> area;       ///< by lowest facet, mm²
    std::vector<BorderEdge> edges;
    std::vector<PieceBorder> borders;  ///< by piece
};

Walls find_pieces(const FacetSoup& soup, std::span<const EdgeUse> uses) {
    const std::size_t n = soup.facets.size();
    std::vector<std::uint32_t> of(n);
    std::iota(of.begin(), of.end(), 0u);
    for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
        if (edge.size() == 2) join_clusters(of, edge[0].facet(), edge[1].facet());
    });
    Walls walls;
    walls.of.resize(n);
    walls.area.assign(n, 0);
    for (std::uint32_t f = 0; f < n; ++f) {
        walls.of[f] = cluster_root(of, f);
        walls.area[walls.of[f]] += length(soup.twice_area_of(f)) / 2;
    }
    std::vector<PieceBorder> here;
    for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
        if (edge.size() == 2) return;
        const auto number = static_cast<std::uint32_t>(walls.edges.size());
        walls.edges.push_back({length(minus(soup.at(edge[0].low), soup.at(edge[0].high))), excess(edge),
                               static_cast<std::uint32_t>(edge.size())});
        here.clear();
        for (const EdgeUse& use : edge)
            here.push_back({walls.of[use.facet()], number, use.reversed() ? -1 : 1, 1});
        std::sort(here.begin(), here.end(),
                  [](const PieceBorder& a, const PieceBorder& b) { return a.piece < b.piece; });
        for (const PieceBorder& one : here) {
            if (!walls.borders.empty() && walls.borders.back().edge == number &&
                walls.borders.back().piece == one.piece) {
                walls.borders.back().excess += one.excess;
                ++walls.borders.back().uses;
            } else {
                walls.borders.push_back(one);
            }
        }
    });
    std::sort(walls.borders.begin(), walls.borders.end(), [](const PieceBorder& a, const PieceBorder& b) {
        return std::tie(a.piece, a.edge) < std::tie(b.piece, b.edge);
    });
    return walls;
}

/// Whether all balances along the border of a piece without it, and does not with it.
bool divides(const Walls& walls, std::span<const PieceBorder> border) {
    double all = 0, shared = 0;
    bool unbalanced = false;
    for (const PieceBorder& b : border) {
        const BorderEdge& edge = walls.edges[b.edge];
        if (b.excess == 0) continue;
        if (edge.excess != b.excess) return false;
        unbalanced = true;
        all += edge.length;
        if (edge.uses > b.uses) shared += edge.length;
    }
    return unbalanced && shared >= kLeastShared * all;
}

}  // namespace

DroppedWalls drop_inner_walls(Context& context, FacetSoup& soup) {
    DroppedWalls result;
    Walls walls = find_pieces(soup, sorted_uses(context, soup));
    const double all = std::accumulate(walls.area.begin(), walls.area.end(), 0.0);
    std::vector<std::span<const PieceBorder>> candidates;
    for (std::size_t i = 0, j = 0; i < walls.borders.size(); i = j) {
        while (j < walls.borders.size() && walls.borders[j].piece == walls.borders[i].piece) ++j;
        if (walls.area[walls.borders[i].piece] <= kMostArea * all)
            candidates.push_back(std::span(walls.borders).subspan(i, j - i));
    }
    std::sort(candidates.begin(), candidates.end(), [&](const auto& a, const auto& b) {
        return std::tie(walls.area[a[0].piece], a[0].piece) < std::tie(walls.area[b[0].piece], b[0].piece);
    });
    std::vector<bool> gone(soup.facets.size(), false);  // by piece
    for (const std::span<const PieceBorder> border : candidates) {
        if (!divides(walls, border)) continue;
        const std::uint32_t piece = border[0].piece;
        gone[piece] = true;
        for (const PieceBorder& b : border) {
            walls.edges[b.edge].excess -= b.excess;
            walls.edges[b.edge].uses -= b.uses;
        }
        if (result.count++ > 0 && walls.area[piece] <= result.area_mm2) continue;
        result.area_mm2 = walls.area[piece];
        result.where = {};
        for (const std::uint32_t v : soup.facets[piece])
            result.where = plus(result.where, soup.at(v), 1.0 / 3);
    }
    if (result.count == 0) return result;
    result.dropped.resize(soup.facets.size());
    for (std::size_t f = 0; f < soup.facets.size(); ++f) result.dropped[f] = gone[walls.of[f]];
    soup.drop(result.dropped);
    return result;
}

}  // namespace slabwright
