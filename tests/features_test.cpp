#include "kernels/features/features.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>
#include <random>
#include <set>

#include "kernels/errors.h"
#include "kernels/features/filled_columns.h"
#include "kernels/features/section_areas.h"
#include "kernels/mesh/facet_roles.h"
#include "kernels/mesh/weld.h"
#include "kernels/repair/triangulate.h"
#include "kernels/slicing/slicing.h"
#include "tests/support/seed.h"

namespace slabwright {
namespace {

using Facets = std::vector<std::array<Vec3f, 3>>;

void quad(Facets& t, Vec3f a, Vec3f b, Vec3f c, Vec3f d) {
    t.push_back({a, b, c});
    t.push_back({a, c, d});
}

// An axis-parallel box, or the hollow of one.
void box(Facets& t, Vec3f lo, Vec3f hi, bool hollow = false) {
    Facets mine;
    auto p = [&](int i) { return Vec3f{i & 1 ? hi.x : lo.x, i & 2 ? hi.y : lo.y, i & 4 ? hi.z : lo.z}; };
    for (const auto& f :
         {std::array{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {1, 3, 7, 5}, {3, 2, 6, 7}, {2, 0, 4, 6}})
        quad(mine, p(f[0]), p(f[1]), p(f[2]), p(f[3]));
    for (auto f : mine) {
        if (hollow) std::swap(f[1], f[2]);
        t.push_back(f);
    }
}

// A closed solid under a height field on a grid of unit cells, z = heights[y][x], all diagonals one way.
using Field = std::vector<std::vector<float>>;
Facets under(const Field& h) {
    Facets t;
    const std::size_t ny = h.size(), nx = h[0].size();
    auto top = [&](std::size_t x, std::size_t y) {
        return Vec3f{static_cast<float>(x), static_cast<float>(y), h[y][x]};
    };
    auto low = [&](std::size_t x, std::size_t y) {
        return Vec3f{static_cast<float>(x), static_cast<float>(y), 0};
    };
    for (std::size_t y = 0; y + 1 < ny; ++y)
        for (std::size_t x = 0; x + 1 < nx; ++x) {
            quad(t, top(x, y), top(x + 1, y), top(x + 1, y + 1), top(x, y + 1));
            quad(t, low(x, y), low(x, y + 1), low(x + 1, y + 1), low(x + 1, y));
        }
    for (std::size_t x = 0; x + 1 < nx; ++x) {
        quad(t, low(x, 0), low(x + 1, 0), top(x + 1, 0), top(x, 0));
        quad(t, low(x + 1, ny - 1), low(x, ny - 1), top(x, ny - 1), top(x + 1, ny - 1));
    }
    for (std::size_t y = 0; y + 1 < ny; ++y) {
        quad(t, low(nx - 1, y), low(nx - 1, y + 1), top(nx - 1, y + 1), top(nx - 1, y));
        quad(t, low(0, y + 1), low(0, y), top(0, y), top(0, y + 1));
    }
    return t;
}

FeatureOptions options(Finder finder = Finder::exact) {
    FeatureOptions o;
    o.finder = finder;
    o.flat_merge_mm = 0.05;
    o.chordal_deviation_mm = 0.01;
    return o;
}

FeatureSet find(const Facets& facets, const FeatureOptions& o = options()) {
    Context context;
    return find_features(context, weld(context, facets).view(), o);
}

std::vector<Feature> of(const FeatureSet& set, FeatureType type) {
    std::vector<Feature> found;
    for (const Feature& f : set.features)
        if (f.type == type) found.push_back(f);
    return found;
}

TEST(Features, BoxHasOneFlatAndItsBaseIsNone) {
    Facets t;
    box(t, {0, 0, 0}, {30, 20, 10});
    const FeatureSet set = find(t);
    ASSERT_EQ(set.features.size(), 1u);
    const Feature& f = set.features[0];
    EXPECT_EQ(f.type, FeatureType::up_flat);
    EXPECT_EQ(f.z_low, 10);
    EXPECT_EQ(f.z_high, 10);
    EXPECT_DOUBLE_EQ(f.area, 600);
    EXPECT_EQ(f.facets.size(), 2u);
    EXPECT_EQ(name(f.type), "up_flat");
    EXPECT_EQ(name(f.found_by), "facets");
}

// Below the top of a bubble the surface ends going up, as at a peak, but the solid lies around it; at its
// bottom it begins.
TEST(Features, HollowsAndBulgesAreNoPeaksOrValleys) {
    Facets t;
    box(t, {0, 0, 0}, {30, 30, 30});
    const std::array<Vec3f, 6> o = {Vec3f{10, 15, 15}, {20, 15, 15}, {15, 10, 15},
                                    {15, 20, 15},      {15, 15, 10}, {15, 15, 20}};
    auto octahedron = [&](bool hollow, float dx) {
        for (const auto& f : {std::array{0, 2, 5},
                              {2, 1, 5},
                              {1, 3, 5},
                              {3, 0, 5},
                              {2, 0, 4},
                              {1, 2, 4},
                              {3, 1, 4},
                              {0, 3, 4}}) {
            std::array<Vec3f, 3> facet = {o[f[0]], o[f[1]], o[f[2]]};
            for (Vec3f& p : facet) p.x += dx;
            if (hollow) std::swap(facet[1], facet[2]);
            t.push_back(facet);
        }
    };
    octahedron(true, 0);
    octahedron(false, 40);
    for (const Finder finder : {Finder::exact, Finder::halving}) {
        const FeatureSet set = find(t, options(finder));
        const auto peaks = of(set, FeatureType::peak), valleys = of(set, FeatureType::valley);
        const double within = finder == Finder::exact ? 0 : 0.127;
        ASSERT_EQ(peaks.size(), 1u);  // of the solid octahedron only
        EXPECT_NEAR(peaks[0].z_low, 20, within);
        EXPECT_GT(peaks[0].x, 40);
        ASSERT_EQ(valleys.size(), 1u);  // the hollow's floor
        EXPECT_NEAR(valleys[0].z_low, 10, within);
        EXPECT_LT(valleys[0].x, 30);
    }
}

TEST(Features, ASliverIsNoFlatButTwoFacetsAre) {
    // A roof whose ridge was repaired with a needle of level facet, and one cut off by a real strip.
    for (const double width : {0.005, 0.5}) {
        const auto w = static_cast<float>(width);
        Facets t;
        const Vec3f a{0, 0, 0}, b{20, 0, 0}, c{20, 10, 0}, d{0, 10, 0}, r{0, 5, 4}, s{20, 5, 4},
            m{10, 5 + w, 4};
        quad(t, a, d, c, b);
        t.push_back({a, b, s});
        t.push_back({a, s, r});
        t.push_back({r, s, m});  // level
        t.push_back({s, c, m});
        t.push_back({c, d, m});
        t.push_back({d, r, m});
        t.push_back({b, c, s});
        t.push_back({a, r, d});
        const FeatureSet set = find(t);
        EXPECT_EQ(of(set, FeatureType::up_flat).size(), width > 0.01 ? 1u : 0u);
        EXPECT_EQ(of(set, FeatureType::peak).size(), width > 0.01 ? 0u : 1u);
    }
}

TEST(Features, PeaksNearAFlatAreDroppedAndFarOnesStay) {
    Field h(12, std::vector<float>(12, 5.0f));
    h[3][3] = 5.04f;  // within flat_merge of the flat around it
    h[8][8] = 6.0f;
    const FeatureSet set = find(under(h));
    ASSERT_EQ(of(set, FeatureType::peak).size(), 1u);
    EXPECT_FLOAT_EQ(static_cast<float>(of(set, FeatureType::peak)[0].z_low), 6.0f);
    EXPECT_EQ(of(set, FeatureType::up_flat).size(), 1u);
}

// Brute force: components of equal height by flooding the grid's own edges, then the heights around them. A
// rim vertex has the wall's foot among its neighbours, so the rim bears no valleys.
TEST(Features, ExactScanAgreesWithBruteForceOnRandomFields) {
    const unsigned seed = test::seed();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    for (int round = 0; round < 40; ++round) {
        const int nx = 4 + static_cast<int>(random() % 20), ny = 4 + static_cast<int>(random() % 20),
                  levels = round % 2 ? 4 : 100000;
        Field h(static_cast<std::size_t>(ny), std::vector<float>(static_cast<std::size_t>(nx)));
        for (auto& row : h)
            for (float& z : row)
                z = 1.0f + static_cast<float>(random() % static_cast<unsigned>(levels)) *
                               (8.0f / static_cast<float>(levels));
        FeatureOptions o = options();
        o.flat_merge_mm = 0;
        const Facets facets = under(h);
        const FeatureSet set = find(facets, o);

        using Node = std::pair<int, int>;
        auto z = [&](Node n) {
            return h[static_cast<std::size_t>(n.second)][static_cast<std::size_t>(n.first)];
        };
        auto around = [&](Node n) {
            std::vector<Node> result;
            for (const auto& [dx, dy] : {Node{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, -1}}) {
                const Node m{n.first + dx, n.second + dy};
                if (m.first >= 0 && m.first < nx && m.second >= 0 && m.second < ny) result.push_back(m);
            }
            return result;
        };
        std::map<Node, bool> seen;
        std::multiset<float> peaks, valleys;
        for (int y = 0; y < ny; ++y)
            for (int x = 0; x < nx; ++x) {
                if (seen[{x, y}]) continue;
                std::vector<Node> plateau{{x, y}};
                seen[{x, y}] = true;
                bool higher = false, lower = false, flat = false;
                for (std::size_t i = 0; i < plateau.size(); ++i) {
                    const Node n = plateau[i];
                    lower = lower || n.first == 0 || n.second == 0 || n.first == nx - 1 || n.second == ny - 1;
                    for (const Node& m : around(n)) {
                        higher = higher || z(m) > z(n);
                        lower = lower || z(m) < z(n);
                        if (z(m) != z(n)) continue;
                        // A level facet of the plateau makes it a flat: both triangles of n's cell, and of
                        // the cells beside.
                        for (const Node& k : around(n))
                            flat = flat || (k != m && z(k) == z(n) && [&] {
                                       const auto beside = around(m);
                                       return std::find(beside.begin(), beside.end(), k) != beside.end();
                                   }());
                        if (!seen[m]) {
                            seen[m] = true;
                            plateau.push_back(m);
                        }
                    }
                }
                if (flat) continue;
                if (!higher) peaks.insert(z({x, y}));
                if (!lower) valleys.insert(z({x, y}));
            }
        std::multiset<float> found_peaks, found_valleys;
        for (const Feature& f : of(set, FeatureType::peak)) found_peaks.insert(static_cast<float>(f.z_low));
        for (const Feature& f : of(set, FeatureType::valley))
            found_valleys.insert(static_cast<float>(f.z_low));
        ASSERT_EQ(found_peaks, peaks) << "round " << round;
        ASSERT_EQ(found_valleys, valleys) << "round " << round;
        // On a sphere peaks and pits outnumber saddles by two, a saddle that joins more than two counting as
        // often; the base is one pit. No saddle is counted where plateaus were left out as flats.
        if (levels > 4) {
            const std::size_t saddles = of(set, FeatureType::saddle).size();
            EXPECT_LE(saddles + 1, peaks.size() + valleys.size());
            EXPECT_EQ(saddles > 0, peaks.size() + valleys.size() > 1);
        }
    }
}

TEST(Features, SaddleBetweenTwoPeaks) {
    Field h(7, std::vector<float>(11));
    for (std::size_t y = 0; y < 7; ++y)
        for (std::size_t x = 0; x < 11; ++x) {
            const float dy = static_cast<float>(y) - 3, d1 = static_cast<float>(x) - 2.9f,
                        d2 = static_cast<float>(x) - 8.1f;
            h[y][x] = 2 + 10 / (1 + d1 * d1 + dy * dy * 1.01f) + 9 / (1 + d2 * d2 + dy * dy * 1.03f);
        }
    const FeatureSet set = find(under(h));
    EXPECT_EQ(of(set, FeatureType::peak).size(), 2u);
    EXPECT_EQ(of(set, FeatureType::valley).size(), 0u);
    ASSERT_EQ(of(set, FeatureType::saddle).size(), 1u);
    EXPECT_NEAR(of(set, FeatureType::saddle)[0].x, 5.5, 1.0);
}

TEST(Features, HalvingFindsWhatStandsAloneWithinItsResolution) {
    // Pyramids and pits far apart, at heights that no coarse plane meets.
    const unsigned seed = test::seed();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    Field h(32, std::vector<float>(32, 20.0f));
    std::uniform_real_distribution<float> up(26, 40), down(2, 14);
    std::vector<double> peaks, valleys;
    for (std::size_t y = 4; y < 30; y += 7)
        for (std::size_t x = 4; x < 30; x += 7) {
            const bool peak = random() % 2;
            h[y][x] = peak ? up(random) : down(random);
            (peak ? peaks : valleys).push_back(h[y][x]);
        }
    FeatureOptions o = options(Finder::halving);
    const FeatureSet halving = find(under(h), o);
    auto expect_near = [&](FeatureType type, std::vector<double> truth) {
        std::vector<double> found;
        for (const Feature& f : of(halving, type)) found.push_back(f.z_low);
        std::sort(truth.begin(), truth.end());
        std::sort(found.begin(), found.end());
        ASSERT_EQ(found.size(), truth.size());
        for (std::size_t i = 0; i < truth.size(); ++i)
            EXPECT_NEAR(found[i], truth[i], o.halving_resolution_mm / 2);
    };
    expect_near(FeatureType::peak, peaks);
    expect_near(FeatureType::valley, valleys);
    o.finder = Finder::both;
    for (const FinderDisagreement& d : find(under(h), o).disagreements)
        EXPECT_EQ(d.type, FeatureType::saddle);
}

TEST(Features, BothReportsWhatHalvingMisses) {
    // A pimple that appears and vanishes within one coarse step, on a slope that is no flat.
    Field h(20, std::vector<float>(20));
    for (std::size_t y = 0; y < 20; ++y)
        for (std::size_t x = 0; x < 20; ++x)
            h[y][x] = 5 + 0.5f * static_cast<float>(x) + 0.01f * static_cast<float>(y);
    h[10][10] += 0.8f;
    const FeatureSet set = find(under(h), options(Finder::both));
    bool reported = false;
    for (const FinderDisagreement& d : set.disagreements)
        reported = reported || (d.type == FeatureType::peak && d.found_by == FoundBy::exact &&
                                std::abs(d.x - 10) < 0.1 && std::abs(d.y - 10) < 0.1);
    EXPECT_TRUE(reported);
}

TEST(Features, ShallowPatchesHaveTheirFacetsRanges) {
    // A ramp of 10° between two of 30°.
    Facets t;
    const double t10 = std::tan(10 * M_PI / 180), t30 = std::tan(30 * M_PI / 180);
    const std::array<double, 4> x = {0, 10, 30, 40},
                                z = {5, 5 + 10 * t30, 5 + 10 * t30 + 20 * t10, 5 + 20 * t30 + 20 * t10};
    auto p = [&](int i, float y) {
        return Vec3f{static_cast<float>(x[static_cast<std::size_t>(i)]), y,
                     static_cast<float>(z[static_cast<std::size_t>(i)])};
    };
    for (int i = 0; i < 3; ++i) quad(t, p(i, 0), p(i + 1, 0), p(i + 1, 10), p(i, 10));
    const FeatureSet set = find(t);
    const auto shallow = of(set, FeatureType::shallow);
    ASSERT_EQ(shallow.size(), 1u);
    EXPECT_EQ(shallow[0].z_low, static_cast<double>(static_cast<float>(z[1])));
    EXPECT_EQ(shallow[0].z_high, static_cast<double>(static_cast<float>(z[2])));
    EXPECT_NEAR(shallow[0].area, 200 / std::cos(10 * M_PI / 180), 1e-3);
    EXPECT_EQ(shallow[0].facets, (std::vector<std::uint32_t>{2, 3}));
}

TEST(Features, SameOnAnyNumberOfThreads) {
    std::mt19937 random(7);
    Field h(90, std::vector<float>(90));
    for (auto& row : h)
        for (float& z : row) z = 1.0f + static_cast<float>(random() % 50) / 5.0f;
    std::vector<FeatureSet> sets;
    for (const int threads : {1, 2, 5}) {
        Context context({threads, 0, {}});
        sets.push_back(find_features(context, weld(context, under(h)).view(), options(Finder::both)));
    }
    for (std::size_t i = 1; i < sets.size(); ++i) {
        ASSERT_EQ(sets[i].features.size(), sets[0].features.size());
        for (std::size_t k = 0; k < sets[0].features.size(); ++k) {
            const Feature &a = sets[0].features[k], &b = sets[i].features[k];
            ASSERT_TRUE(a.type == b.type && a.z_low == b.z_low && a.z_high == b.z_high && a.x == b.x &&
                        a.y == b.y && a.area == b.area && a.facets == b.facets);
        }
        EXPECT_EQ(sets[i].disagreements.size(), sets[0].disagreements.size());
    }
    EXPECT_GT(sets[0].features.size(), 100u);
}

TEST(Features, OptionsOutOfRangeAreUsageErrors) {
    Facets t;
    box(t, {0, 0, 0}, {1, 1, 1});
    for (double FeatureOptions::*key :
         {&FeatureOptions::shallow_limit_rad, &FeatureOptions::halving_coarse_mm,
          &FeatureOptions::halving_resolution_mm, &FeatureOptions::horizontal_rad,
          &FeatureOptions::flat_merge_mm})
        for (const double bad : {-1.0, std::nan("")}) {
            FeatureOptions o;
            o.*key = bad;
            try {
                (void)find(t, o);
                FAIL();
            } catch (const Error& e) {
                EXPECT_EQ(e.kind(), ErrorKind::usage);
                EXPECT_EQ(e.code(), "features.options");
            }
        }
    EXPECT_TRUE(find({}).features.empty());
}

TEST(Features, CancelStops) {
    Context context;
    Facets t;
    box(t, {0, 0, 0}, {1, 1, 1});
    const Mesh mesh = weld(context, t);
    context.cancel();
    EXPECT_THROW((void)find_features(context, mesh.view(), options()), Error);
    EXPECT_THROW((void)measure_undercuts(context, mesh.view(), std::array{1.0}, options()), Error);
}

std::vector<UnmadeUndercut> unmade(const Facets& t, std::vector<double> tops) {
    Context context;
    return measure_undercuts(context, weld(context, t).view(), tops);
}

// A beam over a gap: legs 0..10 and 20..30, beam 10..15 mm high.
Facets bridge() {
    Facets t;
    const std::array<std::array<float, 2>, 8> p = {
        {{0, 0}, {10, 0}, {10, 10}, {20, 10}, {20, 0}, {30, 0}, {30, 15}, {0, 15}}};
    for (std::size_t i = 0; i < p.size(); ++i) {
        const auto a = p[i], b = p[(i + 1) % p.size()];
        quad(t, {a[0], 0, a[1]}, {a[0], 8, a[1]}, {b[0], 8, b[1]}, {b[0], 0, b[1]});
    }
    for (const auto& f :
         {std::array<std::size_t, 3>{0, 1, 2}, {0, 2, 7}, {2, 3, 7}, {3, 6, 7}, {3, 4, 5}, {3, 5, 6}}) {
        auto at = [&](std::size_t i, float y) { return Vec3f{p[i][0], y, p[i][1]}; };
        t.push_back({at(f[0], 0), at(f[1], 0), at(f[2], 0)});
        t.push_back({at(f[0], 8), at(f[2], 8), at(f[1], 8)});
    }
    return t;
}

TEST(Undercuts, AFlatIsMadeByItsBoundaryAndOtherwiseLeavesItsHeight) {
    const Facets t = bridge();
    EXPECT_TRUE(unmade(t, {10, 15}).empty());
    EXPECT_TRUE(unmade(t, {4, 10.0005, 15}).empty());
    struct Case {
        std::vector<double> tops;
        double depth;
    };
    for (const Case& c : {Case{{15}, 10}, Case{{4, 15}, 6}, Case{{9.5, 15}, 0.5}, Case{{10.5, 15}, 10}}) {
        const auto u = unmade(t, c.tops);
        ASSERT_EQ(u.size(), 1u);
        EXPECT_EQ(u[0].type, FeatureType::down_flat);
        EXPECT_NEAR(u[0].height_mm, c.depth, 1e-6);
        EXPECT_NEAR(u[0].thickness_mm, c.depth, 1e-6);
        EXPECT_NEAR(u[0].volume_mm3, 80 * c.depth, 2 * c.depth);
        EXPECT_NEAR(u[0].area_mm2, 80, 1e-3);
        EXPECT_NEAR(u[0].z, 10, 1e-6);
        EXPECT_EQ(u[0].facets.size(), 2u);
    }
}

// A steep roof, and under it, at √17 mm, a floor along it with a slot of 2√17 mm, right where a facet of the
// roof has its centroid and nowhere near a corner, the middle of an edge or the tallest column.
TEST(Undercuts, ASlotUnderTheCentroidOfARoofIsMeasured) {
    const std::vector<std::array<float, 2>> p{
        {0, 0},        {80, 0},  {80, 197}, {56, 197}, {42.25F, 142}, {50.25F, 140}, {49.75F, 138},
        {41.75F, 140}, {14, 29}, {10, 30},  {52, 198}, {52, 210},     {0, 210}};
    const auto at = [&](std::size_t i, float y) { return Vec3f{p[i % p.size()][0], y, p[i % p.size()][1]}; };
    Facets t;
    std::vector<Xyz> outline;
    std::vector<std::uint32_t> around;
    for (std::size_t i = 0; i < p.size(); ++i) {
        quad(t, at(i, 0), at(i, 30), at(i + 1, 30), at(i + 1, 0));
        outline.push_back({p[i][0], 0, p[i][1]});
        around.push_back(static_cast<std::uint32_t>(i));
    }
    for (const auto& f : clip_ears(outline, {around}, {0, 1, 0})) {
        t.push_back({at(f[0], 0), at(f[1], 0), at(f[2], 0)});
        t.push_back({at(f[0], 30), at(f[2], 30), at(f[1], 30)});
    }
    double thickest = 0;
    for (const UnmadeUndercut& u : unmade(t, {210})) thickest = std::max(thickest, u.thickness_mm);
    EXPECT_NEAR(thickest, 3 * std::sqrt(17), 1e-4);
}

TEST(Undercuts, SolidBelowEndsTheDepth) {
    Facets t = bridge();
    box(t, {12, 1, 0}, {18, 7, 7});  // a block in the gap
    const auto u = unmade(t, {15});
    ASSERT_EQ(u.size(), 1u);
    // Nothing stands under the flat's rim: there the layer's bottom ends it, 10 mm down; over the block it
    // would be 3.
    EXPECT_NEAR(u[0].height_mm, 10, 1e-6);
    EXPECT_NEAR(u[0].volume_mm3, 80 * 10 - 36 * 7, 15);
    Facets full = bridge();
    box(full, {10, 0, 0}, {20, 8, 7});
    const auto v = unmade(full, {15});
    ASSERT_EQ(v.size(), 1u);
    EXPECT_NEAR(v[0].height_mm, 3, 1e-6);
    EXPECT_NEAR(v[0].volume_mm3, 80 * 3, 5);
}

TEST(Undercuts, AFlatInsideAnotherShellIsNone) {
    Facets t;
    box(t, {0, 0, 0}, {30, 30, 30});
    box(t, {10, 10, 10}, {20, 20, 40});
    EXPECT_TRUE(unmade(t, {40}).empty());
}

// A wall that leans out by `lean` over `height`: the wedge under it stays, as deep as it leans.
Facets leaning(float lean, float height) {
    Facets t;
    const Vec3f a{0, 0, 0}, b{50, 0, 0}, c{50, 20, 0}, d{0, 20, 0}, e{0, 0, height}, f{50 + lean, 0, height},
        g{50 + lean, 20, height}, h{0, 20, height};
    quad(t, a, d, c, b);
    quad(t, e, f, g, h);
    quad(t, a, b, f, e);
    quad(t, b, c, g, f);
    quad(t, c, d, h, g);
    quad(t, d, a, e, h);
    return t;
}

TEST(Undercuts, NearVerticalWallsAreAsDeepAsTheyLean) {
    const auto thin = unmade(leaning(0.01f, 1000), {1000});
    ASSERT_EQ(thin.size(), 1u);
    EXPECT_LE(thin[0].thickness_mm, 0.0101);
    EXPECT_GE(thin[0].thickness_mm, 0.009);
    EXPECT_NEAR(thin[0].area_mm2, 20000, 1);
    // Layers cut the lean: each can only be as deep as its own share.
    std::vector<double> tops;
    for (int i = 1; i <= 50; ++i) tops.push_back(20.0 * i);
    const auto cut = unmade(leaning(1.0f, 1000), tops);
    ASSERT_EQ(cut.size(), 1u);
    EXPECT_LE(cut[0].thickness_mm, 0.0201);
    EXPECT_GE(cut[0].thickness_mm, 0.018);
    EXPECT_TRUE(unmade(leaning(0.01f, 1000), tops).empty());  // a fifth of a micrometre a layer
    // 45°: along the normal from the middle of the wall both ways out are height / √2 long.
    const auto steep = unmade(leaning(10, 10), {10});
    ASSERT_EQ(steep.size(), 1u);
    EXPECT_NEAR(steep[0].thickness_mm, 10 / std::sqrt(2.0), 0.15);
    EXPECT_NEAR(steep[0].height_mm, 10, 0.15);
    EXPECT_NEAR(steep[0].volume_mm3, 20 * 50, 5);
}

// A hole from below whose walls lean in by a hair and then stand upright, so that no edge joins them to the
// ceiling: one body of air stays, and it is told once.
TEST(Undercuts, WallsUnderACeilingBelongToIt) {
    Facets t;
    box(t, {-20, -20, 0}, {20, 20, 30});
    const auto corner = [](int k, float r, float z) {
        return Vec3f{k == 0 || k == 3 ? -r : r, k < 2 ? -r : r, z};
    };
    // A body inside out: what both hold counts as none.
    const auto ring = [&](float r0, float z0, float r1, float z1) {
        for (int k = 0; k < 4; ++k)
            quad(t, corner(k, r0, z0), corner(k, r1, z1), corner((k + 1) % 4, r1, z1),
                 corner((k + 1) % 4, r0, z0));
    };
    ring(5.01F, 0, 5, 15);
    ring(5, 15, 5, 20);
    quad(t, corner(0, 5.01F, 0), corner(1, 5.01F, 0), corner(2, 5.01F, 0), corner(3, 5.01F, 0));
    quad(t, corner(0, 5, 20), corner(3, 5, 20), corner(2, 5, 20), corner(1, 5, 20));
    const auto u = unmade(t, {30});
    ASSERT_EQ(u.size(), 1u);
    EXPECT_NEAR(u[0].height_mm, 20, 0.01);
    EXPECT_NEAR(u[0].volume_mm3, 10 * 10 * 20, 60);
    EXPECT_NEAR(u[0].area_mm2, 100 + 4 * 10 * 15, 1);
}

TEST(Undercuts, TopsMustAscend) {
    const Facets t = bridge();
    for (const std::vector<double>& tops : {std::vector<double>{5, 5}, {5, 4}, {0.0}, {std::nan("")}})
        EXPECT_THROW((void)unmade(t, tops), Error);
}

// Brute force: a solid of random overlapping boxes on a grid of millimetres. In a layer, the cells without
// solid that have solid straight above them within the layer stay; the deepest run of such cells under a flat
// is its depth.
TEST(Undercuts, AgreesWithCellsOnRandomBoxes) {
    const unsigned seed = test::seed();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    constexpr int n = 10;
    for (int round = 0; round < 30; ++round) {
        // A base plate, then boxes that touch it or one another; disjoint cells become facets, inner faces
        // are left out.
        std::array<std::array<std::array<bool, n + 2>, n + 2>, n + 2> solid{};
        auto cell = [&](int x, int y, int z) -> bool& {
            return solid[static_cast<std::size_t>(x + 1)][static_cast<std::size_t>(y + 1)]
                        [static_cast<std::size_t>(z + 1)];
        };
        for (int x = 0; x < n; ++x)
            for (int y = 0; y < n; ++y) cell(x, y, 0) = true;
        for (int k = 0; k < 8; ++k) {
            const int x = static_cast<int>(random() % n), y = static_cast<int>(random() % n),
                      z = static_cast<int>(random() % n);
            for (int i = x; i < std::min<int>(n, x + 3); ++i)
                for (int j = y; j < std::min<int>(n, y + 4); ++j)
                    for (int l = z; l < std::min<int>(n, z + 2); ++l) cell(i, j, l) = true;
        }
        Facets t;
        for (int x = 0; x < n; ++x)
            for (int y = 0; y < n; ++y)
                for (int z = 0; z < n; ++z) {
                    if (!cell(x, y, z)) continue;
                    const Vec3f lo{static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)},
                        hi{lo.x + 1, lo.y + 1, lo.z + 1};
                    Facets whole;
                    box(whole, lo, hi);
                    const std::array<std::array<int, 3>, 6> out = {
                        {{0, 0, -1}, {0, 0, 1}, {0, -1, 0}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 0}}};
                    for (std::size_t side = 0; side < 6; ++side)
                        if (!cell(x + out[side][0], y + out[side][1], z + out[side][2]))
                            t.insert(t.end(), whole.begin() + 2 * static_cast<long>(side),
                                     whole.begin() + 2 * static_cast<long>(side) + 2);
                }
        const int split = 1 + static_cast<int>(random() % (n - 1));
        double deepest = 0, area = 0, volume = 0;
        int height = 0;
        for (int x = 0; x < n; ++x)
            for (int y = 0; y < n; ++y)
                for (int z = 0; z < n; ++z)
                    if (cell(x, y, z)) height = std::max(height, z + 1);
        for (int x = 0; x < n; ++x)
            for (int y = 0; y < n; ++y)
                for (int z = 1; z < n; ++z) {
                    if (!cell(x, y, z) || cell(x, y, z - 1)) continue;
                    const int bottom = z >= split ? split : 0;
                    int depth = 0;
                    while (z - depth > bottom && !cell(x, y, z - depth - 1)) ++depth;
                    if (depth == 0) continue;
                    deepest = std::max<double>(deepest, depth);
                    area += 1;
                    volume += depth;
                }
        std::vector<double> tops;
        if (split < height) tops.push_back(split);
        tops.push_back(height);
        double found_highest = 0, found_thickest = 0, found_area = 0, found_volume = 0;
        for (const UnmadeUndercut& u : unmade(t, tops)) {
            found_highest = std::max(found_highest, u.height_mm);
            found_thickest = std::max(found_thickest, u.thickness_mm);
            found_area += u.area_mm2;
            found_volume += u.volume_mm3;
        }
        ASSERT_NEAR(found_highest, deepest, 1e-6) << "round " << round;
        ASSERT_NEAR(found_thickest, deepest, 1e-6) << "round " << round;
        ASSERT_NEAR(found_volume, volume, 0.01 * volume + 0.05) << "round " << round;
        ASSERT_NEAR(found_area, area, 1e-6) << "round " << round;
    }
}

// A box turned about all axes: what of an upright line lies in it follows from its six planes.
struct TurnedBox {
    Facets facets;
    std::array<std::array<double, 4>, 6> planes{};  // n·p ≤ d

    // The height of the box over (x, y), or nothing.
    [[nodiscard]] std::optional<std::array<double, 2>> over(double x, double y) const {
        double low = -HUGE_VAL, high = HUGE_VAL;
        for (const auto& [a, b, c, d] : planes) {
            const double left = d - a * x - b * y;
            if (c > 1e-12) high = std::min(high, left / c);
            else if (c < -1e-12) low = std::max(low, left / c);
            else if (left < 0) return {};
        }
        if (low >= high) return {};
        return std::array{low, high};
    }
};

TurnedBox turned_box(std::mt19937& random, double side) {
    std::uniform_real_distribution<double> unit(0, 1);
    const double a = 6.2832 * unit(random), b = 1.5 * unit(random), w = 4 + 16 * unit(random),
                 d = 4 + 16 * unit(random), h = 3 + 6 * unit(random);
    const std::array<std::array<double, 3>, 3> axes{
        {{std::cos(a) * std::cos(b), std::sin(a) * std::cos(b), std::sin(b)},
         {-std::sin(a), std::cos(a), 0},
         {-std::cos(a) * std::sin(b), -std::sin(a) * std::sin(b), std::cos(b)}}};
    const std::array<double, 3> size{w, d, h},
        at{side * unit(random), side * unit(random), 30 * unit(random)};
    TurnedBox made;
    box(made.facets, {0, 0, 0}, {1, 1, 1});
    for (auto& facet : made.facets)
        for (Vec3f& v : facet) {
            const std::array<double, 3> u{v.x * w, v.y * d, v.z * h};
            std::array<double, 3> p = at;
            for (std::size_t k = 0; k < 3; ++k)
                for (std::size_t c = 0; c < 3; ++c) p[c] += u[k] * axes[k][c];
            v = {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])};
        }
    for (std::size_t k = 0; k < 3; ++k) {
        const double from = at[0] * axes[k][0] + at[1] * axes[k][1] + at[2] * axes[k][2];
        made.planes[2 * k] = {axes[k][0], axes[k][1], axes[k][2], from + size[k]};
        made.planes[2 * k + 1] = {-axes[k][0], -axes[k][1], -axes[k][2], -from};
    }
    return made;
}

// Brute force: upright lines through a union of turned boxes on a plate, known from the boxes' planes.
TEST(Undercuts, HeightAndVolumeAgreeWithLinesThroughTurnedBoxes) {
    const unsigned seed = test::seed();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    constexpr double side = 40;
    for (int round = 0; round < 12; ++round) {
        Facets t;
        box(t, {-30, -30, -40}, {side + 30, side + 30, -30});
        std::vector<TurnedBox> boxes;
        for (int k = 0; k < 3 + round % 4; ++k) {
            boxes.push_back(turned_box(random, side));
            t.insert(t.end(), boxes.back().facets.begin(), boxes.back().facets.end());
        }
        Context context;
        Mesh mesh = weld(context, t);
        mesh.roles = facet_roles(context, mesh.view());
        const double top = bounds(mesh.view()).max.z;
        std::vector<double> tops{-30, -12.34, 3.21, 17.77};
        std::erase_if(tops, [&](double z) { return z >= top; });
        tops.push_back(top);
        double highest = 0, volume = 0;
        constexpr double cell = 0.2;
        for (double x = -30 + cell / 2; x < side + 30; x += cell)
            for (double y = -30 + cell / 2; y < side + 30; y += cell) {
                std::vector<std::array<double, 2>> solid{{-40, -30}};
                for (const TurnedBox& b : boxes)
                    if (const auto over = b.over(x, y)) solid.push_back(*over);
                std::sort(solid.begin(), solid.end());
                double reached = -30;
                for (const auto& [low, high] : solid) {
                    // Air between `reached` and `low`: of the layer that the roof lies in.
                    if (low > reached) {
                        double bottom = -40;
                        for (std::size_t l = 0; l + 1 < tops.size(); ++l)
                            if (tops[l] <= low) bottom = tops[l];
                        const double air = low - std::max(bottom, reached);
                        highest = std::max(highest, air);
                        volume += air * cell * cell;
                    }
                    reached = std::max(reached, high);
                }
            }
        double found_highest = 0, found_volume = 0;
        for (const UnmadeUndercut& u : measure_undercuts(context, mesh.view(), tops)) {
            found_volume += u.volume_mm3;
            found_highest = std::max(found_highest, u.height_mm);
            EXPECT_LE(u.thickness_mm, u.height_mm + 1e-9);
        }
        EXPECT_NEAR(found_highest, highest, 1.5) << "round " << round;
        EXPECT_NEAR(found_volume, volume, 0.02 * volume + 1) << "round " << round;
    }
}

// Each line of filled_gaps() looked up by itself.
TEST(Undercuts, ALineCountsForTheHeightWhereItsFourNeighboursHoldSuchAir) {
    const unsigned seed = test::seed();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    constexpr double side = 40, cell = 0.5;
    std::array<std::size_t, 4> lacks{};  // the tallest line of a facet only the neighbour on this side
    for (int round = 0; round < 30; ++round) {
        Facets t;
        box(t, {-30, -30, -40}, {side + 30, side + 30, -30});
        for (int k = 0; k < 4; ++k) {
            const TurnedBox more = turned_box(random, side);
            t.insert(t.end(), more.facets.begin(), more.facets.end());
        }
        Context context;
        const Mesh mesh = weld(context, t);
        const std::vector<double> borders{-40, -12.34, 3.21, 17.77, HUGE_VAL};
        const ColumnGrid grid{-30 + cell / 2, -30 + cell / 2, cell, 200, 200};
        const std::vector<std::vector<FilledGap>> rows = filled_gaps(context, mesh.view(), borders, grid);
        std::set<std::array<long, 3>> held;  // row, column, layer
        for (std::size_t row = 0; row < rows.size(); ++row)
            for (const FilledGap& gap : rows[row])
                held.insert({static_cast<long>(row), long{gap.column}, long{gap.layer}});
        std::vector<FilledUnder> expected(mesh.facets.size());
        std::vector<double> tallest(mesh.facets.size());
        std::vector<int> lacking(mesh.facets.size());  // of the tallest line: a bit for each neighbour
        for (std::size_t row = 0; row < rows.size(); ++row)
            for (const FilledGap& gap : rows[row]) {
                FilledUnder& under = expected[gap.facet];
                const double height = gap.high - gap.low;
                under.volume_mm3 += height * cell * cell;
                const long r = static_cast<long>(row), c = gap.column, layer = gap.layer;
                const std::array<std::array<long, 3>, 4> around{
                    {{r, c - 1, layer}, {r, c + 1, layer}, {r - 1, c, layer}, {r + 1, c, layer}}};
                int lacks_now = 0;
                for (std::size_t k = 0; k < 4; ++k) lacks_now |= held.count(around[k]) != 0 ? 0 : 1 << k;
                if (height > tallest[gap.facet]) tallest[gap.facet] = height, lacking[gap.facet] = lacks_now;
                if (lacks_now != 0 || height <= under.height_mm) continue;
                under.height_mm = height;
                under.x = grid.x0 + static_cast<double>(c) * cell;
                under.y = grid.y0 + static_cast<double>(r) * cell;
                under.z = gap.high;
                under.layer = gap.layer;
            }
        const std::vector<FilledUnder> found = filled_under(context, mesh.view(), borders, cell);
        ASSERT_EQ(found.size(), expected.size());
        for (std::size_t f = 0; f < found.size(); ++f) {
            EXPECT_NEAR(found[f].volume_mm3, expected[f].volume_mm3, 1e-9 * (1 + expected[f].volume_mm3));
            EXPECT_EQ(found[f].height_mm, expected[f].height_mm);
            EXPECT_NEAR(found[f].x, expected[f].x, 1e-9);
            EXPECT_NEAR(found[f].y, expected[f].y, 1e-9);
            EXPECT_EQ(found[f].z, expected[f].z);
            EXPECT_EQ(found[f].layer, expected[f].layer);
            for (std::size_t k = 0; k < 4; ++k) lacks[k] += lacking[f] == 1 << k;
        }
    }
    for (const std::size_t facets : lacks) EXPECT_GT(facets, 0U) << "nothing tells of this neighbour";
}

TEST(Undercuts, HundredThousandFacetsAreQuick) {
    // A mushroom: stem and cap of revolution, its underside full of slanting facets.
    Facets t;
    const int around = 400, along = 124;
    auto at = [&](int i, int k) {
        const double turn = 2 * M_PI * i / around, u = static_cast<double>(k) / along;
        // Up the stem, out under the cap, back over its top.
        const double r = u < 0.3   ? 20
                         : u < 0.7 ? 20 + 200 * (u - 0.3)
                                   : 100 - 333 * (u - 0.7),
                     z = u < 0.3   ? 100 * u
                         : u < 0.7 ? 30 + 40 * (u - 0.3)
                                   : 46 + 60 * (u - 0.7);
        return Vec3f{static_cast<float>(r * std::cos(turn)), static_cast<float>(r * std::sin(turn)),
                     static_cast<float>(z)};
    };
    for (int i = 0; i < around; ++i) {
        const int j = (i + 1) % around;
        for (int k = 0; k < along; ++k) quad(t, at(i, k), at(j, k), at(j, k + 1), at(i, k + 1));
        t.push_back({Vec3f{0, 0, 0}, at(j, 0), at(i, 0)});
        t.push_back({Vec3f{0, 0, at(0, along).z}, at(i, along), at(j, along)});
    }
    Context context;
    const Mesh mesh = weld(context, t);
    const auto start = std::chrono::steady_clock::now();
    const auto u = measure_undercuts(context, mesh.view(), std::array{18.0, 36.0, 80.0});
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    ASSERT_FALSE(u.empty());
    EXPECT_GT(u[0].thickness_mm, 5);
    EXPECT_LT(u[0].height_mm, 70);
    EXPECT_LT(seconds, 20);  // a fraction of a second when optimised; the bound leaves room for sanitizers
}

TEST(SectionAreas, AgreeWithSlicing) {
    std::mt19937 random(11);
    Field h(40, std::vector<float>(40));
    for (auto& row : h)
        for (float& z : row) z = 1.0f + static_cast<float>(random() % 1000) / 100.0f;
    Context context;
    for (const Facets& t : {under(h), bridge(), leaning(5, 30)}) {
        const Mesh mesh = weld(context, t);
        const SectionAreas areas(context, mesh.view());
        std::vector<Plane> planes;
        for (int i = 0; i < 40; ++i) planes.push_back({0.37 * i, Side::above});
        for (const Section& s : slice(context, mesh.view(), planes))
            EXPECT_NEAR(areas(s.plane.z), area(s.loops), 2e-2) << s.plane.z;
        EXPECT_EQ(areas(-1), 0);
        EXPECT_EQ(areas(1000), 0);
    }
}

TEST(SectionAreas, VolumesAgreeWithSlicesByTheHundred) {
    std::mt19937 random(12);
    Field h(12, std::vector<float>(12));
    for (auto& row : h)
        for (float& z : row) z = 1.0f + static_cast<float>(random() % 1000) / 100.0f;
    Context context;
    for (const Facets& t : {under(h), bridge(), leaning(5, 30)}) {
        const Mesh mesh = weld(context, t);
        const SectionAreas areas(context, mesh.view());
        for (const auto& [low, high] : {std::pair{-3.0, 1000.0}, {0.0, 4.3}, {2.17, 9.4}, {5.5, 5.6}}) {
            constexpr int pieces = 4000;
            const double top = std::min<double>(high, bounds(mesh.view()).max.z), bottom = std::max(low, 0.0);
            std::vector<Plane> planes;
            for (int i = 0; i < pieces; ++i)
                planes.push_back({bottom + (i + 0.5) / pieces * (top - bottom), Side::above});
            double sum = 0;
            for (const Section& s : slice(context, mesh.view(), planes)) sum += area(s.loops);
            sum *= std::max(0.0, top - bottom) / pieces;
            EXPECT_NEAR(areas.volume_between(low, high), sum, 1e-3 * sum + 1e-6) << low << " to " << high;
        }
        EXPECT_EQ(areas.volume_between(4, 4), 0);
        EXPECT_EQ(areas.volume_between(4, 3), 0);
        EXPECT_EQ(areas.volume_between(1000, 2000), 0);
    }
}

TEST(FeaturesCorpus, RealPartsAreFoundQuicklyAndMeasured) {
    const char* corpus = std::getenv("SLABWRIGHT_CORPUS");
    if (!corpus) {
        std::puts("skipped: SLABWRIGHT_CORPUS is not set");
        return;
    }
    for (const char* file :
         {"castings/bearing_block.stl", "castings/valve_body_half.stl",
          "castings/midget_crankcase_front_pattern.stl", "relief/mount_st_helens_1980.stl"}) {
        SCOPED_TRACE(file);
        std::ifstream in(std::filesystem::path(corpus) / file, std::ios::binary);
        const std::string bytes((std::istreambuf_iterator<char>(in)), {});
        ASSERT_GT(bytes.size(), 84u);
        std::uint32_t count = 0;
        std::memcpy(&count, &bytes[80], 4);
        ASSERT_EQ(bytes.size(), 84 + std::size_t{50} * count);
        Facets t(count);
        for (std::uint32_t i = 0; i < count; ++i)
            std::memcpy(&t[i], &bytes[84 + std::size_t{50} * i + 12], 36);
        Context context;
        const Mesh mesh = weld(context, t);
        const FeatureSet set = find_features(context, mesh.view(), {});
        EXPECT_FALSE(set.features.empty());
        for (const Feature& f : set.features) {
            EXPECT_LE(f.z_low, f.z_high);
            EXPECT_TRUE(std::is_sorted(f.facets.begin(), f.facets.end()));
        }
        const Box3 box3 = bounds(mesh.view());
        std::vector<double> tops;
        for (double z = box3.min.z + 18.0; z < box3.max.z; z += 18.0) tops.push_back(z);
        tops.push_back(box3.max.z + 1e-3);
        const auto u = measure_undercuts(context, mesh.view(), tops);
        const bool relief = std::strncmp(file, "relief", 6) == 0;
        EXPECT_EQ(u.empty(), relief);
        for (const UnmadeUndercut& patch : u) {
            EXPECT_GT(patch.thickness_mm, 0);
            EXPECT_GE(patch.height_mm, patch.thickness_mm);
            EXPECT_LE(patch.height_mm, double{box3.max.z} - box3.min.z);
        }
    }
}

}  // namespace
}  // namespace slabwright
