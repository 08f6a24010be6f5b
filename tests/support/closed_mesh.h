// What tests ask of a closed mesh.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <utility>

#include "kernels/mesh/mesh.h"

namespace slabwright::test {

/// mm³
inline double volume(MeshView mesh) {
    double six = 0;
    for (const Index3& f : mesh.facets) {
        const Vec3f &a = mesh.vertices[f[0]], &b = mesh.vertices[f[1]], &c = mesh.vertices[f[2]];
        six += a.x * (double{b.y} * c.z - double{b.z} * c.y) - a.y * (double{b.x} * c.z - double{b.z} * c.x) +
               a.z * (double{b.x} * c.y - double{b.y} * c.x);
    }
    return six / 6;
}

/// Every edge of a closed, oriented mesh is used as often in one direction as in the other.
inline bool closed(MeshView mesh) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> balance;
    for (const Index3& f : mesh.facets)
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t a = f[k], b = f[(k + 1) % 3];
            balance[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
        }
    return std::all_of(balance.begin(), balance.end(), [](const auto& edge) { return edge.second == 0; });
}

}  // namespace slabwright::test
