// Fewer facets for a picture: how many, how near, how closed, and the same on any number of threads.
#include "kernels/mesh/decimate.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <utility>

#include "kernels/access/closest_point.h"
#include "kernels/access/deviation.h"
#include "kernels/errors.h"
#include "kernels/mesh/slopes.h"
#include "kernels/mesh/weld.h"
#include "tests/data/models.h"
#include "tests/support/closed_mesh.h"

namespace slabwright {
namespace {

using test::closed;
using test::volume;

Mesh welded(Context& context, const std::vector<Facet>& facets) { return weld(context, facets); }

TEST(Decimate, KeepsTheShapeOfOwnModels) {
    Context context;
    for (const auto& facets : {half_sphere(), pump_cover()}) {
        const Mesh mesh = welded(context, facets);
        const std::size_t wished = mesh.facets.size() / 4;
        const Mesh few = decimate(context, mesh.view(), wished);
        EXPECT_LE(few.facets.size(), wished);
        EXPECT_GT(few.facets.size(), wished * 9 / 10);
        EXPECT_TRUE(closed(few.view()));
        EXPECT_NEAR(volume(few.view()), volume(mesh.view()), 0.003 * volume(mesh.view()));
        const double error =
            surface_deviation(context, StandingPart(context, mesh.view()), StandingPart(context, few.view()));
        const Box3 box = bounds(mesh.view());
        EXPECT_GT(error, 0);
        EXPECT_LT(error, 0.003 * (box.max.x - box.min.x));
    }
}

TEST(Decimate, FlatPlatesNeedFewFacets) {
    // A plate whose top is a fine grid: all of that is flat, so hardly anything of it is needed, and nothing
    // moves.
    std::vector<Facet> facets;
    const int n = 30;
    const auto quad = [&](Vec3f a, Vec3f b, Vec3f c, Vec3f d) {
        facets.push_back({a, b, c});
        facets.push_back({a, c, d});
    };
    const auto f = [](int v) { return static_cast<float>(v); };
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
            quad({f(i), f(j), 5}, {f(i + 1), f(j), 5}, {f(i + 1), f(j + 1), 5}, {f(i), f(j + 1), 5});
            quad({f(i), f(j), 0}, {f(i), f(j + 1), 0}, {f(i + 1), f(j + 1), 0}, {f(i + 1), f(j), 0});
        }
    for (int i = 0; i < n; ++i) {
        quad({f(i), 0, 0}, {f(i + 1), 0, 0}, {f(i + 1), 0, 5}, {f(i), 0, 5});
        quad({f(i + 1), f(n), 0}, {f(i), f(n), 0}, {f(i), f(n), 5}, {f(i + 1), f(n), 5});
        quad({0, f(i + 1), 0}, {0, f(i), 0}, {0, f(i), 5}, {0, f(i + 1), 5});
        quad({f(n), f(i), 0}, {f(n), f(i + 1), 0}, {f(n), f(i + 1), 5}, {f(n), f(i), 5});
    }
    Context context;
    const Mesh mesh = welded(context, facets);
    ASSERT_TRUE(closed(mesh.view()));
    const Mesh few = decimate(context, mesh.view(), 60);
    EXPECT_LE(few.facets.size(), 60u);
    EXPECT_TRUE(closed(few.view()));
    EXPECT_LT(
        surface_deviation(context, StandingPart(context, mesh.view()), StandingPart(context, few.view())),
        1e-3);
    EXPECT_NEAR(volume(few.view()), 5.0 * n * n, 1e-2);
}

TEST(Decimate, SameOnAnyThreadsAndUntouchedWhenSmall) {
    Context one({.threads = 1}), four({.threads = 4});
    const Mesh mesh = welded(one, pump_cover());
    const Mesh a = decimate(one, mesh.view(), 3000), b = decimate(four, mesh.view(), 3000);
    EXPECT_EQ(a.vertices, b.vertices);
    EXPECT_EQ(a.facets, b.facets);
    const Mesh same = decimate(one, mesh.view(), mesh.facets.size());
    EXPECT_EQ(same.facets.size(), mesh.facets.size());
    EXPECT_LT(surface_deviation(one, StandingPart(one, mesh.view()), StandingPart(one, same.view())), 1e-9);
    EXPECT_TRUE(decimate(one, MeshView{}, 100).facets.empty());
}

TEST(Decimate, AGridKeepsEdges) {
    // A block whose sides are fine grids, turned so that no side lies along the cells: merged vertices must
    // go back to its edges and corners.
    const int n = 60;
    const auto turned = [&](double x, double y, double z) {
        const double c = std::cos(0.4), s = std::sin(0.4), u = c * x - s * y, v = s * x + c * y;
        return Vec3f{static_cast<float>(u), static_cast<float>(c * v - s * z),
                     static_cast<float>(s * v + c * z)};
    };
    std::vector<Facet> facets;
    for (int side = 0; side < 6; ++side)
        for (int i = 0; i < n; ++i)
            for (int j = 0; j < n; ++j) {
                const auto at = [&](int a, int b) {
                    std::array<double, 3> p{};
                    const auto axis = static_cast<std::size_t>(side / 2);
                    p[axis] = side % 2 * n, p[(axis + 1) % 3] = a, p[(axis + 2) % 3] = b;
                    return turned(p[0], p[1], p[2]);
                };
                Vec3f a = at(i, j), b = at(i + 1, j), c = at(i + 1, j + 1), d = at(i, j + 1);
                if (side % 2 == 0) std::swap(b, d);
                facets.push_back({a, b, c});
                facets.push_back({a, c, d});
            }
    Context one({.threads = 1}), four({.threads = 4});
    const Mesh mesh = welded(one, facets);
    ASSERT_TRUE(closed(mesh.view()));
    // 6000 facets are aimed at: cells of 2.7 mm.
    const Mesh few = decimate(one, mesh.view(), 5000, 24'000),
               same = decimate(four, mesh.view(), 5000, 24'000);
    EXPECT_EQ(few.vertices, same.vertices);
    EXPECT_EQ(few.facets, same.facets);
    EXPECT_LE(few.facets.size(), 5000u);
    EXPECT_GT(few.facets.size(), 1000u);
    EXPECT_LT(surface_deviation(one, StandingPart(one, mesh.view()), StandingPart(one, few.view())), 0.1);
    EXPECT_NEAR(volume(few.view()), 1.0 * n * n * n, 1e-3 * n * n * n);
}

TEST(Decimate, AGridKeepsTheShapeOfOwnModels) {
    Context context;
    for (const auto& facets : {half_sphere(), pump_cover()}) {
        const Mesh mesh = welded(context, facets);
        const Mesh few = decimate(context, mesh.view(), mesh.facets.size() / 40, mesh.facets.size());
        EXPECT_LE(few.facets.size(), mesh.facets.size() / 40);
        const Box3 box = bounds(mesh.view());
        const double area = 2 * (box.max.x - box.min.x) * (box.max.y - box.min.y);
        const double cell = std::sqrt(2 * area / (static_cast<double>(mesh.facets.size()) / 4));
        EXPECT_LT(
            surface_deviation(context, StandingPart(context, mesh.view()), StandingPart(context, few.view())),
            3 * cell);
        EXPECT_NEAR(volume(few.view()), volume(mesh.view()), 0.02 * volume(mesh.view()));
    }
}

TEST(Decimate, Cancels) {
    Context context;
    const Mesh mesh = welded(context, pump_cover());
    context.cancel();
    EXPECT_THROW((void)decimate(context, mesh.view(), 1000), Error);
}

TEST(Deviation, IsTheDistanceOfShiftedPlanes) {
    Context context;
    const std::uint32_t seed = 7;
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    for (int round = 0; round < 20; ++round) {
        const float up = std::uniform_real_distribution<float>(0.01f, 3.0f)(random);
        Mesh a, b;
        a.vertices = {{0, 0, 0}, {10, 0, 0}, {0, 10, 0}};
        b.vertices = {{0, 0, up}, {10, 0, up}, {0, 10, up}};
        a.facets = b.facets = {{0, 1, 2}};
        EXPECT_NEAR(
            surface_deviation(context, StandingPart(context, a.view()), StandingPart(context, b.view())), up,
            1e-6);
    }
}

TEST(Deviation, AgreesWithClosestPoints) {
    Context context;
    const Mesh mesh = welded(context, pump_cover());
    const auto farthest = [&](const Mesh& from, const Mesh& to) {
        double most = 0;
        const ClosestPoint closest(context, to.view());
        for (const Index3& f : from.facets) {
            Point3 middle{};
            for (const std::uint32_t i : f) {
                const Vec3f& v = from.vertices[i];
                most = std::max(most, closest.query_unsigned({v.x, v.y, v.z}, 1e9).distance);
                middle[0] += v.x / 3.0, middle[1] += v.y / 3.0, middle[2] += v.z / 3.0;
            }
            most = std::max(most, closest.query_unsigned(middle, 1e9).distance);
        }
        return most;
    };
    for (const std::size_t count : {200U, 900U, 3000U}) {
        const Mesh few = decimate(context, mesh.view(), count);
        const StandingPart a(context, mesh.view()), b(context, few.view());
        const double there = farthest(mesh, few), back = farthest(few, mesh);
        EXPECT_GT(there, 1e-4);
        EXPECT_NEAR(a.farthest_from(context, b, 0), there, 1e-9);
        EXPECT_NEAR(b.farthest_from(context, a, 0), back, 1e-9);
        EXPECT_NEAR(a.farthest_from(context, b, 0.9 * there), there, 1e-9);
        EXPECT_EQ(a.farthest_from(context, b, 1.1 * there), 1.1 * there);
        EXPECT_NEAR(surface_deviation(context, a, b), std::max(there, back), 1e-9);
        EXPECT_NEAR(surface_deviation(context, b, a), std::max(there, back), 1e-9);
    }
}

TEST(Slopes, OfACone) {
    // A cone of slope 60° on a base: every height but the base has the slope of its facets.
    std::vector<Facet> facets;
    const int n = 360;
    const float radius = 20, height = static_cast<float>(radius * std::tan(M_PI / 3));
    const auto rim = [&](int i) {
        const double angle = 2 * M_PI * (i % n) / n;
        return Vec3f{static_cast<float>(radius * std::cos(angle)),
                     static_cast<float>(radius * std::sin(angle)), 0};
    };
    for (int i = 0; i < n; ++i) {
        facets.push_back({Vec3f{0, 0, height}, rim(i), rim(i + 1)});
        facets.push_back({Vec3f{0, 0, 0}, rim(i + 1), rim(i)});
    }
    Context context;
    const Mesh mesh = welded(context, facets);
    const SlopeProfile profile = slope_profile(context, mesh.view(), 50);
    for (const double least : profile.least_deg) EXPECT_NEAR(least, 60, 0.05);
    double sum = 0;
    for (const double area : profile.area_mm2) sum += area;
    EXPECT_NEAR(sum, M_PI * radius * 2 * radius, 0.5);  // slant length is twice the radius
    EXPECT_NEAR(profile.down_flat_mm2, M_PI * radius * radius, 0.3);
    EXPECT_EQ(profile.undercut_mm2, 0);
}

TEST(Slopes, AgreeWithBruteForceOnThePumpCover) {
    Context context;
    const Mesh mesh = welded(context, pump_cover());
    const int steps = 37;
    const SlopeProfile profile = slope_profile(context, mesh.view(), steps);
    const double step = (profile.z_high - profile.z_low) / steps;
    for (int i = 0; i < steps; ++i) {
        const double low = profile.z_low + i * step, high = low + step;
        double least = 90;
        for (const Index3& f : mesh.facets) {
            const Vec3f &a = mesh.vertices[f[0]], &b = mesh.vertices[f[1]], &c = mesh.vertices[f[2]];
            if (std::max({a.z, b.z, c.z}) <= low + 1e-6 || std::min({a.z, b.z, c.z}) >= high - 1e-6) continue;
            const double nx =
                (double{b.y} - a.y) * (double{c.z} - a.z) - (double{b.z} - a.z) * (double{c.y} - a.y);
            const double ny =
                (double{b.z} - a.z) * (double{c.x} - a.x) - (double{b.x} - a.x) * (double{c.z} - a.z);
            const double nz =
                (double{b.x} - a.x) * (double{c.y} - a.y) - (double{b.y} - a.y) * (double{c.x} - a.x);
            if (nz < 0) continue;
            least = std::min(least, std::atan2(std::hypot(nx, ny), nz) * 180 / M_PI);
        }
        // Flats at a step's very border belong to one side of it; the profile may take them where brute force
        // does not.
        EXPECT_LE(profile.least_deg[static_cast<std::size_t>(i)], least + 1e-6) << i;
        if (profile.least_deg[static_cast<std::size_t>(i)] > 0.01) {
            EXPECT_NEAR(profile.least_deg[static_cast<std::size_t>(i)], least, 1e-6) << i;
        }
    }
}

}  // namespace
}  // namespace slabwright
