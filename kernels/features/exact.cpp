// Peaks, valleys and saddles to float precision: the height's critical points on the surface, by the signs around every
// vertex. Vertices of one height that edges join are one plateau and are judged together.
//
// Around a plateau lie its star facets, each of which crosses from one plateau edge to the next. Where all of the star is
// lower, the section just below the plateau is a set of closed rings in the star; with the solid on their left their
// area is positive when the solid lies within (a peak) and negative when it lies around (the ceiling of a hollow, an
// undercut's matter). Just above a minimum it is the other way about: negative in a depression (a valley), positive
// under a bulge. The sign is exact wherever the surface does not cross itself, overhangs included, which a sum of
// normals is not.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "kernels/features/finders.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr std::size_t kGrain = 4096;

// The facets around every vertex; facets with two equal corners are left out.
struct Incidence {
    std::vector<std::uint32_t> starts, facets;
    [[nodiscard]] std::span<const std::uint32_t> around(std::uint32_t v) const {
        return std::span(facets).subspan(starts[v], starts[v + 1] - starts[v]);
    }
};

bool collapsed(const Index3& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }

Incidence incidence_of(MeshView mesh) {
    Incidence incidence;
    incidence.starts.assign(mesh.vertices.size() + 1, 0);
    for (const Index3& t : mesh.facets)
        if (!collapsed(t))
            for (const std::uint32_t v : t) ++incidence.starts[v];
    std::uint32_t sum = 0;
    for (std::uint32_t& s : incidence.starts) s = sum += s;
    incidence.facets.resize(sum);
    for (std::size_t f = mesh.size(); f-- > 0;)  // backwards, so that each list ascends
        if (!collapsed(mesh.facets[f]))
            for (const std::uint32_t v : mesh.facets[f]) incidence.facets[--incidence.starts[v]] = static_cast<std::uint32_t>(f);
    return incidence;
}

// What lies around a plateau at height z, gathered facet by facet.
struct Star {
    bool above = false, below = false;
    int changes = 0;                       // facets that lead from higher to lower neighbours
    double nearest = HUGE_VAL;             // least height difference to a neighbour
    int rings_above = 0, rings_below = 0;  // runs of higher and of lower neighbours, once rings were walked
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

// Twice the area, as seen from above, of the ring that the facet's part in the section at distance `eps` from the
// plateau's height contributes to. Falling edges start the part and rising ones end it, on either side of the plateau.
double ring_area(MeshView mesh, std::uint32_t facet, float z, double eps, const Vec3d& origin) {
    std::array<double, 2> start{}, end{};
    const Index3 t = mesh.facets[facet];
    for (int k = 0; k < 3; ++k) {
        Vec3d a = minus(to_double(mesh.vertices[t[k]]), origin), b = minus(to_double(mesh.vertices[t[(k + 1) % 3]]), origin);
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
bool extremum(MeshView mesh, std::span<const std::uint32_t> star_facets, std::uint32_t vertex, const Star& star, FeatureType& type) {
    const Vec3d origin = to_double(mesh.vertices[vertex]);
    double area = 0;
    for (const std::uint32_t f : star_facets) area += ring_area(mesh, f, mesh.vertices[vertex].z, star.nearest, origin);
    if (star.below && area > 0) type = FeatureType::peak;
    else if (star.above && area < 0) type = FeatureType::valley;
    else return false;
    return true;
}

// Walks the rings of a star and counts its runs of higher and of lower neighbours. Facets are sorted; a plateau facet
// (all of one height) is no part of a ring. An open mesh ends a ring, which is then walked from its other end too.
void walk_rings(MeshView mesh, std::span<const std::uint32_t> star_facets, float z, Star& star) {
    std::vector<std::uint8_t> seen(star_facets.size(), 0);
    auto position = [&](std::uint32_t f) {
        const auto it = std::lower_bound(star_facets.begin(), star_facets.end(), f);
        return it != star_facets.end() && *it == f ? static_cast<std::size_t>(it - star_facets.begin()) : star_facets.size();
    };
    std::vector<std::size_t> stack;
    for (std::size_t seed = 0; seed < star_facets.size(); ++seed) {
        if (seen[seed]) continue;
        Star ring;
        seen[seed] = 1;
        stack.assign(1, seed);
        while (!stack.empty()) {
            const std::uint32_t f = star_facets[stack.back()];
            stack.pop_back();
            add_facet(mesh, f, z, ring);
            for (int k = 0; k < 3; ++k) {
                const bool a_on = mesh.vertices[mesh.facets[f][k]].z == z, b_on = mesh.vertices[mesh.facets[f][(k + 1) % 3]].z == z;
                const std::uint32_t g = mesh.neighbours[f][k];
                if (a_on == b_on || g == kNoFacet) continue;
                const std::size_t next = position(g);
                if (next == star_facets.size() || seen[next]) continue;
                seen[next] = 1;
                stack.push_back(next);
            }
        }
        if (ring.changes == 0) {
            star.rings_above += ring.above;
            star.rings_below += ring.below;
        } else {
            star.rings_above += (ring.changes + 1) / 2;
            star.rings_below += (ring.changes + 1) / 2;
        }
    }
}

bool saddle(MeshView mesh, std::span<const std::uint32_t> star_facets, float z, Star& star) {
    walk_rings(mesh, star_facets, z, star);
    return star.rings_above > 1 || star.rings_below > 1;
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

// Vertices of up-facing flats. What touches a flat and differs from it by less than the merging distance is the flat's.
struct Flats {
    std::vector<std::uint8_t> on;
    double reach = 0;
    [[nodiscard]] bool touched(MeshView mesh, std::span<const std::uint32_t> star_facets, float z) const {
        for (const std::uint32_t f : star_facets)
            for (const std::uint32_t v : mesh.facets[f])
                if (on[v] && std::abs(static_cast<double>(mesh.vertices[v].z) - static_cast<double>(z)) <= reach) return true;
        return false;
    }
};

// Joins results of chunks in order.
std::vector<Feature> append(std::vector<Feature> a, std::vector<Feature> b) {
    a.insert(a.end(), std::make_move_iterator(b.begin()), std::make_move_iterator(b.end()));
    return a;
}

// A vertex without neighbours of its own height.
void judge_vertex(MeshView mesh, const Incidence& incidence, const Flats& flats, std::uint32_t v, std::vector<Feature>& found) {
    const auto facets = incidence.around(v);
    const float z = mesh.vertices[v].z;
    Star star;
    for (const std::uint32_t f : facets) add_facet(mesh, f, z, star);
    FeatureType type{};
    if (star.mixed()) {
        // Two changes are a slope; anything else is a saddle or a place where several sheets touch.
        if (star.changes == 2 || !saddle(mesh, facets, z, star)) return;
        type = FeatureType::saddle;
    } else if (!extremum(mesh, facets, v, star, type)) return;
    if (!flats.touched(mesh, facets, z)) found.push_back(point_feature(mesh, type, v));
}

void judge_plateau(MeshView mesh, const Incidence& incidence, const Flats& flats, std::span<const std::uint32_t> plateau,
                   std::vector<Feature>& found) {
    const float z = mesh.vertices[plateau.front()].z;
    std::vector<std::uint32_t> facets;
    Star star;
    for (const std::uint32_t v : plateau)
        for (const std::uint32_t f : incidence.around(v)) {
            const Index3 t = mesh.facets[f];
            if (mesh.vertices[t[0]].z != z || mesh.vertices[t[1]].z != z || mesh.vertices[t[2]].z != z) facets.push_back(f);
        }
    std::sort(facets.begin(), facets.end());
    facets.erase(std::unique(facets.begin(), facets.end()), facets.end());
    for (const std::uint32_t f : facets) add_facet(mesh, f, z, star);
    FeatureType type{};
    if (star.mixed()) {
        if (!saddle(mesh, facets, z, star)) return;
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

std::vector<Feature> find_exact(Context& context, MeshView mesh, std::span<const Feature> flats, double flat_reach) {
    const std::size_t n = mesh.vertices.size();
    if (mesh.size() == 0) return {};
    const MemoryCharge charge(context, mesh.size() * 12 + n * 15, "the search for peaks and valleys");
    const Incidence incidence = incidence_of(mesh);
    context.throw_if_cancelled();

    // Facets with a level edge are found in parallel; their few edges are then united one by one.
    std::vector<std::uint32_t> level = parallel_reduce(
        context, mesh.size(), kGrain, std::vector<std::uint32_t>{},
        [&](std::size_t begin, std::size_t end) {
            std::vector<std::uint32_t> part;
            for (std::size_t f = begin; f < end; ++f) {
                const Index3 t = mesh.facets[f];
                const float a = mesh.vertices[t[0]].z, b = mesh.vertices[t[1]].z, c = mesh.vertices[t[2]].z;
                if (a == b || b == c || c == a) part.push_back(static_cast<std::uint32_t>(f));
            }
            return part;
        },
        [](std::vector<std::uint32_t> a, std::vector<std::uint32_t> b) {
            a.insert(a.end(), b.begin(), b.end());
            return a;
        });
    std::vector<std::uint32_t> leader(n);
    std::iota(leader.begin(), leader.end(), 0u);
    auto find = [&](std::uint32_t v) {
        while (leader[v] != v) v = leader[v] = leader[leader[v]];
        return v;
    };
    std::vector<std::uint8_t> kind(n, 0);  // 0: alone at its height, 1: of a plateau, 2: of a plateau in which a flat lies
    for (const std::uint32_t f : level)
        for (int k = 0; k < 3; ++k) {
            std::uint32_t a = mesh.facets[f][k], b = mesh.facets[f][(k + 1) % 3];
            if (a == b || mesh.vertices[a].z != mesh.vertices[b].z) continue;
            kind[a] = kind[b] = 1;
            a = find(a);
            b = find(b);
            leader[std::max(a, b)] = std::min(a, b);
        }
    Flats touching{std::vector<std::uint8_t>(n, 0), flat_reach};
    for (const Feature& flat : flats)
        for (const std::uint32_t f : flat.facets)
            for (const std::uint32_t v : mesh.facets[f]) {
                if (kind[v] != 0) kind[find(v)] = 2;
                if (flat.type == FeatureType::up_flat) touching.on[v] = 1;
            }
    std::vector<std::uint32_t> members;  // of plateaus without flats, one after the other
    for (std::uint32_t v = 0; v < n; ++v)
        if (kind[v] != 0 && kind[find(v)] != 2) members.push_back(v);
    std::vector<std::uint32_t> root(members.size());
    for (std::size_t i = 0; i < members.size(); ++i) root[i] = find(members[i]);
    std::vector<std::uint32_t> order(members.size());
    std::iota(order.begin(), order.end(), 0u);
    parallel_sort(context, order.begin(), order.end(),
                  [&](std::uint32_t a, std::uint32_t b) { return std::pair(root[a], a) < std::pair(root[b], b); });
    std::vector<std::uint32_t> sorted(members.size()), plateau_starts;
    for (std::size_t i = 0; i < order.size(); ++i) {
        sorted[i] = members[order[i]];
        if (i == 0 || root[order[i]] != root[order[i - 1]]) plateau_starts.push_back(static_cast<std::uint32_t>(i));
    }
    plateau_starts.push_back(static_cast<std::uint32_t>(sorted.size()));

    std::vector<Feature> found = parallel_reduce(
        context, n, kGrain, std::vector<Feature>{},
        [&](std::size_t begin, std::size_t end) {
            std::vector<Feature> part;
            for (std::size_t v = begin; v < end; ++v)
                if (kind[v] == 0) judge_vertex(mesh, incidence, touching, static_cast<std::uint32_t>(v), part);
            return part;
        },
        append);
    return append(std::move(found), parallel_reduce(
                                        context, plateau_starts.size() - 1, 64, std::vector<Feature>{},
                                        [&](std::size_t begin, std::size_t end) {
                                            std::vector<Feature> part;
                                            for (std::size_t p = begin; p < end; ++p)
                                                judge_plateau(mesh, incidence, touching,
                                                              std::span(sorted).subspan(plateau_starts[p], plateau_starts[p + 1] - plateau_starts[p]),
                                                              part);
                                            return part;
                                        },
                                        append));
}

}  // namespace slabwright
