// What finishing must not leave where one layer meets the next and at the foot of low walls, wherever these
// fall between its levels and the lines of its rasters: judged by the simulation of the emitted text.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <vector>

#include "engine/planner/planner.h"
#include "io/slabwright.h"
#include "io/verify.h"
#include "io/write/stl_writer.h"
#include "tests/data/sweep.h"
#include "tests/support/height_field.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

constexpr double kDraft = 2, kChord = 0.01;

Outline square(double half, double radius, double shift_y = 0) {
    const std::vector<Corner> corners{{-half, -half + shift_y, radius},
                                      {half, -half + shift_y, radius},
                                      {half, half + shift_y, radius},
                                      {-half, half + shift_y, radius}};
    return rounded_polygon(corners, kChord);
}

// The findings of each layer of this solid's plan.
std::vector<LayerFindings> findings_of(const std::vector<Facet>& facets, const Job& job) {
    Context context;
    const support::TemporaryFolder folder;
    const std::string stl = folder / "part.stl";
    std::ofstream(stl, std::ios::binary) << stl_bytes("part", facets);
    write(context, plan(context, stl, job), folder / "out");
    return verify_folder(context, folder / "out", {.source = stl, .write = false}).report.layers;
}

// A block with drafted sides, one layer on another: the lowest level of the upper one must touch the wall
// where it meets the lower. Its levels are counted from the top, so that another height puts the lowest at
// another distance from the joint.
TEST(Seams, DraftedWallsAreCutDownToTheJoint) {
    for (const double height : {28.0, 28.3, 28.6, 28.9}) {
        std::vector<Facet> facets;
        const Outline outline = square(20, 4);
        const Profile wall = drafted_wall(0, height, kDraft, 0, 0, kChord);
        flat(facets, ring(outline, wall.front()), {}, false);
        flat(facets, sweep(facets, outline, wall), {}, true);
        const std::vector<LayerFindings> layers = findings_of(facets, Job{});
        ASSERT_EQ(layers.size(), 2U);
        for (const LayerFindings& layer : layers)
            EXPECT_EQ(layer.missed, 0U) << height << " mm high, " << layer.missed_left.size << " mm missed";
    }
}

// A low land on a plate, its foot a small hollow: neither a ball on the plate nor the flat end mill that
// makes the plate touches its sides, which are left to the rest pass, whose lines are a millimetre apart, so
// the sides are moved past them.
TEST(Seams, LowWallsAreCutWhereverTheyStand) {
    for (const double shift : {0.0, 0.3, 0.55, 0.8}) {
        std::vector<Facet> facets;
        const Outline plate = square(40, 4), land = square(20, 4, shift);
        const Profile side{{0, 0}, {0, 10}}, wall = drafted_wall(10, 11.3, kDraft, 0.25, 0, kChord);
        flat(facets, ring(plate, side.front()), {}, false);
        flat(facets, sweep(facets, plate, side), {ring(land, wall.front())}, true);
        flat(facets, sweep(facets, land, wall), {}, true);
        const std::vector<LayerFindings> layers = findings_of(facets, Job{});
        ASSERT_EQ(layers.size(), 1U);
        EXPECT_EQ(layers[0].missed, 0U)
            << "moved by " << shift << " mm, " << layers[0].missed_left.size << " mm missed";
    }
}

// A boss on gently sloping ground: lines of the raster that come to its walls end there and begin anew behind
// it.
TEST(Seams, ARastersLinesEndAtABoss) {
    Context context;
    const support::TemporaryFolder folder;
    const std::string stl = folder / "part.stl";
    write_stl(stl, test::height_field(context, 32, 1.5, [](double x, double y) {
                  return std::max(std::abs(x), std::abs(y)) < 8 ? 16 : 7 + 0.1 * x + 0.05 * y;
              }));
    const Plan made = plan(context, stl, Job{});
    double raster = 0;
    for (const Layer& layer : made.layers)
        for (const Operation& op : layer.operations)
            if (op.purpose == "projected raster") raster += op.cutting_mm;
    EXPECT_GT(raster, 2000);
    EXPECT_LT(raster, 3000) << "even ground needs no lines in between";
    write(context, made, folder / "out");
    const Verification found =
        verify_folder(context, folder / "out", {.source = stl, .cell = 0.5, .write = false});
    EXPECT_TRUE(found.report.violations.empty()) << found.report.violations[0].message;
}

}  // namespace
}  // namespace slabwright
