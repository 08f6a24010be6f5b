// The border of all up-facing facets together, as a chain of edges, closes everywhere: every facet adds a
// closed triangle, and an edge between two of them cancels. Cut into loops in any way, its winding number
// over a point is the number of up-facing facets above that point, so the silhouette is where that is not
// zero.
#include "kernels/slicing/silhouette.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "kernels/parallel/parallel.h"
#include "kernels/slicing/slicing.h"

namespace slabwright {

namespace {

using Corner = std::array<double, 3>;
using PlanEdge = std::pair<Point2, Point2>;

/// Where an edge crosses a height: the same point whichever way the edge runs.
Corner crossing(Corner a, Corner b, double z) {
    if (b < a) std::swap(a, b);
    const double t = (z - a[2]) / (b[2] - a[2]);
    return {a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), z};
}

/// Of a convex polygon the part on one side of a height: sign = 1 keeps what is above, −1 what is below.
void keep_side(std::vector<Corner>& polygon, std::vector<Corner>& scratch, double z, double sign) {
    scratch.clear();
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        const Corner &a = polygon[i], &b = polygon[i + 1 < polygon.size() ? i + 1 : 0];
        const double from = sign * (a[2] - z), to = sign * (b[2] - z);
        if (from >= 0) scratch.push_back(a);
        if ((from > 0 && to < 0) || (from < 0 && to > 0)) scratch.push_back(crossing(a, b, z));
    }
    polygon.swap(scratch);
}

/// The facets that face down, ascending.
std::vector<std::uint32_t> facets_facing_down(Context& context, MeshView mesh) {
    constexpr std::size_t grain = std::size_t{1} << 16;
    return parallel_reduce(
        context, mesh.size(), grain, std::vector<std::uint32_t>{},
        [&](std::size_t begin, std::size_t end) {
            std::vector<std::uint32_t> down;
            for (std::size_t f = begin; f < end; ++f) {
                const Vec3f &a = mesh.vertices[mesh.facets[f][0]], &b = mesh.vertices[mesh.facets[f][1]],
                            &c = mesh.vertices[mesh.facets[f][2]];
                const double ux = double{b.x} - a.x, uy = double{b.y} - a.y, vx = double{c.x} - a.x,
                             vy = double{c.y} - a.y;
                if (ux * vy - uy * vx < 0) down.push_back(static_cast<std::uint32_t>(f));
            }
            return down;
        },
        [](std::vector<std::uint32_t> a, const std::vector<std::uint32_t>& b) {
            a.insert(a.end(), b.begin(), b.end());
            return a;
        });
}

/// The borders of facets that face down, cut off to a range of heights and seen from below: against the
/// clock, those between two of them gone.
std::vector<PlanEdge> borders_within(MeshView mesh, std::span<const std::uint32_t> down, HeightRange range) {
    std::vector<PlanEdge> edges;
    std::vector<Corner> polygon, scratch;
    std::vector<Point2> plan;
    for (const std::uint32_t f : down) {
        polygon.clear();
        double lowest = INFINITY, highest = -INFINITY;
        for (const std::uint32_t v : mesh.facets[f]) {
            const Vec3f& p = mesh.vertices[v];
            polygon.push_back({p.x, p.y, p.z});
            lowest = std::min(lowest, double{p.z});
            highest = std::max(highest, double{p.z});
        }
        if (highest <= range.low || lowest >= range.high) continue;
        keep_side(polygon, scratch, range.low, 1);
        keep_side(polygon, scratch, range.high, -1);
        plan.clear();
        for (const Corner& c : polygon) plan.push_back({to_units(c[0]), to_units(c[1])});
        for (std::size_t i = plan.size(); i-- > 0;)
            if (const Point2 from = plan[i + 1 < plan.size() ? i + 1 : 0]; from != plan[i])
                edges.emplace_back(from, plan[i]);
    }
    // Two facets that meet run along their edge in both directions.
    const auto undirected = [](const PlanEdge& e) { return std::minmax(e.first, e.second); };
    std::sort(edges.begin(), edges.end(), [&](const PlanEdge& a, const PlanEdge& b) {
        const std::pair<Point2, Point2> ua = undirected(a), ub = undirected(b);
        return ua != ub ? ua < ub : a < b;
    });
    std::vector<PlanEdge> left;
    for (std::size_t i = 0, j = 0; i < edges.size(); i = j) {
        std::ptrdiff_t forward = 0;
        const std::pair<Point2, Point2> both = undirected(edges[i]);
        for (; j < edges.size() && std::pair<Point2, Point2>(undirected(edges[j])) == both; ++j)
            forward += edges[j].first == both.first ? 1 : -1;
        const PlanEdge kept = forward > 0 ? both : PlanEdge{both.second, both.first};
        left.insert(left.end(), static_cast<std::size_t>(std::abs(forward)), kept);
    }
    return left;
}

/// Joins edges, as many of which leave every point as enter it, into loops.
void append_chains(std::vector<PlanEdge> edges, Loops& loops) {
    std::sort(edges.begin(), edges.end());
    std::vector<std::size_t> first_unused(edges.size() + 1);
    for (std::size_t i = 0; i < first_unused.size(); ++i) first_unused[i] = i;
    std::vector<char> used(edges.size(), 0);
    const auto next_from = [&](Point2 p) {
        const auto begin = std::lower_bound(edges.begin(), edges.end(), PlanEdge{p, {INT32_MIN, INT32_MIN}});
        const auto start = static_cast<std::size_t>(begin - edges.begin());
        if (start == edges.size()) return edges.size();
        std::size_t& i = first_unused[start];  // where many edges leave one point, none is asked twice
        while (i < edges.size() && edges[i].first == p && used[i]) ++i;
        return i < edges.size() && edges[i].first == p ? i : edges.size();
    };
    for (std::size_t first = 0; first < edges.size(); ++first) {
        if (used[first]) continue;
        for (std::size_t e = first; e < edges.size() && !used[e]; e = next_from(edges[e].second)) {
            used[e] = 1;
            loops.points.push_back(edges[e].first);
        }
        loops.close_loop();
    }
}

}  // namespace

Loops silhouette(Context& context, MeshView mesh) {
    // The sign of the projected area decides, in integers, so that a facet that rounding turns over belongs
    // nowhere else.
    const MemoryCharge memory(context, mesh.size(), "the silhouette");
    auto projected = [&](std::uint32_t v) {
        return Point2{to_units(mesh.vertices[v].x), to_units(mesh.vertices[v].y)};
    };
    std::vector<char> up(mesh.size());
    constexpr std::size_t grain = std::size_t{1} << 14;
    parallel_for(context, mesh.size(), grain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t f = begin; f < end; ++f) {
            const Point2 a = projected(mesh.facets[f][0]), b = projected(mesh.facets[f][1]),
                         c = projected(mesh.facets[f][2]);
            const std::int64_t ux = std::int64_t{b.x} - a.x, uy = std::int64_t{b.y} - a.y,
                               vx = std::int64_t{c.x} - a.x, vy = std::int64_t{c.y} - a.y;
            up[f] = ux * vy - uy * vx > 0;
        }
    });
    using Edge = std::pair<std::uint32_t, std::uint32_t>;
    std::vector<Edge> edges;
    for (std::size_t f = 0; f < mesh.size(); ++f) {
        if (!up[f]) continue;
        for (int k = 0; k < 3; ++k) {
            const std::uint32_t beyond = mesh.neighbours[f][k];
            if (beyond == kNoFacet || !up[beyond])
                edges.emplace_back(mesh.facets[f][k], mesh.facets[f][(k + 1) % 3]);
        }
    }
    context.throw_if_cancelled();
    std::sort(edges.begin(), edges.end());
    std::vector<char> used(edges.size(), 0);
    auto next_from = [&](std::uint32_t vertex) {
        auto it = std::lower_bound(edges.begin(), edges.end(), Edge{vertex, 0});
        while (it != edges.end() && it->first == vertex && used[static_cast<std::size_t>(it - edges.begin())])
            ++it;
        return it != edges.end() && it->first == vertex ? static_cast<std::size_t>(it - edges.begin())
                                                        : edges.size();
    };
    Loops loops;
    for (std::size_t first = 0; first < edges.size(); ++first) {
        if (used[first]) continue;
        // As many edges leave a vertex as enter it, so the walk ends only where it began.
        for (std::size_t e = first; e < edges.size() && !used[e]; e = next_from(edges[e].second)) {
            used[e] = 1;
            loops.points.push_back(projected(edges[e].first));
        }
        loops.close_loop();
    }
    return simplify(loops);
}

std::vector<Loops> shadows(Context& context, MeshView mesh, std::span<const HeightRange> ranges) {
    std::vector<Plane> planes;
    for (const HeightRange& range : ranges) planes.push_back({range.low, Side::above});
    std::vector<Section> sections = slice(context, mesh, planes);
    const std::vector<std::uint32_t> down = facets_facing_down(context, mesh);
    const MemoryCharge memory(context, down.size() * sizeof(down[0]), "the shadows");
    std::vector<Loops> found(ranges.size());
    parallel_each(context, ranges.size(), [&](std::size_t i) {
        Loops loops = std::move(sections[i].loops);
        loops.parents.clear();
        append_chains(borders_within(mesh, down, ranges[i]), loops);
        found[i] = simplify(loops);
    });
    return found;
}

}  // namespace slabwright
