// Defects made on purpose in closed meshes, and what mending leaves of them.
#include "kernels/repair/repair.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "kernels/errors.h"
#include "kernels/mesh/weld.h"
#include "kernels/repair/bodies.h"
#include "kernels/repair/duplicates.h"
#include "kernels/repair/orient.h"
#include "kernels/repair/rebuild.h"
#include "kernels/repair/soup.h"
#include "kernels/repair/t_junctions.h"
#include "kernels/repair/triangulate.h"
#include "kernels/repair/winding.h"
#include "kernels/slicing/slicing.h"
#include "tests/mesh_shapes.h"
#include "tests/support/closed_mesh.h"
#include "tests/support/seed.h"

namespace slabwright {
namespace {

using shapes::Facets;
using Random = std::mt19937;

std::size_t draw(Random& random, std::size_t below) { return random() % below; }

float middle(const std::array<Vec3f, 3>& f, float Vec3f::*axis) {
    return (f[0].*axis + f[1].*axis + f[2].*axis) / 3;
}

/// A box of 2·6·n² facets.
Facets fine_box(int n, Vec3f low, Vec3f high) {
    Facets fine;
    const auto at = [&](const std::array<Vec3f, 3>& f, int i, int j) {
        // One rounding from exact thirds of the sides, so that both sides of an edge agree.
        const auto mix = [&](float a, float b, float c) {
            return static_cast<float>((double{a} * (n - i - j) + double{b} * i + double{c} * j) / n);
        };
        return Vec3f{mix(f[0].x, f[1].x, f[2].x), mix(f[0].y, f[1].y, f[2].y), mix(f[0].z, f[1].z, f[2].z)};
    };
    for (const auto& f : shapes::box(low, high))
        for (int i = 0; i < n; ++i)
            for (int j = 0; i + j < n; ++j) {
                fine.push_back({at(f, i, j), at(f, i + 1, j), at(f, i, j + 1)});
                if (i + j < n - 1) fine.push_back({at(f, i + 1, j), at(f, i + 1, j + 1), at(f, i, j + 1)});
            }
    return fine;
}

/// A torus beside a box with a cavity: curved and flat, three shells.
Facets sound() {
    Facets facets = shapes::torus(32, 60, 20);
    for (auto& f : facets)
        for (Vec3f& v : f) v.z += 20;
    shapes::append(facets, fine_box(8, {100, -40, 0}, {200, 40, 64}));
    shapes::append(facets, shapes::flipped(fine_box(4, {120, -20, 16}, {180, 20, 48})));
    return facets;
}

struct Damage {
    const char* name;
    Defect kind;  ///< that must be told
    std::function<void(Facets&, Random&)> make;
    double off_mm = 0;      ///< how far surfaces may lie from where they lay
    double at_most_mm = 0;  ///< size that must not be exceeded; 0: not asked
};

/// Moves what lies to the right of a plane away from what lies to the left, by the corners on the plane.
void crack(Facets& facets, float width) {
    // x = 150 is a line of the box's grid.
    for (auto& f : facets)
        if (middle(f, &Vec3f::x) > 150)
            for (Vec3f& v : f)
                if (v.x == 150) v.x += width;
}

std::vector<Damage> damages() {
    const auto on_top = [](const std::array<Vec3f, 3>& f) {
        return f[0].z == 64 && f[1].z == 64 && f[2].z == 64;
    };
    return {
        {"flipped patch", Defect::turned,
         [](Facets& fs, Random&) {
             for (auto& f : fs)
                 if (middle(f, &Vec3f::x) < -40) std::swap(f[0], f[1]);
         }},
        {"crack of 1e-4 mm", Defect::crack, [](Facets& fs, Random&) { crack(fs, 1e-4F); }, 1e-4, 2e-4},
        {"crack of .01 mm", Defect::crack, [](Facets& fs, Random&) { crack(fs, 1e-2F); }, 1e-2, 1.1e-2},
        {"crack of .1 mm", Defect::crack, [](Facets& fs, Random&) { crack(fs, 1e-1F); }, .1, .11},
        {"T-junctions", Defect::t_junction,
         [](Facets& fs, Random& random) {
             for (int i = 0; i < 40; ++i) {
                 auto& f = fs[draw(random, fs.size())];
                 const Vec3f m{(f[0].x + f[1].x) / 2, (f[0].y + f[1].y) / 2, (f[0].z + f[1].z) / 2};
                 const std::array<Vec3f, 3> rest{m, f[1], f[2]};
                 f[1] = m;
                 fs.push_back(rest);
             }
         },
         1e-3, 1e-3},
        {"missing facets", Defect::hole,
         [](Facets& fs, Random& random) {
             for (int i = 0; i < 25; ++i) fs.erase(fs.begin() + static_cast<long>(draw(random, fs.size())));
         },
         .6},  // of the torus's curve, where two facets are gone that were beside one another
        {"large flat hole", Defect::hole,
         [&](Facets& fs, Random&) {
             fs.erase(std::remove_if(fs.begin(), fs.end(),
                                     [](const auto& f) {
                                         return f[0].z == 64 && f[1].z == 64 && f[2].z == 64 &&
                                                middle(f, &Vec3f::x) > 115 && middle(f, &Vec3f::x) < 190 &&
                                                std::abs(middle(f, &Vec3f::y)) < 28;
                                     }),
                      fs.end());
         }},
        {"hole around an island", Defect::hole,
         [on_top](Facets& fs, Random&) {
             fs.erase(std::remove_if(fs.begin(), fs.end(),
                                     [&](const auto& f) {
                                         const float x = middle(f, &Vec3f::x), y = middle(f, &Vec3f::y);
                                         const float away = std::max(std::abs(x - 150), std::abs(y));
                                         return on_top(f) && away > 13 && away < 30;
                                     }),
                      fs.end());
         }},
        {"duplicate facets", Defect::duplicate,
         [](Facets& fs, Random& random) {
             for (int i = 0; i < 30; ++i) {
                 auto copy = fs[draw(random, fs.size())];
                 if (i % 2 == 0) std::swap(copy[0], copy[1]);
                 fs.push_back(copy);
             }
         }},
        {"degenerate facets", Defect::degenerate,
         [](Facets& fs, Random& random) {
             for (int i = 0; i < 30; ++i) {
                 const auto f = fs[draw(random, fs.size())];
                 if (i % 2 == 0) fs.push_back({f[0], f[1], f[1]});
                 else fs.push_back({Vec3f{5, 5, 5}, Vec3f{6, 6, 6}, Vec3f{8, 8, 8}});
             }
             fs.erase(fs.begin());  // a solid with some that close nothing would be left as it is
         }},
        {"two shells, one inside out", Defect::inside_out,
         [](Facets& fs, Random&) {
             for (auto& f : fs)
                 if (middle(f, &Vec3f::x) < 90) std::swap(f[0], f[1]);
         }},
        {"inside out, cavity and all", Defect::inside_out,
         [](Facets& fs, Random&) { fs = shapes::flipped(fs); }},
        {"every facet at random", Defect::turned,
         [](Facets& fs, Random& random) {
             for (auto& f : fs)
                 if (random() % 2 == 0) std::swap(f[0], f[1]);
         }},
        {"stray facets", Defect::stray,
         [](Facets& fs, Random& random) {
             for (int i = 0; i < 6; ++i) {
                 const auto x = static_cast<float>(210 + 8 * i), z = static_cast<float>(draw(random, 50) + 3);
                 fs.push_back({Vec3f{x, 0, z}, Vec3f{x + 5, 0, z}, Vec3f{x, 5, z + 1}});
             }
         }},
        {"an inner wall", Defect::stray,
         [](Facets& fs, Random&) {
             // Across a corner of the box, on its grid, so that it meets the sides along edges.
             const Vec3f a{112.5, -40, 64}, b{100, -30, 64}, c{100, -40, 56};
             fs.push_back({a, b, c});
         }},
    };
}

std::vector<double> section_areas(const Mesh& mesh) {
    Context context({.threads = 1});
    std::vector<Plane> planes;
    for (const double z : {3.3, 10.7, 18.9, 21.3, 30.1, 39.4, 47.7, 55.2, 63.1}) planes.push_back({z});
    std::vector<double> areas;
    for (const Section& s : slice(context, mesh.view(), planes)) {
        EXPECT_TRUE(s.open_chains.starts.size() <= 1);
        areas.push_back(area(s.loops));
    }
    return areas;
}

bool same_bytes(const Mesh& a, const Mesh& b) {
    const auto same = [](const auto& x, const auto& y) {
        return x.size() == y.size() &&
               (x.empty() || std::memcmp(x.data(), y.data(), x.size() * sizeof(x[0])) == 0);
    };
    return same(a.vertices, b.vertices) && same(a.facets, b.facets) && same(a.neighbours, b.neighbours);
}

Mended mended(Context& context, const Mesh& mesh, const MendOptions& options = {}) {
    return mend(context, mesh.view(), report_mesh(context, mesh.view()), options);
}
Mended mended(const Mesh& mesh, int threads = 1) {
    Context context({.threads = threads});
    return mended(context, mesh);
}
Mesh welded(const Facets& facets) {
    Context context({.threads = 1});
    return weld(context, facets);
}

TEST(Repair, ASolidComesBackAsItIs) {
    const Mesh mesh = welded(sound());
    const Mended result = mended(mesh);
    EXPECT_FALSE(result.needed);
    EXPECT_TRUE(result.solid);
    EXPECT_TRUE(same_bytes(result.mesh, mesh));
    // Bodies that overlap, or touch along an edge, need none either.
    Facets two = shapes::box({0, 0, 0}, {10, 10, 10});
    shapes::append(two, shapes::box({10, 10, 0}, {20, 20, 10}));
    shapes::append(two, shapes::box({5, 5, 5}, {15, 15, 15}));
    EXPECT_FALSE(mended(welded(two)).needed);
}

TEST(Repair, EachDefectIsMendedToldAndTheSolidIsTheSame) {
    const Facets good = sound();
    const Mesh original = welded(good);
    const double volume = test::volume(original.view()), area = mended(original).report.area_mm2;
    const std::vector<double> sections = section_areas(original);
    Random random(test::seed());
    for (const Damage& damage : damages()) {
        SCOPED_TRACE(damage.name);
        Facets bad = good;
        damage.make(bad, random);
        const Mesh mesh = welded(bad);
        const Mended result = mended(mesh);
        EXPECT_TRUE(result.needed);
        ASSERT_TRUE(result.solid);
        EXPECT_TRUE(test::closed(result.mesh.view()));
        EXPECT_GT(result[damage.kind].count, 0u);
        EXPECT_LE(result.moved_mm, damage.at_most_mm > 0 ? damage.at_most_mm : kMostStitch);
        const double off = std::max(damage.off_mm, 1e-6);
        EXPECT_NEAR(test::volume(result.mesh.view()), volume, off * area * .1 + volume * 1e-6);
        const std::vector<double> mended_sections = section_areas(result.mesh);
        for (std::size_t i = 0; i < sections.size(); ++i)
            EXPECT_NEAR(mended_sections[i], sections[i], off * 300 + 1e-2) << "section " << i;
        EXPECT_FALSE(mended(result.mesh).needed) << "what was mended needs no mending";
        for (const int threads : {2, 4}) EXPECT_TRUE(same_bytes(mended(mesh, threads).mesh, result.mesh));
    }
}

TEST(Repair, OfTheVerticesThatSplitEdgesTheFarthestIsTold) {
    Random random(test::seed());
    std::uniform_real_distribution<float> away(1e-3F, 0.04F);
    Context context({.threads = 1});
    for (int round = 0; round < 20; ++round) {
        // Pairs of triangles below and above an edge; those above meet at a vertex that lies off it.
        FacetSoup soup;
        double farthest = 0;
        Xyz where{};
        const auto edges = static_cast<std::uint32_t>(1 + draw(random, 9));
        for (std::uint32_t k = 0; k < edges; ++k) {
            const float x = 20 * static_cast<float>(k), y = away(random);
            const std::uint32_t a = 5 * k, b = a + 1, middle = a + 2, below = a + 3, above = a + 4;
            for (const Vec3f& v : {Vec3f{x, 0, 0}, Vec3f{x + 8, 0, 0}, Vec3f{x + 4, y, 0},
                                   Vec3f{x + 4, -5, 0}, Vec3f{x + 4, 5, 0}})
                soup.vertices.push_back(v);
            for (const Index3& f : {Index3{b, a, below}, Index3{a, middle, above}, Index3{middle, b, above}})
                soup.facets.push_back(f);
            if (double{y} > farthest) farthest = y, where = soup.at(middle);
        }
        const EdgeSplits split = split_at_vertices(context, soup, sorted_uses(context, soup), 0.05, 0);
        EXPECT_EQ(split.edges, edges);
        EXPECT_EQ(soup.facets.size(), 4 * edges);
        EXPECT_NEAR(split.farthest_mm, farthest, 1e-9);
        EXPECT_EQ(split.where, where);
    }
}

FacetSoup soup_of(const Mesh& mesh) {
    FacetSoup soup;
    soup.vertices.assign(mesh.vertices.begin(), mesh.vertices.end());
    soup.facets.assign(mesh.facets.begin(), mesh.facets.end());
    return soup;
}

TEST(Repair, FacetsGivenTwiceStayWhereTheyJoinBodiesOrAreAllThereIs) {
    Context context({.threads = 1});
    Random random(test::seed());
    const Facets box = fine_box(2, {0, 0, 0}, {10, 10, 10}), beside = fine_box(2, {10, 0, 0}, {20, 10, 10});
    Facets joined = box, twice = box;
    shapes::append(joined, beside);
    shapes::append(twice, box);
    for (Facets* facets : {&joined, &twice}) {
        std::shuffle(facets->begin(), facets->end(), random);
        FacetSoup soup = soup_of(welded(*facets));
        const std::size_t all = facets->size();
        ASSERT_EQ(soup.facets.size(), all);
        EXPECT_EQ(drop_duplicates(context, soup).count, 0u);
        EXPECT_EQ(soup.facets.size(), all);
    }
    // Any facet that is there once more goes, one beside others as well, but for all of them.
    for (int round = 0; round < 20; ++round) {
        Facets some = box;
        const std::size_t more = 1 + draw(random, box.size() / 2);
        for (std::size_t i = 0; i < more; ++i) some.push_back(box[(i + 7) % box.size()]);
        FacetSoup soup = soup_of(welded(some));
        EXPECT_EQ(drop_duplicates(context, soup).count, more);
        EXPECT_EQ(soup.facets.size(), box.size());
    }
}

TEST(Repair, WhatIsTurnedIsCountedByFacetsAndPatches) {
    Context context({.threads = 1});
    Random random(test::seed());
    const FacetSoup good = soup_of(welded(fine_box(4, {0, 0, 0}, {40, 40, 40})));
    const std::size_t n = good.facets.size();
    for (const std::size_t turned : {std::size_t{0}, std::size_t{1}, n / 20, n / 8, n / 3}) {
        std::vector<std::size_t> order(n);
        for (std::size_t f = 0; f < n; ++f) order[f] = f;
        std::shuffle(order.begin(), order.end(), random);
        order.resize(turned);
        FacetSoup bad = good;
        for (const std::size_t f : order) std::swap(bad.facets[f][1], bad.facets[f][2]);
        // Patches: those that share two corners hang together.
        std::vector<std::size_t> patch(turned);
        for (std::size_t i = 0; i < turned; ++i) patch[i] = i;
        for (std::size_t i = 0; i < turned; ++i)
            for (std::size_t k = 0; k < i; ++k) {
                int shared = 0;
                for (const std::uint32_t v : good.facets[order[i]])
                    for (const std::uint32_t w : good.facets[order[k]]) shared += v == w ? 1 : 0;
                const std::size_t from = patch[i], to = patch[k];
                if (shared == 2)
                    for (std::size_t& p : patch) p = p == from ? to : p;
            }
        std::sort(patch.begin(), patch.end());
        const auto patches =
            static_cast<std::uint64_t>(std::unique(patch.begin(), patch.end()) - patch.begin());
        const Turned found = orient(context, bad);
        EXPECT_EQ(found.facets, turned);
        EXPECT_EQ(found.patches, patches);
        EXPECT_EQ(found.area_mm2 > 0, turned > 0);
        EXPECT_TRUE(std::equal(bad.facets.begin(), bad.facets.end(), good.facets.begin()));
    }
}

TEST(Repair, AHoleAroundAnIslandIsOneHoleOfItsArea) {
    // A ring of a cube's side is missing, and what stands within stays where it is.
    for (int axis = 0; axis < 3; ++axis) {
        Facets cube = fine_box(8, {0, 0, 0}, {80, 80, 80});
        std::erase_if(cube, [](const auto& f) {
            const float away =
                std::max(std::abs(middle(f, &Vec3f::x) - 40), std::abs(middle(f, &Vec3f::y) - 40));
            return f[0].z == 80 && f[1].z == 80 && f[2].z == 80 && away > 10 && away < 30;
        });
        for (auto& f : cube)
            for (Vec3f& v : f)
                for (int k = 0; k < axis; ++k) v = {v.z, v.x, v.y};
        const Mended result = mended(welded(cube));
        EXPECT_TRUE(result.solid);
        EXPECT_EQ(result[Defect::hole].count, 1u) << axis;
        EXPECT_NEAR(result[Defect::hole].size, 60 * 60 - 20 * 20, 1e-3) << axis;
        EXPECT_EQ(result[Defect::stray].count, 0u) << axis;
        EXPECT_NEAR(test::volume(result.mesh.view()), 80 * 80 * 80, 1) << axis;
    }
}

TEST(Repair, SeveralDefectsAtOnce) {
    const Facets good = sound();
    const double volume = test::volume(welded(good).view());
    Random random(test::seed());
    const std::vector<Damage> all = damages();
    for (int round = 0; round < 40; ++round) {
        Facets bad = good;
        std::string names;
        for (int i = 0; i < 4; ++i) {
            const Damage& damage = all[draw(random, all.size())];
            if (names.find(damage.name) != std::string::npos) continue;
            if (damage.kind == Defect::inside_out && names.find("at random") != std::string::npos) continue;
            names += std::string(damage.name) + "; ";
            damage.make(bad, random);
        }
        SCOPED_TRACE(names);
        // Facets that are missing side by side leave a hole that is larger than is closed unasked.
        Context context({.threads = 1});
        const Mended result = mended(context, welded(bad), {.hole_mm = 60});
        EXPECT_TRUE(result.solid) << result.left.holes << " holes, " << result.left.sheets << " sheets, "
                                  << result.report.inverted_components.count << " inside out, "
                                  << result.report.open_edges.count << " open, "
                                  << result.report.misoriented_edges.count << " misoriented, "
                                  << result.left.one_sided << " one-sided";
        EXPECT_NEAR(test::volume(result.mesh.view()), volume, .01 * volume);
        EXPECT_EQ(mended(result.mesh).needed, !result.solid);
    }
}

TEST(Repair, AHoleThatIsNeitherFlatNorThinIsLeftAndTold) {
    Facets facets = shapes::torus(32, 60, 20);
    facets.erase(std::remove_if(facets.begin(), facets.end(),
                                [](const auto& f) {
                                    const float x = middle(f, &Vec3f::x), y = middle(f, &Vec3f::y);
                                    return x > 0 && x * x + y * y > 60 * 60;
                                }),
                 facets.end());
    const Mended result = mended(welded(facets));
    EXPECT_FALSE(result.solid);
    EXPECT_EQ(result.left.holes, 1u);
    EXPECT_GT(result.left.hole_mm, 100);
    Context context({.threads = 1});
    EXPECT_TRUE(mended(context, welded(facets), {.hole_mm = 200}).solid);
}

TEST(Repair, ASoupIsNoSolid) {
    Random random(test::seed());
    Facets facets;
    const auto number = [&] { return static_cast<float>(random() % 10000) / 100; };
    for (int i = 0; i < 100; ++i) {
        std::array<Vec3f, 3> f;
        for (Vec3f& v : f) v = {number(), number(), number()};
        facets.push_back(f);
    }
    const Mended result = mended(welded(facets));
    EXPECT_FALSE(result.solid);
    EXPECT_EQ(result.left.sheets, 100u);
}

TEST(Repair, AMoebiusStripIsTold) {
    Facets facets;
    constexpr int n = 40;
    const auto at = [](int i, int side) {
        const double u = 2 * 3.141592653589793 * i / n, w = (side == 0 ? -1 : 1) * (i >= n ? -1 : 1);
        const double turn = (i % n) * 3.141592653589793 / n, r = 50 + 10 * w * std::cos(turn);
        return Vec3f{static_cast<float>(r * std::cos(u)), static_cast<float>(r * std::sin(u)),
                     static_cast<float>(10 * w * std::sin(turn))};
    };
    const auto seam = [&](int i, int side) { return i == n ? at(0, 1 - side) : at(i, side); };
    for (int i = 0; i < n; ++i) {
        facets.push_back({seam(i, 0), seam(i + 1, 0), seam(i + 1, 1)});
        facets.push_back({seam(i, 0), seam(i + 1, 1), seam(i, 1)});
    }
    const Mended result = mended(welded(facets));
    EXPECT_GT(result.left.one_sided, 0u);
    EXPECT_EQ(result.solid, test::closed(result.mesh.view()));
}

/// Few points, so that facets share edges in every wrong way.
TEST(Repair, RandomSoupsNeitherCrashNorHang) {
    Random random(test::seed());
    int solids = 0;
    for (int round = 0; round < 400; ++round) {
        const auto grid = static_cast<unsigned>(2 + draw(random, 6));
        const auto step = static_cast<float>(std::pow(10.0, static_cast<double>(draw(random, 5)) - 3));
        Facets facets;
        const std::size_t n = 1 + draw(random, 150);
        const auto number = [&] { return static_cast<float>(random() % grid) * step; };
        for (std::size_t i = 0; i < n; ++i) {
            std::array<Vec3f, 3> f;
            for (Vec3f& v : f) v = {number(), number(), number()};
            facets.push_back(f);
        }
        const Mesh mesh = welded(facets);
        const Mended result = mended(mesh);
        EXPECT_TRUE(same_bytes(mended(mesh, 4).mesh, result.mesh));
        solids += result.solid ? 1 : 0;
        if (!result.mesh.facets.empty()) {
            EXPECT_EQ(mended(result.mesh).needed, !result.solid);
        }
    }
    std::printf("%d of 400 soups became solids\n", solids);
}

TEST(Repair, ASoupIsRebuiltAsASolidOrAsNothing) {
    Random random(test::seed());
    int solids = 0;
    for (int round = 0; round < 20; ++round) {
        Facets facets;
        const auto number = [&] { return static_cast<float>(random() % 40) / 2; };
        for (std::size_t i = 0; i < 60; ++i) {
            std::array<Vec3f, 3> f;
            for (Vec3f& v : f) v = {number(), number(), number()};
            facets.push_back(f);
        }
        const Mesh mesh = welded(facets);
        Context context({.threads = 2});
        const Rebuilt result = rebuild(context, mesh.view(), mesh.view(), {.cell_mm = 1});
        EXPECT_TRUE(result.mesh.facets.empty() || test::closed(result.mesh.view()));
        solids += result.solid ? 1 : 0;
    }
    std::printf("%d of 20 soups became solids\n", solids);
}

TEST(Repair, BodiesThatEncloseNothingAreTheirTwoFaces) {
    FacetSoup soup;
    std::vector<std::uint32_t> body_of;
    const auto add = [&](float x, float side, const std::vector<Index3>& facets) {
        const auto first = static_cast<std::uint32_t>(soup.vertices.size());
        for (const Vec3f& v : {Vec3f{x, 0, 0}, {x + side, 0, 0}, {x, side, 0}, {x, 0, side}})
            soup.vertices.push_back(v);
        const std::uint32_t number = body_of.empty() ? 0 : body_of.back() + 1;
        for (const Index3& f : facets) {
            soup.facets.push_back({first + f[0], first + f[1], first + f[2]});
            body_of.push_back(number);
        }
    };
    const std::vector<Index3> faces{{0, 1, 2}, {0, 2, 1}};
    add(0, 1, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}});
    add(10, 1, faces);
    add(20, 2, faces);
    add(30, 1.5F, faces);
    const EmptyBodies found = find_empty_bodies(soup, body_of);
    EXPECT_EQ(found.count, 3u);
    EXPECT_NEAR(found.area_mm2, 2 * 2, 1e-12) << "both faces of the largest";
    EXPECT_EQ(found.where, (Xyz{20, 0, 0}));
    EXPECT_EQ(found.facets,
              (std::vector<bool>{false, false, false, false, true, true, true, true, true, true}));
}

TEST(Repair, EdgesAreSortedInTwiceTheirMemory) {
    const FacetSoup soup{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                         {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}};
    const std::uint64_t need = 2 * 12 * sizeof(EdgeUse);
    Context enough({.threads = 1, .memory_bytes = need}), less({.threads = 1, .memory_bytes = need - 1});
    EXPECT_EQ(sorted_uses(enough, soup).size(), 12u);
    EXPECT_EQ(enough.memory_charged(), 0u);
    try {
        (void)sorted_uses(less, soup);
        ADD_FAILURE();
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), "memory.limit");
    }
}

TEST(Repair, StopsWhenCancelled) {
    Facets facets = shapes::torus(64);
    facets.pop_back();
    const Mesh mesh = welded(facets);
    Context context({.threads = 2});
    const MeshReport report = report_mesh(context, mesh.view());
    context.cancel();
    try {
        (void)mend(context, mesh.view(), report);
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::cancelled);
    }
}

TEST(Repair, TimeGrowsWithTheFacetsNotTheirSquare) {
    // 80 000 facets, every one with vertices of its own a little off: as many borders as facets.
    Facets facets = shapes::torus(200, 300, 100);
    Random random(test::seed());
    for (auto& f : facets)
        for (Vec3f& v : f) v.x += 1e-4F * static_cast<float>(random() % 100) / 100;
    const Mended result = mended(welded(facets), 2);
    EXPECT_TRUE(result.solid);
    EXPECT_LE(result.moved_mm, 3e-4);
}

Facets open_torus() {
    Facets facets = shapes::torus(48, 60, 20);
    for (auto& f : facets)
        for (Vec3f& v : f) v.z += 20;
    facets.erase(std::remove_if(facets.begin(), facets.end(),
                                [](const auto& f) {
                                    const float x = middle(f, &Vec3f::x), y = middle(f, &Vec3f::y);
                                    const float z = middle(f, &Vec3f::z) - 20;
                                    return (x - 80) * (x - 80) + y * y + z * z < 12 * 12;
                                }),
                 facets.end());
    return facets;
}

TEST(Repair, RebuiltSurfaceIsASolidAsNearAsItSays) {
    const Facets whole = shapes::torus(48, 60, 20);
    for (const bool open : {false, true}) {
        const Mesh mesh = welded(open ? open_torus() : whole);
        Mesh first;
        for (const int threads : {1, 2, 4}) {
            Context context({.threads = threads});
            Rebuilt result = rebuild(context, mesh.view(), mesh.view(), {.cell_mm = 1});
            ASSERT_TRUE(result.solid);
            EXPECT_TRUE(test::closed(result.mesh.view()));
            EXPECT_LT(result.missed_mm, 1) << "a cell";
            if (!open) {
                EXPECT_LT(result.deviation_mm, .2);
            }
            EXPECT_EQ(result.report.components, 1u);
            EXPECT_NEAR(result.report.volume_mm3, test::volume(welded(whole).view()),
                        (open ? .01 : .002) * result.report.volume_mm3);
            if (threads == 1) first = std::move(result.mesh);
            else EXPECT_TRUE(same_bytes(result.mesh, first));
        }
    }
}

TEST(Repair, RebuiltBodiesThatOverlapOrAreInsideOutAreOne) {
    Facets facets = shapes::box({0, 0, 0}, {30, 30, 30});
    shapes::append(facets, shapes::box({20, 20, 20}, {50, 50, 50}));
    shapes::append(facets, shapes::flipped(shapes::box({60, 0, 0}, {80, 20, 20})));
    shapes::append(facets, shapes::flipped(shapes::box({5, 5, 5}, {15, 15, 15})));  // a cavity
    const Mesh mesh = welded(facets);
    Context context({.threads = 2});
    const Rebuilt result = rebuild(context, mesh.view(), mesh.view(), {.cell_mm = .5});
    ASSERT_TRUE(result.solid);
    EXPECT_NEAR(result.report.volume_mm3, 2 * 27000 - 1000 + 8000 - 1000, .01 * 60000);
}

TEST(Repair, WindingNumberIsThatOfTheSum) {
    Facets facets = sound();
    facets.resize(facets.size() - 40);  // open too
    const Mesh mesh = welded(facets);
    Context context({.threads = 2});
    const WindingTree tree(context, mesh.vertices, mesh.facets);
    Random random(test::seed());
    for (int i = 0; i < 2000; ++i) {
        const Xyz p{-90 + 3.0 * static_cast<double>(random() % 100) + .013,
                    -90 + 1.8 * static_cast<double>(random() % 100) + .017,
                    .7 * static_cast<double>(random() % 100) - 3.01};
        double exact = 0;
        for (const Index3& f : mesh.facets)
            exact +=
                winding_of(xyz(mesh.vertices[f[0]]), xyz(mesh.vertices[f[1]]), xyz(mesh.vertices[f[2]]), p);
        EXPECT_NEAR(tree.at(p), exact, .1);
    }
}

// Through each facet the winding number falls by one, outwards.
TEST(Repair, WindingNumberFallsByOneThroughEachFacet) {
    const Mesh mesh = welded(sound());
    Context context({.threads = 2});
    const WindingTree tree(context, mesh.vertices, mesh.facets);
    for (std::size_t f = 0; f < mesh.facets.size(); ++f) {
        std::array<Xyz, 3> at;
        for (std::size_t k = 0; k < 3; ++k) at[k] = xyz(mesh.vertices[mesh.facets[f][k]]);
        Xyz middle{};
        for (const Xyz& corner : at) middle = plus(middle, corner, 1.0 / 3);
        const Xyz outward = twice_area(at[0], at[1], at[2]);
        const double beside = 1e-3 / length(outward);
        EXPECT_NEAR(tree.at(plus(middle, outward, -beside)) - tree.at(plus(middle, outward, beside)), 1, .1)
            << f;
    }
}

TEST(Repair, LeastAreaAndEarsCoverARegion) {
    Random random(test::seed());
    for (int round = 0; round < 200; ++round) {
        const std::size_t n = 3 + draw(random, 40);
        std::vector<Xyz> star;
        double expected = 0;
        for (std::size_t i = 0; i < n; ++i) {
            const double u = 2 * 3.141592653589793 * static_cast<double>(i) / static_cast<double>(n);
            const double r = 5 + static_cast<double>(random() % 100) / 10;
            star.push_back({r * std::cos(u), r * std::sin(u), 0});
        }
        for (std::size_t i = 0; i < n; ++i) {
            const Xyz &a = star[i], &b = star[(i + 1) % n];
            expected += (a[0] * b[1] - a[1] * b[0]) / 2;
        }
        std::vector<std::vector<std::uint32_t>> rings(1);
        for (std::uint32_t i = 0; i < n; ++i) rings[0].push_back(i);
        const auto covered = [&](const std::vector<std::array<std::uint32_t, 3>>& triangles) {
            double sum = 0;
            for (const auto& t : triangles) sum += length(twice_area(star[t[0]], star[t[1]], star[t[2]])) / 2;
            return sum;
        };
        EXPECT_NEAR(covered(least_area(star)), expected, 1e-9 * expected);
        if (n >= 5) {  // with a hole well inside
            for (const auto& [x, y] : {std::pair{1.0, 0.0}, {0.0, -1.0}, {-1.0, 0.0}, {0.0, 1.0}})
                star.push_back({x, y, 0});
            rings.push_back({});
            for (std::uint32_t i = 0; i < 4; ++i) rings[1].push_back(static_cast<std::uint32_t>(n) + i);
            expected -= 2;
        }
        EXPECT_NEAR(covered(clip_ears(star, rings, {0, 0, 1})), expected, 1e-9 * expected);
    }
}

}  // namespace
}  // namespace slabwright
