// Facets stand in Morton order in a tree of boxes, eight together; each eight is held against the tree. Where
// boxes meet, two facets are apart if their projections on some axis are: on the normals, on those of the
// edges within each facet, or square to an edge of either.
#include "kernels/mesh/facet_roles.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <vector>

#include "kernels/geometry/wide.h"
#include "kernels/mesh/clusters.h"
#include "kernels/mesh/morton.h"
#include "kernels/mesh/windings.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr std::size_t kTogether = 8;
constexpr std::size_t kGrain = std::size_t{1} << 15;
constexpr double kApart = 1e-5;   // mm: facets of which this is not said may touch; under what a float tells
constexpr double kTouch = 1e-9;   // mm: facets that share a corner are apart if they overlap by no more
constexpr double kBeside = 2e-6;  // mm: how far from a patch the winding number is counted
constexpr double kFolded = 1e-4;  // short of 1, the cosine between facets beside each other of which one is
                                  // folded back onto the other: less than a degree

using Corners = std::array<Vec3d, 3>;
Corners corners(MeshView mesh, std::uint32_t f) {
    const Index3& facet = mesh.facets[f];
    return {to_double(mesh.vertices[facet[0]]), to_double(mesh.vertices[facet[1]]),
            to_double(mesh.vertices[facet[2]])};
}
Vec3d normal(const Corners& p) { return cross(minus(p[1], p[0]), minus(p[2], p[0])); }

Vec3d centroid(const Corners& p) { return scaled(1.0 / 3, plus(plus(p[0], p[1]), p[2])); }

bool collapsed(const Index3& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }

/// Whether the two stand at least `gap` apart along an axis; false for one that is no direction.
bool apart_along(const Corners& a, const Corners& b, const Vec3d& axis, double gap) {
    const double length2 = dot(axis, axis);
    if (!(length2 > 0)) return false;
    const auto [a0, a1] = std::minmax({dot(axis, a[0]), dot(axis, a[1]), dot(axis, a[2])});
    const auto [b0, b1] = std::minmax({dot(axis, b[0]), dot(axis, b[1]), dot(axis, b[2])});
    return std::max(b0 - a1, a0 - b1) >= gap * std::sqrt(length2);
}

/// @param gap mm; negative: they may overlap by that much
bool apart(const Corners& a, Corners b, double gap) {
    // From one of the corners, so that no digits are lost far from the origin.
    Corners p;
    const Vec3d origin = a[0];
    for (std::size_t k = 0; k < 3; ++k) {
        p[k] = minus(a[k], origin);
        b[k] = minus(b[k], origin);
    }
    const Vec3d m = normal(p), n = normal(b);
    if (apart_along(p, b, m, gap) || apart_along(p, b, n, gap)) return true;
    std::array<Vec3d, 3> e, f;
    for (std::size_t k = 0; k < 3; ++k) {
        e[k] = minus(p[(k + 1) % 3], p[k]);
        f[k] = minus(b[(k + 1) % 3], b[k]);
    }
    for (std::size_t k = 0; k < 3; ++k)
        if (apart_along(p, b, cross(m, e[k]), gap) || apart_along(p, b, cross(n, f[k]), gap)) return true;
    for (const Vec3d& u : e)
        for (const Vec3d& v : f)
            if (apart_along(p, b, cross(u, v), gap)) return true;
    return false;
}

/// Of two facets that share the corner s[i] = t[j], whether the sector of one may pass through that of the
/// other: where it crosses the other's plane, it does so along a ray that lies within the other.
bool may_cross_at_corner(const Corners& a, std::size_t i, const Corners& b, std::size_t j) {
    const Vec3d u = minus(a[(i + 1) % 3], a[i]), v = minus(a[(i + 2) % 3], a[i]);
    const Vec3d p = minus(b[(j + 1) % 3], b[j]), q = minus(b[(j + 2) % 3], b[j]);
    const Vec3d n = cross(u, v);
    const double over_p = dot(n, p), over_q = dot(n, q);
    if ((over_p > 0 && over_q > 0) || (over_p < 0 && over_q < 0)) return false;
    if (over_p == 0 && over_q == 0) return true;
    const Vec3d ray = plus(scaled(std::abs(over_q), p), scaled(std::abs(over_p), q));
    return dot(n, cross(u, ray)) >= 0 && dot(n, cross(ray, v)) >= 0;
}

/// Whether two facets meet elsewhere than in the corners that they share.
bool meet(MeshView mesh, std::uint32_t f, std::uint32_t g) {
    const Index3 &s = mesh.facets[f], &t = mesh.facets[g];
    std::size_t shared = 0;
    for (const std::uint32_t v : s) shared += v == t[0] || v == t[1] || v == t[2];
    if (shared == 3) return true;
    const Corners a = corners(mesh, f), b = corners(mesh, g);
    if (shared == 0) return !apart(a, b, kApart);
    if (shared == 1) {
        std::size_t i = 0, j = 0;
        while (s[i] != t[0] && s[i] != t[1] && s[i] != t[2]) ++i;
        while (t[j] != s[i]) ++j;
        return may_cross_at_corner(a, i, b, j) && !apart(a, b, -kTouch);
    }
    // Along an edge they are apart unless one is folded back onto the other.
    if (dot(normal(a), normal(b)) > 0) return false;
    std::size_t i = 0, j = 0;  // the corners that they do not share
    while (s[i] == t[0] || s[i] == t[1] || s[i] == t[2]) ++i;
    while (t[j] == s[0] || t[j] == s[1] || t[j] == s[2]) ++j;
    const Vec3d edge = minus(a[(i + 2) % 3], a[(i + 1) % 3]);
    const Vec3d u = cross(edge, minus(a[i], a[(i + 1) % 3])), v = cross(edge, minus(b[j], a[(i + 1) % 3]));
    return dot(u, v) > (1 - kFolded) * std::sqrt(dot(u, u) * dot(v, v));
}

/// Boxes of eight things, rounded so that they hold them.
struct Boxes {
    std::array<std::array<float, kTogether>, 3> low, high;
    Boxes() {
        for (std::size_t k = 0; k < 3; ++k)
            low[k].fill(std::numeric_limits<float>::infinity()),
                high[k].fill(-std::numeric_limits<float>::infinity());
    }
};
struct Box {
    std::array<float, 3> low, high;
};
Box whole(const Boxes& boxes) {
    Box box{};
    for (std::size_t k = 0; k < 3; ++k) {
        box.low[k] = *std::min_element(boxes.low[k].begin(), boxes.low[k].end());
        box.high[k] = *std::max_element(boxes.high[k].begin(), boxes.high[k].end());
    }
    return box;
}
Box child(const Boxes& boxes, std::size_t i) {
    return {{boxes.low[0][i], boxes.low[1][i], boxes.low[2][i]},
            {boxes.high[0][i], boxes.high[1][i], boxes.high[2][i]}};
}
/// A bit for each of the eight that a box meets.
unsigned meeting(const Boxes& boxes, const Box& box) {
    Ints8 all{1, 2, 4, 8, 16, 32, 64, 128};
    for (std::size_t k = 0; k < 3; ++k) {
        Floats8 low, high;
        std::memcpy(&low, boxes.low[k].data(), sizeof low);
        std::memcpy(&high, boxes.high[k].data(), sizeof high);
        all &= (low <= box.high[k]) & (high >= box.low[k]);
    }
    std::int32_t bits = 0;
    for (std::size_t i = 0; i < kTogether; ++i) bits |= all[i];
    return static_cast<unsigned>(bits);
}

/// The facets in Morton order and their boxes; levels[0] those of facets, levels[k] those of levels[k − 1].
struct BoxTree {
    std::vector<std::uint32_t> facets;
    std::vector<std::vector<Boxes>> levels;
};

BoxTree box_tree(Context& context, MeshView mesh) {
    struct Key {
        std::uint64_t code;
        std::uint32_t facet;
    };
    BulkVector<Key> keys(mesh.size());
    const MortonGrid grid(bounds(context, mesh));
    parallel_for(context, mesh.size(), kGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t f = begin; f < end; ++f) {
            const Corners p = corners(mesh, static_cast<std::uint32_t>(f));
            const Vec3d middle = centroid(p);
            keys[f] = {grid.code(middle[0], middle[1], middle[2]), static_cast<std::uint32_t>(f)};
        }
    });
    parallel_sort(context, keys.begin(), keys.end(), [](const Key& a, const Key& b) {
        return a.code != b.code ? a.code < b.code : a.facet < b.facet;
    });
    BoxTree tree;
    tree.facets.resize(keys.size());
    for (std::size_t i = 0; i < keys.size(); ++i) tree.facets[i] = keys[i].facet;
    keys = {};
    constexpr auto far = static_cast<float>(kApart);
    auto level = [&](std::size_t count, auto&& box_of) {
        std::vector<Boxes>& boxes = tree.levels.emplace_back((count + kTogether - 1) / kTogether);
        parallel_for(context, boxes.size(), kGrain / kTogether, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = kTogether * begin; i < std::min(count, kTogether * end); ++i) {
                const Box box = box_of(i);
                for (std::size_t k = 0; k < 3; ++k) {
                    boxes[i / kTogether].low[k][i % kTogether] = box.low[k];
                    boxes[i / kTogether].high[k][i % kTogether] = box.high[k];
                }
            }
        });
        return boxes.size();
    };
    std::size_t count = level(tree.facets.size(), [&](std::size_t i) {
        const Index3& t = mesh.facets[tree.facets[i]];
        const Vec3f &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
        // Wider by what facets may be apart and still touch, rounding included.
        const auto down = [&](float u, float v, float w) {
            const float low = std::min({u, v, w});
            return low - far - std::abs(low) * std::numeric_limits<float>::epsilon();
        };
        const auto up = [&](float u, float v, float w) { return std::max({u, v, w}); };
        return Box{{down(a.x, b.x, c.x), down(a.y, b.y, c.y), down(a.z, b.z, c.z)},
                   {up(a.x, b.x, c.x), up(a.y, b.y, c.y), up(a.z, b.z, c.z)}};
    });
    while (count > 1) {
        const std::size_t below = tree.levels.size() - 1;
        count = level(count, [&](std::size_t i) { return whole(tree.levels[below][i]); });
    }
    return tree;
}

/// Marks what meets others.
class Meetings {
public:
    Meetings(MeshView mesh, const BoxTree& tree, std::span<std::uint8_t> met)
        : mesh_(mesh), tree_(tree), met_(met) {}

    /// Of a tree of one eight: holds its facets against each other.
    void look_within() { pairs(0, 0, whole(tree_.levels[0][0])); }

    /// Holds the facets of eight eights against each other and against all that follow: the way down the tree
    /// is gone once for all of them, to the nodes of eights that they come near to.
    void look_from(std::size_t block) {
        const Boxes& own = tree_.levels[1][block];
        const Box box = whole(own);
        near_.clear();
        waiting_.assign(1, {tree_.levels.size() - 1, 0});
        while (!waiting_.empty()) {
            const auto [level, node] = waiting_.back();
            waiting_.pop_back();
            if (level == 1) {
                near_.push_back(node);
                continue;
            }
            // Children of a node follow one another, so those wholly before this block are none of its own.
            const std::size_t span = std::size_t{1} << 3 * (level - 2);
            for (unsigned bits = meeting(tree_.levels[level][node], box); bits != 0; bits &= bits - 1) {
                const std::size_t next = kTogether * node + static_cast<std::size_t>(std::countr_zero(bits));
                if ((next + 1) * span > block) waiting_.push_back({level - 1, next});
            }
        }
        const std::size_t first = kTogether * block,
                          end = std::min(first + kTogether, tree_.levels[0].size());
        for (std::size_t eight = first; eight < end; ++eight) {
            const Box of_eight = child(own, eight - first);
            for (const std::size_t node : near_)
                for (unsigned bits = meeting(tree_.levels[1][node], of_eight); bits != 0; bits &= bits - 1) {
                    const std::size_t other =
                        kTogether * node + static_cast<std::size_t>(std::countr_zero(bits));
                    if (other >= eight) pairs(eight, other, child(tree_.levels[1][node], other % kTogether));
                }
        }
    }

private:
    /// @param of_other the box of all of the other's
    void pairs(std::size_t eight, std::size_t other, const Box& of_other) {
        const Boxes &own = tree_.levels[0][eight], &boxes = tree_.levels[0][other];
        for (unsigned near = meeting(own, of_other); near != 0; near &= near - 1) {
            const std::size_t i = static_cast<std::size_t>(std::countr_zero(near));
            unsigned bits = meeting(boxes, child(own, i));
            if (other == eight) bits &= ~0U << (i + 1);
            for (; bits != 0; bits &= bits - 1) {
                const std::size_t j = static_cast<std::size_t>(std::countr_zero(bits));
                const std::uint32_t f = tree_.facets[kTogether * eight + i],
                                    g = tree_.facets[kTogether * other + j];
                if (collapsed(mesh_.facets[f]) || collapsed(mesh_.facets[g]) || (is_met(f) && is_met(g)) ||
                    !meet(mesh_, f, g))
                    continue;
                std::atomic_ref(met_[f]).store(1, std::memory_order_relaxed);
                std::atomic_ref(met_[g]).store(1, std::memory_order_relaxed);
            }
        }
    }
    [[nodiscard]] bool is_met(std::uint32_t f) {
        return std::atomic_ref(met_[f]).load(std::memory_order_relaxed) != 0;
    }
    MeshView mesh_;
    const BoxTree& tree_;
    std::span<std::uint8_t> met_;
    struct Waiting {
        std::size_t level, node;
    };
    std::vector<Waiting> waiting_;
    std::vector<std::size_t> near_;  // nodes of eights
};

std::vector<std::uint8_t> find_met(Context& context, MeshView mesh) {
    const MemoryCharge charge(context, mesh.size() * (sizeof(Boxes) / kTogether + 24), "facets that meet");
    const BoxTree tree = box_tree(context, mesh);
    std::vector<std::uint8_t> met(mesh.size(), 0);
    if (tree.levels.empty()) return met;
    if (tree.levels.size() == 1) {
        Meetings(mesh, tree, met).look_within();
        return met;
    }
    parallel_for(context, tree.levels[1].size(), kGrain / 512, [&](std::size_t begin, std::size_t end) {
        Meetings meetings(mesh, tree, met);
        for (std::size_t block = begin; block < end; ++block) meetings.look_from(block);
    });
    return met;
}

FacetRole role_between(int in_front, int behind) {
    if (in_front == 0 && behind > 0) return FacetRole::surface;
    if (in_front < 0 && behind == 0) return FacetRole::turned;
    return in_front != 0 && behind != 0 ? FacetRole::inner : FacetRole::unsure;
}

}  // namespace

BulkVector<FacetRole> facet_roles(Context& context, MeshView mesh) {
    const std::vector<std::uint8_t> met = find_met(context, mesh);
    BulkVector<std::uint32_t> patch(mesh.size());
    for (std::size_t f = 0; f < mesh.size(); ++f) patch[f] = static_cast<std::uint32_t>(f);
    parallel_for(context, mesh.size(), kGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t f = begin; f < end; ++f)
            for (const std::uint32_t g : mesh.neighbours[f])
                if (g != kNoFacet && g < f && met[f] == 0 && met[g] == 0)
                    join_clusters(patch, static_cast<std::uint32_t>(f), g);
    });
    // The largest facet of each patch is asked.
    struct Largest {
        double area2 = 0;
        std::uint32_t facet = kNoFacet;
    };
    std::vector<std::uint32_t> number(mesh.size(), kNoFacet);
    std::vector<Largest> largest;
    for (std::uint32_t f = 0; f < mesh.size(); ++f) {
        if (met[f] != 0) continue;
        const std::uint32_t root = cluster_root(patch, f);
        if (number[root] == kNoFacet) {
            number[root] = static_cast<std::uint32_t>(largest.size());
            largest.emplace_back();
        }
        patch[f] = root;
        const Vec3d n = normal(corners(mesh, f));
        if (const double area2 = dot(n, n); area2 > largest[number[root]].area2)
            largest[number[root]] = {area2, f};
    }
    std::vector<std::array<double, 3>> places;
    for (const Largest& l : largest) {
        Vec3d middle{}, away{};
        if (l.facet != kNoFacet) {
            const Corners c = corners(mesh, l.facet);
            middle = centroid(c);
            away = scaled(kBeside / std::sqrt(l.area2), normal(c));
        }
        places.push_back(plus(middle, away));
        places.push_back(minus(middle, away));
    }
    const std::vector<int> winding = windings_at(context, mesh, places);
    BulkVector<FacetRole> roles(mesh.size());
    bool all_surface = true;
    for (std::uint32_t f = 0; f < mesh.size(); ++f) {
        const std::uint32_t p = number[patch[f]];
        if (met[f] != 0) roles[f] = FacetRole::unsure;
        else if (largest[p].facet == kNoFacet) roles[f] = FacetRole::surface;
        else roles[f] = role_between(winding[2 * p], winding[2 * p + 1]);
        all_surface = all_surface && roles[f] == FacetRole::surface;
    }
    if (all_surface) return {};
    return roles;
}

}  // namespace slabwright
