// A closed solid under a random height field, for tests: heights in steps so that flats and coincident levels
// are common.
#pragma once

#include <cstdint>
#include <functional>
#include <random>
#include <vector>

#include "kernels/mesh/weld.h"
#include "kernels/parallel/context.h"

namespace slabwright::test {

/// n × n cells of `pitch` mm around the origin; heights are `height(x, y)`, the base lies at z = 0.
inline Mesh height_field(Context& context, int n, double pitch,
                         const std::function<double(double, double)>& height) {
    auto at = [&](int i, int j, bool top) {
        const double x = (i - n / 2.0) * pitch, y = (j - n / 2.0) * pitch;
        return Vec3f{static_cast<float>(x), static_cast<float>(y),
                     top ? static_cast<float>(height(x, y)) : 0.0F};
    };
    std::vector<std::array<Vec3f, 3>> facets;
    auto quad = [&](Vec3f a, Vec3f b, Vec3f c, Vec3f d) {
        facets.push_back({a, b, c});
        facets.push_back({a, c, d});
    };
    for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
            quad(at(i, j, true), at(i + 1, j, true), at(i + 1, j + 1, true), at(i, j + 1, true));
            quad(at(i, j + 1, false), at(i + 1, j + 1, false), at(i + 1, j, false), at(i, j, false));
        }
    for (int k = 0; k < n; ++k) {
        quad(at(k, 0, false), at(k + 1, 0, false), at(k + 1, 0, true), at(k, 0, true));
        quad(at(k + 1, n, false), at(k, n, false), at(k, n, true), at(k + 1, n, true));
        quad(at(0, k + 1, false), at(0, k, false), at(0, k, true), at(0, k + 1, true));
        quad(at(n, k, false), at(n, k + 1, false), at(n, k + 1, true), at(n, k, true));
    }
    return weld(context, facets);
}

/// Random heights between 1 and `high` mm in multiples of `step`.
inline Mesh random_height_field(Context& context, int n, double pitch, double high, double step,
                                std::uint32_t seed) {
    std::mt19937 random(seed);
    std::vector<double> heights;
    for (int k = 0; k < (n + 1) * (n + 1); ++k)
        heights.push_back(
            1 + step * static_cast<double>(random() % static_cast<std::uint32_t>((high - 1) / step + 1)));
    return height_field(context, n, pitch, [&](double x, double y) {
        const int i = static_cast<int>(std::lround(x / pitch + n / 2.0)),
                  j = static_cast<int>(std::lround(y / pitch + n / 2.0));
        return heights[static_cast<std::size_t>(j * (n + 1) + i)];
    });
}

}  // namespace slabwright::test
