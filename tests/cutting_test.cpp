// Fibres, level contours and drops against brute force over all facets.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <random>
#include <tuple>

#include "engine/paths/runs/feet.h"
#include "kernels/cutting/drop.h"
#include "kernels/cutting/level_contours.h"
#include "kernels/mesh/weld.h"
#include "tests/mesh_shapes.h"
#include "tests/support/height_field.h"
#include "tests/support/seed.h"

namespace slabwright {
namespace {

double dot(const Vec3d& a, const Vec3d& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vec3d minus(const Vec3d& a, const Vec3d& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

// Distance from a point to a triangle (Ericson, Real-Time Collision Detection 5.1.5).
double distance_to(const Vec3d& p, const std::array<Vec3d, 3>& t) {
    const Vec3d ab = minus(t[1], t[0]), ac = minus(t[2], t[0]), ap = minus(p, t[0]);
    auto at = [&](double v, double w) {
        const Vec3d q{t[0][0] + v * ab[0] + w * ac[0], t[0][1] + v * ab[1] + w * ac[1],
                      t[0][2] + v * ab[2] + w * ac[2]},
            d = minus(p, q);
        return std::sqrt(dot(d, d));
    };
    const double d1 = dot(ab, ap), d2 = dot(ac, ap);
    if (d1 <= 0 && d2 <= 0) return at(0, 0);
    const Vec3d bp = minus(p, t[1]);
    const double d3 = dot(ab, bp), d4 = dot(ac, bp);
    if (d3 >= 0 && d4 <= d3) return at(1, 0);
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return at(d1 / (d1 - d3), 0);
    const Vec3d cp = minus(p, t[2]);
    const double d5 = dot(ab, cp), d6 = dot(ac, cp);
    if (d6 >= 0 && d5 <= d6) return at(0, 1);
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return at(0, d2 / (d2 - d6));
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
        const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return at(1 - w, w);
    }
    return at(vb / (va + vb + vc), vc / (va + vb + vc));
}

// How much room the cutter has: distance of its axis (ball centre and up, disc and up) from the mesh cut off
// at z_top, less its radius; negative where it touches. Facets are lifted flat to the cutter's level where
// they stand above it.
double room(const Mesh& mesh, double z_top, const CutterShape& cutter, double x, double y, double tip) {
    const bool ball = cutter.is_ball();
    const double zc = ball ? tip + cutter.radius : tip;
    if (tip >= z_top) return 1e9;
    double nearest = 1e9;
    auto visit = [&](std::array<Vec3d, 3> t) { nearest = std::min(nearest, distance_to({x, y, zc}, t)); };
    int turns = 0;  // of the section at zc (or the cap) around the axis, by a ray upward from the axis point:
                    // crossings
    for (const Index3& f : mesh.facets) {
        std::vector<Vec3d> p;
        for (const std::uint32_t v : f)
            p.push_back({mesh.vertices[v].x, mesh.vertices[v].y, mesh.vertices[v].z});
        auto clip = [](const std::vector<Vec3d>& in, double z, bool below) {
            std::vector<Vec3d> out;
            for (std::size_t k = 0; k < in.size(); ++k) {
                const Vec3d &a = in[k], &b = in[(k + 1) % in.size()];
                const bool ai = below ? a[2] <= z : a[2] > z, bi = below ? b[2] <= z : b[2] > z;
                if (ai) out.push_back(a);
                if (ai != bi && a[2] != b[2]) {
                    const double s = (z - a[2]) / (b[2] - a[2]);
                    out.push_back({a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]), z});
                }
            }
            return out;
        };
        const std::vector<Vec3d> kept = clip(p, z_top, true);
        // A ray straight up from (x, y) just under the cap, or from zc: an odd number of facets above means
        // inside.
        const double area2 =
            (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[2][0] - p[0][0]) * (p[1][1] - p[0][1]);
        if (area2 != 0) {
            bool in = true;
            double z = 0;
            for (int k = 0; k < 3; ++k) {
                const Vec3d &a = p[static_cast<std::size_t>(k)],
                            &b = p[static_cast<std::size_t>((k + 1) % 3)],
                            &c = p[static_cast<std::size_t>((k + 2) % 3)];
                const double s = (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]);
                in &= area2 > 0 ? s > 0 : s < 0;
                z += s / area2 * c[2];
            }
            if (in && z > std::min(zc, z_top)) ++turns;
        }
        if (kept.size() < 3) continue;
        std::vector<Vec3d> above = clip(kept, zc, false);
        for (Vec3d& v : above) v[2] = zc;
        for (std::size_t k = 1; k + 1 < above.size(); ++k) visit({above[0], above[k], above[k + 1]});
        if (ball)
            for (std::size_t k = 1; k + 1 < kept.size(); ++k) visit({kept[0], kept[k], kept[k + 1]});
    }
    if (turns % 2 == 1)
        return -cutter.radius;  // on the axis, or above the cap and nearer than the ball's lower half
    return nearest - cutter.radius;
}

class Cutting : public testing::TestWithParam<std::tuple<int, bool>> {};

TEST_P(Cutting, ContoursTouchAndSpareThePart) {
    const auto [seed, is_flat] = GetParam();
    std::printf("seed %d\n", seed);
    Context context;
    const Mesh mesh = test::random_height_field(context, 6, 3.0, 12, seed % 2 ? 0.5 : 2.0,
                                                static_cast<std::uint32_t>(seed));
    const double z_top = seed % 3 == 0 ? 8.0 : 12.5;
    const LayerSolid solid = layer_solid(context, mesh.view(), -5, z_top);
    const CutterShape cutter = is_flat ? flat_cutter(2) : ball_cutter(2);
    const std::int32_t pitch = 2000;  // 0.2 mm
    const double miss = 0.2 * 0.2 / (4 * cutter.radius) + 1e-4;
    std::mt19937 random(static_cast<std::uint32_t>(seed));
    for (const double tip : {-1.5, 1.0, 2.0, 3.25, 5.0, 7.0, 7.9}) {
        const Plane plane = inside_plane(solid, cutter, tip);
        const std::vector<Section> inside = slice(context, mesh.view(), {&plane, 1});
        const Contours contours =
            level_contours(context, solid, inside[0].loops, cutter, tip, fibre_grid(solid, cutter, pitch));
        Loops loops;
        for (std::size_t c = 0; c < contours.size(); ++c) {
            const auto points = std::span(contours.points)
                                    .subspan(contours.starts[c], contours.starts[c + 1] - contours.starts[c]);
            for (std::size_t k = 0; k < points.size(); ++k) {
                const Point2 a = points[k], b = points[(k + 1) % points.size()];
                loops.points.push_back(a);
                ASSERT_LE(std::hypot(a.x - b.x, a.y - b.y), 1.4143 * pitch) << "a chord leaves its cell";
                if (random() % 8) continue;
                const double left = room(mesh, z_top - kTopSheet, cutter, to_mm(a.x), to_mm(a.y), tip);
                EXPECT_GE(left, -2e-4) << to_mm(a.x) << ' ' << to_mm(a.y) << " tip " << tip;
                // A fibre that only grazes a wall ends where rounding says, up to √(8·r·rounding) from it;
                // the border of the model lies so.
                const bool grazes =
                    std::abs(std::abs(to_mm(a.x)) - 11) < 1e-9 || std::abs(std::abs(to_mm(a.y)) - 11) < 1e-9;
                EXPECT_LE(left, grazes ? 0.02 : 2e-4) << to_mm(a.x) << ' ' << to_mm(a.y) << " tip " << tip;
                EXPECT_GE(room(mesh, z_top - kTopSheet, cutter, 0.5 * to_mm(std::int64_t{a.x} + b.x),
                               0.5 * to_mm(std::int64_t{a.y} + b.y), tip),
                          -miss);
            }
            loops.close_loop();
        }
        // Nothing is missing: wherever there is clearly room, or clearly none, the contours say the same.
        for (int k = 0; k < 200; ++k) {
            const double x = static_cast<double>(random() % 2600) / 100 - 13,
                         y = static_cast<double>(random() % 2600) / 100 - 13;
            const double r = room(mesh, z_top - kTopSheet, cutter, x, y, tip);
            if (std::abs(r) < 0.05) continue;
            EXPECT_EQ(winding(loops, {to_units(x), to_units(y)}) != 0, r < 0)
                << x << ' ' << y << " tip " << tip << " room " << r;
        }
    }
}

// Levels found from one another against each by itself; the torus overhangs itself.
TEST_P(Cutting, LevelsTogetherForbidWhatEachDoes) {
    const auto [number, is_flat] = GetParam();
    std::mt19937 random(test::seed() + static_cast<std::uint32_t>(number));
    Context context;
    Mesh mesh = number % 3 == 0 ? weld(context, shapes::torus(24, 9, 4))
                                : test::random_height_field(context, 20, 1.0, 12, number % 2 ? 0.5 : 2.0,
                                                            static_cast<std::uint32_t>(random()));
    const LayerSolid solid = layer_solid(context, mesh.view(), -5, number % 2 ? 3.5 : 12.5);
    const CutterShape cutter = is_flat ? flat_cutter(2) : ball_cutter(2);
    std::vector<double> tips;
    for (int k = 0; k < 12; ++k) tips.push_back(static_cast<double>(random() % 16000) / 1000 - 4);
    tips.push_back(tips[3]);
    std::vector<Plane> planes;
    for (const double tip : tips) planes.push_back(inside_plane(solid, cutter, tip));
    std::vector<Section> inside;  // one by one, for planes need not be in order here
    for (const Plane& plane : planes)
        inside.push_back(std::move(slice(context, mesh.view(), {&plane, 1}).front()));
    std::vector<FibreLevel> levels;
    for (std::size_t i = 0; i < tips.size(); ++i) levels.push_back({tips[i], &inside[i].loops});
    std::vector<std::int32_t> lines;
    for (std::int32_t v = -160000; v < 160000; v += 1 + static_cast<std::int32_t>(random() % 9000))
        lines.push_back(v);
    std::size_t compared = 0;
    for (const Axis axis : {Axis::x, Axis::y}) {
        const std::vector<Fibres> together = fibres(context, solid, levels, cutter, axis, lines);
        ASSERT_EQ(together.size(), levels.size());
        for (std::size_t i = 0; i < levels.size(); ++i) {
            const Fibres alone = fibres(context, solid, inside[i].loops, cutter, tips[i], axis, lines);
            ASSERT_EQ(together[i].starts, alone.starts) << tips[i];
            for (std::size_t k = 0; k < alone.intervals.size(); ++k, ++compared) {
                EXPECT_NEAR(together[i].intervals[k].low, alone.intervals[k].low, 1e-9);
                EXPECT_NEAR(together[i].intervals[k].high, alone.intervals[k].high, 1e-9);
            }
        }
    }
    EXPECT_GT(compared, 50U);
}

TEST_P(Cutting, DropRestsOnThePart) {
    const auto [seed, is_flat] = GetParam();
    std::printf("seed %d\n", seed);
    Context context;
    const Mesh mesh = test::random_height_field(context, 6, 3.0, 12, seed % 2 ? 0.5 : 2.0,
                                                static_cast<std::uint32_t>(seed));
    const double z_top = seed % 3 == 0 ? 8.0 : 12.5;
    const LayerSolid solid = layer_solid(context, mesh.view(), -5, z_top);
    const CutterShape cutter = is_flat ? flat_cutter(2) : ball_cutter(2);
    const DropIndex index(solid, cutter);
    std::mt19937 random(static_cast<std::uint32_t>(seed));
    for (int k = 0; k < 150; ++k) {
        const double x = static_cast<double>(random() % 26000) / 1000 - 13,
                     y = static_cast<double>(random() % 26000) / 1000 - 13;
        const Rest rest = index.drop(x, y);
        if (rest.tip_z < -2.5) {
            EXPECT_GE(room(mesh, z_top - kTopSheet, cutter, x, y, -2.4), 0);
            continue;
        }
        EXPECT_GE(room(mesh, z_top - kTopSheet, cutter, x, y, rest.tip_z + 1e-6), -1e-6) << x << ' ' << y;
        EXPECT_LT(room(mesh, z_top - kTopSheet, cutter, x, y, rest.tip_z - 1.1e-3 - kTopSheet), 0)
            << x << ' ' << y << " could go lower than " << rest.tip_z;
    }
}

// Many facets under one cutter, which the solid's tree must leave out or find: tiny ones, large ones beside
// them, upright walls and equal heights, and all of it a metre away from the origin.
TEST_P(Cutting, DropFindsTheOneFacetOfMany) {
    const auto [number, is_flat] = GetParam();
    std::mt19937 random(test::seed() + static_cast<std::uint32_t>(number));
    auto uniform = [&](double low, double high) {
        return low + (high - low) * (static_cast<double>(random()) / 4294967296.0);
    };
    Context context;
    Mesh mesh;
    if (number % 2 == 0) {
        const double a = uniform(0.2, 1.5), b = uniform(0.3, 2), rough = number == 2 ? 0.0 : 0.03,
                     floor = number == 4 ? 2.5 : 0.5;
        mesh = test::height_field(context, 64, 0.25, [&](double x, double y) {
            return std::max(floor,
                            3 + 2 * std::sin(a * x + b * y) + std::cos(b * x) + uniform(-rough, rough));
        });
        // Through it a wall of few facets, which has a tier of its own.
        shapes::Facets facets = shapes::box({-8.5F, 0.6F, -9}, {8.5F, 0.9F, 4.25F});
        for (const auto& f : mesh.facets)
            facets.push_back({mesh.vertices[f[0]], mesh.vertices[f[1]], mesh.vertices[f[2]]});
        mesh = weld(context, facets);
    } else {
        shapes::Facets facets;
        for (int j = 0; j < 8; ++j)
            for (int i = 0; i < 8; ++i) {
                const auto x = static_cast<float>(2 * i - 8), y = static_cast<float>(2 * j - 8),
                           z = static_cast<float>(2 + random() % 3);
                shapes::append(facets, shapes::box({x, y, 0}, {x + static_cast<float>(uniform(0.1, 1.9)),
                                                               y + 1.25F, z}));
            }
        mesh = weld(context, facets);
    }
    const Vec3f away{number > 3 ? 1123.25F : -3.5F, number > 3 ? -877.5F : 2.25F, 0};
    for (Vec3f& v : mesh.vertices) v.x += away.x, v.y += away.y;
    const LayerSolid solid = layer_solid(context, mesh.view(), -20, 100);
    EXPECT_EQ(solid.tree.tiers.size() > 1, number % 2 == 0);
    // What was met at the places before changes nothing.
    int nearly = 0;
    for (const double r : {0.4, 3.0, 12.0}) {
        const DropIndex index(solid, is_flat ? flat_cutter(r) : ball_cutter(r));
        MetPoints met;
        double x = away.x, y = away.y;
        for (int k = 0; k < 200; ++k) {
            if (k % 20 == 0) x = away.x + uniform(-8, 8), y = away.y + uniform(-8, 8);
            else x += uniform(-0.1 * r, 0.1 * r), y += uniform(-0.1 * r, 0.1 * r);
            const Rest rest = index.drop(x, y);
            for (const double z : {rest.tip_z - uniform(0, r), rest.tip_z - 1e-6, rest.tip_z,
                                   rest.tip_z + 1e-6, rest.tip_z + uniform(0, r)}) {
                SCOPED_TRACE(testing::Message()
                             << "r " << r << " at " << x << ' ' << y << ' ' << z << " tip " << rest.tip_z);
                EXPECT_EQ(index.stands_over(x, y, z, &met), rest.tip_z > z);
                EXPECT_EQ(index.tip_within(x, y, z, &met), index.tip_within(x, y, z));
                const std::optional<Rest> told = index.drop_within(x, y, -1e9, z, &met);
                ASSERT_EQ(told.has_value(), rest.tip_z <= z);
                for (const Rest& other : {told.value_or(rest), index.drop(x, y, -1e9, &met)})
                    EXPECT_TRUE(other.tip_z == rest.tip_z && other.nx == rest.nx && other.ny == rest.ny &&
                                other.nz == rest.nz);
            }
            const double kept_up = met.keep_up(index.cutter(), x, y);
            EXPECT_LE(kept_up, rest.tip_z);
            nearly += kept_up > rest.tip_z - 1e-4;
        }
    }
    EXPECT_GT(nearly, 100);
    for (const double r : {0.4, 3.0, 12.0}) {
        const CutterShape cutter = is_flat ? flat_cutter(r) : ball_cutter(r);
        const DropIndex index(solid, cutter);
        for (int k = 0; k < 40; ++k) {
            // Some of the places lie right over edges and vertices.
            const double x = away.x +
                             (k % 4 ? uniform(-8 - r, 8 + r) : 0.25 * static_cast<double>(random() % 64) - 8),
                         y = away.y +
                             (k % 4 ? uniform(-8 - r, 8 + r) : 0.25 * static_cast<double>(random() % 64) - 8);
            const Rest rest = index.drop(x, y);
            for (const double z : {-1e9, -r, 0.2 * k, rest.tip_z, std::nextafter(rest.tip_z, -1e9),
                                   rest.tip_z + 1e-3, rest.tip_z - 1e-3}) {
                EXPECT_EQ(index.stands_over(x, y, z), rest.tip_z > z)
                    << x << ' ' << y << ' ' << z << " tip " << rest.tip_z;
                const std::optional<double> within = index.tip_within(x, y, z);
                EXPECT_EQ(within.has_value(), rest.tip_z <= z)
                    << x << ' ' << y << ' ' << z << " tip " << rest.tip_z;
                if (within) {
                    EXPECT_EQ(*within, rest.tip_z) << x << ' ' << y << ' ' << z;
                }
                const std::optional<Rest> told = index.drop_within(x, y, -1e9, z);
                EXPECT_EQ(told.has_value(), rest.tip_z <= z)
                    << x << ' ' << y << ' ' << z << " tip " << rest.tip_z;
                if (told) {
                    EXPECT_TRUE(told->tip_z == rest.tip_z && told->nx == rest.nx && told->ny == rest.ny &&
                                told->nz == rest.nz)
                        << x << ' ' << y;
                }
                const Rest above = index.drop(x, y, z);
                EXPECT_EQ(above.tip_z, rest.tip_z > z ? rest.tip_z : -std::numeric_limits<double>::infinity())
                    << x << ' ' << y << ' ' << z;
                if (rest.tip_z <= z) continue;
                EXPECT_TRUE(above.nx == rest.nx && above.ny == rest.ny && above.nz == rest.nz)
                    << x << ' ' << y << ' ' << z;
            }
            if (rest.tip_z < -r) {
                EXPECT_GE(room(mesh, 100, cutter, x, y, -r + 1e-6), 0) << x << ' ' << y;
                continue;
            }
            EXPECT_GE(room(mesh, 100, cutter, x, y, rest.tip_z + 1e-6), -1e-6) << x << ' ' << y << " r " << r;
            const double lower =
                room(mesh, 100, cutter, x, y, rest.tip_z - 1e-4);  // 0 where a vertex lies on the very rim
            EXPECT_TRUE(lower < 0 || (k % 4 == 0 && lower == 0))
                << x << ' ' << y << " r " << r << " could go lower than " << rest.tip_z;
        }
    }
}

// What the raster asks of a wider end mill for many places at once.
TEST(Drops, WhereAWiderEndMillMeetsNothingNorDoesANarrowOneAround) {
    std::mt19937 random(test::seed());
    auto uniform = [&](double low, double high) {
        return low + (high - low) * (static_cast<double>(random()) / 4294967296.0);
    };
    Context context;
    const Mesh mesh = test::height_field(context, 48, 0.25, [&](double x, double y) {
        return std::abs(x) + std::abs(y) < 2 ? 4.0 : std::max(1.0, 2 * std::sin(1.3 * x) + std::cos(y));
    });
    const LayerSolid solid = layer_solid(context, mesh.view(), -20, 3.5);
    constexpr double r = 0.8, half = 0.6, rounding = 1e-6;
    const DropIndex narrow(solid, flat_cutter(r)), wide(solid, flat_cutter(r + half + rounding));
    int free = 0;
    for (int k = 0; k < 4000; ++k) {
        const double x = uniform(-7, 7), y = uniform(-7, 7), z = k % 2 ? 1.001 : uniform(0, 4);
        if (std::abs(z - solid.z_top) <= kTopSheet)
            continue;  // there its upper end stands and its facets do not
        if (wide.stands_over(x, y, z - rounding)) continue;
        ++free;
        for (const double way : {-half, half, uniform(-half, half)})
            EXPECT_FALSE(narrow.stands_over(x + way, y, z)) << x << ' ' << way << ' ' << y << ' ' << z;
    }
    EXPECT_GT(free, 100);
}

// Where two contacts are equally high, which one is given must not depend on the threads that made the tree.
TEST(Drops, SameBytesOnAnyNumberOfThreads) {
    std::vector<std::vector<float>> results;
    for (const int threads : {1, 2, 4}) {
        Context context({.threads = threads});
        const Mesh mesh = test::random_height_field(context, 150, 0.5, 12, 0.5, 7);
        const LayerSolid solid = layer_solid(context, mesh.view(), -5, 9);
        const DropIndex index(solid, ball_cutter(3.0));
        std::vector<float>& result = results.emplace_back();
        for (double y = -40; y <= 40; y += 1.25)
            for (double x = -40; x <= 40; x += 0.25) {
                const Rest rest = index.drop(x, y);
                result.insert(result.end(), {static_cast<float>(rest.tip_z), rest.nx, rest.ny, rest.nz});
            }
    }
    EXPECT_EQ(results[1], results[0]);
    EXPECT_EQ(results[2], results[0]);
}

TEST(Drops, CapCellsKnowTheInsideAsWindingDoes) {
    std::mt19937 random(test::seed());
    for (int round = 0; round < 20; ++round) {
        // Outer loops counter-clockwise and holes clockwise, some crossing each other, all on even
        // coordinates; some have level edges.
        Loops loops;
        const int size = 1 << (10 + round), corners = 3 + static_cast<int>(random() % 40);
        for (int l = 0; l < 6; ++l) {
            const double cx = static_cast<double>(random() % 1000) / 1000 * size,
                         cy = static_cast<double>(random() % 1000) / 1000 * size;
            for (int k = 0; k < corners; ++k) {
                const double turn = 2 * 3.141592653589793 * k / corners * (l % 3 == 2 ? -1 : 1),
                             d = size * (0.2 + static_cast<double>(random() % 100) / 200);
                Point2 p{2 * static_cast<std::int32_t>(cx + d * std::cos(turn)),
                         2 * static_cast<std::int32_t>(cy + d * std::sin(turn))};
                if (k % 3 == 1) p.y = loops.points.back().y;
                loops.points.push_back(p);
            }
            loops.close_loop();
        }
        const CapCells cells(loops);
        int inside = 0;
        for (int k = 0; k < 3000; ++k) {
            const auto at = [&] {
                return static_cast<std::int32_t>(static_cast<double>(random() % 10000) / 10000 * 4 * size -
                                                 size) |
                       1;
            };
            const Point2 p{at(), at()};
            const bool expected = winding(loops, p) > 0;
            inside += expected;
            ASSERT_EQ(cells.inside(to_mm(p.x), to_mm(p.y)), expected) << p.x << ' ' << p.y;
        }
        EXPECT_GT(inside, 100);
    }
}

INSTANTIATE_TEST_SUITE_P(Random, Cutting, testing::Combine(testing::Range(1, 7), testing::Bool()));

// A flange whose underside float32 puts a hair under the layer's top is no part of the layer: neither are its
// facets there, nor may its section be, or the contours around it would run off the grid.
TEST(Fibres, AFlangeThatBeginsAtTheTopIsNoneOfTheLayer) {
    Context context;
    shapes::Facets facets = shapes::box({10, 10, 0}, {20, 20, 10});
    for (const auto& f : shapes::box({-30, -30, 9.9996F}, {60, 60, 15})) facets.push_back(f);
    const Mesh mesh = weld(context, facets);
    const LayerSolid solid = layer_solid(context, mesh.view(), 0, 10);
    const CutterShape cutter = ball_cutter(3.0);
    for (const double tip : {4.0, 6.9999, 7.5, 9.5}) {
        const Plane plane = inside_plane(solid, cutter, tip);
        const Contours contours =
            level_contours(context, solid, slice(context, mesh.view(), {&plane, 1})[0].loops, cutter, tip,
                           fibre_grid(solid, cutter, 2500));
        ASSERT_EQ(contours.size(), 1U) << tip;
        const double reach = 3 - std::max(0.0, tip - 7), half = std::sqrt(9 - (3 - reach) * (3 - reach));
        for (const Point2 p : contours.points) {
            EXPECT_GE(to_mm(p.x), 10 - half - 0.01);
            EXPECT_LE(to_mm(p.x), 20 + half + 0.01);
        }
    }
}

// What only the facets that a cutter can touch say, against what each of them forbids.
TEST(Fibres, WhatACutterCanTouchEndsAllThatIsForbidden) {
    std::mt19937 random(test::seed());
    Context context;
    std::size_t compared = 0, turned = 0;
    for (int trial = 0; trial < 48; ++trial) {
        const double size = trial % 4 == 1 ? 0.4 : trial % 4 == 2 ? 1.0 : 3.0, high = trial % 2 ? 3.0 : 12.0;
        const Mesh mesh =
            trial % 6 == 5
                ? weld(context, shapes::torus(static_cast<int>(20 + random() % 60), 9, 4))
                : test::random_height_field(context, static_cast<int>(24 / size), size, high,
                                            high < 4 ? 0.25 : 2.0, static_cast<std::uint32_t>(random()));
        const LayerSolid solid = layer_solid(context, mesh.view(), -5, trial % 3 == 0 ? 2.5 : 12.5);
        LayerSolid each = solid;
        each.corners.clear();
        for (const GroupCorners& group : solid.corners)
            for (const auto& corner : group.corner.high)
                for (const std::int8_t up : corner[2]) turned += up > 0 && up < 127;
        const double radius = trial % 5 == 0 ? 0.7 : 3.0;
        const CutterShape cutter = trial < 24 ? ball_cutter(radius) : flat_cutter(radius);
        std::vector<double> tips;
        for (int k = 0; k < 10; ++k) tips.push_back(static_cast<double>(random() % 12000) / 1000 - 4);
        if (const float corner = mesh.vertices[random() % mesh.vertices.size()].z; corner < solid.z_top)
            tips.push_back(corner);
        std::vector<Section> inside;
        for (const double tip : tips) {
            const Plane plane = inside_plane(solid, cutter, tip);
            inside.push_back(std::move(slice(context, mesh.view(), {&plane, 1}).front()));
        }
        std::vector<FibreLevel> levels;
        for (std::size_t i = 0; i < tips.size(); ++i) levels.push_back({tips[i], &inside[i].loops});
        std::vector<std::int32_t> lines;
        for (std::int32_t v = -170000; v < 170000; v += 1 + static_cast<std::int32_t>(random() % 5000))
            lines.push_back(v);
        for (const Axis axis : {Axis::x, Axis::y}) {
            const std::vector<Fibres> some = fibres(context, solid, levels, cutter, axis, lines),
                                      all = fibres(context, each, levels, cutter, axis, lines);
            for (std::size_t i = 0; i < levels.size(); ++i) {
                ASSERT_EQ(some[i].starts, all[i].starts) << "trial " << trial << " tip " << tips[i];
                for (std::size_t k = 0; k < all[i].intervals.size(); ++k, ++compared) {
                    ASSERT_NEAR(some[i].intervals[k].low, all[i].intervals[k].low, 1e-9)
                        << "trial " << trial << " tip " << tips[i];
                    ASSERT_NEAR(some[i].intervals[k].high, all[i].intervals[k].high, 1e-9)
                        << "trial " << trial << " tip " << tips[i];
                }
            }
        }
    }
    EXPECT_GT(compared, 40'000U);
    EXPECT_GT(turned, 10'000U);
}

// The corners that a facet is to test hold the normals around them and all between these.
TEST(LayerSolid, CornersHoldTheNormalsAroundThem) {
    std::mt19937 random(test::seed());
    Context context;
    std::size_t known = 0, known_aside = 0;
    for (int trial = 0; trial < 8; ++trial) {
        // The ring is cut off where it overhangs: between its normals and upright lie those that are level.
        const bool ring = trial >= 6;
        const Mesh mesh = ring ? weld(context, shapes::torus(trial == 6 ? 12 : 30, 30, 10))
                               : test::random_height_field(context, 12, 2.0, 5, trial % 2 ? 0.5 : 2.0,
                                                           static_cast<std::uint32_t>(random()));
        const LayerSolid solid = layer_solid(context, mesh.view(), -50, trial < 4 ? 100 : ring ? -4 : 2.5);
        std::map<Vec3d, std::vector<const SolidFacet*>> around;
        for (const SolidFacet& f : solid.facets)
            for (const Vec3d& p : f.p) around[p].push_back(&f);
        for (const SolidFacet& f : solid.facets) {
            const std::size_t i = static_cast<std::size_t>(&f - solid.facets.data());
            const GroupCorners::Normals& corners = solid.corners[i / FacetGroup::kFacets].corner;
            for (std::size_t c = 0; c < 3; ++c) {
                if ((f.ends >> c & 1) == 0) continue;
                for (int round = 0; round < 20; ++round) {
                    Vec3d sum{0, 0,
                              f.p[c][2] >= f.z_max && f.top
                                  ? std::uniform_real_distribution<double>(0, 1)(random)
                                  : 0.0};
                    for (const SolidFacet* other : around[f.p[c]]) {
                        const double weight =
                            std::pow(std::uniform_real_distribution<double>(0, 1)(random), 4);
                        for (std::size_t k = 0; k < 3; ++k) sum[k] += weight * other->normal[k];
                    }
                    const double length = std::hypot(sum[0], sum[1], sum[2]);
                    for (std::size_t k = 0; k < 3; ++k) {
                        const int low = corners.low[c][k][i % FacetGroup::kFacets],
                                  high = corners.high[c][k][i % FacetGroup::kFacets];
                        known += high - low < 150;
                        EXPECT_LE(low * SolidFacet::kTurn, sum[k] / length + 1e-9);
                        EXPECT_GE(high * SolidFacet::kTurn, sum[k] / length - 1e-9);
                    }
                }
            }
            for (std::size_t c = 0; c < 3; ++c) {
                if (f.aside[c] == SolidFacet::kAnyTurn) continue;
                ++known_aside;
                for (const SolidFacet* other : around[f.p[c]]) {
                    const Vec3d &m = other->normal, &n = f.normal;
                    const double m_across = std::hypot(m[0], m[1]), n_across = std::hypot(n[0], n[1]);
                    if (m_across > 0) {
                        EXPECT_LE(
                            std::hypot(m[0] / m_across - n[0] / n_across, m[1] / m_across - n[1] / n_across),
                            f.aside[c] * SolidFacet::kTurn + 1e-12);
                    }
                }
            }
        }
    }
    EXPECT_GT(known, 1000U);
    EXPECT_GT(known_aside, 500U);
}

// The normals beside an edge and all between them are told, and a corner in which edges end that are tested
// is tested by one of its facets.
TEST(LayerSolid, EdgesHoldTheNormalsBetweenTheirFacets) {
    std::mt19937 random(test::seed());
    Context context;
    std::size_t edges = 0, corners = 0, narrow = 0;
    for (int trial = 0; trial < 6; ++trial) {
        const Mesh mesh = test::random_height_field(context, 12, 2.0, 5, trial % 2 ? 0.5 : 2.0,
                                                    static_cast<std::uint32_t>(random()));
        const double z_top = trial < 3 ? 100 : 2.5;
        const LayerSolid solid = layer_solid(context, mesh.view(), -5, z_top);
        std::map<std::pair<Vec3d, Vec3d>, const SolidFacet*> by_edge;
        std::map<Vec3d, int> ends;  // how many facets are to test a corner
        for (const SolidFacet& f : solid.facets)
            for (std::size_t c = 0; c < 3; ++c)
                by_edge[{f.p[c], f.p[(c + 1) % 3]}] = &f, ends[f.p[c]] += f.ends >> c & 1;
        for (std::size_t i = 0; i < solid.facets.size(); ++i) {
            const SolidFacet& f = solid.facets[i];
            const GroupCorners& group = solid.corners[i / FacetGroup::kFacets];
            for (std::size_t c = 0; c < 3; ++c) {
                if ((f.edges >> c & 1) == 0) continue;
                const Vec3d &a = f.p[c], &b = f.p[(c + 1) % 3];
                EXPECT_GE(ends[a], 1);
                EXPECT_GE(ends[b], 1);
                if (a[2] < z_top - 0.1) {
                    EXPECT_EQ(ends[a], 1);
                    ++corners;
                }
                const auto other = by_edge.find({b, a});
                if (other == by_edge.end() && a[2] < z_top - 0.1) continue;
                const Vec3d m = f.normal, n = other == by_edge.end() ? Vec3d{0, 0, 1} : other->second->normal;
                ++edges;
                for (int step = 0; step <= 20; ++step) {
                    const double s = 0.05 * step;
                    const Vec3d sum{m[0] + s * (n[0] - m[0]), m[1] + s * (n[1] - m[1]),
                                    m[2] + s * (n[2] - m[2])};
                    const double length = std::hypot(sum[0], sum[1], sum[2]);
                    for (std::size_t k = 0; k < 3; ++k) {
                        const int least = group.edge.low[c][k][i % FacetGroup::kFacets],
                                  most = group.edge.high[c][k][i % FacetGroup::kFacets];
                        EXPECT_LE(least * SolidFacet::kTurn, sum[k] / length + 1e-9);
                        EXPECT_GE(most * SolidFacet::kTurn, sum[k] / length - 1e-9);
                        narrow += most - least < 60;
                    }
                }
            }
        }
    }
    EXPECT_GT(edges, 300U);
    EXPECT_GT(corners, 300U);
    EXPECT_GT(narrow, 3000U);
}

// Beside some of its facets a solid's contours are those of what lies near them alone.
TEST(LayerSolid, WhatIsNearSufficesForTheContoursThere) {
    std::mt19937 random(test::seed());
    Context context;
    std::size_t compared = 0, left_out = 0, contours_left_out = 0;
    for (int trial = 0; trial < 8; ++trial) {
        const Mesh mesh = test::random_height_field(context, 24, 3.0, 12, trial % 2 ? 0.5 : 2.0,
                                                    static_cast<std::uint32_t>(random()));
        const LayerSolid solid = layer_solid(context, mesh.view(), -5, 12.5);
        const CutterShape cutter = trial % 3 == 0 ? flat_cutter(2) : ball_cutter(2);
        std::vector<SolidFacet> chosen;
        const Vec3d middle = solid.facets[random() % solid.facets.size()].p[0];
        for (const SolidFacet& f : solid.facets)
            if (std::hypot(f.p[0][0] - middle[0], f.p[0][1] - middle[1]) < 5 && f.nz > 0.5)
                chosen.push_back(f);
        // Where a disc touches two facets in one place, either tells its nz.
        const bool ball = cutter.is_ball();
        const LayerSolid near = solid_near(context, solid, chosen, 2 * cutter.radius + 2 * 0.25);
        left_out += solid.facets.size() - near.facets.size();
        const FibreGrid grid = fibre_grid(solid, cutter, 2500);
        auto beside = [&](Point2 p) {
            double nearest = 1e9;
            for (const SolidFacet& f : chosen) {
                std::array<Vec3d, 3> flat = f.p;
                for (Vec3d& v : flat) v[2] = 0;
                nearest = std::min(nearest, distance_to({to_mm(p.x), to_mm(p.y), 0}, flat));
            }
            return nearest < cutter.radius;
        };
        auto points = [&](const Contours& contours) {
            std::vector<std::tuple<std::int32_t, std::int32_t, float>> found;
            for (std::size_t k = 0; k < contours.points.size(); ++k)
                if (beside(contours.points[k]))
                    found.emplace_back(contours.points[k].x, contours.points[k].y, ball ? contours.nz[k] : 0);
            std::sort(found.begin(), found.end());
            return found;
        };
        for (const double tip : {1.0, 3.0, 5.0, 8.0}) {
            const Plane plane = inside_plane(solid, cutter, tip);
            const std::vector<Section> inside = slice(context, mesh.view(), {&plane, 1});
            const Contours whole = level_contours(context, solid, inside[0].loops, cutter, tip, grid),
                           beside_all = level_contours(context, near, inside[0].loops, cutter, tip, grid),
                           beside_near = contours_near(context, near, {&tip, 1}, inside, cutter, grid)[0];
            EXPECT_EQ(points(beside_all), points(whole)) << "trial " << trial << " tip " << tip;
            EXPECT_EQ(points(beside_near), points(whole)) << "trial " << trial << " tip " << tip;
            compared += points(whole).size();
            contours_left_out += beside_all.points.size() - beside_near.points.size();
        }
    }
    EXPECT_GT(compared, 500U);
    EXPECT_GT(left_out, 4000U);
    EXPECT_GT(contours_left_out, 1000U);
}

TEST(Fibres, SameBytesOnAnyNumberOfThreads) {
    std::vector<Contours> results;
    for (const int threads : {1, 2, 4}) {
        Context context({.threads = threads});
        const Mesh mesh = test::random_height_field(context, 20, 2.0, 12, 0.5, 7);
        const LayerSolid solid = layer_solid(context, mesh.view(), -5, 9);
        const CutterShape cutter = ball_cutter(3.0);
        const Plane plane = inside_plane(solid, cutter, 4);
        const auto inside = slice(context, mesh.view(), {&plane, 1});
        results.push_back(
            level_contours(context, solid, inside[0].loops, cutter, 4, fibre_grid(solid, cutter, 2500)));
    }
    for (const Contours& c : results) {
        EXPECT_EQ(c.points, results[0].points);
        EXPECT_EQ(c.starts, results[0].starts);
        EXPECT_EQ(c.nz, results[0].nz);
    }
    EXPECT_GT(results[0].size(), 0U);
}

}  // namespace
}  // namespace slabwright
