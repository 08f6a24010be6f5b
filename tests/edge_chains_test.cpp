// Sharp edges of solids whose edges are known.
#include "kernels/features/edge_chains.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>

#include "io/write/edges_json.h"
#include "kernels/errors.h"
#include "kernels/mesh/weld.h"
#include "tests/mesh_shapes.h"
#include "tests/support/drilled_plate.h"
#include "tests/support/seed.h"

namespace slabwright {
namespace {

using test::LoopAxis;
constexpr double kPi = std::numbers::pi;

double sum(const std::vector<EdgeChain>& chains, bool convex) {
    double mm = 0;
    for (const EdgeChain& c : chains)
        if (c.convex == convex) mm += c.length_mm;
    return mm;
}

TEST(EdgeChains, ABoxHasTwelve) {
    Context context;
    const Mesh box = weld(context, shapes::box({0, 0, 0}, {30, 20, 10}));
    const auto chains = find_edge_chains(context, box.view());
    ASSERT_EQ(chains.size(), 12U);
    for (const EdgeChain& c : chains) {
        EXPECT_TRUE(c.convex);
        EXPECT_FALSE(c.closed) << "three meet at each corner";
        EXPECT_EQ(c.vertices.size(), 2U);
        EXPECT_NEAR(c.sharpest_deg, 90, 1e-9);
    }
    EXPECT_NEAR(sum(chains, true), 240, 1e-9);
    EXPECT_EQ(chains.front().length_mm, 30);
}

TEST(EdgeChains, ABlindHoleHasARimAndAFoot) {
    Context context;
    test::DrilledPlate plate(40, 20);
    const LoopAxis axis{{20, 20, 0}};
    std::mt19937 random(1);
    const std::vector<double> angles = test::turn(48, 0.2, 0, random);
    const Vec3d apex{20, 20, 6};
    plate.cell(40, axis, {axis.ring(angles, 8, 20), axis.ring(angles, 8, 6)}, &apex);
    const Mesh mesh = weld(context, test::rounded(plate.closed()));
    const auto chains = find_edge_chains(context, mesh.view());
    ASSERT_EQ(chains.size(), 14U);
    const double around = 48 * 2 * 8 * std::sin(kPi / 48);
    std::vector<EdgeChain> closed;
    std::copy_if(chains.begin(), chains.end(), std::back_inserter(closed),
                 [](const EdgeChain& c) { return c.closed; });
    ASSERT_EQ(closed.size(), 2U);
    EXPECT_NE(closed[0].convex, closed[1].convex);
    for (const EdgeChain& c : closed) {
        EXPECT_EQ(c.vertices.size(), 48U);
        EXPECT_NEAR(c.length_mm, around, 1e-3);
        EXPECT_NEAR(c.at[2], c.convex ? 20 : 6, 1e-6);
        // One edge after another, all of one length.
        for (std::size_t i = 0; i < c.vertices.size(); ++i) {
            const Vec3f &a = mesh.vertices[c.vertices[i]], &b = mesh.vertices[c.vertices[(i + 1) % 48]];
            EXPECT_NEAR(length(minus(to_double(a), to_double(b))), around / 48, 1e-4);
        }
    }
    // The wall's chords turn by 7.5°: with them three meet at each corner of rim and foot.
    EXPECT_EQ(find_edge_chains(context, mesh.view(), 7).size(), 12U + 3 * 48U);
    EXPECT_EQ(find_edge_chains(context, mesh.view(), 91).size(), 0U);
}

TEST(EdgeChains, ASumCountsTheClosedOnesOfItsKind) {
    std::mt19937 random(test::seed());
    for (int round = 0; round < 40; ++round) {
        std::vector<EdgeChain> chains(random() % 6);
        std::array<std::size_t, 2> all{}, closed{};
        std::array<double, 2> mm{};
        for (EdgeChain& c : chains) {
            c.convex = random() % 2 == 0;
            c.closed = random() % 2 == 0;
            c.vertices = {0, 1, 2};
            c.length_mm = static_cast<double>(1 + random() % 100);
            const std::size_t kind = c.convex ? 1 : 0;
            ++all[kind], closed[kind] += c.closed ? 1 : 0, mm[kind] += c.length_mm;
        }
        JsonText text;
        put_edges(text, chains, 30);
        const nlohmann::json told = nlohmann::json::parse(text.take());
        for (const std::size_t kind : {0U, 1U}) {
            const nlohmann::json& sum = told.at(kind == 1 ? "convex" : "concave");
            EXPECT_EQ(sum.at("chains"), all[kind]);
            EXPECT_EQ(sum.at("closed"), closed[kind]);
            EXPECT_EQ(sum.at("length"), mm[kind]);
        }
    }
}

TEST(EdgeChains, AChainEndsWhereTheKindChanges) {
    // A ridge that goes over into a valley: z = ±|y|, up to x = 10 the one and from there the other.
    Context context;
    std::vector<std::array<Vec3f, 3>> facets;
    const auto strip = [&](float x0, float x1, float z0, float z1) {
        const Vec3f ridge0{x0, 0, 0}, ridge1{x1, 0, 0}, left0{x0, 5, z0}, left1{x1, 5, z1},
            right0{x0, -5, z0}, right1{x1, -5, z1};
        facets.push_back({ridge0, ridge1, left1});
        facets.push_back({ridge0, left1, left0});
        facets.push_back({ridge0, right0, right1});
        facets.push_back({ridge0, right1, ridge1});
    };
    strip(0, 10, -5, -5);
    strip(10, 20, 5, 5);
    const Mesh mesh = weld(context, facets);
    const auto chains = find_edge_chains(context, mesh.view(), 30);
    ASSERT_EQ(chains.size(), 2U);
    EXPECT_NEAR(sum(chains, true), 10, 1e-9);
    EXPECT_NEAR(sum(chains, false), 10, 1e-9);
}

TEST(EdgeChains, TheyDoNotDependOnThreads) {
    const auto of = [](int threads) {
        Context context({.threads = threads});
        const Mesh torus = weld(context, shapes::torus(40, 30, 10));
        return find_edge_chains(context, torus.view(), 5);
    };
    const auto one = of(1), four = of(4);
    ASSERT_EQ(one.size(), four.size());
    ASSERT_FALSE(one.empty());
    for (std::size_t i = 0; i < one.size(); ++i) EXPECT_EQ(one[i].vertices, four[i].vertices);
}

TEST(EdgeChains, LimitsOutOfRangeAreRefused) {
    Context context;
    const Mesh box = weld(context, shapes::box({0, 0, 0}, {30, 20, 10}));
    EXPECT_THROW((void)find_edge_chains(context, box.view(), 0), Error);
    EXPECT_THROW((void)find_edge_chains(context, box.view(), 180), Error);
    EXPECT_TRUE(find_edge_chains(context, {}, 30).empty());
}

}  // namespace
}  // namespace slabwright
