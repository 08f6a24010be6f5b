// Solids of polygons one above the other.
#pragma once

#include <array>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "kernels/mesh/mesh.h"
#include "kernels/mesh/weld.h"
#include "kernels/parallel/context.h"

namespace slabwright::support {

struct Ring {
    double z = 0;
    std::vector<std::array<double, 2>> points;  ///< counter-clockwise; as many as every ring has
};

/// The facets between rings from below, with a fan about the middle of the first and the last.
inline std::vector<std::array<Vec3f, 3>> loft_facets(const std::vector<Ring>& rings) {
    const auto at = [](const Ring& ring, std::size_t i) {
        const auto& p = ring.points[i % ring.points.size()];
        return Vec3f{static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(ring.z)};
    };
    const auto middle = [](const Ring& ring) {
        double x = 0, y = 0;
        for (const auto& p : ring.points) x += p[0], y += p[1];
        const double n = static_cast<double>(ring.points.size());
        return Vec3f{static_cast<float>(x / n), static_cast<float>(y / n), static_cast<float>(ring.z)};
    };
    std::vector<std::array<Vec3f, 3>> facets;
    const Ring &bottom = rings.front(), &top = rings.back();
    for (std::size_t i = 0; i < bottom.points.size(); ++i) {
        facets.push_back({middle(bottom), at(bottom, i + 1), at(bottom, i)});
        facets.push_back({middle(top), at(top, i), at(top, i + 1)});
        for (std::size_t r = 0; r + 1 < rings.size(); ++r) {
            facets.push_back({at(rings[r], i), at(rings[r], i + 1), at(rings[r + 1], i + 1)});
            facets.push_back({at(rings[r], i), at(rings[r + 1], i + 1), at(rings[r + 1], i)});
        }
    }
    return facets;
}

inline Mesh loft(Context& context, const std::vector<Ring>& rings) {
    return weld(context, loft_facets(rings));
}

inline Ring circle(double z, double radius, int n, double x = 0, double y = 0) {
    Ring ring{z, {}};
    for (int i = 0; i < n; ++i) {
        const double a = 2 * 3.141592653589793 * i / n;
        ring.points.push_back({x + radius * std::cos(a), y + radius * std::sin(a)});
    }
    return ring;
}

/// A solid of revolution whose radius is a function of height. @param rings above the first
inline Mesh turned(Context& context, double height, int rings, int n,
                   const std::function<double(double)>& radius) {
    std::vector<Ring> all;
    for (int i = 0; i <= rings; ++i) all.push_back(circle(height * i / rings, radius(height * i / rings), n));
    return loft(context, all);
}

}  // namespace slabwright::support
