// The mesh report: every finding on small solids, and inverted bodies against a nesting known beforehand.
#include "kernels/mesh/report.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <vector>

#include "kernels/mesh/weld.h"
#include "tests/mesh_shapes.h"
#include "tests/support/seed.h"

namespace slabwright {
namespace {

using shapes::Facets;

MeshReport report_of(const Facets& facets, int threads = 2) {
    Context context({.threads = threads});
    return report_mesh(context, weld(context, facets).view());
}

void expect_finding(const Finding& finding, std::uint64_t count, std::uint32_t first) {
    EXPECT_EQ(finding.count, count);
    EXPECT_EQ(finding.first_facet, count == 0 ? kNoFacet : first);
}

TEST(MeshReport, EmptyMesh) {
    const MeshReport report = report_of({});
    EXPECT_EQ(report.facets, 0u);
    EXPECT_EQ(report.components, 0u);
    EXPECT_EQ(report.volume_mm3, 0);
    expect_finding(report.open_edges, 0, 0);
}

TEST(MeshReport, SoundBox) {
    const MeshReport report = report_of(shapes::box({1, 2, 3}, {11, 22, 33}));
    EXPECT_EQ(report.facets, 12u);
    EXPECT_EQ(report.vertices, 8u);
    EXPECT_EQ(report.components, 1u);
    EXPECT_DOUBLE_EQ(report.volume_mm3, 6000);
    EXPECT_DOUBLE_EQ(report.area_mm2, 2 * (200 + 300 + 600));
    EXPECT_EQ(report.box.min, (Vec3f{1, 2, 3}));
    EXPECT_EQ(report.box.max, (Vec3f{11, 22, 33}));
    for (const Finding* finding :
         {&report.open_edges, &report.open_edges_off_base, &report.non_manifold_edges,
          &report.misoriented_edges, &report.degenerate_facets, &report.duplicate_facets,
          &report.inverted_components})
        expect_finding(*finding, 0, 0);
}

TEST(MeshReport, OpenInTheBaseAndAboveIt) {
    Facets facets = shapes::box({0, 0, 0}, {10, 10, 10});
    facets.erase(facets.begin(), facets.begin() + 2);  // the bottom
    MeshReport report = report_of(facets);
    EXPECT_EQ(report.open_edges.count, 4u);
    expect_finding(report.open_edges_off_base, 0, 0);
    EXPECT_DOUBLE_EQ(report.volume_mm3, 1000) << "an opening in the base counts as filled";

    report = report_of(shapes::flipped(facets));
    expect_finding(report.inverted_components, 1, 0);

    facets = shapes::box({0, 0, 0}, {10, 10, 10});
    facets.erase(facets.begin() + 2);  // half of the top: facets 2 and later move down by one
    report = report_of(facets);
    EXPECT_EQ(report.open_edges.count, 3u);
    expect_finding(report.open_edges_off_base, 3, 2);
}

TEST(MeshReport, OneFlippedFacet) {
    Facets facets = shapes::box({0, 0, 0}, {1, 1, 1});
    std::swap(facets[5][0], facets[5][1]);
    const MeshReport report = report_of(facets);
    EXPECT_EQ(report.misoriented_edges.count, 3u);
    expect_finding(report.open_edges, 0, 0);
    expect_finding(report.non_manifold_edges, 0, 0);
    EXPECT_EQ(report.components, 1u) << "a misoriented edge still holds a body together";
}

TEST(MeshReport, TouchingBodiesAreNonManifoldButSound) {
    Facets facets = shapes::box({0, 0, 0}, {1, 1, 1});
    shapes::append(facets, shapes::box({1, 1, 0}, {2, 2, 1}));
    const MeshReport report = report_of(facets);
    EXPECT_EQ(report.non_manifold_edges.count, 1u);
    EXPECT_EQ(report.components, 2u);
    expect_finding(report.misoriented_edges, 0, 0);
    expect_finding(report.open_edges, 0, 0);
    for (std::size_t f = 0; f < 24; ++f) EXPECT_EQ(report.component_of[f], f < 12 ? 0u : 1u);
}

TEST(MeshReport, FinAtAnEdgeIsMisoriented) {
    Facets facets = shapes::box({0, 0, 0}, {1, 1, 1});
    facets.push_back({Vec3f{0, 0, 0}, {1, 0, 0}, {0.5f, -1, 0}});
    const MeshReport report = report_of(facets);
    EXPECT_EQ(report.non_manifold_edges.count, 1u);
    EXPECT_EQ(report.misoriented_edges.count, 1u);
    expect_finding(report.open_edges, 2, 12);
    expect_finding(report.open_edges_off_base, 0, 0);
}

TEST(MeshReport, DegenerateFacets) {
    Facets facets = shapes::box({0, 0, 0}, {1, 1, 1});
    facets.push_back({Vec3f{0, 0, 0}, {1, 0, 0}, {0, 0, 0}});  // two equal corners: changes nothing else
    MeshReport report = report_of(facets);
    expect_finding(report.degenerate_facets, 1, 12);
    expect_finding(report.open_edges, 0, 0);
    expect_finding(report.non_manifold_edges, 0, 0);
    expect_finding(report.misoriented_edges, 0, 0);

    facets.back() = {Vec3f{3, 3, 3}, {4, 4, 4}, {6, 6, 6}};  // three corners in a line
    report = report_of(facets);
    expect_finding(report.degenerate_facets, 1, 12);
    EXPECT_EQ(report.open_edges.count, 3u);
}

TEST(MeshReport, DuplicateFacets) {
    Facets facets = shapes::box({0, 0, 0}, {1, 1, 1});
    facets.push_back({facets[4][1], facets[4][2], facets[4][0]});  // turned
    facets.push_back({facets[4][1], facets[4][0], facets[4][2]});  // and reversed
    const MeshReport report = report_of(facets);
    expect_finding(report.duplicate_facets, 2, 12);
    EXPECT_EQ(report.non_manifold_edges.count, 3u);
    expect_finding(report.misoriented_edges, 0, 0);
}

bool operator==(const Finding& a, const Finding& b) {
    return a.count == b.count && a.first_facet == b.first_facet;
}

/// What weld() says about odd edges must not change the report.
void expect_same_with_odd(Context& context, const Facets& facets) {
    std::vector<std::uint32_t> odd{1, 2, 3};  // whatever was in it goes
    const Mesh mesh = weld(context, facets, &odd);
    const MeshReport all = report_mesh(context, mesh.view()), some = report_mesh(context, mesh.view(), &odd);
    ASSERT_TRUE(std::is_sorted(odd.begin(), odd.end()));
    ASSERT_TRUE(some.open_edges == all.open_edges);
    ASSERT_TRUE(some.open_edges_off_base == all.open_edges_off_base);
    ASSERT_TRUE(some.non_manifold_edges == all.non_manifold_edges);
    ASSERT_TRUE(some.misoriented_edges == all.misoriented_edges);
    ASSERT_TRUE(some.degenerate_facets == all.degenerate_facets);
    ASSERT_TRUE(some.duplicate_facets == all.duplicate_facets)
        << some.duplicate_facets.count << " instead of " << all.duplicate_facets.count;
    ASSERT_TRUE(some.inverted_components == all.inverted_components);
    ASSERT_EQ(some.component_of, all.component_of);
    ASSERT_EQ(some.volume_mm3, all.volume_mm3);
}

TEST(MeshReport, OddEdgesAreAllThatMatters) {
    std::mt19937_64 random(test::seed());
    Context context({.threads = 2});
    std::vector<std::uint32_t> odd;
    static_cast<void>(weld(context, shapes::torus(40), &odd));
    EXPECT_TRUE(odd.empty()) << "a closed mesh has no odd edges";
    for (int round = 0; round < 200; ++round) {
        // A good mesh, spoilt in a few places; and a body of two facets back to back, whose edges all look
        // good.
        Facets facets = shapes::torus(12);
        for (std::uint64_t fault = random() % 4; fault > 0; --fault) {
            const std::size_t at = random() % facets.size();
            const auto facet = facets[at];
            switch (random() % 6) {
                case 0:
                    facets.erase(facets.begin() + static_cast<std::ptrdiff_t>(at));
                    break;
                case 1:
                    std::swap(facets[at][0], facets[at][1]);
                    break;
                case 2:
                    facets.push_back(facet);
                    break;
                case 3:
                    facets.push_back({facet[1], facet[0], facet[2]});
                    break;
                case 4:
                    facets.push_back({facet[0], facet[1], facet[0]});
                    break;
                default: {
                    const float x = static_cast<float>(random() % 3);
                    const Vec3f a{x, 900, 0}, b{x, 901, 0}, c{x, 901, 5};
                    facets.push_back({a, b, c});
                    facets.push_back({b, a, c});
                }
            }
        }
        if (round % 2 == 0) std::shuffle(facets.begin(), facets.end(), random);
        expect_same_with_odd(context, facets);
    }
    // Fans of any size, closed and open, and soups in which anything meets anything.
    for (std::size_t spokes = 3; spokes < 60; ++spokes) {
        Facets fan;
        auto rim = [&](std::size_t i) { return Vec3f{float(i % spokes), float(i % spokes * i % spokes), 1}; };
        for (std::size_t i = 0; i < spokes; ++i) fan.push_back({Vec3f{0.5f, 0.5f, 0}, rim(i), rim(i + 1)});
        for (std::size_t i = 0; i < spokes; i += 1 + random() % 2)
            fan.push_back({Vec3f{0.5f, 0.5f, 2}, rim(i + 1), rim(i)});
        expect_same_with_odd(context, fan);
    }
    for (int round = 0; round < 300; ++round) {
        const std::uint64_t grid = 2 + random() % 3;
        Facets facets(1 + random() % 60);
        for (auto& facet : facets)
            for (Vec3f& p : facet) p = {float(random() % grid), float(random() % grid), float(random() % 2)};
        expect_same_with_odd(context, facets);
    }
}

TEST(MeshReport, CountsEqualBruteForceOnRandomSoup) {
    std::mt19937_64 random(test::seed());
    for (int round = 0; round < 300; ++round) {
        // Few points, so that facets share edges in every way.
        const std::uint64_t grid = 2 + random() % 3;
        Facets facets(1 + random() % 60);
        for (auto& facet : facets)
            for (Vec3f& p : facet) p = {float(random() % grid), float(random() % grid), float(random() % 2)};
        Context context({.threads = 1 + round % 3});
        const Mesh mesh = weld(context, facets);
        const MeshReport report = report_mesh(context, mesh.view());

        struct Uses {
            std::vector<std::uint32_t> facets;
            int forward = 0;
        };
        std::map<std::pair<std::uint32_t, std::uint32_t>, Uses> edges;
        std::map<std::array<std::uint32_t, 3>, std::uint32_t> seen;
        std::uint64_t degenerate = 0, duplicate = 0;
        double area = 0;
        for (std::uint32_t f = 0; f < mesh.facets.size(); ++f) {
            Index3 v = mesh.facets[f];
            const auto& c = facets[f];
            const double ux = c[1].x - c[0].x, uy = c[1].y - c[0].y, uz = c[1].z - c[0].z,
                         vx = c[2].x - c[0].x, vy = c[2].y - c[0].y, vz = c[2].z - c[0].z;
            const double twice = std::sqrt(std::pow(uy * vz - uz * vy, 2) + std::pow(uz * vx - ux * vz, 2) +
                                           std::pow(ux * vy - uy * vx, 2));
            degenerate += twice == 0;
            area += twice / 2;
            if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) continue;
            for (std::size_t k = 0; k < 3; ++k) {
                const std::uint32_t a = v[k], b = v[(k + 1) % 3];
                Uses& uses = edges[std::minmax(a, b)];
                uses.facets.push_back(f);
                uses.forward += a < b;
            }
            std::sort(v.begin(), v.end());
            duplicate += !seen.try_emplace(v, f).second;
        }
        float base = 1e9f;
        for (const Vec3f& v : mesh.vertices) base = std::min(base, v.z);
        Finding open, off_base, non_manifold, misoriented;
        auto note = [](Finding& finding, std::uint32_t facet) {
            ++finding.count, finding.first_facet = std::min(finding.first_facet, facet);
        };
        for (const auto& [edge, uses] : edges) {
            const std::size_t n = uses.facets.size();
            if (n == 1) note(open, uses.facets[0]);
            if (n == 1 && (mesh.vertices[edge.first].z > base || mesh.vertices[edge.second].z > base))
                note(off_base, uses.facets[0]);
            if (n > 2) note(non_manifold, uses.facets[0]);
            if (n > 1 && 2 * uses.forward != static_cast<int>(n)) note(misoriented, uses.facets[0]);
        }
        expect_finding(report.open_edges, open.count, open.first_facet);
        expect_finding(report.open_edges_off_base, off_base.count, off_base.first_facet);
        expect_finding(report.non_manifold_edges, non_manifold.count, non_manifold.first_facet);
        expect_finding(report.misoriented_edges, misoriented.count, misoriented.first_facet);
        EXPECT_EQ(report.degenerate_facets.count, degenerate);
        EXPECT_EQ(report.duplicate_facets.count, duplicate);
        EXPECT_NEAR(report.area_mm2, area, 1e-9);
        if (HasFailure()) FAIL() << "round " << round;
    }
}

// Of n facets at one edge, pairs would be 80 000 000 000.
TEST(MeshReport, AnyNumberOfFacetsMayHangOnOneEdge) {
    constexpr std::size_t kFacets = 400'000, kPlaces = 150'000;
    std::mt19937 random(test::seed());
    Facets facets;
    std::vector<bool> seen(kPlaces, false);
    std::uint64_t duplicates = 0;
    std::uint32_t first = kNoFacet;
    const Vec3f a{0, 0, 0}, b{0, 0, 10};
    for (std::uint32_t f = 0; f < kFacets; ++f) {
        const std::size_t place = random() % kPlaces;
        const Vec3f c{20, static_cast<float>(place), 5};
        facets.push_back(random() % 2 == 0 ? std::array{a, b, c} : std::array{b, a, c});
        if (seen[place] && duplicates++ == 0) first = f;
        seen[place] = true;
    }
    const MeshReport report = report_of(facets);
    expect_finding(report.duplicate_facets, duplicates, first);
    EXPECT_EQ(
        report.non_manifold_edges.count, 1 + 2 * [&] {
            std::vector<int> times(kPlaces, 0);
            for (const auto& facet : facets) ++times[static_cast<std::size_t>(facet[2].y)];
            return std::count_if(times.begin(), times.end(), [](int n) { return n > 2; });
        }());
}

TEST(MeshReport, InsideOutBodiesCavitiesAndIslands) {
    const Facets outer = shapes::box({0, 0, 0}, {10, 10, 10}), middle = shapes::box({2, 2, 2}, {8, 8, 8}),
                 inner = shapes::box({4, 4, 4}, {6, 6, 6});
    auto together = [](const Facets& a, const Facets& b, const Facets& c = {}) {
        Facets all = a;
        shapes::append(all, b);
        shapes::append(all, c);
        return all;
    };
    expect_finding(report_of(shapes::flipped(outer)).inverted_components, 1, 0);
    expect_finding(report_of(together(outer, shapes::flipped(middle))).inverted_components, 0, 0);
    expect_finding(report_of(together(outer, shapes::flipped(middle), inner)).inverted_components, 0, 0);
    // An island inside out in a cavity lies in the block's outline, but in none of its material.
    expect_finding(
        report_of(together(outer, shapes::flipped(middle), shapes::flipped(inner))).inverted_components, 1,
        24);
    // Beside a sound body.
    expect_finding(report_of(together(outer, shapes::flipped(shapes::box({20, 0, 0}, {30, 10, 10}))))
                       .inverted_components,
                   1, 12);
    // Below and above one, where a vertical ray meets it.
    expect_finding(
        report_of(together(outer, shapes::flipped(shapes::box({2, 2, 20}, {8, 8, 30})))).inverted_components,
        1, 12);
    expect_finding(report_of(together(outer, shapes::flipped(shapes::box({2, 2, -30}, {8, 8, -20}))))
                       .inverted_components,
                   1, 12);
    // A cavity in a block without a bottom.
    Facets open = outer;
    open.erase(open.begin(), open.begin() + 2);
    expect_finding(report_of(together(open, shapes::flipped(middle))).inverted_components, 0, 0);
}

TEST(MeshReport, InvertedBodiesOfRandomNestsEqualTheKnownNesting) {
    std::mt19937_64 random(test::seed());
    for (int round = 0; round < 200; ++round) {
        struct Body {
            Vec3f low, high;
            int around;  // sum of the signs of all bodies around it
            int sign;
        };
        std::vector<Body> bodies;
        Facets facets;
        for (int column = 0; column < 3; ++column) {
            for (int row = 0; row < 3; ++row) {
                Vec3f low{float(40 * column), float(40 * row), float(random() % 30)},
                    high{low.x + 36, low.y + 36, low.z + 36};
                int around = 0;
                for (int depth = 0; depth < 4 && random() % 4 != 0; ++depth) {
                    const int sign = random() % 2 == 0 ? 1 : -1;
                    bodies.push_back({low, high, around, sign});
                    around += sign;
                    auto gap = [&] { return 0.5f + 0.25f * static_cast<float>(random() % 12); };
                    low = {low.x + gap(), low.y + gap(), low.z + gap()};
                    high = {high.x - gap(), high.y - gap(), high.z - gap()};
                }
            }
        }
        std::uint64_t inverted = 0;
        double volume = 0;
        for (const Body& body : bodies) {
            const Facets box = shapes::box(body.low, body.high);
            shapes::append(facets, body.sign > 0 ? box : shapes::flipped(box));
            inverted += body.sign < 0 && body.around <= 0;
            volume += body.sign * double(body.high.x - body.low.x) * double(body.high.y - body.low.y) *
                      double(body.high.z - body.low.z);
        }
        std::shuffle(facets.begin(), facets.end(), random);
        const MeshReport report = report_of(facets, 1 + round % 3);
        EXPECT_EQ(report.components, bodies.size());
        EXPECT_EQ(report.inverted_components.count, inverted) << "round " << round;
        EXPECT_NEAR(report.volume_mm3, volume, 1e-6);
    }
}

TEST(MeshReport, VolumeOfATorusFarFromTheOrigin) {
    Facets facets = shapes::torus(300, 3, 1);
    const double near = report_of(facets).volume_mm3;
    EXPECT_NEAR(near, 2 * std::pow(3.141592653589793, 2) * 3, 0.02);
    for (auto& facet : facets)
        for (Vec3f& p : facet) p = {p.x + 4096, p.y - 4096, p.z + 4096};
    EXPECT_NEAR(report_of(facets).volume_mm3, near, 2e-3) << "only the rounding of the vertices may show";
}

TEST(MeshReport, SameOnAnyNumberOfThreads) {
    std::mt19937_64 random(test::seed());
    Facets facets = shapes::torus(300);
    shapes::append(facets, shapes::flipped(shapes::torus(100, 300, 50)));  // a cavity
    for (int i = 0; i < 500; ++i) {
        facets.push_back(facets[random() % facets.size()]);
        std::swap(facets[random() % facets.size()][0], facets[random() % facets.size()][1]);
    }
    std::shuffle(facets.begin(), facets.end(), random);
    const MeshReport first = report_of(facets, 1);
    EXPECT_GT(first.misoriented_edges.count, 0u);
    for (const int threads : {2, 4}) {
        const MeshReport report = report_of(facets, threads);
        EXPECT_EQ(report.components, first.components);
        EXPECT_EQ(report.component_of, first.component_of);
        EXPECT_EQ(report.volume_mm3, first.volume_mm3);
        EXPECT_EQ(report.area_mm2, first.area_mm2);
        auto same = [](const Finding& a, const Finding& b) {
            return a.count == b.count && a.first_facet == b.first_facet;
        };
        EXPECT_TRUE(same(report.open_edges, first.open_edges));
        EXPECT_TRUE(same(report.open_edges_off_base, first.open_edges_off_base));
        EXPECT_TRUE(same(report.non_manifold_edges, first.non_manifold_edges));
        EXPECT_TRUE(same(report.misoriented_edges, first.misoriented_edges));
        EXPECT_TRUE(same(report.degenerate_facets, first.degenerate_facets));
        EXPECT_TRUE(same(report.duplicate_facets, first.duplicate_facets));
        EXPECT_TRUE(same(report.inverted_components, first.inverted_components));
    }
}

}  // namespace
}  // namespace slabwright
