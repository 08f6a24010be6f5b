// Facets of a surface are divided until they lie within the deviation, and stay one net with the edges that
// bound them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>

#include "kernels/geometry/triangle.h"
#include "kernels/mesh/surface_facets.h"
#include "tests/support/seed.h"

namespace slabwright {
namespace {

/// A rectangle of parameters in `n` by `n` cells of two facets.
SurfaceFacets patch(const ParametricSurface& surface, double u0, double u1, double v0, double v1,
                    std::uint32_t n) {
    SurfaceFacets mesh;
    for (std::uint32_t j = 0; j <= n; ++j)
        for (std::uint32_t i = 0; i <= n; ++i) {
            const double u = u0 + (u1 - u0) * i / n, v = v0 + (v1 - v0) * j / n;
            mesh.at.push_back(surface(u, v));
            mesh.uv.push_back({u, v});
        }
    for (std::uint32_t j = 0; j < n; ++j)
        for (std::uint32_t i = 0; i < n; ++i) {
            const std::uint32_t a = j * (n + 1) + i, b = a + 1, c = a + n + 1, d = c + 1;
            mesh.facets.push_back({a, b, d});
            mesh.facets.push_back({a, d, c});
        }
    return mesh;
}

/// Edges that one facet knows; others must be known to two, once either way.
std::map<std::pair<std::uint32_t, std::uint32_t>, int> border(const SurfaceFacets& mesh) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> directed, open;
    for (const Index3& f : mesh.facets)
        for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(++directed[std::pair(f[k], f[(k + 1) % 3])], 1);
    for (const auto& [edge, count] : directed)
        if (!directed.contains({edge.second, edge.first})) open[edge] = count;
    return open;
}

TEST(SurfaceFacets, LieWithinTheDeviation) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> unit(0, 1);
    constexpr double pi = std::numbers::pi;
    for (int trial = 0; trial < 12; ++trial) {
        const double R = 20 + 60 * unit(random), r = 3 + 12 * unit(random), wave = 1 + 2 * unit(random),
                     deviation = std::pow(10, -0.5 - 2 * unit(random));
        const ParametricSurface torus = [&](double u, double v) {
            return Point3{(R + r * std::cos(v)) * std::cos(u), (R + r * std::cos(v)) * std::sin(u),
                          r * std::sin(v)};
        };
        // Its parameters run unevenly: u is the square of what it would be.
        const ParametricSurface waves = [&](double u, double v) {
            return Point3{10 * u * u, 10 * v, wave * std::sin(3 * u * u) * std::cos(2 * v)};
        };
        const bool is_torus = trial % 2 == 0;
        const ParametricSurface& surface = is_torus ? torus : waves;
        const double u1 = is_torus ? pi / 2 : 2, v1 = is_torus ? 1.5 : 3;
        SurfaceFacets mesh = patch(surface, 0, u1, 0, v1, 4);
        const SurfaceFacets before = mesh;
        const double off = refine_on(surface, deviation, mesh);
        const auto was = border(before), is = border(mesh);
        EXPECT_TRUE(was == is) << "edges that bound the surface stay as they are";
        for (std::size_t k = 0; k < before.at.size(); ++k) EXPECT_EQ(mesh.at[k], before.at[k]);
        for (std::size_t k = 0; k < mesh.at.size(); ++k)
            EXPECT_LE(length(minus(mesh.at[k], surface(mesh.uv[k][0], mesh.uv[k][1]))), 1e-12);
        // What is farther than a facet's width from the border is not held by it: there the surface is near.
        double most = 0;
        for (int k = 0; k < 300; ++k) {
            const double u = u1 * (0.3 + 0.4 * unit(random)), v = v1 * (0.3 + 0.4 * unit(random));
            const Point3 p = surface(u, v);
            double least = 1e9;
            for (const Index3& f : mesh.facets) {
                const Triangle at{mesh.at[f[0]], mesh.at[f[1]], mesh.at[f[2]]};
                least = std::min(least, length(minus(p, closest_on_triangle(p, at))));
            }
            most = std::max(most, least);
        }
        EXPECT_LE(most, deviation) << trial;
        EXPECT_GT(mesh.facets.size(), before.facets.size());
        EXPECT_GE(off, 0);
    }
}

// Two edges of a facet are divided, and the third, on the border, is whole: whichever that is.
TEST(SurfaceFacets, AFacetWithOneWholeEdgeIsDividedAsTheOthersAre) {
    const ParametricSurface dome = [](double u, double v) {
        return Point3{u, v, -0.01 * ((u - 3) * (u - 3) + (v - 4) * (v - 4))};
    };
    for (std::size_t first = 0; first < 3; ++first) {
        SurfaceFacets mesh;
        for (const auto& [u, v] :
             {std::array{0.0, 0.0}, std::array{10.0, 0.0}, {4.0, 9.0}, {12.0, 11.0}, {-6.0, 8.0}}) {
            mesh.at.push_back(dome(u, v));
            mesh.uv.push_back({u, v});
        }
        const std::array<std::uint32_t, 3> middle{0, 1, 2};
        mesh.facets = {
            {middle[first], middle[(first + 1) % 3], middle[(first + 2) % 3]}, {3, 2, 1}, {4, 0, 2}};
        const auto was = border(mesh);
        (void)refine_on(dome, 0.15, mesh);
        EXPECT_GT(mesh.facets.size(), 3U);
        EXPECT_TRUE(border(mesh) == was);
        double area = 0;
        for (const Index3& f : mesh.facets) {
            const auto &a = mesh.uv[f[0]], &b = mesh.uv[f[1]], &c = mesh.uv[f[2]];
            const double twice = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            EXPECT_GT(twice, 0);
            area += twice / 2;
        }
        EXPECT_NEAR(area, 45 + 42 + 43, 1e-9) << first;
    }
}

TEST(SurfaceFacets, WhatIsNearEnoughStays) {
    const ParametricSurface plane = [](double u, double v) { return Point3{u, v, 2 * u - v}; };
    SurfaceFacets mesh = patch(plane, 0, 100, 0, 50, 3);
    const std::size_t facets = mesh.facets.size();
    EXPECT_LE(refine_on(plane, 1e-3, mesh), 1e-12);
    EXPECT_EQ(mesh.facets.size(), facets);
    // A step is no surface that facets come near to; it ends all the same, and what is off is told.
    const ParametricSurface step = [](double u, double v) { return Point3{u, v, u < 40 ? 0.0 : 5.0}; };
    SurfaceFacets stair = patch(step, 0, 100, 0, 50, 3);
    EXPECT_GT(refine_on(step, 1e-3, stair), 1e-3);
    EXPECT_LE(stair.facets.size(), 1000 * facets);
}

}  // namespace
}  // namespace slabwright
