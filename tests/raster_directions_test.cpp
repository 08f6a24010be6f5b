// A projected raster runs along narrow shallow bands, whatever way they lie, and makes all of them.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "engine/moves/motion_time.h"
#include "engine/paths/paths.h"
#include "engine/tool_choice/select.h"
#include "tests/support/end_mill_job.h"
#include "tests/support/height_field.h"
#include "tests/support/seed.h"

namespace slabwright {
namespace {

constexpr double kTop = 12, kFloor = 3, kHigh = 1.6, kLong = 50;  // mm

double height(double x, double y) {
    const double off = std::max(std::abs(y), std::abs(x) - kLong / 2);
    return kFloor + std::max(0.0, kHigh - off * std::tan(std::numbers::pi / 6));
}

// What is planned over a ridge of triangular section through the middle, slopes of 30°, at an angle to x.
struct Ridge {
    explicit Ridge(double angle) : mesh(test::height_field(context, 60, 1, height)) {
        for (Vec3f& v : mesh.vertices)
            v = {static_cast<float>(std::cos(angle) * v.x - std::sin(angle) * v.y),
                 static_cast<float>(std::sin(angle) * v.x + std::cos(angle) * v.y), v.z};
        layer.mesh = mesh.view();
        layer.job = &job;
        layer.z_top = layer.slab_thickness = kTop;
        layer.stock_min = {-45, -45};
        layer.stock_max = {45, 45};
        layer.tools = fixed_tools(job);
        layer.flats = {{kFloor, kFloor}};
    }
    struct Made {
        double minutes = 0, left_mm2 = 0;  // of the raster; of the layer
    };
    [[nodiscard]] Made made() {
        const LayerResult result = plan_layer_paths(context, layer);
        for (const Operation& op : result.operations)
            if (op.purpose == "projected raster")
                return {motion_time(op.moves, job.machine, op.blend).minutes, result.left_mm2};
        return {};
    }

    Context context;
    Job job = test::end_mill_job();
    Mesh mesh;
    LayerJob layer;
};

// Ridges along one of the directions that lines have, but for a degree.
TEST(RasterDirections, ARidgeTakesNotMuchLongerWhateverWayItLies) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> by(-0.02, 0.02);
    const double along_x = Ridge(by(random)).made().minutes;
    ASSERT_GT(along_x, 0);
    for (const auto& [p, q] : {std::array{2, 1}, {1, 1}, {1, 2}, {0, 1}, {-1, 2}, {-1, 1}, {-2, 1}}) {
        const double angle = std::atan2(q, p) + by(random);
        const auto [minutes, left_mm2] = Ridge(angle).made();
        EXPECT_LT(minutes, 1.6 * along_x) << angle;
        EXPECT_LT(left_mm2, 1) << angle;
    }
}

// Of any other angle lines go across a ridge no farther than they must, and miss nothing.
TEST(RasterDirections, RidgesOfAllAnglesAreMade) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> turn(0, std::numbers::pi);
    const double along_x = Ridge(0).made().minutes;
    double sum = 0;
    constexpr int trials = 12;
    for (int trial = 0; trial < trials; ++trial) {
        const double angle = turn(random);
        const auto [minutes, left_mm2] = Ridge(angle).made();
        sum += minutes;
        EXPECT_LT(left_mm2, 1) << angle;
    }
    EXPECT_LT(sum / trials, 2 * along_x) << "2.3 where all lines go along x or y";
}

}  // namespace
}  // namespace slabwright
