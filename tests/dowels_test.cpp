// Dowels in the joints between layers: where they are placed, against brute force, and what makes their
// holes.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "engine/paths/operations/dowel_holes.h"
#include "engine/schedule/dowels.h"
#include "io/read/job_toml.h"
#include "kernels/errors.h"
#include "kernels/mesh/weld.h"
#include "tests/mesh_shapes.h"
#include "tests/support/seed.h"

namespace slabwright {
namespace {

struct Box {
    std::array<double, 3> low{}, high{};
};

double apart(const JointDowel& a, const JointDowel& b) { return std::hypot(a.x - b.x, a.y - b.y); }

// A block with hollows, no two of which touch: flat ones that sections may miss, tall ones that reach through
// joints.
struct Hollowed {
    Box block;
    std::vector<Box> hollows;

    [[nodiscard]] Mesh mesh(Context& context) const {
        const auto facets = [](const Box& b) {
            const auto corner = [](const std::array<double, 3>& p) {
                return Vec3f{static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])};
            };
            return shapes::box(corner(b.low), corner(b.high));
        };
        shapes::Facets all = facets(block);
        for (const Box& hollow : hollows) shapes::append(all, shapes::flipped(facets(hollow)));
        return weld(context, all);
    }

    // How far an upright line is from the nearest surface between two heights, mm; negative outside.
    [[nodiscard]] double room(double x, double y, double low, double high) const {
        double least = std::min({x - block.low[0], block.high[0] - x, y - block.low[1], block.high[1] - y});
        if (low < block.low[2] || high > block.high[2]) return -1;
        for (const Box& h : hollows) {
            if (h.high[2] < low || h.low[2] > high) continue;
            const double dx = std::max({h.low[0] - x, 0.0, x - h.high[0]}),
                         dy = std::max({h.low[1] - y, 0.0, y - h.high[1]});
            least = std::min(least, std::hypot(dx, dy));
        }
        return least;
    }
};

Hollowed random_block(std::mt19937& random) {
    const auto between = [&](double low, double high) {
        return std::uniform_real_distribution(low, high)(random);
    };
    Hollowed part;
    part.block = {{0, 0, 0}, {between(100, 240), between(80, 160), 80}};
    for (int i = 0; i < 40 && part.hollows.size() < 8; ++i) {
        Box h;
        for (std::size_t k = 0; k < 3; ++k) {
            const double size = k == 2 && i % 2 == 0 ? between(0.2, 1.5) : between(3, 30);
            h.low[k] = between(part.block.low[k] + 1, part.block.high[k] - size - 1);
            h.high[k] = h.low[k] + size;
        }
        const bool is_free = std::none_of(part.hollows.begin(), part.hollows.end(), [&](const Box& o) {
            for (std::size_t k = 0; k < 3; ++k)
                if (h.high[k] + 0.5 < o.low[k] || o.high[k] + 0.5 < h.low[k]) return false;
            return true;
        });
        if (is_free) part.hollows.push_back(h);
    }
    return part;
}

Plan plan_of(const Hollowed& part, const std::vector<double>& tops, const JointDowels& rules) {
    Plan plan;
    plan.job.dowels = rules;
    plan.stock_min = {part.block.low[0] - 20, part.block.low[1] - 20};
    plan.stock_max = {part.block.high[0] + 20, part.block.high[1] + 20};
    double bottom = 0;
    for (const double top : tops) {
        Layer& layer = plan.layers.emplace_back();
        layer.index = static_cast<int>(plan.layers.size());
        layer.z_bottom = bottom;
        layer.z_top = bottom = top;
        layer.slab_thickness = top - layer.z_bottom + 0.5;
    }
    return plan;
}

std::vector<std::string> codes_of(const Plan& plan) {
    std::vector<std::string> codes;
    for (const Diagnostic& d : plan.diagnostics) codes.push_back(d.code);
    return codes;
}

TEST(Dowels, EveryOneStandsInWoodOnBothSidesOfItsJoint) {
    Context context;
    std::mt19937 random(test::seed());
    std::size_t placed = 0, apart_as_can_be = 0;
    for (int round = 0; round < 60; ++round) {
        const Hollowed part = random_block(random);
        JointDowels rules;
        rules.per_joint = 2 + round % 3;
        rules.diameter = 6 + round % 4;
        rules.clearance = 3 + round % 9;
        rules.depth = 8 + round % 13;
        Plan plan = plan_of(part, {16, 34, 45, 62, 80}, rules);
        place_dowels(context, part.mesh(context).view(), plan);
        const double reach = rules.diameter / 2 + rules.clearance;
        ASSERT_TRUE(plan.layers.back().dowels.empty());
        for (std::size_t i = 0; i + 1 < plan.layers.size(); ++i) {
            const Layer &lower = plan.layers[i], &upper = plan.layers[i + 1];
            const double z = lower.z_top;
            for (const JointDowel& d : lower.dowels) {
                ++placed;
                EXPECT_EQ(d.diameter, rules.diameter);
                EXPECT_LE(d.below, std::min(rules.depth, z - lower.z_bottom - kLeastWoodAtDowel));
                EXPECT_LE(d.above, std::min(rules.depth, upper.z_top - z - kLeastWoodAtDowel));
                EXPECT_GE(std::min(d.below, d.above), rules.diameter / 2);
                // Points all over the hole and the wood around it.
                EXPECT_GE(part.room(d.x, d.y, z - d.below, z + d.above), reach);
            }
            // Of all places of a fine grid no two are farther apart than the first two may be.
            double longest = 0, best = 0;
            for (const JointDowel& a : lower.dowels)
                for (const JointDowel& b : lower.dowels) longest = std::max(longest, apart(a, b));
            if (lower.dowels.empty() || rules.per_joint == 2 || i > 0) continue;
            const auto [low, high] = wood_around(lower.dowels[0], z);
            std::vector<JointDowel> grid;
            for (double x = 0; x < part.block.high[0]; x += 3)
                for (double y = 0; y < part.block.high[1]; y += 3)
                    if (part.room(x, y, low, high) >= reach) grid.push_back({x, y, 0, 0, 0});
            for (const JointDowel& a : grid)
                for (const JointDowel& b : grid) best = std::max(best, apart(a, b));
            EXPECT_GE(longest, 0.97 * best);
            ++apart_as_can_be;
        }
    }
    EXPECT_GT(placed, 200u);
    EXPECT_GT(apart_as_can_be, 20u);
}

TEST(Dowels, HolesFromBothSidesOfASlabDoNotMeet) {
    Context context;
    std::mt19937 random(test::seed());
    int side_by_side = 0;
    for (int round = 0; round < 20; ++round) {
        const Hollowed part = random_block(random);
        Plan plan = plan_of(part, {18, 36, 54, 80}, {.per_joint = 3, .clearance = 4});
        place_dowels(context, part.mesh(context).view(), plan);
        for (std::size_t i = 1; i < plan.layers.size(); ++i) {
            const Layer& layer = plan.layers[i];
            for (const JointDowel& under : plan.layers[i - 1].dowels)
                for (const JointDowel& over : layer.dowels) {
                    const double between = layer.z_top - layer.z_bottom - under.above - over.below;
                    if (between >= kLeastWoodAtDowel) continue;
                    ++side_by_side;
                    EXPECT_GE(apart(under, over), 8 + kLeastWoodAtDowel);
                }
        }
    }
    EXPECT_GT(side_by_side, 20);
}

TEST(Dowels, ASlabDoesNotFitTurned) {
    const Blank slab{{0, 0}, {200, 100}}, square{{0, 0}, {100, 100}};
    const auto at = [](double x, double y) { return JointDowel{x, y, 8, 10, 10}; };
    EXPECT_TRUE(fits_turned(std::vector{at(20, 50), at(180, 50)}, slab));
    EXPECT_TRUE(fits_turned(std::vector{at(20, 50), at(170, 50)}, slab));  // within two diameters
    EXPECT_FALSE(fits_turned(std::vector{at(20, 50), at(160, 50)}, slab));
    EXPECT_TRUE(fits_turned(std::vector{at(20, 20), at(180, 20), at(20, 80), at(180, 80)}, slab));
    EXPECT_FALSE(fits_turned(std::vector{at(20, 20), at(180, 20), at(20, 80)}, slab));
    // By a quarter, where that can be laid.
    const std::vector<JointDowel> four{at(20, 20), at(80, 20), at(20, 80), at(80, 80)};
    EXPECT_TRUE(fits_turned(four, square));
    EXPECT_FALSE(fits_turned(std::vector{at(50, 20), at(80, 50), at(50, 80)}, square));
    // Of two, three and four alike on blocks that are the same all around.
    Context context;
    for (int n = 2; n <= 4; ++n) {
        const Hollowed part{{{0, 0, 0}, {160, 120, 40}}, {}};
        Plan plan = plan_of(part, {20, 40}, {.per_joint = n});
        place_dowels(context, part.mesh(context).view(), plan);
        const std::vector<JointDowel>& dowels = plan.layers[0].dowels;
        EXPECT_EQ(dowels.size(), static_cast<std::size_t>(n));
        EXPECT_FALSE(fits_turned(dowels, slab_of(plan, plan.layers[1])));
        EXPECT_TRUE(plan.diagnostics.empty());
    }
}

TEST(Dowels, AJointWithoutAPlaceIsToldOrRefused) {
    Context context;
    const Hollowed thin{{{0, 0, 0}, {160, 25, 60}}, {}}, small{{{0, 0, 0}, {35, 35, 60}}, {}};
    const auto planned = [&](const Hollowed& part, const std::vector<double>& tops, JointDowels rules) {
        Plan plan = plan_of(part, tops, rules);
        place_dowels(context, part.mesh(context).view(), plan);
        return plan;
    };
    using Codes = std::vector<std::string>;
    EXPECT_EQ(codes_of(planned(thin, {30, 60}, {.per_joint = 2})), Codes{"dowel.none"});
    EXPECT_EQ(codes_of(planned(thin, {30, 60}, {.per_joint = 2, .clearance = 8})), Codes{});
    EXPECT_EQ(codes_of(planned(small, {30, 60}, {.per_joint = 2})), Codes{"dowel.few"});
    // Of two dowels one has room, about which the slab turns; of four two have, which hold it.
    const auto says = [&](const Hollowed& part, JointDowels rules) {
        return planned(part, {30, 60}, rules).diagnostics.at(0).message;
    };
    EXPECT_NE(says(small, {.per_joint = 2}).find("or lay the slab by its edges"), std::string::npos);
    const Hollowed wide{{{0, 0, 0}, {70, 35, 60}}, {}};
    EXPECT_NE(says(wide, {.per_joint = 4}).find("room for 2 of 4"), std::string::npos)
        << says(wide, {.per_joint = 4});
    EXPECT_EQ(says(wide, {.per_joint = 4}).find("or lay the slab by its edges"), std::string::npos);
    EXPECT_EQ(codes_of(planned(thin, {8, 60}, {.per_joint = 2, .clearance = 8})), Codes{"dowel.none"});
    EXPECT_EQ(codes_of(planned(thin, {8, 60}, {.clearance = 8})), Codes{});
    try {
        (void)planned(thin, {30, 60}, {.per_joint = 2, .required = true});
        ADD_FAILURE() << "placed";
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), "dowel.none");
        EXPECT_EQ(error.kind(), ErrorKind::no_plan);
        EXPECT_FALSE(error.remedy().empty());
        EXPECT_NE(error.place().find("30.00"), std::string::npos);
    }
}

TEST(Dowels, ArePlacedAlikeOnAnyNumberOfThreads) {
    std::mt19937 random(test::seed());
    for (int round = 0; round < 5; ++round) {
        const Hollowed part = random_block(random);
        std::vector<Plan> plans;
        for (const int threads : {1, 2, 5}) {
            Context context({.threads = threads});
            plans.push_back(plan_of(part, {16, 34, 45, 62, 80}, {.per_joint = 3, .clearance = 4}));
            place_dowels(context, part.mesh(context).view(), plans.back());
        }
        for (std::size_t i = 0; i < plans[0].layers.size(); ++i)
            for (const Plan& other : plans) EXPECT_EQ(plans[0].layers[i].dowels, other.layers[i].dowels);
    }
}

TEST(Dowels, AFacetsDistanceIsThatOfWhatLiesBetweenTheHeights) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> any(-10, 10);
    for (int round = 0; round < 2000; ++round) {
        std::array<std::array<double, 3>, 3> facet;
        for (auto& corner : facet) corner = {any(random), any(random), any(random)};
        const double a = any(random), b = any(random), x = any(random), y = any(random);
        const std::array<double, 2> heights{std::min(a, b), std::max(a, b)};
        double sampled = INFINITY;
        constexpr int kSteps = 120;
        for (int i = 0; i <= kSteps; ++i)
            for (int k = 0; i + k <= kSteps; ++k) {
                std::array<double, 3> p{};
                for (std::size_t c = 0; c < 3; ++c)
                    p[c] =
                        (facet[0][c] * i + facet[1][c] * k + facet[2][c] * (kSteps - i - k)) / double{kSteps};
                if (p[2] >= heights[0] && p[2] <= heights[1])
                    sampled = std::min(sampled, std::hypot(p[0] - x, p[1] - y));
            }
        const double found = plan_distance(facet, heights, x, y);
        EXPECT_LE(found, sampled + 1e-9);
        if (std::isfinite(sampled) && heights[1] - heights[0] > 1) {
            EXPECT_GE(found, sampled - 0.6);
        }
    }
}

TEST(Dowels, ADrillIsTakenOrTheWidestMillThatBores) {
    Job job;
    job.dowels.diameter = 8;
    const auto remedy = [&](double depth) -> std::string {
        try {
            (void)dowel_tool(job, depth);
        } catch (const Error& error) {
            return error.remedy();
        }
        return "none";
    };
    // 12.7 mm is too wide, but not for the dowels of 18 mm that shops keep; nothing is 40 mm long.
    EXPECT_NE(remedy(10).find("; or take dowels.diameter = 18, whose holes T2 makes"), std::string::npos)
        << remedy(10);
    EXPECT_NE(remedy(40).find("narrower by more than its core_diameter"), std::string::npos);
    EXPECT_EQ(remedy(40).find("or take"), std::string::npos) << remedy(40);
    const auto add = [&](int number, ToolKind kind, double diameter, double flutes) {
        Tool tool = job.tools[1];
        tool.number = number;
        tool.kind = kind;
        tool.diameter = tool.shank_diameter = diameter;
        tool.flute_length = flutes;
        job.tools.push_back(tool);
    };
    add(4, ToolKind::flat, 3.9, 30);
    add(5, ToolKind::flat, 7, 30);  // its core would leave a post
    EXPECT_THROW((void)dowel_tool(job, 10), Error);
    add(6, ToolKind::flat, 4, 30);
    add(7, ToolKind::flat, 6, 30);
    EXPECT_EQ(dowel_tool(job, 10).number, 7);
    EXPECT_THROW((void)dowel_tool(job, 31), Error);
    add(8, ToolKind::drill, 8, 12);
    EXPECT_EQ(dowel_tool(job, 10).number, 7);  // its point needs more than its flutes
    add(9, ToolKind::drill, 8, 30);
    EXPECT_EQ(dowel_tool(job, 10).number, 9);
}

TEST(Dowels, KeysAreReadAndChecked) {
    const Job job = parse_job("[dowels]\nper_joint = 3\ndiameter = 6\ndepth = 12.5\nrequired = true\n", "x");
    EXPECT_EQ(job.dowels.per_joint, 3);
    EXPECT_EQ(job.dowels.depth, 12.5);
    EXPECT_TRUE(job.dowels.required);
    EXPECT_EQ(parse_job("", "x").dowels.per_joint, 0);
    for (const char* bad :
         {"per_joint = -1", "per_joint = 1", "per_joint = 13", "diameter = 0", "depth = 3", "clearance = 0"})
        EXPECT_THROW((void)parse_job(fmt::format("[dowels]\n{}\n", bad), "x"), Error) << bad;
}

}  // namespace
}  // namespace slabwright
