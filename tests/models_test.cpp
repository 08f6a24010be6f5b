// The project's own models are what the other tests lean on, so they are judged here by brute force alone.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <sstream>
#include <stdexcept>

#include "tests/data/luo_layer_sample.h"
#include "tests/data/models.h"
#include "tests/support/places.h"

namespace slabwright {
namespace {

constexpr double kInch = 25.4;
constexpr double kPi = std::numbers::pi;

using Point = std::array<float, 3>;
Point point(const Vec3f& v) { return {v.x, v.y, v.z}; }

/// Every directed edge must occur once, and once the other way round. Returns the first breach in words.
std::string why_not_closed(const std::vector<Facet>& facets) {
    std::map<std::pair<Point, Point>, int> edges;
    for (const Facet& f : facets)
        for (std::size_t k = 0; k < 3; ++k) ++edges[{point(f[k]), point(f[(k + 1) % 3])}];
    for (const auto& [edge, count] : edges) {
        const auto back = edges.find({edge.second, edge.first});
        if (count == 1 && back != edges.end() && back->second == 1) continue;
        std::ostringstream words;
        words << "edge (" << edge.first[0] << ", " << edge.first[1] << ", " << edge.first[2] << ") to ("
              << edge.second[0] << ", " << edge.second[1] << ", " << edge.second[2] << ") occurs " << count
              << " times, reversed " << (back == edges.end() ? 0 : back->second);
        return words.str();
    }
    return "";
}

double volume(const std::vector<Facet>& facets) {
    double six = 0;
    for (const Facet& f : facets) {
        const double ax = f[0].x, ay = f[0].y, az = f[0].z, bx = f[1].x, by = f[1].y, bz = f[1].z,
                     cx = f[2].x, cy = f[2].y, cz = f[2].z;
        six += ax * (by * cz - bz * cy) - ay * (bx * cz - bz * cx) + az * (bx * cy - by * cx);
    }
    return six / 6;
}

/// Twice the signed area seen from above; exact, since coordinates are 24-bit multiples of 1/4096 mm.
double seen_from_above(const Facet& f) {
    return (double{f[1].x} - f[0].x) * (double{f[2].y} - f[0].y) -
           (double{f[1].y} - f[0].y) * (double{f[2].x} - f[0].x);
}

bool level_at(const Facet& f, double z) {
    return std::all_of(f.begin(), f.end(), [&](const Vec3f& v) { return std::abs(v.z - z) < 1e-4; });
}

double lowest(const std::vector<Facet>& facets) {
    double z = std::numeric_limits<double>::infinity();
    for (const Facet& f : facets)
        for (const Vec3f& v : f) z = std::min<double>(z, v.z);
    return z;
}

double highest(const std::vector<Facet>& facets) {
    double z = 0;
    for (const Facet& f : facets)
        for (const Vec3f& v : f) z = std::max<double>(z, v.z);
    return z;
}

/// No area at all, exactly.
bool degenerate(const Facet& f) {
    const double ux = double{f[1].x} - f[0].x, uy = double{f[1].y} - f[0].y, uz = double{f[1].z} - f[0].z;
    const double vx = double{f[2].x} - f[0].x, vy = double{f[2].y} - f[0].y, vz = double{f[2].z} - f[0].z;
    return uy * vz == uz * vy && uz * vx == ux * vz && ux * vy == uy * vx;
}

/// Closed, without degenerate facets, on z = 0, and nothing but the base (and flats at `down_flats`) faces
/// down.
void expect_pattern(const std::vector<Facet>& facets, const std::vector<double>& down_flats = {}) {
    ASSERT_FALSE(facets.empty());
    EXPECT_EQ(why_not_closed(facets), "");
    EXPECT_EQ(lowest(facets), 0);
    EXPECT_GT(volume(facets), 0);
    EXPECT_EQ(std::count_if(facets.begin(), facets.end(), degenerate), 0);
    double up = 0, down = 0;
    std::size_t undercut = 0;
    for (const Facet& f : facets) {
        const double seen = seen_from_above(f);
        (seen > 0 ? up : down) += seen / 2;
        const bool allowed = level_at(f, 0) || std::any_of(down_flats.begin(), down_flats.end(),
                                                           [&](double z) { return level_at(f, z); });
        if (seen < 0 && !allowed) ++undercut;
    }
    EXPECT_EQ(undercut, 0u) << "facets face down";
    EXPECT_NEAR(up, -down, 1e-9 * up);
}

std::string bytes_of(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    std::ostringstream bytes;
    bytes << file.rdbuf();
    return bytes.str();
}

void expect_committed(const std::string& name, const std::vector<Facet>& facets) {
    const std::string path = support::checkout("tests/data/") + name + ".stl";
    EXPECT_TRUE(bytes_of(path) == stl_bytes(name, facets))
        << path << " differs: run `make_models all tests/data` and look at what changed";
}

std::vector<Facet> collect(const MetrePattern& pattern) {
    std::vector<Facet> facets;
    metre_pattern(pattern, [&](const Facet& f) { facets.push_back(f); });
    return facets;
}

/// What Steiner's formula needs of a smooth outline: inset all round by o, its area is area − length·o +
/// π·o², as long as no arc vanishes.
struct Measures {
    double area = 0, length = 0;
    /// Of the solid drafted by `degrees` over `height`, the outline being its foot.
    [[nodiscard]] double drafted_volume(double height, double degrees) const {
        const double o = height * std::tan(degrees * kPi / 180);
        return height * (area - length * o / 2 + kPi * o * o / 3);
    }
};

/// Outline of right angles, its corners rounded: each rounding takes (1 − π/4)·r² off a convex corner, adds
/// it at a concave one, and shortens the outline by (2 − π/2)·r.
Measures right_angled(double area, double length, const std::vector<double>& convex,
                      const std::vector<double>& concave) {
    for (const double r : convex) area -= (1 - kPi / 4) * r * r, length -= (2 - kPi / 2) * r;
    for (const double r : concave) area += (1 - kPi / 4) * r * r, length -= (2 - kPi / 2) * r;
    return {area, length};
}

/// Any outline with its corners {x, y, radius} rounded, counter-clockwise: at a corner that turns by φ the
/// rounding takes (tan φ/2 − φ/2)·r² off the area, or adds it where φ is negative, and shortens the outline
/// by 2·|tan φ/2 − φ/2|·r.
Measures rounded(const std::vector<std::array<double, 3>>& corners) {
    Measures m;
    const std::size_t n = corners.size();
    for (std::size_t i = 0; i < n; ++i) {
        const auto &a = corners[(i + n - 1) % n], &b = corners[i], &c = corners[(i + 1) % n];
        const double ux = b[0] - a[0], uy = b[1] - a[1], vx = c[0] - b[0], vy = c[1] - b[1];
        m.area += (b[0] * c[1] - c[0] * b[1]) / 2;
        m.length += std::hypot(vx, vy);
        const double half = std::atan2(ux * vy - uy * vx, ux * vx + uy * vy) / 2,
                     less = std::tan(half) - half;
        m.area -= less * b[2] * b[2];
        m.length -= 2 * std::abs(less) * b[2];
    }
    return m;
}

TEST(Models, LuoLayerSampleIsClosedAndOverhangsOnlyAtItsFlat) {
    const std::vector<Facet> facets = luo_layer_sample();
    expect_pattern(facets, {1.2 * kInch});
    EXPECT_NEAR(highest(facets), 1.5 * kInch, 0.01);
    expect_committed("luo-layer-sample", facets);
}

TEST(Models, HalfSphereHasTheVolumeOfASphere) {
    const std::vector<Facet> facets = half_sphere();
    expect_pattern(facets);
    const double exact = 2.0 / 3 * kPi * 50 * 50 * 50;
    EXPECT_NEAR(volume(facets), exact, 1e-3 * exact);
    for (const Facet& f : facets)
        for (const Vec3f& v : f)
            ASSERT_NEAR(std::sqrt(double{v.x} * v.x + double{v.y} * v.y + double{v.z} * v.z), 50, 5e-4);
    expect_committed("half-sphere", facets);
}

TEST(Models, LuoToolSampleHasTheVolumeOfItsDrawing) {
    const std::vector<Facet> facets = luo_tool_sample();
    expect_pattern(facets);
    EXPECT_NEAR(highest(facets), 2 * kInch, 1e-3);
    // Inches.
    const Measures plate = right_angled(8.75 * 6.5, 2 * (8.75 + 6.5), {.5, .5, .5, .5}, {});
    const Measures letter_h = right_angled(5.2 * 5.9 - 2 * 1.6 * .6, 2 * (5.2 + 5.9) + 4 * 1.6,
                                           {.5, .5, .5, .5, .5, .5, .5, .5}, {.15, .15, .15, .15});
    const Measures letter_c =
        right_angled(2.8 * 4.7 - 1.7 * .72, 2 * (2.8 + 4.7) + 2 * 1.7, {.3, .3, .3, .3, .3, .3}, {.15, .15});
    const Measures island{1.4 * 1.6 + kPi * .8 * .8, 2 * 1.4 + 2 * kPi * .8};
    const Measures boss{kPi * .8 * .8, 2 * kPi * .8};
    // The slot from its rim downwards: .238 in wide on its floor, and .170 at the narrow end.
    const double widened = .3 * std::tan(3 * kPi / 180), wide = .119 + widened, narrow = .085 + widened;
    const Measures slot = rounded({{2.75, -wide, wide},
                                   {3.85, -wide, .15},
                                   {4.0, -narrow, .15},
                                   {4.62, -narrow, narrow},
                                   {4.62, narrow, narrow},
                                   {4.0, narrow, .15},
                                   {3.85, wide, .15},
                                   {2.75, wide, wide}});
    const double exact = plate.drafted_volume(.75, 0) + letter_h.drafted_volume(.75, 3) +
                         island.drafted_volume(1.25, 2) + boss.drafted_volume(.75, 0) +
                         letter_c.drafted_volume(.5, 3) - slot.drafted_volume(.3, 3);
    EXPECT_NEAR(volume(facets) / (kInch * kInch * kInch), exact, 1e-3 * exact);
    expect_committed("luo-tool-sample", facets);
}

/// The boundary of a section as segments with outward normals, by cutting every facet.
struct Segment {
    double ax, ay, bx, by, nx, ny;
};
std::vector<Segment> cut(const std::vector<Facet>& facets, double z) {
    std::vector<Segment> segments;
    for (const Facet& f : facets) {
        std::vector<std::array<double, 2>> ends;
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3f &a = f[k], &b = f[(k + 1) % 3];
            if ((a.z > z) == (b.z > z)) continue;
            const double t = (z - a.z) / (double{b.z} - a.z);
            ends.push_back({a.x + t * (double{b.x} - a.x), a.y + t * (double{b.y} - a.y)});
        }
        if (ends.size() != 2) continue;
        const double ux = double{f[1].x} - f[0].x, uy = double{f[1].y} - f[0].y, uz = double{f[1].z} - f[0].z;
        const double vx = double{f[2].x} - f[0].x, vy = double{f[2].y} - f[0].y, vz = double{f[2].z} - f[0].z;
        const double nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, n = std::hypot(nx, ny);
        segments.push_back({ends[0][0], ends[0][1], ends[1][0], ends[1][1], nx / n, ny / n});
    }
    return segments;
}

/// The share of a section's boundary that a disc can touch without overlapping the solid by more than 0.05
/// mm.
double reached_share(const std::vector<Segment>& segments, double radius) {
    double all = 0, reached = 0;
    for (const Segment& s : segments) {
        const double length = std::hypot(s.bx - s.ax, s.by - s.ay);
        const int samples = std::max(1, static_cast<int>(length / 0.5));
        for (int i = 0; i < samples; ++i) {
            const double t = (i + 0.5) / samples;
            const double x = s.ax + t * (s.bx - s.ax) + radius * s.nx,
                         y = s.ay + t * (s.by - s.ay) + radius * s.ny;
            const bool free = std::none_of(segments.begin(), segments.end(), [&](const Segment& o) {
                const double dx = o.bx - o.ax, dy = o.by - o.ay, squared = dx * dx + dy * dy;
                const double u =
                    squared > 0 ? std::clamp(((x - o.ax) * dx + (y - o.ay) * dy) / squared, 0.0, 1.0) : 0;
                return std::hypot(x - o.ax - u * dx, y - o.ay - u * dy) < radius - 0.05;
            });
            all += length / samples;
            if (free) reached += length / samples;
        }
    }
    return reached / all;
}

TEST(Models, LuoToolSampleForcesTheToolsOfThePaper) {
    const std::vector<Facet> facets = luo_tool_sample();
    const auto share = [&](double z_inch, double diameter_inch) {
        return reached_share(cut(facets, z_inch * kInch), diameter_inch / 2 * kInch);
    };
    constexpr double threshold = 0.975;
    // Layer 1: every tool reaches all.
    EXPECT_GT(share(.4, 1.0), 0.9999);
    // Layer 2, and layer 3 below its slot: .25 in is the largest.
    for (const double z : {.8, 1.1, 1.45, 1.6}) {
        EXPECT_LT(share(z, 1.0), threshold) << z;
        EXPECT_LT(share(z, .75), threshold) << z;
        EXPECT_LT(share(z, .5), threshold) << z;
        EXPECT_GT(share(z, .25), threshold) << z;
    }
    // From the foot of the slot to its rim .125 in is the largest, by the narrow end alone higher up.
    for (const double z : {1.71, 1.75, 1.81, 1.85, 1.95, 1.999}) {
        EXPECT_LT(share(z, .25), threshold) << z;
        EXPECT_GT(share(z, .125), threshold) << z;
    }
}

TEST(Models, PumpCoverIsAPatternWithDraft) {
    const std::vector<Facet> facets = pump_cover();
    expect_pattern(facets);
    double low_x = 0, high_x = 0, low_y = 0, high_y = 0;
    std::set<float> flats;
    for (const Facet& f : facets) {
        for (const Vec3f& v : f) {
            low_x = std::min<double>(low_x, v.x), high_x = std::max<double>(high_x, v.x);
            low_y = std::min<double>(low_y, v.y), high_y = std::max<double>(high_y, v.y);
        }
        if (f[0].z == f[1].z && f[1].z == f[2].z && f[0].z > 0) flats.insert(f[0].z);
        // No facet is steeper than the draft allows: its normal leans up by 2° or more. The grid of 1/4096 mm
        // costs up to .1°.
        const double ux = double{f[1].x} - f[0].x, uy = double{f[1].y} - f[0].y, uz = double{f[1].z} - f[0].z;
        const double vx = double{f[2].x} - f[0].x, vy = double{f[2].y} - f[0].y, vz = double{f[2].z} - f[0].z;
        const double nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
        const bool base = level_at(f, 0);
        ASSERT_TRUE(base || std::atan2(nz, std::hypot(nx, ny)) * 180 / kPi > 1.9);
    }
    EXPECT_NEAR(high_x - low_x, 200, 0.01);
    EXPECT_NEAR(high_y - low_y, 150, 0.01);
    EXPECT_EQ(highest(facets), 60);
    EXPECT_EQ(flats, (std::set<float>{8, 14, 20, 28, 44, 52, 60}));
    expect_committed("pump-cover", facets);
}

TEST(Models, MetrePatternIsClosedAtAnyCount) {
    for (const std::uint64_t wish : {1u, 900u, 5000u, 12'000u, 20'000u, 50'000u, 200'000u}) {
        for (const std::uint64_t seed : {1u, 2u, 77u}) {
            SCOPED_TRACE(testing::Message() << wish << " facets, seed " << seed);
            const MetrePattern pattern{1160, 300, wish, seed};
            const std::vector<Facet> facets = collect(pattern);
            expect_pattern(facets);
            EXPECT_EQ(facets.size(), metre_pattern_facets(pattern));
            EXPECT_GE(facets.size(), wish);
            if (wish >= 20'000) {
                EXPECT_LE(static_cast<double>(facets.size()), 1.1 * static_cast<double>(wish));
            }
            EXPECT_NEAR(highest(facets), 300, 1e-3);
            double widest = 0;
            for (const Facet& f : facets)
                for (const Vec3f& v : f) widest = std::max<double>({widest, v.x, v.y});
            EXPECT_EQ(widest, 1160);
        }
    }
}

TEST(Models, MetrePatternCountsWithinTenPercent) {
    // The counts follow from arithmetic alone, so all magnitudes can be asked.
    for (std::uint64_t wish = 20'000; wish < 100'000'000; wish += wish / 7 + 13) {
        const std::uint64_t count = metre_pattern_facets({1160, 300, wish, 1});
        EXPECT_GE(count, wish);
        EXPECT_LE(static_cast<double>(count), 1.1 * static_cast<double>(wish)) << wish;
    }
}

TEST(Models, MetrePatternKeepsTheShapeOfItsFacets) {
    // Under the plate is a fan with one facet to each vertex of its border; it says how many vertices a tile
    // has around, and the count how many rings. Were one of them to grow alone, times by number of facets
    // would be times of ever longer slivers.
    for (const std::uint64_t wish : {20'000, 100'000, 200'000, 1'000'000}) {
        const std::vector<Facet> facets = collect({1160, 300, wish, 1});
        const auto under = std::count_if(facets.begin(), facets.end(), [](const Facet& f) {
            return f[0].z == 0 && f[1].z == 0 && f[2].z == 0;
        });
        const double tiles = 8, around = static_cast<double>(under) / tiles;
        const double rings =
            ((static_cast<double>(facets.size()) / around - 3 * tiles) / (tiles * tiles) - 1) / 2;
        EXPECT_GT(around / (2 * rings), 0.55) << wish;
        EXPECT_LT(around / (2 * rings), 1.8) << wish;
    }
}

TEST(Models, MetrePatternIsTheSameForTheSameSeed) {
    const MetrePattern pattern{600, 150, 30'000, 5};
    MetrePattern other = pattern;
    other.seed = 6;
    const std::string bytes = stl_bytes("metre", collect(pattern));
    EXPECT_EQ(bytes, stl_bytes("metre", collect(pattern)));
    EXPECT_NE(bytes, stl_bytes("metre", collect(other)));
}

TEST(Models, MetrePatternWallsHaveTheirDraft) {
    // Plane walls lean by 3°. Around corners the chords lie a little closer together than the arcs, which
    // steepens a wall by less the more chords there are.
    double coarse = 0, fine = 0;
    for (const std::uint64_t count : {100'000u, 400'000u}) {
        const std::vector<Facet> facets = collect({1160, 300, count, 3});
        (count == 100'000 ? coarse : fine) = volume(facets);
        std::size_t walls = 0, at_draft = 0;
        for (const Facet& f : facets) {
            const double ux = double{f[1].x} - f[0].x, uy = double{f[1].y} - f[0].y,
                         uz = double{f[1].z} - f[0].z;
            const double vx = double{f[2].x} - f[0].x, vy = double{f[2].y} - f[0].y,
                         vz = double{f[2].z} - f[0].z;
            const double slope =
                90 -
                std::atan2(ux * vy - uy * vx, std::hypot(uy * vz - uz * vy, uz * vx - ux * vz)) * 180 / kPi;
            if (slope > 90 || slope < 86.5) continue;  // the base; flats and most of the domes
            ++walls;
            if (std::abs(slope - 87) < 0.05) ++at_draft;
            ASSERT_LT(slope, 87.3);
        }
        EXPECT_GT(walls, facets.size() / 10);
        EXPECT_GT(at_draft, walls * 2 / 3);
    }
    // The shape does not depend on the count, but for the chords of its arcs.
    EXPECT_NEAR(coarse, fine, 5e-3 * fine);
}

TEST(Models, MetrePatternRefusesWhatCannotBe) {
    EXPECT_THROW((void)metre_pattern_facets({1160, 500, 1'000'000, 1}), std::invalid_argument);
    EXPECT_THROW((void)metre_pattern_facets({0, 100, 1000, 1}), std::invalid_argument);
    EXPECT_THROW((void)metre_pattern_facets({100, 10, 0, 1}), std::invalid_argument);
    EXPECT_THROW((void)stl_head("too many", std::uint64_t{1} << 32), std::invalid_argument);
}

}  // namespace
}  // namespace slabwright
