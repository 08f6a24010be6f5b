#include "kernels/access/standing_part.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "kernels/access/piece_depth.h"
#include "kernels/access/standing_walk.h"
#include "kernels/geometry/triangle.h"
#include "kernels/geometry/wide.h"
#include "kernels/mesh/morton.h"
#include "kernels/mesh/raw_array.h"
#include "kernels/parallel/deal.h"
#include "kernels/parallel/parallel.h"

namespace slabwright {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

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
    e.x0[k] = a.x;
    e.y0[k] = a.y;
    e.z0[k] = a.z;
    e.x1[k] = b.x;
    e.y1[k] = b.y;
    e.z1[k] = b.z;
    e.x2[k] = c.x;
    e.y2[k] = c.y;
    e.z2[k] = c.z;
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
        a.x0 = std::min(a.x0, b.x0);
        a.y0 = std::min(a.y0, b.y0);
        a.z0 = std::min(a.z0, b.z0);
        a.x1 = std::max(a.x1, b.x1);
        a.y1 = std::max(a.y1, b.y1);
        a.z1 = std::max(a.z1, b.z1);
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
                eight.x0[k] = node.x0;
                eight.y0[k] = node.y0;
                eight.z0[k] = node.z0;
                eight.x1[k] = node.x1;
                eight.y1[k] = node.y1;
                eight.z1[k] = node.z1;
            }
        });
        below_count = count;
    } while (below_count > kFan);
}

StandingPart::Within::Within(const Point3& from, const Point3& to) {
    constexpr float inf = std::numeric_limits<float>::infinity();
    for (std::size_t k = 0; k < 3; ++k) {
        low[k] = static_cast<float>(from[k]);
        high[k] = static_cast<float>(to[k]);
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
    wide(n.x0, x0);
    wide(n.y0, y0);
    wide(n.z0, z0);
    wide(n.x1, x1);
    wide(n.y1, y1);
    wide(n.z1, z1);
    const Doubles8 none{};
    gap(x0 - from.point[0], from.point[0] - x1, dx);
    gap(y0 - from.point[1], from.point[1] - y1, dy);
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
        least = least < w ? least : w;
        most = most > w ? most : w;
        std::memcpy(low.data(), &least, sizeof(least)), std::memcpy(high.data(), &most, sizeof(most));
    };
    extent(f.x0, f.x1, f.x2, boxes.x0, boxes.x1);
    extent(f.y0, f.y1, f.y2, boxes.y0, boxes.y1);
    extent(f.z0, f.z1, f.z2, boxes.z0, boxes.z1);
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
