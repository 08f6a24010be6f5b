#include "kernels/mesh/decimate.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <unordered_map>
#include <utility>
#include <vector>

#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

using Vector = Eigen::Vector3d;

constexpr std::size_t kClusterFrom = 4'000'000;  // facets: from here on a grid makes them fewer first
constexpr double kClusterFacets = 2'000'000;     // that the grid aims at
constexpr double kRoundShare = 0.3;              // of the edges, the cheapest, are tried in one round; the others wait for better figures
constexpr double kTurn = 0.2;                    // cosine: a facet may turn by no more in one collapse
constexpr double kLeastProgress = 0.002;         // of the facets; a round that removes fewer is the last
constexpr double kEdgeWeight = 1e-3;             // pulls a flat neighbourhood's free optimum towards the edge's middle

/// Sum of squared distances from weighted planes: xᵀAx + 2bᵀx + c.
struct Quadric {
    Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
    Vector b = Vector::Zero();
    double c = 0;
    void add_plane(const Vector& normal, double offset, double weight) {
        a += weight * normal * normal.transpose();
        b += weight * offset * normal;
        c += weight * offset * offset;
    }
    Quadric& operator+=(const Quadric& q) {
        a += q.a, b += q.b, c += q.c;
        return *this;
    }
    [[nodiscard]] double at(const Vector& x) const { return x.dot(a * x) + 2 * b.dot(x) + c; }
};

struct Edge {
    double cost = 0;
    std::uint32_t a = 0, b = 0;
    Vector place = Vector::Zero();
    bool operator<(const Edge& e) const { return cost != e.cost ? cost < e.cost : a != e.a ? a < e.a : b < e.b; }
};

bool degenerate(const Index3& f) { return f[0] == f[1] || f[1] == f[2] || f[2] == f[0]; }

Vector cross_of(const Vector& p, const Vector& q, const Vector& r) { return (q - p).cross(r - p); }

class Decimation {
public:
    Decimation(Context& context, MeshView mesh) : context_(context) {
        vertices_.reserve(mesh.vertices.size());
        for (const Vec3f& v : mesh.vertices) vertices_.emplace_back(v.x, v.y, v.z);
        facets_.reserve(mesh.facets.size());
        for (const Index3& f : mesh.facets)
            if (!degenerate(f)) facets_.push_back(f);
    }

    /// Vertices in one cell of a grid become their mean.
    void cluster() {
        double area = 0;
        for (const Index3& f : facets_) area += cross_of(vertices_[f[0]], vertices_[f[1]], vertices_[f[2]]).norm() / 2;
        const double cell = std::max(1e-6, std::sqrt(2 * area / kClusterFacets));
        struct Mean {
            std::uint32_t id = 0, count = 0;
            Vector sum = Vector::Zero();
        };
        struct Hash {
            std::size_t operator()(const std::array<std::int32_t, 3>& k) const {
                return static_cast<std::size_t>(k[0]) * 73856093u ^ static_cast<std::size_t>(k[1]) * 19349663u ^
                       static_cast<std::size_t>(k[2]) * 83492791u;
            }
        };
        std::unordered_map<std::array<std::int32_t, 3>, std::uint32_t, Hash> cells;
        std::vector<Mean> means;
        std::vector<std::uint32_t> to(vertices_.size());
        for (std::size_t i = 0; i < vertices_.size(); ++i) {
            if (i % 65536 == 0) context_.throw_if_cancelled();
            std::array<std::int32_t, 3> key{};
            for (int k = 0; k < 3; ++k) key[static_cast<std::size_t>(k)] = static_cast<std::int32_t>(std::floor(vertices_[i][k] / cell));
            const auto [entry, fresh] = cells.try_emplace(key, static_cast<std::uint32_t>(means.size()));
            if (fresh) means.emplace_back();
            Mean& mean = means[entry->second];
            mean.sum += vertices_[i];
            ++mean.count;
            to[i] = entry->second;
        }
        vertices_.clear();
        for (const Mean& mean : means) vertices_.push_back(mean.sum / mean.count);
        for (Index3& f : facets_)
            for (std::uint32_t& v : f) v = to[v];
        std::erase_if(facets_, degenerate);
    }

    void collapse_to(std::size_t wished) {
        measure();
        while (facets_.size() > wished) {
            const std::size_t before = facets_.size();
            round(wished);
            if (static_cast<double>(before - facets_.size()) < kLeastProgress * static_cast<double>(before)) break;
        }
    }

    Mesh take() {
        constexpr std::uint32_t unused = 0xFFFFFFFFu;
        Mesh mesh;
        std::vector<std::uint32_t> to(vertices_.size(), unused);
        for (const Index3& f : facets_) {
            Index3 g{};
            for (std::size_t k = 0; k < 3; ++k) {
                if (to[f[k]] == unused) {
                    to[f[k]] = static_cast<std::uint32_t>(mesh.vertices.size());
                    const Vector& v = vertices_[f[k]];
                    mesh.vertices.push_back({static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())});
                }
                g[k] = to[f[k]];
            }
            mesh.facets.push_back(g);
        }
        return mesh;
    }

private:
    /// The facets around every vertex, ascending.
    void find_facets_around() {
        starts_.assign(vertices_.size() + 1, 0);
        for (const Index3& f : facets_)
            for (const std::uint32_t v : f) ++starts_[v + 1];
        for (std::size_t i = 1; i < starts_.size(); ++i) starts_[i] += starts_[i - 1];
        around_.resize(3 * facets_.size());
        std::vector<std::uint32_t> next(starts_.begin(), starts_.end() - 1);
        for (std::size_t f = 0; f < facets_.size(); ++f)
            for (const std::uint32_t v : facets_[f]) around_[next[v]++] = static_cast<std::uint32_t>(f);
    }

    /// The quadric of a vertex: the planes of its facets, weighted by area; an open edge adds a plane upright on its facet.
    void measure() {
        find_facets_around();
        quadrics_.assign(vertices_.size(), {});
        parallel_for(context_, vertices_.size(), 4096, [&](std::size_t begin, std::size_t end) {
            for (std::size_t v = begin; v < end; ++v)
                for (std::uint32_t k = starts_[v]; k < starts_[v + 1]; ++k) {
                    const Index3& f = facets_[around_[k]];
                    Vector n = cross_of(vertices_[f[0]], vertices_[f[1]], vertices_[f[2]]);
                    const double area = n.norm() / 2;
                    if (!(area > 0)) continue;
                    n /= 2 * area;
                    quadrics_[v].add_plane(n, -n.dot(vertices_[f[0]]), area);
                    for (std::size_t e = 0; e < 3; ++e) {
                        const std::uint32_t p = f[e], q = f[(e + 1) % 3];
                        if ((p != v && q != v) || shared(p, q) > 1) continue;
                        const Vector along = vertices_[q] - vertices_[p];
                        const Vector upright = along.cross(n).normalized();
                        if (upright.allFinite()) quadrics_[v].add_plane(upright, -upright.dot(vertices_[p]), along.squaredNorm());
                    }
                }
        });
    }

    /// How many facets have both vertices.
    [[nodiscard]] int shared(std::uint32_t a, std::uint32_t b) const {
        int count = 0;
        for (std::uint32_t k = starts_[a]; k < starts_[a + 1]; ++k) {
            const Index3& f = facets_[around_[k]];
            count += f[0] == b || f[1] == b || f[2] == b;
        }
        return count;
    }

    /// Where the merged vertex lies best, and what it costs.
    void rate(Edge& edge) const {
        const Vector &p = vertices_[edge.a], &q = vertices_[edge.b], middle = (p + q) / 2;
        Quadric sum = quadrics_[edge.a];
        sum += quadrics_[edge.b];
        // In a flat or a straight neighbourhood the optimum is a plane or a line; a weak pull to the middle makes it one point.
        const double pull = kEdgeWeight * sum.a.trace() + 1e-12;
        const Eigen::Matrix3d a = sum.a + pull * Eigen::Matrix3d::Identity();
        Vector best = a.ldlt().solve(pull * middle - sum.b);
        double cost = best.allFinite() && (best - middle).norm() < 2 * (p - q).norm() ? sum.at(best) : std::numeric_limits<double>::infinity();
        for (const Vector& other : {middle, p, q})
            if (const double c = sum.at(other); c < cost) cost = c, best = other;
        edge.place = best;
        edge.cost = std::max(0.0, cost) + 1e-9 * (p - q).squaredNorm();  // of equally flat ones the shortest first
    }

    /// Whether merging keeps every facet around upright and joins no sheets.
    [[nodiscard]] bool allowed(const Edge& edge) const {
        ring_a_.clear(), ring_b_.clear();
        int common_facets = 0;
        for (const std::uint32_t v : {edge.a, edge.b})
            for (std::uint32_t k = starts_[v]; k < starts_[v + 1]; ++k) {
                const Index3& f = facets_[around_[k]];
                if (degenerate(f)) continue;
                const bool has_a = f[0] == edge.a || f[1] == edge.a || f[2] == edge.a, has_b = f[0] == edge.b || f[1] == edge.b || f[2] == edge.b;
                for (const std::uint32_t w : f)
                    if (w != edge.a && w != edge.b) (v == edge.a ? ring_a_ : ring_b_).push_back(w);
                if (has_a && has_b) {
                    common_facets += v == edge.a;
                    continue;
                }
                std::array<Vector, 3> moved;
                for (std::size_t c = 0; c < 3; ++c) moved[c] = f[c] == v ? edge.place : vertices_[f[c]];
                const Vector old_cross = cross_of(vertices_[f[0]], vertices_[f[1]], vertices_[f[2]]),
                             new_cross = cross_of(moved[0], moved[1], moved[2]);
                const double scale = old_cross.norm() * new_cross.norm();
                if (old_cross.norm() > 0 && !(old_cross.dot(new_cross) > kTurn * scale)) return false;
            }
        if (common_facets == 0) return false;
        for (auto* ring : {&ring_a_, &ring_b_}) {
            std::sort(ring->begin(), ring->end());
            ring->erase(std::unique(ring->begin(), ring->end()), ring->end());
        }
        int common = 0;
        for (const std::uint32_t w : ring_a_) common += std::binary_search(ring_b_.begin(), ring_b_.end(), w);
        return common == common_facets;  // more: the edge is one side of a hole of three, and the surface would be pinched
    }

    void round(std::size_t wished) {
        find_facets_around();
        std::vector<Edge> edges;
        edges.reserve(facets_.size() * 3 / 2 + 16);
        context_.throw_if_cancelled();
        for (const Index3& f : facets_)
            for (std::size_t k = 0; k < 3; ++k) {
                const std::uint32_t a = f[k], b = f[(k + 1) % 3];
                if (a < b || shared(a, b) == 1) edges.push_back({0, std::min(a, b), std::max(a, b), Vector::Zero()});
            }
        parallel_for(context_, edges.size(), 2048, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) rate(edges[i]);
        });
        const std::size_t tried =
            std::min(edges.size(), std::max<std::size_t>(64, static_cast<std::size_t>(kRoundShare * static_cast<double>(edges.size()))));
        std::nth_element(edges.begin(), edges.begin() + static_cast<std::ptrdiff_t>(tried) - 1, edges.end());
        edges.resize(tried);
        std::sort(edges.begin(), edges.end());
        std::vector<char> used(vertices_.size(), 0);
        std::size_t left = facets_.size();
        std::size_t since = 0;
        for (const Edge& edge : edges) {
            if (left <= wished) break;
            if (++since % 4096 == 0) context_.throw_if_cancelled();
            if (used[edge.a] || used[edge.b] || !allowed(edge)) continue;
            used[edge.a] = used[edge.b] = 1;
            vertices_[edge.a] = edge.place;
            quadrics_[edge.a] += quadrics_[edge.b];
            for (std::uint32_t k = starts_[edge.b]; k < starts_[edge.b + 1]; ++k) {
                Index3& f = facets_[around_[k]];
                if (degenerate(f)) continue;
                for (std::uint32_t& v : f)
                    if (v == edge.b) v = edge.a;
                left -= degenerate(f);
            }
        }
        std::erase_if(facets_, degenerate);
    }

    Context& context_;
    std::vector<Vector> vertices_;
    std::vector<Index3> facets_;
    std::vector<Quadric> quadrics_;
    std::vector<std::uint32_t> starts_, around_;
    mutable std::vector<std::uint32_t> ring_a_, ring_b_;
};

}  // namespace

Mesh decimate(Context& context, MeshView mesh, std::size_t facets) {
    // Of a mesh that a grid makes smaller first its vertices and facets are held once more, and then no more than of what that leaves.
    const bool clustered = mesh.facets.size() > kClusterFrom;
    const auto left = static_cast<std::uint64_t>(kClusterFacets);
    const std::uint64_t bytes = clustered ? 28 * mesh.vertices.size() + 12 * mesh.facets.size() + 200 * left + 160 * 2 * left
                                          : 200 * mesh.vertices.size() + 160 * mesh.facets.size();
    const MemoryCharge charge(context, bytes, "fewer facets for the report");
    Decimation decimation(context, mesh);
    if (clustered) decimation.cluster();
    decimation.collapse_to(std::max<std::size_t>(4, facets));
    return decimation.take();
}

}  // namespace slabwright
