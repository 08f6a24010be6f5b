// The solid that a mesh means is where its winding number is not zero: roles, sections, heights and cutters
// against winding numbers counted by brute force, on random bodies that overlap, touch and are inside out.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <vector>

#include "kernels/access/standing_part.h"
#include "kernels/cutting/drop.h"
#include "kernels/cutting/fibres.h"
#include "kernels/cutting/layer_solid.h"
#include "kernels/features/features.h"
#include "kernels/mesh/facet_roles.h"
#include "kernels/mesh/report.h"
#include "kernels/mesh/weld.h"
#include "kernels/mesh/windings.h"
#include "kernels/slicing/slicing.h"
#include "kernels/slicing/solid_volume.h"
#include "tests/data/luo_layer_sample.h"
#include "tests/support/compositions.h"
#include "tests/support/seed.h"

using namespace slabwright;

namespace {

using Point = std::array<double, 3>;

Mesh solid_of(Context& context, const shapes::Facets& facets) {
    Mesh mesh = weld(context, facets);
    mesh.roles = facet_roles(context, mesh.view());
    return mesh;
}

Point within(const std::array<Vec3f, 3>& f, std::mt19937& random) {
    std::uniform_real_distribution<double> u(0, 1);
    double a = u(random), b = u(random);
    if (a + b > 1) a = 1 - a, b = 1 - b;
    const double c = 1 - a - b;
    return {c * f[0].x + a * f[1].x + b * f[2].x, c * f[0].y + a * f[1].y + b * f[2].y,
            c * f[0].z + a * f[1].z + b * f[2].z};
}

Point unit_normal(const std::array<Vec3f, 3>& f) {
    const double ux = double{f[1].x} - f[0].x, uy = double{f[1].y} - f[0].y, uz = double{f[1].z} - f[0].z,
                 vx = double{f[2].x} - f[0].x, vy = double{f[2].y} - f[0].y, vz = double{f[2].z} - f[0].z;
    const Point n{uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx};
    const double length = std::hypot(n[0], n[1], n[2]);
    return {n[0] / length, n[1] / length, n[2] / length};
}

std::size_t count(const Mesh& mesh, FacetRole role) {
    return static_cast<std::size_t>(std::count(mesh.roles.begin(), mesh.roles.end(), role));
}

constexpr int kCompositions = 40;

/// A closed surface, some vertices of which are moved: it then folds through itself beside them.
shapes::Facets folded(shapes::Facets facets, double share, double most, std::mt19937& random) {
    std::uniform_real_distribution<double> chance(0, 1), far(-most, most);
    std::map<std::array<float, 3>, Vec3f> moved;
    for (std::array<Vec3f, 3>& facet : facets)
        for (Vec3f& p : facet) {
            const auto [at, first] = moved.try_emplace({p.x, p.y, p.z}, p);
            if (first && chance(random) < share)
                at->second = {static_cast<float>(p.x + far(random)), static_cast<float>(p.y + far(random)),
                              static_cast<float>(p.z + far(random))};
            p = at->second;
        }
    return facets;
}

/// Whether the roles of facets are what the winding numbers beside a point of each say.
void expect_roles(Context& context, const shapes::Facets& facets, std::mt19937& random, int trial) {
    constexpr double beside = 2e-6;
    const Mesh mesh = solid_of(context, facets);
    for (std::size_t f = 0; f < facets.size(); ++f) {
        const Point p = within(facets[f], random), n = unit_normal(facets[f]);
        const int front = test::winding_by_angles(
                      facets, {p[0] + beside * n[0], p[1] + beside * n[1], p[2] + beside * n[2]}),
                  behind = test::winding_by_angles(
                      facets, {p[0] - beside * n[0], p[1] - beside * n[1], p[2] - beside * n[2]});
        switch (mesh.view().role(f)) {
            case FacetRole::surface:
                EXPECT_TRUE(front == 0 && behind != 0) << trial << ' ' << f << ' ' << front << behind;
                break;
            case FacetRole::turned:
                EXPECT_TRUE(front != 0 && behind == 0) << trial << ' ' << f << ' ' << front << behind;
                break;
            case FacetRole::inner:
                EXPECT_TRUE(front != 0 && behind != 0) << trial << ' ' << f << ' ' << front << behind;
                break;
            case FacetRole::unsure:
                break;
        }
    }
}

}  // namespace

TEST(FacetRoles, ABodyByItselfIsAllSurface) {
    Context context;
    EXPECT_TRUE(solid_of(context, shapes::box({0, 0, 0}, {10, 20, 30})).roles.empty());
    EXPECT_TRUE(solid_of(context, shapes::torus(40)).roles.empty());
    shapes::Facets hollow = shapes::box({0, 0, 0}, {10, 20, 30});
    shapes::append(hollow, shapes::flipped(shapes::box({3, 3, 3}, {6, 6, 6})));
    EXPECT_TRUE(solid_of(context, hollow).roles.empty());
}

TEST(FacetRoles, TellBodiesInsideOutAndInOthers) {
    Context context;
    shapes::Facets facets = shapes::box({0, 0, 0}, {10, 20, 30});
    shapes::append(facets, shapes::box({3, 3, 3}, {6, 6, 6}));
    const Mesh nested = solid_of(context, facets);
    EXPECT_EQ(count(nested, FacetRole::inner), 12U);
    EXPECT_EQ(count(nested, FacetRole::surface), 12U);
    facets = shapes::box({0, 0, 0}, {10, 20, 30});
    shapes::append(facets, shapes::flipped(shapes::box({30, 0, 0}, {40, 20, 30})));
    const Mesh apart = solid_of(context, facets);
    EXPECT_EQ(count(apart, FacetRole::turned), 12U);
    facets = shapes::box({0, 0, 0}, {10, 20, 30});
    shapes::append(facets, shapes::box({5, 5, 5}, {15, 15, 25}));
    const Mesh overlapping = solid_of(context, facets);
    EXPECT_EQ(count(overlapping, FacetRole::turned), 0U);
    EXPECT_GT(count(overlapping, FacetRole::unsure), 0U);
    EXPECT_GT(count(overlapping, FacetRole::inner), 0U);
}

TEST(FacetRoles, AreWhatWindingNumbersSayAtRandom) {
    Context context;
    std::mt19937 random(test::seed());
    for (int trial = 0; trial < kCompositions; ++trial)
        expect_roles(context, test::Composer(random, {}).facets(), random, trial);
}

// Around a corner, facets that face alike may pass through one another too: as where a hole was filled with a
// spike, or a patch of a casting's skin overshoots its neighbour.
TEST(FacetRoles, AreWhatWindingNumbersSayOfFolds) {
    Context context;
    std::mt19937 random(test::seed());
    for (int trial = 0; trial < kCompositions; ++trial)
        expect_roles(context, folded(shapes::torus(12, 30, 10), 0.15, 12, random), random, trial);
}

// Two facets on one edge that are folded onto one another are told whichever corners they are given from:
// here the four of a tetrahedron pressed flat, whose volume is nothing.
TEST(FacetRoles, TellFoldsFromWhicheverCorner) {
    Context context;
    const Vec3f a{0, 0, 5}, b{10, 0, 5}, c{5, 8, 5}, d{5, 3, 5};
    const std::array<std::array<Vec3f, 3>, 4> flat{{{a, c, b}, {a, b, d}, {b, c, d}, {c, a, d}}};
    for (unsigned turns = 0; turns < 81; ++turns) {
        shapes::Facets facets = shapes::box({20, 0, 0}, {30, 10, 10});
        unsigned rest = turns;
        for (std::array<Vec3f, 3> facet : flat) {
            std::rotate(facet.begin(), facet.begin() + rest % 3, facet.end());
            facets.push_back(facet);
            rest /= 3;
        }
        const Mesh mesh = solid_of(context, facets);
        ASSERT_EQ(mesh.facets.size(), 16U);
        EXPECT_EQ(count(mesh, FacetRole::unsure), 4U) << turns;
    }
}

// Within a box, where both sides of what does not fold are solid: only the fold itself makes the two unsure.
TEST(FacetRoles, TellTheFoldOfTwoFacetsFromWhicheverCorner) {
    Context context;
    const Vec3f a{2, 2, 5}, b{12, 2, 5}, c{7, 10, 5}, d{7, 5, 5};
    for (const bool exchanged : {false, true})
        for (std::size_t turns = 0; turns < 9; ++turns) {
            std::array<Vec3f, 3> up{a, b, c}, down{b, a, d};
            std::rotate(up.begin(), up.begin() + static_cast<std::ptrdiff_t>(turns % 3), up.end());
            std::rotate(down.begin(), down.begin() + static_cast<std::ptrdiff_t>(turns / 3), down.end());
            if (exchanged) std::swap(up, down);
            shapes::Facets facets = shapes::box({0, 0, 0}, {20, 20, 20});
            facets.push_back(up);
            facets.push_back(down);
            const Mesh mesh = weld(context, facets);
            const BulkVector<FacetRole> roles = facet_roles(context, mesh.view());
            ASSERT_EQ(roles.size(), 14U);
            EXPECT_EQ(std::count(roles.begin(), roles.end(), FacetRole::unsure), 2)
                << exchanged << ' ' << turns;
        }
}

// Of two rings of thousands of facets that pass through each other: what crosses the other ring is unsure,
// what lies farther from it than a facet is long is not.
TEST(FacetRoles, AreFoundAmongThousandsOfFacets) {
    Context context;
    std::mt19937 random(test::seed());
    constexpr int n = 64;
    constexpr double longest = 42, sag = 1.5;  // mm: of edges, and of chords to the round
    std::array<int, 2> crossing{}, apart{};
    for (int trial = 0; trial < 3; ++trial) {
        std::uniform_real_distribution<double> along(-350, 350), up(-90, 90);
        const std::array<Point, 2> middles{Point{0, 0, 0}, Point{along(random), along(random), up(random)}};
        shapes::Facets facets = shapes::torus(n);
        const std::size_t of_one = facets.size();
        for (std::size_t f = 0; f < of_one; ++f) {
            facets.push_back(facets[f]);
            for (Vec3f& p : facets.back())
                p = {p.x + static_cast<float>(middles[1][0]), p.y + static_cast<float>(middles[1][1]),
                     p.z + static_cast<float>(middles[1][2])};
        }
        const Mesh mesh = solid_of(context, facets);
        ASSERT_EQ(mesh.facets.size(), facets.size());
        ASSERT_EQ(mesh.roles.size(), facets.size());
        for (std::size_t f = 0; f < facets.size(); ++f) {
            const std::size_t other = f < of_one ? 1 : 0;
            const Point& middle = middles[other];
            double least = 1e9, most = -1e9;
            for (const Vec3f& p : facets[f]) {
                const double round = std::hypot(p.x - middle[0], p.y - middle[1]) - 300;
                const double outside = std::hypot(round, p.z - middle[2]) - 100;
                least = std::min(least, outside);
                most = std::max(most, outside);
            }
            if (least < -sag && most > sag) {
                EXPECT_EQ(mesh.roles[f], FacetRole::unsure) << trial << ' ' << f;
                ++crossing[other];
            } else if (least > longest || most < -longest) {
                EXPECT_EQ(mesh.roles[f], least > 0 ? FacetRole::surface : FacetRole::inner)
                    << trial << ' ' << f;
                ++apart[other];
            }
        }
    }
    for (const std::size_t other : {0, 1}) {
        EXPECT_GT(crossing[other], 50);
        EXPECT_GT(apart[other], 5000);
    }
}

TEST(Windings, AreThoseOfAngles) {
    Context context;
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> u(-5, 70);
    for (int trial = 0; trial < kCompositions; ++trial) {
        const shapes::Facets facets = test::Composer(random, {}).facets();
        const Mesh mesh = weld(context, facets);
        std::vector<Point> points;
        for (int i = 0; i < 60; ++i) points.push_back({u(random), u(random), u(random) / 2});
        const std::vector<int> winding = windings_at(context, mesh.view(), points);
        for (std::size_t i = 0; i < points.size(); ++i)
            EXPECT_EQ(winding[i], test::winding_by_angles(facets, points[i])) << trial << ' ' << i;
    }
}

TEST(Sections, AreWhereTheWindingNumberIsNotZero) {
    Context context;
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> u(-5, 65), uz(0.1, 45);
    for (int trial = 0; trial < kCompositions; ++trial) {
        const shapes::Facets facets = test::Composer(random, {}).facets();
        const Mesh mesh = solid_of(context, facets);
        std::vector<Plane> planes;
        for (int i = 0; i < 4; ++i) planes.push_back({uz(random), Side::above});
        for (const Section& section : slice(context, mesh.view(), planes)) {
            for (int i = 0; i < 60; ++i) {
                const Point p{u(random), u(random), section.plane.z};
                const int w = winding(section.loops, {to_units(p[0]), to_units(p[1])});
                EXPECT_EQ(w, test::winding_by_angles(facets, p) != 0 ? 1 : 0) << trial << " z " << p[2];
            }
        }
    }
}

TEST(SolidVolume, CountsWhatBodiesShareOnce) {
    Context context;
    const auto volume = [&](const shapes::Facets& facets, double wound) {
        const Mesh mesh = solid_of(context, facets);
        return solid_volume(context, mesh.view(), wound).mm3;
    };
    const shapes::Facets large = shapes::box({0, 0, 0}, {20, 20, 20});
    EXPECT_EQ(volume(large, 8000), 8000);
    shapes::Facets overlapping = large;  // they share 10 × 10 × 12
    shapes::append(overlapping, shapes::box({10, 10, 8}, {30, 30, 28}));
    EXPECT_NEAR(volume(overlapping, 16000), 16000 - 1200, 22);  // 128 sections of 28 mm, jumps of 100 mm²
    shapes::Facets nested = large;
    shapes::append(nested, shapes::box({5, 5, 5}, {15, 15, 15}));
    EXPECT_NEAR(volume(nested, 9000), 8000, 16);
    shapes::Facets inside_out = large;
    shapes::append(inside_out, shapes::flipped(shapes::box({30, 0, 0}, {40, 10, 20})));
    EXPECT_NEAR(volume(inside_out, 6000), 10000, 1e-6);
}

TEST(SolidVolume, IsThatOfPointsWithAWindingNumberAtRandom) {
    Context context;
    std::mt19937 random(test::seed());
    for (int trial = 0; trial < kCompositions; ++trial) {
        const Mesh mesh = solid_of(context, test::Composer(random, {}).facets());
        const Box3 box = bounds(mesh.view());
        const Vec3f low = box.min, high = box.max;
        constexpr int n = 20;
        std::uniform_real_distribution<double> u(0, 1.0 / n);
        std::vector<Point> points;  // one in each cell of a grid
        for (int k = 0; k < n * n * n; ++k) {
            const double x = double(k % n) / n + u(random), y = double(k / n % n) / n + u(random),
                         z = double(k / n / n) / n + u(random);
            points.push_back(
                {low.x + x * (high.x - low.x), low.y + y * (high.y - low.y), low.z + z * (high.z - low.z)});
        }
        const std::vector<int> winding = windings_at(context, mesh.view(), points);
        const double whole = double(high.x - low.x) * (high.y - low.y) * (high.z - low.z);
        const double counted =
            whole *
            static_cast<double>(std::count_if(winding.begin(), winding.end(), [](int w) { return w != 0; })) /
            (n * n * n);
        const double found =
            solid_volume(context, mesh.view(), report_mesh(context, mesh.view()).volume_mm3).mm3;
        EXPECT_NEAR(found, counted, 0.01 * whole) << trial;
    }
}

TEST(StandingPart, CoversWhereTheWindingNumberIsNotZero) {
    Context context;
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> u(-5, 65), uz(0.1, 45);
    for (int trial = 0; trial < kCompositions; ++trial) {
        const shapes::Facets facets = test::Composer(random, {}).facets();
        const Mesh mesh = solid_of(context, facets);
        const StandingPart part(context, mesh.view());
        const double z_top = uz(random), x0 = -5.03, y0 = -4.98, cell = 3.1;
        constexpr int nx = 22, ny = 20;
        RisingEnvelope rising(part, x0, y0, cell, nx, ny);
        std::vector<float> heights(nx * ny);
        rising.at(z_top, -1, heights.data());
        for (int j = 0; j < ny; ++j)
            for (int i = 0; i < nx; ++i) {
                const double x = x0 + i * cell, y = y0 + j * cell;
                const Point under{x, y, z_top - StandingPart::kSheet};
                const bool stands = test::winding_by_angles(facets, under) != 0;
                EXPECT_EQ(part.covered(x, y, under[2]), stands)
                    << trial << " at " << x << ' ' << y << ' ' << under[2];
                const double height = part.envelope(x, y, z_top, -1);
                EXPECT_EQ(heights[static_cast<std::size_t>(j * nx + i)], static_cast<float>(height));
                EXPECT_EQ(height == z_top, stands);
                if (height < 0 || stands) continue;
                EXPECT_NE(test::winding_by_angles(facets, {x, y, height - 2e-7}), 0) << trial;
                EXPECT_EQ(test::winding_by_angles(facets, {x, y, (height + under[2]) / 2}), 0) << trial;
            }
    }
}

// Every point of every facet lies in the solid or on it: none may be within a cutter.
TEST(Cutting, KeepsOutOfWhateverWindsAroundNotZero) {
    Context context;
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> u(-5, 65), uz(5, 45), share(0, 1);
    for (int trial = 0; trial < kCompositions; ++trial) {
        shapes::Facets facets = test::Composer(random, {}).facets();
        // And a sheet without thickness, as folds leave them.
        const auto sheet_x = static_cast<float>(u(random));
        const shapes::Facets sheet{{Vec3f{sheet_x, 9, 8}, {sheet_x, 25, 12}, {sheet_x, 19, 40}}};
        shapes::append(facets, sheet);
        shapes::append(facets, shapes::flipped(sheet));
        const Mesh mesh = solid_of(context, facets);
        const double z_top = uz(random), z_low = std::max(0.0, z_top - 20);
        const LayerSolid solid = layer_solid(context, mesh.view(), z_low, z_top);
        std::vector<Point> points;
        for (const auto& f : facets)
            for (int i = 0; i < 30; ++i)
                if (const Point p = within(f, random); p[2] > z_low && p[2] < z_top - 0.002)
                    points.push_back(p);
        for (const bool flat : {false, true}) {
            const double r = 1.5 + 4 * share(random);
            const CutterShape cutter = flat ? flat_cutter(r) : ball_cutter(r);
            // How deep the point is in the cutter with its tip there, mm.
            const auto depth = [&](const Point& p, double x, double y, double tip) {
                const double across = std::hypot(p[0] - x, p[1] - y);
                if (flat) return std::min(r - across, p[2] - tip);
                return p[2] >= tip + r ? r - across : r - std::hypot(across, p[2] - tip - r);
            };
            const DropIndex drops(solid, cutter);
            for (int i = 0; i < 100; ++i) {
                const double x = u(random), y = u(random), tip = drops.drop(x, y).tip_z;
                if (!(tip > z_low)) continue;
                for (const Point& p : points)
                    ASSERT_LT(depth(p, x, y, tip), 1e-4) << trial << " drop at " << x << ' ' << y;
            }
            const double tip = z_low + share(random) * (z_top - z_low);
            const Plane plane = inside_plane(solid, cutter, tip);
            const Loops inside = slice(context, mesh.view(), {&plane, 1})[0].loops;
            std::vector<std::int32_t> lines;
            for (int i = -5; i < 66; i += 3) lines.push_back(to_units(i + 0.0371));
            for (const Axis axis : {Axis::x, Axis::y}) {
                const Fibres rows = fibres(context, solid, inside, cutter, tip, axis, lines);
                for (std::size_t l = 0; l < lines.size(); ++l)
                    for (int i = 0; i < 20; ++i) {
                        const double at = u(random);
                        bool free = true;
                        for (const Forbidden& f : rows.line(l)) free = free && (at <= f.low || at >= f.high);
                        if (!free) continue;
                        const double x = axis == Axis::x ? at : to_mm(lines[l]),
                                     y = axis == Axis::x ? to_mm(lines[l]) : at;
                        for (const Point& p : points)
                            ASSERT_LT(depth(p, x, y, tip), 1e-4)
                                << trial << " tip " << tip << " at " << x << ' ' << y << " r " << r;
                    }
            }
        }
    }
}

// Walls then lean out by what the noise is: no more of them stays than that, however far a way along them
// runs.
TEST(Undercuts, NoiseInTheVerticesMakesNone) {
    Context context;
    std::mt19937 random(test::seed());
    for (int trial = 0; trial < 40; ++trial) {
        const double most = std::pow(10, std::uniform_real_distribution<double>(-4, -3)(random));
        std::uniform_real_distribution<double> noise(-most, most);
        Mesh mesh = weld(context, luo_layer_sample());
        std::vector<double> tops{1.2 * 25.4, 1.5 * 25.4};  // its down-facing flat is made by a boundary
        for (Vec3f& p : mesh.vertices) {
            p.x = static_cast<float>(p.x + noise(random));
            p.y = static_cast<float>(p.y + noise(random));
        }
        mesh.roles = facet_roles(context, mesh.view());
        for (const UnmadeUndercut& u : measure_undercuts(context, mesh.view(), tops, {}))
            EXPECT_LT(u.thickness_mm, 0.01) << trial << " at " << u.x << ' ' << u.y << ' ' << u.z;
    }
}

TEST(Features, NoPeakLiesInAnotherBody) {
    Context context;
    std::mt19937 random(test::seed());
    for (int trial = 0; trial < kCompositions; ++trial) {
        const shapes::Facets facets = test::Composer(random, {}).facets();
        const Mesh mesh = solid_of(context, facets);
        for (const Feature& f : find_features(context, mesh.view(), {}).features) {
            if (f.type != FeatureType::peak && f.type != FeatureType::valley) continue;
            const auto at = [&](double z) {
                return test::winding_by_angles(facets, {f.x + 3e-7, f.y + 5e-7, z}) != 0;
            };
            EXPECT_FALSE(at(f.z_high + 4e-6)) << trial << " at " << f.x << ' ' << f.y << ' ' << f.z_high;
        }
    }
    // A cone whose tip lies within a box, and one inside out that stands out of it.
    shapes::Facets facets = shapes::box({0, 0, 0}, {40, 40, 20});
    const auto spike = [](float x, float low, float high) {
        shapes::Facets f;
        const std::array<Vec3f, 3> foot{{{x, 10, low}, {x + 6, 10, low}, {x + 3, 16, low}}};
        const Vec3f tip{x + 3, 12, high};
        f.push_back({foot[0], foot[2], foot[1]});
        for (std::size_t k = 0; k < 3; ++k) f.push_back({foot[k], foot[(k + 1) % 3], tip});
        return f;
    };
    shapes::append(facets, spike(5, -0.0F + 5, 15));
    shapes::append(facets, shapes::flipped(spike(20, 10, 30)));
    std::vector<double> peaks;
    for (const Feature& f : find_features(context, solid_of(context, facets).view(), {}).features)
        if (f.type == FeatureType::peak) peaks.push_back(f.z_high);
    EXPECT_EQ(peaks, std::vector<double>{30});
}
