#include "kernels/access/standing_part.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <tuple>

#include "kernels/access/near_facets.h"
#include "kernels/geometry/triangle.h"
#include "kernels/geometry/wide.h"
#include "kernels/mesh/morton.h"
#include "kernels/mesh/raw_array.h"
#include "kernels/parallel/deal.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr std::size_t kFan = 8;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kHair = 1e-9;   // mm: rounding of a bound
constexpr double kEqual = 1e-6;  // mm: depths that differ by less may be the same

/// A convex polygon of at most five corners: a triangle cut by two horizontal planes.
struct Polygon {
    std::array<Point3, 8> p;
    int n = 0;
};

Polygon clip_z(const Polygon& in, double z, bool keep_above) {
    Polygon out;
    for (int i = 0; i < in.n; ++i) {
        const Point3 &a = in.p[i], &b = in.p[(i + 1) % in.n];
        const double da = keep_above ? a[2] - z : z - a[2], db = keep_above ? b[2] - z : z - b[2];
        if (da >= 0) out.p[out.n++] = a;
        if ((da < 0) != (db < 0)) {
            Point3 c = between(a, b, da / (da - db));
            c[2] = z;
            out.p[out.n++] = c;
        }
    }
    return out;
}

double distance_2d(Vec2d p, Vec2d a, Vec2d b) {
    const double dx = b.x - a.x, dy = b.y - a.y, l = dx * dx + dy * dy;
    const double t = l > 0 ? std::clamp(((p.x - a.x) * dx + (p.y - a.y) * dy) / l, 0.0, 1.0) : 0.0;
    const double ex = p.x - a.x - t * dx, ey = p.y - a.y - t * dy;
    return std::sqrt(ex * ex + ey * ey);
}

double cross_2d(Vec2d a, Vec2d b, Vec2d c) { return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x); }

bool segments_cross(Vec2d a, Vec2d b, Vec2d c, Vec2d d) {
    const double s1 = cross_2d(a, b, c), s2 = cross_2d(a, b, d), s3 = cross_2d(c, d, a),
                 s4 = cross_2d(c, d, b);
    return ((s1 > 0) != (s2 > 0)) && ((s3 > 0) != (s4 > 0));
}

bool contains_2d(const Polygon& poly, Vec2d q) {
    // The box first: on a polygon seen edge-on all signs below are rounding, and could agree far along its
    // line.
    double x0 = kInfinity, x1 = -kInfinity, y0 = kInfinity, y1 = -kInfinity;
    for (int i = 0; i < poly.n; ++i) {
        x0 = std::min(x0, poly.p[i][0]), x1 = std::max(x1, poly.p[i][0]);
        y0 = std::min(y0, poly.p[i][1]), y1 = std::max(y1, poly.p[i][1]);
    }
    if (q.x < x0 || q.x > x1 || q.y < y0 || q.y > y1) return false;
    int turn = 0;
    for (int i = 0; i < poly.n; ++i) {
        const Point3 &a = poly.p[i], &b = poly.p[(i + 1) % poly.n];
        const double s = cross_2d({a[0], a[1]}, {b[0], b[1]}, q);
        if (s == 0) continue;
        if (turn != 0 && (s > 0) != (turn > 0)) return false;
        turn = s > 0 ? 1 : -1;
    }
    return turn != 0;  // a polygon seen edge-on has no inside; its edges are measured
}

/// Horizontal distance between a segment (or a point) and a convex polygon; infinite for an empty one.
double distance_2d(const Polygon& poly, Vec2d a, Vec2d b) {
    if (poly.n == 0) return kInfinity;
    // Points exactly on an edge line give s == 0 for one edge only, which contains_2d tolerates: their
    // distance is 0 or is measured against the edges anyway.
    if (poly.n >= 3 && contains_2d(poly, a)) {
        double area = 0;
        for (int i = 1; i + 1 < poly.n; ++i)
            area += cross_2d({poly.p[0][0], poly.p[0][1]}, {poly.p[i][0], poly.p[i][1]},
                             {poly.p[i + 1][0], poly.p[i + 1][1]});
        if (area != 0) return 0;
    }
    const bool moving = a.x != b.x || a.y != b.y;
    double best = kInfinity;
    for (int i = 0; i < poly.n; ++i) {
        const Vec2d c{poly.p[i][0], poly.p[i][1]},
            d{poly.p[(i + 1) % poly.n][0], poly.p[(i + 1) % poly.n][1]};
        best = std::min(best, distance_2d(a, c, d));
        if (moving) {
            if (segments_cross(a, b, c, d)) return 0;
            best = std::min({best, distance_2d(b, c, d), distance_2d(c, a, b)});
        }
    }
    return best;
}

/// Distance between a point's upward ray and a triangle, and its vector (from triangle to ray), whose z is
/// never negative. Over the triangle both the distance from the point and that from the ray are convex, and
/// they have one gradient where the triangle is not above the point: if the nearest point to the point lies
/// there, it is the nearest to the ray too. Otherwise the nearest to the ray is as high as the point or
/// higher, and is measured horizontally.
struct RayDistance {
    double d;
    Point3 vector;
};
RayDistance ray_distance(const Point3& c, const Triangle& t) {
    const Point3 q = closest_on_triangle(c, t);
    if (q[2] <= c[2]) {
        const Point3 v = minus(c, q);
        return {std::sqrt(dot(v, v)), v};
    }
    Polygon poly;
    poly.n = 3;
    for (int i = 0; i < 3; ++i) poly.p[i] = t[i];
    poly = clip_z(poly, c[2], true);
    if (poly.n == 0) {  // q is above by rounding only
        const Point3 v{c[0] - q[0], c[1] - q[1], 0};
        return {std::sqrt(dot(v, v)), v};
    }
    const Vec2d a{c[0], c[1]};
    if (distance_2d(poly, a, a) == 0) return {0, {0, 0, 0}};
    double best = kInfinity;
    Point3 v{};
    for (int i = 0; i < poly.n; ++i) {
        Point3 s = poly.p[i], e = poly.p[(i + 1) % poly.n], from = c;
        s[2] = e[2] = from[2] = 0;
        const Point3 w = minus(from, closest_on_segment(from, s, e));
        const double d = dot(w, w);
        if (d < best) best = d, v = w;
    }
    return {std::sqrt(best), v};
}

/// Calls fn(triangle) for the parts of a facet below z (one or two triangles), none when no corner lies
/// below.
template <class Fn>
void below(const std::array<Vec3f, 3>& facet, double z, Fn&& fn) {
    int under = 0;
    for (const Vec3f& v : facet) under += v.z < z;
    if (under == 0) return;
    if (under == 3 || (facet[0].z <= z && facet[1].z <= z && facet[2].z <= z)) {
        fn(Triangle{to_double(facet[0]), to_double(facet[1]), to_double(facet[2])});
        return;
    }
    Polygon poly;
    poly.n = 3;
    for (int i = 0; i < 3; ++i) poly.p[i] = to_double(facet[i]);
    poly = clip_z(poly, z, false);
    for (int i = 1; i + 1 < poly.n; ++i) fn(Triangle{poly.p[0], poly.p[i], poly.p[i + 1]});
}

/// Least distance over the piece from a to b (ray starts) to a triangle, and where; looks only for less than
/// `limit`. The distance to a convex set is convex along a line: tangents at both ends of a bracket bound it
/// from below, their crossing is the next place to try (Kelley's cutting planes in one dimension).
struct Closest {
    double d;
    double t;
};
Closest piece_distance(const Point3& a, const Point3& b, const Triangle& tri, double limit) {
    const Point3 along = minus(b, a);
    const double length = std::sqrt(dot(along, along));
    struct Sample {
        double t, d, g;
    };
    auto at = [&](double t) {
        const RayDistance r = ray_distance(between(a, b, t), tri);
        return Sample{t, r.d, r.d > 0 ? dot(r.vector, along) / r.d : 0};
    };
    const Sample mid = at(0.5);
    if (mid.d - length / 2 >= limit || mid.g == 0 || length == 0) return {mid.d, 0.5};
    if (mid.d - std::abs(mid.g) / 2 >= limit) return {mid.d, 0.5};
    Sample l = mid, r = mid;
    if (mid.g > 0) {
        l = at(0);
        if (l.g >= 0) return {l.d, 0};
    } else {
        r = at(1);
        if (r.g <= 0) return {r.d, 1};
    }
    for (int i = 0; i < 60; ++i) {
        const Sample& best = l.d <= r.d ? l : r;
        double t = (r.d - l.d + l.g * l.t - r.g * r.t) / (l.g - r.g);
        const double bound = l.d + l.g * (t - l.t);
        if (!(bound < limit) || best.d - bound <= StandingPart::kNumericalError) break;
        // A crossing at an end would not shorten the bracket.
        const double margin = 1e-3 * (r.t - l.t);
        t = std::clamp(t, l.t + margin, r.t - margin);
        const Sample m = at(t);
        if (m.g == 0) return {m.d, m.t};
        (m.g > 0 ? r : l) = m;
    }
    return l.d <= r.d ? Closest{l.d, l.t} : Closest{r.d, r.t};
}

/// Largest min(radius − r, z − tip) over a triangle and a piece of the tip's way, if above `best`.
struct Deepest {
    double depth;
    double t;
};
Deepest piece_depth(const Point3& a, const Point3& b, const Polygon& tri, double radius, double best) {
    double top = -kInfinity;
    for (int i = 0; i < tri.n; ++i) top = std::max(top, tri.p[i][2]);
    auto reaches = [&](const Point3& s, const Point3& e, double tip, double depth) {
        return distance_2d(clip_z(tri, tip + depth, true), {s[0], s[1]}, {e[0], e[1]}) <= radius - depth;
    };
    // The largest depth reached with the tip at one height, while its axis is anywhere between s and e.
    auto deepest_at = [&](const Point3& s, const Point3& e, double tip, double floor) {
        double low = floor, high = std::min(radius, top - tip);
        if (high <= low) return floor;
        if (reaches(s, e, tip, high)) return high;
        while (high - low > StandingPart::kNumericalError / 4) {
            const double m = (low + high) / 2;
            (reaches(s, e, tip, m) ? low : high) = m;
        }
        return low;
    };
    const double lowest = std::min(a[2], b[2]);
    const double enough = best + StandingPart::kNumericalError;
    if (std::min(radius, top - lowest) <= enough || !reaches(a, b, lowest, enough)) return {best, 0};
    if (a[2] == b[2]) {
        const double depth = deepest_at(a, b, lowest, best);
        if (depth <= best) return {best, 0};
        // The place along the piece: the axis there is nearest to what stands above the cylinder's shrunken
        // floor.
        const Polygon above = clip_z(tri, lowest + depth, true);
        double low = 0, high = 1;
        for (int i = 0; i < 40; ++i) {
            const double m1 = low + (high - low) / 3, m2 = high - (high - low) / 3;
            const Point3 p = between(a, b, m1), q = between(a, b, m2);
            if (distance_2d(above, {p[0], p[1]}, {p[0], p[1]}) <=
                distance_2d(above, {q[0], q[1]}, {q[0], q[1]}))
                high = m2;
            else low = m1;
        }
        return {depth, (low + high) / 2};
    }
    // A ramp or plunge: the depth is concave along the way, so a search by thirds finds its maximum.
    auto depth_at = [&](double t) {
        const Point3 p = between(a, b, t);
        return deepest_at(p, p, p[2], std::min(0.0, best) - 2 * (StandingPart::kPiece + 1));
    };
    double low = 0, high = 1;
    for (int i = 0; i < 50; ++i) {
        const double m1 = low + (high - low) / 3, m2 = high - (high - low) / 3;
        if (depth_at(m1) >= depth_at(m2)) high = m2;
        else low = m1;
    }
    Deepest result{best, 0};
    for (const double t : {0.0, (low + high) / 2, 1.0}) {
        const double d = depth_at(t);
        if (d > result.depth) result = {d, t};
    }
    return result;
}

/// Whether the mesh is known to close: every edge is gone along as often one way as the other, so that the
/// facets together wind around nothing.
bool closes(Context& context, MeshView mesh) {
    if (mesh.neighbours.size() != mesh.size()) return false;
    return parallel_reduce(
        context, mesh.size(), 1 << 14, true,
        [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i)
                for (std::size_t k = 0; k < 3; ++k)
                    if (mesh.neighbours[i][k] == kNoFacet && mesh.facets[i][k] != mesh.facets[i][(k + 1) % 3])
                        return false;
            return true;
        },
        [](bool a, bool b) { return a && b; });
}

}  // namespace

void StandingPart::Facets::set(std::size_t i, const Facet& facet) {
    EightFacets& e = eights_[i / 8];
    const std::size_t k = i % 8;
    const auto& [a, b, c] = facet.v;
    e.x0[k] = a.x, e.y0[k] = a.y, e.z0[k] = a.z, e.x1[k] = b.x, e.y1[k] = b.y, e.z1[k] = b.z, e.x2[k] = c.x,
    e.y2[k] = c.y, e.z2[k] = c.z;
}

void StandingPart::Facets::end() {
    constexpr float none = std::numeric_limits<float>::quiet_NaN();
    for (std::size_t i = size_; i < 8 * eights_.size(); ++i)
        set(i, {{Vec3f{none, none, none}, {none, none, none}, {none, none, none}}});
}

StandingPart::StandingPart(Context& context, MeshView mesh) {
    const std::size_t n = mesh.size();
    box_ = bounds(context, mesh);
    closed_ = closes(context, mesh);
    const MortonGrid grid(box_);
    // A key is as much of the Morton number as fits beside the facet's own.
    const unsigned facet_bits = static_cast<unsigned>(std::bit_width(std::max<std::size_t>(n, 1))),
                   drop = facet_bits - 1;  // of the number's 63 bits
    constexpr unsigned part_bits = 12;
    auto key_of = [&](std::size_t i) {
        const Index3& f = mesh.facets[i];
        const Vec3f &a = mesh.vertices[f[0]], &b = mesh.vertices[f[1]], &c = mesh.vertices[f[2]];
        auto middle = [](float u, float v, float w) { return (double{u} + v + w) / 3; };
        return grid.code(middle(a.x, b.x, c.x), middle(a.y, b.y, c.y), middle(a.z, b.z, c.z)) >>
                   drop << facet_bits |
               i;
    };
    auto part_of = [](std::uint64_t key) { return static_cast<std::size_t>(key >> (64 - part_bits)); };
    RawArray<std::uint64_t> keys(n), in_order(n);  // sorted, and as the facets come
    deal(
        context, n, std::max<std::size_t>(1 << 14, (n + 63) / 64), std::size_t{1} << part_bits,
        [&](std::size_t begin, std::size_t end, auto&& take) {
            for (std::size_t i = begin; i < end; ++i) take(part_of(in_order[i] = key_of(i)));
        },
        [&](std::size_t begin, std::size_t end, auto&& take) {
            for (std::size_t i = begin; i < end; ++i) take(part_of(in_order[i]), in_order[i]);
        },
        [&](std::uint64_t, std::uint64_t) { return std::pair(keys.data(), std::uint64_t{n}); },
        [&](std::size_t first, std::size_t last, std::span<const std::uint32_t> starts) {
            parallel_for(context, last - first, 8, [&](std::size_t begin, std::size_t end) {
                for (std::size_t i = begin; i < end; ++i)
                    std::sort(keys.data() + starts[i], keys.data() + starts[i + 1]);
            });
        });
    in_order = {};
    const std::uint64_t facet_mask = (std::uint64_t{1} << facet_bits) - 1;
    facets_.resize(n);
    parallel_for(context, n, 1 << 14, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            const Index3& f = mesh.facets[keys[i] & facet_mask];
            facets_.set(i, {{mesh.vertices[f[0]], mesh.vertices[f[1]], mesh.vertices[f[2]]}});
        }
    });
    facets_.end();
    auto join = [](Node& a, const Node& b) {
        a.x0 = std::min(a.x0, b.x0), a.y0 = std::min(a.y0, b.y0), a.z0 = std::min(a.z0, b.z0);
        a.x1 = std::max(a.x1, b.x1), a.y1 = std::max(a.y1, b.y1), a.z1 = std::max(a.z1, b.z1);
    };
    std::size_t below_count = n;
    do {
        const std::size_t count = (below_count + kFan - 1) / kFan, level = levels_.size();
        levels_.emplace_back((count + kFan - 1) / kFan);
        parallel_for(context, levels_.back().size(), 1 << 10, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin * kFan; i < end * kFan; ++i) {
                constexpr float inf = std::numeric_limits<float>::infinity();
                Node node{inf, inf, inf, -inf, -inf, -inf};
                for (std::size_t k = i * kFan; k < std::min(below_count, (i + 1) * kFan); ++k) {
                    if (level == 0)
                        for (const Vec3f& v : facets_[k].v) join(node, {v.x, v.y, v.z, v.x, v.y, v.z});
                    else join(node, levels_[level - 1][k / kFan][k % kFan]);
                }
                Nodes& eight = levels_[level][i / kFan];
                const std::size_t k = i % kFan;
                eight.x0[k] = node.x0, eight.y0[k] = node.y0, eight.z0[k] = node.z0;
                eight.x1[k] = node.x1, eight.y1[k] = node.y1, eight.z1[k] = node.z1;
            }
        });
        below_count = count;
    } while (below_count > kFan);
}

StandingPart::Within::Within(const Point3& from, const Point3& to) {
    constexpr float inf = std::numeric_limits<float>::infinity();
    for (std::size_t k = 0; k < 3; ++k) {
        low[k] = static_cast<float>(from[k]), high[k] = static_cast<float>(to[k]);
        if (low[k] > from[k]) low[k] = std::nextafter(low[k], -inf);
        if (high[k] < to[k]) high[k] = std::nextafter(high[k], inf);
    }
}

// Written with vectors of eight, since compilers take such a short loop apart into smaller ones.
SLABWRIGHT_WIDE void StandingPart::overlapping(const ManyNodes& many, const Within& box,
                                               unsigned* __restrict kept) {
    const Floats8 none{}, low_x = none + box.low[0], low_y = none + box.low[1], low_z = none + box.low[2];
    const Floats8 high_x = none + box.high[0], high_y = none + box.high[1], high_z = none + box.high[2];
    for (std::size_t i = 0; i < many.count; ++i) {
        const Nodes& n = *many.eights[i];
        static_assert(sizeof(n.x0) == sizeof(Floats8));
        Floats8 x0, y0, z0, x1, y1, z1;
        std::memcpy(&x0, n.x0.data(), sizeof(Floats8)), std::memcpy(&y0, n.y0.data(), sizeof(Floats8)),
            std::memcpy(&z0, n.z0.data(), sizeof(Floats8));
        std::memcpy(&x1, n.x1.data(), sizeof(Floats8)), std::memcpy(&y1, n.y1.data(), sizeof(Floats8)),
            std::memcpy(&z1, n.z1.data(), sizeof(Floats8));
        const Ints8 signs =
            (x0 <= high_x) & (low_x <= x1) & (y0 <= high_y) & (low_y <= y1) & (z0 <= high_z) & (low_z <= z1);
        const Ints8 own{1, 2, 4, 8, 16, 32, 64, 128}, bits = signs & own;
        std::array<std::uint64_t, 4> pairs;
        std::memcpy(pairs.data(), &bits, sizeof(pairs));
        const std::uint64_t all = pairs[0] | pairs[1] | pairs[2] | pairs[3];
        kept[i] = static_cast<unsigned>(all | all >> 32);
    }
}

namespace {
/// Asks for what is looked at soon.
template <class T>
void expect(const T& what) {
    for (std::size_t byte = 0; byte < sizeof(T); byte += 64)
        __builtin_prefetch(static_cast<const char*>(static_cast<const void*>(&what)) + byte);
}
}  // namespace

/// Visits, in the order of the tree, the facets [first, last) of every node whose bit is 1 in what
/// choose(eights, kept) says of up to eight times eight nodes of one level at a time: looking at them costs
/// little more than calling for it.
template <class Choose, class Visit>
void StandingPart::walk_leaves(Choose&& choose, Visit&& visit) const {
    if (facets_.empty()) return;
    struct Waiting {  // eights of a level, ascending: all that the last look at the level above has kept
        std::size_t next, end;
        std::array<std::uint32_t, ManyNodes::kMost * kFan> eights;
    };
    constexpr std::size_t levels = 12;  // of 2³² facets: 11
    std::array<Waiting, levels> waiting;
    ManyNodes many;
    std::array<unsigned, ManyNodes::kMost> kept;
    std::size_t level = levels_.size() - 1;
    waiting[level].next = 0, waiting[level].end = 1, waiting[level].eights[0] = 0;
    while (level < levels_.size()) {
        Waiting& here = waiting[level];
        if (here.next == here.end) {
            ++level;
            continue;
        }
        const std::uint32_t* const eights = here.eights.data() + here.next;
        many.count = std::min(here.end - here.next, ManyNodes::kMost);
        here.next += many.count;
        for (std::size_t i = 0; i < many.count; ++i) many.eights[i] = &levels_[level][eights[i]];
        choose(many, kept);
        if (level == 0) {
            for (std::size_t i = 0; i < many.count; ++i)
                for_each_bit(kept[i], [&](std::size_t k) {
                    const std::size_t first = (eights[i] * kFan + k) * kFan;
                    visit(first, std::min(facets_.size(), first + kFan));
                });
            continue;
        }
        Waiting& below = waiting[--level];
        below.next = below.end = 0;
        for (std::size_t i = 0; i < many.count; ++i)
            for_each_bit(kept[i], [&](std::size_t k) {
                const std::size_t eight = eights[i] * kFan + k;
                expect(levels_[level][eight]);
                below.eights[below.end++] = static_cast<std::uint32_t>(eight);
            });
    }
}

/// The same of every node whose box enter() holds for.
template <class Enter, class Visit>
void StandingPart::walk(Enter&& enter, Visit&& visit) const {
    walk_leaves(
        [&](const ManyNodes& many, auto& kept) {
            for (std::size_t i = 0; i < many.count; ++i) {
                const Nodes& nodes = *many.eights[i];
                kept[i] = 0;
                for (unsigned k = 0; k < kFan; ++k)
                    kept[i] |= static_cast<unsigned>(nodes.x0[k] <= nodes.x1[k] && enter(nodes[k])) << k;
            }
        },
        [&](std::size_t first, std::size_t last) {
            for (std::size_t f = first; f < last; ++f) visit(facets_[f]);
        });
}

/// The same of every node whose box has something in common with this.
template <class Visit>
void StandingPart::walk_within(const Within& box, Visit&& visit) const {
    walk_leaves([&](const ManyNodes& many, auto& kept) { overlapping(many, box, kept.data()); },
                [&](std::size_t first, std::size_t last) {
                    for (std::size_t f = first; f < last; ++f) visit(facets_[f]);
                });
}

namespace {
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
            along0 = std::min(along0, along), along1 = std::max(along1, along);
            across0 = std::min(across0, across), across1 = std::max(across1, across);
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

/// A cutter of one form with a layer's top.
struct Cutter {
    StandingPart::Form form;
    double radius, top;

    [[nodiscard]] bool ball() const { return form == StandingPart::Form::ball; }
    /// What is asked of a motion is asked of so many pieces of it.
    [[nodiscard]] int pieces(const Point3& from, const Point3& to) const {
        const Point3 span = minus(to, from);
        const double length = std::sqrt(dot(span, span));
        const double count =
            ball() ? std::max(length / StandingPart::kSpan, std::abs(span[2]) / StandingPart::kRise)
                   : length / (from[2] == to[2] ? StandingPart::kSpan : StandingPart::kPiece);
        return std::max(1, static_cast<int>(std::ceil(count)));
    }
    /// Depth with the tip under the cap, the section of the part by the layer's top: that of the ball's
    /// centre below it, or of the cylinder's floor. On a piece it is greatest at an end or where the axis
    /// crosses the cap's outline, and the outline is an edge of facets cut at the top.
    [[nodiscard]] double under_cap(const Point3& tip) const {
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
    if (!cutter.ball()) return z - piece.lowest > depth && piece.way.distance2(shape) < reach * reach;
    const double dz = std::max(0.0, piece.lowest + cutter.radius - z);
    return piece.way.distance2(shape) + dz * dz < reach * reach;
}

/// Raises the result by what one facet adds to it on one piece.
void meet(const Cutter& cutter, const Piece& piece, const std::array<Vec3f, 3>& facet, Penetration& result) {
    if (!near(cutter, piece, facet, std::max({facet[0].z, facet[1].z, facet[2].z}), result.depth)) return;
    if (cutter.ball()) {
        Point3 a = piece.a, b = piece.b;
        a[2] += cutter.radius, b[2] += cutter.radius;
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

// Written with vectors of eight, as overlapping() is.
SLABWRIGHT_WIDE void StandingPart::squares(const Nodes& n, const Away& from, std::array<double, 8>& squares) {
    const auto wide = [](const std::array<float, 8>& row, Doubles8& to) {
        Floats8 values;
        std::memcpy(&values, row.data(), sizeof(values));
        to = __builtin_convertvector(values, Doubles8);
    };
    const auto gap = [](const Doubles8& below, const Doubles8& above, Doubles8& most) {
        const Doubles8 none{};
        most = below > above ? below : above;
        most = most > none ? most : none;
    };
    Doubles8 x0, y0, z0, x1, y1, z1, dx, dy, dz{};
    wide(n.x0, x0), wide(n.y0, y0), wide(n.z0, z0), wide(n.x1, x1), wide(n.y1, y1), wide(n.z1, z1);
    const Doubles8 none{};
    gap(x0 - from.point[0], from.point[0] - x1, dx), gap(y0 - from.point[1], from.point[1] - y1, dy);
    Doubles8 square = dx * dx + dy * dy;
    if (from.kind == Away::Kind::facets) {
        gap(z0 - from.point[2], from.point[2] - z1, dz);
        square += dz * dz;
    } else {
        const Doubles8 infinite = none + kInfinity, top = none + from.top;
        if (from.kind == Away::Kind::shadow) {
            gap(none, from.point[2] - (z1 < top ? z1 : top), dz);
            square += dz * dz;
        } else square = z1 > none + from.point[2] ? square : infinite;
        square = z0 < top ? square : infinite;
    }
    std::memcpy(squares.data(), &square, sizeof(square));
}

SLABWRIGHT_WIDE void StandingPart::boxes(const EightFacets& f, Nodes& boxes) {
    const auto extent = [](const std::array<float, 8>& a, const std::array<float, 8>& b,
                           const std::array<float, 8>& c, std::array<float, 8>& low,
                           std::array<float, 8>& high) {
        Floats8 u, v, w;
        std::memcpy(&u, a.data(), sizeof(u)), std::memcpy(&v, b.data(), sizeof(v)),
            std::memcpy(&w, c.data(), sizeof(w));
        Floats8 least = u < v ? u : v, most = u > v ? u : v;
        least = least < w ? least : w, most = most > w ? most : w;
        std::memcpy(low.data(), &least, sizeof(least)), std::memcpy(high.data(), &most, sizeof(most));
    };
    extent(f.x0, f.x1, f.x2, boxes.x0, boxes.x1), extent(f.y0, f.y1, f.y2, boxes.y0, boxes.y1),
        extent(f.z0, f.z1, f.z2, boxes.z0, boxes.z1);
}

/// Visits the facets, and which they are, whose box is nearer than limit(), a square, the nearer of sibling
/// nodes first, so that the limit falls early. Ties keep the order of the tree.
template <class Limit, class Visit>
void StandingPart::walk_nearest(const Away& from, Limit&& limit, Visit&& visit) const {
    struct Item {
        std::uint32_t level;
        std::size_t index;
        double d;
    };
    std::array<Item, 128> stack;
    std::array<double, 8> d;
    std::size_t size = 0;
    if (facets_.empty()) return;
    const auto push = [&](std::uint32_t level, std::size_t eight) {
        squares(levels_[level][eight], from, d);  // infinite where there is no node
        const std::size_t first = size;
        const double most = limit();
        for (std::size_t k = kFan; k-- > 0;) {
            if (!(d[k] < most)) continue;
            std::size_t at = size++;
            for (; at > first && stack[at - 1].d < d[k]; --at) stack[at] = stack[at - 1];
            stack[at] = {level, eight * kFan + k, d[k]};
        }
    };
    push(static_cast<std::uint32_t>(levels_.size() - 1), 0);
    while (size > 0) {
        const Item item = stack[--size];
        if (!(item.d < limit())) continue;
        if (item.level > 0) {
            push(item.level - 1, item.index);
            continue;
        }
        Nodes around;
        boxes(facets_.eight(item.index), around);
        squares(around, from, d);
        for (std::size_t first = item.index * kFan, k = 0; first + k < std::min(facets_.size(), first + kFan);
             ++k)
            if (d[k] < limit()) visit(facets_[first + k], static_cast<std::uint32_t>(first + k));
    }
}

Penetration StandingPart::ball(double z_top, const Point3& from, const Point3& to, double radius,
                               double at_least) const {
    return depth_of(Form::ball, z_top, from, to, radius, at_least);
}

Penetration StandingPart::cylinder(double z_top, const Point3& from, const Point3& to, double radius,
                                   double at_least) const {
    return depth_of(Form::cylinder, z_top, from, to, radius, at_least);
}

Penetration StandingPart::depth_of(Form form, double z_top, const Point3& from, const Point3& to,
                                   double radius, double at_least) const {
    const Cutter cutter{form, radius, z_top - kSheet};
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
        from = a, to = b;
        arc.reset();
        slack = 0;
        for (std::size_t k = 0; k < 3; ++k) low[k] = std::min(a[k], b[k]), high[k] = std::max(a[k], b[k]);
    }
    /// Motions [begin, end), each of which begins where the one before ends. @param flat the way is level, so
    /// that what is over it is no slack
    void take(std::span<const Motion> motions, std::size_t begin, std::size_t end, bool flat) {
        first = begin, last = end;
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
        l = l > none ? l : none, under = under > none ? under : none;
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
                close.x0[some] = e.x0[k], close.y0[some] = e.y0[k], close.z0[some] = e.z0[k];
                close.x1[some] = e.x1[k], close.y1[some] = e.y1[k], close.z1[some] = e.z1[k];
                close.x2[some] = e.x2[k], close.y2[some] = e.y2[k], close.z2[some] = e.z2[k];
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
        nearest = std::min(nearest, r), farthest = std::max(farthest, r),
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
        before = std::max(before, -along), after = std::max(after, along),
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

StandingPart::Found StandingPart::deepest(Form form, double z_top, std::span<const Motion> motions,
                                          double radius, double ignore, double tolerance,
                                          std::atomic<double>* known, std::span<const Chords> chords) const {
    Found found;
    Search search;
    if (form == Form::ball) search.arcs = chords;
    const Cutter& cutter = search.cutter = {form, radius, z_top - kSheet};
    std::vector<unsigned char>& keep = search.keep;
    Stretch stretch, single;
    bool whole = true;  // the stretch's facets are known
    Point3 last{};      // the end of one motion is mostly the begin of the next
    bool last_known = false, last_covered = false;
    auto covered_at = [&](const Point3& tip) {
        if (last_known && last == tip) return last_covered;
        last = tip, last_known = true;
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
        if (radius <= floor || std::min(from[2], to[2]) >= cutter.top - floor) {
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
            found.most = p, found.motion = m;
            if (known)
                for (double most = known->load(std::memory_order_relaxed); p.depth > most;)
                    if (known->compare_exchange_weak(most, p.depth, std::memory_order_relaxed)) break;
        }
        if (p.found && p.depth > tolerance) found.beyond.push_back(static_cast<std::uint32_t>(m));
        ++m;
    }
    return found;
}

bool StandingPart::covered(double x, double y, double z) const {
    int winding = 0;
    walk_within(Within({x, y, z}, {x, y, kInfinity}), [&](const Facet& f) {
        if (f.v[0].z < z && f.v[1].z < z && f.v[2].z < z) return;
        const int w = facet_winding(f.v, x, y);
        if (w != 0 && facet_height(f.v, x, y) >= z) winding += w;
    });
    return winding != 0;
}

double StandingPart::envelope(double x, double y, double z_top, double none) const {
    const double top = z_top - kSheet;
    int winding = 0;
    double height = -kInfinity;
    walk_within(Within({x, y, -kInfinity}, {x, y, kInfinity}), [&](const Facet& f) {
        const int w = facet_winding(f.v, x, y);
        if (w == 0) return;
        const double z = facet_height(f.v, x, y);
        if (z >= top) winding += w;
        else height = std::max(height, z);
    });
    if (winding != 0) return z_top;
    return height > -kInfinity ? height : none;
}

// fn(point, winding, height) for all points that facets come over which may be as high as z_low and lower
// than z_high.
template <class Fn>
void RisingEnvelope::for_each_point(double z_low, double z_high, Fn&& fn) const {
    const double x1 = x0_ + cell_ * (nx_ - 1), y1 = y0_ + cell_ * (ny_ - 1), per_cell = 1 / cell_;
    // Points from `low` to `high`, and one beside them where rounding does not tell: facet_winding() decides,
    // this only saves asking it.
    constexpr double hair = 1e-6;
    const auto first_of = [](double low) { return low > 0 ? static_cast<int>(low + (1 - hair)) : 0; };
    const auto last_of = [](double high, int n) {
        return high < -hair ? -1 : high < n - 1 ? static_cast<int>(high + hair) : n - 1;
    };
    part_->walk_within(StandingPart::Within({x0_, y0_, z_low}, {x1, y1, z_high}), [&](const auto& facet) {
        const auto& [a, b, c] = facet.v;
        if (std::max({a.z, b.z, c.z}) < z_low || std::min({a.z, b.z, c.z}) >= z_high) return;
        const double fx0 = (std::min({a.x, b.x, c.x}) - x0_) * per_cell,
                     fx1 = (std::max({a.x, b.x, c.x}) - x0_) * per_cell;
        const double fy0 = (std::min({a.y, b.y, c.y}) - y0_) * per_cell,
                     fy1 = (std::max({a.y, b.y, c.y}) - y0_) * per_cell;
        if (fx0 > nx_ || fy0 > ny_) return;
        const int i0 = first_of(fx0), i1 = last_of(fx1, nx_), j0 = first_of(fy0), j1 = last_of(fy1, ny_);
        for (int j = j0; j <= j1; ++j) {
            const double y = y0_ + j * cell_;
            int begin = i0, last = i1;
            if (constexpr int few = 3; last - begin >= few) {  // where the row crosses the outline
                double low = fx1, high = fx0;
                for (int k = 0; k < 3; ++k) {
                    const Vec3f &p = facet.v[static_cast<std::size_t>(k)],
                                &q = facet.v[static_cast<std::size_t>((k + 1) % 3)];
                    if ((p.y <= y) == (q.y <= y)) continue;
                    const double x =
                        p.x + (y - p.y) / (static_cast<double>(q.y) - p.y) * (static_cast<double>(q.x) - p.x);
                    low = std::min(low, (x - x0_) * per_cell), high = std::max(high, (x - x0_) * per_cell);
                }
                begin = first_of(low), last = last_of(high, nx_);
            }
            for (int i = begin; i <= last; ++i) {
                const double x = x0_ + i * cell_;
                if (const int w = facet_winding(facet.v, x, y); w != 0)
                    fn(static_cast<std::size_t>(j) * static_cast<std::size_t>(nx_) +
                           static_cast<std::size_t>(i),
                       w, facet_height(facet.v, x, y));
            }
        }
    });
}

RisingEnvelope::RisingEnvelope(const StandingPart& part, double x0, double y0, double cell, int nx, int ny)
    : part_(&part),
      x0_(x0),
      y0_(y0),
      cell_(cell),
      nx_(nx),
      ny_(ny),
      passed_(-kInfinity),
      above_(static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny), 0),
      below_(above_.size(), -std::numeric_limits<float>::infinity()) {
    // Over a closed mesh what is at all heights together winds around nothing.
    if (!part.closed_)
        for_each_point(-kInfinity, kInfinity, [&](std::size_t k, int w, double) { above_[k] += w; });
}

void RisingEnvelope::at(double z_top, float none, float* out) {
    const double top = z_top - StandingPart::kSheet;
    crossings_.clear();
    for_each_point(passed_, top, [&](std::size_t k, int w, double z) {
        if (z < passed_ || z >= top) return;
        crossings_.push_back({static_cast<std::uint32_t>(k), w, z});
        above_[k] -= w;
        below_[k] = std::max(below_[k], static_cast<float>(z));
    });
    passed_ = std::max(passed_, top);
    for (std::size_t k = 0; k < above_.size(); ++k)
        out[k] = above_[k] != 0                                         ? static_cast<float>(z_top)
                 : below_[k] == -std::numeric_limits<float>::infinity() ? none
                                                                        : below_[k];
}

void RisingEnvelope::covered_air(double z_bottom, float* out) {
    std::fill(out, out + above_.size(), 0.0F);
    std::sort(crossings_.begin(), crossings_.end(), [](const Crossing& a, const Crossing& b) {
        return std::tie(a.column, a.z, a.winding) < std::tie(b.column, b.z, b.winding);
    });
    for (auto first = crossings_.begin(); first != crossings_.end();) {
        const auto end = std::find_if(first, crossings_.end(),
                                      [&](const Crossing& c) { return c.column != first->column; });
        // From above: the winding number over the highest crossing is known.
        std::int32_t winding = above_[first->column];
        bool under_part = winding != 0;
        double air = 0, upper = 0;
        for (auto c = std::make_reverse_iterator(end); c != std::make_reverse_iterator(first); ++c) {
            if (winding == 0 && under_part) air += std::max(0.0, upper - std::max(c->z, z_bottom));
            winding += c->winding;
            under_part = under_part || winding != 0;
            upper = c->z;
        }
        if (winding == 0 && under_part) air += std::max(0.0, upper - z_bottom);
        out[first->column] = static_cast<float>(air);
        first = end;
    }
}

StandingPart::Clearance StandingPart::from_shadow(const Point3& point, double z_top, double limit,
                                                  bool under) const {
    const double top = z_top - kSheet;
    Clearance best{limit, {0, 0, 0}};
    if (under && point[2] - top < best.distance) {
        const double over = std::max(0.0, point[2] - top);
        best = {over, {0, 0, over}};
    }
    walk_nearest(
        {Away::Kind::shadow, point, top}, [&] { return best.distance * best.distance; },
        [&](const Facet& f, std::uint32_t) {
            below(f.v, top, [&](const Triangle& t) {
                const RayDistance r = ray_distance(point, t);
                if (r.d < best.distance) best = {r.d, r.vector};
            });
        });
    return best;
}

StandingPart::Clearance StandingPart::beside(const Point3& point, double z_top, double limit) const {
    const double top = z_top - kSheet;
    Clearance best{limit, {0, 0, 0}};
    if (point[2] >= top) return best;
    if (covered(point[0], point[1], top)) return {0, {0, 0, 0}};
    const Vec2d axis{point[0], point[1]};
    walk_nearest(
        {Away::Kind::beside, point, top}, [&] { return best.distance * best.distance; },
        [&](const Facet& f, std::uint32_t) {
            Polygon poly;
            poly.n = 3;
            for (int k = 0; k < 3; ++k) poly.p[k] = to_double(f.v[k]);
            poly = clip_z(clip_z(poly, top, false), point[2], true);
            if (poly.n == 0) return;
            if (distance_2d(poly, axis, axis) == 0) {
                best = {0, {0, 0, 0}};
                return;
            }
            for (int i = 0; i < poly.n; ++i) {
                Point3 s = poly.p[i], e = poly.p[(i + 1) % poly.n], from = point;
                s[2] = e[2] = from[2] = 0;
                const Point3 w = minus(from, closest_on_segment(from, s, e));
                const double d = std::sqrt(dot(w, w));
                if (d < best.distance) best = {d, w};
            }
        });
    return best;
}

double StandingPart::distance(const Point3& point, std::uint32_t facet) const {
    const std::array<Vec3f, 3>& v = facets_[facet].v;
    const Point3 away =
        minus(point, closest_on_triangle(point, {to_double(v[0]), to_double(v[1]), to_double(v[2])}));
    return std::sqrt(dot(away, away));
}

StandingPart::Near StandingPart::nearest(const Point3& point, const Near& known, double enough) const {
    Near best = known;
    walk_nearest(
        {Away::Kind::facets, point, 0},
        [&] { return best.distance <= enough ? 0.0 : best.distance * best.distance; },
        [&](const Facet&, std::uint32_t facet) {
            const double d = distance(point, facet);
            if (d < best.distance) best = {d, facet};
        });
    return best;
}

double StandingPart::from_facets(const Point3& point, double limit, double enough) const {
    double best2 = limit * limit;
    walk_nearest(
        {Away::Kind::facets, point, 0}, [&] { return best2 <= enough * enough ? 0.0 : best2; },
        [&](const Facet& f, std::uint32_t) {
            const Point3 away = minus(
                point, closest_on_triangle(point, {to_double(f.v[0]), to_double(f.v[1]), to_double(f.v[2])}));
            best2 = std::min(best2, dot(away, away));
        });
    return std::sqrt(best2);
}

}  // namespace slabwright
