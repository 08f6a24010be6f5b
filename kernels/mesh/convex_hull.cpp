#include "kernels/mesh/convex_hull.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <utility>

#include "kernels/geometry/vectors.h"

namespace slabwright {

namespace {

constexpr double kApart = 1e-9;  // of the extent: by how much points of one plane are told apart

/// A number from −1 to 1 that belongs to k (SplitMix64's finaliser).
double scattered(std::uint64_t k) {
    k += 0x9E3779B97F4A7C15U;
    k = (k ^ (k >> 30)) * 0xBF58476D1CE4E5B9U;
    k = (k ^ (k >> 27)) * 0x94D049BB133111EBU;
    return static_cast<double>((k ^ (k >> 31)) >> 11) * 0x1p-52 - 1;
}

class Hull {
public:
    Hull(std::span<const Vec3f> points, double tolerance) : tolerance_(tolerance) {
        Vec3d low{kUnbounded, kUnbounded, kUnbounded}, high{-kUnbounded, -kUnbounded, -kUnbounded};
        points_.reserve(points.size());
        for (const Vec3f& p : points) {
            points_.push_back(to_double(p));
            for (std::size_t k = 0; k < 3; ++k)
                low[k] = std::min(low[k], points_.back()[k]), high[k] = std::max(high[k], points_.back()[k]);
        }
        if (points.empty()) return;
        const double apart = kApart * length(minus(high, low));
        for (std::size_t i = 0; i < points_.size(); ++i)
            for (std::size_t k = 0; k < 3; ++k) points_[i][k] += apart * scattered(3 * i + k);
    }

    std::vector<Index3> facets() {
        std::vector<Index3> found;
        if (points_.size() < 4 || !begin()) return found;
        while (!waiting_.empty()) {
            const std::uint32_t facet = waiting_.back();
            waiting_.pop_back();
            if (facets_[facet].alive && !facets_[facet].outside.empty()) add_farthest(facet);
        }
        for (const Facet& f : facets_)
            if (f.alive) found.push_back(f.corners);
        return found;
    }

private:
    struct Facet {
        Index3 corners{};
        Vec3d normal{};  // of unit length
        double offset = 0;
        std::array<std::uint32_t, 3> across{};  // the facet beyond the edge from corner k to the next
        std::vector<std::uint32_t> outside;     // points farther out than the tolerance
        bool alive = true, visible = false;

        [[nodiscard]] double above(const Vec3d& p) const { return dot(normal, p) - offset; }
    };

    std::uint32_t make(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        Facet f;
        f.corners = {a, b, c};
        const Vec3d n = cross(minus(points_[b], points_[a]), minus(points_[c], points_[a]));
        const double l = length(n);
        f.normal = l > 0 ? scaled(1 / l, n) : Vec3d{};
        f.offset = dot(f.normal, points_[a]);
        facets_.push_back(std::move(f));
        return static_cast<std::uint32_t>(facets_.size() - 1);
    }

    /// A first tetrahedron of points far from one another. @return whether there is one
    bool begin() {
        const auto farthest = [&](auto&& far) {
            std::size_t best = 0;
            double most = -1;
            for (std::size_t i = 0; i < points_.size(); ++i)
                if (const double d = far(points_[i]); d > most) most = d, best = i;
            return std::pair{static_cast<std::uint32_t>(best), most};
        };
        const std::uint32_t a =
            farthest([&](const Vec3d& p) { return squared_distance(p, points_[0]); }).first;
        const std::uint32_t b =
            farthest([&](const Vec3d& p) { return squared_distance(p, points_[a]); }).first;
        const Vec3d edge = minus(points_[b], points_[a]);
        const double l = length(edge);
        if (!(l > tolerance_)) return false;
        const auto [c, aside] =
            farthest([&](const Vec3d& p) { return length(cross(edge, minus(p, points_[a]))) / l; });
        if (!(aside > tolerance_)) return false;
        const Vec3d normal = cross(edge, minus(points_[c], points_[a]));
        const double n = length(normal);
        const auto [d, height] =
            farthest([&](const Vec3d& p) { return std::abs(dot(normal, minus(p, points_[a]))) / n; });
        if (!(height > tolerance_)) return false;
        const bool below = dot(normal, minus(points_[d], points_[a])) < 0;
        const std::array<std::uint32_t, 4> t = below ? std::array{a, b, c, d} : std::array{a, c, b, d};
        make(t[0], t[1], t[2]), make(t[0], t[3], t[1]), make(t[1], t[3], t[2]), make(t[2], t[3], t[0]);
        link({0, 1, 2, 3});
        std::vector<std::uint32_t> all(points_.size());
        for (std::uint32_t i = 0; i < all.size(); ++i) all[i] = i;
        assign(all, {0, 1, 2, 3});
        return true;
    }

    /// Finds the neighbours of some facets that share edges with one another.
    void link(const std::vector<std::uint32_t>& some) {
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::pair<std::uint32_t, std::size_t>> edges;
        for (const std::uint32_t f : some)
            for (std::size_t k = 0; k < 3; ++k)
                edges[{facets_[f].corners[k], facets_[f].corners[(k + 1) % 3]}] = {f, k};
        for (const auto& [edge, at] : edges)
            if (const auto other = edges.find({edge.second, edge.first}); other != edges.end())
                facets_[at.first].across[at.second] = other->second.first;
    }

    /// Gives points to the facet that they lie farthest out of.
    void assign(const std::vector<std::uint32_t>& points, const std::vector<std::uint32_t>& facets) {
        for (const std::uint32_t p : points) {
            double most = tolerance_;
            std::uint32_t of = 0;
            bool found = false;
            for (const std::uint32_t f : facets)
                if (const double d = facets_[f].above(points_[p]); d > most) most = d, of = f, found = true;
            if (found) facets_[of].outside.push_back(p);
        }
        for (const std::uint32_t f : facets)
            if (!facets_[f].outside.empty()) waiting_.push_back(f);
    }

    /// Replaces what the farthest point out of a facet sees by a cone from it to the horizon.
    void add_farthest(std::uint32_t facet) {
        const std::vector<std::uint32_t>& out = facets_[facet].outside;
        std::uint32_t apex = out.front();
        for (const std::uint32_t p : out)
            if (facets_[facet].above(points_[p]) > facets_[facet].above(points_[apex])) apex = p;
        std::vector<std::uint32_t> seen{facet};
        facets_[facet].visible = true;
        struct Edge {
            std::uint32_t a, b, beyond;
        };
        std::vector<Edge> horizon;
        for (std::size_t i = 0; i < seen.size(); ++i) {
            const Facet& f = facets_[seen[i]];
            for (std::size_t k = 0; k < 3; ++k) {
                Facet& other = facets_[f.across[k]];
                if (other.visible) continue;
                if (other.above(points_[apex]) > 0) {
                    other.visible = true;
                    seen.push_back(f.across[k]);
                } else {
                    horizon.push_back({f.corners[k], f.corners[(k + 1) % 3], f.across[k]});
                }
            }
        }
        std::vector<std::uint32_t> fresh, orphans;
        for (const Edge& e : horizon) {
            const std::uint32_t f = make(e.a, e.b, apex);
            facets_[f].across[0] = e.beyond;
            Facet& beyond = facets_[e.beyond];
            for (std::size_t k = 0; k < 3; ++k)
                if (beyond.corners[k] == e.b && beyond.corners[(k + 1) % 3] == e.a) beyond.across[k] = f;
            fresh.push_back(f);
        }
        link(fresh);
        for (const std::uint32_t s : seen) {
            facets_[s].alive = false;
            for (const std::uint32_t p : facets_[s].outside)
                if (p != apex) orphans.push_back(p);
            facets_[s].outside = {};
        }
        assign(orphans, fresh);
    }

    double tolerance_;
    std::vector<Vec3d> points_;
    std::vector<Facet> facets_;
    std::vector<std::uint32_t> waiting_;
};

}  // namespace

std::vector<Index3> convex_hull(std::span<const Vec3f> points, double tolerance) {
    return Hull(points, tolerance).facets();
}

}  // namespace slabwright
