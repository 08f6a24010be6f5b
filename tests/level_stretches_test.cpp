// Level contours over slopes about as steep as where they begin: they stay on the wall where it is a little
// flatter for a while, and leave stretches to the projected paths that these make as well.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "engine/paths/paths.h"
#include "engine/tool_choice/select.h"
#include "tests/support/end_mill_job.h"
#include "tests/support/height_field.h"

namespace slabwright {
namespace {

constexpr double kTop = 12, kFloor = 2, kHigh = 8, kDegree = std::numbers::pi / 180;  // mm

// A ridge along x, whose slopes are steeper and flatter in turns, every 20 mm, and its ends flat.
struct Ridge {
    Ridge(double flatter_deg, double steeper_deg)
        : mesh(test::height_field(context, 120, 0.5, [&](double x, double y) {
              const double share = 0.5 + 0.5 * std::sin(2 * std::numbers::pi * x / 20),
                           slope = std::tan((flatter_deg + share * (steeper_deg - flatter_deg)) * kDegree);
              return kFloor + std::max(0.0, std::min(kHigh - std::abs(y) * slope, (28 - std::abs(x)) * 0.5));
          })) {
        layer.mesh = mesh.view();
        layer.job = &job;
        layer.z_top = layer.slab_thickness = kTop;
        layer.stock_min = {-30, -30};
        layer.stock_max = {30, 30};
        layer.tools = fixed_tools(job);
        layer.flats = {{kFloor, kFloor}};
        result = plan_layer_paths(context, layer);
    }
    // How often the cutter of an operation comes down by feed.
    [[nodiscard]] int entries(const std::string& purpose) const {
        int count = 0;
        for (const Operation& op : result.operations) {
            if (op.purpose != purpose) continue;
            for (std::size_t k = 1; k < op.moves.size(); ++k)
                count += op.moves[k].feed != 0 && op.moves[k - 1].feed == 0;
        }
        return count;
    }

    Context context;
    Job job = test::end_mill_job();
    Mesh mesh;
    LayerJob layer;
    LayerResult result;
};

TEST(LevelStretches, AreNotLeftForAFewMillimetresOfFlatterSlope) {
    const Ridge even(52, 52), uneven(41, 47);
    EXPECT_GT(even.entries("level contours"), 0);
    EXPECT_LE(uneven.entries("level contours"), 6);
    EXPECT_LT(uneven.result.left_mm2, 1);
}

TEST(LevelStretches, AreLeftToProjectionWhereItMakesThem) {
    const Ridge some(42.8, 44), more(42.8, 46);
    EXPECT_EQ(some.entries("level contours"), 0);
    EXPECT_GT(more.entries("level contours"), 0);
    EXPECT_LT(some.result.left_mm2, 1);
    EXPECT_LT(more.result.left_mm2, 1);
}

}  // namespace
}  // namespace slabwright
