// How deep a cutter goes on motions: one by one, and in rows, where what of the part is near is looked for
// once for many.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

#include "kernels/access/near_facets.h"
#include "kernels/access/piece_depth.h"
#include "kernels/access/revolved_depth.h"
#include "kernels/access/standing_part.h"
#include "kernels/access/standing_walk.h"
#include "kernels/geometry/wide.h"

namespace slabwright {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kHair = 1e-9;   // mm: rounding of a bound
constexpr double kEqual = 1e-6;  // mm: depths that differ by less may be the same

/// A straight motion seen from above. Boxes and facets are measured in the frame of its direction, where
/// their extents bound their distance.
class WayInPlan {
public:
    WayInPlan(const Point3& a, const Point3& b) : ax_(a[0]), ay_(a[1]) {
        const double dx = b[0] - a[0], dy = b[1] - a[1];
        length_ = std::sqrt(dx * dx + dy * dy);
        if (length_ > 0) ux_ = dx / length_, uy_ = dy / length_;
    }
    /// Square of a lower bound of the distance to a box, and never more than a hair above it by rounding.
    template <class NodeT>
    [[nodiscard]] double distance2(const NodeT& n) const {
        const double hx = 0.5 * (static_cast<double>(n.x1) - n.x0),
                     hy = 0.5 * (static_cast<double>(n.y1) - n.y0);
        const double cx = 0.5 * (static_cast<double>(n.x1) + n.x0) - ax_,
                     cy = 0.5 * (static_cast<double>(n.y1) + n.y0) - ay_;
        const double along = cx * ux_ + cy * uy_, across = cy * ux_ - cx * uy_;
        const double h_along = std::abs(ux_) * hx + std::abs(uy_) * hy,
                     h_across = std::abs(uy_) * hx + std::abs(ux_) * hy;
        return gaps2(along - h_along, along + h_along, across - h_across, across + h_across);
    }
    [[nodiscard]] double distance2(const std::array<Vec3f, 3>& v) const {
        double along0 = kInfinity, along1 = -kInfinity, across0 = kInfinity, across1 = -kInfinity;
        for (const Vec3f& p : v) {
            const double x = p.x - ax_, y = p.y - ay_, along = x * ux_ + y * uy_, across = y * ux_ - x * uy_;
            along0 = std::min(along0, along);
            along1 = std::max(along1, along);
            across0 = std::min(across0, across);
            across1 = std::max(across1, across);
        }
        return gaps2(along0, along1, across0, across1);
    }

private:
    [[nodiscard]] double gaps2(double along0, double along1, double across0, double across1) const {
        const double l = std::max({0.0, along0 - length_, -along1}), c = std::max({0.0, across0, -across1});
        return l * l + c * c;
    }
    double ax_, ay_, ux_ = 1, uy_ = 0, length_ = 0;
};

CutterForm form_of(const Envelope& under) {
    if (under.sin_taper > 0) return under.rounding > 0 ? CutterForm::tapered_ball : CutterForm::cone;
    if (under.rounding <= 0) return CutterForm::flat;
    return under.core > 0 ? CutterForm::bull_nose : CutterForm::ball;
}

/// A cutter with a layer's top.
struct Cutter {
    Cutter() = default;
    Cutter(const Envelope& shape, double layer_top)
        : form(form_of(shape)), radius(shape.radius), corner(shape.rounding), top(layer_top), under(shape) {}
    CutterForm form = CutterForm::flat;
    double radius = 0, corner = 0, top = 0;
    Envelope under;

    [[nodiscard]] bool ball() const { return form == CutterForm::ball; }
    [[nodiscard]] bool tapers() const { return under.sin_taper > 0; }
    /// What is asked of a motion is asked of so many pieces of it.
    [[nodiscard]] int pieces(const Point3& from, const Point3& to) const {
        const Point3 span = minus(to, from);
        const double length = std::sqrt(dot(span, span));
        const double count =
            ball() || tapers()
                ? std::max(length / StandingPart::kSpan, std::abs(span[2]) / StandingPart::kRise)
                : length / (from[2] == to[2] ? StandingPart::kSpan : StandingPart::kPiece);
        return std::max(1, static_cast<int>(std::ceil(count)));
    }
    /// Depth with the tip under the cap, the section of the part by the layer's top: that of the ball's
    /// centre below it, of the cylinder's floor, or of the axis. On a piece it is greatest at an end or where
    /// the axis crosses the cap's outline, and the outline is an edge of facets cut at the top.
    [[nodiscard]] double under_cap(const Point3& tip) const {
        if (tapers()) return depth_within(under, 0, top - tip[2]);
        return ball() ? radius - std::max(0.0, tip[2] + radius - top) : std::min(radius, top - tip[2]);
    }
};

/// A piece of a motion.
struct Piece {
    Piece(const Point3& from, const Point3& to)
        : a(from), b(to), lowest(std::min(from[2], to[2])), way(from, to) {}
    Point3 a, b;
    double lowest;
    WayInPlan way;
};

/// Whether a box or facet, whose highest point is given, can be deeper than `depth` in the cutter.
template <class Shape>
bool near(const Cutter& cutter, const Piece& piece, const Shape& shape, double highest, double depth) {
    const double reach = cutter.radius - depth + kHair, z = std::min(highest, cutter.top);
    if (cutter.tapers())
        return depth_within(cutter.under, std::sqrt(piece.way.distance2(shape)), z - piece.lowest) + kHair >
               depth;
    if (!cutter.ball()) return z - piece.lowest > depth && piece.way.distance2(shape) < reach * reach;
    const double dz = std::max(0.0, piece.lowest + cutter.radius - z);
    return piece.way.distance2(shape) + dz * dz < reach * reach;
}

/// As meet(). A bull-nose is what is no farther than its corner from its core, a cylinder that begins that
/// much higher.
void meet_bull_nose(const Cutter& cutter, const Piece& piece, const std::array<Vec3f, 3>& facet,
                    Penetration& result) {
    const double corner = cutter.corner, disc = cutter.radius - corner;
    Point3 a = piece.a, b = piece.b;
    a[2] += corner, b[2] += corner;
    below(facet, cutter.top, [&](const Triangle& t) {
        if (result.depth < corner) {
            const Closest c = disc_piece_distance(a, b, disc, t, corner - result.depth);
            if (corner - c.d > result.depth) result = {corner - c.d, between(piece.a, piece.b, c.t), true};
            if (c.d > 0) return;
        }
        Polygon poly;
        poly.n = 3;
        for (std::size_t k = 0; k < 3; ++k) poly.p[k] = t[k];
        const Deepest d = piece_depth(a, b, poly, disc, result.depth - corner);
        if (corner + d.depth > result.depth)
            result = {corner + d.depth, between(piece.a, piece.b, d.t), true};
    });
}

/// As meet().
void meet_tapered(const Cutter& cutter, const Piece& piece, const std::array<Vec3f, 3>& facet,
                  Penetration& result) {
    below(facet, cutter.top, [&](const Triangle& t) {
        const Deepest d = revolved_piece_depth(piece.a, piece.b, t, cutter.under, result.depth);
        if (d.depth > result.depth) result = {d.depth, between(piece.a, piece.b, d.t), true};
    });
}

/// Raises the result by what one facet adds to it on one piece.
void meet(const Cutter& cutter, const Piece& piece, const std::array<Vec3f, 3>& facet, Penetration& result) {
    if (!near(cutter, piece, facet, std::max({facet[0].z, facet[1].z, facet[2].z}), result.depth)) return;
    if (cutter.form == CutterForm::bull_nose) return meet_bull_nose(cutter, piece, facet, result);
    if (cutter.tapers()) return meet_tapered(cutter, piece, facet, result);
    if (cutter.ball()) {
        Point3 a = piece.a, b = piece.b;
        a[2] += cutter.radius;
        b[2] += cutter.radius;
        below(facet, cutter.top, [&](const Triangle& t) {
            const Closest c = piece_distance(a, b, t, cutter.radius - result.depth);
            if (cutter.radius - c.d > result.depth)
                result = {cutter.radius - c.d, between(piece.a, piece.b, c.t), true};
        });
        return;
    }
    Polygon poly;
    poly.n = 3;
    int under = 0;
    for (int k = 0; k < 3; ++k) {
        poly.p[k] = to_double(facet[k]);
        under += facet[k].z < cutter.top;
    }
    if (under == 0) return;
    if (under < 3) poly = clip_z(poly, cutter.top, false);
    const Deepest d = piece_depth(piece.a, piece.b, poly, cutter.radius, result.depth);
    if (d.depth > result.depth) result = {d.depth, between(piece.a, piece.b, d.t), true};
}

/// One motion. @param covered whether there is part just under the layer's top at a place @param look raises
/// the result by what is near a piece
template <class Covered, class Look>
Penetration motion_depth(const Cutter& cutter, const Point3& from, const Point3& to, double at_least,
                         Covered&& covered, Look&& look) {
    if (cutter.radius <= at_least || std::min(from[2], to[2]) >= cutter.top - at_least)
        return {0, from, false};
    Penetration result{at_least, from, false};
    const int pieces = cutter.pieces(from, to);
    auto under_cap = [&](const Point3& tip) {
        const double depth = cutter.under_cap(tip);
        if (depth > result.depth && covered(tip)) result = {depth, tip, true};
    };
    under_cap(from);
    Point3 a = from;
    for (int i = 0; i < pieces && result.depth < cutter.radius; ++i) {
        const Point3 b = i + 1 == pieces ? to : between(from, to, static_cast<double>(i + 1) / pieces);
        under_cap(b);
        if (std::min(a[2], b[2]) < cutter.top - result.depth) look(Piece(a, b), result);
        a = b;
    }
    if (!result.found) result.depth = 0;
    return result;
}

}  // namespace

Penetration StandingPart::depth_under(const Envelope& shape, double z_top, const Point3& from,
                                      const Point3& to, double at_least) const {
    const Cutter cutter(shape, z_top - kSheet);
    return motion_depth(
        cutter, from, to, at_least, [&](const Point3& tip) { return covered(tip[0], tip[1], cutter.top); },
        [&](const Piece& piece, Penetration& result) {
            walk(
                [&](const Node& n) {
                    return n.z0 < cutter.top && near(cutter, piece, n, n.z1, result.depth);
                },
                [&](const Facet& f) { meet(cutter, piece, f.v, result); });
        });
}

/// A stretch of a row of motions, or one piece, taken as one straight way that nothing of it is far from, and
/// the facets it may meet.
struct StandingPart::Stretch {
    static constexpr std::size_t kLong = 512, kShort = 12, kCalm = 8;  // motions; stretches
    static constexpr double kLength = 2.5, kSlack = 0.2;               // mm: of short ones
    static constexpr double kBow = 0.5;                                // mm: of what runs along a circle
    static constexpr std::size_t kFew = 32;  // facets: a long one that meets more is taken in parts

    std::size_t first = 0, last = 0;
    Point3 from{}, to{};   // the way
    Point3 low{}, high{};  // of the tip
    double slack = 0;      // mm: nothing is farther from the way
    NearFacets terms;
    std::vector<std::uint32_t> facets;  // in the order of the tree
    std::optional<LevelWay> arc;        // along a circle

    void take(const Point3& a, const Point3& b) {
        from = a;
        to = b;
        arc.reset();
        slack = 0;
        for (std::size_t k = 0; k < 3; ++k) low[k] = std::min(a[k], b[k]), high[k] = std::max(a[k], b[k]);
    }
    /// Motions [begin, end), each of which begins where the one before ends. @param flat the way is level, so
    /// that what is over it is no slack
    void take(std::span<const Motion> motions, std::size_t begin, std::size_t end, bool flat) {
        first = begin;
        last = end;
        take(motions[begin].from, motions[end - 1].to);
        Point3 a = from, b = to;
        if (flat) a[2] = b[2] = 0;
        for (std::size_t m = begin; m + 1 < end; ++m) {
            Point3 p = motions[m].to;
            for (std::size_t k = 0; k < 3; ++k)
                low[k] = std::min(low[k], p[k]), high[k] = std::max(high[k], p[k]);
            if (flat) p[2] = 0;
            const Point3 off = minus(p, closest_on_segment(p, a, b));
            slack = std::max(slack, dot(off, off));
        }
        // The distance from the way is convex, so that a motion is nowhere farther from it than where it
        // begins or ends.
        if (slack > 0) slack = std::sqrt(slack) + kHair;
        if (flat && end - begin > 1) sink();
    }
    /// Takes all as if it was as low as its lowest point.
    void sink() { from[2] = to[2] = low[2]; }
};

// Written with vectors of eight, as overlapping() is.
SLABWRIGHT_WIDE void StandingPart::around(const ManyNodes& many, const WayAround& way, const Within& box,
                                          unsigned* __restrict kept) {
    const WayAround w = way;
    const Floats8 none{}, top = none + w.top;
    const Floats8 low_x = none + box.low[0], low_y = none + box.low[1], low_z = none + box.low[2];
    const Floats8 high_x = none + box.high[0], high_y = none + box.high[1], high_z = none + box.high[2];
    const float sx = std::abs(w.ux), sy = std::abs(w.uy);
    for (std::size_t i = 0; i < many.count; ++i) {
        const Nodes& n = *many.eights[i];
        Floats8 x0, y0, z0, x1, y1, z1;
        std::memcpy(&x0, n.x0.data(), sizeof(Floats8)), std::memcpy(&y0, n.y0.data(), sizeof(Floats8)),
            std::memcpy(&z0, n.z0.data(), sizeof(Floats8));
        std::memcpy(&x1, n.x1.data(), sizeof(Floats8)), std::memcpy(&y1, n.y1.data(), sizeof(Floats8)),
            std::memcpy(&z1, n.z1.data(), sizeof(Floats8));
        const Ints8 within =
            (x0 <= high_x) & (low_x <= x1) & (y0 <= high_y) & (low_y <= y1) & (z0 <= high_z) & (low_z <= z1);
        const Floats8 hx = (x1 - x0) * 0.5F, hy = (y1 - y0) * 0.5F, cx = (x1 + x0) * 0.5F - w.ax,
                      cy = (y1 + y0) * 0.5F - w.ay;
        const Floats8 along = cx * w.ux + cy * w.uy, aside = cy * w.ux - cx * w.uy,
                      across = aside > none ? aside : -aside;
        const Floats8 before = -along - (hx * sx + hy * sy), behind = along - w.length - (hx * sx + hy * sy),
                      beside = across - (hx * sy + hy * sx);
        Floats8 l = before > behind ? before : behind, high = z1 < top ? z1 : top, under = w.lowest - high;
        l = l > none ? l : none;
        under = under > none ? under : none;
        const Floats8 c = beside > none ? beside : none, u = under * w.upwards;
        const Ints8 signs =
            within & (z0 < top) & (z1 > none + w.above) & (l * l + c * c + u * u < none + w.reach2);
        const Ints8 own{1, 2, 4, 8, 16, 32, 64, 128}, bits = signs & own;
        std::array<std::uint64_t, 4> pairs;
        std::memcpy(pairs.data(), &bits, sizeof(pairs));
        const std::uint64_t all = pairs[0] | pairs[1] | pairs[2] | pairs[3];
        kept[i] = static_cast<unsigned>(all | all >> 32);
    }
}

namespace {
/// The way of a cutter that is asked for depths above `depth`. @param lowest of the tip
NearWay asking(const Cutter& cutter, const Point3& from, const Point3& to, double lowest, double depth,
               double slack) {
    const double reach = cutter.radius - depth + kHair, up = cutter.ball() ? cutter.radius : depth;
    return {{from[0], from[1], from[2] + up},
            {to[0], to[1], to[2] + up},
            reach,
            lowest + (cutter.ball() ? cutter.radius - reach : depth),
            slack};
}
}  // namespace

/// What finding the facets of a stretch needs, and what is known of the row so far.
struct StandingPart::Search {
    Cutter cutter{};
    std::vector<unsigned char> keep;
    std::size_t
        many = Stretch::kShort,
        calm =
            0;  // motions that the next stretch takes if they are free; free stretches before it takes more
    std::span<const Chords> arcs;  // that have not ended
};

/// Finds the facets that a stretch may be deeper than `depth` in. @return false when they would be more than
/// `most`: they are not all found then
bool StandingPart::gather(Search& search, Stretch& s, double depth, std::size_t most) const {
    const Cutter& cutter = search.cutter;
    // What begins or ends above the layer's top: what is far from it when sunk has no outline of the cap
    // anywhere above or below it.
    if (s.high[2] >= cutter.top - depth) s.sink();
    const Point3 &from = s.from, &to = s.to;
    const NearWay way = asking(cutter, from, to, s.low[2], depth, s.slack);
    const double length = std::hypot(to[0] - from[0], to[1] - from[1]);
    double largest = length + std::max({std::abs(from[0]), std::abs(from[1]), std::abs(s.low[2])});
    for (const float v : {box_.min.x, box_.min.y, box_.min.z, box_.max.x, box_.max.y, box_.max.z})
        largest = std::max<double>(largest, std::abs(v));
    const double reach = way.reach + s.slack + 1e-5 * (largest + cutter.radius);
    const WayAround place(way, cutter.ball(), s.low[2] + (cutter.ball() ? cutter.radius : 0), cutter.top,
                          reach);
    std::optional<LevelWay> level = s.arc;
    if (!level && cutter.ball() && way.a[2] == way.b[2])
        level.emplace(way.a, way.b, cutter.top, way.reach + s.slack);
    const double lowest = s.low[2] + (cutter.ball() ? cutter.radius : depth);
    const Within box(
        {s.low[0] - way.reach, s.low[1] - way.reach, cutter.ball() ? lowest - way.reach : lowest},
        {s.high[0] + way.reach, s.high[1] + way.reach, cutter.top});
    s.terms.place(s.low, s.high, way.reach, cutter.ball(), cutter.top, cutter.ball() ? cutter.radius : depth);
    s.facets.clear();
    ManyEights many;
    FacetRows close;
    std::array<std::uint32_t, ManyEights::kMost> first_of;
    std::array<unsigned, ManyEights::kMost> met;
    std::array<std::uint32_t, FacetRows::kMost> which;
    std::size_t some = 0;
    const bool closely = s.slack == 0 || most == Stretch::kFew;
    bool all = true;
    auto look = [&] {
        if (level) s.terms.add(close, some, search.keep);
        else s.terms.add(close, some, way, closely, search.keep);
        for_each_kept(search.keep, [&](std::size_t k) { s.facets.push_back(which[k]); });
        some = 0;
        all = s.facets.size() <= most;
    };
    auto take = [&] {
        if (level) facets_along(many, *level, met);
        else facets_around(many, place, met);
        for (std::size_t i = 0; i < many.count; ++i)
            for_each_bit(met[i], [&](std::size_t k) {
                const EightFacets& e = *many.eights[i];
                close.x0[some] = e.x0[k];
                close.y0[some] = e.y0[k];
                close.z0[some] = e.z0[k];
                close.x1[some] = e.x1[k];
                close.y1[some] = e.y1[k];
                close.z1[some] = e.z1[k];
                close.x2[some] = e.x2[k];
                close.y2[some] = e.y2[k];
                close.z2[some] = e.z2[k];
                which[some++] = first_of[i] + static_cast<std::uint32_t>(k);
                if (some == FacetRows::kMost) look();
            });
        many.count = 0;
    };
    walk_leaves(
        [&](const ManyNodes& nodes, auto& kept) {
            if (all) around(nodes, place, box, kept.data());
            else kept.fill(0);
        },
        [&](std::size_t first, std::size_t) {
            static_assert(kFan == 8);
            if (!all) return;
            first_of[many.count] = static_cast<std::uint32_t>(first);
            expect(facets_.eight(first / kFan));
            many.eights[many.count++] = &facets_.eight(first / kFan);
            if (many.count == ManyEights::kMost) take();
        });
    if (many.count > 0 && all) take();
    if (some > 0 && all) look();
    return all;
}

/// Finds a stretch of chords of one circle that begins with a motion, and its facets. @return false when
/// there is none
bool StandingPart::arc_from(Search& search, Stretch& s, std::span<const Motion> motions, std::size_t m,
                            double depth) const {
    while (!search.arcs.empty() && search.arcs.front().last <= m) search.arcs = search.arcs.subspan(1);
    if (search.arcs.empty() || search.arcs.front().first > m) return false;
    const Chords& arc = search.arcs.front();
    const Point3& from = motions[m].from;
    const double z = from[2], chord = std::hypot(motions[m].to[0] - from[0], motions[m].to[1] - from[1]);
    // Parts of about one length that are not too far from straight.
    const double most = std::sqrt(8 * Stretch::kBow * arc.radius) / std::max(chord, kHair);
    const std::size_t left = arc.last - m, parts = static_cast<std::size_t>(std::ceil(
                                               static_cast<double>(left) / std::clamp(most, 2.0, 1e6)));
    const std::size_t last = m + (left + parts - 1) / parts;
    // Where the ends of a chord are from the centre, all of it is no farther than the one and no nearer than
    // the other, less what the chord bows.
    double nearest = std::hypot(from[0] - arc.x, from[1] - arc.y), farthest = nearest, longest2 = 0;
    for (std::size_t k = m; k < last; ++k) {
        const Point3 &a = motions[k].from, &b = motions[k].to;
        if (b[2] != z || (k > m && a != motions[k - 1].to)) return false;
        const double dx = b[0] - a[0], dy = b[1] - a[1], x = b[0] - arc.x, y = b[1] - arc.y,
                     r = std::sqrt(x * x + y * y);
        nearest = std::min(nearest, r);
        farthest = std::max(farthest, r);
        longest2 = std::max(longest2, dx * dx + dy * dy);
    }
    nearest = std::sqrt(std::max(0.0, nearest * nearest - longest2 / 4));
    const double off = std::max(farthest - arc.radius, arc.radius - nearest);
    if (!(off < Stretch::kBow && nearest > 0)) return false;
    s.take(motions, m, last, false);
    Point3 about = motions[(m + last) / 2].from;
    const double r = std::hypot(about[0] - arc.x, about[1] - arc.y), tx = (arc.y - about[1]) / r,
                 ty = (about[0] - arc.x) / r;
    double before = 0, after = 0, bow = off;
    const auto extend = [&](const Point3& p) {
        const double x = p[0] - about[0], y = p[1] - about[1], along = x * tx + y * ty;
        before = std::max(before, -along);
        after = std::max(after, along);
        bow = std::max(bow, y * tx - x * ty + off);
    };
    for (std::size_t k = m; k < last; ++k) extend(motions[k].to);
    extend(from);
    about[2] += search.cutter.radius;
    s.arc.emplace(arc.x, arc.y, arc.radius, about, before, after, bow, search.cutter.top,
                  search.cutter.radius - depth + off + kHair);
    gather(search, s, depth, std::numeric_limits<std::size_t>::max());
    return true;
}

/// Finds a stretch that begins with a motion: as many as are free of the part, or a short one and its facets;
/// or one motion whose pieces are to be looked at one by one, and returns false.
bool StandingPart::stretch_from(Search& search, Stretch& s, std::span<const Motion> motions, std::size_t m,
                                double depth) const {
    if (arc_from(search, s, motions, m, depth)) return true;
    const double top = search.cutter.top - depth;
    const bool flat = !search.cutter.ball();
    const std::size_t end = search.arcs.empty() ? motions.size() : std::max(m + 1, search.arcs.front().first);
    std::size_t last = m, short_last = m + 1;
    double length = 0;
    for (; last < end && last - m < std::max(search.many, Stretch::kShort); ++last) {
        const Motion& next = motions[last];
        if (std::min(next.from[2], next.to[2]) >= top || (last > m && next.from != motions[last - 1].to))
            break;
        const Point3 way = minus(next.to, next.from);
        length += std::sqrt(dot(way, way));
        if (length <= Stretch::kLength && last - m < Stretch::kShort) short_last = last + 1;
        else if (last - m >= search.many) break;
    }
    const Point3 own = minus(motions[m].to, motions[m].from);
    const bool whole = own[0] * own[0] + own[1] * own[1] <= kSpan * kSpan;
    if (last > short_last || !whole) {
        s.take(motions, m, last, flat);
        if (gather(search, s, depth, Stretch::kFew)) {
            if (!s.facets.empty()) search.many = std::max<std::size_t>(1, search.many / 2);
            else if (search.calm > 0) --search.calm;
            else search.many = std::min(2 * search.many, Stretch::kLong);
            return true;
        }
        search.many = std::max<std::size_t>(1, (last - m) / 4);
        search.calm = Stretch::kCalm;
        if (!whole) {
            s.take(motions, m, m + 1, flat);
            return false;
        }
    }
    for (last = short_last;; last = m + (last - m) / 2) {
        s.take(motions, m, last, flat);
        if (s.slack <= Stretch::kSlack) break;
    }
    gather(search, s, depth, std::numeric_limits<std::size_t>::max());
    if (!s.facets.empty()) return true;
    if (search.calm > 0) --search.calm;
    else search.many = std::min(2 * std::max(search.many, last - m), Stretch::kLong);
    return true;
}

StandingPart::Found StandingPart::deepest_under(const Envelope& shape, double z_top,
                                                std::span<const Motion> motions, double ignore,
                                                double tolerance, std::atomic<double>* known,
                                                std::span<const Chords> chords) const {
    Found found;
    Search search;
    const Cutter& cutter = search.cutter = Cutter(shape, z_top - kSheet);
    if (cutter.ball()) search.arcs = chords;
    std::vector<unsigned char>& keep = search.keep;
    Stretch stretch, single;
    bool whole = true;  // the stretch's facets are known
    Point3 last{};      // the end of one motion is mostly the begin of the next
    bool last_known = false, last_covered = false;
    auto covered_at = [&](const Point3& tip) {
        if (last_known && last == tip) return last_covered;
        last = tip;
        last_known = true;
        return last_covered = covered(tip[0], tip[1], cutter.top);
    };
    auto meet_near = [&](const NearFacets& terms, const std::vector<std::uint32_t>& facets,
                         const Piece& piece, Penetration& result) {
        if (facets.size() <= 4) {
            for (const std::uint32_t f : facets) meet(cutter, piece, facets_[f].v, result);
            return;
        }
        terms.near(asking(cutter, piece.a, piece.b, piece.lowest, result.depth, 0), true, keep);
        for_each_kept(keep, [&](std::size_t k) { meet(cutter, piece, facets_[facets[k]].v, result); });
    };
    for (std::size_t m = 0; m < motions.size();) {
        // Only what is deeper than all before can change the maximum; but every motion beyond the tolerance
        // is to be found. Of equal ones in other rows this may be the first.
        const double deep =
            std::max(found.most.depth, known ? known->load(std::memory_order_relaxed) - kEqual : 0.0);
        const double floor = std::max(ignore, std::min(deep, tolerance));
        const auto& [from, to] = motions[m];
        if (cutter.radius <= floor || std::min(from[2], to[2]) >= cutter.top - floor) {
            ++m;
            continue;
        }
        if (m >= stretch.last) whole = stretch_from(search, stretch, motions, m, floor);
        // Where no facet is near, the cap has no outline either, so that what begins beside it stays there.
        auto free_until = [&](std::size_t end) { m = end, last = motions[end - 1].to, last_covered = false; };
        if (whole && stretch.facets.empty() && !covered_at(from)) {
            free_until(stretch.last);
            continue;
        }
        const bool below = stretch.high[2] < cutter.top - floor;
        auto look = [&](const Piece& piece, Penetration& result) {
            if (!whole) {
                single.take(piece.a, piece.b);
                gather(search, single, result.depth, std::numeric_limits<std::size_t>::max());
                for (const std::uint32_t f : single.facets) meet(cutter, piece, facets_[f].v, result);
            } else meet_near(stretch.terms, stretch.facets, piece, result);
        };
        Penetration p;
        if (below && !covered_at(from)) {
            p = motion_depth(
                cutter, from, to, floor, [](const Point3&) { return false; }, look);
            if (!p.found) {
                free_until(m + 1);
                continue;
            }
        }
        p = motion_depth(cutter, from, to, floor, covered_at, look);
        if (p.found && p.depth > found.most.depth) {
            found.most = p;
            found.motion = m;
            if (known)
                for (double most = known->load(std::memory_order_relaxed); p.depth > most;)
                    if (known->compare_exchange_weak(most, p.depth, std::memory_order_relaxed)) break;
        }
        if (p.found && p.depth > tolerance) found.beyond.push_back(static_cast<std::uint32_t>(m));
        ++m;
    }
    return found;
}

}  // namespace slabwright
