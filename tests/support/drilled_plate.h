// Plates with holes and what is none, triangulated directly: a row of cells, in each of which loops follow
// one another from the top's outline inwards, down a wall, across a shelf, to a bottom or out below.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "kernels/geometry/vectors.h"

namespace slabwright::test {

using Loop = std::vector<Vec3d>;
using PlateFacets = std::vector<std::array<Vec3d, 3>>;

/// Where loops turn: about an axis that points out of the solid.
struct LoopAxis {
    Vec3d at{}, u{1, 0, 0}, v{0, 1, 0}, out{0, 0, 1};

    static LoopAxis along(const Vec3d& at, const Vec3d& out) {
        const Vec3d w = scaled(1 / length(out), out);
        const Vec3d side = std::abs(w[2]) < 0.9 ? Vec3d{0, 0, 1} : Vec3d{1, 0, 0};
        const Vec3d v = cross(w, side), unit_v = scaled(1 / length(v), v);
        return {at, cross(unit_v, w), unit_v, w};
    }
    [[nodiscard]] double angle(const Vec3d& p) const {
        const Vec3d d = minus(p, at);
        const double a = std::atan2(dot(d, v), dot(d, u));
        return a < 0 ? a + 2 * std::numbers::pi : a;
    }
    /// A circle's corners at the given angles, `height` along `out`.
    [[nodiscard]] Loop ring(const std::vector<double>& angles, double radius, double height) const {
        Loop loop;
        for (const double a : angles)
            loop.push_back(
                plus(plus(plus(at, u, radius * std::cos(a)), v, radius * std::sin(a)), out, height));
        return loop;
    }
    /// The same, moved along the axis on to the plane z = `z`.
    [[nodiscard]] Loop ring_at_z(const std::vector<double>& angles, double radius, double z) const {
        Loop loop = ring(angles, radius, 0);
        for (Vec3d& p : loop) p = plus(p, out, (z - p[2]) / out[2]);
        return loop;
    }
};

/// n angles from `phase` on; each moved by up to `jitter` of their distance.
inline std::vector<double> turn(int n, double phase, double jitter, std::mt19937& random) {
    std::vector<double> angles;
    std::uniform_real_distribution<double> off(-jitter, jitter);
    for (int i = 0; i < n; ++i)
        angles.push_back(phase + 2 * std::numbers::pi * (i + (jitter > 0 ? off(random) : 0)) / n);
    return angles;
}

/// The facets between two loops around an axis, the first of which lies nearer to the solid's outline.
inline void strip(PlateFacets& to, const LoopAxis& axis, const Loop& outer, const Loop& inner) {
    const auto sorted = [&](const Loop& loop) {
        std::vector<std::pair<double, Vec3d>> corners;
        for (const Vec3d& p : loop) corners.emplace_back(axis.angle(p), p);
        std::sort(corners.begin(), corners.end(),
                  [](const auto& a, const auto& b) { return a.first < b.first; });
        corners.emplace_back(corners.front().first + 2 * std::numbers::pi, corners.front().second);
        return corners;
    };
    const auto a = sorted(outer), b = sorted(inner);
    // Each side goes to the corner of the other loop that is nearer by angle: that never folds over.
    const auto middle = [](const auto& loop, std::size_t i) {
        return i + 1 == loop.size() ? 1e9 : (loop[i].first + loop[i + 1].first) / 2;
    };
    for (std::size_t i = 0, j = 0; i + 1 < a.size() || j + 1 < b.size();) {
        if (middle(a, i) <= middle(b, j)) {
            to.push_back({a[i].second, a[i + 1].second, b[j].second});
            ++i;
        } else {
            to.push_back({a[i].second, b[j + 1].second, b[j].second});
            ++j;
        }
    }
}

/// Closes a loop at a point.
inline void fan(PlateFacets& to, const LoopAxis& axis, const Loop& loop, const Vec3d& apex) {
    std::vector<Vec3d> sorted = loop;
    std::sort(sorted.begin(), sorted.end(),
              [&](const Vec3d& p, const Vec3d& q) { return axis.angle(p) < axis.angle(q); });
    for (std::size_t i = 0; i < sorted.size(); ++i)
        to.push_back({sorted[i], sorted[(i + 1) % sorted.size()], apex});
}

inline void quad(PlateFacets& to, const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& d) {
    to.push_back({a, b, c});
    to.push_back({a, c, d});
}

/// As a mesh's file has them.
inline std::vector<std::array<Vec3f, 3>> rounded(const PlateFacets& facets) {
    std::vector<std::array<Vec3f, 3>> corners;
    for (const auto& facet : facets) {
        std::array<Vec3f, 3> floats;
        for (std::size_t k = 0; k < 3; ++k)
            floats[k] = {static_cast<float>(facet[k][0]), static_cast<float>(facet[k][1]),
                         static_cast<float>(facet[k][2])};
        corners.push_back(floats);
    }
    return corners;
}

/// Cells of one height and breadth beside each other along x, from x = 0, between y = 0 and `breadth`.
class DrilledPlate {
public:
    DrilledPlate(double breadth, double height) : breadth_(breadth), height_(height) {}

    [[nodiscard]] double next_x() const { return x_; }

    /// A cell of some width whose surface goes from the top's outline through the loops to an apex in the
    /// last one's middle, `apex` above z = 0; with no apex it goes on to the outline of the underside.
    void cell(double width, const LoopAxis& axis, const std::vector<Loop>& loops, const Vec3d* apex) {
        const Loop top = outline(width, height_), bottom = outline(width, 0);
        const Loop* last = &top;
        for (const Loop& loop : loops) {
            strip(facets_, axis, *last, loop);
            last = &loop;
        }
        if (apex != nullptr) {
            fan(facets_, axis, *last, *apex);
            quad(facets_, bottom[3], bottom[2], bottom[1], bottom[0]);
        } else strip(facets_, axis, *last, bottom);
        quad(facets_, bottom[0], bottom[1], top[1], top[0]);
        quad(facets_, bottom[2], bottom[3], top[3], top[2]);
        if (x_ == 0) quad(facets_, bottom[3], bottom[0], top[0], top[3]);
        x_ += width;
    }

    /// The facets, closed at the last cell's side.
    [[nodiscard]] PlateFacets closed() const {
        PlateFacets all = facets_;
        quad(all, {x_, 0, 0}, {x_, breadth_, 0}, {x_, breadth_, height_}, {x_, 0, height_});
        return all;
    }

private:
    [[nodiscard]] Loop outline(double width, double z) const {
        return {{x_, 0, z}, {x_ + width, 0, z}, {x_ + width, breadth_, z}, {x_, breadth_, z}};
    }
    double breadth_, height_, x_ = 0;
    PlateFacets facets_;
};

}  // namespace slabwright::test
