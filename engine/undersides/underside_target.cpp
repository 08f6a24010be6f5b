#include "engine/undersides/underside_target.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "engine/schedule/fit.h"
#include "engine/schedule/joints.h"
#include "kernels/mesh/facet_roles.h"
#include "kernels/mesh/weld.h"
#include "kernels/repair/triangulate.h"
#include "kernels/slicing/silhouette.h"
#include "kernels/slicing/slicing.h"

namespace slabwright {

namespace {

constexpr double kLeads = 2;        // mm of room for leads
constexpr double kSliver = 0.1;     // mm: air less wide is none
constexpr double kSlit = 1;         // mm: wood less wide between two regions goes with them
constexpr double kFine = 0.05;      // mm by which the region's outline may be off
constexpr double kStraight = 0.01;  // mm from the line between its neighbours: a point less far off goes
constexpr double kSpeck = 1;        // mm²: a loop less large goes
constexpr int kDirections = 8;      // from which a region is tried to be filled
constexpr double kTurn = 0.7;       // radians between them
constexpr int kOutlines = 4;        // regions that are tried, each a little wider, until one can be filled
constexpr double kWider = 0.37;     // mm
constexpr double kRim = 2;          // mm of wood at the slab's edges that stay
constexpr double kBeyond = 200;     // mm: the rim reaches past the slab, so that nothing is cut beside it
constexpr double kUnder = 1;        // mm: the tray reaches below all else by that

Loops rectangle(const Blank& blank, double inset) {
    Loops loops;
    const std::int32_t x0 = to_units(blank.min[0] + inset), x1 = to_units(blank.max[0] - inset),
                       y0 = to_units(blank.min[1] + inset), y1 = to_units(blank.max[1] - inset);
    loops.points = {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}};
    loops.close_loop();
    return loops;
}

/// The tray of a slab: a rectangle with a recess, as a closed mesh.
class Tray {
public:
    /// @param region of the recess, in the turned slab's frame, nested
    Tray(const TurnedSlab& slab, Loops region, double bottom)
        : region_(std::move(region)),
          bottom_(bottom),
          floor_(recess_floor(slab)),
          top_(slab.slab_thickness),
          length_(slab.blank.length()),
          width_(slab.blank.width()) {}

    /// None where the region's outline cannot be filled with triangles.
    std::optional<Mesh> make(Context& context) {
        for (const double z : {floor_, top_})
            for (const Point2 p : region_.points) add(to_mm(p.x), to_mm(p.y), z);
        corners_ = static_cast<std::uint32_t>(points_.size());
        for (const double z : {bottom_, top_})
            for (const auto& [x, y] : {std::array{-kBeyond, -kBeyond},
                                       {length_ + kBeyond, -kBeyond},
                                       {length_ + kBeyond, width_ + kBeyond},
                                       {-kBeyond, width_ + kBeyond}})
                add(x, y, z);
        fill_levels();
        if (!filled_) return std::nullopt;
        walls();
        mesh_.vertices.assign(points_.begin(), points_.end());
        pair_edges(context, mesh_);
        return std::move(mesh_);
    }

private:
    using Ring = std::vector<std::uint32_t>;

    void add(double x, double y, double z) {
        points_.push_back({static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)});
        exact_.push_back({x, y, z});
    }

    /// A loop of the region at one of its two heights.
    [[nodiscard]] Ring ring(std::size_t loop, bool at_top, bool reversed) const {
        Ring ring;
        const auto shift = static_cast<std::uint32_t>(at_top ? region_.points.size() : 0);
        for (std::uint32_t i = region_.starts[loop]; i < region_.starts[loop + 1]; ++i)
            ring.push_back(i + shift);
        if (reversed) std::reverse(ring.begin(), ring.end());
        return ring;
    }

    /// Bridges to holes may miss where corners lie level; seen from another direction they do not.
    void fill(const std::vector<Ring>& rings) {
        for (int k = 0; k < kDirections; ++k) {
            const double turn = k * kTurn, cosine = std::cos(turn), sine = std::sin(turn);
            std::vector<Xyz> points = exact_;
            for (Xyz& p : points) p = {cosine * p[0] - sine * p[1], sine * p[0] + cosine * p[1], p[2]};
            const auto triangles = clip_ears(points, rings, {0, 0, 1});
            if (triangles.empty()) continue;
            mesh_.facets.insert(mesh_.facets.end(), triangles.begin(), triangles.end());
            return;
        }
        filled_ = false;
    }

    [[nodiscard]] std::vector<std::size_t> children(std::int32_t parent) const {
        std::vector<std::size_t> found;
        for (std::size_t i = 0; i < region_.size(); ++i)
            if (region_.parents[i] == parent) found.push_back(i);
        return found;
    }

    /// The recess's floor, the rim, and the islands in the recess, which are as high as the rim.
    void fill_levels() {
        std::vector<Ring> rim{{corners_ + 4, corners_ + 5, corners_ + 6, corners_ + 7}};
        for (const std::size_t outer : children(-1)) rim.push_back(ring(outer, true, true));
        fill(rim);
        for (std::size_t i = 0; i < region_.size(); ++i) {
            const bool is_outer = signed_area(region_.loop(i)) > 0;
            std::vector<Ring> rings{ring(i, !is_outer, !is_outer)};
            for (const std::size_t inner : children(static_cast<std::int32_t>(i)))
                rings.push_back(ring(inner, !is_outer, !is_outer));
            fill(rings);
        }
    }

    void quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
        mesh_.facets.push_back({a, b, c});
        mesh_.facets.push_back({a, c, d});
    }

    void walls() {
        const auto up = static_cast<std::uint32_t>(region_.points.size());
        for (std::size_t l = 0; l < region_.size(); ++l)
            for (std::uint32_t i = region_.starts[l]; i < region_.starts[l + 1]; ++i) {
                const std::uint32_t next = i + 1 < region_.starts[l + 1] ? i + 1 : region_.starts[l];
                quad(next, i, i + up, next + up);
            }
        for (std::uint32_t k = 0; k < 4; ++k) {
            const std::uint32_t a = corners_ + k, b = corners_ + (k + 1) % 4;
            quad(a, b, b + 4, a + 4);
        }
        quad(corners_ + 3, corners_ + 2, corners_ + 1, corners_);
    }

    const Loops region_;
    double bottom_, floor_, top_, length_, width_;
    std::vector<Vec3f> points_;
    std::vector<Xyz> exact_;
    std::uint32_t corners_ = 0;
    bool filled_ = true;
    Mesh mesh_;
};

/// How far a point lies from the line through two others, mm; from the first where they are one.
double off_line(Point2 p, Point2 a, Point2 b) {
    const double dx = double{1} * b.x - a.x, dy = double{1} * b.y - a.y, px = double{1} * p.x - a.x,
                 py = double{1} * p.y - a.y;
    const double length = std::hypot(dx, dy);
    return (length > 0 ? std::abs(dx * py - dy * px) / length : std::hypot(px, py)) / kUnitsPerMm;
}

/// Loops without points that lie on the line between their neighbours, and without those too small to matter.
Loops without_straight_points(const Loops& region) {
    Loops kept;
    for (std::size_t l = 0; l < region.size(); ++l) {
        std::vector<Point2> points;
        for (const Point2 p : region.loop(l)) {
            while (points.size() > 1 && off_line(points.back(), points[points.size() - 2], p) < kStraight)
                points.pop_back();
            points.push_back(p);
        }
        while (points.size() > 2 && off_line(points.back(), points[points.size() - 2], points[0]) < kStraight)
            points.pop_back();
        if (points.size() < 3 || std::abs(signed_area(points)) < kSpeck) continue;
        kept.points.insert(kept.points.end(), points.begin(), points.end());
        kept.close_loop();
    }
    return kept;
}

/// A strip of the web, in the turned slab's frame; its ends lie in the tray's rim.
Mesh strip(Context& context, const TurnedSlab& slab, double y, double bottom) {
    const double top = slab.slab_thickness - (slab.z_top - slab.z_bottom) + slab.web;
    const std::array<double, 2> xs{-kBeyond / 2, slab.blank.length() + kBeyond / 2},
        ys{y - kStripWidth / 2, y + kStripWidth / 2}, zs{bottom, top};
    Mesh box;
    for (std::size_t k = 0; k < 8; ++k)
        box.vertices.push_back({static_cast<float>(xs[k & 1]), static_cast<float>(ys[k >> 1 & 1]),
                                static_cast<float>(zs[k >> 2])});
    constexpr std::array<std::array<std::uint32_t, 4>, 6> sides{
        {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}};
    for (const auto& q : sides) {
        box.facets.push_back({q[0], q[1], q[2]});
        box.facets.push_back({q[0], q[2], q[3]});
    }
    pair_edges(context, box);
    return box;
}

/// Adds a closed body to a mesh with neighbours.
void append(const Mesh& body, Mesh& mesh) {
    const auto vertex = static_cast<std::uint32_t>(mesh.vertices.size()),
               facet = static_cast<std::uint32_t>(mesh.facets.size());
    mesh.vertices.insert(mesh.vertices.end(), body.vertices.begin(), body.vertices.end());
    for (Index3 f : body.facets) {
        for (std::uint32_t& v : f) v += vertex;
        mesh.facets.push_back(f);
    }
    for (Index3 n : body.neighbours) {
        for (std::uint32_t& f : n) f = f == kNoFacet ? f : f + facet;
        mesh.neighbours.push_back(n);
    }
}

/// @param region in the pattern's frame
Mesh tray_of(Context& context, const Loops& region, const TurnedSlab& slab, double bottom) {
    for (int k = 0; k < kOutlines; ++k) {
        const Loops wider =
            k == 0 ? region : intersect(offset(region, k * kWider, kFine), rectangle(slab.blank, kRim));
        if (auto tray = Tray(slab, turned_region(without_straight_points(wider), slab), bottom).make(context))
            return std::move(*tray);
    }
    throw refusal("underside.outline", "the outline of what is milled from below cannot be filled",
                  fmt::format("layer {}", slab.layer),
                  "mill this pattern's slabs from above: layers.sides = \"one\"");
}

}  // namespace

Loops turned_region(const Loops& region, const TurnedSlab& slab) {
    Loops loops;
    const std::int32_t right = to_units(slab.blank.max[0]), front = to_units(slab.blank.min[1]);
    for (std::size_t l = 0; l < region.size(); ++l) {
        const auto loop = region.loop(l);
        for (auto p = loop.rbegin(); p != loop.rend(); ++p)
            loops.points.push_back({right - p->x, p->y - front});
        loops.close_loop();
    }
    nest(loops);
    return loops;
}

double film_web(double height, double slab_thickness) {
    return std::max(0.0, kUndersideFilm - (slab_thickness - height));
}

bool has_strips(const TurnedSlab& slab) {
    const double film = film_web(slab.z_top - slab.z_bottom, slab.slab_thickness);
    return slab.web > film && slab.web <= kStripWeb;
}

double recess_floor(const TurnedSlab& slab) {
    const double height = slab.z_top - slab.z_bottom;
    const double web = has_strips(slab) ? film_web(height, slab.slab_thickness) : slab.web;
    return slab.slab_thickness - height + web;
}

MilledLayer milled_layer(const TurnedSlab& slab) {
    MilledLayer layer{slab.z_top, MilledFrom::both_sides, slab.web};
    if (!has_strips(slab)) return layer;
    layer.strip_pitch = kStripPitch;
    layer.strip_width = kStripWidth;
    layer.front = slab.blank.min[1];
    layer.film = film_web(slab.z_top - slab.z_bottom, slab.slab_thickness);
    return layer;
}

double underside_room(const Job& job) {
    double widest = 0;
    for (const Tool& tool : job.tools)
        if (is_end_mill(tool.kind)) widest = std::max(widest, tool.diameter);
    return widest + 2 * job.cutting.wall_allowance + kLeads;
}

Loops underside_region(Context& context, MeshView pattern, const TurnedSlab& slab) {
    const HeightRange range{slab.z_bottom + kBesideJoint, slab.z_top - kBesideJoint};
    const Loops shadow = shadows(context, pattern, {&range, 1}).front();
    const Plane plane{range.low, Side::above};
    const std::vector<Section> below = slice(context, pattern, {&plane, 1});
    const Loops air = offset(subtract(shadow, below.front().loops), -kSliver, kFine / 2);
    if (air.empty()) return {};
    const Loops wide = offset(air, kSliver + slab.room + kSlit, kFine);
    return intersect(offset(wide, -kSlit, kFine), rectangle(slab.blank, kRim));
}

Mesh underside_target(Context& context, MeshView pattern, const TurnedSlab& slab) {
    for (const Index3& n : pattern.neighbours)
        if (std::find(n.begin(), n.end(), kNoFacet) != n.end())
            throw refusal("underside.open", "the pattern is open at its base, so it has no underside to mill",
                          fmt::format("layer {}", slab.layer),
                          "close the pattern, or mill its slabs from above: layers.sides = \"one\"");
    const Loops region = underside_region(context, pattern, slab);
    if (region.empty())
        throw refusal("underside.none", "has an underside of which nothing is to be milled",
                      fmt::format("layer {}", slab.layer), "plan again");
    Mesh target;
    float lowest = 0;
    for (const Vec3f& v : pattern.vertices) {
        target.vertices.push_back({static_cast<float>(slab.blank.max[0] - v.x),
                                   static_cast<float>(v.y - slab.blank.min[1]),
                                   static_cast<float>(slab.z_bottom + slab.slab_thickness - v.z)});
        lowest = std::min(lowest, target.vertices.back().z);
    }
    target.facets.assign(pattern.facets.begin(), pattern.facets.end());
    target.neighbours.assign(pattern.neighbours.begin(), pattern.neighbours.end());
    append(tray_of(context, region, slab, lowest - kUnder), target);
    if (has_strips(slab))
        for (double y = kStripPitch / 2; y < slab.blank.width(); y += kStripPitch)
            append(strip(context, slab, y, lowest - kUnder / 2), target);
    target.roles = facet_roles(context, target.view());
    return target;
}

std::vector<JointDowel> turned_dowels(const TurnedSlab& slab, std::span<const JointDowel> dowels) {
    std::vector<JointDowel> turned;
    for (const JointDowel& d : dowels)
        turned.push_back({slab.blank.max[0] - d.x, d.y - slab.blank.min[1], d.diameter, d.above, d.below});
    return turned;
}

}  // namespace slabwright
