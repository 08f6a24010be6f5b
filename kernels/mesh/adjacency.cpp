#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <iterator>
#include <vector>

#include "kernels/mesh/edges.h"
#include "kernels/mesh/weld.h"

namespace slabwright {

namespace {

Vec3d way(const Vec3f& a, const Vec3f& b) { return minus(to_double(b), to_double(a)); }

/// Grows with the angle of (x, y) from +x, 0 … 4 for a whole turn; only divides, so no library's atan2
/// decides an order.
double diamond_angle(double x, double y) {
    const double sum = std::abs(x) + std::abs(y);
    if (sum == 0) return 0;
    const double t = y / sum;
    if (x < 0) return 2 - t;
    return t < 0 ? 4 + t : t;
}

/// A facet at an edge, seen along the edge from low to high.
struct Blade {
    double angle;
    EdgeUse use;
};

/// Facets nearer than this (diamond angle, about a microradian) count as lying on one another: rounding to
/// float32 tilts facets that are one plane in the file's origin by about as much.
constexpr double kSameAngle = 1e-6;

void link(Mesh& mesh, const EdgeUse& a, const EdgeUse& b) {
    mesh.neighbours[a.facet()][a.corner()] = b.facet();
    mesh.neighbours[b.facet()][b.corner()] = a.facet();
}

/// More than two facets at one edge. Seen along the edge from low to high and turning counter-clockwise, a
/// facet that runs high to low has the solid after it, one that runs low to high has it before: they open and
/// close the solid like brackets, and are matched like brackets around the circle. What is left over has no
/// partner.
void pair_around_edge(Mesh& mesh, std::span<const EdgeUse> uses) {
    const Vec3f low = mesh.vertices[uses[0].low];
    const Vec3d edge = way(low, mesh.vertices[uses[0].high]);
    std::vector<Blade> blades;
    blades.reserve(uses.size());
    Vec3d u{}, v{};
    bool framed = false;
    for (const EdgeUse& use : uses) {
        const Index3& facet = mesh.facets[use.facet()];
        const Vec3d arm = way(low, mesh.vertices[facet[(use.corner() + 2) % 3]]);
        const Vec3d across =
            cross(edge, arm);  // perpendicular to the edge, a quarter turn ahead of the facet
        double angle = 0;      // a facet without area lies anywhere: with the first
        if (dot(across, across) > 0) {
            if (!framed) {
                v = across;
                u = cross(across, edge);
                framed = true;
                // Both to unit length, so that the angle is one.
                const double lu = std::sqrt(dot(u, u)), lv = std::sqrt(dot(v, v));
                u = {u[0] / lu, u[1] / lu, u[2] / lu};
                v = {v[0] / lv, v[1] / lv, v[2] / lv};
            }
            // The arm's own direction is `across` turned back by a quarter.
            angle = diamond_angle(dot(across, v), -dot(across, u));
            if (angle > 4 - kSameAngle) angle -= 4;
        }
        blades.push_back({angle, use});
    }
    std::sort(blades.begin(), blades.end(), [](const Blade& a, const Blade& b) {
        return a.angle != b.angle ? a.angle < b.angle : a.use.code < b.use.code;
    });
    // Where facets lie on one another, closing comes before opening: bodies that share a face stay bodies of
    // their own.
    for (std::size_t begin = 0, end = 0; begin < blades.size(); begin = end) {
        end = begin + 1;
        while (end < blades.size() && blades[end].angle - blades[end - 1].angle < kSameAngle) ++end;
        std::sort(blades.begin() + static_cast<std::ptrdiff_t>(begin),
                  blades.begin() + static_cast<std::ptrdiff_t>(end), [](const Blade& a, const Blade& b) {
                      return a.use.reversed() != b.use.reversed() ? b.use.reversed()
                                                                  : a.use.code < b.use.code;
                  });
    }
    std::vector<std::size_t> open;
    std::vector<bool> done(blades.size(), false);
    for (int turn = 0; turn < 2;
         ++turn) {  // the second turn closes what began before the start of the circle
        for (std::size_t i = 0; i < blades.size(); ++i) {
            if (done[i]) continue;
            if (blades[i].use.reversed()) {
                if (turn == 0) open.push_back(i);
            } else if (!open.empty()) {
                link(mesh, blades[open.back()].use, blades[i].use);
                done[open.back()] = done[i] = true;
                open.pop_back();
            }
        }
    }
}

/// Whether every edge of a fan is shared by just two facets, which run along it in opposite directions.
bool is_plain(std::span<const EdgeUse> fan) {
    if (fan.size() % 2 != 0) return false;
    bool plain = true;
    for (std::size_t i = 0; i < fan.size(); i += 2)
        plain &= (fan[i].high == fan[i + 1].high) & (fan[i].reversed() != fan[i + 1].reversed()) &
                 (i == 0 || fan[i].high != fan[i - 1].high);
    return plain;
}

/// Whether something about a fan needs a closer look than its adjacency gives: it is not plain; two facets
/// share two edges, as duplicates do; or it has so many uses that this is not asked.
bool is_odd(std::span<const EdgeUse> fan, bool plain) {
    if (fan.size() > kPlainFan || !plain) return true;
    for (std::size_t i = 2; i < fan.size(); i += 2) {
        const std::uint32_t a = fan[i].facet(), b = fan[i + 1].facet();
        for (std::size_t j = 0; j < i; j += 2)
            if (fan[j].facet() == a && fan[j + 1].facet() == b) return true;
    }
    return false;
}

}  // namespace

void pair_edges(Context& context, Mesh& mesh, std::vector<std::uint32_t>* odd) {
    EdgeScratch scratch;
    pair_edges(context, mesh, scratch, odd);
}

namespace {

/// Facets that follow one another and have most of their vertices for themselves. What is known of their
/// edges fits the cache.
constexpr std::size_t kBlockFacets = 16384;

/// Which vertices only the facets of one block use. In a file that was not shuffled most are such.
struct OwnVertices {
    std::vector<std::uint32_t> first;   ///< of each block: the vertices from this one on are used by no block
                                        ///< before; and their number
    std::vector<std::uint64_t> shared;  ///< a bit for each vertex that other blocks may use too
    bool many = false;                  ///< more than half of all

    [[nodiscard]] bool is_shared(std::uint32_t v) const noexcept {
        return (shared[v >> 6] >> (v & 63) & 1) != 0;
    }
};

OwnVertices own_vertices(Context& context, const Mesh& mesh) {
    const std::size_t blocks = (mesh.facets.size() + kBlockFacets - 1) / kBlockFacets;
    OwnVertices own;
    own.first.assign(blocks + 1, 0);
    parallel_for(context, mesh.facets.size(), kBlockFacets, [&](std::size_t begin, std::size_t end) {
        std::uint32_t past = 0;
        for (std::size_t f = begin; f < end; ++f)
            for (const std::uint32_t v : mesh.facets[f]) past = std::max(past, v + 1);
        own.first[begin / kBlockFacets + 1] = past;
    });
    for (std::size_t b = 1; b <= blocks; ++b) own.first[b] = std::max(own.first[b], own.first[b - 1]);
    own.shared.assign(mesh.vertices.size() / 64 + 1, 0);
    parallel_for(context, mesh.facets.size(), kBlockFacets, [&](std::size_t begin, std::size_t end) {
        const std::uint32_t mine = own.first[begin / kBlockFacets];
        for (std::size_t f = begin; f < end; ++f)
            for (const std::uint32_t v : mesh.facets[f]) {
                if (v >= mine) continue;
                const std::atomic_ref word(own.shared[v >> 6]);
                const std::uint64_t bit = std::uint64_t{1} << (v & 63);
                if ((word.load(std::memory_order_relaxed) & bit) == 0)
                    word.fetch_or(bit, std::memory_order_relaxed);
            }
    });
    std::size_t count = 0;
    for (const std::uint64_t word : own.shared) count += static_cast<std::size_t>(std::popcount(word));
    own.many = 2 * count < mesh.vertices.size();
    return own;
}

/// Calls on_fan(T& part, uses) as reduce_fans() does, for the vertices that only one block uses. Such a block
/// is at hand as a whole, so that its edges need not be dealt first. @param others for each chunk of
/// kBlocksTogether blocks the uses that are left
constexpr std::size_t kBlocksTogether = 8;
template <class T, class OnPair, class OnFan, class Join>
T reduce_own_fans(Context& context, const Mesh& mesh, const OwnVertices& own,
                  std::span<BulkVector<EdgeUse>> others, T identity, OnPair&& on_pair, OnFan&& on_fan,
                  Join&& join) {
    return parallel_reduce(
        context, mesh.facets.size(), kBlocksTogether * kBlockFacets, identity,
        [&](std::size_t begin, std::size_t end) {
            T part = identity;
            BulkVector<EdgeUse>& other = others[begin / (kBlocksTogether * kBlockFacets)];
            RawArray<EdgeUse> uses(3 * std::min(kBlockFacets, end - begin));
            for (std::size_t block = begin; block < end; block += kBlockFacets) {
                const std::uint32_t origin = own.first[block / kBlockFacets],
                                    past = own.first[block / kBlockFacets + 1];
                std::size_t count = 0;
                for (std::size_t f = block; f < std::min(end, block + kBlockFacets); ++f) {
                    const Index3 v = mesh.facets[f];
                    for (std::uint32_t k = 0; k < 3; ++k) {
                        const std::uint32_t a = v[k], b = v[k == 2 ? 0 : k + 1];
                        if (a == b) continue;
                        // In a mesh without order no branch foretells which end is the lower one.
                        const std::uint32_t reversed = a > b ? 1u : 0u, turned = (a ^ b) & (0u - reversed);
                        const EdgeUse use{a ^ turned, b ^ turned,
                                          2 * (3 * static_cast<std::uint32_t>(f) + k) + reversed};
                        if (own.is_shared(use.low)) other.push_back(use);
                        else uses[count++] = use;
                    }
                }
                pair_fans(std::span<const EdgeUse>(uses.data(), count), origin, past - origin, on_pair,
                          [&](std::span<const EdgeUse> fan) { on_fan(part, fan); });
            }
            return part;
        },
        join);
}

}  // namespace

void pair_edges(Context& context, Mesh& mesh, EdgeScratch& scratch, std::vector<std::uint32_t>* odd) {
    mesh.neighbours.resize(mesh.facets.size());
    parallel_for(context, mesh.neighbours.size(), std::size_t{1} << 16,
                 [&](std::size_t begin, std::size_t end) {
                     for (std::size_t f = begin; f < end; ++f)
                         mesh.neighbours[f] = {kNoFacet, kNoFacet, kNoFacet};
                 });
    using Vertices = std::vector<std::uint32_t>;
    auto pair_fan = [&](Vertices& part, std::span<const EdgeUse> fan) {
        const bool plain = is_plain(fan);
        if (odd != nullptr && is_odd(fan, plain)) part.push_back(fan[0].low);
        if (plain) {
            for (std::size_t i = 0; i < fan.size(); i += 2) link(mesh, fan[i], fan[i + 1]);
            return;
        }
        each_edge(fan, [&](std::span<const EdgeUse> uses) {
            if (uses.size() == 2) {
                if (uses[0].reversed() != uses[1].reversed()) link(mesh, uses[0], uses[1]);
            } else if (uses.size() > 2) {
                pair_around_edge(mesh, uses);
            }
        });
    };
    auto join = [](Vertices a, const Vertices& b) {
        a.insert(a.end(), b.begin(), b.end());
        return a;
    };
    if (mesh.facets.size() > kMaxFacets) throw too_many_facets(mesh.facets.size());
    const OwnVertices own = own_vertices(context, mesh);
    Vertices found, others;
    if (own.many) {
        constexpr std::size_t chunk = kBlocksTogether * kBlockFacets;
        std::vector<BulkVector<EdgeUse>> uses((mesh.facets.size() + chunk - 1) / chunk);
        std::uint32_t* const neighbours =
            mesh.neighbours.front().data();  // by facet and corner, as codes count
        auto pair = [&](std::uint32_t a, std::uint32_t b) {
            neighbours[a / 2] = b / 6;
            neighbours[b / 2] = a / 6;
        };
        found = reduce_own_fans(context, mesh, own, uses, Vertices{}, pair, pair_fan, join);
        std::size_t total = 0;
        for (const auto& part : uses) total += part.size();
        const MemoryCharge charge(context, total * sizeof(EdgeUse), "the edges of the mesh");
        auto each_use = [&](std::size_t begin, std::size_t end, auto&& take) {
            for (std::size_t part = begin; part < end; ++part)
                for (const EdgeUse& use : uses[part]) take(use);
        };
        others = reduce_dealt_fans(context, uses.size(), 1, total, mesh.vertices.size(), scratch, Vertices{},
                                   each_use, pair_fan, join);
    } else {
        others = reduce_fans(
            context, mesh.facets, mesh.vertices.size(), scratch, Vertices{},
            [](std::uint32_t) { return true; }, pair_fan, join);
    }
    if (odd == nullptr) return;
    odd->clear();
    std::merge(found.begin(), found.end(), others.begin(), others.end(), std::back_inserter(*odd));
}

}  // namespace slabwright
