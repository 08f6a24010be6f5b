// Sections against brute force: closed on closed adjacency at every height, the right area from each side,
// the same bits on any number of threads. Adjacency is built here, edge by edge, so that nothing of the mesh
// kernel is trusted.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <sstream>

#include "io/read/pattern_mesh.h"
#include "kernels/errors.h"
#include "kernels/mesh/part.h"
#include "kernels/slicing/slicing.h"

namespace {

using namespace slabwright;

std::mt19937_64 random_of(std::uint64_t seed) {
    std::printf("seed %llu\n", static_cast<unsigned long long>(seed));
    return std::mt19937_64(seed);
}

/// Pairs edges one for one in opposite directions, in the order of the facets.
void pair_by_brute_force(Mesh& mesh) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<std::pair<std::uint32_t, std::uint32_t>>>
        waiting;
    mesh.neighbours.assign(mesh.facets.size(), {kNoFacet, kNoFacet, kNoFacet});
    for (std::uint32_t f = 0; f < mesh.facets.size(); ++f) {
        for (std::uint32_t k = 0; k < 3; ++k) {
            const std::uint32_t a = mesh.facets[f][k], b = mesh.facets[f][(k + 1) % 3];
            if (a == b) continue;
            auto& others = waiting[{b, a}];
            const auto other =
                std::find_if(others.begin(), others.end(), [&](const auto& o) { return o.first != f; });
            if (other == others.end()) {
                waiting[{a, b}].push_back({f, k});
                continue;
            }
            mesh.neighbours[f][k] = other->first;
            mesh.neighbours[other->first][other->second] = f;
            others.erase(other);
        }
    }
}

/// Collects facets by corner coordinates.
struct Builder {
    Mesh mesh;
    std::map<std::array<float, 3>, std::uint32_t> known;
    std::uint32_t vertex(double x, double y, double z) {
        const std::array<float, 3> key{static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
        const auto [it, fresh] = known.emplace(key, static_cast<std::uint32_t>(mesh.vertices.size()));
        if (fresh) mesh.vertices.push_back({key[0], key[1], key[2]});
        return it->second;
    }
    void facet(std::uint32_t a, std::uint32_t b, std::uint32_t c) { mesh.facets.push_back({a, b, c}); }
    void quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
        facet(a, b, c);
        facet(a, c, d);
    }
    void box(double x0, double y0, double z0, double x1, double y1, double z1) {
        std::uint32_t v[8];
        for (int i = 0; i < 8; ++i) v[i] = vertex(i & 1 ? x1 : x0, i & 2 ? y1 : y0, i & 4 ? z1 : z0);
        quad(v[0], v[2], v[3], v[1]);
        quad(v[4], v[5], v[7], v[6]);
        quad(v[0], v[1], v[5], v[4]);
        quad(v[3], v[2], v[6], v[7]);
        quad(v[2], v[0], v[4], v[6]);
        quad(v[1], v[3], v[7], v[5]);
    }
    Mesh shuffled(std::mt19937_64& random) {
        std::shuffle(mesh.facets.begin(), mesh.facets.end(), random);
        for (Index3& f : mesh.facets) std::rotate(f.begin(), f.begin() + random() % 3, f.end());
        pair_by_brute_force(mesh);
        return mesh;
    }
};

/// Tetrahedra and flat-ended wedges with heights on a coarse grid: many vertices, edges and facets lie in the
/// planes.
Mesh random_tetrahedra(std::mt19937_64& random, int count, double reach) {
    Builder builder;
    std::uniform_real_distribution<double> place(-reach, reach), size(-20, 20);
    auto height = [&] { return 0.5 * static_cast<double>(random() % 12); };
    for (int t = 0; t < count; ++t) {
        const double x = place(random), y = place(random);
        std::uint32_t v[4];
        for (auto& i : v) i = builder.vertex(x + size(random), y + size(random), height());
        const auto at = [&](int i) { return builder.mesh.vertices[v[i]]; };
        const double ux = at(1).x - at(0).x, uy = at(1).y - at(0).y, uz = at(1).z - at(0).z;
        const double vx = at(2).x - at(0).x, vy = at(2).y - at(0).y, vz = at(2).z - at(0).z;
        const double wx = at(3).x - at(0).x, wy = at(3).y - at(0).y, wz = at(3).z - at(0).z;
        const double volume = ux * (vy * wz - vz * wy) - uy * (vx * wz - vz * wx) + uz * (vx * wy - vy * wx);
        if (volume < 0) std::swap(v[2], v[3]);
        builder.facet(v[0], v[2], v[1]);
        builder.facet(v[0], v[1], v[3]);
        builder.facet(v[1], v[2], v[3]);
        builder.facet(v[2], v[0], v[3]);
    }
    return builder.shuffled(random);
}

/// A height field over n × n quads with heights on a grid of 0.5: plateaus, pits, saddles, ridges, all in the
/// planes.
Mesh random_relief(std::mt19937_64& random, int n, double pitch, double x0) {
    Builder builder;
    std::vector<double> z(static_cast<std::size_t>((n + 1) * (n + 1)));
    for (double& h : z) h = 0.5 + 0.5 * static_cast<double>(random() % 6);
    auto top = [&](int i, int j) {
        return builder.vertex(x0 + i * pitch, j * pitch, z[static_cast<std::size_t>(j * (n + 1) + i)]);
    };
    auto bottom = [&](int i, int j) { return builder.vertex(x0 + i * pitch, j * pitch, 0); };
    for (int j = 0; j < n; ++j) {
        for (int i = 0; i < n; ++i) {
            if (random() % 2) builder.quad(top(i, j), top(i + 1, j), top(i + 1, j + 1), top(i, j + 1));
            else builder.quad(top(i + 1, j), top(i + 1, j + 1), top(i, j + 1), top(i, j));
            builder.quad(bottom(i, j), bottom(i, j + 1), bottom(i + 1, j + 1), bottom(i + 1, j));
        }
    }
    for (int i = 0; i < n; ++i) {
        builder.quad(bottom(i, 0), bottom(i + 1, 0), top(i + 1, 0), top(i, 0));
        builder.quad(bottom(i + 1, n), bottom(i, n), top(i, n), top(i + 1, n));
        builder.quad(bottom(0, i + 1), bottom(0, i), top(0, i), top(0, i + 1));
        builder.quad(bottom(n, i), bottom(n, i + 1), top(n, i + 1), top(n, i));
    }
    return builder.shuffled(random);
}

/// Boxes on a grid of heights, apart, stacked, side by side, overlapping, touching along edges.
Mesh random_boxes(std::mt19937_64& random, int count) {
    Builder builder;
    for (int b = 0; b < count; ++b) {
        const double x = static_cast<double>(random() % 8), y = static_cast<double>(random() % 8),
                     z = 0.5 * static_cast<double>(random() % 8);
        builder.box(x, y, z, x + 1 + static_cast<double>(random() % 3),
                    y + 1 + static_cast<double>(random() % 3),
                    z + 0.5 + 0.5 * static_cast<double>(random() % 4));
    }
    return builder.shuffled(random);
}

/// Degenerate facets that closed meshes carry: a sliver without area between two neighbours, and one with two
/// equal corners.
Mesh with_degenerate_facets(Mesh mesh, std::mt19937_64& random) {
    const std::size_t facets = mesh.facets.size();
    for (std::size_t f = 0; f < facets; ++f) {
        if (random() % 3 != 0) continue;
        const auto [a, b, c] = mesh.facets[f];
        if (random() % 2) {
            // The edge ab gets a point of a twice over: (a, b, c) becomes (m, b, c), (a, m, c), and the
            // sliver (a, b, m) between.
            const Vec3f &p = mesh.vertices[a], &q = mesh.vertices[b];
            const auto m = static_cast<std::uint32_t>(mesh.vertices.size());
            mesh.vertices.push_back({(p.x + q.x) / 2, (p.y + q.y) / 2, (p.z + q.z) / 2});
            mesh.facets[f] = {m, b, c};
            mesh.facets.push_back({a, m, c});
            mesh.facets.push_back({a, b, m});
        } else {
            mesh.facets.push_back({a, a, b});  // has both directions of the edge ab
        }
    }
    pair_by_brute_force(mesh);
    return mesh;
}

/// Area of the section in mm² by another way: each facet's segment from its own three corners in double,
/// oriented by the facet's normal; z must be at no vertex.
double brute_area(const Mesh& mesh, double z) {
    double sum = 0;
    for (const Index3& facet : mesh.facets) {
        double x[3], y[3];
        int n = 0;
        for (int k = 0; k < 3; ++k) {
            const Vec3f &p = mesh.vertices[facet[k]], &q = mesh.vertices[facet[(k + 1) % 3]];
            const double dp = p.z - z, dq = q.z - z;
            if (dp * dq >= 0) continue;
            x[n] = (p.x * dq - q.x * dp) / (dq - dp);
            y[n] = (p.y * dq - q.y * dp) / (dq - dp);
            ++n;
        }
        if (n != 2) continue;
        const Vec3f &a = mesh.vertices[facet[0]], &b = mesh.vertices[facet[1]], &c = mesh.vertices[facet[2]];
        const double nx = (static_cast<double>(b.y) - a.y) * (static_cast<double>(c.z) - a.z) -
                          (static_cast<double>(b.z) - a.z) * (static_cast<double>(c.y) - a.y);
        const double ny = (static_cast<double>(b.z) - a.z) * (static_cast<double>(c.x) - a.x) -
                          (static_cast<double>(b.x) - a.x) * (static_cast<double>(c.z) - a.z);
        // Solid on the left: outside, the normal, on the right of the segment.
        const double right = (y[1] - y[0]) * nx - (x[1] - x[0]) * ny;
        sum += (right >= 0 ? 0.5 : -0.5) * (x[0] * y[1] - x[1] * y[0]);
    }
    return sum;
}

/// The limit at `z` from the side of `step`, where no vertex lies in (z, z + 3 step]: there the area is a
/// parabola in z.
double brute_limit(const Mesh& mesh, double z, double step) {
    return 3 * brute_area(mesh, z + step) - 3 * brute_area(mesh, z + 2 * step) +
           brute_area(mesh, z + 3 * step);
}

double perimeter(const Loops& loops) {
    double sum = 0;
    for (std::size_t i = 0; i < loops.size(); ++i) {
        const auto loop = loops.loop(i);
        for (std::size_t k = 0; k < loop.size(); ++k) {
            const Point2 p = loop[k], q = loop[(k + 1) % loop.size()];
            sum += std::hypot(to_mm(q.x) - to_mm(p.x), to_mm(q.y) - to_mm(p.y));
        }
    }
    return sum;
}

void expect_clean(const Section& section) {
    ASSERT_EQ(section.loops.parents.size(), section.loops.size());
    for (std::size_t i = 0; i < section.loops.size(); ++i) {
        const auto loop = section.loops.loop(i);
        ASSERT_GE(loop.size(), 3u);
        ASSERT_NE(signed_area(loop), 0);
        for (std::size_t k = 0; k < loop.size(); ++k) ASSERT_NE(loop[k], loop[(k + 1) % loop.size()]);
    }
}

/// Every height of a vertex from both sides, and heights between: closed, clean, and of the area that brute
/// force finds. `reach` in mm bounds |x| and |y|; dropped slivers and rounding may cost what a 0.1 µm ribbon
/// along all segments holds.
void expect_sections_right(const Mesh& mesh, double between) {
    Context context({.threads = 2});
    std::set<double> heights;
    for (const Vec3f& v : mesh.vertices) heights.insert(v.z);
    std::vector<Plane> planes;
    for (const double z : heights)
        for (const Plane plane :
             {Plane{z, Side::above}, Plane{z, Side::below}, Plane{z + between, Side::above}})
            planes.push_back(plane);
    std::vector<double> expected;
    std::vector<double> list(heights.begin(), heights.end());
    for (std::size_t i = 0; i < list.size(); ++i) {
        const double up = i + 1 < list.size() ? (list[i + 1] - list[i]) / 3.5 : 1.0,
                     down = i > 0 ? (list[i] - list[i - 1]) / 3.5 : 1.0;
        expected.push_back(brute_limit(mesh, list[i], up));
        expected.push_back(brute_limit(mesh, list[i], -down));
        expected.push_back(brute_area(mesh, list[i] + between));
    }
    const auto sections = slice(context, mesh.view(), planes);
    ASSERT_EQ(sections.size(), planes.size());
    double met = 0;
    for (std::size_t i = 0; i < sections.size(); ++i) {
        EXPECT_EQ(sections[i].plane.z, planes[i].z);
        EXPECT_TRUE(sections[i].open_chains.empty()) << "z " << planes[i].z;
        EXPECT_EQ(sections[i].closed_gaps, 0u);
        expect_clean(sections[i]);
        const double tolerance = 1e-4 * (perimeter(sections[i].loops) + 1) + 1e-6 * std::abs(expected[i]);
        EXPECT_NEAR(area(sections[i].loops), expected[i], tolerance)
            << "z " << planes[i].z << (planes[i].side == Side::above ? " above" : " below");
        met += std::abs(expected[i]);
    }
    EXPECT_GT(met, 0);
    // The side is the limit: a plane 1e-4 mm off has nearly the section of z ± 0.
    std::vector<Plane> near;
    for (const double z : heights) {
        near.push_back({z + 1e-4, Side::above});
        near.push_back({z - 1e-4, Side::below});
    }
    const auto limits = slice(context, mesh.view(), near);
    for (std::size_t i = 0; i < list.size(); ++i) {
        for (std::size_t side = 0; side < 2; ++side) {
            const double z = near[2 * i + side].z;
            EXPECT_NEAR(area(limits[2 * i + side].loops), brute_area(mesh, z),
                        1e-4 * (perimeter(limits[2 * i + side].loops) + 1));
            EXPECT_TRUE(limits[2 * i + side].open_chains.empty());
        }
    }
}

TEST(Slicing, CubeFromEachSide) {
    Builder builder;
    builder.box(1, 2, 0, 3, 5, 4);
    pair_by_brute_force(builder.mesh);
    Context context;
    const Plane planes[] = {{0, Side::below}, {0, Side::above},  {2, Side::above}, {4, Side::below},
                            {4, Side::above}, {-1, Side::above}, {5, Side::below}};
    const auto sections = slice(context, builder.mesh.view(), planes);
    const double areas[] = {0, 6, 6, 6, 0, 0, 0};
    for (std::size_t i = 0; i < 7; ++i) EXPECT_EQ(area(sections[i].loops), areas[i]) << i;
    EXPECT_TRUE(sections[0].loops.empty());
    EXPECT_TRUE(sections[4].loops.empty());
    ASSERT_EQ(sections[2].loops.size(), 1u);
    EXPECT_GT(signed_area(sections[2].loops.loop(0)), 0);  // counter-clockwise
    for (const Point2 p : sections[2].loops.points) {
        EXPECT_TRUE(p.x == 10000 || p.x == 20000 || p.x == 30000);
        EXPECT_TRUE(p.y == 20000 || p.y == 50000 || p.y == 35000) << p.y;
    }
}

TEST(Slicing, HolesRunClockwiseAndAreNested) {
    Builder builder;
    builder.box(0, 0, 0, 10, 10, 10);
    const std::size_t outer = builder.mesh.facets.size();
    builder.box(2, 2, 2, 8, 8, 8);
    for (std::size_t f = outer; f < builder.mesh.facets.size(); ++f)
        std::swap(builder.mesh.facets[f][1], builder.mesh.facets[f][2]);
    builder.box(4, 4, 4, 6, 6, 6);
    pair_by_brute_force(builder.mesh);
    Context context;
    const Plane planes[] = {{5, Side::above}, {4, Side::below}, {8, Side::above}};
    const auto sections = slice(context, builder.mesh.view(), planes);
    ASSERT_EQ(sections[0].loops.size(), 3u);
    EXPECT_EQ(sections[0].loops.parents, (std::vector<std::int32_t>{-1, 0, 1}));
    EXPECT_GT(signed_area(sections[0].loops.loop(0)), 0);
    EXPECT_LT(signed_area(sections[0].loops.loop(1)), 0);
    EXPECT_GT(signed_area(sections[0].loops.loop(2)), 0);
    EXPECT_EQ(area(sections[0].loops), 68);
    EXPECT_EQ(area(sections[1].loops), 64);
    EXPECT_EQ(area(sections[2].loops), 100);
}

TEST(Slicing, TetrahedraAgreeWithBruteForce) {
    auto random = random_of(11);
    for (int round = 0; round < 40; ++round)
        expect_sections_right(random_tetrahedra(random, 1 + round, 100), 0.13);
}

TEST(Slicing, TetrahedraPastOneMetreAgreeWithBruteForce) {
    auto random = random_of(12);
    for (int round = 0; round < 10; ++round) expect_sections_right(random_tetrahedra(random, 20, 2000), 0.21);
}

TEST(Slicing, ReliefsAgreeWithBruteForce) {
    auto random = random_of(13);
    for (int round = 0; round < 12; ++round)
        expect_sections_right(random_relief(random, 4 + 2 * round, 1.7, round % 2 ? 1900 : -3), 0.23);
}

TEST(Slicing, BoxesAgreeWithBruteForce) {
    auto random = random_of(14);
    for (int round = 0; round < 30; ++round) expect_sections_right(random_boxes(random, 1 + round), 0.25);
}

TEST(Slicing, BoxSectionsAreTheSumOfTheBoxes) {
    auto random = random_of(15);
    Builder builder;
    struct Box {
        double z0, z1, area;
    };
    std::vector<Box> boxes;
    for (int b = 0; b < 40; ++b) {
        const double z = static_cast<double>(random() % 6), h = 1 + static_cast<double>(random() % 3);
        const double w = 1 + static_cast<double>(random() % 3), d = 1 + static_cast<double>(random() % 3);
        const double x = static_cast<double>(random() % 50), y = static_cast<double>(random() % 50);
        builder.box(x, y, z, x + w, y + d, z + h);
        boxes.push_back({z, z + h, w * d});
    }
    const Mesh mesh = builder.shuffled(random);
    std::vector<Plane> planes;
    for (int z = -1; z < 10; ++z)
        for (const Side side : {Side::above, Side::below}) planes.push_back({static_cast<double>(z), side});
    Context context;
    const auto sections = slice(context, mesh.view(), planes);
    for (std::size_t i = 0; i < planes.size(); ++i) {
        double expected = 0;
        for (const Box& box : boxes) {
            const double z = planes[i].z;
            if (planes[i].side == Side::above ? box.z0 <= z && z < box.z1 : box.z0 < z && z <= box.z1)
                expected += box.area;
        }
        EXPECT_EQ(area(sections[i].loops), expected) << i;
    }
}

TEST(Slicing, DegenerateFacetsDoNotBreakLoops) {
    auto random = random_of(16);
    for (int round = 0; round < 20; ++round) {
        expect_sections_right(with_degenerate_facets(random_relief(random, 6, 2, 0), random), 0.1);
        expect_sections_right(with_degenerate_facets(random_boxes(random, 8), random), 0.1);
    }
}

bool same(const Loops& a, const Loops& b) {
    return a.points == b.points && a.starts == b.starts && a.parents == b.parents;
}
bool same(const std::vector<Section>& a, const std::vector<Section>& b) {
    if (a.size() != b.size()) return false;
    for (std::size_t i = 0; i < a.size(); ++i) {
        if (a[i].plane.z != b[i].plane.z || a[i].plane.side != b[i].plane.side ||
            a[i].closed_gaps != b[i].closed_gaps)
            return false;
        if (!same(a[i].loops, b[i].loops) || !same(a[i].open_chains, b[i].open_chains)) return false;
    }
    return true;
}

TEST(Slicing, SameBitsOnAnyNumberOfThreads) {
    auto random = random_of(17);
    Mesh mesh = random_relief(random, 140, 0.7, -50);  // more facets than one chunk
    ASSERT_GT(mesh.facets.size(), 65536u);
    std::vector<Plane> planes;
    for (int i = 0; i < 90; ++i)
        planes.push_back({0.05 * static_cast<double>(random() % 70), i % 2 ? Side::above : Side::below});
    for (const bool open : {false, true}) {
        if (open) {
            std::size_t kept = 0;
            for (std::size_t f = 0; f < mesh.facets.size(); ++f)
                if (f % 97 != 0) mesh.facets[kept++] = mesh.facets[f];
            mesh.facets.resize(kept);
            pair_by_brute_force(mesh);
        }
        Context one({.threads = 1});
        const auto reference = slice(one, mesh.view(), planes, {.close_gap_mm = 0.5});
        for (const int threads : {2, 4}) {
            Context context({.threads = threads});
            EXPECT_TRUE(same(reference, slice(context, mesh.view(), planes, {.close_gap_mm = 0.5})))
                << threads << " threads";
        }
        // Nor do the planes know of each other.
        std::vector<Plane> single{planes[13]};
        EXPECT_TRUE(same({reference[13]}, slice(one, mesh.view(), single, {.close_gap_mm = 0.5})));
    }
}

// Facets in the planes that bound the part, and meshes that are open, included.
TEST(PartBetween, HasTheSameSectionsAndNeighboursBetweenItsHeights) {
    auto random = random_of(23);
    Context context({.threads = 2});
    std::size_t smaller = 0;
    for (int round = 0; round < 40; ++round) {
        Mesh mesh = round % 2 ? random_relief(random, 10 + 2 * round, 1.7, -3)
                              : random_tetrahedra(random, 1 + 3 * round, 100);
        if (round % 5 == 0) {
            std::erase_if(mesh.facets, [&](const Index3&) { return random() % 7 == 0; });
            pair_by_brute_force(mesh);
        }
        const double low = 0.25 * static_cast<double>(random() % 12),
                     high = low + 0.25 * static_cast<double>(random() % 6);
        const Mesh part = part_between(context, mesh.view(), low, high);
        smaller += part.facets.size() < mesh.facets.size();
        std::vector<Plane> planes{
            {low, Side::below}, {low, Side::above}, {high, Side::below}, {high, Side::above}};
        for (int i = 0; i < 8; ++i)
            planes.push_back({low + (high - low) * static_cast<double>(random() % 100) / 100,
                              i % 2 ? Side::above : Side::below});
        EXPECT_TRUE(same(slice(context, mesh.view(), planes), slice(context, part.view(), planes))) << round;

        const auto corners = [](const Mesh& of, std::uint32_t f) {
            return std::array{of.vertices[of.facets[f][0]], of.vertices[of.facets[f][1]],
                              of.vertices[of.facets[f][2]]};
        };
        std::uint32_t at = 0;
        for (std::uint32_t f = 0; f < mesh.facets.size(); ++f) {
            const auto p = corners(mesh, f);
            const bool reaches =
                std::max({p[0].z, p[1].z, p[2].z}) >= low && std::min({p[0].z, p[1].z, p[2].z}) <= high;
            if (at == part.facets.size() || corners(part, at) != p) {
                EXPECT_FALSE(reaches) << round << ": facet " << f << " is missing or out of order";
                continue;
            }
            for (std::size_t k = 0; k < 3 && reaches; ++k) {
                const std::uint32_t across = mesh.neighbours[f][k], found = part.neighbours[at][k];
                ASSERT_EQ(across == kNoFacet, found == kNoFacet) << round << ": facet " << f;
                if (across != kNoFacet) {
                    EXPECT_EQ(corners(mesh, across), corners(part, found)) << round << ": facet " << f;
                }
            }
            ++at;
        }
        EXPECT_EQ(at, part.facets.size()) << round;
    }
    EXPECT_GT(smaller, 20U);
}

TEST(Slicing, LoopsStartAtTheirLowestFacet) {
    auto random = random_of(18);
    const Mesh mesh = random_relief(random, 12, 1, 0);
    Context context;
    const double z = 1.23;
    const Plane planes[] = {{z, Side::above}};
    const Loops loops = slice(context, mesh.view(), planes)[0].loops;
    ASSERT_GT(loops.size(), 1u);
    // The facets whose boundary carries a loop's point: the lowest facets must ascend from loop to loop.
    std::map<Point2, std::uint32_t> lowest;
    for (std::uint32_t f = 0; f < mesh.facets.size(); ++f) {
        for (int k = 0; k < 3; ++k) {
            std::uint32_t i = mesh.facets[f][static_cast<std::size_t>(k)],
                          j = mesh.facets[f][static_cast<std::size_t>((k + 1) % 3)];
            if (i > j) std::swap(i, j);
            const Vec3f p = mesh.vertices[i], q = mesh.vertices[j];
            if ((p.z > z) == (q.z > z)) continue;
            const double t = (z - p.z) / (static_cast<double>(q.z) - p.z);
            lowest.emplace(Point2{to_units(p.x + t * (static_cast<double>(q.x) - p.x)),
                                  to_units(p.y + t * (static_cast<double>(q.y) - p.y))},
                           f);
        }
    }
    std::uint32_t last = 0;
    for (std::size_t l = 0; l < loops.size(); ++l) {
        std::uint32_t least = kNoFacet;
        for (const Point2 p : loops.loop(l)) {
            ASSERT_TRUE(lowest.count(p)) << "a point that is on no edge";
            least = std::min(least, lowest[p]);
        }
        EXPECT_EQ(lowest[loops.loop(l)[0]], least);
        if (l > 0) {
            EXPECT_GT(least, last);
        }
        last = least;
    }
}

TEST(Slicing, OpenMeshesLeaveOpenChains) {
    Builder builder;
    builder.box(0, 0, 0, 10, 10, 10);
    Mesh& mesh = builder.mesh;
    // Without the two facets of the wall at y = 0 (the third quad).
    mesh.facets.erase(mesh.facets.begin() + 4, mesh.facets.begin() + 6);
    pair_by_brute_force(mesh);
    Context context;
    const Plane planes[] = {{3, Side::above}, {10, Side::above}, {0, Side::below}};
    auto sections = slice(context, mesh.view(), planes);
    EXPECT_TRUE(sections[0].loops.empty());
    ASSERT_EQ(sections[0].open_chains.size(), 1u);
    EXPECT_TRUE(sections[1].open_chains.empty());
    EXPECT_TRUE(sections[2].open_chains.empty());
    const auto chain = sections[0].open_chains.loop(0);
    EXPECT_EQ(chain.front(),
              (Point2{100000, 0}));  // solid on the left: up the right wall, back, down the left
    EXPECT_EQ(chain.back(), (Point2{0, 0}));
    // 9.9999 mm are not enough to close it, 10 are.
    EXPECT_TRUE(slice(context, mesh.view(), planes, {.close_gap_mm = 9.9999})[0].loops.empty());
    sections = slice(context, mesh.view(), planes, {.close_gap_mm = 10});
    EXPECT_EQ(sections[0].closed_gaps, 1u);
    EXPECT_TRUE(sections[0].open_chains.empty());
    EXPECT_EQ(area(sections[0].loops), 100);
}

TEST(Slicing, ChainsAreJoinedNearestFirst) {
    // Four walls that do not quite meet, each its own strip; corners gape by 0.1, 0.2, 0.3 and 0.05 mm.
    Mesh mesh;
    auto wall = [&](double x0, double y0, double x1, double y1) {  // solid on the left
        const auto v = static_cast<std::uint32_t>(mesh.vertices.size());
        for (const double z : {0.0, 5.0}) {
            mesh.vertices.push_back({static_cast<float>(x0), static_cast<float>(y0), static_cast<float>(z)});
            mesh.vertices.push_back({static_cast<float>(x1), static_cast<float>(y1), static_cast<float>(z)});
        }
        mesh.facets.push_back({v, v + 1, v + 3});
        mesh.facets.push_back({v, v + 3, v + 2});
    };
    wall(0, 0, 9.9, 0);
    wall(10, 10, 0.3, 10);
    wall(10, 0, 10, 9.8);
    wall(0, 10, 0, 0.05);
    pair_by_brute_force(mesh);
    Context context;
    const Plane planes[] = {{2, Side::above}};
    EXPECT_EQ(slice(context, mesh.view(), planes)[0].open_chains.size(), 4u);
    const Section half = slice(context, mesh.view(), planes, {.close_gap_mm = 0.15})[0];
    EXPECT_EQ(half.closed_gaps, 2u);
    EXPECT_EQ(half.open_chains.size(), 2u);
    const Section whole = slice(context, mesh.view(), planes, {.close_gap_mm = 0.3001})[0];
    EXPECT_EQ(whole.closed_gaps, 4u);
    EXPECT_TRUE(whole.open_chains.empty());
    EXPECT_EQ(area(whole.loops), 100);
    // A gap as large as the part still joins the nearest ends.
    const Section wide = slice(context, mesh.view(), planes, {.close_gap_mm = 1000})[0];
    EXPECT_EQ(area(wide.loops), 100);
}

TEST(Slicing, UnweldedSoupIsClosedWithinTheGap) {
    auto random = random_of(19);
    const Mesh closed = random_relief(random, 10, 3, 0);
    Mesh soup;  // every facet has vertices of its own
    for (const Index3& facet : closed.facets) {
        const auto v = static_cast<std::uint32_t>(soup.vertices.size());
        for (const std::uint32_t i : facet) soup.vertices.push_back(closed.vertices[i]);
        soup.facets.push_back({v, v + 1, v + 2});
    }
    soup.neighbours.assign(soup.facets.size(), {kNoFacet, kNoFacet, kNoFacet});
    Context context;
    const Plane planes[] = {{0.7, Side::above}, {1.3, Side::above}, {2.2, Side::below}};
    const auto expected = slice(context, closed.view(), planes),
               joined = slice(context, soup.view(), planes, {.close_gap_mm = 0.001});
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_TRUE(joined[i].open_chains.empty());
        EXPECT_GT(joined[i].closed_gaps, 10u);
        EXPECT_NEAR(area(joined[i].loops), area(expected[i].loops), 1e-3);
    }
}

TEST(Slicing, AdjacencyThatLiesDoesNotHang) {
    auto random = random_of(20);
    Mesh mesh = random_relief(random, 8, 1, 0);
    for (int round = 0; round < 50; ++round) {
        for (int k = 0; k < 40; ++k) {
            const std::size_t f = random() % mesh.facets.size();
            mesh.neighbours[f][random() % 3] =
                k % 4 == 0 ? static_cast<std::uint32_t>(random())
                           : static_cast<std::uint32_t>(random() % mesh.facets.size());
        }
        Context context;
        std::vector<Plane> planes;
        for (int i = 0; i < 40; ++i) planes.push_back({0.1 * i, i % 2 ? Side::above : Side::below});
        EXPECT_EQ(slice(context, mesh.view(), planes, {.close_gap_mm = 0.2}).size(), planes.size());
    }
}

TEST(Slicing, EmptyRequestsAndManyPlanes) {
    Context context;
    const Plane planes[] = {{1, Side::above}};
    const auto none = slice(context, MeshView{}, planes);
    ASSERT_EQ(none.size(), 1u);
    EXPECT_TRUE(none[0].loops.empty());
    Builder builder;
    builder.box(0, 0, 0, 1, 1, 1);
    pair_by_brute_force(builder.mesh);
    EXPECT_TRUE(slice(context, builder.mesh.view(), {}).empty());
    // More planes than are counted at a time, descending and with repeats.
    std::vector<Plane> many;
    for (int i = 10000; i-- > 0;) many.push_back({-0.1 + 1.2 * (i / 2) / 5000.0, Side::above});
    const auto sections = slice(context, builder.mesh.view(), many);
    for (std::size_t i = 0; i < many.size(); ++i) {
        ASSERT_EQ(sections[i].plane.z, many[i].z);
        ASSERT_EQ(area(sections[i].loops), many[i].z >= 0 && many[i].z < 1 ? 1 : 0) << many[i].z;
    }
    // Heights that no float holds, and those beside a vertex.
    const double beside = 1 - 1e-12;
    const Plane odd[] = {{1e300, Side::below},
                         {-1e300, Side::above},
                         {beside, Side::above},
                         {1 + 1e-12, Side::below},
                         {std::nextafter(0.0, 1.0), Side::below},
                         {3.5e38, Side::above},
                         {-3.5e38, Side::below}};
    const auto odds = slice(context, builder.mesh.view(), odd);
    const double areas[] = {0, 0, 1, 0, 1, 0, 0};
    for (std::size_t i = 0; i < 7; ++i) EXPECT_EQ(area(odds[i].loops), areas[i]) << i;
}

TEST(Slicing, RefusesWhatItCannotCut) {
    Builder builder;
    builder.box(0, 0, 0, 1, 1, 1);
    pair_by_brute_force(builder.mesh);
    const Mesh good = builder.mesh;
    Context context;
    const Plane plane[] = {{0.5, Side::above}};
    auto kind_of = [&](const Mesh& mesh, std::span<const Plane> planes, SliceOptions options = {}) {
        try {
            (void)slice(context, mesh.view(), planes, options);
        } catch (const Error& error) {
            return std::pair(error.kind(), error.code());
        }
        return std::pair(ErrorKind::verification, std::string("none"));
    };
    const Plane bad[] = {{0.5, Side::above}, {std::nan(""), Side::above}};
    EXPECT_EQ(kind_of(good, bad), std::pair(ErrorKind::usage, std::string("slice.plane")));
    EXPECT_EQ(kind_of(good, plane, {.close_gap_mm = -1}),
              std::pair(ErrorKind::usage, std::string("slice.gap")));
    EXPECT_EQ(kind_of(good, plane, {.close_gap_mm = std::nan("")}),
              std::pair(ErrorKind::usage, std::string("slice.gap")));
    for (const float value :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 3e5f}) {
        Mesh mesh = good;
        mesh.vertices[3].x = value;
        EXPECT_EQ(kind_of(mesh, plane), std::pair(ErrorKind::input, std::string("slice.range")));
    }
    Mesh mesh = good;
    mesh.vertices[3].z = std::numeric_limits<float>::quiet_NaN();
    EXPECT_EQ(kind_of(mesh, plane), std::pair(ErrorKind::input, std::string("slice.range")));
    mesh = good;
    mesh.facets[5][1] = 8;
    EXPECT_EQ(kind_of(mesh, plane), std::pair(ErrorKind::input, std::string("slice.index")));
    mesh = good;
    mesh.neighbours.pop_back();
    EXPECT_EQ(kind_of(mesh, plane), std::pair(ErrorKind::input, std::string("slice.adjacency")));
    Context poor({.memory_bytes = 100});
    EXPECT_THROW((void)slice(poor, good.view(), plane), Error);
    context.cancel();
    EXPECT_EQ(kind_of(good, plane), std::pair(ErrorKind::cancelled, std::string("cancelled")));
}

/// Like brute_area(), at a height where vertices may lie: they count as the side says.
double brute_area_at(const Mesh& mesh, const Plane& plane) {
    double sum = 0;
    for (const Index3& facet : mesh.facets) {
        bool above[3];
        for (int k = 0; k < 3; ++k) {
            const double z = mesh.vertices[facet[static_cast<std::size_t>(k)]].z;
            above[k] = plane.side == Side::above ? z > plane.z : z >= plane.z;
        }
        if (above[0] == above[1] && above[1] == above[2]) continue;
        double x[2] = {}, y[2] = {};  // where the facet falls through the plane, where it rises
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t next = (k + 1) % 3;
            if (above[k] == above[next]) continue;
            const Vec3f &p = mesh.vertices[facet[k]], &q = mesh.vertices[facet[next]];
            const double wp = std::abs(q.z - plane.z), wq = std::abs(p.z - plane.z);
            const int end = above[next] ? 1 : 0;
            x[end] = (p.x * wp + q.x * wq) / (wp + wq);
            y[end] = (p.y * wp + q.y * wq) / (wp + wq);
        }
        sum += 0.5 * (x[0] * y[1] - x[1] * y[0]);
    }
    return sum;
}

TEST(Slicing, CorpusIsClosedAtEveryHeight) {
    const char* corpus = std::getenv("SLABWRIGHT_CORPUS");
    if (!corpus) {
        std::printf("skipped: SLABWRIGHT_CORPUS is not set\n");
        return;
    }
    std::ifstream manifest(std::string(corpus) + "/MANIFEST.tsv");
    ASSERT_TRUE(manifest) << "no MANIFEST.tsv in " << corpus;
    std::string line;
    std::getline(manifest, line);
    int files = 0;
    Context context;
    while (std::getline(manifest, line)) {
        std::vector<std::string> fields;
        std::istringstream columns(line);
        for (std::string field; std::getline(columns, field, '\t');) fields.push_back(field);
        ASSERT_GE(fields.size(), 7u) << line;
        if (fields[6] != "yes") continue;
        PatternMesh stl;
        try {
            stl = read_pattern_mesh(context, std::string(corpus) + "/" + fields[0]);
        } catch (const Error& error) {
            if (error.kind() != ErrorKind::input) throw;
            std::printf("%s is refused: %s\n", fields[0].c_str(), error.what());
            continue;
        }
        const Mesh& mesh = stl.mesh;
        if (stl.report.open_edges.count != 0 || stl.report.misoriented_edges.count != 0) {
            std::printf("%s has open or misoriented edges, though the manifest calls it watertight\n",
                        fields[0].c_str());
            continue;
        }
        ++files;
        std::set<double> flats;
        for (const Index3& f : mesh.facets) {
            const float z = mesh.vertices[f[0]].z;
            if (z == mesh.vertices[f[1]].z && z == mesh.vertices[f[2]].z) flats.insert(z);
        }
        const Box3 box = bounds(mesh.view());
        std::vector<Plane> planes;
        for (int i = 0; i < 50; ++i)
            planes.push_back(
                {box.min.z + (static_cast<double>(box.max.z) - box.min.z) * (i + 0.5) / 50, Side::above});
        for (const double z : flats) {
            planes.push_back({z, Side::above});
            planes.push_back({z, Side::below});
        }
        // The loops as they run, overlaps and bodies inside out included: their signed area is what the
        // facets' is. (tests/solid_test.cpp asks for the outlines.)
        MeshView view = mesh.view();
        view.roles = {};
        const auto sections = slice(context, view, planes);
        std::size_t open = 0;
        for (const Section& section : sections) open += section.open_chains.size();
        EXPECT_EQ(open, 0u) << fields[0];
        // Brute force looks at all facets for each plane: the 50 planes and up to 40 of the flats.
        const std::size_t stride = std::max<std::size_t>(1, (planes.size() - 50) / 40);
        for (std::size_t i = 0; i < planes.size(); i += i < 50 ? 1 : stride) {
            const double expected = brute_area_at(mesh, planes[i]);
            EXPECT_NEAR(area(sections[i].loops), expected,
                        1e-4 * (perimeter(sections[i].loops) + 1) + 1e-9 * std::abs(expected))
                << fields[0] << " at " << planes[i].z;
        }
        std::printf("%s: %zu facets, %zu flats, %zu planes\n", fields[0].c_str(), mesh.facets.size(),
                    flats.size(), planes.size());
    }
    EXPECT_GT(files, 10);
}

}  // namespace
