// Accessibility against closed forms, and against brute force over dense places of the tool on random small
// parts.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

#include "kernels/access/accessibility.h"
#include "kernels/errors.h"
#include "kernels/mesh/weld.h"
#include "tests/mesh_shapes.h"

using namespace slabwright;

namespace {

ToolShape flat(double radius) { return {.cutter = flat_cutter(radius)}; }
ToolShape ball(double radius) { return {.cutter = ball_cutter(radius)}; }
ToolShape bull_nose(double radius, double corner) { return {.cutter = {radius, corner, 0}}; }
ToolShape tapered_ball(double radius, double tip, double degrees) {
    return {.cutter = {radius, tip, degrees * std::numbers::pi / 180}};
}

/// Columns of square cells with upright walls between them.
Mesh blocks(Context& context, int n, double cell, const std::function<double(int, int)>& height) {
    shapes::Facets facets;
    auto quad = [&](Vec3f a, Vec3f b, Vec3f c, Vec3f d) {
        facets.push_back({a, b, c});
        facets.push_back({a, c, d});
    };
    auto at = [&](int i, int j, double z) {
        return Vec3f{static_cast<float>(i * cell), static_cast<float>(j * cell), static_cast<float>(z)};
    };
    auto h = [&](int i, int j) { return i < 0 || j < 0 || i >= n || j >= n ? 0.0 : height(i, j); };
    for (int i = 0; i <= n; ++i)
        for (int j = 0; j <= n; ++j) {
            if (i < n && j < n) {
                const double z = h(i, j);
                quad(at(i, j, z), at(i + 1, j, z), at(i + 1, j + 1, z), at(i, j + 1, z));
                quad(at(i, j, 0), at(i, j + 1, 0), at(i + 1, j + 1, 0), at(i + 1, j, 0));
            }
            // The wall between this cell and the one before it in x, and the same in y; facing the lower of
            // the two.
            const double west = h(i - 1, j), here = h(i, j), south = h(i, j - 1);
            if (j < n && west < here)
                quad(at(i, j + 1, west), at(i, j, west), at(i, j, here), at(i, j + 1, here));
            if (j < n && west > here)
                quad(at(i, j, here), at(i, j + 1, here), at(i, j + 1, west), at(i, j, west));
            if (i < n && south < here)
                quad(at(i, j, south), at(i + 1, j, south), at(i + 1, j, here), at(i, j, here));
            if (i < n && south > here)
                quad(at(i + 1, j, here), at(i, j, here), at(i, j, south), at(i + 1, j, south));
        }
    return weld(context, facets);
}

}  // namespace

TEST(ToolShape, RefusesWhatCannotBe) {
    EXPECT_THROW(check_tool_shape(flat(0)), Error);
    EXPECT_THROW(check_tool_shape(flat(-1)), Error);
    EXPECT_THROW(check_tool_shape(bull_nose(3, 4)), Error);
    EXPECT_THROW(check_tool_shape(tapered_ball(3, 1, 90)), Error);
    EXPECT_THROW(check_tool_shape(tapered_ball(1, 3, 5)), Error);
    ToolShape stubby = ball(3);
    stubby.flute_length = 2;
    EXPECT_THROW(check_tool_shape(stubby), Error);
    EXPECT_NO_THROW(check_tool_shape(bull_nose(3, 3)));
}

// A block in the open: all of its walls, by any tool that is upright somewhere.
TEST(Accessibility, OfABlockIsWhole) {
    Context context;
    const Mesh mesh = weld(context, shapes::box({0, 0, 0}, {20, 10, 12}));
    const AccessScene scene(context, mesh.view());
    for (const ToolShape& tool : {flat(3), ball(3), bull_nose(3, 1)}) {
        const Accessibility a = scene.accessible(context, 0, 12, tool);
        EXPECT_NEAR(a.area, 60 * (12 - 0.002), 0.01);
        EXPECT_DOUBLE_EQ(a.ratio(), 1);
        EXPECT_EQ(a.undercut, 0);
        EXPECT_EQ(a.undecided, 0u);
    }
}

// By facet: its share, and −1 for what is no wall of the layer.
TEST(Accessibility, SharesAreOneOnWallsAndMinusOneElsewhere) {
    Context context;
    const Mesh mesh = weld(context, shapes::box({0, 0, 0}, {20, 10, 12}));
    const AccessScene scene(context, mesh.view());
    AccessOptions options;
    options.shares = true;
    for (const double z_top : {12.0, 5.0}) {
        const Accessibility a = scene.accessible(context, 0, z_top, flat(3), options);
        ASSERT_EQ(a.share.size(), mesh.facets.size());
        for (std::size_t f = 0; f < mesh.facets.size(); ++f) {
            const Index3& corners = mesh.facets[f];
            const float z = mesh.vertices[corners[0]].z;
            const bool level = z == mesh.vertices[corners[1]].z && z == mesh.vertices[corners[2]].z;
            EXPECT_EQ(a.share[f], level ? -1.0F : 1.0F) << f;
        }
    }
}

// A slot: a flat end mill enters it if it is not wider by more than the tolerance on either side.
TEST(Accessibility, OfASlotByWidth) {
    Context context;
    // 5 × 5 cells of 4 mm, the middle row sunk to 6 of 10 mm.
    const Mesh mesh = blocks(context, 5, 4, [](int, int j) { return j == 2 ? 6 : 10; });
    const AccessScene scene(context, mesh.view());
    const double outside = 4 * 20 * 10 - 2 * 16, slot = 20 * 4 + 2 * 20 * 4;
    for (const double radius : {1.5, 2.0, 2.005}) {
        const Accessibility a = scene.accessible(context, 0, 10, flat(radius));
        EXPECT_NEAR(a.area, outside + slot, 0.5);
        EXPECT_DOUBLE_EQ(a.ratio(), 1) << radius;
    }
    // A wider one meets the two corners of the slot's mouth first, and reaches in between by its bulge there.
    const double radius = 2.5, bulge = radius - std::sqrt(radius * radius - 4), half = std::asin(2 / radius);
    const double segment = radius * radius * (half - std::sin(half) * std::cos(half));
    AccessOptions coarse;
    coarse.accuracy = 0.005;
    const Accessibility wide = scene.accessible(context, 0, 10, flat(radius), coarse);
    EXPECT_NEAR(wide.reached, outside + 2 * segment, wide.uncertain + 0.05 * bulge * slot / 20) << segment;
    EXPECT_LE(wide.uncertain, 0.1 * wide.area);
}

namespace {

/// The under side of a tool by its definition, at steps of the distance from the axis: shrunk by `depth`, and
/// grown by `cover`. Offsets are taken from a dense outline, point by point.
class Outline {
public:
    Outline(const ToolShape& tool, double depth, double cover) : radius_(tool.cutter.radius) {
        std::vector<std::array<double, 2>> line;  // of the un-eroded tool: distance, height
        constexpr int steps = 1500;
        for (int i = -steps; i <= steps; ++i) {
            const double d = radius_ * i / steps;
            line.push_back({d, height(tool, std::abs(d))});
        }
        for (int i = 1; i <= steps; ++i)
            for (const int side : {-1, 1})
                line.push_back({side * radius_, height(tool, radius_) + 8.0 * i / steps});
        // Over every point of the under side by `depth`, or under some point of the outline by `cover`.
        auto offset = [&](double d, double by, bool over) {
            double h = over ? -1e9 : 1e9;
            for (const auto& [db, hb] : line) {
                const double off = d - db;
                if (std::abs(off) > by || (over && hb > height(tool, radius_))) continue;
                const double rise = std::sqrt(by * by - off * off);
                h = over ? std::max(h, hb + rise) : std::min(h, hb - rise);
            }
            return h;
        };
        const int n = static_cast<int>((radius_ + cover) / step_) + 2;
        for (int i = 0; i <= n; ++i) {
            const double d = i * step_;
            shrunk_.push_back(d <= radius_ - depth ? offset(d, depth, true) : 1e9);
            grown_.push_back(d <= radius_ + cover ? offset(d, cover, false) : 1e9);
        }
    }
    [[nodiscard]] double shrunk(double d) const { return at(shrunk_, d); }
    [[nodiscard]] double grown(double d) const { return at(grown_, d); }

private:
    static double height(const ToolShape& tool, double d) {
        const auto& [radius, r, taper] = tool.cutter;
        if (taper > 0) {
            const double tangent = r * std::cos(taper);
            if (d > tangent) return r - r * std::sin(taper) + (d - tangent) / std::tan(taper);
            return r - std::sqrt(r * r - d * d);
        }
        const double x = d - (radius - r);
        return x <= 0 ? 0 : r - std::sqrt(std::max(0.0, r * r - x * x));
    }
    [[nodiscard]] double at(const std::vector<double>& table, double d) const {
        const auto i = static_cast<std::size_t>(d / step_ + 0.5);
        return i < table.size() ? table[i] : 1e9;
    }
    double radius_;
    static constexpr double step_ = 0.004;
    std::vector<double> shrunk_, grown_;
};

/// All places on a grid, and the lowest that the tool may go in each: over the columns of the part on the
/// same grid.
class DensePlaces {
public:
    static constexpr double kCell = 0.1;
    DensePlaces(const StandingPart& part, double size, double z_top, const ToolShape& tool, double depth,
                double cover)
        : outline_(tool, depth, cover), reach_(tool.cutter.radius + cover) {
        constexpr double room = 4;
        low_ = -room;
        n_ = static_cast<int>((size + 2 * room) / kCell);
        std::vector<float> columns(static_cast<std::size_t>(n_) * n_);
        RisingEnvelope(part, low_, low_, kCell, n_, n_).at(z_top, -1e6f, columns.data());
        tips_.assign(columns.size(), -1e6f);
        const int r = static_cast<int>(tool.cutter.radius / kCell) + 1;
        for (int dj = -r; dj <= r; ++dj)
            for (int di = -r; di <= r; ++di) {
                const double under = outline_.shrunk(std::hypot(di, dj) * kCell);
                if (under > 1e6) continue;
                for (int j = std::max(0, -dj); j < std::min(n_, n_ - dj); ++j) {
                    const float* column = &columns[static_cast<std::size_t>(j + dj) * n_];
                    float* tip = &tips_[static_cast<std::size_t>(j) * n_];
                    for (int i = std::max(0, -di); i < std::min(n_, n_ - di); ++i)
                        tip[i] = std::max(tip[i], column[i + di] - static_cast<float>(under));
                }
            }
    }
    [[nodiscard]] bool reach(const Point3& p) const {
        const int ci = static_cast<int>((p[0] - low_) / kCell), cj = static_cast<int>((p[1] - low_) / kCell),
                  r = static_cast<int>(reach_ / kCell) + 2;
        for (int j = std::max(0, cj - r); j < std::min(n_, cj + r); ++j)
            for (int i = std::max(0, ci - r); i < std::min(n_, ci + r); ++i) {
                const double d = std::hypot(low_ + i * kCell - p[0], low_ + j * kCell - p[1]);
                const double grown = outline_.grown(d);
                if (grown < 1e6 && tips_[static_cast<std::size_t>(j) * n_ + i] <= p[2] - grown) return true;
            }
        return false;
    }

private:
    Outline outline_;
    double reach_, low_ = 0;
    int n_ = 0;
    std::vector<float> tips_;
};

/// Upright steps, or slopes, on cells of 2 mm, and at times a plate that floats over some of it.
Mesh random_part(Context& context, std::mt19937_64& random, int kind) {
    auto uniform = [&](double a, double b) {
        return a + (b - a) * static_cast<double>(random() % 10007) / 10006;
    };
    constexpr int n = 9;
    constexpr double cell = 2;
    std::array<std::array<double, n + 1>, n + 1> h{};
    for (auto& row : h)
        for (double& v : row) v = uniform(2, 8.5);
    if (kind % 2 == 0)
        return blocks(context, n, cell, [&](int i, int j) { return std::round(h[i][j] * 2) / 2; });
    shapes::Facets facets;
    auto top = [&](int i, int j) {
        return Vec3f{static_cast<float>(i * cell), static_cast<float>(j * cell), static_cast<float>(h[i][j])};
    };
    auto foot = [&](int i, int j) {
        return Vec3f{static_cast<float>(i * cell), static_cast<float>(j * cell), 0};
    };
    auto quad = [&](Vec3f a, Vec3f b, Vec3f c, Vec3f d) {
        facets.push_back({a, b, c});
        facets.push_back({a, c, d});
    };
    for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j) {
            quad(top(i, j), top(i + 1, j), top(i + 1, j + 1), top(i, j + 1));
            quad(foot(i, j), foot(i, j + 1), foot(i + 1, j + 1), foot(i + 1, j));
        }
        quad(foot(i, 0), foot(i + 1, 0), top(i + 1, 0), top(i, 0));
        quad(foot(i + 1, n), foot(i, n), top(i, n), top(i + 1, n));
        quad(foot(0, i + 1), foot(0, i), top(0, i), top(0, i + 1));
        quad(foot(n, i), foot(n, i + 1), top(n, i + 1), top(n, i));
    }
    if (kind % 4 == 3) {
        const auto x = static_cast<float>(uniform(2, 8)), y = static_cast<float>(uniform(2, 8));
        shapes::append(facets, shapes::box({x, y, 9}, {x + 5, y + 6, 9.5f}));
    }
    return weld(context, facets);
}

struct SurfacePoint {
    Point3 p, n;
    std::uint32_t facet;
};

/// Points on facets that do not face down, below z_top.
std::vector<SurfacePoint> random_points(const Mesh& mesh, std::mt19937_64& random, std::size_t count,
                                        double z_top) {
    std::vector<SurfacePoint> points;
    while (points.size() < count) {
        const auto f = static_cast<std::uint32_t>(random() % mesh.facets.size());
        double u = static_cast<double>(random() % 1000) / 999, v = static_cast<double>(random() % 1000) / 999;
        if (u + v > 1) u = 1 - u, v = 1 - v;
        u = 0.01 + 0.97 * u, v = 0.01 + 0.97 * v * (1 - u);
        std::array<Point3, 3> t;
        for (int k = 0; k < 3; ++k) {
            const Vec3f& c = mesh.vertices[mesh.facets[f][k]];
            t[k] = {c.x, c.y, c.z};
        }
        Point3 a{}, b{}, p{};
        for (int k = 0; k < 3; ++k)
            a[k] = t[1][k] - t[0][k], b[k] = t[2][k] - t[0][k], p[k] = t[0][k] + u * a[k] + v * b[k];
        Point3 n{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
        const double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        for (double& c : n) c /= length;
        if (n[2] >= -1e-9 && p[2] < z_top - 0.01) points.push_back({p, n, f});
    }
    return points;
}

}  // namespace

// A place of the grid stands for all within 0.071 mm of it, and its columns for all within 0.15 (a corner of
// 90° holds one of them), so what the kernel reaches with the tolerance t is reached on the grid with t +
// 0.08, and what the grid reaches 0.15 within half of t the kernel reaches. Between the two either may be
// right; few points are.
TEST(Accessibility, OfRandomPartsAgainstDensePlaces) {
    constexpr std::uint64_t seed = 20261121;
    std::printf("seed %llu\n", static_cast<unsigned long long>(seed));
    std::mt19937_64 random(seed);
    Context context;
    AccessOptions options;
    options.tolerance = 0.4;
    options.spacing = 2;
    constexpr double size = 18, z_top = 9.75, place = 0.08, column = 0.15;
    std::size_t reached = 0, missed = 0, open = 0, whole = 0, none = 0;
    for (int part = 0; part < 20; ++part) {
        const Mesh mesh = random_part(context, random, part);
        const AccessScene scene(context, mesh.view());
        const StandingPart standing(context, mesh.view());
        const std::vector<SurfacePoint> points = random_points(mesh, random, 110, z_top);
        for (const ToolShape& tool :
             {flat(2.2), ball(1.8), bull_nose(2.4, 0.9), tapered_ball(2.2, 0.8, 12)}) {
            const double t = options.tolerance;
            const DensePlaces generous(standing, size, z_top, tool, t + place, t + place),
                strict(standing, size, z_top, tool, t / 2 - column, t);
            // The same by facet: what is reached or missed as a whole is so in its points.
            std::vector<float> shares;
            if (part % 5 == 0) {
                AccessOptions by_facet = options;
                by_facet.shares = true;
                by_facet.accuracy = 1;  // borders are of no interest
                shares = scene.accessible(context, 0, z_top, tool, by_facet).share;
                ASSERT_EQ(shares.size(), mesh.facets.size());
            }
            for (const SurfacePoint& s : points) {
                const bool kernel = scene.reaches(z_top, s.p, s.n, tool, options);
                const bool may = generous.reach(s.p), must = strict.reach(s.p);
                if (kernel)
                    EXPECT_TRUE(may) << "part " << part << " of " << name_of(tool.cutter.form()) << " facet "
                                     << s.facet << " at " << s.p[0] << ", " << s.p[1] << ", " << s.p[2];
                else
                    EXPECT_FALSE(must)
                        << "part " << part << " of " << name_of(tool.cutter.form()) << " facet " << s.facet
                        << " at " << s.p[0] << ", " << s.p[1] << ", " << s.p[2];
                // What a plate hangs over is not in the facet's share.
                const bool hung_over = standing.envelope(s.p[0], s.p[1], z_top, -1) > s.p[2] + 0.01;
                const float share = shares.empty() || hung_over ? -1 : shares[s.facet];
                if (share == 1) {
                    EXPECT_TRUE(may) << "part " << part << " facet " << s.facet;
                    ++whole;
                }
                if (share == 0) {
                    EXPECT_FALSE(must) << "part " << part << " facet " << s.facet;
                    ++none;
                }
                reached += kernel && must;
                missed += !kernel && !may;
                open += may && !must;
            }
        }
    }
    std::printf(
        "%zu reached and %zu missed by both, %zu too near to call; %zu on facets reached and %zu on facets "
        "missed as a whole\n",
        reached, missed, open, whole, none);
    EXPECT_GT(whole, 400u);
    EXPECT_GT(none, 50u);
    EXPECT_GT(reached, 3000u);
    EXPECT_GT(missed, 1000u);
    EXPECT_LT(open, (reached + missed) / 2);
}

// Where a limit is asked about, points dealt evenly tell: they lie within their likely error of what all of
// the surface gives, on the same side of the limit, and where the limit is far they are few.
TEST(Accessibility, OfPointsDealtEvenlyLiesWithinItsLikelyErrorOfTheWhole) {
    constexpr std::uint64_t seed = 20261130;
    std::printf("seed %llu\n", static_cast<unsigned long long>(seed));
    std::mt19937_64 random(seed);
    Context context;
    constexpr double z_top = 9.75;
    double squares = 0;
    int asked = 0, decided = 0, few = 0;
    for (int part = 0; part < 20; ++part) {
        const Mesh mesh = random_part(context, random, part);
        const AccessScene scene(context, mesh.view());
        for (const ToolShape& tool : {flat(2.2), ball(1.8), ball(0.6)}) {
            AccessOptions options;
            options.tolerance = 0.05;
            options.spacing = 0.7;
            const Accessibility whole = scene.accessible(context, 0, z_top, tool, options);
            options.spacing = 0;
            for (const double limit : {0.2, 0.5, 0.8, 0.975}) {
                options.limit = limit;
                const Accessibility told = scene.accessible(context, 0, z_top, tool, options);
                const double off = told.ratio() - whole.ratio();
                EXPECT_GT(told.likely_error, 0);
                EXPECT_LT(std::abs(off), 4.5 * told.likely_error + 0.004)
                    << "part " << part << " of " << name_of(tool.cutter.form()) << " limit " << limit;
                EXPECT_NEAR(told.area + told.undercut, whole.area + whole.undercut, 1e-6 * whole.area);
                squares += off * off / (told.likely_error * told.likely_error);
                ++asked;
                if (std::abs(whole.ratio() - limit) > 6 * told.likely_error + 0.004) {
                    EXPECT_EQ(told.ratio() > limit, whole.ratio() > limit)
                        << "part " << part << " limit " << limit;
                    ++decided;
                }
                if (std::abs(whole.ratio() - limit) > 0.15) {
                    EXPECT_LE(told.points, 512u) << "part " << part << " limit " << limit;
                    ++few;
                }
            }
        }
    }
    std::printf("%d asked, %d far from their limit, %d very far; off by %.2f likely errors\n", asked, decided,
                few, std::sqrt(squares / asked));
    EXPECT_LT(std::sqrt(squares / asked), 1.2);
    EXPECT_GT(decided, 200);
    EXPECT_GT(few, 110);
}

// Whatever a larger tool reaches a smaller one of the same kind reaches too, if neither has shank or holder.
// The larger one gets half the tolerance, for what is missed is missed with half of it only; without
// refinement both are asked about the same points.
TEST(Accessibility, NeverFallsAsTheToolShrinks) {
    constexpr std::uint64_t seed = 4;
    std::printf("seed %llu\n", static_cast<unsigned long long>(seed));
    std::mt19937_64 random(seed);
    Context context;
    int grew = 0;
    for (int part = 0; part < 2; ++part) {
        const Mesh mesh = random_part(context, random, part);
        const AccessScene scene(context, mesh.view());
        for (int profile = 0; profile < 3; ++profile) {
            double last = 0;
            for (const double radius : {2.5, 1.2, 0.5}) {
                const ToolShape tool = profile == 0   ? flat(radius)
                                       : profile == 1 ? ball(radius)
                                                      : bull_nose(radius, radius / 3);
                AccessOptions options;
                options.accuracy = 1;
                options.spacing = 4;
                options.tolerance = 0.05;
                const double now = scene.accessible(context, 1, 9, tool, options).reached;
                EXPECT_GE(now, last * (1 - 1e-12))
                    << "part " << part << " profile " << profile << " radius " << radius;
                grew += now > last;
                options.tolerance /= 2;
                last = scene.accessible(context, 1, 9, tool, options).reached;
            }
        }
    }
    EXPECT_GT(grew, 12);
}

// What overhangs is left out with all that lies in its shadow, and the same figures come out on any number of
// threads.
TEST(Accessibility, LeavesUndercutsOut) {
    Context one({.threads = 1}), many({.threads = 3});
    shapes::Facets facets = shapes::box({0, 0, 0}, {20, 20, 4});
    shapes::append(facets, shapes::box({5, 5, 8}, {15, 15, 9}));  // a plate over the middle
    const Mesh mesh = weld(one, facets);
    const AccessScene scene(one, mesh.view());
    AccessOptions options;
    options.shares = true;
    options.accuracy = 0.005;
    const Accessibility a = scene.accessible(one, 0, 12, ball(2), options),
                        b = scene.accessible(many, 0, 12, ball(2), options);
    EXPECT_NEAR(a.undercut, 100 + 100, 2 + a.uncertain);  // the plate's under side, and what is under it
    EXPECT_NEAR(a.area, 4 * 20 * 4 + 300 + 100 + 40, 2 + a.uncertain);
    // A ball beside the plate leaves a strip at its foot unreached only where it cannot go under: none, for
    // it is tangent there.
    EXPECT_GT(a.ratio(), 0.8);
    EXPECT_EQ(a.area, b.area);
    EXPECT_EQ(a.reached, b.reached);
    EXPECT_EQ(a.undercut, b.undercut);
    EXPECT_EQ(a.share, b.share);
}

// A wall 30 mm deep beside a floor: shank and holder decide how near to its foot the tool comes.
TEST(Accessibility, ShankAndHolder) {
    Context context;
    const Mesh mesh = blocks(context, 2, 40, [](int i, int) { return i == 0 ? 40 : 10; });
    const AccessScene scene(context, mesh.view());
    AccessOptions options;
    ToolShape tool = flat(3);
    const Point3 up{0, 0, 1}, out{1, 0, 0};
    EXPECT_TRUE(scene.reaches(40, {40.5, 20, 10}, up, tool, options));
    EXPECT_TRUE(scene.reaches(40, {40, 20, 15}, out, tool, options));
    tool.flute_length = 12, tool.shank_radius = 5;  // 2 mm proud of the cutter
    EXPECT_FALSE(scene.reaches(40, {40, 20, 15}, out, tool, options));
    EXPECT_FALSE(scene.reaches(40, {41.9, 20, 10}, up, tool, options));
    EXPECT_TRUE(scene.reaches(40, {42.1, 20, 10}, up, tool, options));
    EXPECT_TRUE(scene.reaches(40, {40, 20, 28.1}, out, tool, options));
    tool.shank_radius = 3, tool.stickout = 25, tool.holder_radius = 20;
    EXPECT_FALSE(scene.reaches(40, {56.9, 20, 10}, up, tool, options));
    EXPECT_TRUE(scene.reaches(40, {57.1, 20, 10}, up, tool, options));
    EXPECT_FALSE(scene.reaches(40, {40, 20, 14.9}, out, tool, options));
    EXPECT_TRUE(scene.reaches(40, {40, 20, 15.1}, out, tool, options));
    // The base board stops a ball that would have to pass below the foot of an outer wall.
    EXPECT_TRUE(scene.reaches(40, {80, 20, 1}, out, ball(3), options));
    options.lowest_tip = 0;
    EXPECT_FALSE(scene.reaches(40, {80, 20, 1}, out, ball(3), options));
    EXPECT_TRUE(scene.reaches(40, {80, 20, 3.1}, out, ball(3), options));
}

TEST(Accessibility, CanBeCancelledAndRefuses) {
    Context context;
    const Mesh mesh = weld(context, shapes::box({0, 0, 0}, {20, 10, 12}));
    const AccessScene scene(context, mesh.view());
    AccessOptions options;
    options.tolerance = 0;
    EXPECT_THROW((void)scene.accessible(context, 0, 12, ball(3), options), Error);
    EXPECT_THROW((void)scene.accessible(context, 0, 12, ball(-3)), Error);
    context.cancel();
    EXPECT_THROW((void)scene.accessible(context, 0, 12, ball(3)), Error);
}

TEST(Accessibility, IsChargedForItsTrees) {
    std::uint64_t taken = 0;
    {
        Context context;
        const Mesh mesh = blocks(context, 40, 1, [](int i, int j) { return 2 + (i * 7 + j * 5) % 11; });
        const std::uint64_t before = context.memory_charged();
        {
            const AccessScene scene(context, mesh.view());
            taken = context.memory_charged() - before;
            EXPECT_GT(taken, mesh.facets.size() * 100);
            EXPECT_LT(taken, mesh.facets.size() * 1000);
        }
        EXPECT_EQ(context.memory_charged(), before);
        // Room for the planes, not for the tree.
        Context narrow({.memory_bytes = taken * 3 / 5});
        try {
            const AccessScene scene(narrow, mesh.view());
            ADD_FAILURE() << "no limit was kept";
        } catch (const Error& e) {
            EXPECT_EQ(e.code(), "memory.limit");
        }
        EXPECT_EQ(narrow.memory_charged(), 0u);
    }
}
