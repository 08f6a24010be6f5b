#include "kernels/halves/halves.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "kernels/access/closest_point.h"
#include "kernels/errors.h"
#include "kernels/mesh/weld.h"
#include "kernels/polygons/loops.h"
#include "kernels/repair/repair.h"
#include "kernels/repair/triangulate.h"

namespace slabwright {

namespace {

constexpr double kOnPlane = 1e-5;        // mm
constexpr int kDowelCorners = 48;        // of a hole's circle
constexpr std::size_t kMostPlaces = 60;  // of a ring, at which a dowel is tried
constexpr int kMostRings = 12;           // a quarter of a hole's radius and wall apart
constexpr double kDepthStep = 1;         // mm between the places that are looked at along a hole

using Loop = std::vector<std::uint32_t>;

/// Directions in the plane, so that u × v is the normal.
struct PlaneFrame {
    Vec3d n, u, v;
    double offset;
    PlaneFrame(const CutPlane& plane) {  // NOLINT(google-explicit-constructor)
        const double size = length(plane.normal);
        if (!(size > 1e-9) || !std::isfinite(size) || !std::isfinite(plane.offset_mm))
            throw Error(ErrorKind::usage, "split.plane", "the plane has no direction", "--plane",
                        "give a, b, c, d with a, b, c not all 0");
        n = scaled(1 / size, plane.normal);
        offset = plane.offset_mm;
        std::size_t least = 0;
        for (std::size_t k = 1; k < 3; ++k)
            if (std::abs(n[k]) < std::abs(n[least])) least = k;
        Vec3d aside{};
        aside[least] = 1;
        u = cross(aside, n);
        u = scaled(1 / length(u), u);
        v = cross(n, u);
    }
    [[nodiscard]] double height(const Point3& p) const { return dot(n, p) - offset; }
    [[nodiscard]] Point3 at(double a, double b) const { return plus(plus(scaled(offset, n), u, a), v, b); }
};

/// The solid with the plane's crossings as vertices of its own; what lies on which side.
class Cut {
public:
    Cut(MeshView mesh, const MeshReport& report, const PlaneFrame& plane)
        : mesh_(mesh), report_(report), plane_(plane) {
        for (const Vec3f& v : mesh.vertices) {
            points_.push_back(to_double(v));
            double h = plane.height(points_.back());
            if (std::abs(h) <= kOnPlane) h = 0;
            heights_.push_back(h);
        }
        for (std::size_t f = 0; f < mesh.size(); ++f) cut_facet(f);
    }

    std::vector<Point3>& points() { return points_; }
    /// Facets of a half, and the body of each. @param side 0 above, 1 below
    [[nodiscard]] const std::vector<Index3>& facets(std::size_t side) const { return facets_[side]; }

    /// The loops that cap a half, by body, in the direction in which the cap's facets run along them.
    [[nodiscard]] std::map<std::uint32_t, std::vector<Loop>> cap_loops(std::size_t side) const {
        std::map<std::uint32_t, std::map<std::pair<std::uint32_t, std::uint32_t>, int>> edges;
        for (std::size_t f = 0; f < facets_[side].size(); ++f)
            for (std::size_t k = 0; k < 3; ++k) {
                const std::uint32_t a = facets_[side][f][k], b = facets_[side][f][(k + 1) % 3];
                if (heights_[a] != 0 || heights_[b] != 0 || a == b) continue;
                ++edges[bodies_[side][f]][{b, a}];
                --edges[bodies_[side][f]][{a, b}];
            }
        std::map<std::uint32_t, std::vector<Loop>> loops;
        for (const auto& [body, counted] : edges) loops[body] = chained(counted);
        return loops;
    }

private:
    std::uint32_t crossing(std::uint32_t a, std::uint32_t b) {
        const auto [known, fresh] =
            crossings_.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(points_.size()));
        if (fresh) {
            const auto [low, high] = std::minmax(a, b);
            const double share = heights_[low] / (heights_[low] - heights_[high]);
            points_.push_back(between(points_[low], points_[high], share));
            heights_.push_back(0);
        }
        return known->second;
    }

    void keep(std::size_t side, std::size_t facet, const Index3& corners) {
        if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) return;
        facets_[side].push_back(corners);
        bodies_[side].push_back(report_.component_of[facet]);
    }

    void cut_facet(std::size_t facet) {
        const Index3& i = mesh_.facets[facet];
        const auto above = [&](std::size_t k) { return heights_[i[k]] > 0; };
        const auto below = [&](std::size_t k) { return heights_[i[k]] < 0; };
        const bool any_above = above(0) || above(1) || above(2), any_below = below(0) || below(1) || below(2);
        if (!any_above && !any_below) {  // it lies in the plane: the solid is behind it
            const Vec3d a = points_[i[0]];
            const Vec3d normal = cross(minus(points_[i[1]], a), minus(points_[i[2]], a));
            keep(dot(normal, plane_.n) > 0 ? 1 : 0, facet, i);
            return;
        }
        if (!any_below) return keep(0, facet, i);
        if (!any_above) return keep(1, facet, i);
        for (const std::size_t side : {0U, 1U}) {
            Loop part;
            for (std::size_t k = 0; k < 3; ++k) {
                const std::size_t next = (k + 1) % 3;
                if (side == 0 ? !below(k) : !above(k)) part.push_back(i[k]);
                if ((above(k) && below(next)) || (below(k) && above(next)))
                    part.push_back(crossing(i[k], i[next]));
            }
            for (std::size_t k = 2; k < part.size(); ++k) keep(side, facet, {part[0], part[k - 1], part[k]});
        }
    }

    static std::vector<Loop> chained(const std::map<std::pair<std::uint32_t, std::uint32_t>, int>& counted) {
        std::multimap<std::uint32_t, std::uint32_t> next;
        for (const auto& [edge, count] : counted)
            for (int c = 0; c < count; ++c) next.emplace(edge.first, edge.second);
        std::vector<Loop> loops;
        while (!next.empty()) {
            Loop path;
            std::map<std::uint32_t, std::size_t> placed;  // so that a loop ends where it meets itself
            std::uint32_t at = next.begin()->first;
            for (;;) {
                if (const auto met = placed.find(at); met != placed.end()) {
                    const std::size_t from = met->second;
                    loops.emplace_back(path.begin() + static_cast<std::ptrdiff_t>(from), path.end());
                    for (std::size_t k = from; k < path.size(); ++k) placed.erase(path[k]);
                    path.resize(from);
                }
                const auto step = next.find(at);
                if (step == next.end()) break;
                placed[at] = path.size();
                path.push_back(at);
                at = step->second;
                next.erase(step);
            }
        }
        return loops;
    }

    MeshView mesh_;
    const MeshReport& report_;
    const PlaneFrame& plane_;
    std::vector<Point3> points_;
    std::vector<double> heights_;
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> crossings_;
    std::array<std::vector<Index3>, 2> facets_;
    std::array<std::vector<std::uint32_t>, 2> bodies_;
};

struct Flat2 {
    double a, b;
};

/// Loops of one body's cap as they lie in the plane.
class FlatLoops {
public:
    FlatLoops(const std::vector<Point3>& points, const PlaneFrame& plane) : points_(points), plane_(plane) {}
    [[nodiscard]] Flat2 flat(std::uint32_t v) const {
        return {dot(plane_.u, points_[v]), dot(plane_.v, points_[v])};
    }
    /// Twice the area, positive counter-clockwise about the plane's normal.
    [[nodiscard]] double area2(const Loop& loop) const {
        double sum = 0;
        for (std::size_t k = 0; k < loop.size(); ++k) {
            const Flat2 p = flat(loop[k]), q = flat(loop[(k + 1) % loop.size()]);
            sum += p.a * q.b - p.b * q.a;
        }
        return sum;
    }
    [[nodiscard]] bool holds(const Loop& loop, const Flat2& p) const {
        bool in = false;
        for (std::size_t k = 0; k < loop.size(); ++k) {
            const Flat2 a = flat(loop[k]), b = flat(loop[(k + 1) % loop.size()]);
            if ((a.b > p.b) != (b.b > p.b) && p.a < a.a + (b.a - a.a) * (p.b - a.b) / (b.b - a.b)) in = !in;
        }
        return in;
    }

private:
    const std::vector<Point3>& points_;
    const PlaneFrame& plane_;
};

/// Where dowels go: as far apart as the cut, and the material above and below it, allow.
std::vector<Dowel> place_dowels(Context& context, MeshView mesh, const PlaneFrame& plane,
                                const std::vector<Loop>& loops, const FlatLoops& flat,
                                const DowelRules& rules) {
    if (!(rules.diameter_mm > 0) || loops.empty()) return {};
    const double radius = (rules.diameter_mm + rules.clearance_mm) / 2, keep = radius + rules.wall_mm;
    Loops section;
    for (const Loop& loop : loops) {
        for (const std::uint32_t v : loop)
            section.points.push_back({to_units(flat.flat(v).a), to_units(flat.flat(v).b)});
        section.close_loop();
    }
    const Loops outline = simplify(section);
    const ClosestPoint closest(context, mesh);
    std::vector<Point3> places;
    // Ever farther from the outline: where walls lean inwards a hole has room only in the middle.
    for (int ring = 0; ring < kMostRings; ++ring) {
        const Loops room = offset(outline, -keep * (1 + 0.25 * ring), 0.01);
        if (room.empty()) break;
        const std::size_t every = room.points.size() / kMostPlaces + 1;
        for (std::size_t i = 0; i < room.points.size(); i += every) {
            if (winding(section, room.points[i]) != 1) continue;  // of one body, which the hole is made in
            const Point3 p = plane.at(to_mm(room.points[i].x), to_mm(room.points[i].y));
            bool free = true;
            for (double t = rules.depth_mm; free && t >= 0; t -= kDepthStep)
                for (const double along : {t, -t})
                    free =
                        free && closest.query_unsigned(plus(p, plane.n, along), keep).distance >= keep - 0.02;
            if (free) places.push_back(p);
        }
    }
    if (places.empty()) return {};
    std::pair<std::size_t, std::size_t> best{0, 0};
    double most = 0;
    for (std::size_t i = 0; i < places.size(); ++i)
        for (std::size_t j = i + 1; j < places.size(); ++j)
            if (const double d = squared_distance(places[i], places[j]); d > most) most = d, best = {i, j};
    std::vector<Dowel> dowels{{places[best.first], rules.diameter_mm, rules.depth_mm}};
    if (most > 16 * keep * keep)
        dowels.push_back({places[best.second], kSecondDowel * rules.diameter_mm, rules.depth_mm});
    return dowels;
}

/// Turns one side's facets and loops into a capped half, dowel holes among it.
class Capper {
public:
    Capper(std::vector<Point3>& points, std::vector<Index3> facets, const PlaneFrame& plane)
        : points_(points), facets_(std::move(facets)), plane_(plane), flat_(points, plane) {}

    /// @param way +1 where the cap faces along the normal (below), −1 above
    void cap(const std::vector<Loop>& loops, const std::vector<Loop>& rims, double way) {
        std::vector<const Loop*> outer, inner;
        for (const Loop& loop : loops) (flat_.area2(loop) * way > 0 ? outer : inner).push_back(&loop);
        for (const Loop& rim : rims) inner.push_back(&rim);
        std::vector<std::vector<const Loop*>> of(outer.size());
        for (const Loop* hole : inner) {
            std::size_t best = outer.size();
            for (std::size_t o = 0; o < outer.size(); ++o)
                if (holds_most(*outer[o], *hole) &&
                    (best == outer.size() ||
                     std::abs(flat_.area2(*outer[o])) < std::abs(flat_.area2(*outer[best]))))
                    best = o;
            if (best < outer.size()) of[best].push_back(hole);
        }
        for (std::size_t o = 0; o < outer.size(); ++o) close(*outer[o], of[o], way);
    }

    /// A blind hole behind a rim that runs counter-clockwise about the cap's normal.
    void drill(const Loop& rim, const Point3& middle, double depth, double way) {
        const Vec3d down = scaled(-way * depth, plane_.n);
        const auto end = static_cast<std::uint32_t>(points_.size());
        for (const std::uint32_t v : rim) points_.push_back(plus(points_[v], down));
        points_.push_back(plus(middle, down));
        const auto n = static_cast<std::uint32_t>(rim.size());
        for (std::uint32_t k = 0; k < n; ++k) {
            const std::uint32_t next = (k + 1) % n;
            facets_.push_back({rim[k], rim[next], end + next});
            facets_.push_back({rim[k], end + next, end + k});
            facets_.push_back({end + n, end + k, end + next});
        }
    }
    [[nodiscard]] const std::vector<Index3>& facets() const { return facets_; }

private:
    [[nodiscard]] bool holds_most(const Loop& outer, const Loop& hole) const {
        std::size_t in = 0;
        for (const std::uint32_t v : hole) in += flat_.holds(outer, flat_.flat(v)) ? 1 : 0;
        return 2 * in > hole.size();
    }
    void close(const Loop& outline, const std::vector<const Loop*>& holes, double way) {
        std::vector<Xyz> corners;
        std::vector<std::uint32_t> names;
        std::vector<Loop> positions;
        const auto add = [&](const Loop& loop) {
            Loop& into = positions.emplace_back();
            for (const std::uint32_t v : loop) {
                into.push_back(static_cast<std::uint32_t>(corners.size()));
                corners.push_back(points_[v]);
                names.push_back(v);
            }
        };
        add(outline);
        for (const Loop* hole : holes) add(*hole);
        const auto triangles = clip_ears(corners, positions, scaled(way, plane_.n));
        if (triangles.empty() && std::abs(flat_.area2(outline)) > 1e-6)
            throw Error(
                ErrorKind::input, "split.crossing", "the section crosses itself",
                fmt::format("({:.2f}, {:.2f}, {:.2f}) mm", corners[0][0], corners[0][1], corners[0][2]),
                "split a little higher or lower, or mend the mesh with --repair=rebuild");
        for (const auto& t : triangles) facets_.push_back({names[t[0]], names[t[1]], names[t[2]]});
    }

    std::vector<Point3>& points_;
    std::vector<Index3> facets_;
    const PlaneFrame& plane_;
    FlatLoops flat_;
};

/// A rotation that brings n to ±z, and the plane to z = 0. The upper half of a level cut stays as it lies.
AffineMap cut_face_down(const PlaneFrame& plane, bool above) {
    const double up = above ? 1 : -1;
    AffineMap map;
    if (plane.n == Vec3d{0, 0, 1}) {
        map.rows[1][1] = map.rows[2][2] = up;
    } else {
        const std::array<Vec3d, 3> rows{plane.u, scaled(up, plane.v), scaled(up, plane.n)};
        for (std::size_t r = 0; r < 3; ++r)
            for (std::size_t c = 0; c < 3; ++c) map.rows[r][c] = rows[r][c];
    }
    map.rows[2][3] = -up * plane.offset;
    return map;
}

Half finished(Context& context, const std::vector<Point3>& points, const std::vector<Index3>& facets,
              const AffineMap& map, std::size_t side) {
    Half half;
    half.map = map;
    std::vector<std::uint32_t> number(points.size(), kNoFacet);
    const bool mirrors = map.mirrors();
    for (Index3 f : facets) {
        if (mirrors) std::swap(f[1], f[2]);
        for (std::uint32_t& v : f) {
            if (number[v] == kNoFacet) {
                number[v] = static_cast<std::uint32_t>(half.mesh.vertices.size());
                const Point3 p = map.of(points[v]);
                const double z = std::abs(p[2]) <= kOnPlane ? 0 : p[2];
                half.mesh.vertices.push_back(
                    {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(z)});
            }
            v = number[v];
        }
        half.mesh.facets.push_back(f);
    }
    pair_edges(context, half.mesh);
    half.report = report_mesh(context, half.mesh.view());
    if (half.mesh.facets.empty() || !is_solid(half.report))
        throw Error(ErrorKind::input, "split.crossing",
                    fmt::format("the half {} is no solid", side == 0 ? "above" : "below"), "",
                    "split a little higher or lower, or mend the mesh with --repair first");
    return half;
}

}  // namespace

Halves split_solid(Context& context, MeshView mesh, const MeshReport& report, const CutPlane& cut_plane,
                   const DowelRules& rules, bool mirror_below) {
    const PlaneFrame plane(cut_plane);
    Cut cut(mesh, report, plane);
    if (cut.facets(0).empty() || cut.facets(1).empty())
        throw Error(
            ErrorKind::input, "split.misses",
            fmt::format("all of the model lies {} the plane", cut.facets(0).empty() ? "below" : "above"),
            "--z, --plane", "give a plane that passes through it; heights are from its bottom");
    Halves halves;
    std::vector<Point3>& points = cut.points();
    const FlatLoops flat(points, plane);
    const std::array caps{cut.cap_loops(0), cut.cap_loops(1)};
    std::vector<Loop> section;
    for (const auto& [body, loops] : caps[1])
        for (const Loop& loop : loops) {
            halves.cut_mm2 += flat.area2(loop) / 2;
            section.push_back(loop);
        }
    halves.dowels = place_dowels(context, mesh, plane, section, flat, rules);
    struct Rim {
        Loop points;  // counter-clockwise about the plane's normal
        std::uint32_t body = 0;
    };
    std::vector<Rim> rims(halves.dowels.size());
    for (std::size_t d = 0; d < rims.size(); ++d) {
        const Dowel& dowel = halves.dowels[d];
        // Corners stand outside of the circle, so that the dowel passes between the flats.
        const double radius =
            (dowel.diameter_mm + rules.clearance_mm) / 2 / std::cos(std::numbers::pi / kDowelCorners);
        for (int k = 0; k < kDowelCorners; ++k) {
            const double turn = 2 * std::numbers::pi * k / kDowelCorners;
            rims[d].points.push_back(static_cast<std::uint32_t>(points.size()));
            points.push_back(
                plus(plus(dowel.at, plane.u, radius * std::cos(turn)), plane.v, radius * std::sin(turn)));
        }
        const Flat2 at{dot(plane.u, dowel.at), dot(plane.v, dowel.at)};
        for (const auto& [body, loops] : caps[1]) {
            bool in = false;
            for (const Loop& loop : loops) in = in != flat.holds(loop, at);
            if (in) rims[d].body = body;
        }
    }
    for (const std::size_t side : {0U, 1U}) {
        context.throw_if_cancelled();
        const double way = side == 0 ? -1 : 1;
        Capper capper(points, cut.facets(side), plane);
        for (const auto& [body, loops] : caps[side]) {
            std::vector<Loop> holes;
            for (const Rim& rim : rims)
                if (rim.body == body) {
                    holes.push_back(rim.points);
                    if (way > 0) std::reverse(holes.back().begin(), holes.back().end());
                }
            capper.cap(loops, holes, way);
        }
        for (std::size_t d = 0; d < rims.size(); ++d) {
            Loop around = rims[d].points;
            if (way < 0) std::reverse(around.begin(), around.end());
            capper.drill(around, halves.dowels[d].at, halves.dowels[d].depth_mm, way);
        }
        AffineMap map = cut_face_down(plane, side == 0);
        if (side == 1 && mirror_below) {
            AffineMap mirror;
            mirror.rows[0][0] = -1;
            map = mirror.after(map);
        }
        (side == 0 ? halves.above : halves.below) = finished(context, points, capper.facets(), map, side);
    }
    return halves;
}

}  // namespace slabwright
