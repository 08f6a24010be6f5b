#include "io/read/polygon_facets.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace slabwright {

namespace {

using Flat = std::array<double, 2>;

double turn(const Flat& a, const Flat& b, const Flat& c) {
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/// The polygon seen along its normal (Newell's, whose largest part names the axis that is left out).
std::vector<Flat> flattened(std::span<const std::uint32_t> corners, std::span<const FileVertex> vertices) {
    std::array<double, 3> normal{};
    for (std::size_t i = 0; i < corners.size(); ++i) {
        const FileVertex &a = vertices[corners[i]], &b = vertices[corners[(i + 1) % corners.size()]];
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t u = (k + 1) % 3, v = (k + 2) % 3;
            normal[k] += (a[u] - b[u]) * (a[v] + b[v]);
        }
    }
    std::size_t axis = 0;
    for (std::size_t k = 1; k < 3; ++k)
        if (std::abs(normal[k]) > std::abs(normal[axis])) axis = k;
    std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
    if (normal[axis] < 0) std::swap(u, v);
    std::vector<Flat> flat;
    for (const std::uint32_t c : corners) flat.push_back({vertices[c][u], vertices[c][v]});
    return flat;
}

bool is_convex(const std::vector<Flat>& flat) {
    const std::size_t n = flat.size();
    for (std::size_t i = 0; i < n; ++i)
        if (turn(flat[i], flat[(i + 1) % n], flat[(i + 2) % n]) < 0) return false;
    // A star turns left everywhere and more than once around: from its first corner it does not.
    for (std::size_t i = 1; i + 1 < n; ++i)
        if (turn(flat[0], flat[i], flat[i + 1]) < 0) return false;
    return true;
}

bool holds(const Flat& a, const Flat& b, const Flat& c, const Flat& p) {
    return turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0;
}

}  // namespace

void append_polygon(std::span<const std::uint32_t> corners, std::span<const FileVertex> vertices,
                    std::vector<Index3>& facets) {
    const auto append = [&](std::size_t a, std::size_t b, std::size_t c) {
        facets.push_back({corners[a], corners[b], corners[c]});
    };
    if (corners.size() == 3) {
        append(0, 1, 2);
        return;
    }
    const std::vector<Flat> flat = flattened(corners, vertices);
    if (is_convex(flat)) {
        for (std::size_t i = 1; i + 1 < corners.size(); ++i) append(0, i, i + 1);
        return;
    }
    std::vector<std::size_t> left(corners.size());
    for (std::size_t i = 0; i < left.size(); ++i) left[i] = i;
    while (left.size() > 3) {
        const std::size_t n = left.size();
        std::size_t ear = n;
        for (std::size_t i = 0; i < n && ear == n; ++i) {
            const std::size_t before = left[(i + n - 1) % n], here = left[i], after = left[(i + 1) % n];
            if (turn(flat[before], flat[here], flat[after]) <= 0) continue;
            const bool free = std::none_of(left.begin(), left.end(), [&](std::size_t j) {
                const bool corner =
                    flat[j] == flat[before] || flat[j] == flat[here] || flat[j] == flat[after];
                return !corner && holds(flat[before], flat[here], flat[after], flat[j]);
            });
            if (free) ear = i;
        }
        if (ear == n) ear = 0;  // it crosses itself: any cut keeps its border, by which the solid is told
        append(left[(ear + n - 1) % n], left[ear], left[(ear + 1) % n]);
        left.erase(left.begin() + static_cast<std::ptrdiff_t>(ear));
    }
    append(left[0], left[1], left[2]);
}

}  // namespace slabwright
