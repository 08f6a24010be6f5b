// Peaks, valleys and saddles to float precision: the height's critical points on the surface, by the signs
// around every vertex. Vertices of one height that edges join are one plateau and are judged together.
//
// Around a plateau lie its star facets, each of which crosses from one plateau edge to the next. Where all of
// the star is lower, the section just below the plateau is a set of closed rings in the star; with the solid
// on their left their area is positive when the solid lies within (a peak) and negative when it lies around
// (the ceiling of a hollow, an undercut's matter). Just above a minimum it is the other way about: negative
// in a depression (a valley), positive under a bulge. The sign is exact wherever the surface does not cross
// itself, overhangs included, which a sum of normals is not.
#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <utility>

#include "kernels/features/finders.h"
#include "kernels/mesh/clusters.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr std::size_t kGrain = 4096;
constexpr std::size_t kCheckedAfter = std::size_t{1}
                                      << 18;  // facets on one thread: whether the work is still wanted

bool collapsed(const Index3& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }

// What lies around a plateau at height z, gathered facet by facet.
struct Star {
    bool above = false, below = false;
    int changes = 0;            // facets that lead from higher to lower neighbours
    double nearest = HUGE_VAL;  // least height difference to a neighbour
    [[nodiscard]] bool mixed() const { return above && below; }
};

void add_facet(MeshView mesh, std::uint32_t facet, float z, Star& star) {
    bool above = false, below = false;
    for (const std::uint32_t v : mesh.facets[facet]) {
        const float other = mesh.vertices[v].z;
        if (other == z) continue;
        (other > z ? above : below) = true;
        star.nearest = std::min(star.nearest, std::abs(static_cast<double>(other) - static_cast<double>(z)));
    }
    star.above = star.above || above;
    star.below = star.below || below;
    star.changes += above && below;
}

// Twice the area, as seen from above, of the ring that the facet's part in the section at distance `eps` from
// the plateau's height contributes to. Falling edges start the part and rising ones end it, on either side of
// the plateau.
double ring_area(MeshView mesh, std::uint32_t facet, float z, double eps, const Vec3d& origin) {
    std::array<double, 2> start{}, end{};
    const Index3 t = mesh.facets[facet];
    for (int k = 0; k < 3; ++k) {
        Vec3d a = minus(to_double(mesh.vertices[t[k]]), origin),
              b = minus(to_double(mesh.vertices[t[(k + 1) % 3]]), origin);
        const bool a_on = mesh.vertices[t[k]].z == z, b_on = mesh.vertices[t[(k + 1) % 3]].z == z;
        if (a_on == b_on) continue;
        const bool falls = a[2] > b[2];
        if (!a_on) std::swap(a, b);
        const double share = eps / std::abs(b[2] - a[2]);
        (falls ? start : end) = {a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share};
    }
    return start[0] * end[1] - start[1] * end[0];
}

// The type of a plateau whose star is all on one side; nothing for ceilings and for the undersides of bulges.
// Where the star's facets are not all surface, its sides do not tell: then any that could be.
bool extremum(MeshView mesh, std::span<const std::uint32_t> star_facets, std::uint32_t vertex,
              const Star& star, FeatureType& type) {
    if (std::any_of(star_facets.begin(), star_facets.end(),
                    [&](std::uint32_t f) { return mesh.role(f) != FacetRole::surface; })) {
        type = star.below ? FeatureType::peak : FeatureType::valley;
        return star.below || star.above;
    }
    const Vec3d origin = to_double(mesh.vertices[vertex]);
    double area = 0;
    for (const std::uint32_t f : star_facets)
        area += ring_area(mesh, f, mesh.vertices[vertex].z, star.nearest, origin);
    if (star.below && area > 0) type = FeatureType::peak;
    else if (star.above && area < 0) type = FeatureType::valley;
    else return false;
    return true;
}

// A plateau's star facets, each to be met once on a walk from neighbour to neighbour. Facets of a plateau
// mostly follow one another in the mesh: then a bit for each from the first to the last sorts them and finds
// them again.
class StarFacets {
public:
    /// Sorts `facets` and leaves out what comes again.
    void set(std::vector<std::uint32_t>& facets) {
        in_order_.clear();
        bits_.clear();
        if (facets.empty()) return;
        const auto [low, high] = std::minmax_element(facets.begin(), facets.end());
        first_ = *low;
        const std::size_t words = (*high - first_) / 64 + 1;
        if (words > 4 * facets.size()) {
            std::sort(facets.begin(), facets.end());
            facets.erase(std::unique(facets.begin(), facets.end()), facets.end());
            in_order_.assign(facets.begin(), facets.end());
            bits_.assign(facets.size() / 64 + 1, ~std::uint64_t{0});
            return;
        }
        bits_.assign(words, 0);
        for (const std::uint32_t f : facets)
            bits_[(f - first_) / 64] |= std::uint64_t{1} << (f - first_) % 64;
        facets.clear();
        for (std::size_t w = 0; w < words; ++w)
            for (std::uint64_t rest = bits_[w]; rest != 0; rest &= rest - 1)
                facets.push_back(first_ + static_cast<std::uint32_t>(64 * w) +
                                 static_cast<std::uint32_t>(std::countr_zero(rest)));
    }
    /// Whether the facet is one of the star that nobody has taken yet.
    bool take(std::uint32_t facet) {
        std::size_t at = std::size_t{facet} - first_;  // far past the end for a facet before the first
        if (!in_order_.empty()) {
            const auto it = std::lower_bound(in_order_.begin(), in_order_.end(), facet);
            if (it == in_order_.end() || *it != facet) return false;
            at = static_cast<std::size_t>(it - in_order_.begin());
        }
        if (at / 64 >= bits_.size()) return false;
        std::uint64_t& word = bits_[at / 64];
        const std::uint64_t bit = std::uint64_t{1} << at % 64;
        const bool there = (word & bit) != 0;
        word &= ~bit;
        return there;
    }

private:
    std::uint32_t first_ = 0;
    std::vector<std::uint32_t> in_order_;  // of facets that lie far apart; else empty
    std::vector<std::uint64_t>
        bits_;  // a bit for each facet from first_, or for each of in_order_: not yet taken
};

// Whether the rings of a star have more than one run of higher or of lower neighbours. Rings are walked until
// that is known; `left` holds the star's facets. A plateau facet (all of one height) is no part of a ring. An
// open mesh ends a ring, which is then walked from its other end too.
bool saddle(MeshView mesh, std::span<const std::uint32_t> star_facets, float z, const Star& star,
            StarFacets& left) {
    // A ring with n changes has at least n / 2 runs of either kind, so three changes are two runs wherever
    // they lie.
    if (star.changes > 2) return true;
    int runs_above = 0, runs_below = 0;
    std::vector<std::uint32_t> stack;
    for (const std::uint32_t seed : star_facets) {
        if (!left.take(seed)) continue;
        bool above = false, below = false;
        int changes = 0;
        stack.assign(1, seed);
        while (!stack.empty()) {
            const std::uint32_t f = stack.back();
            stack.pop_back();
            const Index3 t = mesh.facets[f];
            const std::array<float, 3> height{mesh.vertices[t[0]].z, mesh.vertices[t[1]].z,
                                              mesh.vertices[t[2]].z};
            bool higher = false, lower = false;
            for (std::size_t k = 0; k < 3; ++k) {
                higher = higher || height[k] > z;
                lower = lower || height[k] < z;
                if ((height[k] == z) == (height[(k + 1) % 3] == z)) continue;
                const std::uint32_t g = mesh.neighbours[f][k];
                if (g != kNoFacet && left.take(g)) stack.push_back(g);
            }
            above = above || higher;
            below = below || lower;
            changes += higher && lower;
        }
        runs_above += changes == 0 ? above : (changes + 1) / 2;
        runs_below += changes == 0 ? below : (changes + 1) / 2;
        if (runs_above > 1 || runs_below > 1) return true;
    }
    return false;
}

Feature point_feature(MeshView mesh, FeatureType type, std::uint32_t vertex) {
    Feature feature;
    feature.type = type;
    feature.found_by = FoundBy::exact;
    feature.z_low = feature.z_high = mesh.vertices[vertex].z;
    feature.x = mesh.vertices[vertex].x;
    feature.y = mesh.vertices[vertex].y;
    return feature;
}

// Vertices of up-facing flats. What touches a flat and differs from it by less than the merging distance is
// the flat's.
struct Flats {
    std::vector<std::uint8_t> on;
    double reach = 0;
    [[nodiscard]] bool touched(MeshView mesh, std::span<const std::uint32_t> star_facets, float z) const {
        for (const std::uint32_t f : star_facets)
            for (const std::uint32_t v : mesh.facets[f])
                if (on[v] &&
                    std::abs(static_cast<double>(mesh.vertices[v].z) - static_cast<double>(z)) <= reach)
                    return true;
        return false;
    }
};

// Joins results of chunks in order.
std::vector<Feature> append(std::vector<Feature> a, std::vector<Feature> b) {
    a.insert(a.end(), std::make_move_iterator(b.begin()), std::make_move_iterator(b.end()));
    return a;
}

// A vertex without neighbours of its own height.
void judge_vertex(MeshView mesh, const VertexStars& stars, const Flats& flats, std::uint32_t v,
                  std::vector<Feature>& found) {
    const auto facets = stars.around(v);
    const float z = mesh.vertices[v].z;
    Star star;
    for (const std::uint32_t f : facets) add_facet(mesh, f, z, star);
    FeatureType type{};
    if (star.mixed()) {
        // Two changes are a slope; anything else is a saddle or a place where several sheets touch.
        if (star.changes == 2) return;
        std::vector<std::uint32_t> star_facets(facets.begin(), facets.end());
        StarFacets left;
        left.set(star_facets);
        if (!saddle(mesh, star_facets, z, star, left)) return;
        type = FeatureType::saddle;
    } else if (!extremum(mesh, facets, v, star, type)) return;
    if (!flats.touched(mesh, facets, z)) found.push_back(point_feature(mesh, type, v));
}

// Memory that one plateau after the other may use.
struct PlateauScratch {
    std::vector<std::uint32_t> facets;
    StarFacets left;
};

void judge_plateau(MeshView mesh, const VertexStars& stars, const Flats& flats,
                   std::span<const std::uint32_t> plateau, PlateauScratch& scratch,
                   std::vector<Feature>& found) {
    const float z = mesh.vertices[plateau.front()].z;
    std::vector<std::uint32_t>& facets = scratch.facets;
    facets.clear();
    Star star;
    for (const std::uint32_t v : plateau)
        for (const std::uint32_t f : stars.around(v)) {
            const Index3 t = mesh.facets[f];
            if (mesh.vertices[t[0]].z != z || mesh.vertices[t[1]].z != z || mesh.vertices[t[2]].z != z)
                facets.push_back(f);
        }
    scratch.left.set(facets);
    for (const std::uint32_t f : facets) add_facet(mesh, f, z, star);
    FeatureType type{};
    if (star.mixed()) {
        if (!saddle(mesh, facets, z, star, scratch.left)) return;
        type = FeatureType::saddle;
    } else if (!extremum(mesh, facets, plateau.front(), star, type)) return;
    if (flats.touched(mesh, facets, z)) return;
    // The plateau is placed at its vertex nearest to the vertices' mean.
    double x = 0, y = 0;
    for (const std::uint32_t v : plateau) {
        x += mesh.vertices[v].x;
        y += mesh.vertices[v].y;
    }
    x /= static_cast<double>(plateau.size());
    y /= static_cast<double>(plateau.size());
    std::uint32_t best = plateau.front();
    double least = HUGE_VAL;
    for (const std::uint32_t v : plateau) {
        const double d = std::hypot(mesh.vertices[v].x - x, mesh.vertices[v].y - y);
        if (d < least) {
            least = d;
            best = v;
        }
    }
    found.push_back(point_feature(mesh, type, best));
}

}  // namespace

VertexStars vertex_stars(Context& context, MeshView mesh) {
    const std::size_t n = mesh.vertices.size();
    VertexStars stars;
    stars.starts.assign(n + 1, 0);
    for (std::size_t f = 0; f < mesh.size(); ++f) {
        if (f % kCheckedAfter == 0) context.throw_if_cancelled();
        const Index3& t = mesh.facets[f];
        if (!collapsed(t))
            for (const std::uint32_t v : t) ++stars.starts[v];
    }
    std::uint32_t sum = 0;
    for (std::uint32_t& s : stars.starts) s = sum += s;
    context.throw_if_cancelled();
    stars.facets.resize(sum);
    for (std::size_t f = mesh.size(); f-- > 0;) {  // backwards, so that each list ascends
        if (f % kCheckedAfter == 0) context.throw_if_cancelled();
        if (!collapsed(mesh.facets[f]))
            for (const std::uint32_t v : mesh.facets[f])
                stars.facets[--stars.starts[v]] = static_cast<std::uint32_t>(f);
    }
    context.throw_if_cancelled();

    stars.lowest.resize(n);
    stars.level.assign(n, 0);
    parallel_for(context, n, 4 * kGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v) stars.lowest[v] = static_cast<std::uint32_t>(v);
    });
    parallel_for(context, mesh.size(), kGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t f = begin; f < end; ++f) {
            const Index3 t = mesh.facets[f];
            for (std::size_t k = 0; k < 3; ++k) {
                const std::uint32_t a = t[k], b = t[(k + 1) % 3];
                if (mesh.vertices[a].z != mesh.vertices[b].z || a == b) continue;
                std::atomic_ref(stars.level[a]).store(1, std::memory_order_relaxed);
                std::atomic_ref(stars.level[b]).store(1, std::memory_order_relaxed);
                join_clusters(stars.lowest, a, b);
            }
        }
    });
    return stars;
}

std::vector<Feature> find_exact(Context& context, MeshView mesh, VertexStars stars,
                                std::span<const Feature> flats, double flat_reach) {
    const std::size_t n = mesh.vertices.size();
    if (mesh.size() == 0) return {};
    std::vector<std::uint8_t>& kind = stars.level;  // 0: alone at its height, 1: of a plateau, 2: the lowest
                                                    // of a plateau in which a flat lies
    auto lowest = [&](std::uint32_t v) { return cluster_root(stars.lowest, v); };
    Flats touching{std::vector<std::uint8_t>(n, 0), flat_reach};
    for (const Feature& flat : flats)
        for (const std::uint32_t f : flat.facets)
            for (const std::uint32_t v : mesh.facets[f]) {
                if (kind[v] != 0) kind[lowest(v)] = 2;
                if (flat.type == FeatureType::up_flat) touching.on[v] = 1;
            }
    // The vertices of plateaus without flats, one plateau after the other by their lowest vertices, each
    // ascending: counted, then placed.
    BulkVector<std::uint32_t> next(n);
    std::vector<std::uint32_t> plateau_starts{0};
    parallel_for(context, n, 4 * kGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v) {
            next[v] = 0;
            if (kind[v] != 0)
                lowest(static_cast<std::uint32_t>(v));  // shortens its way to one step, or nearly
        }
    });
    context.throw_if_cancelled();
    for (std::uint32_t v = 0; v < n; ++v)
        if (kind[v] != 0) ++next[lowest(v)];
    context.throw_if_cancelled();
    for (std::uint32_t v = 0; v < n; ++v)
        if (kind[v] == 1 && next[v] != 0)
            plateau_starts.push_back(plateau_starts.back() + std::exchange(next[v], plateau_starts.back()));
    context.throw_if_cancelled();
    std::vector<std::uint32_t> sorted(plateau_starts.back());
    for (std::uint32_t v = 0; v < n; ++v) {
        if (kind[v] == 0) continue;
        const std::uint32_t of = lowest(v);
        if (kind[of] != 2) sorted[next[of]++] = v;
    }

    std::vector<Feature> found = parallel_reduce(
        context, n, kGrain, std::vector<Feature>{},
        [&](std::size_t begin, std::size_t end) {
            std::vector<Feature> part;
            for (std::size_t v = begin; v < end; ++v)
                if (kind[v] == 0) judge_vertex(mesh, stars, touching, static_cast<std::uint32_t>(v), part);
            return part;
        },
        append);
    return append(std::move(found),
                  parallel_reduce(
                      context, plateau_starts.size() - 1, 64, std::vector<Feature>{},
                      [&](std::size_t begin, std::size_t end) {
                          std::vector<Feature> part;
                          PlateauScratch scratch;
                          for (std::size_t p = begin; p < end; ++p)
                              judge_plateau(mesh, stars, touching,
                                            std::span(sorted).subspan(
                                                plateau_starts[p], plateau_starts[p + 1] - plateau_starts[p]),
                                            scratch, part);
                          return part;
                      },
                      append));
}

}  // namespace slabwright
