// Fewer facets for the same surface: the tolerance is a bound everywhere, what was closed stays closed,
// planes become as few facets as they need, and the same on any number of threads.
#include "kernels/mesh/simplify.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "kernels/access/closest_point.h"
#include "kernels/errors.h"
#include "kernels/mesh/weld.h"
#include "kernels/slicing/slicing.h"
#include "tests/data/models.h"
#include "tests/support/closed_mesh.h"
#include "tests/support/height_field.h"
#include "tests/support/seed.h"

namespace slabwright {
namespace {

// The farthest of random points of a's surface, its vertices and the middles of its edges from b's.
double farthest(Context& context, MeshView a, MeshView b, std::mt19937& random) {
    const ClosestPoint closest(context, b);
    std::uniform_real_distribution<double> share(0, 1);
    double most = 0;
    for (const Index3& f : a.facets)
        for (int k = 0; k < 12; ++k) {
            std::array<double, 3> w{share(random), share(random), share(random)};
            if (k < 3) w = {k == 0 ? 1.0 : 0.0, k == 1 ? 1.0 : 0.0, k == 2 ? 1.0 : 0.0};
            else if (k < 6) w[static_cast<std::size_t>(k - 3)] = 0;
            const double sum = w[0] + w[1] + w[2];
            Point3 p{};
            for (std::size_t c = 0; c < 3; ++c) {
                const Vec3f& v = a.vertices[f[c]];
                p[0] += w[c] / sum * v.x, p[1] += w[c] / sum * v.y, p[2] += w[c] / sum * v.z;
            }
            most = std::max(most, closest.query_unsigned(p, 1e9).distance);
        }
    return most;
}

void expect_same_solid(Context& context, MeshView mesh, const Mesh& few, double tolerance,
                       std::mt19937& random) {
    EXPECT_TRUE(test::closed(few.view()));
    for (const Index3& n : few.neighbours)
        for (const std::uint32_t g : n) ASSERT_NE(g, kNoFacet);
    EXPECT_LE(farthest(context, mesh, few.view(), random), tolerance * 1.0001 + 1e-7);
    EXPECT_LE(farthest(context, few.view(), mesh, random), tolerance * 1.0001 + 1e-7);
    EXPECT_NEAR(test::volume(few.view()), test::volume(mesh), 1e-3 * test::volume(mesh));
}

// Smooth waves of random heights, finely facetted, with a step: the steeper and the rougher the tolerance,
// the fewer facets stay.
TEST(Simplify, StaysWithinTheToleranceOnRandomSurfaces) {
    std::mt19937 random(test::seed());
    Context context;
    for (int round = 0; round < 12; ++round) {
        std::uniform_real_distribution<double> between(0, 1);
        const double amplitude = 0.02 + 2 * between(random), wave = 3 + 20 * between(random),
                     slope = 0.4 * between(random), step = round % 2 ? 3.0 : 0.0,
                     noise = round % 3 == 0 ? 0.002 : 0.0;
        std::vector<double> rough(64 * 64);
        for (double& r : rough) r = between(random);
        const Mesh mesh = test::height_field(context, 48, 0.5, [&](double x, double y) {
            return 8 + amplitude * std::sin(x / wave * 6.28) * std::cos(y / wave * 6.28) + slope * x +
                   (x > 3 ? step : 0.0) +
                   noise * rough[static_cast<std::size_t>(std::lround(2 * x + 24) * 64 +
                                                          std::lround(2 * y + 24))];
        });
        std::size_t before = mesh.facets.size();
        for (const double tolerance : {0.001, 0.01, 0.1}) {
            SCOPED_TRACE(testing::Message() << "round " << round << " tolerance " << tolerance);
            const Mesh few = simplify(context, mesh.view(), tolerance);
            expect_same_solid(context, mesh.view(), few, tolerance, random);
            EXPECT_LE(few.facets.size(), before);
            before = few.facets.size();
        }
        EXPECT_LT(before, mesh.facets.size() * 6 / 10);
    }
}

TEST(Simplify, PlanesNeedFewFacets) {
    Context context;
    std::mt19937 random(test::seed());
    const Mesh mesh = test::height_field(context, 64, 0.5, [](double, double) { return 5.0; });
    const Mesh few = simplify(context, mesh.view(), 0.001);
    // Those of a box, and a few about vertices that too many facets meet in.
    EXPECT_LT(few.facets.size(), 150u);
    expect_same_solid(context, mesh.view(), few, 1e-7, random);
    // A roof's ridge and eaves stay where they are.
    const Mesh roof = test::height_field(context, 64, 0.5, [](double x, double) { return 20 - std::abs(x); });
    const Mesh light = simplify(context, roof.view(), 0.001);
    EXPECT_LT(light.facets.size(), 300u);
    expect_same_solid(context, roof.view(), light, 1e-6, random);
}

TEST(Simplify, OwnModelsStayTheyAre) {
    Context context;
    std::mt19937 random(test::seed());
    for (const auto& facets : {half_sphere(), pump_cover()}) {
        const Mesh mesh = weld(context, facets);
        expect_same_solid(context, mesh.view(), simplify(context, mesh.view(), 0.01), 0.01, random);
    }
}

// A thousandth of a millimetre in height moves the section of a surface that is nearly level by far more, so
// there nothing moves.
TEST(Simplify, SectionsOfNearlyLevelSurfacesStay) {
    Context context;
    const Mesh mesh = test::height_field(
        context, 64, 0.5, [](double x, double y) { return 10 - 0.002 * x * x - 0.001 * y * y; });
    const std::vector<double> planes{9.3, 9.8};
    const Mesh kept = simplify(context, mesh.view(), 0.02, planes),
               moved = simplify(context, mesh.view(), 0.02);
    EXPECT_LT(kept.facets.size(), mesh.facets.size() * 9 / 10);
    double most = 0;
    for (const double z : planes) {
        const Plane plane{z, Side::above};
        auto section = [&](const Mesh& of) { return area(slice(context, of.view(), {&plane, 1})[0].loops); };
        EXPECT_DOUBLE_EQ(section(kept), section(mesh)) << z;
        most = std::max(most, std::abs(section(moved) / section(mesh) - 1));
    }
    EXPECT_GT(most, 0.01);
}

// A tetrahedron has nothing to spare; two that touch at a vertex or along an edge are not torn, joined or
// turned inside out.
TEST(Simplify, KeepsSmallAndTouchingBodies) {
    Context context;
    const Vec3f o{0, 0, 0}, x{4, 0, 0}, y{0, 4, 0}, z{0, 0, 4}, u{-4, 0, 0}, v{0, -4, 0};
    auto body = [](Vec3f a, Vec3f b, Vec3f c, Vec3f d) {
        return std::vector<Facet>{{a, c, b}, {a, b, d}, {b, c, d}, {c, a, d}};
    };
    const std::vector<Facet> one = body(o, x, y, z),
                             at_edge = body(o, u, v, z);  // both have the edge from o to z
    std::vector<Facet> both = one;
    both.insert(both.end(), at_edge.begin(), at_edge.end());
    for (const auto& facets : {one, both}) {
        const Mesh mesh = weld(context, facets);
        const Mesh same = simplify(context, mesh.view(), 0.1);
        EXPECT_EQ(same.facets.size(), facets.size());
        EXPECT_TRUE(test::closed(same.view()));
        EXPECT_NEAR(test::volume(same.view()), test::volume(mesh.view()), 1e-6);
    }
    EXPECT_TRUE(simplify(context, MeshView{}, 0.1).facets.empty());
}

TEST(Simplify, OpenEdgesStay) {
    Context context;
    std::vector<Facet> sheet;
    auto at = [](int i, int j) { return Vec3f{static_cast<float>(i), static_cast<float>(j), 0}; };
    for (int i = 0; i < 10; ++i)
        for (int j = 0; j < 10; ++j) {
            sheet.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
            sheet.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
        }
    const Mesh mesh = weld(context, sheet);
    const Mesh few = simplify(context, mesh.view(), 0.01);
    std::size_t open = 0;
    for (const Index3& n : few.neighbours)
        for (const std::uint32_t g : n) open += g == kNoFacet;
    EXPECT_EQ(open, 40u);
    EXPECT_LT(few.facets.size(), 60u);
}

TEST(Simplify, SameOnAnyThreadsAndInAnyOrderClosed) {
    Context one({.threads = 1}), four({.threads = 4});
    std::vector<Facet> facets;
    MetrePattern pattern;
    pattern.facets = 200'000;
    pattern.size_mm = 200;
    pattern.height_mm = 20;
    metre_pattern(pattern, [&](const Facet& f) { facets.push_back(f); });
    const Mesh mesh = weld(one, facets);
    const Mesh a = simplify(one, mesh.view(), 0.001), b = simplify(four, mesh.view(), 0.001);
    EXPECT_EQ(a.vertices, b.vertices);
    EXPECT_EQ(a.facets, b.facets);
    EXPECT_EQ(a.neighbours, b.neighbours);
    EXPECT_LT(a.facets.size(), mesh.facets.size() / 2);
    std::shuffle(facets.begin(), facets.end(), std::mt19937(test::seed()));
    const Mesh shuffled = simplify(one, weld(one, facets).view(), 0.001);
    EXPECT_TRUE(test::closed(shuffled.view()));
    EXPECT_NEAR(static_cast<double>(shuffled.facets.size()), static_cast<double>(a.facets.size()),
                0.05 * static_cast<double>(a.facets.size()));
}

TEST(Simplify, RefusesAndCancels) {
    Context context;
    const Mesh mesh = weld(context, pump_cover());
    EXPECT_THROW((void)simplify(context, mesh.view(), 0), Error);
    EXPECT_THROW((void)simplify(context, mesh.view(), NAN), Error);
    context.cancel();
    EXPECT_THROW((void)simplify(context, mesh.view(), 0.01), Error);
}

}  // namespace
}  // namespace slabwright
