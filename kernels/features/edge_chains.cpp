#include "kernels/features/edge_chains.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include "kernels/errors.h"
#include "kernels/features/round_walls.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr std::size_t kGrain = std::size_t{1} << 14;
constexpr double kRounding = 0.01;  // degrees, of a file's coordinates
constexpr double kDegrees = 180 / std::numbers::pi;

struct MeshEdge {
    std::uint32_t a = 0, b = 0;             // vertices
    std::array<std::uint32_t, 2> facets{};  // beside it
    double turn_deg = 0;
    bool convex = false;
};

std::vector<MeshEdge> edges_over(Context& context, MeshView mesh, double least_deg) {
    const FacetBends bends(context, mesh);
    const auto inner = [&](std::uint32_t f) { return mesh.role(f) == FacetRole::inner; };
    return parallel_reduce(
        context, mesh.size(), kGrain, std::vector<MeshEdge>{},
        [&](std::size_t begin, std::size_t end) {
            std::vector<MeshEdge> found;
            for (auto f = static_cast<std::uint32_t>(begin); f < end; ++f)
                for (std::uint32_t k = 0; k < 3; ++k) {
                    const std::uint32_t g = mesh.neighbours[f][k];
                    if (g == kNoFacet || g < f || inner(f) || inner(g)) continue;
                    const Bend bend = bends.at({f, k});
                    const double turn = std::abs(bend.rad) * kDegrees;
                    if (!bend.is_sure || turn < least_deg - kRounding) continue;
                    found.push_back(
                        {mesh.facets[f][k], mesh.facets[f][(k + 1) % 3], {f, g}, turn, bend.rad < 0});
                }
            return found;
        },
        [](std::vector<MeshEdge> a, const std::vector<MeshEdge>& b) {
            a.insert(a.end(), b.begin(), b.end());
            return a;
        });
}

/// Which edges meet at each vertex.
class EdgeEnds {
public:
    explicit EdgeEnds(const std::vector<MeshEdge>& edges) : edges_(edges) {
        for (std::uint32_t i = 0; i < edges.size(); ++i) {
            ends_.emplace_back(edges[i].a, i);
            ends_.emplace_back(edges[i].b, i);
        }
        std::sort(ends_.begin(), ends_.end());
    }
    /// The only edge that goes on from one at a vertex, of the same kind; the edge itself: there is none.
    [[nodiscard]] std::uint32_t next(std::uint32_t edge, std::uint32_t vertex) const {
        const auto first = std::lower_bound(ends_.begin(), ends_.end(), std::pair{vertex, 0U});
        if (ends_.end() - first < 2 || (first + 1)->first != vertex) return edge;
        if (ends_.end() - first > 2 && (first + 2)->first == vertex) return edge;
        const std::uint32_t other = first->second == edge ? (first + 1)->second : first->second;
        return edges_[other].convex == edges_[edge].convex ? other : edge;
    }

private:
    const std::vector<MeshEdge>& edges_;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> ends_;  // vertex, edge; ascending
};

std::uint32_t far_end(const MeshEdge& e, std::uint32_t vertex) { return e.a == vertex ? e.b : e.a; }

/// The chain that an edge belongs to, from its lower end or, of a closed one, from that edge.
EdgeChain chain_of(MeshView mesh, const std::vector<MeshEdge>& edges, const EdgeEnds& ends,
                   std::uint32_t edge, std::vector<char>& used) {
    // Back to where it begins, or once around.
    std::uint32_t first = edge, vertex = edges[edge].a;
    for (;;) {
        const std::uint32_t before = ends.next(first, vertex);
        if (before == first || before == edge) break;
        first = before;
        vertex = far_end(edges[first], vertex);
    }
    EdgeChain chain;
    chain.convex = edges[edge].convex;
    chain.vertices.push_back(vertex);
    for (std::uint32_t at = first;;) {
        const MeshEdge& e = edges[at];
        used[at] = 1;
        const Point3 p = to_double(mesh.vertices[e.a]), q = to_double(mesh.vertices[e.b]);
        chain.length_mm += length(minus(q, p));
        chain.sides.push_back(e.facets);
        if (e.turn_deg > chain.sharpest_deg) chain.sharpest_deg = e.turn_deg, chain.at = between(p, q, 0.5);
        vertex = far_end(e, vertex);
        if (vertex == chain.vertices.front()) {
            chain.closed = true;
            break;
        }
        chain.vertices.push_back(vertex);
        const std::uint32_t after = ends.next(at, vertex);
        if (after == at) break;
        at = after;
    }
    return chain;
}

}  // namespace

std::vector<EdgeChain> find_edge_chains(Context& context, MeshView mesh, double least_deg) {
    if (!(least_deg >= 1 && least_deg <= 179))
        throw Error(ErrorKind::usage, "edges.limit", "the least angle of a sharp edge is out of range", {},
                    "give 1 to 179 degrees");
    if (mesh.size() == 0) return {};
    const std::vector<MeshEdge> edges = edges_over(context, mesh, least_deg);
    const EdgeEnds ends(edges);
    std::vector<char> used(edges.size(), 0);
    std::vector<EdgeChain> chains;
    for (std::uint32_t i = 0; i < edges.size(); ++i)
        if (!used[i]) chains.push_back(chain_of(mesh, edges, ends, i, used));
    std::stable_sort(chains.begin(), chains.end(), [](const EdgeChain& a, const EdgeChain& b) {
        return a.length_mm != b.length_mm ? a.length_mm > b.length_mm
                                          : a.vertices.front() < b.vertices.front();
    });
    return chains;
}

}  // namespace slabwright
