// Random solids of several bodies, as CAD exports hold them: overlapping, nested, touching, apart by next to
// nothing, some inside out.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "tests/mesh_shapes.h"

namespace slabwright::test {

struct CompositionOptions {
    int least = 2, most = 12;  ///< bodies
    double size = 60;          ///< mm, of the whole in plan
    double inverted = 0.2;     ///< share of the bodies that are inside out
    int corners = 14;          ///< around a round body
};

class Composer {
public:
    Composer(std::mt19937& random, CompositionOptions options) : random_(random), options_(options) {}

    /// A plate that carries the rest, then the bodies.
    shapes::Facets facets() {
        const double s = options_.size;
        shapes::Facets all = shapes::box({0, 0, 0}, to_float(s, 0.8 * s, 0.1 * s));
        boxes_.assign(1, {{0, 0, 0}, {s, 0.8 * s, 0.1 * s}});
        const int bodies = std::uniform_int_distribution(options_.least, options_.most)(random_) - 1;
        for (int i = 0; i < bodies; ++i) {
            shapes::Facets body = placed(shape());
            if (uniform(0, 1) < options_.inverted) body = shapes::flipped(std::move(body));
            shapes::append(all, body);
        }
        return all;
    }

private:
    using Point = std::array<double, 3>;
    using Body = std::vector<std::array<Point, 3>>;
    struct Extent {
        Point low, high;
    };

    double uniform(double low, double high) { return std::uniform_real_distribution(low, high)(random_); }
    int pick(int n) { return std::uniform_int_distribution(0, n - 1)(random_); }
    static Vec3f to_float(double x, double y, double z) {
        return {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
    }

    /// Around the origin: rings of n corners at the given radii and heights, closed by its first and last.
    static Body turned(int n, const std::vector<std::array<double, 2>>& rings) {
        const auto at = [&](std::size_t ring, int k) {
            const double u = 2 * std::numbers::pi * (k % n) / n;
            return Point{rings[ring][0] * std::cos(u), rings[ring][0] * std::sin(u), rings[ring][1]};
        };
        Body body;
        const std::size_t last = rings.size() - 1;
        for (int k = 0; k < n; ++k) {
            for (std::size_t r = 0; r < last; ++r) {
                if (rings[r][0] > 0) body.push_back({at(r, k), at(r, k + 1), at(r + 1, k + 1)});
                if (rings[r + 1][0] > 0) body.push_back({at(r, k), at(r + 1, k + 1), at(r + 1, k)});
            }
            if (rings[0][0] > 0) body.push_back({Point{0, 0, rings[0][1]}, at(0, k + 1), at(0, k)});
            if (rings[last][0] > 0)
                body.push_back({Point{0, 0, rings[last][1]}, at(last, k), at(last, k + 1)});
        }
        return body;
    }

    Body shape() {
        const double s = options_.size, r = uniform(0.08, 0.3) * s, h = uniform(0.1, 0.5) * s;
        const int n = options_.corners;
        switch (pick(5)) {
            case 0: {
                const double a = uniform(0.1, 0.5) * s, b = uniform(0.1, 0.5) * s;
                Body body;
                for (const auto& f : shapes::box(to_float(-a / 2, -b / 2, 0), to_float(a / 2, b / 2, h)))
                    body.push_back({Point{f[0].x, f[0].y, f[0].z}, Point{f[1].x, f[1].y, f[1].z},
                                    Point{f[2].x, f[2].y, f[2].z}});
                return body;
            }
            case 1:
                return turned(n, {{r, 0}, {r, h}});
            case 2:
                return turned(n, {{r, 0}, {uniform(0, 1) < 0.5 ? 0.0 : r / 3, h}});
            case 3: {
                std::vector<std::array<double, 2>> rings;
                for (int k = 0; k <= n / 2; ++k) {
                    const double v = std::numbers::pi * k / (n / 2);
                    rings.push_back({k == 0 || k == n / 2 ? 0.0 : r * std::sin(v), r - r * std::cos(v)});
                }
                return turned(n, rings);
            }
            default: {
                // A prism that leans: every point moves aside with its height.
                Body body = turned(3 + pick(4), {{r, 0}, {r, h}});
                const double dx = uniform(-0.6, 0.6), dy = uniform(-0.6, 0.6);
                for (auto& f : body)
                    for (Point& p : f) p[0] += dx * p[2], p[1] += dy * p[2];
                return body;
            }
        }
    }

    /// Anywhere over the plate, or beside, on or in line with a body that is there, but for next to nothing.
    shapes::Facets placed(const Body& body) {
        const double s = options_.size;
        Extent own{{1e300, 1e300, 1e300}, {-1e300, -1e300, -1e300}};
        for (const auto& f : body)
            for (const Point& p : f)
                for (std::size_t k = 0; k < 3; ++k)
                    own.low[k] = std::min(own.low[k], p[k]), own.high[k] = std::max(own.high[k], p[k]);
        Point move{uniform(0.15, 0.85) * s, uniform(0.15, 0.65) * s, uniform(0, 0.15) * s};
        const Extent& other = boxes_[static_cast<std::size_t>(pick(static_cast<int>(boxes_.size())))];
        constexpr std::array<double, 8> gaps{0, 0, 1e-6, 1e-5, 1e-4, 1e-3, 3e-3, 1e-2};
        for (int snaps = pick(3); snaps > 0; --snaps) {
            const auto axis = static_cast<std::size_t>(pick(3));
            const double gap = gaps[static_cast<std::size_t>(pick(8))] * (pick(2) == 0 ? 1 : -1);
            switch (pick(3)) {
                case 0:
                    move[axis] = other.high[axis] + gap - own.low[axis];
                    break;
                case 1:
                    move[axis] = other.low[axis] + gap - own.low[axis];
                    break;
                default:
                    move[axis] = other.high[axis] + gap - own.high[axis];
            }
        }
        move[2] = std::max(move[2], -own.low[2]);
        for (std::size_t k = 0; k < 3; ++k) own.low[k] += move[k], own.high[k] += move[k];
        boxes_.push_back(own);
        shapes::Facets facets;
        for (const auto& f : body)
            facets.push_back({to_float(f[0][0] + move[0], f[0][1] + move[1], f[0][2] + move[2]),
                              to_float(f[1][0] + move[0], f[1][1] + move[1], f[1][2] + move[2]),
                              to_float(f[2][0] + move[0], f[2][1] + move[1], f[2][2] + move[2])});
        return facets;
    }

    std::mt19937& random_;
    CompositionOptions options_;
    std::vector<Extent> boxes_;
};

/// The winding number around a point by the angles that the facets fill as seen from it.
inline int winding_by_angles(const shapes::Facets& facets, const std::array<double, 3>& p) {
    double sum = 0;
    for (const auto& f : facets) {
        std::array<std::array<double, 3>, 3> v;
        std::array<double, 3> length{};
        for (std::size_t k = 0; k < 3; ++k) {
            v[k] = {f[k].x - p[0], f[k].y - p[1], f[k].z - p[2]};
            length[k] = std::sqrt(v[k][0] * v[k][0] + v[k][1] * v[k][1] + v[k][2] * v[k][2]);
        }
        const auto dot = [&](std::size_t a, std::size_t b) {
            return v[a][0] * v[b][0] + v[a][1] * v[b][1] + v[a][2] * v[b][2];
        };
        const double volume = v[0][0] * (v[1][1] * v[2][2] - v[1][2] * v[2][1]) -
                              v[0][1] * (v[1][0] * v[2][2] - v[1][2] * v[2][0]) +
                              v[0][2] * (v[1][0] * v[2][1] - v[1][1] * v[2][0]);
        sum += 2 * std::atan2(volume, length[0] * length[1] * length[2] + dot(0, 1) * length[2] +
                                          dot(1, 2) * length[0] + dot(2, 0) * length[1]);
    }
    return static_cast<int>(std::lround(sum / (4 * std::numbers::pi)));
}

}  // namespace slabwright::test
