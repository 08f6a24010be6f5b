#include "kernels/mesh/surface_facets.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <utility>

#include "kernels/geometry/triangle.h"

namespace slabwright {

namespace {

constexpr int kRounds = 12;     // each makes what is off a quarter of it
constexpr double kShare = 0.9;  // of the deviation, that middles may be off: beside them it may be more
// So many facets for each that there was, and as many more; what then is off stays so.
constexpr std::size_t kEach = 64, kMore = 100'000;
constexpr std::uint32_t kNone = 0xFFFFFFFF;

// Places within a facet, as shares of its corners.
constexpr double kThird = 1.0 / 3;
constexpr std::array<Point3, 4> kWithin{
    {{kThird, kThird, kThird}, {0.5, 0.25, 0.25}, {0.25, 0.5, 0.25}, {0.25, 0.25, 0.5}}};

struct FacetEdge {
    std::array<std::uint32_t, 2> facets{kNone, kNone};
    std::uint32_t middle = kNone;  // the corner that divides it
};

std::uint64_t key_of(std::uint32_t a, std::uint32_t b) {
    return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
}

class Refiner {
public:
    Refiner(const ParametricSurface& surface, double deviation, SurfaceFacets& mesh)
        : surface_(surface), deviation_(deviation), mesh_(mesh) {}

    // Whether there was something to divide.
    bool round() {
        edges_.clear();
        edges_.reserve(2 * mesh_.facets.size());
        for (std::uint32_t f = 0; f < mesh_.facets.size(); ++f)
            for (std::size_t k = 0; k < 3; ++k) {
                std::array<std::uint32_t, 2>& known = edge(mesh_.facets[f], k).facets;
                known[known[0] == kNone ? 0 : 1] = f;
            }
        const std::size_t before = mesh_.at.size();
        for (const Index3& facet : mesh_.facets)
            for (std::size_t k = 0; k < 3; ++k) divide(facet[k], facet[(k + 1) % 3]);
        std::vector<Index3> divided;
        divided.reserve(mesh_.facets.size());
        for (const Index3& facet : mesh_.facets) append(facet, divided);
        mesh_.facets = std::move(divided);
        return mesh_.at.size() > before;
    }

    [[nodiscard]] double farthest() const {
        double most = 0;
        for (const Index3& facet : mesh_.facets)
            for (const Point3& share : kWithin) {
                const Point3 p = over(facet, share);
                if (const double own = off(p, facet); own > most) most = std::max(most, nearest(p, own));
            }
        return most;
    }

private:
    FacetEdge& edge(const Index3& facet, std::size_t k) {
        return edges_[key_of(facet[k], facet[(k + 1) % 3])];
    }

    [[nodiscard]] Triangle corners(const Index3& facet) const {
        return {mesh_.at[facet[0]], mesh_.at[facet[1]], mesh_.at[facet[2]]};
    }
    [[nodiscard]] double off(const Point3& p, const Index3& facet) const {
        return length(minus(p, closest_on_triangle(p, corners(facet))));
    }
    // The surface at a mean of a facet's parameters.
    [[nodiscard]] Point3 over(const Index3& facet, const Point3& share) const {
        double u = 0, v = 0;
        for (std::size_t k = 0; k < 3; ++k)
            u += share[k] * mesh_.uv[facet[k]][0], v += share[k] * mesh_.uv[facet[k]][1];
        return surface_(u, v);
    }
    // Where parameters run unevenly the surface over a facet's middle lies over another facet.
    [[nodiscard]] double nearest(const Point3& p, double own) const {
        for (const Index3& facet : mesh_.facets) {
            if (own <= deviation_) break;
            const Triangle at = corners(facet);
            bool far = false;
            for (std::size_t k = 0; k < 3; ++k) {
                const auto [low, high] = std::minmax({at[0][k], at[1][k], at[2][k]});
                far = far || p[k] < low - own || p[k] > high + own;
            }
            if (!far) own = std::min(own, off(p, facet));
        }
        return own;
    }

    std::uint32_t corner(const Point3& at, double u, double v) {
        mesh_.at.push_back(at);
        mesh_.uv.push_back({u, v});
        return static_cast<std::uint32_t>(mesh_.at.size() - 1);
    }

    void divide(std::uint32_t a, std::uint32_t b) {
        FacetEdge& edge = edges_[key_of(a, b)];
        if (edge.middle != kNone || edge.facets[1] == kNone) return;
        // A wave that crosses the edge in its middle is seen beside it.
        for (const double share : {0.5, 0.25, 0.75}) {
            const auto [u, v] = between(a, b, share);
            const Point3 p = surface_(u, v);
            if (!(std::min(off(p, mesh_.facets[edge.facets[0]]), off(p, mesh_.facets[edge.facets[1]])) >
                  kShare * deviation_))
                continue;
            const auto [mu, mv] = between(a, b, 0.5);
            edge.middle = corner(surface_(mu, mv), mu, mv);
            return;
        }
    }
    [[nodiscard]] std::array<double, 2> between(std::uint32_t a, std::uint32_t b, double share) const {
        const auto &p = mesh_.uv[a], &q = mesh_.uv[b];
        return {p[0] + share * (q[0] - p[0]), p[1] + share * (q[1] - p[1])};
    }

    // What a facet becomes whose edges are divided.
    void append(const Index3& facet, std::vector<Index3>& out) {
        std::array<std::uint32_t, 3> middle{};
        for (std::size_t k = 0; k < 3; ++k) middle[k] = edge(facet, k).middle;
        const auto count = 3 - std::count(middle.begin(), middle.end(), kNone);
        if (count == 3) {
            for (std::size_t k = 0; k < 3; ++k) out.push_back({facet[k], middle[k], middle[(k + 2) % 3]});
            out.push_back({middle[0], middle[1], middle[2]});
        } else if (count == 2) {
            std::size_t k = 0;  // the edge that is whole, from a to b
            while (middle[k] != kNone) ++k;
            const std::uint32_t a = facet[k], b = facet[(k + 1) % 3], c = facet[(k + 2) % 3],
                                of_bc = middle[(k + 1) % 3], of_ca = middle[(k + 2) % 3];
            out.push_back({of_ca, of_bc, c});
            const auto across = [&](std::uint32_t i, std::uint32_t j) {
                return length(minus(mesh_.at[i], mesh_.at[j]));
            };
            if (across(a, of_bc) < across(b, of_ca))
                out.push_back({a, b, of_bc}), out.push_back({a, of_bc, of_ca});
            else out.push_back({a, b, of_ca}), out.push_back({b, of_bc, of_ca});
        } else if (count == 1) {
            std::size_t k = 0;
            while (middle[k] == kNone) ++k;
            out.push_back({facet[k], middle[k], facet[(k + 2) % 3]});
            out.push_back({middle[k], facet[(k + 1) % 3], facet[(k + 2) % 3]});
        } else {
            if (std::none_of(kWithin.begin(), kWithin.end(), [&](const Point3& share) {
                    return off(over(facet, share), facet) > kShare * deviation_;
                }))
                return out.push_back(facet);
            double u = 0, v = 0;
            for (const std::uint32_t k : facet) u += mesh_.uv[k][0] / 3, v += mesh_.uv[k][1] / 3;
            const std::uint32_t centre = corner(surface_(u, v), u, v);
            for (std::size_t k = 0; k < 3; ++k) out.push_back({facet[k], facet[(k + 1) % 3], centre});
        }
    }

    const ParametricSurface& surface_;
    double deviation_;
    SurfaceFacets& mesh_;
    std::unordered_map<std::uint64_t, FacetEdge> edges_;  // looked up only, so its order decides nothing
};

}  // namespace

double refine_on(const ParametricSurface& surface, double deviation_mm, SurfaceFacets& mesh) {
    Refiner refiner(surface, deviation_mm, mesh);
    const std::size_t most = kEach * mesh.facets.size() + kMore;
    for (int round = 0; round < kRounds && mesh.facets.size() < most && refiner.round(); ++round) {}
    return refiner.farthest();
}

}  // namespace slabwright
