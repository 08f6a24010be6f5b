// Bull-nose, tapered ball and cone end mills in every kernel against judges that know only a cutter's
// profile: as a stack of thin discs, or as a distance to its outline.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <random>
#include <vector>

#include "kernels/access/revolved_depth.h"
#include "kernels/access/standing_part.h"
#include "kernels/cutting/drop.h"
#include "kernels/cutting/level_contours.h"
#include "kernels/errors.h"
#include "kernels/mesh/weld.h"
#include "kernels/stock/sweep.h"
#include "tests/mesh_shapes.h"
#include "tests/support/height_field.h"
#include "tests/support/seed.h"

namespace slabwright {
namespace {

constexpr double kMicrometre = 1e-3;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Poses by the thousand take minutes: a sixth of them unless SLABWRIGHT_SOAK is set.
int poses_of(int all) { return std::getenv("SLABWRIGHT_SOAK") != nullptr ? all : all / 6; }

struct Named {
    const char* name;
    CutterShape shape;
};
const std::vector<Named>& shapes_of_all_forms() {
    static const std::vector<Named> shapes{
        {"bull-nose 12 R1.5", {6, 1.5, 0}},         {"bull-nose 6 R2.5", {3, 2.5, 0}},
        {"bull-nose 4 R0.2", {2, 0.2, 0}},          {"tapered ball 6 R0.5 5.7 deg", {3, 0.5, 0.1}},
        {"tapered ball 8 R2 20 deg", {4, 2, 0.35}}, {"cone 8 90 deg", {4, 0, 0.785398}},
        {"cone 6 30 deg", {3, 0, 0.261799}}};
    return shapes;
}

// Height of the under side over the tip.
double profile_height(const CutterShape& s, double r) {
    if (s.taper_rad == 0) {
        const double x = r - (s.radius - s.corner);
        return x <= 0 ? 0 : s.corner - std::sqrt(std::max(0.0, s.corner * s.corner - x * x));
    }
    const double from = s.corner * std::cos(s.taper_rad);
    if (r <= from) return s.corner - std::sqrt(std::max(0.0, s.corner * s.corner - r * r));
    return s.corner * (1 - std::sin(s.taper_rad)) + (r - from) / std::tan(s.taper_rad);
}
// The radius of the thickest disc that lies in the cutter at a height over its tip, by halving.
double disc_at(const CutterShape& s, double z) {
    double low = 0, high = s.radius;
    if (profile_height(s, high) <= z) return high;
    for (int i = 0; i < 44; ++i) {
        const double middle = (low + high) / 2;
        (profile_height(s, middle) <= z ? low : high) = middle;
    }
    return low;
}

using Triangle3 = std::array<Vec3d, 3>;

// The highest point of a triangle within a disc seen from above; −infinity where there is none.
double highest_within(const Triangle3& t, double x, double y, double r) {
    double top = -kInfinity;
    for (std::size_t k = 0; k < 3; ++k) {
        const Vec3d &a = t[k], &b = t[(k + 1) % 3];
        const double ax = a[0] - x, ay = a[1] - y, dx = b[0] - a[0], dy = b[1] - a[1];
        if (ax * ax + ay * ay <= r * r) top = std::max(top, a[2]);
        const double l2 = dx * dx + dy * dy, half = ax * dx + ay * dy,
                     root = half * half - l2 * (ax * ax + ay * ay - r * r);
        if (l2 == 0 || root < 0) continue;
        for (const double s : {-1.0, 1.0})
            if (const double at = (-half + s * std::sqrt(root)) / l2; at >= 0 && at <= 1)
                top = std::max(top, a[2] + at * (b[2] - a[2]));
    }
    const double ux = t[1][0] - t[0][0], uy = t[1][1] - t[0][1], uz = t[1][2] - t[0][2];
    const double vx = t[2][0] - t[0][0], vy = t[2][1] - t[0][1], vz = t[2][2] - t[0][2];
    const double nz = ux * vy - uy * vx;
    if (nz == 0) return top;
    const double gx = (uz * vy - uy * vz) / nz, gy = (ux * vz - uz * vx) / nz, g = std::hypot(gx, gy);
    const double px = g > 0 ? x + r * gx / g : x, py = g > 0 ? y + r * gy / g : y;
    const double b = ((px - t[0][0]) * vy - (py - t[0][1]) * vx) / nz,
                 c = (ux * (py - t[0][1]) - uy * (px - t[0][0])) / nz;
    if (b >= 0 && c >= 0 && b + c <= 1)
        top = std::max(top, t[0][2] + gx * (px - t[0][0]) + gy * (py - t[0][1]));
    return top;
}

// A cutter as a stack of discs: no disc, as high over the tip as it lies, may be under the highest that is
// within it. Of ranges of heights whose tallest disc at their lowest height would hold the tip no higher,
// nothing more is asked.
class StackOfDiscs {
public:
    explicit StackOfDiscs(const CutterShape& shape) : shape_(shape) {}
    [[nodiscard]] double tip(const std::vector<Triangle3>& all, double x, double y) const {
        std::vector<Triangle3> near;
        for (const Triangle3& t : all)
            if (highest_within(t, x, y, shape_.radius) > -kInfinity) near.push_back(t);
        double best = -kInfinity;
        divide(near, x, y, 0, profile_height(shape_, shape_.radius), best);
        return best;
    }

private:
    void divide(const std::vector<Triangle3>& near, double x, double y, double low, double high,
                double& best) const {
        constexpr double thin = 0.45 * kMicrometre;
        const auto top = [&](double z) {
            const double radius = disc_at(shape_, z);
            double highest = -kInfinity;
            for (const Triangle3& t : near) highest = std::max(highest, highest_within(t, x, y, radius));
            return highest;
        };
        best = std::max(best, top(low) - low);
        if (high - low < thin || top(high) - low <= best + thin) return;
        const double middle = (low + high) / 2;
        divide(near, x, y, low, middle, best);
        divide(near, x, y, middle, high, best);
    }
    CutterShape shape_;
};

std::vector<Triangle3> triangles_of(const LayerSolid& solid) {
    std::vector<Triangle3> all;
    for (const SolidFacet& f : solid.facets) all.push_back(f.p);
    return all;
}

// Heights that leave steps, slopes of every steepness and level places.
Mesh rough_ground(Context& context, unsigned seed) {
    return test::random_height_field(context, 6, 2.5, 9, seed % 2 == 0 ? 0.5 : 2.0, seed);
}

TEST(RevolvedCutters, UnderSideAndItsWidthAreInverse) {
    for (const auto& [name, shape] : shapes_of_all_forms()) {
        const Envelope under = under_side(shape);
        for (int k = 0; k <= 200; ++k) {
            const double r = shape.radius * k / 200, h = profile_height(shape, r);
            EXPECT_NEAR(under.height(r), h, 1e-9) << name << ' ' << r;
            if (h > 1e-9 && r < shape.radius) {
                EXPECT_NEAR(under.width(h), r, 1e-6) << name << ' ' << r;
            }
        }
        EXPECT_LT(under.width(-0.1), 0) << name;
        EXPECT_NEAR(under.width(100), shape.radius, 1e-12) << name;
    }
}

TEST(RevolvedCutters, MeasuresThatMakeNoCutterAreRefused) {
    for (const CutterShape& shape :
         {CutterShape{0, 0, 0}, CutterShape{3, 4, 0}, CutterShape{3, 1, 1.6}, CutterShape{3, -1, 0}})
        EXPECT_THROW((void)under_side(shape), Error);
}

TEST(RevolvedCutters, DropsAgreeWithAStackOfDiscs) {
    const unsigned seed = test::seed();
    Context context;
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> place(-10, 10);
    double worst = 0;
    int poses = 0;
    for (unsigned ground = 0; ground < 4; ++ground) {
        const Mesh mesh = rough_ground(context, seed + ground);
        const LayerSolid solid = layer_solid(context, mesh.view(), -20, 30);
        const std::vector<Triangle3> all = triangles_of(solid);
        for (const auto& [name, shape] : shapes_of_all_forms()) {
            const DropIndex drops(solid, shape);
            const StackOfDiscs judge(shape);
            MetPoints met;
            for (int i = 0; i < poses_of(360); ++i, ++poses) {
                const double x = place(random), y = place(random), expected = judge.tip(all, x, y);
                const Rest rest = drops.drop(x, y, -kInfinity, &met);
                if (expected == -kInfinity) {
                    EXPECT_EQ(rest.tip_z, -kInfinity) << name;
                    continue;
                }
                ASSERT_NEAR(rest.tip_z, expected, kMicrometre) << name << " at " << x << ' ' << y;
                ASSERT_EQ(rest.tip_z, drops.drop(x, y).tip_z) << name << ": what was met changes nothing";
                EXPECT_TRUE(drops.stands_over(x, y, rest.tip_z - 1e-6));
                EXPECT_FALSE(drops.stands_over(x, y, rest.tip_z + 1e-6));
                worst = std::max(worst, std::abs(rest.tip_z - expected));
            }
        }
    }
    std::printf("%d poses; a drop differs by %.2e mm at most\n", poses, worst);
}

TEST(RevolvedCutters, FibresAgreeWithAStackOfDiscs) {
    const unsigned seed = test::seed();
    Context context;
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> place(-10, 10), height(-1, 9);
    std::vector<std::int32_t> lines;
    for (int i = -9; i <= 9; ++i) lines.push_back(to_units(i + 0.0371));
    int ends = 0, places = 0;
    for (unsigned ground = 0; ground < (poses_of(6) > 1 ? 2U : 1U); ++ground) {
        const Mesh mesh = rough_ground(context, seed + ground);
        const LayerSolid solid = layer_solid(context, mesh.view(), -20, 30);
        const std::vector<Triangle3> all = triangles_of(solid);
        for (const auto& [name, shape] : shapes_of_all_forms()) {
            const CutterShape& cutter = shape;
            const StackOfDiscs judge(shape);
            for (const Axis axis : {Axis::x, Axis::y}) {
                const double tip = height(random);
                const Plane plane = inside_plane(solid, cutter, tip);
                const Loops inside = slice(context, mesh.view(), {&plane, 1})[0].loops;
                const Fibres rows = fibres(context, solid, inside, cutter, tip, axis, lines);
                const auto tip_at = [&](double u, std::size_t l) {
                    const double v = to_mm(lines[l]);
                    return axis == Axis::x ? judge.tip(all, u, v) : judge.tip(all, v, u);
                };
                for (std::size_t l = 0; l < lines.size(); ++l) {
                    for (const Forbidden& f : rows.line(l)) {
                        for (const double sign : {-1.0, 1.0}) {
                            const double end = sign < 0 ? f.low : f.high;
                            ASSERT_LE(tip_at(end + sign * kMicrometre, l), tip + kMicrometre)
                                << name << " tip " << tip << " line " << l << " end " << end;
                            ASSERT_GE(tip_at(end - sign * kMicrometre, l), tip - kMicrometre)
                                << name << " tip " << tip << " line " << l << " end " << end;
                            ++ends;
                        }
                    }
                    for (int i = 0; i < 6; ++i) {
                        const double u = place(random), is = tip_at(u, l);
                        if (std::abs(is - tip) < 2 * kMicrometre) continue;
                        const auto on = rows.line(l);
                        const bool is_forbidden = std::any_of(on.begin(), on.end(), [&](const Forbidden& f) {
                            return u > f.low && u < f.high;
                        });
                        // Deep inside the solid no facet is near: the section's inside forbids.
                        if (is == -kInfinity && is_forbidden) continue;
                        ASSERT_EQ(is_forbidden, is > tip)
                            << name << " tip " << tip << " at " << u << ", " << is;
                        ++places;
                    }
                }
            }
        }
    }
    std::printf("%d ends and %d places\n", ends, places);
}

// Chords of a contour keep to what level_contours says: a bull-nose's floor bounds what they cut off.
TEST(RevolvedCutters, ContoursSpareThePart) {
    const unsigned seed = test::seed();
    Context context;
    const Mesh mesh = rough_ground(context, seed);
    const LayerSolid solid = layer_solid(context, mesh.view(), -20, 30);
    const CutterShape shape{3, 1, 0};
    const CutterShape& cutter = shape;
    const DropIndex drops(solid, cutter);
    constexpr std::int32_t pitch = 2000;
    for (const double tip : {-0.5, 1.2, 3.1, 5.6}) {
        const Plane plane = inside_plane(solid, cutter, tip);
        const Loops inside = slice(context, mesh.view(), {&plane, 1})[0].loops;
        const Contours contours =
            level_contours(context, solid, inside, cutter, tip, fibre_grid(solid, cutter, pitch));
        ASSERT_GT(contours.size(), 0U);
        for (const Point2& p : contours.points) {
            // Half a unit of rounding beside a wall.
            double least = kInfinity;
            for (const double dx : {-1e-4, 0.0, 1e-4})
                for (const double dy : {-1e-4, 0.0, 1e-4})
                    least = std::min(least, drops.drop(to_mm(p.x) + dx, to_mm(p.y) + dy).tip_z);
            EXPECT_LE(least, tip + 1e-6) << to_mm(p.x) << ' ' << to_mm(p.y);
        }
    }
}

TEST(RevolvedCutters, SweepsAreTheLeastHeightAlongTheWay) {
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> u(-1, 11), uz(-3, 3);
    const CellGrid grid{0.1, 0.2, 0.31, 30, 28};
    double worst = 0;
    int cells = 0;
    for (int trial = 0; trial < 70; ++trial) {
        const auto& [name, shape] =
            shapes_of_all_forms()[static_cast<std::size_t>(trial) % shapes_of_all_forms().size()];
        const CutterEnd end = cutter_end(shape);
        std::array<double, 3> a{u(random), u(random), uz(random)}, b{u(random), u(random), uz(random)};
        if (trial % 5 == 0) b[2] = a[2];
        if (trial % 6 == 0) b[0] = a[0], b[1] = a[1];
        std::vector<double> exact(grid.count(), kInfinity);
        sweep(grid, end, a, b, [&](std::size_t c, double z) {
            EXPECT_EQ(exact[c], kInfinity) << "a cell came twice";
            exact[c] = z;
        });
        for (int j = 0; j < grid.ny; ++j)
            for (int i = 0; i < grid.nx; ++i) {
                // Where on the way the cutter covers the centre.
                const double px = a[0] - grid.x(i), py = a[1] - grid.y(j), dx = b[0] - a[0], dy = b[1] - a[1];
                const double l2 = dx * dx + dy * dy, half = px * dx + py * dy,
                             c = px * px + py * py - shape.radius * shape.radius, root = half * half - l2 * c;
                double low = 0, high = 1;
                if (l2 > 0 && root >= 0) {
                    low = std::max(0.0, (-half - std::sqrt(root)) / l2);
                    high = std::min(1.0, (-half + std::sqrt(root)) / l2);
                }
                if (low > high || (l2 == 0 ? c > 0 : root < 0)) continue;
                const auto height = [&](double t) {
                    return a[2] + t * (b[2] - a[2]) +
                           profile_height(shape,
                                          std::min(shape.radius, std::hypot(px + t * dx, py + t * dy)));
                };
                const double first = low, last = high;
                for (int k = 0; k < 120; ++k) {
                    const double one = low + (high - low) / 3, two = high - (high - low) / 3;
                    if (height(one) <= height(two)) high = two;
                    else low = one;
                }
                const double expected = std::min({height(low), height(first), height(last)});
                const double found = exact[grid.index(i, j)];
                if (found == kInfinity && last - first < 1e-6) continue;  // covered by a hair
                ASSERT_NEAR(found, expected, kMicrometre) << name << " trial " << trial;
                worst = std::max(worst, std::abs(found - expected));
                ++cells;
            }
    }
    std::printf("%d cells; a height differs by %.2e mm at most\n", cells, worst);
}

TEST(RevolvedCutters, ArcsCutWhatTheirChordsDo) {
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> u(-2, 12), ur(0.4, 4), ua(-6, 6);
    const CellGrid grid{0.1, 0.2, 0.31, 30, 28};
    for (const auto& [name, shape] : shapes_of_all_forms()) {
        const CutterEnd end = cutter_end(shape);
        const LevelArc arc{u(random), u(random), 1.5, ur(random), ua(random), ua(random)};
        std::vector<double> exact(grid.count(), kInfinity), chords(grid.count(), kInfinity);
        sweep(grid, end, arc, [&](std::size_t c, double z) { exact[c] = z; });
        constexpr int n = 4000;
        const auto at = [&](int i) {
            const double a = arc.start + arc.turn * i / n;
            return std::array<double, 3>{arc.x + arc.radius * std::cos(a), arc.y + arc.radius * std::sin(a),
                                         arc.z};
        };
        for (int k = 0; k < n; ++k)
            sweep(grid, end, at(k), at(k + 1),
                  [&](std::size_t c, double z) { chords[c] = std::min(chords[c], z); });
        for (std::size_t c = 0; c < grid.count(); ++c)
            if (chords[c] < kInfinity && exact[c] < kInfinity) {
                EXPECT_NEAR(exact[c], chords[c], 0.01) << name;
            }
    }
}

// How deep a point at (r, z), z over the tip, lies in a cutter: its distance from the outline as so many
// short lines; negative outside.
class Outline {
public:
    explicit Outline(const CutterShape& s) : shape_(s) {
        constexpr int n = 4000;
        if (s.taper_rad == 0) add(s.radius - s.corner, 0);
        const double turned = 1.5707963267948966 - s.taper_rad,
                     disc = s.taper_rad > 0 ? 0 : s.radius - s.corner;
        for (int k = 0; k <= n && s.corner > 0; ++k) {
            const double a = turned * k / n;
            add(disc + s.corner * std::sin(a), s.corner * (1 - std::cos(a)));
        }
        if (s.taper_rad > 0) add(s.radius, profile_height(s, s.radius));
        add(s.radius, points_.back()[1] + 100);
    }
    [[nodiscard]] double depth(double r, double z) const {
        double nearest = kInfinity;
        for (std::size_t k = 0; k + 1 < points_.size(); ++k) {
            const auto& [r0, z0] = points_[k];
            const double dr = points_[k + 1][0] - r0, dz = points_[k + 1][1] - z0, l2 = dr * dr + dz * dz,
                         t = l2 > 0 ? std::clamp(((r - r0) * dr + (z - z0) * dz) / l2, 0.0, 1.0) : 0.0;
            nearest = std::min(nearest, std::hypot(r - r0 - t * dr, z - z0 - t * dz));
        }
        const bool is_inside = r < shape_.radius && z > profile_height(shape_, r);
        return is_inside ? nearest : -nearest;
    }

private:
    void add(double r, double z) { points_.push_back({r, z}); }
    CutterShape shape_;
    std::vector<std::array<double, 2>> points_{{0, 0}};
};
// The same in closed form: from the lines and the circle that the outline is made of.
double depth_in(const CutterShape& s, double r, double z) {
    const double side = s.radius - r;
    if (s.taper_rad == 0) {
        const double disc = s.radius - s.corner;
        if (r <= disc && z >= s.corner) return std::min(side, z);
        return s.corner - std::hypot(std::max(0.0, r - disc), std::max(0.0, s.corner - z));
    }
    const double sine = std::sin(s.taper_rad), cosine = std::cos(s.taper_rad), up = z - s.corner;
    // On the circle's part of the outline everything is nearest that lies below the line square to the flank.
    const bool below = up * cosine + r * sine < 0;
    const double end = below ? s.corner - std::hypot(r, up) : s.corner + up * sine - r * cosine;
    return std::min(side, end);
}

template <class F>
double greatest(int rounds, F&& f) {
    double low = 0, high = 1;
    for (int k = 0; k < rounds; ++k) {
        const double one = low + 0.4 * (high - low), two = high - 0.4 * (high - low);
        if (f(one) >= f(two)) high = two;
        else low = one;
    }
    return std::max({f(0.0), f((low + high) / 2), f(1.0)});
}

// The deepest point of a triangle: depth is concave.
double deepest_of(const CutterShape& s, const Triangle3& t, const Vec3d& tip) {
    return greatest(30, [&](double a) {
        return greatest(30, [&](double b) {
            Vec3d p;
            for (std::size_t k = 0; k < 3; ++k)
                p[k] = t[0][k] + a * ((1 - b) * (t[1][k] - t[0][k]) + b * (t[2][k] - t[0][k]));
            return depth_in(s, std::hypot(p[0] - tip[0], p[1] - tip[1]), p[2] - tip[2]);
        });
    });
}

Mesh random_tetrahedron(Context& context, std::mt19937& random) {
    std::uniform_real_distribution<float> u(-4, 4);
    std::array<Vec3f, 4> p;
    for (Vec3f& v : p) v = {u(random), u(random), u(random)};
    const auto cross_z = [&](int a, int b, int c, int d) {
        const Vec3d u1{p[b].x - p[a].x, p[b].y - p[a].y, p[b].z - p[a].z},
            u2{p[c].x - p[a].x, p[c].y - p[a].y, p[c].z - p[a].z},
            u3{p[d].x - p[a].x, p[d].y - p[a].y, p[d].z - p[a].z};
        return u1[0] * (u2[1] * u3[2] - u2[2] * u3[1]) - u1[1] * (u2[0] * u3[2] - u2[2] * u3[0]) +
               u1[2] * (u2[0] * u3[1] - u2[1] * u3[0]);
    };
    if (cross_z(0, 1, 2, 3) < 0) std::swap(p[0], p[1]);
    const std::vector<std::array<Vec3f, 3>> facets{
        {p[0], p[2], p[1]}, {p[0], p[1], p[3]}, {p[1], p[2], p[3]}, {p[2], p[0], p[3]}};
    return weld(context, facets);
}

TEST(RevolvedCutters, DepthInACutterIsThatFromItsOutline) {
    std::mt19937 random(test::seed());
    for (const auto& [name, shape] : shapes_of_all_forms()) {
        std::uniform_real_distribution<double> ur(0, shape.radius), uz(0, 12);
        const Outline outline(shape);
        int inside = 0;
        for (int i = 0; i < 200; ++i) {
            const double r = ur(random), z = uz(random), expected = outline.depth(r, z);
            if (expected <= 0) continue;
            ++inside;
            EXPECT_NEAR(depth_in(shape, r, z), expected, 1e-6) << name << ' ' << r << ' ' << z;
            EXPECT_NEAR(depth_within(under_side(shape), r, z), expected, 1e-6)
                << name << ' ' << r << ' ' << z;
        }
        EXPECT_GT(inside, 30) << name;
    }
}

TEST(RevolvedCutters, GougesAreTheDeepestPoints) {
    Context context;
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> u(-6, 6), uz(-5, 5);
    double worst = 0;
    int poses = 0, touching = 0;
    for (int solid = 0; solid < poses_of(105); ++solid) {
        const Mesh mesh = random_tetrahedron(context, random);
        const StandingPart part(context, mesh.view());
        std::vector<Triangle3> all;
        for (const Index3& f : mesh.facets) {
            Triangle3 t;
            for (std::size_t k = 0; k < 3; ++k)
                t[k] = {mesh.vertices[f[k]].x, mesh.vertices[f[k]].y, mesh.vertices[f[k]].z};
            all.push_back(t);
        }
        const std::vector<Named>& shapes = shapes_of_all_forms();
        const CutterShape shape = shapes[static_cast<std::size_t>(solid) % shapes.size()].shape;
        for (int i = 0; i < 100; ++i, ++poses) {
            const Point3 tip{u(random), u(random), uz(random)};
            double expected = 0;
            for (const Triangle3& t : all) expected = std::max(expected, deepest_of(shape, t, tip));
            const Penetration found = part.depth(shape, 20, tip, tip, 0);
            ASSERT_NEAR(found.found ? found.depth : 0, expected, kMicrometre)
                << "solid " << solid << ", corner " << shape.corner << ", taper " << shape.taper_rad;
            worst = std::max(worst, std::abs((found.found ? found.depth : 0) - expected));
            touching += static_cast<int>(expected > 0);
        }
        // On motions: the deepest of many places, and in a row what each by itself is.
        std::vector<StandingPart::Motion> row;
        std::vector<double> each;
        for (int i = 0; i < 4; ++i) {
            StandingPart::Motion m{{u(random), u(random), uz(random)}, {u(random), u(random), uz(random)}};
            if (i % 2 == 0) m.to[2] = m.from[2];
            if (i > 0) m.from = row.back().to;
            if (i % 2 == 0) m.to[2] = m.from[2];
            row.push_back(m);
            const Penetration found = part.depth(shape, 20, m.from, m.to, 0);
            double expected = 0;
            for (int k = 0; k <= 60; ++k) {
                Vec3d tip;
                for (std::size_t c = 0; c < 3; ++c) tip[c] = m.from[c] + (m.to[c] - m.from[c]) * k / 60;
                for (const Triangle3& t : all) expected = std::max(expected, deepest_of(shape, t, tip));
            }
            each.push_back(found.found ? found.depth : 0);
            EXPECT_GE(each.back(), expected - kMicrometre) << "solid " << solid << " motion " << i;
            EXPECT_LE(each.back(), expected + 0.15) << "a place between the samples: solid " << solid;
        }
        const auto found = part.deepest(shape, 20, row, 0, 0.01);
        EXPECT_NEAR(found.most.found ? found.most.depth : 0, *std::max_element(each.begin(), each.end()),
                    1e-6);
        for (std::size_t i = 0; i < each.size(); ++i)
            EXPECT_EQ(std::find(found.beyond.begin(), found.beyond.end(), i) != found.beyond.end(),
                      each[i] > 0.01)
                << "solid " << solid << " motion " << i;
    }
    std::printf("%d poses, %d touch; a depth differs by %.2e mm at most\n", poses, touching, worst);
}

// Walls that the layer's top cuts are upright only but for rounding.
TEST(RevolvedCutters, ABullNoseIsNoDeeperThanTheCylinderAroundIt) {
    Context context;
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> u(-14, 14), uz(-1, 5), turn(0, 6);
    int deep = 0;
    for (int solid = 0; solid < 40; ++solid) {
        const double a = turn(random);
        std::vector<std::array<Vec3f, 3>> facets = shapes::box({-6, -5, 0}, {7, 4, 9});
        for (auto& facet : facets)
            for (Vec3f& v : facet)
                v = {static_cast<float>(v.x * std::cos(a) - v.y * std::sin(a)),
                     static_cast<float>(v.x * std::sin(a) + v.y * std::cos(a)), v.z};
        const Mesh mesh = weld(context, facets);
        const StandingPart part(context, mesh.view());
        for (int i = 0; i < 60; ++i) {
            const Point3 from{u(random), u(random), uz(random)};
            Point3 to{u(random), u(random), from[2]};
            if (i % 2 == 0) to = {from[0] + 0.1, from[1] + 0.05, from[2]};
            const double top = 5.1371;
            const Penetration round = part.depth({4, 1.5, 0}, top, from, to, 0),
                              sharp = part.cylinder(top, from, to, 4, 0);
            EXPECT_LE(round.found ? round.depth : 0, (sharp.found ? sharp.depth : 0) + 1e-6)
                << "solid " << solid << " motion " << i;
            deep += static_cast<int>(round.found);
        }
    }
    EXPECT_GT(deep, 200);
}

}  // namespace
}  // namespace slabwright
