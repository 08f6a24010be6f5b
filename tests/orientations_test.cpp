// Laying a pattern on its best side.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "engine/planner/orientations.h"
#include "engine/prepare/preparation.h"
#include "io/orient.h"
#include "io/slabwright.h"
#include "io/write/stl_writer.h"
#include "kernels/errors.h"
#include "kernels/mesh/weld.h"
#include "tests/mesh_shapes.h"
#include "tests/support/seed.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

shapes::Facets turned_facets(shapes::Facets facets, const std::array<double, 3>& degrees) {
    const AffineMap map = turned(degrees);
    for (auto& f : facets)
        for (Vec3f& p : f) {
            const Point3 q = map.of(to_double(p));
            p = {static_cast<float>(q[0]), static_cast<float>(q[1]), static_cast<float>(q[2])};
        }
    return facets;
}

/// An outline in x and z, all of which its first corner sees, counter-clockwise seen from −y, drawn out along
/// y.
void add_prism(shapes::Facets& facets, const std::vector<std::array<float, 2>>& outline, float depth) {
    const std::size_t n = outline.size();
    const auto at = [&](std::size_t k, float y) { return Vec3f{outline[k % n][0], y, outline[k % n][1]}; };
    for (std::size_t k = 0; k < n; ++k) {
        facets.push_back({at(k, 0), at(k + 1, depth), at(k + 1, 0)});
        facets.push_back({at(k, 0), at(k, depth), at(k + 1, depth)});
        if (k < 2) continue;
        facets.push_back({at(0, 0), at(k - 1, 0), at(k, 0)});
        facets.push_back({at(0, depth), at(k, depth), at(k - 1, depth)});
    }
}

/// A block 120 × 80 × 40 mm with a V groove along y, 32 mm deep: upside down the groove is air under wood.
shapes::Facets grooved() {
    shapes::Facets facets;
    add_prism(facets, {{0, 0}, {62, 0}, {62, 8}, {60, 8}, {20, 40}, {0, 40}}, 80);
    add_prism(facets, {{58, 0}, {120, 0}, {120, 40}, {100, 40}, {60, 8}, {58, 8}}, 80);
    return facets;
}

TEST(Orientations, TheTurnLaysTheSideDown) {
    std::mt19937 random(test::seed());
    std::normal_distribution<double> place;
    std::vector<Vec3d> sides{{0, 0, -1}, {0, 0, 1}, {0, 1, 0}, {0, -1, 0}, {1, 0, 0}, {-1, 0, 0}};
    for (int k = 0; k < 200; ++k) {
        const Vec3d v{place(random), place(random), place(random)};
        sides.push_back(scaled(1 / length(v), v));
    }
    for (const Vec3d& side : sides) {
        const Point3 p = turned(turn_that_lays(side)).of(side);
        EXPECT_NEAR(p[0], 0, 5e-8);
        EXPECT_NEAR(p[1], 0, 5e-8);
        EXPECT_NEAR(p[2], -1, 1e-12);
    }
}

// However a grooved block was drawn, it is laid on its back, where nothing of it stays unmade.
TEST(Orientations, FindTheBackOfABlockHoweverItLies) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> degrees(-180, 180);
    for (int k = 0; k < 6; ++k) {
        Context context;
        const std::array<double, 3> how =
            k == 0   ? std::array<double, 3>{180, 0, 0}
            : k == 1 ? std::array<double, 3>{0, 90, 0}
                     : std::array<double, 3>{degrees(random), degrees(random), degrees(random)};
        const Mesh mesh = weld(context, turned_facets(grooved(), how));
        const std::vector<Orientation> ways = orientations(context, mesh.view(), Job{});
        ASSERT_GE(ways.size(), 6U);
        const Orientation& best = ways.front();
        EXPECT_LT(best.outcome.unmade_mm3, 10);
        EXPECT_TRUE(best.outcome.has_room);
        EXPECT_NEAR(std::max(best.size[0], best.size[1]), 120, 0.01);
        EXPECT_NEAR(std::min(best.size[0], best.size[1]), 80, 0.01);
        EXPECT_NEAR(best.size[2], 40, 0.01);
        EXPECT_NEAR(best.foot_mm2, 120 * 80, 1);
        // The worst lies upside down: the whole groove is under wood, but for what joints open.
        double most = 0;
        for (const Orientation& way : ways) most = std::max(most, way.outcome.unmade_mm3);
        EXPECT_GT(most, 0.3 * 80 * 32 * 40);
    }
}

// Askew, a block takes less wood when it is turned about the upright, but as it lies stays among the ways,
// with the same unmade, before the other.
TEST(Orientations, AsItLiesIsAmongTheWays) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> degrees(10, 80);
    for (int k = 0; k < 4; ++k) {
        Context context;
        const Mesh mesh = weld(context, turned_facets(grooved(), {180, 0, degrees(random)}));
        const std::vector<Orientation> ways = orientations(context, mesh.view(), Job{});
        const auto of = [&](auto&& is) { return std::find_if(ways.begin(), ways.end(), is); };
        const auto lies = of([](const Orientation& w) { return w.turn == std::array<double, 3>{}; });
        const auto turned_about_z =
            of([](const Orientation& w) { return w.turn[0] == 0 && w.turn[1] == 0 && w.turn[2] != 0; });
        ASSERT_NE(lies, ways.end());
        ASSERT_NE(turned_about_z, ways.end());
        EXPECT_EQ(lies->outcome.unmade_mm3, turned_about_z->outcome.unmade_mm3);
        EXPECT_GT(lies->outcome.unmade_mm3, 0);
        EXPECT_LT(lies, turned_about_z);
        EXPECT_LT(turned_about_z->size[0] * turned_about_z->size[1], lies->size[0] * lies->size[1]);
    }
}

TEST(Orientations, AModelIsPlannedOnItsBestSideAndPasses) {
    Context context;
    const support::TemporaryFolder folder;
    const std::string stl = folder / "block.stl";
    write_stl(stl, weld(context, turned_facets(grooved(), {180, 0, 0})));
    const OrientModel model = orient_model(context, stl, Job{}, 2);
    ASSERT_GE(model.ways.size(), 6U);
    EXPECT_GT(model.ways[0].minutes, 0);
    EXPECT_GT(model.ways[1].minutes, 0);
    EXPECT_EQ(model.ways[2].minutes, 0);
    EXPECT_NE(orient_text(model).find("180,0,0"), std::string::npos) << orient_text(model);
    EXPECT_NE(orient_json(model).find("slabwright.orient/1"), std::string::npos);

    EXPECT_THROW((void)plan(context, stl, Job{}), Error) << "as it lies its groove stays unmade";
    Job job = oriented(Job{}, model);
    const std::shared_ptr<Pattern> pattern = read_pattern(context, stl, job);
    Plan planned = plan(context, *pattern, job);
    (void)write_proven(context, planned, folder / "out", pattern);
    const VerifyResult found = verify(context, folder / "out", stl);
    EXPECT_TRUE(found.passed);
    EXPECT_LT(found.unmade_mm3, 1);
}

TEST(Orientations, WhatTurningWouldChangeIsRefused) {
    Context context;
    const support::TemporaryFolder folder;
    const std::string stl = folder / "block.stl";
    write_stl(stl, weld(context, grooved()));
    Job turned_job, stretched;
    turned_job.prepare.turn = {0, 90, 0};
    stretched.prepare.scale = {1, 1, 2};
    for (const Job& job : {turned_job, stretched}) try {
            (void)orient_model(context, stl, job, 0);
            FAIL();
        } catch (const Error& e) {
            EXPECT_EQ(e.code(), "orient.turned");
        }
}

// What is asked for the layers of a part that lies another way is what a plan asks.
TEST(WaysOut, AskForLayersAsTheJobSays) {
    Context context;
    const Mesh mesh = weld(context, shapes::box({0, 0, 0}, {60, 40, 30}));
    Job job;
    for (const bool constrain : {false, true}) {
        job.layers.saddles_constrain = constrain;
        job.layers.min_layer = constrain ? 4 : 3;
        job.layers.alpha = constrain ? 0.25 : 0.5;
        job.slabs.facing_allowance = constrain ? 1 : 2;
        job.material.min_thickness = constrain ? 7 : 0;
        const LayerRequest request = quick_layer_request(context, mesh.view(), job);
        EXPECT_EQ(request.height, 30);
        EXPECT_EQ(request.saddles_constrain, constrain);
        EXPECT_EQ(request.min_layer, job.layers.min_layer);
        EXPECT_EQ(request.alpha, job.layers.alpha);
        EXPECT_EQ(request.facing_allowance, job.slabs.facing_allowance);
        EXPECT_NEAR(request.min_material, constrain ? 7 : 0.2 * 25.4, 1e-12);
    }
}

}  // namespace
}  // namespace slabwright
