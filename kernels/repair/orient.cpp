#include "kernels/repair/orient.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <queue>
#include <tuple>
#include <utility>

#include "kernels/mesh/clusters.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

/// From this share of its area on that faces the other way, a piece's outside is not told by its facets.
constexpr double kUnsureShare = 0.2;

/// Two facets at an edge of two, and whether both run along it the same way.
struct Link {
    std::uint32_t a, b;
    bool same_way;
};

/// Pieces of surface, connected across edges with two facets, and which of their facets face the other way.
struct Pieces {
    std::vector<std::uint32_t> of;    ///< by facet
    std::vector<bool> against;        ///< by facet: faces the other side than the piece
    std::vector<double> area;         ///< by piece, mm²
    std::vector<double> turned_area;  ///< by piece, of the facets that face the other side
};

Pieces spread(const FacetSoup& soup, const std::vector<Link>& links, std::uint64_t& one_sided) {
    const std::size_t n = soup.facets.size();
    std::vector<std::uint32_t> start(n + 1, 0), row(2 * links.size());
    for (const Link& link : links) ++start[link.a + 1], ++start[link.b + 1];
    for (std::size_t f = 0; f < n; ++f) start[f + 1] += start[f];
    std::vector<std::uint32_t> next(start.begin(), start.end() - 1);
    for (std::uint32_t l = 0; l < links.size(); ++l) row[next[links[l].a]++] = row[next[links[l].b]++] = l;
    constexpr std::uint32_t none = kNoFacet;
    Pieces pieces{std::vector<std::uint32_t>(n, none), std::vector<bool>(n, false), {}, {}};
    std::vector<std::uint32_t> queue, mine;
    for (std::uint32_t seed = 0; seed < n; ++seed) {
        if (pieces.of[seed] != none) continue;
        const auto piece = static_cast<std::uint32_t>(pieces.area.size());
        double area = 0, against = 0;
        queue.assign(1, seed);
        pieces.of[seed] = piece;
        for (std::size_t i = 0; i < queue.size(); ++i) {
            const std::uint32_t f = queue[i];
            const double own = length(soup.twice_area_of(f)) / 2;
            area += own;
            if (pieces.against[f]) against += own;
            for (std::uint32_t r = start[f]; r < start[f + 1]; ++r) {
                const Link& link = links[row[r]];
                const std::uint32_t g = link.a == f ? link.b : link.a;
                const bool side = pieces.against[f] != link.same_way;
                if (pieces.of[g] == none) {
                    pieces.of[g] = piece;
                    pieces.against[g] = side;
                    queue.push_back(g);
                } else if (pieces.against[g] != side && f <= g) {
                    ++one_sided;
                }
            }
        }
        if (against > area - against) {
            for (const std::uint32_t f : queue) pieces.against[f] = !pieces.against[f];
            against = area - against;
        }
        pieces.area.push_back(area);
        pieces.turned_area.push_back(against);
    }
    return pieces;
}

/// How well two pieces fit together as they lie: the length of edges of three facets and more where they run
/// opposite ways, less that where they run the same way, mm.
struct Fit {
    std::uint32_t a, b;
    double length;
};

std::vector<Fit> fits(const FacetSoup& soup, std::span<const EdgeUse> uses, const Pieces& pieces) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, double> sum;
    std::vector<std::pair<std::uint32_t, int>> run;  // pieces at an edge, and their excess there
    for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
        if (edge.size() < 3) return;
        run.clear();
        for (const EdgeUse& use : edge) {
            const std::uint32_t f = use.facet();
            const int way = use.reversed() != pieces.against[f] ? -1 : 1;
            const auto at = std::find_if(run.begin(), run.end(),
                                         [&](const auto& known) { return known.first == pieces.of[f]; });
            if (at == run.end()) run.emplace_back(pieces.of[f], way);
            else at->second += way;
        }
        constexpr std::size_t few = 16;  // of more pieces at one edge nothing is learnt
        if (run.size() > few) return;
        std::sort(run.begin(), run.end());
        const double mm = length(minus(soup.at(edge[0].low), soup.at(edge[0].high)));
        for (std::size_t i = 0; i < run.size(); ++i)
            for (std::size_t j = i + 1; j < run.size(); ++j)
                if (const int product = run[i].second * run[j].second; product != 0)
                    sum[{run[i].first, run[j].first}] -= mm * product;
    });
    std::vector<Fit> all;
    for (const auto& [pair, mm] : sum) all.push_back({pair.first, pair.second, mm});
    return all;
}

/// Pieces to be turned as a whole: from the largest on, each next one that fits the clearest with those that
/// are settled. Where all fits are good nothing is turned.
std::vector<bool> pieces_to_turn(const Pieces& pieces, const std::vector<Fit>& all) {
    const std::size_t n = pieces.area.size();
    std::vector<bool> turn(n, false);
    if (std::none_of(all.begin(), all.end(), [](const Fit& fit) { return fit.length < 0; })) return turn;
    std::vector<std::vector<std::pair<std::uint32_t, double>>> beside(n);
    for (const Fit& fit : all) {
        beside[fit.a].emplace_back(fit.b, fit.length);
        beside[fit.b].emplace_back(fit.a, fit.length);
    }
    std::vector<std::uint32_t> by_area(n);
    std::iota(by_area.begin(), by_area.end(), 0u);
    std::sort(by_area.begin(), by_area.end(), [&](std::uint32_t a, std::uint32_t b) {
        return pieces.area[a] != pieces.area[b] ? pieces.area[a] > pieces.area[b] : a < b;
    });
    std::vector<bool> settled(n, false);
    std::vector<double> pull(n, 0);  // of the settled pieces: to stay (over 0) or to turn
    // Clearest first; of equals the lower piece.
    std::priority_queue<std::tuple<double, std::int64_t>> open;
    const auto settle = [&](std::uint32_t p) {
        settled[p] = true;
        turn[p] = pull[p] < 0;
        for (const auto& [q, mm] : beside[p]) {
            if (settled[q]) continue;
            pull[q] += turn[p] ? -mm : mm;
            open.emplace(std::abs(pull[q]), -std::int64_t{q});
        }
    };
    for (const std::uint32_t seed : by_area) {
        if (settled[seed]) continue;
        settle(seed);
        while (!open.empty()) {
            const auto [clear, minus_q] = open.top();
            open.pop();
            const auto q = static_cast<std::uint32_t>(-minus_q);
            if (!settled[q] && clear == std::abs(pull[q])) settle(q);
        }
    }
    return turn;
}

/// Counts the connected pieces of turned facets, and finds the largest.
void tell(const FacetSoup& soup, const std::vector<Link>& links, const std::vector<bool>& turned,
          Turned& result) {
    const std::size_t n = soup.facets.size();
    std::vector<std::uint32_t> patch(n);
    std::iota(patch.begin(), patch.end(), 0u);
    for (const Link& link : links)
        if (turned[link.a] && turned[link.b]) join_clusters(patch, link.a, link.b);
    std::vector<double> area(n, 0);
    for (std::uint32_t f = 0; f < n; ++f) {
        if (!turned[f]) continue;
        ++result.facets;
        const std::uint32_t root = cluster_root(patch, f);
        if (root == f) ++result.patches;
        area[root] += length(soup.twice_area_of(f)) / 2;
    }
    std::uint32_t largest = 0;
    for (std::uint32_t f = 0; f < n; ++f)
        if (area[f] > area[largest] || !turned[largest]) largest = f;
    if (result.facets == 0) return;
    result.area_mm2 = area[largest];
    for (const std::uint32_t v : soup.facets[largest]) result.where = plus(result.where, soup.at(v), 1.0 / 3);
}

}  // namespace

Turned orient(Context& context, FacetSoup& soup) {
    Turned result;
    const std::size_t n = soup.facets.size();
    const MemoryCharge charge(context, n * 64, "the orientation of the mesh");
    const std::vector<EdgeUse> uses = sorted_uses(context, soup);
    std::vector<Link> links;
    for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
        if (edge.size() == 2)
            links.push_back({edge[0].facet(), edge[1].facet(), edge[0].reversed() == edge[1].reversed()});
    });
    context.throw_if_cancelled();
    const Pieces pieces = spread(soup, links, result.one_sided);
    context.throw_if_cancelled();
    const std::vector<bool> turn = pieces_to_turn(pieces, fits(soup, uses, pieces));
    std::vector<bool> turned(n);
    result.unsure.resize(n);
    for (std::size_t f = 0; f < n; ++f) {
        const std::uint32_t p = pieces.of[f];
        turned[f] = pieces.against[f] != turn[p];
        result.unsure[f] = pieces.turned_area[p] > kUnsureShare * pieces.area[p];
        if (turned[f]) std::swap(soup.facets[f][1], soup.facets[f][2]);
    }
    tell(soup, links, turned, result);
    return result;
}

}  // namespace slabwright
