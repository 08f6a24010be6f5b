#include "engine/planner/orientations.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>
#include <utility>

#include "engine/prepare/preparation.h"
#include "kernels/features/facet_classes.h"
#include "kernels/geometry/vectors.h"
#include "kernels/mesh/convex_hull.h"
#include "kernels/polygons/loops.h"
#include "kernels/slicing/slicing.h"

namespace slabwright {

namespace {

constexpr double kHullShare = 1e-3;   // of the extent: how far points may lie out of the hull
constexpr double kLeastFacet = 0.01;  // of the hull's surface
constexpr double kAlike = 0.5;        // degrees
constexpr double kOnBoard = 0.01;     // mm: what lies so near to the board lies on it
constexpr double kWorthTurning = 0.98;
constexpr double kDegrees = 180 / std::numbers::pi;

double angle_between(const Vec3d& a, const Vec3d& b) {
    return std::atan2(length(cross(a, b)), dot(a, b)) * kDegrees;
}

/// Degrees to a millionth, without −0: what a command can repeat.
double rounded(double degrees) { return std::round(degrees * 1e6) / 1e6 + 0.0; }

/// A direction that may point down, and how much of the hull's surface lies that way.
struct HullSide {
    Vec3d normal{};
    double mm2 = 0;
};

/// The hull's facets, those of nearly one direction together, the largest first.
std::vector<HullSide> hull_sides(MeshView mesh, const std::vector<Index3>& hull) {
    std::vector<HullSide> facets;
    double surface = 0;
    for (const Index3& f : hull) {
        const Vec3d a = to_double(mesh.vertices[f[0]]);
        const Vec3d n =
            cross(minus(to_double(mesh.vertices[f[1]]), a), minus(to_double(mesh.vertices[f[2]]), a));
        const double l = length(n);
        if (l > 0) facets.push_back({scaled(1 / l, n), l / 2}), surface += l / 2;
    }
    std::stable_sort(facets.begin(), facets.end(),
                     [](const HullSide& a, const HullSide& b) { return a.mm2 > b.mm2; });
    std::vector<HullSide> sides;
    std::vector<Vec3d> sums;
    for (const HullSide& f : facets) {
        const auto like = std::find_if(sides.begin(), sides.end(), [&](const HullSide& s) {
            return angle_between(s.normal, f.normal) < 2 * kAlike;
        });
        if (like == sides.end()) {
            sides.push_back(f);
            sums.push_back(scaled(f.mm2, f.normal));
            continue;
        }
        const auto k = static_cast<std::size_t>(like - sides.begin());
        like->mm2 += f.mm2;
        sums[k] = plus(sums[k], f.normal, f.mm2);
        like->normal = scaled(1 / length(sums[k]), sums[k]);
    }
    std::erase_if(sides, [&](const HullSide& s) { return s.mm2 < kLeastFacet * surface; });
    std::stable_sort(sides.begin(), sides.end(),
                     [](const HullSide& a, const HullSide& b) { return a.mm2 > b.mm2; });
    return sides;
}

/// The direction of the part's own facets that lie there; the hull's where there are none.
Vec3d of_facets(MeshView mesh, const Vec3d& normal, double within) {
    double support = -kUnbounded;
    for (const Vec3f& v : mesh.vertices) support = std::max(support, dot(normal, to_double(v)));
    Vec3d sum{};
    for (std::uint32_t f = 0; f < mesh.size(); ++f) {
        const Index3& t = mesh.facets[f];
        const bool there = std::all_of(t.begin(), t.end(), [&](std::uint32_t v) {
            return dot(normal, to_double(mesh.vertices[v])) > support - within;
        });
        if (!there) continue;
        const Vec3d n = area_normal(mesh, f);
        if (length(n) > 0 && angle_between(n, normal) < 3 * kAlike) sum = plus(sum, n);
    }
    const double l = length(sum);
    return l > 0 ? scaled(1 / l, sum) : normal;
}

/// Degrees about z at which the box of the outline is least, and by a right angle more where only so a slab
/// holds it; 0 where that gains little.
double turn_in_plane(MeshView mesh, const std::vector<Index3>& hull, const std::array<double, 3>& turn,
                     const Slabs& slabs) {
    const AffineMap map = turned(turn);
    std::vector<std::array<double, 2>> corners;
    std::vector<double> angles{0};
    for (const Index3& f : hull)
        for (std::size_t k = 0; k < 3; ++k) {
            const Point3 a = map.of(to_double(mesh.vertices[f[k]])),
                         b = map.of(to_double(mesh.vertices[f[(k + 1) % 3]]));
            corners.push_back({a[0], a[1]});
            if (std::hypot(b[0] - a[0], b[1] - a[1]) > 1)
                angles.push_back(-std::remainder(std::atan2(b[1] - a[1], b[0] - a[0]), std::numbers::pi / 2));
        }
    std::sort(angles.begin() + 1, angles.end());
    angles.erase(std::unique(angles.begin() + 1, angles.end(),
                             [](double a, double b) { return std::abs(a - b) < 1e-4; }),
                 angles.end());
    double best = 0, least = kUnbounded;
    bool across = false;
    for (const double angle : angles) {
        const double c = std::cos(angle), s = std::sin(angle);
        std::array<double, 4> box{kUnbounded, kUnbounded, -kUnbounded, -kUnbounded};
        for (const auto& [x, y] : corners) {
            const double u = c * x - s * y, v = s * x + c * y;
            box = {std::min(box[0], u), std::min(box[1], v), std::max(box[2], u), std::max(box[3], v)};
        }
        const double dx = box[2] - box[0], dy = box[3] - box[1];
        if (dx * dy < (angle == 0 ? 1 : kWorthTurning) * least)
            least = dx * dy, best = angle,
            across = (dx > slabs.length || dy > slabs.width) && dy <= slabs.length && dx <= slabs.width;
    }
    return best * kDegrees + (across ? 90 : 0);
}

}  // namespace

std::array<double, 3> turn_that_lays(const std::array<double, 3>& down) {
    const double aside = std::hypot(down[1], down[2]);
    double about_x = 0;  // lays it into the plane of x and −z, and the turn about y then upright
    if (aside > 1e-9 * std::abs(down[0]))
        about_x = std::remainder(-90 - std::atan2(down[2], down[1]) * kDegrees, 360);
    if (about_x <= -180) about_x = 180;
    return {rounded(about_x), rounded(std::atan2(down[0], aside) * kDegrees), 0};
}

std::vector<Orientation> orientations(Context& context, MeshView mesh, const Job& job,
                                      std::size_t most_facets) {
    const Box3 box = bounds(context, mesh);
    const double extent = length(minus(to_double(box.max), to_double(box.min)));
    const std::vector<Index3> hull = convex_hull(mesh.vertices, kHullShare * extent);
    std::vector<Vec3d> downs{{0, 0, -1}, {0, 0, 1}, {0, 1, 0}, {0, -1, 0}, {1, 0, 0}, {-1, 0, 0}};
    std::vector<HullSide> sides = hull_sides(mesh, hull);
    if (sides.size() > most_facets) sides.resize(most_facets);
    for (const HullSide& side : sides) {
        const Vec3d normal = of_facets(mesh, side.normal, 2 * kHullShare * extent);
        if (std::none_of(downs.begin(), downs.end(),
                         [&](const Vec3d& d) { return angle_between(d, normal) < kAlike; }))
            downs.push_back(normal);
    }
    std::vector<Orientation> found;
    const auto add = [&](const std::array<double, 3>& turn) -> Orientation& {
        context.throw_if_cancelled();
        Orientation way;
        way.turn = turn;
        const Mesh laid = laid_down(mesh, way.turn);
        const Box3 lies = bounds(context, laid.view());
        way.size = minus(to_double(lies.max), to_double(lies.min));
        way.foot_mm2 =
            area(simplify(slice(context, laid.view(), std::vector<Plane>{{kOnBoard, Side::above}})[0].loops));
        way.outcome = lying(context, laid.view(), job);
        return found.emplace_back(way);
    };
    for (const Vec3d& down : downs) {
        std::array<double, 3> turn = turn_that_lays(down);
        const bool as_it_lies = turn == std::array<double, 3>{};
        // Turned about the upright the pattern may take less wood, but it need not be built sooner.
        if (as_it_lies) add(turn);
        turn[2] = rounded(turn_in_plane(mesh, hull, turn, job.slabs));
        if (as_it_lies && turn[2] == 0) continue;
        Orientation& way = add(turn);
        if (as_it_lies) {  // what stays unmade is the same, but for rounding
            way.outcome.unmade_mm3 = found.front().outcome.unmade_mm3;
            way.foot_mm2 = found.front().foot_mm2;
        }
    }
    const auto rank = [](const Orientation& w) {
        return std::tuple(!w.outcome.has_room, std::floor(w.outcome.unmade_mm3 / 10), w.outcome.layers,
                          -std::round(w.foot_mm2), w.size[2]);
    };
    std::stable_sort(found.begin(), found.end(),
                     [&](const Orientation& a, const Orientation& b) { return rank(a) < rank(b); });
    return found;
}

}  // namespace slabwright
