#include "kernels/cutting/layer_solid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "kernels/cutting/fibres.h"
#include "kernels/geometry/vectors.h"
#include "kernels/mesh/morton.h"
#include "kernels/parallel/parallel.h"
#include "kernels/slicing/slicing.h"

namespace slabwright {

namespace {

constexpr double kLeastAlong = 0.17;  // of normals along one that is amid them: short of a right angle from
                                      // it, within which they hold all between them
constexpr int kMostAside = 240;       // the same in a plane: short of straight back
constexpr double kMostTiles = 1024;   // along x and along y, of solid_near

Vec3d unit_normal(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
    const Vec3d u = minus(b, a), v = minus(c, a), n = cross(u, v);
    const double length = std::sqrt(dot(n, n)), scale = dot(u, u) + dot(v, v);
    if (!(length > 1e-12 * scale) || length == 0) return {0, 0, 0};
    return {n[0] / length, n[1] / length, n[2] / length};
}

// None for a facet that is no wider than its corners are rounded by: those tell nothing of how it faces.
Vec3d normal_of(MeshView mesh, std::uint32_t f) {
    constexpr double rounding = 0x1p-22;  // of a coordinate
    const Index3& v = mesh.facets[f];
    const Vec3d a = to_double(mesh.vertices[v[0]]), b = to_double(mesh.vertices[v[1]]),
                c = to_double(mesh.vertices[v[2]]);
    const Vec3d e = minus(b, a), g = minus(c, b), h = minus(a, c), n = cross(e, g);
    double largest = 0;
    for (const Vec3d& p : {a, b, c})
        for (const double x : p) largest = std::max(largest, std::abs(x));
    const double width = rounding * largest, longest2 = std::max({dot(e, e), dot(g, g), dot(h, h)});
    if (dot(n, n) <= width * width * longest2) return {0, 0, 0};
    return unit_normal(a, b, c);
}

// The crossing is computed from the lower end to the upper one, so that both facets of an edge get the same
// point.
Vec3d cross_plane(const Vec3d& a, const Vec3d& b, double z) {
    const Vec3d& low = a[2] <= b[2] ? a : b;
    const Vec3d& high = a[2] <= b[2] ? b : a;
    const double t = (z - low[2]) / (high[2] - low[2]);
    return {low[0] + t * (high[0] - low[0]), low[1] + t * (high[1] - low[1]), z};
}

// An edge is tested by its lower facet unless it is concave: there the facets' own prisms overlap and hide
// it.
bool edge_matters(MeshView mesh, std::uint32_t f, int k, const Vec3d& a, const Vec3d& n) {
    const std::uint32_t g = mesh.neighbours[f][k];
    if (g == kNoFacet) return true;
    if (g < f) return false;
    if (dot(n, n) == 0) return true;
    const std::uint32_t e0 = mesh.facets[f][k], e1 = mesh.facets[f][(k + 1) % 3];
    for (const std::uint32_t v : mesh.facets[g]) {
        if (v == e0 || v == e1) continue;
        const Vec3d w = minus(to_double(mesh.vertices[v]), a);
        return dot(n, w) <= 1e-7 * std::sqrt(dot(w, w)) || normal_of(mesh, g) == Vec3d{0, 0, 0};
    }
    return true;
}

// Of a whole facet's corners and edges, SolidFacet::aside, edges and ends, and the normals.
struct Turns {
    std::array<std::uint8_t, 3> aside{SolidFacet::kAnyTurn, SolidFacet::kAnyTurn, SolidFacet::kAnyTurn};
    std::uint8_t edges = 0, ends = 0;
    FacetNormals normals;
};

std::int8_t rounded_down(double v) {
    return static_cast<std::int8_t>(
        std::max(-127.0, std::floor((v - SolidFacet::kNormalRounding) / SolidFacet::kTurn)));
}
std::int8_t rounded_up(double v) {
    return static_cast<std::int8_t>(
        std::min(127.0, std::ceil((v + SolidFacet::kNormalRounding) / SolidFacet::kTurn)));
}

// What lies between the normals beside an edge, along the way from one to the other, which is less than half
// a turn.
NormalBox between(const Vec3d& m, const Vec3d& n) {
    constexpr double most_turn = -0.99, no_turn = 1 - 1e-12;
    NormalBox box;
    const double along = dot(m, n);
    if (dot(m, m) == 0 || dot(n, n) == 0 || along < most_turn) return box;
    const Vec3d axis = cross(m, n);
    const double across2 = dot(axis, axis);
    for (std::size_t k = 0; k < 3; ++k) {
        double low = std::min(m[k], n[k]), high = std::max(m[k], n[k]);
        if (along < no_turn) {
            // Where both ends lead on, the way turns back between them.
            const double from_m = n[k] - along * m[k], from_n = m[k] - along * n[k],
                         turn = std::sqrt(std::max(0.0, 1 - axis[k] * axis[k] / across2));
            if (from_m > 0 && from_n > 0) high = turn;
            if (from_m < 0 && from_n < 0) low = -turn;
        }
        box.low[k] = rounded_down(low), box.high[k] = rounded_up(high);
    }
    return box;
}

// What lies between all the unit normals of a box: sums of them, with weights that make one, lie in it too,
// and are no shorter than they reach along the middle of the box.
NormalBox between_all(const NormalBox& box) {
    double middle2 = 0, half2 = 0;
    std::array<double, 3> low, high;
    for (std::size_t k = 0; k < 3; ++k) {
        low[k] = box.low[k] * SolidFacet::kTurn, high[k] = box.high[k] * SolidFacet::kTurn;
        const double middle = 0.5 * (low[k] + high[k]), half = 0.5 * (high[k] - low[k]);
        middle2 += middle * middle, half2 += half * half;
    }
    const double middle = std::sqrt(middle2), along = (1 + middle2 - half2) / (2 * middle);
    NormalBox all;
    if (!(middle > 0) || along < kLeastAlong) return all;
    const double most = along < 1 ? 1 / along : 1;
    for (std::size_t k = 0; k < 3; ++k) {
        all.low[k] = rounded_down(low[k] < 0 ? low[k] * most : low[k]);
        all.high[k] = rounded_up(high[k] > 0 ? high[k] * most : high[k]);
    }
    return all;
}

void widen(NormalBox& box, const NormalBox& other) {
    for (std::size_t k = 0; k < 3; ++k)
        box.low[k] = std::min(box.low[k], other.low[k]), box.high[k] = std::max(box.high[k], other.high[k]);
}

SolidFacet turned_over(const SolidFacet& f) {
    SolidFacet back = f;
    std::swap(back.p[1], back.p[2]);
    std::swap(back.aside[1], back.aside[2]);
    for (double& n : back.normal) n = -n;
    // An upright facet hides behind what it bounds, unless it bounds nothing: of two that lie in one another,
    // one faces down.
    constexpr float hardly = -1e-12F;
    back.nz = f.nz == 0 ? hardly : -f.nz;
    back.edges = static_cast<std::uint8_t>((f.edges & 2) | (f.edges & 1) << 2 | (f.edges & 4) >> 2) & 7;
    back.ends = static_cast<std::uint8_t>((f.ends & 1) | (f.ends & 2) << 1 | (f.ends & 4) >> 1) & 7;
    return back;
}

// What of a facet lies no higher than z_top: its corners, each followed by an edge.
struct Clipped {
    static constexpr int kAlongTop = 3;
    int corners = 0;
    std::array<Vec3d, 4> corner;
    std::array<int, 4> of{}, which{};  // which edge of the facet follows, or kAlongTop; which corner that is
    std::array<bool, 4> edge{}, end{},
        cut{};  // whether edge and corner are tested here; whether it lies in the top

    Clipped(const std::array<Vec3d, 3>& p, const Turns& turn, double z_top) {
        for (int k = 0; k < 3; ++k) {
            const Vec3d &a = p[k], &b = p[(k + 1) % 3];
            const bool a_in = a[2] <= z_top, b_in = b[2] <= z_top, matters = turn.edges >> k & 1;
            if (a_in) {
                corner[corners] = a;
                which[corners] = k;
                cut[corners] = a[2] == z_top;
                end[corners] = a[2] == z_top || (turn.ends >> k & 1) != 0;
                // What lies beyond an edge in the top is not there to test it.
                const bool in_top = a[2] == z_top && b[2] == z_top;
                of[corners] = in_top ? kAlongTop : k;
                edge[corners++] = matters || in_top;
            }
            if (a_in != b_in && a[2] != z_top && b[2] != z_top) {
                corner[corners] = cross_plane(a, b, z_top);
                cut[corners] = end[corners] = true;
                of[corners] = a_in ? kAlongTop : k;
                edge[corners++] = a_in || matters;
            } else if (a_in && !b_in) {
                edge[corners - 1] = true;  // a lies on the top itself: what follows it is the top edge
                of[corners - 1] = kAlongTop;
            }
        }
    }
};

// Writes the facets that it makes to `out` and `normals`, as many as pieces() says, and moves these on.
void append_facet(MeshView mesh, std::uint32_t f, const Turns& turn, double z_top, SolidFacet*& out,
                  FacetNormals*& normals) {
    std::array<Vec3d, 3> p;
    for (int k = 0; k < 3; ++k) p[k] = to_double(mesh.vertices[mesh.facets[f][k]]);
    const Vec3d n = unit_normal(p[0], p[1], p[2]);
    const FacetRole role = mesh.role(f);
    const Clipped is(p, turn, z_top);
    if (is.corners < 3) return;
    // Where the solid is cut off, a ball may also touch it with all between a facet's normals and the upright
    // one.
    NormalBox along_cut, at_cut;
    const std::uint8_t most_aside = *std::max_element(turn.aside.begin(), turn.aside.end());
    if (role == FacetRole::surface &&
        std::find(is.cut.begin(), is.cut.begin() + is.corners, true) != is.cut.begin() + is.corners) {
        along_cut = between(n, {0, 0, 1});
        at_cut = {{0, 0, 127}, {0, 0, 127}};
        for (const NormalBox& box : turn.normals.corner) widen(at_cut, box);
        at_cut = between_all(at_cut);
    }
    auto emit = [&](int i, int j, int k, bool ij, bool jk, bool ki, bool first) {
        SolidFacet s;
        s.p = {is.corner[i], is.corner[j], is.corner[k]};
        s.normal = n;
        s.nz = static_cast<float>(n[2]);
        s.edges = static_cast<std::uint8_t>((ij ? 1 : 0) | (jk ? 2 : 0) | (ki ? 4 : 0)) & 7;
        s.z_min = std::min({s.p[0][2], s.p[1][2], s.p[2][2]});
        s.z_max = std::max({s.p[0][2], s.p[1][2], s.p[2][2]});
        s.top = s.z_max >= z_top;
        std::size_t at = 0;
        for (const int c : {i, j, k}) s.aside[at++] = is.cut[c] ? most_aside : turn.aside[is.which[c]];
        const auto ends_here = [&](int c) { return is.end[c] && (first || c == k); };
        s.ends = static_cast<std::uint8_t>((ends_here(i) ? 1 : 0) | (ends_here(j) ? 2 : 0) |
                                           (ends_here(k) ? 4 : 0)) &
                 7;
        FacetNormals around;
        at = 0;
        for (const int c : {i, j, k}) {
            around.edge[at] = is.of[c] == Clipped::kAlongTop
                                  ? along_cut
                                  : turn.normals.edge[static_cast<std::size_t>(is.of[c])];
            around.corner[at++] =
                is.cut[c] ? at_cut : turn.normals.corner[static_cast<std::size_t>(is.which[c])];
        }
        if (role != FacetRole::turned) *out++ = s, *normals++ = around;
        if (role == FacetRole::surface) return;
        // Of what may be touched from behind, its other side; the edges are tested once.
        SolidFacet back = turned_over(s);
        if (role == FacetRole::unsure) back.edges = back.ends = 0;
        *out++ = back, *normals++ = FacetNormals{};
    };
    if (is.corners == 3) emit(0, 1, 2, is.edge[0], is.edge[1], is.edge[2], true);
    else {
        emit(0, 1, 2, is.edge[0], is.edge[1], false, true);
        emit(0, 2, 3, false, is.edge[2], is.edge[3], false);
    }
}

// Between which values of each coordinate unit vectors lie, in SolidFacet::kTurn.
template <std::size_t n>
struct Directions {
    std::array<std::int8_t, n> low, high;
    Directions() { low.fill(127), high.fill(-127); }
    void add(const std::array<double, n>& d) {
        for (std::size_t k = 0; k < n; ++k) {
            low[k] = std::min(
                low[k], static_cast<std::int8_t>(std::max(-127.0, std::floor(d[k] / SolidFacet::kTurn))));
            high[k] = std::max(
                high[k], static_cast<std::int8_t>(std::min(127.0, std::ceil(d[k] / SolidFacet::kTurn))));
        }
    }
    void add_all() { low.fill(-127), high.fill(127); }
    void add(const Directions& other) {
        for (std::size_t k = 0; k < n; ++k)
            low[k] = std::min(low[k], other.low[k]), high[k] = std::max(high[k], other.high[k]);
    }
    // How far from d they end at most.
    [[nodiscard]] std::uint8_t turn_from(const std::array<double, n>& d, double most) const {
        double turn2 = 0;
        for (std::size_t k = 0; k < n; ++k) {
            const double at = d[k] / SolidFacet::kTurn, off = std::max(high[k] - at, at - low[k]);
            turn2 += off * off;
        }
        return turn2 <= most * most ? static_cast<std::uint8_t>(std::ceil(std::sqrt(turn2)))
                                    : SolidFacet::kAnyTurn;
    }
};

// The normal's direction seen from above; none for a level facet, and all where it is nearly that.
enum class Seen { none, direction, all };
Seen seen_from_above(const Vec3d& n, std::array<double, 2>& direction) {
    constexpr double least = 1e-3;
    const double across = std::hypot(n[0], n[1]);
    if (across == 0) return Seen::none;
    if (across < least) return Seen::all;
    direction = {n[0] / across, n[1] / across};
    return Seen::direction;
}

// For the facets. What the solid has no part of is left out: it is far below, or cut off.
BulkVector<Turns> turns(Context& context, MeshView mesh, std::span<const std::uint32_t> facets,
                        double cut_off) {
    constexpr std::size_t grain = 4096;
    BulkVector<Vec3d> normals(facets.size());
    BulkVector<Turns> turns(facets.size());
    parallel_for(context, facets.size(), grain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const Index3& v = mesh.facets[facets[i]];
            const Index3& across = mesh.neighbours[facets[i]];
            normals[i] = normal_of(mesh, facets[i]);
            turns[i] = {};
            if (mesh.role(facets[i]) != FacetRole::surface) {
                // Concave edges are convex seen from behind, and facets that pass through one another part
                // where their edges do not tell.
                turns[i].edges = 7;
                normals[i] = {0, 0, 0};
                continue;
            }
            for (int k = 0; k < 3; ++k) {
                if (!edge_matters(mesh, facets[i], k, to_double(mesh.vertices[v[k]]), normals[i])) continue;
                turns[i].edges |= static_cast<std::uint8_t>(1 << k);
                if (across[k] != kNoFacet)
                    turns[i].normals.edge[static_cast<std::size_t>(k)] =
                        between(normals[i], normal_of(mesh, across[k]));
            }
            if (across[0] == kNoFacet || across[1] == kNoFacet || across[2] == kNoFacet)
                normals[i] = {0, 0, 0};
        }
    });
    struct Around {
        Directions<3> normals;
        Directions<2> aside;
        bool tested = false;
    };
    std::vector<Around> around(mesh.vertices.size());
    for (std::size_t i = 0; i < facets.size(); ++i) {
        const bool any = normals[i] == Vec3d{0, 0, 0};
        Around own;
        std::array<double, 2> aside{};
        if (any) own.normals.add_all(), own.aside.add_all();
        else {
            own.normals.add(normals[i]);
            if (const Seen seen = seen_from_above(normals[i], aside); seen == Seen::all) own.aside.add_all();
            else if (seen == Seen::direction) own.aside.add(aside);
        }
        for (std::size_t c = 0; c < 3; ++c) {
            Around& at = around[mesh.facets[facets[i]][c]];
            at.normals.add(own.normals), at.aside.add(own.aside);
            // The first one with an edge to test that ends in a corner.
            if (at.tested || (turns[i].edges & (1U << c | 1U << (c + 2) % 3)) == 0) continue;
            at.tested = true;
            turns[i].ends |= static_cast<std::uint8_t>(1U << c);
        }
    }
    parallel_for(context, facets.size(), grain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            if (normals[i] == Vec3d{0, 0, 0}) continue;
            std::array<double, 2> aside{};
            const Index3& v = mesh.facets[facets[i]];
            const bool faces = seen_from_above(normals[i], aside) == Seen::direction,
                       at_top = std::max({mesh.vertices[v[0]].z, mesh.vertices[v[1]].z,
                                          mesh.vertices[v[2]].z}) >= cut_off;
            for (std::size_t c = 0; c < 3; ++c) {
                const Around& at = around[mesh.facets[facets[i]][c]];
                if (at_top || (turns[i].ends >> c & 1) != 0)
                    turns[i].normals.corner[c] = between_all({at.normals.low, at.normals.high});
                if (faces) turns[i].aside[c] = at.aside.turn_from(aside, kMostAside);
            }
        }
    });
    return turns;
}

// How many facets append_facet makes of one.
std::size_t pieces(MeshView mesh, std::uint32_t f, double z_top) {
    const std::array<double, 3> z{mesh.vertices[mesh.facets[f][0]].z, mesh.vertices[mesh.facets[f][1]].z,
                                  mesh.vertices[mesh.facets[f][2]].z};
    std::size_t corners = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        const double a = z[k], b = z[(k + 1) % 3];
        corners += a <= z_top;
        corners += (a <= z_top) != (b <= z_top) && a != z_top && b != z_top;
    }
    const std::size_t sides = mesh.role(f) == FacetRole::unsure ? 2 : 1;
    return corners < 3 ? 0 : sides * (corners - 2);
}

constexpr std::size_t kGrain = std::size_t{1} << 14;

// The facets of the mesh that the layer's solid has a part of, in Morton order of their middles.
BulkVector<std::uint32_t> facets_between(Context& context, MeshView mesh, double z_low, double cut_off) {
    // Which they are and the box of the mesh, in one reading of it.
    constexpr std::size_t grain = std::size_t{1} << 16;
    std::vector<std::vector<std::uint32_t>> parts((mesh.size() + grain - 1) / grain);
    std::vector<Box3> boxes(parts.size());
    parallel_for(context, mesh.size(), grain, [&](std::size_t begin, std::size_t end) {
        std::vector<std::uint32_t>& part = parts[begin / grain];
        Box3 box{mesh.vertices[mesh.facets[begin][0]], mesh.vertices[mesh.facets[begin][0]]};
        for (std::size_t f = begin; f < end; ++f) {
            const Vec3f a = mesh.vertices[mesh.facets[f][0]], b = mesh.vertices[mesh.facets[f][1]],
                        c = mesh.vertices[mesh.facets[f][2]];
            box.min = {std::min({box.min.x, a.x, b.x, c.x}), std::min({box.min.y, a.y, b.y, c.y}),
                       std::min({box.min.z, a.z, b.z, c.z})};
            box.max = {std::max({box.max.x, a.x, b.x, c.x}), std::max({box.max.y, a.y, b.y, c.y}),
                       std::max({box.max.z, a.z, b.z, c.z})};
            if (std::min({a.z, b.z, c.z}) >= cut_off || std::max({a.z, b.z, c.z}) < z_low)
                continue;                                    // a flat at the top itself belongs to the cap
            if (mesh.role(f) == FacetRole::inner) continue;  // wood all around
            part.push_back(static_cast<std::uint32_t>(f));
        }
        boxes[begin / grain] = box;
    });
    Box3 box = boxes.empty() ? Box3{} : boxes.front();
    for (const Box3& b : boxes) {
        box.min = {std::min(box.min.x, b.min.x), std::min(box.min.y, b.min.y), std::min(box.min.z, b.min.z)};
        box.max = {std::max(box.max.x, b.max.x), std::max(box.max.y, b.max.y), std::max(box.max.z, b.max.z)};
    }
    struct Key {
        std::uint64_t code;
        std::uint32_t facet;
    };
    std::vector<std::size_t> starts{0};
    for (const auto& part : parts) starts.push_back(starts.back() + part.size());
    BulkVector<Key> keys(starts.back());
    const MortonGrid grid(box);
    parallel_each(context, parts.size(), [&](std::size_t p) {
        auto middle = [](float u, float v, float w) { return (double{u} + v + w) / 3; };
        std::size_t at = starts[p];
        for (const std::uint32_t f : parts[p]) {
            const Vec3f &a = mesh.vertices[mesh.facets[f][0]], &b = mesh.vertices[mesh.facets[f][1]],
                        &c = mesh.vertices[mesh.facets[f][2]];
            keys[at++] = {grid.code(middle(a.x, b.x, c.x), middle(a.y, b.y, c.y), middle(a.z, b.z, c.z)), f};
        }
        std::vector<std::uint32_t>().swap(parts[p]);
    });
    parallel_sort(context, keys.begin(), keys.end(), [](const Key& a, const Key& b) {
        return a.code != b.code ? a.code < b.code : a.facet < b.facet;
    });
    BulkVector<std::uint32_t> facets(keys.size());
    parallel_for(context, keys.size(), kGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) facets[i] = keys[i].facet;
    });
    return facets;
}

}  // namespace

LayerSolid layer_solid(Context& context, MeshView mesh, double z_low, double z_top) {
    LayerSolid solid;
    solid.z_low = z_low;
    solid.z_top = z_top;
    const double cut_off = z_top - kTopSheet;  // the part is cut off here, facets and cap alike
    const BulkVector<std::uint32_t> facets = facets_between(context, mesh, z_low, cut_off);
    const BulkVector<Turns> turn = turns(context, mesh, facets, cut_off);
    // A cutter may touch what is unsure on either side, so by its normals nothing is told of where.
    solid.part = std::any_of(facets.begin(), facets.end(),
                             [&](std::uint32_t f) { return mesh.role(f) == FacetRole::unsure; });
    std::vector<std::size_t> starts((facets.size() + kGrain - 1) / kGrain + 1, 0);
    parallel_for(context, facets.size(), kGrain, [&](std::size_t begin, std::size_t end) {
        std::size_t count = 0;
        for (std::size_t i = begin; i < end; ++i) count += pieces(mesh, facets[i], cut_off);
        starts[begin / kGrain + 1] = count;
    });
    for (std::size_t c = 1; c < starts.size(); ++c) starts[c] += starts[c - 1];
    const Plane top{cut_off, Side::below};
    solid.cap = std::move(slice(context, mesh, {&top, 1})[0].loops);
    solid.cap_cells = CapCells(solid.cap);
    solid.facets.resize(starts.back());
    BulkVector<FacetNormals> normals(starts.back());
    parallel_for(context, facets.size(), kGrain, [&](std::size_t begin, std::size_t end) {
        SolidFacet* to = solid.facets.data() + starts[begin / kGrain];
        FacetNormals* to_normals = normals.data() + starts[begin / kGrain];
        for (std::size_t i = begin; i < end; ++i)
            append_facet(mesh, facets[i], turn[i], cut_off, to, to_normals);
    });
    using Extent = std::array<double, 4>;  // least x, y; greatest x, y
    const Extent extent = parallel_reduce(
        context, solid.facets.size(), kGrain, Extent{kUnbounded, kUnbounded, -kUnbounded, -kUnbounded},
        [&](std::size_t begin, std::size_t end) {
            Extent e{kUnbounded, kUnbounded, -kUnbounded, -kUnbounded};
            for (std::size_t i = begin; i < end; ++i)
                for (const Vec3d& p : solid.facets[i].p)
                    e = {std::min(e[0], p[0]), std::min(e[1], p[1]), std::max(e[2], p[0]),
                         std::max(e[3], p[1])};
            return e;
        },
        [](const Extent& a, const Extent& b) {
            return Extent{std::min(a[0], b[0]), std::min(a[1], b[1]), std::max(a[2], b[2]),
                          std::max(a[3], b[3])};
        });
    solid.min = {extent[0], extent[1]};
    solid.max = {extent[2], extent[3]};
    solid.groups = facet_groups(context, solid.facets, normals);
    solid.corners = group_corners(context, solid.facets, solid.groups, normals);
    solid.tree = facet_tree(context, solid.facets, solid.min, solid.max);
    return solid;
}

LayerSolid solid_near(Context& context, const LayerSolid& solid, std::span<const SolidFacet> facets,
                      double reach) {
    LayerSolid near;
    near.part = true;
    near.z_low = solid.z_low, near.z_top = solid.z_top, near.min = solid.min, near.max = solid.max;
    if (facets.empty() || solid.facets.empty()) return near;
    // Square tiles over the solid; those that come near are marked, by their middles.
    const double tile = std::max(
        {reach, (solid.max[0] - solid.min[0]) / kMostTiles, (solid.max[1] - solid.min[1]) / kMostTiles});
    const auto tiles = [&](int axis) {
        return static_cast<std::size_t>((solid.max[axis] - solid.min[axis]) / tile) + 1;
    };
    const std::size_t nx = tiles(0), ny = tiles(1);
    const auto of = [&](double v, int axis) {
        return static_cast<std::size_t>(
            std::clamp((v - solid.min[axis]) / tile, 0.0, static_cast<double>((axis == 0 ? nx : ny) - 1)));
    };
    std::vector<std::int32_t> rows;
    for (std::size_t j = 0; j < ny; ++j)
        rows.push_back(to_units(solid.min[1] + (static_cast<double>(j) + 0.5) * tile));
    const double half = tile * std::numbers::sqrt2 / 2 + 0.001;
    const Fibres marked = covering(context, facets, reach + half, Axis::x, rows);
    std::vector<std::uint32_t> before(nx * ny + ny, 0);  // by row: how many marked tiles precede a tile
    for (std::size_t j = 0; j < ny; ++j) {
        std::uint32_t* const row = before.data() + j * (nx + 1);
        for (const Forbidden& f : marked.line(j)) {
            if (f.high < solid.min[0] || f.low > solid.max[0]) continue;
            for (std::size_t i = of(f.low, 0); i <= of(f.high, 0); ++i) row[i + 1] = 1;
        }
        for (std::size_t i = 1; i <= nx; ++i) row[i] += row[i - 1];
    }
    const auto meets = [&](const FacetGroup& g) {
        const std::size_t i0 = of(g.low[0], 0), i1 = of(g.high[0], 0), j1 = of(g.high[1], 1);
        for (std::size_t j = of(g.low[1], 1); j <= j1; ++j)
            if (before[j * (nx + 1) + i1 + 1] > before[j * (nx + 1) + i0]) return true;
        return false;
    };
    std::vector<std::uint32_t> met;
    for (std::size_t g = 0; g < solid.groups.size(); ++g)
        if (meets(solid.groups[g])) met.push_back(static_cast<std::uint32_t>(g));
    near.facets.reserve(met.size() * FacetGroup::kFacets);
    for (const std::size_t g : met) {
        const std::size_t first = g * FacetGroup::kFacets,
                          last = std::min(solid.facets.size(), first + FacetGroup::kFacets);
        near.facets.insert(near.facets.end(), solid.facets.begin() + static_cast<std::ptrdiff_t>(first),
                           solid.facets.begin() + static_cast<std::ptrdiff_t>(last));
    }
    near.groups = facet_groups(context, near.facets);
    near.corners = group_corners(context, near.facets, near.groups);
    return near;
}

}  // namespace slabwright
