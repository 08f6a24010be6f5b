// Nearest points of segments and triangles by what makes a point the nearest one; windings and heights of
// facets over a lattice, where lines run through edges and corners.
#include "kernels/geometry/triangle.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/support/seed.h"

using namespace slabwright;

namespace {

double norm(const Point3& v) { return std::sqrt(dot(v, v)); }

double twice_area(const Point3& a, const Point3& b, const Point3& c) {
    return norm(cross(minus(b, a), minus(c, a)));
}

/// Whether q is the point of a triangle that is nearest to p: it lies in it, and no corner lies beyond the
/// plane through q that is square to the way to p.
void expect_nearest(const Point3& p, const Triangle& t, const Point3& q) {
    const double size = norm(minus(t[1], t[0])) + norm(minus(t[2], t[0])) + norm(minus(p, t[0])) + 1e-3;
    for (const Point3& corner : t) EXPECT_LE(dot(minus(p, q), minus(corner, q)), 1e-9 * size * size);
    double off_edges = 1e300;
    for (std::size_t i = 0; i < 3; ++i) {
        const Point3 &a = t[i], &b = t[(i + 1) % 3];
        off_edges = std::min(off_edges, norm(minus(q, a)) + norm(minus(q, b)) - norm(minus(b, a)));
    }
    const double beyond = twice_area(q, t[0], t[1]) + twice_area(q, t[1], t[2]) + twice_area(q, t[2], t[0]) -
                          twice_area(t[0], t[1], t[2]);
    EXPECT_TRUE(off_edges < 1e-9 * size || (beyond < 1e-9 * size * size && twice_area(t[0], t[1], t[2]) > 0))
        << off_edges << ' ' << beyond;
}

/// Corners on a lattice: many triangles are slivers, lines or points, many are upright or level.
class Lattice {
public:
    explicit Lattice(std::mt19937& random) : random_(random) {}
    Point3 point() {
        std::uniform_int_distribution at(0, 4);
        return {static_cast<double>(at(random_)), static_cast<double>(at(random_)),
                static_cast<double>(at(random_))};
    }
    Triangle triangle() { return {point(), point(), point()}; }
    Vec3f corner() {
        const Point3 p = point();
        return {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])};
    }

private:
    std::mt19937& random_;
};

}  // namespace

TEST(Triangle, NearestPoints) {
    std::mt19937 random(test::seed());
    Lattice lattice(random);
    std::uniform_real_distribution<double> u(-3, 7), hair(-1e-4, 1e-4);
    for (int trial = 0; trial < 20000; ++trial) {
        Triangle t = lattice.triangle();
        if (trial % 3 == 0)
            for (Point3& corner : t)
                for (double& x : corner) x += trial % 2 == 0 ? hair(random) : u(random);
        const Point3 p = trial % 4 == 0 ? lattice.point() : Point3{u(random), u(random), u(random)};
        const Point3 nearest = closest_on_triangle(p, t);
        expect_nearest(p, t, nearest);
        Point3 other{};
        const double square = squared_distance(p, t, other);
        expect_nearest(p, t, other);
        EXPECT_NEAR(square, dot(minus(p, other), minus(p, other)), 1e-12);
        EXPECT_NEAR(std::sqrt(square), norm(minus(p, nearest)), 1e-6);
        const Point3 on_edge = closest_on_segment(p, t[0], t[1]);
        expect_nearest(p, {t[0], t[1], t[1]}, on_edge);
        if (HasFailure()) FAIL() << "trial " << trial;
    }
}

// Over a tetrahedron the windings cancel out wherever one looks, on its edges and corners too; within a facet
// it is the facet's own, beside it there is none.
TEST(Triangle, WindingsOfAClosedMeshCancelOut) {
    std::mt19937 random(test::seed());
    Lattice lattice(random);
    int on_border = 0;
    for (int trial = 0; trial < 3000; ++trial) {
        const std::array<Vec3f, 4> c{lattice.corner(), lattice.corner(), lattice.corner(), lattice.corner()};
        const std::array<std::array<Vec3f, 3>, 4> facets{
            {{c[0], c[2], c[1]}, {c[0], c[1], c[3]}, {c[1], c[2], c[3]}, {c[2], c[0], c[3]}}};
        for (double x = -0.5; x <= 4.5; x += 0.5)
            for (double y = -0.5; y <= 4.5; y += 0.5) {
                int sum = 0;
                for (const std::array<Vec3f, 3>& f : facets) {
                    const int winding = facet_winding(f, x, y);
                    sum += winding;
                    int left = 0, right = 0;
                    for (std::size_t i = 0; i < 3; ++i) {
                        const Vec3f &a = f[i], &b = f[(i + 1) % 3];
                        const double side = (double{b.x} - a.x) * (y - a.y) - (double{b.y} - a.y) * (x - a.x);
                        left += side > 0, right += side < 0;
                    }
                    const bool inside = left == 3 || right == 3;
                    if (inside || (left > 0 && right > 0)) {
                        EXPECT_EQ(winding, left == 3 ? 1 : right == 3 ? -1 : 0);
                    } else {
                        ++on_border;
                    }
                }
                ASSERT_EQ(sum, 0) << "trial " << trial << " at " << x << ' ' << y;
            }
    }
    EXPECT_GT(on_border, 1000);
}

TEST(Triangle, HeightsAreThePlanesWithinTheFacet) {
    std::mt19937 random(test::seed());
    Lattice lattice(random);
    std::uniform_real_distribution<double> u(0, 1), far(-9, 12);
    for (int trial = 0; trial < 5000; ++trial) {
        const std::array<Vec3f, 3> f{lattice.corner(), lattice.corner(), lattice.corner()};
        const auto [low, high] = std::minmax({f[0].z, f[1].z, f[2].z});
        const double beside = facet_height(f, far(random), far(random));
        EXPECT_GE(beside, low);
        EXPECT_LE(beside, high);
        const double area = (double{f[1].x} - f[0].x) * (double{f[2].y} - f[0].y) -
                            (double{f[1].y} - f[0].y) * (double{f[2].x} - f[0].x);
        double a = u(random), b = u(random);
        if (a + b > 1) a = 1 - a, b = 1 - b;
        const double c = 1 - a - b;
        const double x = a * f[0].x + b * f[1].x + c * f[2].x, y = a * f[0].y + b * f[1].y + c * f[2].y;
        const double expected = area == 0 ? high : a * f[0].z + b * f[1].z + c * f[2].z;
        EXPECT_NEAR(facet_height(f, x, y), expected, 1e-9);
    }
}
