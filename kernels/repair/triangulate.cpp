#include "kernels/repair/triangulate.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace slabwright {

std::vector<std::array<std::uint32_t, 3>> least_area(std::span<const Xyz> loop) {
    const std::size_t n = loop.size();
    if (n < 3 || n > kMostForLeastArea) return {};
    std::vector<double> best(n * n, 0);
    std::vector<std::uint32_t> apex(n * n, 0);
    for (std::size_t span = 2; span < n; ++span) {
        for (std::size_t i = 0; i + span < n; ++i) {
            const std::size_t j = i + span;
            double least = std::numeric_limits<double>::infinity();
            for (std::size_t m = i + 1; m < j; ++m) {
                double area = best[i * n + m] + best[m * n + j];
                if (area >= least) continue;
                area += length(twice_area(loop[i], loop[m], loop[j]));
                if (area >= least) continue;
                least = area;
                apex[i * n + j] = static_cast<std::uint32_t>(m);
            }
            best[i * n + j] = least;
        }
    }
    std::vector<std::array<std::uint32_t, 3>> triangles;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> open{{0u, static_cast<std::uint32_t>(n - 1)}};
    while (!open.empty()) {
        const auto [i, j] = open.back();
        open.pop_back();
        if (j - i < 2) continue;
        const std::uint32_t m = apex[i * n + j];
        triangles.push_back({i, m, j});
        open.emplace_back(i, m);
        open.emplace_back(m, j);
    }
    return triangles;
}

namespace {

using Flat = std::array<double, 2>;

/// Twice the signed area.
double turn(const Flat& a, const Flat& b, const Flat& c) {
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

bool in_triangle(const Flat& a, const Flat& b, const Flat& c, const Flat& p) {
    return turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0;
}

/// The points in their plane, so that the region lies to the left of its outline.
std::vector<Flat> flattened(std::span<const Xyz> points, const Xyz& normal) {
    std::size_t axis = 0;
    for (std::size_t k = 1; k < 3; ++k)
        if (std::abs(normal[k]) > std::abs(normal[axis])) axis = k;
    const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
    std::vector<Flat> flat;
    flat.reserve(points.size());
    for (const Xyz& p : points) {
        if (normal[axis] > 0) flat.push_back({p[u], p[v]});
        else flat.push_back({p[v], p[u]});
    }
    return flat;
}

/// Joins a hole to the outline by a bridge from the hole's rightmost point to a point of the outline that it
/// sees (Eberly, "Triangulation by ear clipping", 2002). @return false where it sees none
bool bridge(const std::vector<Flat>& at, std::vector<std::uint32_t>& outline,
            const std::vector<std::uint32_t>& hole) {
    std::size_t right = 0;
    for (std::size_t i = 1; i < hole.size(); ++i)
        if (at[hole[i]] > at[hole[right]]) right = i;
    const Flat m = at[hole[right]];
    // The first side of the outline that a ray to the right meets, and of its ends the one farther right.
    double nearest = std::numeric_limits<double>::infinity();
    std::size_t seen = outline.size();
    for (std::size_t i = 0; i < outline.size(); ++i) {
        const Flat a = at[outline[i]], b = at[outline[(i + 1) % outline.size()]];
        if (!(a[1] <= m[1] && b[1] >= m[1]) || a[1] == b[1]) continue;
        const double x = a[0] + (m[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
        if (x < m[0] || x >= nearest) continue;
        nearest = x;
        seen = a[0] > b[0] ? i : (i + 1) % outline.size();
    }
    if (seen == outline.size()) return false;
    // A corner within the triangle of hole, ray and that end hides it: then the corner nearest to the ray.
    const Flat hit{nearest, m[1]}, end = at[outline[seen]];
    double best = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < outline.size(); ++i) {
        const Flat p = at[outline[i]];
        if (p == end || p[0] < m[0]) continue;
        if (!(end[1] < m[1] ? in_triangle(m, end, hit, p) : in_triangle(m, hit, end, p))) continue;
        const double steep = std::abs(p[1] - m[1]) / std::max(p[0] - m[0], 1e-300);
        if (steep < best) best = steep, seen = i;
    }
    std::vector<std::uint32_t> joined(outline.begin(),
                                      outline.begin() + static_cast<std::ptrdiff_t>(seen) + 1);
    for (std::size_t i = 0; i <= hole.size(); ++i) joined.push_back(hole[(right + i) % hole.size()]);
    joined.insert(joined.end(), outline.begin() + static_cast<std::ptrdiff_t>(seen), outline.end());
    outline = std::move(joined);
    return true;
}

}  // namespace

std::vector<std::array<std::uint32_t, 3>> clip_ears(std::span<const Xyz> points,
                                                    const std::vector<std::vector<std::uint32_t>>& loops,
                                                    const Xyz& normal) {
    const std::vector<Flat> at = flattened(points, normal);
    std::vector<std::uint32_t> ring = loops[0];
    // Holes farther right first, so that a bridge meets the outline or a hole that is joined already.
    std::vector<std::size_t> order;
    const auto rightmost = [&](std::size_t h) {
        Flat most = at[loops[h][0]];
        for (const std::uint32_t v : loops[h]) most = std::max(most, at[v]);
        return most;
    };
    for (std::size_t h = 1; h < loops.size(); ++h) order.push_back(h);
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        const Flat pa = rightmost(a), pb = rightmost(b);
        return pa != pb ? pa > pb : a < b;
    });
    for (const std::size_t h : order)
        if (!bridge(at, ring, loops[h])) return {};
    std::vector<std::array<std::uint32_t, 3>> triangles;
    std::size_t i = 0, missed = 0;
    while (ring.size() > 3) {
        if (missed > ring.size()) return {};
        const std::size_t n = ring.size();
        i %= n;
        const std::uint32_t a = ring[(i + n - 1) % n], b = ring[i], c = ring[(i + 1) % n];
        bool ear = turn(at[a], at[b], at[c]) > 0;
        for (std::size_t k = 0; ear && k < n; ++k) {
            const std::uint32_t p = ring[k];
            if (p == a || p == b || p == c || at[p] == at[a] || at[p] == at[c] || at[p] == at[b]) continue;
            if (in_triangle(at[a], at[b], at[c], at[p])) ear = false;
        }
        if (!ear) {
            ++i, ++missed;
            continue;
        }
        triangles.push_back({a, b, c});
        ring.erase(ring.begin() + static_cast<std::ptrdiff_t>(i));
        missed = 0;
        ++i;  // not fan-wise from one corner
    }
    triangles.push_back({ring[0], ring[1], ring[2]});
    return triangles;
}

}  // namespace slabwright
