#include "kernels/polygons/medial_axis.h"

#include <algorithm>
#include <array>
#include <boost/polygon/voronoi_builder.hpp>
#include <boost/polygon/voronoi_diagram.hpp>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <tuple>
#include <utility>

#include "kernels/geometry/vectors.h"
#include "kernels/polygons/facing_edges.h"
#include "kernels/polygons/farthest.h"
#include "kernels/polygons/plane_edges.h"

namespace slabwright {

namespace {

using Diagram = boost::polygon::voronoi_diagram<double>;
using Cell = Diagram::cell_type;
using Vertex = Diagram::vertex_type;

constexpr double kLeastClearance = 10;  // units: nearer than that a point is a wall's own corner
constexpr double kStraight = 3;         // units, within which corners lie in a line
constexpr double kAngle = 1e-6;         // rad, of rounding
constexpr std::uint32_t kNone = UINT32_MAX;

Vec2d of(Point2 p) { return {double(p.x), double(p.y)}; }
Vec2d at_share(const Vec2d& a, const Vec2d& b, double t) {
    return {a.x + t * (b.x - a.x), a.y + t * (b.y - a.y)};
}

/// The points of a stretch of a loop between two that stay, without those that lie in their neighbours' line.
void thin_between(const PointRows& rows, std::size_t first, std::size_t last, std::vector<char>& stays) {
    std::vector<std::pair<std::size_t, std::size_t>> open{{first, last}};
    while (!open.empty()) {
        const auto [from, to] = open.back();
        open.pop_back();
        const Farthest farthest = farthest_between(rows, from, to);
        if (farthest.distance2 <= kStraight * kStraight) continue;
        stays[farthest.at] = 1;
        open.emplace_back(from, farthest.at);
        open.emplace_back(farthest.at, to);
    }
}

/// Walls that many facets make up are straight but for rounding. Without that the diagram has to decide in
/// exact numbers, again and again, which of two points on one line is nearer.
Loops without_straight_corners(const Loops& loops) {
    Loops thinned;
    PointRows rows;
    std::vector<char> stays;
    for (std::size_t l = 0; l < loops.size(); ++l) {
        const auto loop = loops.loop(l);
        const std::size_t n = loop.size();
        if (n < 3) continue;
        rows.x.clear(), rows.y.clear();
        for (std::size_t i = 0; i <= n; ++i) {
            rows.x.push_back(loop[i % n].x);
            rows.y.push_back(loop[i % n].y);
        }
        rows.z.assign(n + 1, 0.0);
        // The lowest corner and the one farthest from it are certain to be corners.
        std::size_t begin = 0, far = 0;
        for (std::size_t i = 1; i < n; ++i)
            if (loop[i] < loop[begin]) begin = i;
        std::rotate(rows.x.begin(), rows.x.begin() + static_cast<std::ptrdiff_t>(begin), rows.x.end() - 1);
        std::rotate(rows.y.begin(), rows.y.begin() + static_cast<std::ptrdiff_t>(begin), rows.y.end() - 1);
        rows.x.back() = rows.x.front(), rows.y.back() = rows.y.front();
        double most = -1;
        for (std::size_t i = 1; i < n; ++i) {
            const double d = std::hypot(rows.x[i] - rows.x[0], rows.y[i] - rows.y[0]);
            if (d > most) most = d, far = i;
        }
        stays.assign(n + 1, 0);
        stays[0] = stays[far] = 1;
        thin_between(rows, 0, far, stays);
        thin_between(rows, far, n, stays);
        for (std::size_t i = 0; i < n; ++i)
            if (stays[i])
                thinned.points.push_back(
                    {static_cast<std::int32_t>(rows.x[i]), static_cast<std::int32_t>(rows.y[i])});
        thinned.close_loop();
    }
    return thinned;
}

/// What is nearest to the points of a Voronoi cell: a wall's edge, or the end of one.
struct Source {
    Vec2d a, b;  ///< the same for an end
    bool is_edge = false;
    std::uint32_t edge = 0;   ///< that it is or ends
    bool begins_edge = true;  ///< of an end

    [[nodiscard]] Vec2d foot(const Vec2d& p) const {
        if (!is_edge) return a;
        const Vec2d d = b - a;
        return at_share(a, b, std::clamp(dot(p - a, d) / dot(d, d), 0.0, 1.0));
    }
};

/// The points of one Voronoi edge by t from 0 to 1: straight between alike sources, else a parabola.
class Bisector {
public:
    Bisector(const Source& s, const Source& t, const Vec2d& from, const Vec2d& to) : from_(from), to_(to) {
        if (s.is_edge == t.is_edge) {
            pinch_ = s.is_edge ? -1 : share(at_share(s.a, t.a, 0.5), from, to);
            return;
        }
        const Source& wall = s.is_edge ? s : t;
        focus_ = s.is_edge ? t.a : s.a;
        const Vec2d d = wall.b - wall.a;
        const double long_ = length(d);
        origin_ = wall.a;
        along_ = {d.x / long_, d.y / long_};
        height_ = cross(along_, focus_ - origin_);
        u0_ = dot(from - origin_, along_), u1_ = dot(to - origin_, along_);
        curved_ = std::abs(height_) > 1 && u0_ != u1_;
        pinch_ = curved_ ? (dot(focus_ - origin_, along_) - u0_) / (u1_ - u0_) : -1;
    }

    [[nodiscard]] Vec2d at(double t) const {
        if (t <= 0) return from_;
        if (t >= 1) return to_;
        if (!curved_) return at_share(from_, to_, t);
        const double u = u0_ + t * (u1_ - u0_), off = u - dot(focus_ - origin_, along_);
        const double v = (height_ * height_ + off * off) / (2 * height_);
        return {origin_.x + u * along_.x - v * along_.y, origin_.y + u * along_.y + v * along_.x};
    }
    /// Where it is nearest to both sources, if that lies between its ends.
    [[nodiscard]] double pinch() const { return pinch_; }

    /// The shares of it beyond which it is wider than `most`, or out of a box; first > last: all of it.
    [[nodiscard]] std::pair<double, double> range(double most, const Vec2d& low, const Vec2d& high) const {
        if (curved_) {
            const double h = std::abs(height_), off2 = 2 * h * most - h * h;
            const double reach = off2 > 0 ? std::sqrt(off2) / std::abs(u1_ - u0_) : -1;
            return {std::max(0.0, pinch_ - reach), std::min(1.0, pinch_ + reach)};
        }
        // Straight: as far as it passes the box.
        double first = 0, last = 1;
        const auto within = [&](double from, double to, double least, double greatest) {
            if (from == to) {
                if (from < least || from > greatest) last = -1;
                return;
            }
            const double a = (least - from) / (to - from), b = (greatest - from) / (to - from);
            first = std::max(first, std::min(a, b));
            last = std::min(last, std::max(a, b));
        };
        within(from_.x, to_.x, low.x, high.x);
        within(from_.y, to_.y, low.y, high.y);
        return {first, last};
    }

private:
    static double share(const Vec2d& p, const Vec2d& from, const Vec2d& to) {
        const Vec2d d = to - from;
        return dot(d, d) > 0 ? dot(p - from, d) / dot(d, d) : -1;
    }
    Vec2d from_, to_, focus_, origin_, along_;
    double height_ = 0, u0_ = 0, u1_ = 0, pinch_ = -1;
    bool curved_ = false;
};

/// Keeps the narrow part of the diagram.
class NarrowAxis {
public:
    NarrowAxis(const Loops& solid, const MedialLimits& limits) : solid_(solid), limits_(limits) {
        // What is round is so narrow between walls on three sides of it.
        const double spread = std::min(limits.least_spread_rad, 2 * std::numbers::pi / 3);
        edges_ = edges_meeting_in_ends(facing_edges(without_straight_corners(solid),
                                                    2 * limits.most_clearance_mm * kUnitsPerMm, spread));
        for (std::uint32_t i = 0; i < edges_.size(); ++i) by_end_.push_back(i);
        for (const Point2 p : solid.points) {
            low_ = {std::min(low_.x, double(p.x)), std::min(low_.y, double(p.y))};
            high_ = {std::max(high_.x, double(p.x)), std::max(high_.y, double(p.y))};
        }
        std::sort(by_end_.begin(), by_end_.end(), [&](std::uint32_t i, std::uint32_t j) {
            return edges_[i].b != edges_[j].b ? edges_[i].b < edges_[j].b : i < j;
        });
    }

    MedialAxis build() {
        boost::polygon::default_voronoi_builder builder;
        for (const PlaneEdge& e : edges_) builder.insert_segment(e.a.x, e.a.y, e.b.x, e.b.y);
        builder.construct(&diagram_);
        points_of_.assign(diagram_.num_vertices(), kNone);
        for (std::size_t i = 0; i < diagram_.num_edges(); i += 2) {
            const Diagram::edge_type& e = diagram_.edges()[i];
            if (e.is_primary() && e.is_finite()) add_edge(e);
        }
        add_middles();
        return std::move(axis_);
    }

private:
    struct Sample {
        Vec2d at;
        double clearance = 0, spread = 0;
        bool kept = false;
    };

    [[nodiscard]] Source source(const Cell& cell) const {
        Source s;
        s.edge = static_cast<std::uint32_t>(cell.source_index());
        const PlaneEdge& e = edges_[s.edge];
        s.is_edge = cell.contains_segment();
        s.begins_edge = cell.source_category() == boost::polygon::SOURCE_CATEGORY_SEGMENT_START_POINT;
        s.a = of(s.is_edge || s.begins_edge ? e.a : e.b);
        s.b = of(s.is_edge ? e.b : (s.begins_edge ? e.a : e.b));
        return s;
    }

    /// Whether what is nearest to a source at p lies outside the solid, which edges have on their left.
    [[nodiscard]] bool in_air(const Source& s, const Vec2d& p) const {
        const PlaneEdge& e = edges_[s.edge];
        if (s.is_edge) return cross(s.b - s.a, p - s.a) < 0;
        const Point2 corner = s.begins_edge ? e.a : e.b;
        const auto into = std::equal_range(by_end_.begin(), by_end_.end(), corner, EndsBefore{edges_});
        const auto out = std::equal_range(edges_.begin(), edges_.end(), corner, BeginsBefore{});
        // Where a wall goes on that was left out, no place beside its end has that end for its nearest.
        if (into.second == into.first || out.second == out.first) return false;
        if (into.second - into.first == 1 && out.second - out.first == 1) {
            const PlaneEdge& before = edges_[*into.first];
            const double turns = cross(of(before.b) - of(before.a), of(out.first->b) - of(out.first->a));
            if (turns != 0) return turns > 0;
        }
        return winding(solid_, {static_cast<std::int32_t>(std::lround(p.x)),
                                static_cast<std::int32_t>(std::lround(p.y))}) == 0;
    }

    [[nodiscard]] bool narrow(double clearance) const {
        return clearance >= kLeastClearance && clearance <= limits_.most_clearance_mm * kUnitsPerMm;
    }

    [[nodiscard]] Sample sample(const Source& s, const Source& t, const Vec2d& p) const {
        Sample found{p};
        const Vec2d to_s = s.foot(p) - p, to_t = t.foot(p) - p;
        found.clearance = length(to_s);
        found.spread = std::abs(std::atan2(cross(to_s, to_t), dot(to_s, to_t)));
        found.kept = narrow(found.clearance) && found.spread >= limits_.least_spread_rad && in_air(s, p) &&
                     in_air(t, p);
        return found;
    }

    std::uint32_t add_point(const Sample& s) {
        axis_.points.push_back({s.at.x / kUnitsPerMm, s.at.y / kUnitsPerMm, s.clearance / kUnitsPerMm});
        return static_cast<std::uint32_t>(axis_.points.size() - 1);
    }
    [[nodiscard]] std::size_t index_of(const Vertex* v) const {
        return static_cast<std::size_t>(v - diagram_.vertices().data());
    }
    std::uint32_t point_of(const Vertex* v, const Sample& s) {
        std::uint32_t& point = points_of_[index_of(v)];
        if (point == kNone) point = add_point(s);
        return point;
    }

    void add_edge(const Diagram::edge_type& e) {
        const Source s = source(*e.cell()), t = source(*e.twin()->cell());
        const Vec2d from{e.vertex0()->x(), e.vertex0()->y()}, to{e.vertex1()->x(), e.vertex1()->y()};
        const Bisector bisector(s, t, from, to);
        // An axis that is wide at both ends is narrow between them only about a pinch.
        const double far = length(to - from), most = limits_.most_clearance_mm * kUnitsPerMm;
        const double here = length(s.foot(from) - from), there = length(s.foot(to) - to);
        const double pinch = bisector.pinch();
        const bool pinched = pinch > 0 && pinch < 1;
        if (here > most && there > most && !pinched) return;
        std::vector<double>& shares = shares_;
        shares.assign({0.0, 1.0});
        const auto [first, last] = bisector.range(most, low_, high_);
        if (first > last && !pinched) return;
        const double pieces = std::ceil(far * (last - first) / (limits_.step_mm * kUnitsPerMm));
        if (first > 0) shares.push_back(first);
        for (double i = 1; i < pieces; ++i) shares.push_back(first + (last - first) * i / pieces);
        if (last < 1) shares.push_back(last);
        if (pinched) shares.push_back(pinch);
        std::sort(shares.begin(), shares.end());
        // Far from its pinch a parabola runs farther than its share says.
        const double step = limits_.step_mm * kUnitsPerMm + 1;
        const auto wide = [&](const Vec2d& p) { return length(s.foot(p) - p) > most + 1; };
        for (std::size_t i = 0; i + 1 < shares.size();) {
            const double half_way = (shares[i] + shares[i + 1]) / 2;
            const Vec2d a = bisector.at(shares[i]), b = bisector.at(shares[i + 1]);
            if (length(b - a) > step && !wide(a) && !wide(b))
                shares.insert(shares.begin() + static_cast<std::ptrdiff_t>(i) + 1, half_way);
            else ++i;
        }
        Sample before;
        std::uint32_t before_point = kNone;
        for (const double share : shares) {
            const Sample next = sample(s, t, bisector.at(share));
            std::uint32_t point = kNone;
            if (next.kept)
                point = share == 0   ? point_of(e.vertex0(), next)
                        : share == 1 ? point_of(e.vertex1(), next)
                                     : add_point(next);
            if (next.kept && before.kept && before_point != point)
                axis_.links.push_back({before_point, point});
            before = next;
            before_point = point;
        }
    }

    /// The middles of what is round: no half-plane through them is free of the nearest places of the walls.
    void add_middles() {
        std::vector<MedialPoint> middles;
        for (const Vertex& v : diagram_.vertices()) {
            const Vec2d p{v.x(), v.y()};
            const Source first = source(*v.incident_edge()->cell());
            const double clearance = length(first.foot(p) - p);
            if (points_of_[index_of(&v)] != kNone || !narrow(clearance)) continue;
            std::vector<double>& angles = shares_;
            angles.clear();
            const Diagram::edge_type* e = v.incident_edge();
            bool all_in_air = true;
            do {
                const Source nearest = source(*e->cell());
                const Vec2d to = nearest.foot(p) - p;
                angles.push_back(std::atan2(to.y, to.x));
                all_in_air = all_in_air && in_air(nearest, p);
                e = e->rot_next();
            } while (e != v.incident_edge());
            std::sort(angles.begin(), angles.end());
            double gap = angles.front() + 2 * std::numbers::pi - angles.back();
            for (std::size_t i = 1; i < angles.size(); ++i) gap = std::max(gap, angles[i] - angles[i - 1]);
            if (gap > std::numbers::pi + kAngle || !all_in_air) continue;
            middles.push_back({p.x / kUnitsPerMm, p.y / kUnitsPerMm, clearance / kUnitsPerMm});
        }
        keep_apart(middles);
    }

    /// A polygon of many sides has its middle in several vertices that all but coincide: the widest stays.
    void keep_apart(std::vector<MedialPoint>& middles) {
        std::sort(middles.begin(), middles.end(), [](const MedialPoint& a, const MedialPoint& b) {
            return std::tie(a.x, a.y, a.clearance) < std::tie(b.x, b.y, b.clearance);
        });
        constexpr double same = 0.05;  // of the clearance
        std::vector<char> gone(middles.size(), 0);
        for (std::size_t i = 0; i < middles.size(); ++i)
            for (std::size_t j = i + 1; j < middles.size() && !gone[i]; ++j) {
                const MedialPoint &a = middles[i], &b = middles[j];
                if (b.x - a.x > same * limits_.most_clearance_mm) break;
                if (gone[j] || std::hypot(a.x - b.x, a.y - b.y) > same * std::min(a.clearance, b.clearance))
                    continue;
                gone[a.clearance >= b.clearance ? j : i] = 1;
            }
        for (std::size_t i = 0; i < middles.size(); ++i)
            if (!gone[i]) axis_.points.push_back(middles[i]);
    }

    struct BeginsBefore {
        bool operator()(const PlaneEdge& e, Point2 p) const { return e.a < p; }
        bool operator()(Point2 p, const PlaneEdge& e) const { return p < e.a; }
    };
    struct EndsBefore {
        const std::vector<PlaneEdge>& edges;
        bool operator()(std::uint32_t i, Point2 p) const { return edges[i].b < p; }
        bool operator()(Point2 p, std::uint32_t i) const { return p < edges[i].b; }
    };

    const Loops& solid_;
    const MedialLimits& limits_;
    std::vector<PlaneEdge> edges_;       // in ascending order, so by where they begin
    std::vector<std::uint32_t> by_end_;  // those edges by where they end
    Diagram diagram_;
    MedialAxis axis_;
    std::vector<std::uint32_t> points_of_;  // of each vertex of the diagram, its point
    std::vector<double> shares_;            // scratch
    Vec2d low_{kUnbounded, kUnbounded}, high_{-kUnbounded, -kUnbounded};  // of the solid
};

}  // namespace

MedialAxis narrow_axis(const Loops& solid, const MedialLimits& limits) {
    if (solid.empty()) return {};
    return NarrowAxis(solid, limits).build();
}

}  // namespace slabwright
