// How deep points lie in tools, against the nearest of many points of the tool's core.
#include "kernels/access/place_proofs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "kernels/cutting/tool_shape.h"
#include "tests/support/seed.h"

namespace slabwright {
namespace {

/// Of a point at a distance from the axis and a height over the core's disc, how far it lies from the core's
/// flank.
double from_flank(double distance, double height, const Envelope& e) {
    double least = 1e9;
    for (int k = 0; k <= 50'000; ++k) {
        const double s = 2e-4 * k;
        least = std::min(least, std::hypot(distance - e.core - s * e.sin_taper, height - s * e.cos_taper));
    }
    return least;
}

TEST(PlaceProofs, OutsideTheCoreTheDepthIsThatUnderTheRoundingWhateverThePatch) {
    std::mt19937 random(test::seed());
    const auto within = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    int beside = 0;
    while (beside < 300) {
        const double taper = within(0, 1) < 0.3 ? 0 : within(0.02, 0.5);
        const Envelope e{within(0, 2), within(0.5, 4), within(1, 3), std::sin(taper), std::cos(taper), 60};
        // Its radius is that of the core and the rounding where the flank is upright.
        Envelope whole = e;
        if (taper == 0) whole.radius = e.core + e.rounding;
        ToolPlaces at;
        at.x = within(-50, 50), at.y = within(-50, 50), at.tip = within(-10, 10);
        at.spread = within(0, 0.3), at.lift = within(0, 6), at.tolerance = 0.01;
        const double turn = within(0, 6.3), distance = within(e.core, e.core + e.rounding),
                     height = within(-1, 8);
        const double off = (distance - e.core) * e.cos_taper - height * e.sin_taper,
                     up = (distance - e.core) * e.sin_taper + height * e.cos_taper;
        if (!(off > 0 && up > 0)) continue;
        ++beside;
        const PlaceDepth depth = depth_of({at.x + distance * std::cos(turn), at.y + distance * std::sin(turn),
                                           at.tip + e.low + e.rounding + height},
                                          at, whole);
        EXPECT_NEAR(depth.mm, e.rounding - from_flank(distance, height, e), 1.1e-4);
        EXPECT_NEAR(depth.gradient[0], e.cos_taper * std::cos(turn), 1e-9);
        EXPECT_NEAR(depth.gradient[1], e.cos_taper * std::sin(turn), 1e-9);
        EXPECT_NEAR(depth.gradient[2], -e.sin_taper, 1e-9);
    }
}

}  // namespace
}  // namespace slabwright
