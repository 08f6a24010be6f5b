// The border of all up-facing facets together, as a chain of edges, closes everywhere: every facet adds a
// closed triangle, and an edge between two of them cancels. Cut into loops in any way, its winding number
// over a point is the number of up-facing facets above that point, so the silhouette is where that is not
// zero.
#include "kernels/slicing/silhouette.h"

#include <algorithm>
#include <utility>

#include "kernels/parallel/parallel.h"

namespace slabwright {

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

}  // namespace slabwright
