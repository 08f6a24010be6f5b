#include "kernels/features/rounded_holes.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "kernels/mesh/weld.h"

namespace slabwright {

namespace {

constexpr double kSame = 1e-3;          // mm: heights nearer than this are one
constexpr double kUpright = 0.9999999;  // cosine of .026°: what a wall's two rims may be out of line
constexpr int kMostParts = 256;         // of a chord

using Rim = std::vector<std::uint32_t>;

// Flips edges between level facets around a rim where the arc over a chord would reach out of its facet:
// slivers that lie nearly along the rim are common there.
class RimRoom {
public:
    explicit RimRoom(MeshView mesh) {
        mesh_.vertices.assign(mesh.vertices.begin(), mesh.vertices.end());
        mesh_.facets.assign(mesh.facets.begin(), mesh.facets.end());
        mesh_.neighbours.assign(mesh.neighbours.begin(), mesh.neighbours.end());
        mesh_.roles.assign(mesh.roles.begin(), mesh.roles.end());
    }

    Mesh make(Context& context, std::span<const RoundHole> holes) {
        std::vector<std::uint8_t> of_hole(mesh_.facets.size(), 0);
        for (const RoundHole& hole : holes)
            for (const std::uint32_t f : hole.facets) of_hole[f] = 1;
        constexpr int kPasses = 8;  // each may turn an edge to the next corner
        for (int pass = 0; pass < kPasses; ++pass) {
            touched_ = of_hole;
            std::size_t flips = 0;
            for (const RoundHole& hole : holes) flips += around(hole) ? 1 : 0;
            if (flips == 0) break;
            pair_edges(context, mesh_);
        }
        return std::move(mesh_);
    }

private:
    bool around(const RoundHole& hole) {
        bool has_flipped = false;
        for (const std::uint32_t f : hole.facets)
            for (std::size_t k = 0; k < 3; ++k) {
                const std::uint32_t g = mesh_.neighbours[f][k];
                if (g == kNoFacet || touched_[g] != 0) continue;
                const std::uint32_t from = mesh_.facets[f][k], to = mesh_.facets[f][(k + 1) % 3];
                const std::size_t apex = corner_beside(g, from, to);
                if (!reaches_out(hole, from, to, mesh_.facets[g][apex])) continue;
                has_flipped = flip(hole, from, to, g, apex) || has_flipped;
            }
        return has_flipped;
    }

    [[nodiscard]] std::size_t corner_beside(std::uint32_t facet, std::uint32_t a, std::uint32_t b) const {
        std::size_t apex = 0;
        while (mesh_.facets[facet][apex] == a || mesh_.facets[facet][apex] == b) ++apex;
        return apex;
    }
    [[nodiscard]] Vec3d at(std::uint32_t v) const { return to_double(mesh_.vertices[v]); }
    // Twice a facet's area as seen from above, mm².
    [[nodiscard]] double area(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
        const Vec3d u = minus(at(b), at(a)), v = minus(at(c), at(a));
        return u[0] * v[1] - u[1] * v[0];
    }

    // Whether the tangents of the circle at both ends of a chord leave the apex on the circle's side: then
    // the arc would come out of the facet.
    [[nodiscard]] bool reaches_out(const RoundHole& hole, std::uint32_t from, std::uint32_t to,
                                   std::uint32_t apex) const {
        const Vec3d x = at(apex);
        for (const std::uint32_t v : {from, to}) {
            const Vec3d p = at(v);
            const double ox = p[0] - hole.mouth[0], oy = p[1] - hole.mouth[1];
            if (ox * (x[0] - p[0]) + oy * (x[1] - p[1]) <= 0) return true;
        }
        return false;
    }

    // Takes the edge from the apex to one end of the chord away, where the corner behind it is a better apex.
    bool flip(const RoundHole& hole, std::uint32_t from, std::uint32_t to, std::uint32_t facet,
              std::size_t apex) {
        const std::uint32_t x = mesh_.facets[facet][apex];
        for (const std::size_t side : {apex, (apex + 2) % 3}) {
            const std::uint32_t other = mesh_.neighbours[facet][side];
            if (other == kNoFacet || touched_[other] != 0) continue;
            const std::uint32_t a = mesh_.facets[facet][side], b = mesh_.facets[facet][(side + 1) % 3];
            const std::uint32_t y = mesh_.facets[other][corner_beside(other, a, b)];
            const std::uint32_t kept = a == x ? b : a;  // the chord's end that loses the edge to x
            const std::uint32_t rest = kept == from ? to : from;
            if (std::abs(at(y)[2] - at(from)[2]) > kSame || std::abs(at(x)[2] - at(from)[2]) > kSame)
                continue;
            const double sign = area(to, from, x);
            const Index3 near{to, from, y};
            const Index3 far = kept == from ? Index3{rest, y, x} : Index3{y, rest, x};
            if (area(near[0], near[1], near[2]) * sign <= 0 || area(far[0], far[1], far[2]) * sign <= 0)
                continue;
            // Towards an apex that the tangents do not cut off, or one that is at least farther out.
            const auto out = [&](std::uint32_t v) {
                return std::hypot(at(v)[0] - hole.mouth[0], at(v)[1] - hole.mouth[1]);
            };
            if (reaches_out(hole, from, to, y) && out(y) <= out(x)) continue;
            mesh_.facets[facet] = near;
            mesh_.facets[other] = far;
            touched_[facet] = touched_[other] = 1;
            return true;
        }
        return false;
    }

    Mesh mesh_;
    std::vector<std::uint8_t> touched_;
};

class Rounder {
public:
    Rounder(Context& context, MeshView mesh, double chord_mm)
        : context_(context), mesh_(mesh), chord_(chord_mm) {
        out_.mesh.vertices.assign(mesh.vertices.begin(), mesh.vertices.end());
        gone_.assign(mesh.size(), 0);
    }

    void round(const RoundHole& hole, std::size_t index) {
        const bool is_open = hole.bottom == HoleBottom::open;
        if (hole.kind != HoleKind::plain || std::abs(hole.into[2]) < kUpright || hole.into[2] > 0) return;
        if (!is_open && hole.bottom != HoleBottom::cone) return;
        for (const std::uint32_t f : hole.facets)
            if (mesh_.role(f) != FacetRole::surface) return;
        std::vector<Rim> rims = rims_of(mesh_, hole);
        if (rims.size() != (is_open ? 2 : 1)) return;
        for (const Rim& rim : rims)
            if (!is_level(mesh_, rim)) return;
        std::sort(rims.begin(), rims.end(), [&](const Rim& a, const Rim& b) { return z(a) > z(b); });
        const std::size_t vertices = out_.mesh.vertices.size();
        std::vector<Rim> finer;
        std::vector<Index3> facets;
        std::vector<std::uint32_t> replaced;
        for (const Rim& rim : rims) {
            if (!refine(hole, rim, finer.emplace_back(), facets, replaced)) {
                out_.mesh.vertices.resize(vertices);
                return;
            }
        }
        if (!is_open) finer.push_back(lower_rim(hole, finer.front()));
        add_wall(hole, finer, facets);
        if (!is_open) {
            const Vec3d tip = plus(hole.mouth, hole.into, hole.depth_mm);
            const std::uint32_t point = add({tip[0], tip[1], tip[2]});
            const Rim& low = finer.back();
            for (std::size_t i = 0; i < low.size(); ++i)
                facets.push_back({low[i], low[(i + 1) % low.size()], point});
        }
        for (const std::uint32_t f : replaced) gone_[f] = 1;
        for (const std::uint32_t f : hole.facets) gone_[f] = 1;
        facets_.insert(facets_.end(), facets.begin(), facets.end());
        out_.rounded.push_back(index);
    }

    std::optional<RoundedMesh> take() {
        if (out_.rounded.empty()) return std::nullopt;
        for (std::size_t f = 0; f < mesh_.size(); ++f)
            if (gone_[f] == 0) keep(mesh_.facets[f], mesh_.role(f));
        for (const Index3& facet : facets_) keep(facet, FacetRole::surface);
        pair_edges(context_, out_.mesh);
        return std::move(out_);
    }

private:
    [[nodiscard]] double z(const Rim& rim) const { return mesh_.vertices[rim.front()].z; }
    [[nodiscard]] Vec3d at(std::uint32_t v) const { return to_double(out_.mesh.vertices[v]); }
    std::uint32_t add(const Vec3d& p) {
        out_.mesh.vertices.push_back(
            {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])});
        return static_cast<std::uint32_t>(out_.mesh.vertices.size() - 1);
    }
    void keep(const Index3& facet, FacetRole role) {
        out_.mesh.facets.push_back(facet);
        if (!mesh_.roles.empty()) out_.mesh.roles.push_back(role);
    }

    // The rim with corners between its own, and the facets around it with them. False where one would fold.
    bool refine(const RoundHole& hole, const Rim& rim, Rim& finer, std::vector<Index3>& facets,
                std::vector<std::uint32_t>& replaced) {
        const double radius = hole.diameter_mm / 2;
        const double most = 2 * std::acos(std::max(0.0, 1 - chord_ / radius));
        const double x = hole.mouth[0], y = hole.mouth[1];
        for (std::size_t i = 0; i < rim.size(); ++i) {
            const std::uint32_t from = rim[i], to = rim[(i + 1) % rim.size()];
            const Vec3d a = at(from), b = at(to);
            const double ax = a[0] - x, ay = a[1] - y, bx = b[0] - x, by = b[1] - y;
            const double start = std::atan2(ay, ax), turn = std::atan2(ax * by - ay * bx, ax * bx + ay * by);
            const int parts = std::clamp(static_cast<int>(std::ceil(std::abs(turn) / most)), 1, kMostParts);
            Rim edge{from};
            for (int k = 1; k < parts; ++k) {
                const double t = static_cast<double>(k) / parts;
                const double r = (1 - t) * std::hypot(ax, ay) + t * std::hypot(bx, by);
                edge.push_back(add({x + r * std::cos(start + t * turn), y + r * std::sin(start + t * turn),
                                    (1 - t) * a[2] + t * b[2]}));
            }
            finer.insert(finer.end(), edge.begin(), edge.end());
            edge.push_back(to);
            if (parts > 1 && !fan(hole, edge, facets, replaced)) return false;
        }
        return true;
    }

    // The facet on the other side of a rim's edge, which runs along it the other way, as a fan.
    bool fan(const RoundHole& hole, const Rim& edge, std::vector<Index3>& facets,
             std::vector<std::uint32_t>& replaced) {
        const std::uint32_t outside = outside_of(hole, edge.front(), edge.back());
        if (outside == kNoFacet || gone_[outside] != 0 ||
            std::find(replaced.begin(), replaced.end(), outside) != replaced.end())
            return false;
        const Index3& facet = mesh_.facets[outside];
        std::uint32_t apex = facet[0];
        for (const std::uint32_t v : facet)
            if (v != edge.front() && v != edge.back()) apex = v;
        const auto normal = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
            return cross(minus(at(b), at(a)), minus(at(c), at(a)));
        };
        const Vec3d whole = normal(edge.back(), edge.front(), apex);
        for (std::size_t k = 0; k + 1 < edge.size(); ++k) {
            const Vec3d part = normal(edge[k + 1], edge[k], apex);
            if (dot(part, whole) <= 0.9 * length(part) * length(whole)) return false;
            facets.push_back({edge[k + 1], edge[k], apex});
        }
        replaced.push_back(outside);
        return true;
    }

    // The facet beyond a hole's edge.
    [[nodiscard]] std::uint32_t outside_of(const RoundHole& hole, std::uint32_t from,
                                           std::uint32_t to) const {
        for (const std::uint32_t f : hole.facets)
            for (std::size_t k = 0; k < 3; ++k)
                if (mesh_.facets[f][k] == from && mesh_.facets[f][(k + 1) % 3] == to)
                    return mesh_.neighbours[f][k];
        return kNoFacet;
    }

    // Where a blind hole's wall ends, under the upper rim's corners.
    Rim lower_rim(const RoundHole& hole, const Rim& upper) {
        const double depth = hole.steps.front().to_mm;
        Rim lower;
        for (const std::uint32_t v : upper) {
            const Vec3d p = plus(at(v), hole.into, depth);
            lower.push_back(add({p[0], p[1], hole.mouth[2] + hole.into[2] * depth}));
        }
        // A rim below runs the other way round than one above; as the upper one does, so that the wall
        // follows.
        return lower;
    }

    // The wall between two rims, side by side with the nearer corner by angle. The upper rim runs as the
    // wall's facets do along it.
    void add_wall(const RoundHole& hole, const std::vector<Rim>& rims, std::vector<Index3>& facets) {
        const auto by_angle = [&](const Rim& rim) {
            std::vector<std::pair<double, std::uint32_t>> corners;
            for (const std::uint32_t v : rim)
                corners.emplace_back(std::atan2(at(v)[1] - hole.mouth[1], at(v)[0] - hole.mouth[0]), v);
            std::sort(corners.begin(), corners.end());
            corners.emplace_back(corners.front().first + 2 * std::numbers::pi, corners.front().second);
            return corners;
        };
        const auto above = by_angle(rims[0]), below = by_angle(rims[1]);
        const auto middle = [](const auto& rim, std::size_t i) {
            return i + 1 == rim.size() ? kUnbounded : (rim[i].first + rim[i + 1].first) / 2;
        };
        // Seen from the axis a facet runs counter-clockwise: above it goes the way in which angles grow.
        for (std::size_t i = 0, j = 0; i + 1 < above.size() || j + 1 < below.size();) {
            if (middle(above, i) <= middle(below, j)) {
                facets.push_back({above[i].second, above[i + 1].second, below[j].second});
                ++i;
            } else {
                facets.push_back({above[i].second, below[j + 1].second, below[j].second});
                ++j;
            }
        }
    }

    Context& context_;
    MeshView mesh_;
    double chord_;
    RoundedMesh out_;
    std::vector<std::uint8_t> gone_;
    std::vector<Index3> facets_;
};

}  // namespace

std::vector<std::vector<std::uint32_t>> rims_of(MeshView mesh, const RoundHole& hole) {
    std::map<std::uint32_t, std::uint32_t> next;
    for (const std::uint32_t f : hole.facets)
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t g = mesh.neighbours[f][k];
            if (g != kNoFacet && std::binary_search(hole.facets.begin(), hole.facets.end(), g)) continue;
            if (!next.emplace(mesh.facets[f][k], mesh.facets[f][(k + 1) % 3]).second) return {};
        }
    std::vector<Rim> rims;
    while (!next.empty()) {
        Rim& rim = rims.emplace_back();
        for (auto at = next.begin(); at != next.end(); at = next.find(rim.back())) {
            if (rim.empty()) rim.push_back(at->first);
            rim.push_back(at->second);
            next.erase(at);
        }
        if (rim.front() != rim.back()) return {};
        rim.pop_back();
    }
    return rims;
}

bool is_level(MeshView mesh, const Rim& rim) {
    const double z = mesh.vertices[rim.front()].z;
    return std::all_of(rim.begin(), rim.end(),
                       [&](std::uint32_t v) { return std::abs(double{mesh.vertices[v].z} - z) < kSame; });
}

std::optional<RoundedMesh> with_rounded_holes(Context& context, MeshView mesh,
                                              std::span<const RoundHole> holes, double chord_mm) {
    const Mesh roomy = RimRoom(mesh).make(context, holes);
    Rounder rounder(context, roomy.view(), chord_mm);
    for (std::size_t i = 0; i < holes.size(); ++i) rounder.round(holes[i], i);
    return rounder.take();
}

}  // namespace slabwright
