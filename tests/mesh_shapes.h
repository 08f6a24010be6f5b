// Small solids as loose facets, for the tests of mesh and STL.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "kernels/mesh/mesh.h"

namespace slabwright::shapes {

using Facets = std::vector<std::array<Vec3f, 3>>;

/// The 12 facets of a box, outward.
inline Facets box(Vec3f low, Vec3f high) {
    auto at = [&](int i) {
        return Vec3f{(i & 1) != 0 ? high.x : low.x, (i & 2) != 0 ? high.y : low.y,
                     (i & 4) != 0 ? high.z : low.z};
    };
    constexpr int quads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                 {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    Facets facets;
    for (const auto& q : quads) {
        facets.push_back({at(q[0]), at(q[1]), at(q[2])});
        facets.push_back({at(q[0]), at(q[2]), at(q[3])});
    }
    return facets;
}

inline Facets flipped(Facets facets) {
    for (auto& facet : facets) std::swap(facet[1], facet[2]);
    return facets;
}

inline void append(Facets& to, const Facets& more) { to.insert(to.end(), more.begin(), more.end()); }

/// A torus around z of 2·n² facets, closed bit for bit.
inline Facets torus(int n, double major = 300, double minor = 100) {
    auto at = [&](int i, int j) {
        const double u = 2 * 3.141592653589793 * (i % n) / n, w = 2 * 3.141592653589793 * (j % n) / n;
        return Vec3f{static_cast<float>((major + minor * std::cos(w)) * std::cos(u)),
                     static_cast<float>((major + minor * std::cos(w)) * std::sin(u)),
                     static_cast<float>(minor * std::sin(w))};
    };
    Facets facets;
    facets.reserve(2 * static_cast<std::size_t>(n) * static_cast<std::size_t>(n));
    for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j) {
            facets.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
            facets.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
        }
    }
    return facets;
}

}  // namespace slabwright::shapes
