// What a core without edges comes down on, by hand-written programs and against small steps of a ring.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

#include "engine/simulate/core_contact.h"
#include "engine/simulate/simulate.h"
#include "tests/support/seed.h"

using namespace slabwright;

namespace {

constexpr double kTop = 20, kSide = 120, kCell = 0.5, kClear = 30;
constexpr double kDegree = std::numbers::pi / 180;

// 40 mm wide, 24 mm of it without edges; ramps of 3° leave 1.26 mm under those.
Tool face_mill() {
    Tool tool{1, ToolKind::face, "face", 40, 20, 20, 60, 60, 4, 0.0, 12000, 9000, 1000, 0.1, 4.0, 0.6};
    tool.core_diameter = 24;
    tool.ramp_deg = 3;
    return tool;
}

// A tool over a full slab of 120 × 120 × 20 mm.
struct Watched {
    Tool tool;
    Stock stock;
    CoreContact core;
    ProgramStep at;
    explicit Watched(const Tool& with)
        : tool(with), stock(grid()), core(with, grid()), at{-50, -50, kClear, 0, 0, true} {
        stock.add_slab(0, kTop);
    }
    static CellGrid grid() {
        const int cells = static_cast<int>(kSide / kCell);
        return {kCell / 2, kCell / 2, kCell, cells, cells};
    }
    // What another cutter has taken.
    Watched& hole(double x, double y, double radius, double z) {
        stock.cut({CutterEnd::Form::flat, radius, 0}, {x, y, z}, {x, y, z});
        return *this;
    }
    Watched& to(double x, double y, double z, double feed = 3000) {
        const ProgramStep next{x, y, z, feed, at.line + 1, true};
        if (core.watches() && core.concerns(stock, at, next)) core.follow(stock, at, next);
        stock.cut({CutterEnd::Form::flat, tool.diameter / 2, 0}, {at.x, at.y, at.z}, {x, y, z});
        at = next;
        return *this;
    }
    Watched& over(double x, double y) { return to(at.x, at.y, kClear, 0).to(x, y, kClear, 0); }
    // To and fro along x over (60 ± length/2, 60), down by `drop` in all; every leg falls as much.
    Watched& ramp(double length, double drop, int legs) {
        over(60 - length / 2, 60).to(60 - length / 2, 60, kTop + 0.1);
        for (int k = 1; k <= legs; ++k)
            to(60 + (k % 2 == 1 ? 1 : -1) * length / 2, 60, kTop + 0.1 - drop * k / legs);
        return *this;
    }
    // Turns around (60, 60) in chords.
    Watched& helix(double radius, double drop, int turns, int chords = 64) {
        over(60 + radius, 60).to(60 + radius, 60, kTop + 0.1);
        for (int k = 1; k <= turns * chords; ++k) {
            const double turn = 2 * std::numbers::pi * k / chords;
            to(60 + radius * std::cos(turn), 60 + radius * std::sin(turn),
               kTop + 0.1 - drop * k / (turns * chords));
        }
        return *this;
    }
    [[nodiscard]] double deepest() const { return core.findings().deepest; }
    [[nodiscard]] double area() const { return static_cast<double>(core.findings().cells) * kCell * kCell; }
};

}  // namespace

TEST(CoreContact, StraightDownIntoStock) {
    Watched watched(face_mill());
    watched.over(60, 60).to(60, 60, kTop - 3);
    EXPECT_NEAR(watched.deepest(), 3, 1e-5);
    EXPECT_NEAR(watched.area(), std::numbers::pi * 12 * 12, 10);
    EXPECT_EQ(watched.core.findings().line, 3U);
    EXPECT_NEAR(watched.core.findings().z, kTop - 3, 1e-9);
    // In many small steps it is no better.
    Watched slowly(face_mill());
    slowly.over(60, 60);
    for (double z = kTop; z > kTop - 3; z -= 0.1) slowly.to(60, 60, z);
    EXPECT_NEAR(slowly.deepest(), 2.9, 0.11);
    EXPECT_EQ(slowly.area(), watched.area());
}

TEST(CoreContact, OnlyWhatStandsUnderTheCoreCounts) {
    Watched wide(face_mill());
    wide.hole(60, 60, 12.5, 5).over(60, 60).to(60, 60, 6);
    EXPECT_EQ(wide.area(), 0) << "the ring cuts what stands around the hole";
    Watched narrow(face_mill());
    narrow.hole(60, 60, 8, 5).over(60, 60).to(60, 60, 6);
    EXPECT_NEAR(narrow.deepest(), 14, 1e-5);
    EXPECT_NEAR(narrow.area(), std::numbers::pi * (12 * 12 - 8 * 8), 10);
    Watched beside(face_mill());
    beside.over(-13, 60).to(-13, 60, 6);
    EXPECT_EQ(beside.area(), 0) << "only its rim stands over the slab";
    Watched partly(face_mill());
    partly.over(-8, 60).to(-8, 60, 6);
    EXPECT_GT(partly.area(), 40);
    EXPECT_LT(partly.area(), 120);
}

TEST(CoreContact, WhatItScrapesIsNoMatter) {
    Watched watched(face_mill());
    watched.over(60, 60).to(60, 60, kTop - 0.2);
    EXPECT_EQ(watched.area(), 0);
    watched.to(60, 60, kTop - 0.3);
    EXPECT_GT(watched.area(), 400) << "straight down on, it is one plunge";
    // A quarter of a millimetre is the most.
    Watched less(face_mill()), more(face_mill());
    less.over(60, 60).to(60, 60, kTop - 0.249);
    EXPECT_EQ(less.area(), 0);
    more.over(60, 60).to(60, 60, kTop - 0.251);
    EXPECT_GT(more.area(), 400);
}

TEST(CoreContact, ACutterThatPlungesHasNoCore) {
    Tool tool = face_mill();
    tool.core_diameter = -1;
    tool.plunges = true;
    EXPECT_FALSE(CoreContact(tool, Watched::grid()).watches());
    tool.kind = ToolKind::ball;
    EXPECT_FALSE(CoreContact(tool, Watched::grid()).watches());
    tool.plunges = false;
    EXPECT_FALSE(CoreContact(tool, Watched::grid()).watches()) << "a ball's edges meet at its tip";
    tool.kind = ToolKind::flat;
    EXPECT_TRUE(CoreContact(tool, Watched::grid()).watches()) << "most flat end mills do not cut there";
}

// The wood under the core is as high as the ramp falls while the core passes over a place.
TEST(CoreContact, ARampIsAsGoodAsTheRecess) {
    const double gentle = std::tan(3 * kDegree) * 60;
    Watched once(face_mill());
    once.ramp(60, gentle, 1);
    EXPECT_EQ(once.area(), 0) << "straight on at the steepest slope";
    Watched steep(face_mill());
    steep.ramp(60, 2 * gentle, 1);
    EXPECT_NEAR(steep.deepest(), 24 * 2 * gentle / 60, 0.05);
    EXPECT_GT(steep.area(), 500);
    Watched fine(face_mill());
    fine.ramp(60, 0.98 * 2 * gentle, 4);
    EXPECT_EQ(fine.area(), 0) << "to and fro at half the slope";
    Watched back(face_mill());
    back.ramp(60, 4 * gentle, 4);
    EXPECT_NEAR(back.deepest(), 2 * 24 * std::tan(3 * kDegree), 0.06)
        << "where it turns, a place is under the core twice";
    Watched brief(face_mill());
    brief.ramp(10, 10 * 20 * std::tan(1 * kDegree), 20);
    EXPECT_NEAR(brief.deepest(), 10 * 20 * std::tan(1 * kDegree) - 0.1, 0.05)
        << "a ramp shorter than the core leaves a post";
}

TEST(CoreContact, AHelixNarrowerThanTheCoreLeavesAPost) {
    const double fall = 2 * std::numbers::pi * 16 * std::tan(2 * kDegree);
    Watched around(face_mill());
    around.helix(16, 3 * fall, 3);
    EXPECT_EQ(around.area(), 0);
    Watched post(face_mill());
    post.helix(8, 8, 4);
    EXPECT_NEAR(post.deepest(), 7.9, 0.02);
    EXPECT_NEAR(post.area(), std::numbers::pi * 12 * 12, 500) << "the post, and what is too steep around it";
    Watched steep(face_mill());
    steep.helix(16, 3 * 2.5 * fall, 3);
    EXPECT_GT(steep.area(), 100);
    // Around a hole that is wide enough nothing is left to stand.
    Watched hole(face_mill());
    hole.hole(60, 60, 20.5, 0).helix(8, 8, 4);
    EXPECT_EQ(hole.area(), 0);
}

// The simulated stock has lost it all; the post still stands until an edge has passed.
TEST(CoreContact, WhatTheStockHasLostIsRemembered) {
    const double fall = std::tan(3 * kDegree) * 60;
    Watched watched(face_mill());
    watched.ramp(60, fall, 1);
    const double z = watched.at.z;
    watched.over(90, 60).to(90, 60, z);
    EXPECT_EQ(watched.area(), 0) << "it stood there before, as deep";
    watched.over(90, 60).to(90, 60, z - 0.1);
    EXPECT_NEAR(watched.deepest(), 24 * std::tan(3 * kDegree) + 0.1, 0.05)
        << "straight down on what the ramp left";
    Watched cleared(face_mill());
    cleared.ramp(60, fall, 1).to(30, 60, z).over(90, 60).to(90, 60, z - 0.1);
    EXPECT_EQ(cleared.area(), 0) << "cleared on the way back";
}

// Random motions against a ring in steps of a tenth of a millimetre. A core that is a little narrower meets
// less than the closed form says, one a little wider more.
TEST(CoreContact, AgreesWithARingInSmallSteps) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> unit(0, 1);
    for (int round = 0; round < 12; ++round) {
        Tool tool = face_mill();
        tool.core_diameter = 8 + 26 * unit(random);
        tool.ramp_deg = 0;
        std::vector<std::array<double, 3>> places{{60, 60, kTop + 1}};
        for (int k = 0; k < 10; ++k) {
            const std::array<double, 3>& from = places.back();
            const double turn = 2 * std::numbers::pi * unit(random), way = 25 * unit(random);
            const int kind = static_cast<int>(4 * unit(random));
            const double fall = kind == 0 ? 0 : kind == 1 ? -2 * unit(random) : 2 * unit(random);
            places.push_back({std::clamp(from[0] + (kind == 3 ? 0 : way) * std::cos(turn), 25.0, 95.0),
                              std::clamp(from[1] + (kind == 3 ? 0 : way) * std::sin(turn), 25.0, 95.0),
                              from[2] - fall});
        }
        Watched watched(tool);
        watched.at = {places[0][0], places[0][1], places[0][2], 3000, 1, true};
        for (std::size_t k = 1; k < places.size(); ++k) watched.to(places[k][0], places[k][1], places[k][2]);
        const auto in_steps = [&](double wider) {
            const CellGrid grid = Watched::grid();
            std::vector<double> stands(grid.count(), kTop);
            const double core = tool.core_diameter / 2 + wider, rim = tool.diameter / 2;
            double deepest = 0;
            for (std::size_t k = 1; k < places.size(); ++k) {
                const auto &a = places[k - 1], &b = places[k];
                const int steps =
                    1 + static_cast<int>(10 * std::hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]));
                for (int s = 1; s <= steps; ++s) {
                    const double t = static_cast<double>(s) / steps, x = a[0] + t * (b[0] - a[0]),
                                 y = a[1] + t * (b[1] - a[1]), z = a[2] + t * (b[2] - a[2]);
                    const auto first = [&](double v) {
                        return std::max(0, static_cast<int>((v - rim) / kCell) - 1);
                    };
                    const int span = static_cast<int>(2 * rim / kCell) + 3;
                    for (int j = first(y); j < std::min(grid.ny, first(y) + span); ++j)
                        for (int i = first(x); i < std::min(grid.nx, first(x) + span); ++i) {
                            double& h = stands[grid.index(i, j)];
                            const double off = std::hypot(grid.x(i) - x, grid.y(j) - y);
                            if (off >= rim || h <= z) continue;
                            if (off >= core) h = z;
                            else if (b[2] < a[2]) deepest = std::max(deepest, h - z);
                        }
                }
            }
            return deepest;
        };
        const double least = in_steps(-0.3), most = in_steps(0.3);
        if (least > CoreContact::kScrape + 0.1) {
            EXPECT_GE(watched.deepest(), least - 0.05) << round;
        }
        EXPECT_LE(watched.deepest(), most + 0.05) << round;
    }
}

// By the whole simulation: what is said, of which program and line; with pending level motions before it.
TEST(CoreContact, IsAViolationOfTheProgram) {
    for (const bool plunges : {false, true}) {
        Mesh mesh;
        for (const float z : {0.F, 20.F})
            for (const float y : {0.F, 10.F})
                for (const float x : {0.F, 10.F}) mesh.vertices.push_back({x, y, z});
        mesh.facets = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                       {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
        SimulationInput input;
        input.mesh = mesh.view();
        input.stock_min = {-10, -10};
        input.stock_max = {130, 130};
        input.layers.push_back({0, 20, 20});
        Tool tool = face_mill();
        tool.plunges = plunges;
        if (plunges) tool.core_diameter = -1;
        input.tools = {tool};
        Program program;
        program.file = "L001_01_rough_T1.ngc";
        program.kind = OperationKind::rough;
        program.tool = program.planned_tool = 1;
        program.spindle_rpm = 10000;
        const auto to = [&](double x, double y, double z, double feed) {
            program.steps.push_back(
                {x, y, z, feed, static_cast<std::uint32_t>(program.steps.size()) + 10, true});
        };
        to(kUnknown, kUnknown, kClear, 0);
        to(160, 60, kClear, 0);
        to(160, 60, 17, 1000);
        to(70, 60, 17, 1000);  // a slot, into which it comes down again
        to(70, 60, kClear, 0);
        to(100, 60, kClear, 0);
        to(100, 60, 17, 1000);
        to(100, 60, kClear, 0);
        to(100, 95, kClear, 0);
        to(100, 95, 17, 1000);  // line 19: beside it
        to(100, 95, kClear, 0);
        input.programs = {program};
        Context context;
        SimulationOptions options;
        options.cell = 0.5;
        const SimulationReport report = simulate(context, input, StandingPart(context, input.mesh), options);
        const auto found =
            std::find_if(report.violations.begin(), report.violations.end(),
                         [](const Violation& v) { return v.code == "plunge.not_center_cutting"; });
        if (plunges) {
            EXPECT_EQ(found, report.violations.end());
            continue;
        }
        ASSERT_NE(found, report.violations.end());
        EXPECT_EQ(found->file, program.file);
        EXPECT_EQ(found->line, 19U);
        EXPECT_NEAR(found->size, 3, 1e-4);
        ASSERT_TRUE(found->where);
        EXPECT_LT(std::hypot((*found->where)[0] - 100, (*found->where)[1] - 95), 12);
        EXPECT_NEAR((*found->where)[2], 17, 1e-6);
        EXPECT_NEAR(report.programs[0].crushed_mm2, std::numbers::pi * 12 * 12, 10);
    }
}
