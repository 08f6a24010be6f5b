#include "kernels/access/wall_thickness.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "kernels/access/facet_scene.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr double kAlong = 0.70710678;           // cosine between the normal of a wall's far side and the ray
constexpr std::size_t kMostPoints = 1U << 18U;  // of one facet
constexpr double kLeastThickness = 1e-3;        // mm: two bodies' faces this near are one joint
constexpr std::size_t kGrain = 64;
constexpr std::size_t kMostCrossings = 64;  // of one ray
constexpr double kFarOff = 1e7;             // mm

struct Crossing {
    std::uint32_t facet;
    int turns;  // 1 where the ray leaves a body
    double distance;
};

/// Point k of an endless row that covers a triangle evenly.
Point3 point_in(const Triangle& t, std::size_t k) {
    constexpr double first = 0.7548776662466927, second = 0.5698402909980532;
    double u = std::fmod(0.5 + first * static_cast<double>(k), 1.0),
           v = std::fmod(0.5 + second * static_cast<double>(k), 1.0);
    if (k == 0) u = v = 1.0 / 3;
    if (u + v > 1) u = 1 - u, v = 1 - v;
    Point3 p{};
    for (std::size_t c = 0; c < 3; ++c) p[c] = t[0][c] + u * (t[1][c] - t[0][c]) + v * (t[2][c] - t[0][c]);
    return p;
}

class Walls {
public:
    Walls(Context& context, MeshView mesh, double limit)
        : scene_(context, mesh), mesh_(mesh), limit_(limit) {}

    /// Unit normal as the facet is turned; zero of a facet that has none.
    [[nodiscard]] Vec3d normal(std::uint32_t f) const {
        const Triangle t = scene_.triangle(f);
        const Vec3d n = cross(minus(t[1], t[0]), minus(t[2], t[0]));
        const double l = length(n);
        return l > 0 ? scaled(1 / l, n) : Vec3d{};
    }

    /// mm of solid from a point of a facet inwards, where that is a wall's; unbounded where it is no less
    /// than the limit.
    [[nodiscard]] double under(std::uint32_t f, const Point3& from, const Vec3d& into) const {
        const double step = kLeastThickness + scene_.margin();
        if (!mesh_.roles.empty()) return under_bodies(f, from, into, step);
        const FacetScene::RayHit hit = scene_.first_along(from, into, step, limit_);
        return hit.facet != kNoFacet && ends_wall(hit.facet, into) ? hit.distance : kUnbounded;
    }

    [[nodiscard]] ThinFacet look(std::uint32_t f, double spacing) const {
        ThinFacet found{f, 0, static_cast<float>(limit_), {}};
        if (mesh_.role(f) == FacetRole::inner) return found;
        const Triangle t = scene_.triangle(f);
        const Vec3d into = scaled(mesh_.role(f) == FacetRole::turned ? 1 : -1, normal(f));
        if (into == Vec3d{}) return found;
        const double area = length(cross(minus(t[1], t[0]), minus(t[2], t[0]))) / 2;
        const auto points = static_cast<std::size_t>(
            std::clamp(std::ceil(area / (spacing * spacing)), 1.0, static_cast<double>(kMostPoints)));
        std::size_t thin = 0;
        for (std::size_t k = 0; k < points; ++k) {
            const Point3 p = point_in(t, k);
            const double mm = under(f, p, into);
            if (!(mm < limit_)) continue;
            ++thin;
            if (static_cast<float>(mm) >= found.thickness_mm) continue;
            found.thickness_mm = static_cast<float>(mm);
            found.at = p;
        }
        found.share = static_cast<float>(thin) / static_cast<float>(points);
        return found;
    }

private:
    [[nodiscard]] bool ends_wall(std::uint32_t f, const Vec3d& into) const {
        return std::abs(dot(normal(f), into)) >= kAlong;
    }

    // The same where bodies overlap: the winding number says whether the point is on the solid's surface, and
    // where the ray leaves it. Faces that coincide are met as one; where the count then does not come out
    // the point is passed over.
    [[nodiscard]] double under_bodies(std::uint32_t f, const Point3& from, const Vec3d& into,
                                      double step) const {
        std::array<Crossing, kMostCrossings> crossings;
        std::size_t count = 0;
        int winding = 0;  // just under the point
        for (double begin = step; count < kMostCrossings;) {
            const FacetScene::RayHit hit = scene_.first_along(from, into, begin, kFarOff);
            if (hit.facet == kNoFacet) break;
            const int turns = dot(normal(hit.facet), into) > 0 ? 1 : -1;
            crossings[count++] = {hit.facet, turns, hit.distance};
            winding += turns;
            begin = hit.distance + step;
        }
        const int outside = winding - (dot(normal(f), into) < 0 ? 1 : -1);
        if (outside != 0 || winding == 0) return kUnbounded;
        for (std::size_t i = 0; i < count; ++i) {
            winding -= crossings[i].turns;
            if (winding == 0) return ends_wall(crossings[i].facet, into) ? crossings[i].distance : kUnbounded;
        }
        return kUnbounded;
    }

    FacetScene scene_;
    MeshView mesh_;
    double limit_;
};

}  // namespace

std::vector<ThinFacet> thin_facets(Context& context, MeshView mesh, double limit, double spacing) {
    if (mesh.size() == 0) return {};
    const Walls walls(context, mesh, limit);
    using Found = std::vector<ThinFacet>;
    return parallel_reduce(
        context, mesh.size(), kGrain, Found{},
        [&](std::size_t begin, std::size_t end) {
            Found found;
            for (std::size_t f = begin; f < end; ++f) {
                const ThinFacet thin = walls.look(static_cast<std::uint32_t>(f), spacing);
                if (thin.share > 0) found.push_back(thin);
            }
            return found;
        },
        [](Found a, const Found& b) {
            a.insert(a.end(), b.begin(), b.end());
            return a;
        });
}

}  // namespace slabwright
