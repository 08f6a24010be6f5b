#include "kernels/repair/t_junctions.h"

#include <algorithm>
#include <array>
#include <tuple>

#include "kernels/parallel/parallel.h"
#include "kernels/repair/point_tree.h"

namespace slabwright {

namespace {

/// Vertices this near count as lying on an edge, whichever way their own border leads, mm.
constexpr double kOnEdge = 1e-3;
/// The cosine from which on a border counts as running along another.
constexpr double kAlong = 0.8;

/// A side of a facet that is to be split, from its corner k on, at these vertices in this order.
struct SplitSide {
    std::uint32_t facet, k;
    std::vector<std::uint32_t> at;
    double farthest = 0;
    std::uint32_t farthest_vertex = 0;
};

/// An odd edge.
struct OddEdge {
    std::uint32_t low, high;
    EdgeUse split;  ///< the use that no other faces
};

/// The odd edges that end at each vertex, in compressed rows.
struct EdgesAtVertices {
    std::vector<std::uint32_t> start, other_end;

    EdgesAtVertices(std::span<const OddEdge> edges, std::size_t vertex_count) : start(vertex_count + 1, 0) {
        for (const OddEdge& e : edges) ++start[e.low + 1], ++start[e.high + 1];
        for (std::size_t v = 0; v < vertex_count; ++v) start[v + 1] += start[v];
        other_end.resize(2 * edges.size());
        std::vector<std::uint32_t> next(start.begin(), start.end() - 1);
        for (const OddEdge& e : edges) {
            other_end[next[e.low]++] = e.high;
            other_end[next[e.high]++] = e.low;
        }
    }
    [[nodiscard]] std::span<const std::uint32_t> of(std::uint32_t v) const {
        return std::span(other_end).subspan(start[v], start[v + 1] - start[v]);
    }
};

std::vector<OddEdge> odd_edges(std::span<const EdgeUse> uses) {
    std::vector<OddEdge> odd;
    for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
        if (edge.size() % 2 == 0) return;
        const bool more_reversed = excess(edge) < 0;
        const auto split = std::find_if(edge.begin(), edge.end(),
                                        [&](const EdgeUse& use) { return use.reversed() == more_reversed; });
        odd.push_back({edge[0].low, edge[0].high, *split});
    });
    return odd;
}

bool runs_along(const FacetSoup& soup, const EdgesAtVertices& at, std::uint32_t m, const Xyz& along,
                double along_length) {
    for (const std::uint32_t w : at.of(m)) {
        const Xyz mine = minus(soup.at(w), soup.at(m));
        if (std::abs(inner(mine, along)) >= kAlong * length(mine) * along_length) return true;
    }
    return false;
}

/// The vertices at which an odd edge is to be split, in order from the split facet's corner on.
SplitSide split_side(const FacetSoup& soup, const PointTree& tree, const EdgesAtVertices& at,
                     const OddEdge& edge, double tolerance, double off_ends) {
    SplitSide side{edge.split.facet(), edge.split.corner(), {}};
    const Index3& f = soup.facets[side.facet];
    const std::uint32_t a = f[side.k], b = f[(side.k + 1) % 3], c = f[(side.k + 2) % 3];
    const Xyz pa = soup.at(a), pb = soup.at(b), along = minus(pb, pa);
    const double square = inner(along, along), along_length = std::sqrt(square);
    std::vector<std::tuple<double, std::uint32_t>> found;
    tree.near_segment(pa, pb, tolerance, [&](std::uint32_t m) {
        if (m == a || m == b || m == c) return;
        const Xyz p = soup.at(m), from = minus(p, pa);
        const double t = inner(from, along) / square;
        if (!(t > 0 && t < 1)) return;
        const double away = length(minus(from, {t * along[0], t * along[1], t * along[2]}));
        if (away > tolerance || p == pa || p == pb) return;
        const double from_end = std::min(t, 1 - t) * along_length;
        if (from_end < off_ends || from_end < away) return;
        if (away > kOnEdge && !runs_along(soup, at, m, along, along_length)) return;
        found.emplace_back(t, m);
        if (away > side.farthest || side.at.empty()) side.farthest = away, side.farthest_vertex = m;
        side.at.push_back(m);
    });
    std::sort(found.begin(), found.end());
    for (std::size_t i = 0; i < found.size(); ++i) side.at[i] = std::get<1>(found[i]);
    return side;
}

/// One facet becomes a fan for each of its sides that are split: from the opposite corner, so that the other
/// two sides stay whole and each fall to one facet of the fan.
void split_facet(FacetSoup& soup, std::uint32_t facet, std::span<const SplitSide* const> sides) {
    struct Piece {
        Index3 corners;
        std::array<const SplitSide*, 3> splits;
    };
    Piece whole{soup.facets[facet], {}};
    for (const SplitSide* side : sides) whole.splits[side->k] = side;
    std::vector<Piece> open{whole};
    bool first = true;
    while (!open.empty()) {
        const Piece piece = open.back();
        open.pop_back();
        std::size_t k = 0;
        while (k < 3 && piece.splits[k] == nullptr) ++k;
        if (k == 3) {
            if (has_equal_corners(piece.corners)) continue;
            if (first) soup.facets[facet] = piece.corners;
            else soup.facets.push_back(piece.corners);
            first = false;
            continue;
        }
        const std::uint32_t b = piece.corners[(k + 1) % 3], c = piece.corners[(k + 2) % 3];
        std::uint32_t from = piece.corners[k];
        const SplitSide* last_side = piece.splits[(k + 2) % 3];  // c to the first corner
        for (const std::uint32_t m : piece.splits[k]->at) {
            open.push_back({{from, m, c}, {nullptr, nullptr, last_side}});
            last_side = nullptr;
            from = m;
        }
        open.push_back({{from, b, c}, {nullptr, piece.splits[(k + 1) % 3], last_side}});
    }
}

}  // namespace

EdgeSplits split_at_vertices(Context& context, FacetSoup& soup, std::span<const EdgeUse> uses,
                             double tolerance_mm, double off_ends_mm) {
    EdgeSplits result;
    const std::vector<OddEdge> odd = odd_edges(uses);
    std::vector<std::uint32_t> ends;
    for (const OddEdge& e : odd) ends.push_back(e.low), ends.push_back(e.high);
    std::sort(ends.begin(), ends.end());
    ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
    const EdgesAtVertices at(odd, soup.vertices.size());
    const PointTree tree(soup.vertices, std::move(ends));
    std::vector<SplitSide> sides(odd.size());
    parallel_for(context, odd.size(), 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            sides[i] = split_side(soup, tree, at, odd[i], tolerance_mm, off_ends_mm);
    });
    std::vector<const SplitSide*> order;
    for (const SplitSide& side : sides)
        if (!side.at.empty()) order.push_back(&side);
    std::sort(order.begin(), order.end(), [](const SplitSide* a, const SplitSide* b) {
        return std::tie(a->facet, a->k) < std::tie(b->facet, b->k);
    });
    for (const SplitSide* side : order) {
        if (result.edges++ > 0 && side->farthest <= result.farthest_mm) continue;
        result.farthest_mm = side->farthest;
        result.where = soup.at(side->farthest_vertex);
    }
    for (std::size_t i = 0, j = 0; i < order.size(); i = j) {
        while (j < order.size() && order[j]->facet == order[i]->facet) ++j;
        split_facet(soup, order[i]->facet, std::span(order).subspan(i, j - i));
    }
    return result;
}

}  // namespace slabwright
