#include "kernels/repair/stitch.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <tuple>
#include <utility>

#include "kernels/geometry/vectors.h"
#include "kernels/mesh/clusters.h"
#include "kernels/parallel/parallel.h"
#include "kernels/repair/duplicates.h"
#include "kernels/repair/point_tree.h"
#include "kernels/repair/t_junctions.h"

namespace slabwright {

namespace {

/// What is nearest is brought together first: distances in mm, each up to the tolerance.
constexpr std::array<double, 8> kSteps{1e-5, 1e-4, 1e-3, 1e-2, 0.05, 0.1, 0.25, 0.5};
constexpr int kRounds = 4;           // at one distance
constexpr std::size_t kNearest = 8;  // candidates for each vertex

/// Two vertices that may become one.
struct Pair {
    double distance;
    std::uint32_t a, b;
    friend bool operator<(const Pair& p, const Pair& q) {
        return std::tie(p.distance, p.a, p.b) < std::tie(q.distance, q.a, q.b);
    }
};

/// Merges vertices of borders, and remembers which stretches of border that brought together.
class Stitcher {
public:
    Stitcher(Context& context, FacetSoup& soup) : context_(context), soup_(soup) {
        stretch_.resize(soup.vertices.size());
        std::iota(stretch_.begin(), stretch_.end(), 0u);
        moved_.assign(soup.vertices.size(), false);
        joined_.resize(soup.vertices.size());
        std::iota(joined_.begin(), joined_.end(), 0u);
    }

    Stitched run(double tolerance) {
        rim_ = rim_vertices(sorted_uses(context_, soup_), soup_.vertices.size());
        std::vector<EdgeUse> uses = sorted_uses(context_, soup_, rim_);
        for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
            if (edge.size() % 2 != 0) join_clusters(stretch_, edge[0].low, edge[0].high);
        });
        for (const double step : kSteps) {
            const double reach = std::min(step, tolerance);
            if (!(reach > 0)) break;
            // What a larger distance may still merge with the end of an edge does not split it before.
            const double off_ends = step >= tolerance ? 0 : tolerance;
            for (int round = 0; round < kRounds; ++round) {
                context_.throw_if_cancelled();
                const bool merged = merge(uses, reach);
                if (merged) uses = sorted_uses(context_, soup_, rim_);
                const EdgeSplits split = split_at_vertices(context_, soup_, uses, reach, off_ends);
                tell(split);
                if (split.edges > 0) uses = sorted_uses(context_, soup_, rim_);
                if (!merged && split.edges == 0) break;
            }
            if (step >= tolerance) break;
        }
        std::vector<bool> counted(stretch_.size(), false);
        for (std::uint32_t v = 0; v < stretch_.size(); ++v) {
            if (!moved_[v]) continue;
            const std::uint32_t root = cluster_root(stretch_, v);
            if (!counted[root]) ++told_.cracks;
            counted[root] = true;
        }
        return told_;
    }

private:
    void tell(const EdgeSplits& split) {
        if (split.edges > 0 && (told_.t_junctions == 0 || split.farthest_mm > told_.t_junction_mm)) {
            told_.t_junction_mm = split.farthest_mm;
            told_.t_junction_at = split.where;
        }
        told_.t_junctions += split.edges;
    }

    /// Pairs of vertices of odd edges, nearest first. @param room by vertex: how far it may move
    std::vector<Pair> pairs(const std::vector<double>& room, const std::vector<std::uint32_t>& ends,
                            std::span<const EdgeUse> uses, double reach) const {
        const PointTree tree(soup_.vertices, ends);
        std::vector<std::vector<Pair>> found(ends.size());
        parallel_for(context_, ends.size(), 256, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                const std::uint32_t v = ends[i];
                const Xyz p = soup_.at(v);
                const double mine = std::min(reach, room[v]);
                tree.near_segment(p, p, mine, [&](std::uint32_t w) {
                    const double away = length(minus(soup_.at(w), p));
                    if (w > v && away <= std::min(mine, room[w]) && !share_edge(uses, v, w))
                        found[i].push_back({away, v, w});
                });
                std::sort(found[i].begin(), found[i].end());
                if (found[i].size() > kNearest) found[i].resize(kNearest);
            }
        });
        std::vector<Pair> all;
        for (const auto& some : found) all.insert(all.end(), some.begin(), some.end());
        std::sort(all.begin(), all.end());
        return all;
    }

    static bool share_edge(std::span<const EdgeUse> uses, std::uint32_t low, std::uint32_t high) {
        const auto at =
            std::lower_bound(uses.begin(), uses.end(), std::pair(low, high),
                             [](const EdgeUse& use, const std::pair<std::uint32_t, std::uint32_t>& e) {
                                 return std::tie(use.low, use.high) < std::tie(e.first, e.second);
                             });
        return at != uses.end() && at->low == low && at->high == high;
    }

    bool merge(std::span<const EdgeUse> uses, double reach) {
        constexpr double any = kUnbounded;
        std::vector<double> room(soup_.vertices.size(), any);
        std::vector<std::uint32_t> ends;
        for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
            if (edge.size() % 2 == 0) return;
            const std::uint32_t a = edge[0].low, b = edge[0].high;
            const double half = length(minus(soup_.at(a), soup_.at(b))) / 2;
            for (const std::uint32_t v : {a, b}) {
                if (room[v] == any) ends.push_back(v);
                room[v] = std::min(room[v], half);
            }
        });
        std::sort(ends.begin(), ends.end());
        const std::vector<Pair> candidates = pairs(room, ends, uses, reach);
        if (candidates.empty()) return false;
        bool merged = false;
        for (const Pair& pair : candidates) {
            const std::uint32_t a = cluster_root(joined_, pair.a), b = cluster_root(joined_, pair.b);
            // Vertices join the one that stays, so a chain of near ones does not draw them far.
            const double away = length(minus(soup_.at(a), soup_.at(b)));
            if (a == b || away > reach) continue;
            join_clusters(joined_, a, b);
            join_clusters(stretch_, a, b);
            moved_[a] = true;
            merged = true;
            if (away > told_.crack_mm || told_.crack_at == Xyz{}) {
                told_.crack_mm = std::max(away, told_.crack_mm);
                told_.crack_at = soup_.at(a);
            }
        }
        if (!merged) return false;
        for (Index3& f : soup_.facets)
            for (std::uint32_t& v : f) v = cluster_root(joined_, v);
        std::vector<bool> gone(soup_.facets.size());
        for (std::size_t f = 0; f < gone.size(); ++f) gone[f] = has_equal_corners(soup_.facets[f]);
        soup_.drop(gone);
        return true;
    }

    Context& context_;
    FacetSoup& soup_;
    std::vector<bool> rim_, moved_;
    std::vector<std::uint32_t> stretch_, joined_;
    Stitched told_;
};

}  // namespace

Stitched stitch(Context& context, FacetSoup& soup, double tolerance_mm) {
    return Stitcher(context, soup).run(tolerance_mm);
}

}  // namespace slabwright
