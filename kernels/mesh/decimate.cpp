#include "kernels/mesh/decimate.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "kernels/mesh/raw_array.h"
#include "kernels/parallel/deal.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

using Vector = Eigen::Vector3d;

constexpr double kMostCells = (1 << 21) - 1;  // of the grid along one axis
constexpr unsigned kPartBits = 9;  // of a cell's hash: what each part has of the vertices fits a cache
constexpr std::uint64_t kDealtAtOnce = 1 << 23;  // vertices, unless one part has more
constexpr std::size_t kGrain = 1 << 16;          // of what is done for one vertex or facet after the other
constexpr double kFlat = 0.02;                   // of a cell: a vertex as near to the planes around it stays
constexpr std::size_t kLeastTable = 1 << 10;     // of a part's cells
constexpr const char* kWhat = "fewer facets for the report";
constexpr double kRoundShare =
    0.3;  // of the edges, the cheapest, are tried in one round; the others wait for better figures
constexpr double kTurn = 0.2;             // cosine: a facet may turn by no more in one collapse
constexpr double kLeastProgress = 0.002;  // of the facets; a round that removes fewer is the last
constexpr double kEdgeWeight = 1e-3;  // pulls a flat neighbourhood's free optimum towards the edge's middle

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
        a += q.a;
        b += q.b;
        c += q.c;
        return *this;
    }
    [[nodiscard]] double at(const Vector& x) const { return x.dot(a * x) + 2 * b.dot(x) + c; }
};

struct Edge {
    double cost = 0;
    std::uint32_t a = 0, b = 0;
    Vector place = Vector::Zero();
    bool operator<(const Edge& e) const {
        return cost != e.cost ? cost < e.cost : a != e.a ? a < e.a : b < e.b;
    }
};

bool degenerate(const Index3& f) { return f[0] == f[1] || f[1] == f[2] || f[2] == f[0]; }

Vector vector_of(const Vec3f& v) { return {v.x, v.y, v.z}; }

Vector cross_of(const Vector& p, const Vector& q, const Vector& r) { return (q - p).cross(r - p); }

// The cells of a grid by their keys, numbered as they come.
class CellTable {
public:
    // @returns the cell's number; a new one is the next
    std::uint32_t number(std::uint64_t key, std::uint64_t hash) {
        std::size_t slot = slot_of(key, hash);
        if (table_[slot] != kEmpty) return table_[slot];
        const auto id = static_cast<std::uint32_t>(keys_.size());
        table_[slot] = id;
        keys_.push_back(key);
        hashes_.push_back(hash);
        // Cells are many fewer than vertices, so that the table begins small and grows.
        if (2 * keys_.size() > table_.size()) {
            table_.assign(2 * table_.size(), kEmpty);
            for (std::uint32_t k = 0; k < keys_.size(); ++k) table_[slot_of(keys_[k], hashes_[k])] = k;
        }
        return id;
    }
    [[nodiscard]] std::size_t size() const { return keys_.size(); }

private:
    static constexpr std::uint32_t kEmpty = 0xFFFFFFFFu;
    [[nodiscard]] std::size_t slot_of(std::uint64_t key, std::uint64_t hash) const {
        std::size_t slot = (hash >> 16) & (table_.size() - 1);
        while (table_[slot] != kEmpty && keys_[table_[slot]] != key) slot = (slot + 1) & (table_.size() - 1);
        return slot;
    }
    std::vector<std::uint32_t> table_ = std::vector<std::uint32_t>(kLeastTable, kEmpty);
    std::vector<std::uint64_t> keys_, hashes_;
};

std::array<Vector, 3> corners_of(MeshView mesh, std::size_t f) {
    const Index3& v = mesh.facets[f];
    return {vector_of(mesh.vertices[v[0]]), vector_of(mesh.vertices[v[1]]), vector_of(mesh.vertices[v[2]])};
}

// A grid of which about `aim` facets meet their own cell each.
class ClusterGrid {
public:
    ClusterGrid(Context& context, MeshView mesh, std::size_t aim) {
        constexpr std::size_t sampled = 16;
        const double area = sampled * parallel_reduce(
                                          context, mesh.facets.size() / sampled, kGrain, 0.0,
                                          [&](std::size_t begin, std::size_t end) {
                                              double sum = 0;
                                              for (std::size_t f = begin; f < end; ++f) {
                                                  const std::array<Vector, 3> c =
                                                      corners_of(mesh, f * sampled);
                                                  sum += cross_of(c[0], c[1], c[2]).norm() / 2;
                                              }
                                              return sum;
                                          },
                                          [](double x, double y) { return x + y; });
        const Box3 box = bounds(context, mesh);
        low_ = vector_of(box.min);
        cell_ = std::max({1e-6, std::sqrt(2 * area / static_cast<double>(aim)),
                          (vector_of(box.max) - low_).maxCoeff() / kMostCells});
        per_cell_ = 1 / cell_;
    }
    [[nodiscard]] double cell() const { return cell_; }  // mm
    [[nodiscard]] std::uint64_t key_of(const Vec3f& v) const {
        const Vector at = (vector_of(v) - low_) * per_cell_;
        const auto share = [&](int k) {
            return static_cast<std::uint64_t>(std::clamp(at[k], 0.0, kMostCells));
        };
        return share(0) << 42 | share(1) << 21 | share(2);
    }
    static std::uint64_t hash_of(std::uint64_t key) { return key * 0x9E3779B97F4A7C15u; }
    static std::size_t part_of(std::uint64_t key) {
        return static_cast<std::size_t>(hash_of(key) >> (64 - kPartBits));
    }

private:
    Vector low_;
    double cell_ = 0, per_cell_ = 0;
};

class Decimation {
public:
    Decimation(Context& context, MeshView mesh, std::size_t clustered_from) : context_(context) {
        if (mesh.facets.size() >= clustered_from) {
            cluster(mesh, clustered_from / 4);
            charge_.emplace(context, 200 * vertices_.size() + 160 * facets_.size(), kWhat);
            return;
        }
        charge_.emplace(context, 200 * mesh.vertices.size() + 160 * mesh.facets.size(), kWhat);
        vertices_.reserve(mesh.vertices.size());
        for (const Vec3f& v : mesh.vertices) vertices_.push_back(vector_of(v));
        facets_.reserve(mesh.facets.size());
        for (const Index3& f : mesh.facets)
            if (!degenerate(f)) facets_.push_back(f);
    }

    void collapse_to(std::size_t wished) {
        measure();
        while (facets_.size() > wished) {
            const std::size_t before = facets_.size();
            round(wished);
            if (static_cast<double>(before - facets_.size()) < kLeastProgress * static_cast<double>(before))
                break;
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
                    mesh.vertices.push_back(
                        {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())});
                }
                g[k] = to[f[k]];
            }
            mesh.facets.push_back(g);
        }
        return mesh;
    }

private:
    /// Vertices in one cell of a grid become one, where the planes of the facets that stay want it. Those are
    /// the facets whose corners lie in three cells.
    /// @param aim facets that the grid aims at
    void cluster(MeshView mesh, std::size_t aim) {
        charge_.emplace(context_, 12 * mesh.vertices.size() + 100 * aim, kWhat);
        const ClusterGrid grid(context_, mesh, aim);
        const std::vector<std::uint32_t> source = merge_facets(mesh, merge_vertices(mesh, grid));
        place_by_planes(mesh, source, grid.cell());
    }

    /// Makes vertices_ the means of those in a cell. @returns by the mesh's vertices, those that they become
    RawArray<std::uint32_t> merge_vertices(MeshView mesh, const ClusterGrid& grid) {
        // Vertices are dealt by their cell's hash into parts, of which each numbers its cells as they come.
        struct Item {
            std::uint64_t key;
            std::uint32_t vertex;
        };
        const std::size_t n = mesh.vertices.size(), parts = std::size_t{1} << kPartBits;
        RawArray<std::uint32_t> to(n);
        RawArray<std::uint64_t> cells(n);
        std::vector<std::vector<Vector>> means(parts);
        {
            std::optional<MemoryCharge> charge;
            RawArray<Item> dealt;
            deal(
                context_, n, std::max(kGrain, n / 64 + 1), parts,
                [&](std::size_t begin, std::size_t end, auto&& take) {
                    for (std::size_t i = begin; i < end; ++i)
                        take(ClusterGrid::part_of(cells[i] = grid.key_of(mesh.vertices[i])));
                },
                [&](std::size_t begin, std::size_t end, auto&& take) {
                    for (std::size_t i = begin; i < end; ++i) {
                        const std::uint64_t key = cells[i];
                        take(ClusterGrid::part_of(key), Item{key, static_cast<std::uint32_t>(i)});
                    }
                },
                [&](std::uint64_t total, std::uint64_t largest) {
                    const std::uint64_t most = std::min(total, std::max(kDealtAtOnce, largest));
                    charge.emplace(context_, most * sizeof(Item), kWhat);
                    dealt = RawArray<Item>(most);
                    return std::pair(dealt.data(), most);
                },
                [&](std::size_t first, std::size_t last, std::span<const std::uint32_t> starts) {
                    parallel_each(context_, last - first, [&](std::size_t p) {
                        const std::span<const Item> mine(dealt.data() + starts[p], starts[p + 1] - starts[p]);
                        CellTable table;
                        std::vector<std::uint32_t> counts;
                        std::vector<Vector>& sums = means[first + p];
                        for (const Item& item : mine) {
                            const std::uint32_t id = table.number(item.key, ClusterGrid::hash_of(item.key));
                            if (id == sums.size()) {
                                sums.push_back(Vector::Zero());
                                counts.push_back(0);
                            }
                            sums[id] += vector_of(mesh.vertices[item.vertex]);
                            ++counts[id];
                            to[item.vertex] = id;
                        }
                        for (std::size_t id = 0; id < sums.size(); ++id) sums[id] /= counts[id];
                    });
                });
        }
        std::vector<std::uint32_t> before(parts);  // cells of the parts before
        for (std::size_t p = 0; p < parts; ++p) {
            before[p] = static_cast<std::uint32_t>(vertices_.size());
            vertices_.insert(vertices_.end(), means[p].begin(), means[p].end());
            std::vector<Vector>().swap(means[p]);
        }
        parallel_for(context_, n, kGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) to[i] += before[ClusterGrid::part_of(cells[i])];
        });
        return to;
    }

    /// Makes facets_ those whose corners are three vertices. @returns by these, the mesh's
    std::vector<std::uint32_t> merge_facets(MeshView mesh, const RawArray<std::uint32_t>& to) {
        std::vector<std::vector<std::uint32_t>> staying((mesh.facets.size() + kGrain - 1) / kGrain);
        const auto merged = [&](std::size_t f) {
            const Index3& v = mesh.facets[f];
            return Index3{to[v[0]], to[v[1]], to[v[2]]};
        };
        parallel_for(context_, mesh.facets.size(), kGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t f = begin; f < end; ++f)
                if (!degenerate(merged(f))) staying[begin / kGrain].push_back(static_cast<std::uint32_t>(f));
        });
        std::vector<std::uint32_t> source;
        for (const std::vector<std::uint32_t>& some : staying)
            source.insert(source.end(), some.begin(), some.end());
        facets_.resize(source.size());
        parallel_for(context_, source.size(), kGrain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) facets_[i] = merged(source[i]);
        });
        return source;
    }

    /// Moves vertices to where the planes of their facets want them, unless they lie well. @param cell mm
    void place_by_planes(MeshView mesh, std::span<const std::uint32_t> source, double cell) {
        struct Oriented {
            Vector normal, place;
            double twice_area;
        };
        std::vector<Oriented> planes(source.size());
        parallel_for(context_, source.size(), 4096, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                const std::array<Vector, 3> c = corners_of(mesh, source[i]);
                const Vector normal = cross_of(c[0], c[1], c[2]);
                const double twice = normal.norm();
                planes[i] = {twice > 0 ? Vector(normal / twice) : Vector(Vector::Zero()), c[0], twice};
            }
        });
        find_facets_around();
        parallel_for(context_, vertices_.size(), 4096, [&](std::size_t begin, std::size_t end) {
            for (std::size_t v = begin; v < end; ++v) {
                Quadric sum;  // about the mean
                for (std::uint32_t k = starts_[v]; k < starts_[v + 1]; ++k) {
                    const Oriented& plane = planes[around_[k]];
                    sum.add_plane(plane.normal, plane.normal.dot(vertices_[v] - plane.place),
                                  plane.twice_area);
                }
                const double weight = sum.a.trace();
                if (sum.c <= kFlat * kFlat * cell * cell * weight) continue;
                const Eigen::Matrix3d a =
                    sum.a + (kEdgeWeight * weight + 1e-12) * Eigen::Matrix3d::Identity();
                const Vector way = a.ldlt().solve(-sum.b);
                if (way.allFinite() && way.norm() < cell) vertices_[v] += way;
            }
        });
    }

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

    /// The quadric of a vertex: the planes of its facets, weighted by area; an open edge adds a plane upright
    /// on its facet.
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
                        if (upright.allFinite())
                            quadrics_[v].add_plane(upright, -upright.dot(vertices_[p]), along.squaredNorm());
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
        // In a flat or a straight neighbourhood the optimum is a plane or a line; a weak pull to the middle
        // makes it one point.
        const double pull = kEdgeWeight * sum.a.trace() + 1e-12;
        const Eigen::Matrix3d a = sum.a + pull * Eigen::Matrix3d::Identity();
        Vector best = a.ldlt().solve(pull * middle - sum.b);
        double cost = best.allFinite() && (best - middle).norm() < 2 * (p - q).norm()
                          ? sum.at(best)
                          : std::numeric_limits<double>::infinity();
        for (const Vector& other : {middle, p, q})
            if (const double c = sum.at(other); c < cost) cost = c, best = other;
        edge.place = best;
        edge.cost =
            std::max(0.0, cost) + 1e-9 * (p - q).squaredNorm();  // of equally flat ones the shortest first
    }

    /// Whether merging keeps every facet around upright and joins no sheets.
    [[nodiscard]] bool allowed(const Edge& edge) const {
        ring_a_.clear();
        ring_b_.clear();
        int common_facets = 0;
        for (const std::uint32_t v : {edge.a, edge.b})
            for (std::uint32_t k = starts_[v]; k < starts_[v + 1]; ++k) {
                const Index3& f = facets_[around_[k]];
                if (degenerate(f)) continue;
                const bool has_a = f[0] == edge.a || f[1] == edge.a || f[2] == edge.a,
                           has_b = f[0] == edge.b || f[1] == edge.b || f[2] == edge.b;
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
        return common == common_facets;  // more: the edge is one side of a hole of three, and the surface
                                         // would be pinched
    }

    void round(std::size_t wished) {
        find_facets_around();
        std::vector<Edge> edges;
        edges.reserve(facets_.size() * 3 / 2 + 16);
        context_.throw_if_cancelled();
        for (const Index3& f : facets_)
            for (std::size_t k = 0; k < 3; ++k) {
                const std::uint32_t a = f[k], b = f[(k + 1) % 3];
                if (a < b || shared(a, b) == 1)
                    edges.push_back({0, std::min(a, b), std::max(a, b), Vector::Zero()});
            }
        parallel_for(context_, edges.size(), 2048, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) rate(edges[i]);
        });
        const std::size_t tried = std::min(
            edges.size(), std::max<std::size_t>(
                              64, static_cast<std::size_t>(kRoundShare * static_cast<double>(edges.size()))));
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
    std::optional<MemoryCharge> charge_;
    std::vector<Vector> vertices_;
    std::vector<Index3> facets_;
    std::vector<Quadric> quadrics_;
    std::vector<std::uint32_t> starts_, around_;
    mutable std::vector<std::uint32_t> ring_a_, ring_b_;
};

}  // namespace

Mesh decimate(Context& context, MeshView mesh, std::size_t facets, std::size_t clustered_from) {
    Decimation decimation(context, mesh, clustered_from);
    decimation.collapse_to(std::max<std::size_t>(4, facets));
    return decimation.take();
}

}  // namespace slabwright
