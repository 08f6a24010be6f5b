// A block with round tunnels along y: what no side of it, and no single boundary, makes.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "tests/mesh_shapes.h"

namespace slabwright::support {

struct Tunnel {
    double x, z, radius;  ///< of its axis
};

/// @param tunnels that do not overlap in x, ascending. Each is a polygon of 4·quarter corners on its circle,
/// two of them level with its axis.
inline shapes::Facets block_with_tunnels(Vec3f low, Vec3f high, const std::vector<Tunnel>& tunnels,
                                         int quarter = 90) {
    struct Line {
        double x, floor, roof;  // of the tunnel there
    };
    std::vector<Line> lines;
    const double middle = (double{low.z} + high.z) / 2;
    lines.push_back({low.x, middle, middle});
    for (const Tunnel& t : tunnels)
        for (int k = 0; k <= 2 * quarter; ++k) {
            const double turn = std::numbers::pi * k / (2 * quarter);
            const double h = k == 0 || k == 2 * quarter ? 0 : t.radius * std::sin(turn);
            lines.push_back({t.x - t.radius * std::cos(turn), t.z - h, t.z + h});
        }
    lines.push_back({high.x, middle, middle});
    shapes::Facets facets;
    const auto at = [](double x, float y, double z) {
        return Vec3f{static_cast<float>(x), y, static_cast<float>(z)};
    };
    const auto quad = [&](Vec3f a, Vec3f b, Vec3f c, Vec3f d) {
        if (!(a == b) && !(b == c) && !(c == a)) facets.push_back({a, b, c});
        if (!(a == c) && !(c == d) && !(d == a)) facets.push_back({a, c, d});
    };
    for (std::size_t i = 0; i + 1 < lines.size(); ++i) {
        const Line &p = lines[i], &q = lines[i + 1];
        const auto level = [&](double zp, double zq, bool up) {
            const Vec3f a = at(p.x, low.y, zp), b = at(q.x, low.y, zq), c = at(q.x, high.y, zq),
                        d = at(p.x, high.y, zp);
            if (up) quad(a, b, c, d);
            else quad(d, c, b, a);
        };
        const auto ends = [&](double p0, double q0, double p1, double q1) {
            quad(at(p.x, low.y, p0), at(q.x, low.y, q0), at(q.x, low.y, q1), at(p.x, low.y, p1));
            quad(at(p.x, high.y, p1), at(q.x, high.y, q1), at(q.x, high.y, q0), at(p.x, high.y, p0));
        };
        level(low.z, low.z, false);
        level(high.z, high.z, true);
        ends(low.z, low.z, p.floor, q.floor);
        ends(p.roof, q.roof, high.z, high.z);
        if (p.floor == p.roof && q.floor == q.roof) continue;
        level(p.floor, q.floor, true);
        level(p.roof, q.roof, false);
    }
    for (const auto& [from, to] : {std::pair{double{low.z}, middle}, std::pair{middle, double{high.z}}}) {
        quad(at(low.x, high.y, from), at(low.x, low.y, from), at(low.x, low.y, to), at(low.x, high.y, to));
        quad(at(high.x, low.y, from), at(high.x, high.y, from), at(high.x, high.y, to),
             at(high.x, low.y, to));
    }
    return facets;
}

}  // namespace slabwright::support
