// Distances of a level disc, with all that is above it, to facets shorter than a millimetre, against dense
// points on them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "kernels/access/piece_depth.h"
#include "tests/support/seed.h"

using namespace slabwright;

namespace {

double to_disc(const Point3& c, double disc, const Point3& p) {
    const double beside = std::max(0.0, std::hypot(p[0] - c[0], p[1] - c[1]) - disc),
                 under = std::max(0.0, c[2] - p[2]);
    return std::hypot(beside, under);
}

}  // namespace

TEST(DiscDistance, ToSmallFacetsIsThatToTheirNearestPoint) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> at(-4, 4), by(-0.5, 0.5);
    for (int round = 0; round < 400; ++round) {
        const Point3 c{at(random), at(random), at(random)};
        const double disc = 2;
        Triangle t;
        const Point3 middle{at(random), at(random), at(random)};
        for (Point3& p : t) p = {middle[0] + by(random), middle[1] + by(random), middle[2] + by(random)};
        double nearest = 1e300;
        constexpr int n = 120;
        for (int i = 0; i <= n; ++i)
            for (int j = 0; i + j <= n; ++j) {
                Point3 p{};
                for (std::size_t k = 0; k < 3; ++k)
                    p[k] = (i * t[0][k] + j * t[1][k] + (n - i - j) * t[2][k]) / n;
                nearest = std::min(nearest, to_disc(c, disc, p));
            }
        const double found = disc_piece_distance(c, c, disc, t, 1e9).d;
        ASSERT_LE(found, nearest + 1e-6) << "round " << round;
        ASSERT_GE(found, nearest - 0.01) << "round " << round;
    }
}
