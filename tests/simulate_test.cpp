// The simulator on a part whose programs are written by hand: the good ones pass, and each corruption is
// reported as what it is.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <numbers>

#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "engine/simulate/simulate.h"
#include "engine/simulate/simulation_memory.h"
#include "io/posts/gcode_reader.h"
#include "kernels/errors.h"
#include "tests/support/seed.h"

using namespace slabwright;

namespace {

/// What a program must state before its first motion.
const std::string kStart = "G21 G17 G90 G94 G40 G49 G80\nG54 G8 G97 G91.1 G64 P0.02 Q0\nT3 M6\nG43 H3\n";

struct Solid {
    Mesh mesh;
    void quad(const Point3& a, const Point3& b, const Point3& c, const Point3& d) {
        for (const auto* t : {&a, &b, &c, &a, &c, &d}) {
            mesh.vertices.push_back(
                {static_cast<float>((*t)[0]), static_cast<float>((*t)[1]), static_cast<float>((*t)[2])});
            if (mesh.vertices.size() % 3 == 0) {
                const auto n = static_cast<std::uint32_t>(mesh.vertices.size());
                mesh.facets.push_back({n - 3, n - 2, n - 1});
            }
        }
    }
    void box(const Point3& l, const Point3& h) {
        quad({l[0], l[1], l[2]}, {l[0], h[1], l[2]}, {h[0], h[1], l[2]}, {h[0], l[1], l[2]});
        quad({l[0], l[1], h[2]}, {h[0], l[1], h[2]}, {h[0], h[1], h[2]}, {l[0], h[1], h[2]});
        quad({l[0], l[1], l[2]}, {h[0], l[1], l[2]}, {h[0], l[1], h[2]}, {l[0], l[1], h[2]});
        quad({h[0], h[1], l[2]}, {l[0], h[1], l[2]}, {l[0], h[1], h[2]}, {h[0], h[1], h[2]});
        quad({l[0], h[1], l[2]}, {l[0], l[1], l[2]}, {l[0], l[1], h[2]}, {l[0], h[1], h[2]});
        quad({h[0], l[1], l[2]}, {h[0], h[1], l[2]}, {h[0], h[1], h[2]}, {h[0], l[1], h[2]});
    }
};

/// Writes a program move by move.
struct Writer {
    Program p;
    std::uint32_t line = 8;
    Writer(const std::string& file, int layer, int tool, OperationKind kind) {
        p.file = file;
        p.layer = layer;
        p.kind = kind;
        p.tool = p.planned_tool = tool;
        p.spindle_rpm = 18000;
    }
    Writer& to(double x, double y, double z, double feed = 0) {
        p.steps.push_back({x, y, z, feed, line++, true});
        return *this;
    }
    /// From wherever the machine stands to over (x, y).
    Writer& start(double x, double y, double clearance) {
        return to(kUnknown, kUnknown, clearance).to(x, y, clearance);
    }
};

constexpr double kClear = 25;

/// A 20 × 20 × 10 block in a 40 × 40 × 12 slab: faced by a 60 mm face mill, then cleared by a 10 mm flat end
/// mill in rectangles.
struct Block {
    Solid solid;
    SimulationInput input;
    SimulationOptions options;

    explicit Block(bool two_layers = false) {
        solid.box({0, 0, 0}, {20, 20, two_layers ? 20.0 : 10.0});
        input.stock_min = {-10, -10};
        input.stock_max = {30, 30};
        input.tools = {
            {1, ToolKind::face, "face", 60, 20, 20, 60, 60, 4, 0.0, 12000, 9000, 1000, 0.1, 4.0, 0.6},
            {2, ToolKind::flat, "flat", 10, 32, 10, 50, 40, 2, 0.5, 18000, 9000, 1500, 1, 6, 0.5},
            {3, ToolKind::ball, "ball", 6, 30, 6, 45, 32, 2, 0.5, 18000, 9000, 1500, 1, 3, 0.5}};
        options.cell = 0.25;
        add_layer(0);
        if (two_layers) add_layer(10);
    }
    void add_layer(double z) {
        const int layer = static_cast<int>(input.layers.size());
        input.layers.push_back({z, z + 10, 12});
        const std::string name = "L" + std::to_string(layer + 1);
        input.programs.push_back(Writer(name + "_01", layer, 1, OperationKind::face)
                                     .start(-45, 10, z + kClear)
                                     .to(-45, 10, z + 10)
                                     .to(65, 10, z + 10, 5000)
                                     .to(65, 10, z + kClear)
                                     .p);
        Writer rough(name + "_02", layer, 2, OperationKind::rough);
        rough.start(-20, -5, z + kClear);
        for (const double level : {z + 5, z}) {
            rough.to(-20, -5, level);
            for (const double d : {9.0, 5.0})
                rough.to(-d, -d, level, 5000)
                    .to(20 + d, -d, level, 5000)
                    .to(20 + d, 20 + d, level, 5000)
                    .to(-d, 20 + d, level, 5000)
                    .to(-d, -d, level, 5000);
            rough.to(-5, -5, z + kClear).to(-20, -5, z + kClear);
        }
        input.programs.push_back(rough.p);
    }
    SimulationReport run(int threads = 0) {
        input.mesh = solid.mesh.view();
        Context context({.threads = threads});
        return simulate(context, input, StandingPart(context, input.mesh), options);
    }
    Program& rough() { return input.programs[1]; }
};

std::string codes(const SimulationReport& r) {
    std::string s;
    for (const Violation& v : r.violations) s += (s.empty() ? "" : " ") + v.code;
    return s;
}
const Violation* find(const SimulationReport& r, const std::string& code) {
    for (const Violation& v : r.violations)
        if (v.code == code) return &v;
    return nullptr;
}

}  // namespace

TEST(Simulate, GoodProgramsPass) {
    Block block;
    const SimulationReport r = block.run();
    EXPECT_EQ(codes(r), "");
    ASSERT_EQ(r.layers.size(), 1u);
    EXPECT_EQ(r.nx, 160);
    EXPECT_EQ(r.layers[0].cells, 160u * 160);
    EXPECT_EQ(r.gouge_max, 0);
    EXPECT_EQ(r.layers[0].gouge_cells, 0u);
    EXPECT_LT(r.layers[0].left.size, 1e-4);
    EXPECT_EQ(r.layers[0].within_share, 1);
    EXPECT_NEAR(r.programs[0].removed_mm3, 40 * 40 * 2, 0.1);
    EXPECT_NEAR(r.programs[1].removed_mm3, (1600 - 400) * 10, 1);
    EXPECT_NEAR(r.removed_mm3, 3200 + 12000, 1);
    EXPECT_NEAR(r.programs[1].lowest, 0, 1e-6);
    EXPECT_NEAR(r.programs[0].stock_top, 12, 1e-6);
    EXPECT_NEAR(r.programs[1].stock_top, 10, 1e-6);
    EXPECT_EQ(r.board_cut, 0);
}

TEST(Simulate, TwoLayersPassAndAnyNumberOfThreadsAgrees) {
    Block block(true);
    const SimulationReport a = block.run(1), b = block.run(3);
    EXPECT_EQ(codes(a), "");
    ASSERT_EQ(a.layers.size(), 2u);
    EXPECT_EQ(a.removed_mm3, b.removed_mm3);
    EXPECT_EQ(a.seconds, b.seconds);
    for (std::size_t l = 0; l < 2; ++l) {
        EXPECT_EQ(a.layers[l].left_rms, b.layers[l].left_rms);
        EXPECT_EQ(a.layers[l].left.where, b.layers[l].left.where);
    }
}

TEST(Simulate, LoweredZIsAGouge) {
    Block block;
    for (ProgramStep& s : block.input.programs[0].steps)
        if (!s.rapid()) s.z -= 0.5;
    block.input.programs[0].steps[2].z -= 0.5;
    const SimulationReport r = block.run();
    const Violation* v = find(r, "gouge.cutter");
    ASSERT_NE(v, nullptr) << codes(r);
    EXPECT_EQ(v->file, "L1_01");
    EXPECT_NEAR(v->size, 0.5, StandingPart::kSheet + 1e-6);
    const Violation* stock = find(r, "gouge.stock");
    ASSERT_NE(stock, nullptr);
    EXPECT_NEAR(stock->size, 0.5, 1e-5);
}

TEST(Simulate, AShiftOfTwentyMicrometresIsCaughtWhereNoCellSees) {
    Block block;
    block.options.cell = 1;  // centres lie 0.5 mm inside the wall
    for (ProgramStep& s : block.rough().steps) s.x += 0.02;
    const SimulationReport r = block.run();
    EXPECT_EQ(codes(r), "gouge.cutter");
    EXPECT_NEAR(r.gouge_max, 0.02, 1e-6);
    Block fine;
    for (ProgramStep& s : fine.rough().steps) s.x += 0.008;
    EXPECT_EQ(codes(fine.run()), "") << "within the tolerance";
}

// A program that lets the machine round its corners is held against the part as far as that may take the
// cutter.
TEST(Simulate, RoundedCornersAreHeldAgainstThePart) {
    Block block;
    block.rough().strays = kJunction;
    EXPECT_EQ(codes(block.run()), "") << "walls are cut to their size by a path of the ordinary precision";
    block.rough().strays = 0.1;
    const SimulationReport tight = block.run();
    EXPECT_EQ(codes(tight), "gouge.cutter");
    EXPECT_NEAR(tight.gouge_max, 0.1, 1e-6);
    for (ProgramStep& s : block.rough().steps)  // the innermost rings go round at 0.095 mm from the walls
        for (double* const v : {&s.x, &s.y}) {
            if (*v == -5) *v = -5.095;
            if (*v == 25) *v = 25.095;
        }
    const SimulationReport kept = block.run();
    EXPECT_EQ(find(kept, "gouge.cutter"), nullptr) << codes(kept);
    EXPECT_NEAR(kept.gouge_max, 0.005, 1e-6);
}

TEST(Simulate, DroppedRetractIsARapidThroughStock) {
    Block block;
    auto& steps = block.rough().steps;
    // The first level's retract and the way back, at depth: from inside the cleared ring straight across the
    // block's corner.
    for (std::size_t i = 0; i < steps.size(); ++i)
        if (steps[i].rapid() && i > 3 && steps[i].z == kClear) {
            steps[i].z = 5;
            break;
        }
    steps.insert(steps.begin() + 13, {25, 25, 5, 0, 99, true});
    const SimulationReport r = block.run();
    EXPECT_NE(find(r, "gouge.cutter"), nullptr) << codes(r);
    const Violation* v = find(r, "rapid.through_stock");
    ASSERT_NE(v, nullptr) << codes(r);
    EXPECT_EQ(v->file, "L1_02");
    EXPECT_NEAR(v->size, 5, 1e-5);
}

TEST(Simulate, ARapidStraightDownIntoStock) {
    Block block;
    auto& steps = block.rough().steps;
    steps[1].x = steps[2].x = -5;  // plunges where stock stands
    const SimulationReport r = block.run();
    const Violation* v = find(r, "rapid.through_stock");
    ASSERT_NE(v, nullptr) << codes(r);
    EXPECT_EQ(v->line, steps[2].line);
    EXPECT_NEAR(v->size, 5, 1e-5);
}

TEST(Simulate, WrongAndUnknownTool) {
    Block block;
    block.rough().tool = 3;
    SimulationReport r = block.run();
    ASSERT_NE(find(r, "tool.wrong"), nullptr);
    EXPECT_EQ(find(r, "tool.wrong")->file, "L1_02");
    block.rough().tool = 7;
    r = block.run();
    ASSERT_NE(find(r, "tool.unknown"), nullptr);
    EXPECT_NE(find(r, "left.too_much"), nullptr) << "and so nothing was roughed";
}

TEST(Simulate, DeletedLineLeavesStock) {
    Block block;
    auto& steps = block.rough().steps;
    // The second level's inner rectangle loses its far corner: the way is cut short, through the block.
    Block shorter;
    shorter.rough().steps.erase(shorter.rough().steps.begin() + 17, shorter.rough().steps.begin() + 26);
    const SimulationReport r = shorter.run();
    EXPECT_NE(find(r, "left.too_much"), nullptr) << codes(r);
    const LayerFindings& l = r.layers[0];
    EXPECT_NEAR(l.missed_left.size, 5, 0.6);
    EXPECT_GT(l.waste_mm3, 1000);
    steps.erase(steps.begin() + 23);
    const SimulationReport cut_short = block.run();
    EXPECT_NE(find(cut_short, "gouge.cutter"), nullptr) << codes(cut_short);
}

TEST(Simulate, SpindleFlutesShankHolder) {
    Block off;
    for (ProgramStep& s : off.rough().steps) s.spindle = false;
    EXPECT_EQ(codes(off.run()), "spindle.off");

    Block flutes;
    flutes.input.tools[1].flute_length = 3;  // steps of 5 mm
    const SimulationReport f = flutes.run();
    ASSERT_NE(find(f, "flute.too_deep"), nullptr) << codes(f);
    EXPECT_NEAR(find(f, "flute.too_deep")->size, 2, 1e-4);

    Block shank;
    shank.input.tools[1].flute_length = 6;
    shank.input.tools[1].shank_diameter =
        12;  // on the lower level it begins at 6, and stands 1 mm into the block's wall
    const SimulationReport s = shank.run();
    ASSERT_NE(find(s, "contact.shank"), nullptr) << codes(s);
    EXPECT_NEAR(find(s, "contact.shank")->size, 1, 1e-4);

    Block holder;
    holder.input.tools[1].stickout = 7;
    holder.input.tools[1].holder_diameter = 40;
    const SimulationReport h = holder.run();
    EXPECT_NE(find(h, "contact.holder"), nullptr) << codes(h);
}

// Two levels of 5 mm whose rims lie `apart` mm from each other beside the wall at y = 0; the lower one's is
// just past the points at y = −0.25.
SimulationReport two_levels(double apart) {
    Block block;
    block.options.cell = 0.5;
    block.rough().planned_stepdown = 5;
    for (ProgramStep& s : block.rough().steps)
        if (s.y == -5) s.y = s.z == 5 ? -5.249 - apart : -5.249, s.x = s.x == -5 ? -9 : s.x == 25 ? 29 : s.x;
    return block.run();
}

// A cutter's rim that meets the centres of a row, on one level and not on the one above, has cut a micrometre
// there and no whole row.
TEST(Simulate, ARimOnARowOfPointsIsNoDeepCut) {
    const SimulationReport r = two_levels(0.002);
    EXPECT_EQ(find(r, "cut.too_deep"), nullptr) << codes(r);
}

TEST(Simulate, ARidgeThatWasLeftIsADeepCut) {
    const SimulationReport r = two_levels(2);
    ASSERT_NE(find(r, "cut.too_deep"), nullptr) << codes(r);
    EXPECT_NEAR(find(r, "cut.too_deep")->size, 5, 1e-6);
}

// Where a tool has come to from an unknown place, what stood there is taken by the way that begins there.
TEST(Simulate, AWayFromAnUnknownPlaceTakesWhatStandsWhereItBegins) {
    for (const double stepdown : {0.0, 1.0}) {
        Block block;
        Writer first("L1_02", 0, 2, OperationKind::rough);
        first.to(kUnknown, kUnknown, 5).to(-5, -5, 5).to(15, -5, 5, 1000).to(15, -5, kClear);
        block.rough() = first.p;
        block.rough().planned_stepdown = stepdown;
        const SimulationReport r = block.run();
        ASSERT_EQ(r.programs.size(), 2U);
        EXPECT_NEAR(r.programs[1].removed_mm3, 5 * (20 * 10 + std::numbers::pi * 5 * 5), 5) << stepdown;
        EXPECT_EQ(find(r, "cut.too_deep") != nullptr, stepdown > 0) << codes(r);
    }
}

TEST(Simulate, EmptyOperationTravelAndUnknownStart) {
    Block twice;
    twice.input.programs.insert(twice.input.programs.begin() + 1, twice.input.programs[0]);
    twice.input.programs[1].file = "L1_01b";
    SimulationReport r = twice.run();
    EXPECT_EQ(codes(r), "operation.empty");
    EXPECT_EQ(r.violations[0].file, "L1_01b");
    twice.options.cell = 0.5;  // points so far apart may miss what an operation takes
    EXPECT_EQ(codes(twice.run()), "");

    Block small;
    small.input.machine.travel_x = 100;  // the face mill's way is 110 mm
    EXPECT_EQ(codes(small.run()), "travel.exceeded");

    Block low;
    low.input.programs[0].steps[0].z = 11;  // the slab stands at 12
    low.input.programs[0].steps[1].z = 11;
    r = low.run();
    ASSERT_NE(find(r, "rapid.unknown_start"), nullptr) << codes(r);
    EXPECT_NEAR(find(r, "rapid.unknown_start")->size, 1, 1e-6);
}

TEST(Simulate, BoardAndLayersBelow) {
    Block deep;
    deep.options.board_cut = 2;
    for (ProgramStep& s : deep.rough().steps)
        if (s.z == 0) s.z = -3;
    SimulationReport r = deep.run();
    EXPECT_EQ(codes(r), "board.too_deep");
    EXPECT_NEAR(r.board_cut, 3, 1e-5);

    // The upper layer's cutter passes its bottom: beside the block there is nothing, so it may.
    Block pass(true);
    for (ProgramStep& s : pass.input.programs[3].steps)
        if (s.z == 10) s.z = 8;
    EXPECT_EQ(codes(pass.run()), "");
    // But where the lower layer is wider, it may not.
    Block step(true);
    step.solid.box({-4, 5, 0}, {0, 15, 10});
    for (ProgramStep& s : step.input.programs[3].steps)
        if (s.z == 10) s.z = 9.9;
    r = step.run();
    const Violation* v = find(r, "gouge.stock");
    EXPECT_NE(v, nullptr) << codes(r);
}

TEST(Simulate, WhatNoToolReachesIsExcusedAndTheRestIsNot) {
    // A second block beside the first makes a slot of 4 mm: no tool enters it. The rectangles run outside
    // both.
    Block slot;
    slot.solid = {};
    slot.solid.box({0, 0, 0}, {8, 20, 10});
    slot.solid.box({12, 0, 0}, {20, 20, 10});
    slot.input.tools.pop_back();  // the ball would dip into it
    SimulationReport r = slot.run();
    EXPECT_EQ(codes(r), "") << r.layers[0].missed_left.where[0] << " " << r.layers[0].missed_left.where[1]
                            << " " << r.layers[0].missed_left.where[2];
    EXPECT_NEAR(static_cast<double>(r.layers[0].unreachable) * 0.0625, 80, 12);
    EXPECT_DOUBLE_EQ(r.unreachable_mm2(), static_cast<double>(r.layers[0].unreachable) * 0.0625);
    EXPECT_NEAR(r.layers[0].unreachable_left.size, 2,
                0.2);  // the middle of the slot is 2 mm from either wall
    // A slot of 7 mm lets the ball in: that it was left is the plan's fault.
    Block wide;
    wide.solid = {};
    wide.solid.box({0, 0, 0}, {6.5, 20, 10});
    wide.solid.box({13.5, 0, 0}, {20, 20, 10});
    r = wide.run();
    EXPECT_NE(find(r, "left.too_much"), nullptr) << codes(r);
    EXPECT_NEAR(r.layers[0].missed_left.size, 3.5, 0.3);
    for (const char* code : {"left.too_much", "left.missed"}) {
        const Violation* left = find(r, code);
        ASSERT_NE(left, nullptr) << codes(r);
        EXPECT_EQ(left->file, "") << "what is left is of the layer, and of no program's line";
        EXPECT_EQ(left->line, 0U);
        EXPECT_EQ(left->layer, 0U);
    }
    // ... unless the holder does not fit: too short a tool under a wide holder.
    for (Tool& t : wide.input.tools) t.stickout = 0.5, t.holder_diameter = 60;
    wide.input.tools[0].stickout = wide.input.tools[1].stickout = 50;
    wide.input.tools[2].stickout = 2;
    r = wide.run();
    EXPECT_LT(r.layers[0].missed_left.size, 3.0);
    // Even beside the wall some of the stock can still be taken: the tip stays above 8, and a centre between
    // x = 9.328, where the ball clears the wall's edge, and 9.366 covers the point 0.09 mm below the cell
    // at 6.625.
    EXPECT_EQ(r.layers[0].unreachable, 0u);
    // With the holder 0.5 mm above the tip it would need x ≥ 8.158 and x ≤ 8.120.
    wide.input.tools[2].stickout = 0.5;
    r = wide.run();
    EXPECT_GT(r.layers[0].unreachable, 0u);
    EXPECT_GT(r.layers[0].missed, r.layers[0].unreachable) << "the middle of the slot can be dipped into";
}

TEST(Simulate, WhatStaysFilledUnderARoof) {
    Block whole;
    SimulationReport r = whole.run();
    EXPECT_EQ(r.unmade_mm3(), 0);
    EXPECT_NEAR(r.pattern_mm2, 400, 1e-9);
    // A roof 5 mm over the board on a leg 8 mm wide: the wood under the roof stays.
    Block table;
    table.solid = {};
    table.solid.box({0, 0, 5}, {20, 20, 10});
    table.solid.box({0, 0, 0}, {8, 20, 5});
    r = table.run();
    EXPECT_EQ(codes(r), "");
    EXPECT_NEAR(r.unmade_mm3(), 11.5 * 19.5 * 5, 1) << "all but a cell at the rim";
    EXPECT_NEAR(r.unmade().size, 5, 1e-4);
    EXPECT_NEAR(r.pattern_mm2, 400, 1e-9);
    // A wall that leans by less than a cell is not told.
    Block leaning;
    leaning.solid = {};
    leaning.solid.box({0, 0, 0}, {19.9F, 20, 5});
    leaning.solid.box({0, 0, 5}, {20, 20, 10});
    EXPECT_EQ(leaning.run().unmade_mm3(), 0);
}

TEST(Simulate, InnerCornersLeaveARoundThatIsExcused) {
    // An L: its inner corner keeps a round of the end mill's radius 5 (or the ball's 3, which the plan did
    // not use: missed).
    Block ell;
    ell.solid = {};
    ell.solid.box({0, 0, 0}, {20, 10, 10});
    ell.solid.box({0, 10, 0}, {10, 20, 10});
    Writer corner("L1_03", 0, 2, OperationKind::rough);
    corner.start(25, 25, kClear);
    for (const double z : {5.0, 0.0})
        corner.to(25, 25, z)
            .to(25, 15, z, 3000)
            .to(15, 15, z, 3000)
            .to(15, 25, z, 3000)
            .to(15, 25, kClear)
            .to(25, 25, kClear);
    ell.input.programs.push_back(corner.p);
    SimulationReport r = ell.run();
    EXPECT_GT(r.layers[0].missed, 0u) << "the ball gets deeper into the corner";
    ell.input.tools.pop_back();
    r = ell.run();
    EXPECT_EQ(codes(r), "");
    EXPECT_GT(r.layers[0].unreachable, 0u);
    EXPECT_NEAR(r.layers[0].unreachable_left.size, 5 * (1 - std::sqrt(0.5)), 0.3);
}

// The stock measured at its cells can show no deeper gouge than the exact check of all motions, but for the
// sheet under a layer's top and the stock's float.
TEST(Simulate, NoCellIsGougedDeeperThanTheExactCheckSays) {
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    auto uniform = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(random); };
    int gouged = 0;
    for (int trial = 0; trial < 16; ++trial) {
        Block block(true);
        block.solid = {};
        // Walls that lean inwards or outwards, over both layers, and one with an undercut below it.
        for (int k = 0; k < 3; ++k) {
            const double x = uniform(0, 12), y = uniform(0, 12), w = uniform(3, 8), lean = uniform(-2, 2),
                         z0 = k == 2 ? uniform(3, 12) : 0;
            const double z1 = k == 0 ? 20 : uniform(z0 + 1, 20);
            const std::array<Point3, 8> c{
                Point3{x, y, z0},  {x + w, y, z0},        {x + w, y + w, z0},        {x, y + w, z0},
                {x + lean, y, z1}, {x + w + lean, y, z1}, {x + w + lean, y + w, z1}, {x + lean, y + w, z1}};
            block.solid.quad(c[0], c[3], c[2], c[1]);
            block.solid.quad(c[4], c[5], c[6], c[7]);
            for (std::size_t i = 0; i < 4; ++i)
                block.solid.quad(c[i], c[(i + 1) % 4], c[4 + (i + 1) % 4], c[4 + i]);
        }
        block.input.programs.clear();
        Context context;
        const StandingPart part(context, block.solid.mesh.view());
        const bool ball = trial % 2 == 0;
        for (int layer = 0; layer < 2; ++layer) {
            Writer cuts("L" + std::to_string(layer + 1), layer, ball ? 3 : 2, OperationKind::finish);
            const double top = 10.0 * layer + 10;
            for (int k = 0; k < 30; ++k) {
                // A cut lowered until it is as deep in the part as it should be, or at the bottom.
                Point3 from{uniform(-3, 23), uniform(-3, 23), 0},
                    to{uniform(-3, 23), uniform(-3, 23), uniform(-1, 1)};
                const double wanted = uniform(0.005, 0.4);
                double low = 10.0 * layer - (ball ? 2 : 0) + 1, high = top + 2;
                for (int i = 0; i < 24; ++i) {
                    const double z = (low + high) / 2;
                    const Point3 a{from[0], from[1], z}, b{to[0], to[1], z + to[2]};
                    const double depth =
                        ball ? part.ball(top, a, b, 3, 0).depth : part.cylinder(top, a, b, 5, 0).depth;
                    (depth > wanted ? low : high) = z;
                }
                cuts.to(from[0], from[1], kClear)
                    .to(from[0], from[1], high, 3000)
                    .to(to[0], to[1], high + to[2], 3000)
                    .to(to[0], to[1], kClear);
            }
            block.input.programs.push_back(cuts.p);
        }
        block.options.cell = uniform(0.25, 0.5);
        const SimulationReport r = block.run();
        // A point that is d deep in the part and in a ball has, d towards the ball's centre, part that is d
        // deep in the ball. In a cylinder the depth is the lesser of those from wall and floor, so at its rim
        // d is √2 times the depth.
        const double bound = (ball ? 1 : std::sqrt(2.0)) * r.gouge_max + StandingPart::kSheet + 1e-5;
        ASSERT_LT(r.gouge_max, 1);
        for (const LayerFindings& l : r.layers) {
            EXPECT_LE(l.gouge.size, bound) << "trial " << trial;
            gouged += l.gouge.size > 0.05;
        }
        // With maps every cell's depth is told, else only those that change what is found.
        block.options.maps = true;
        const SimulationReport mapped = block.run();
        for (std::size_t l = 0; l < r.layers.size(); ++l) {
            const LayerFindings &a = r.layers[l], &b = mapped.layers[l];
            EXPECT_EQ(a.gouge.size, b.gouge.size) << "trial " << trial;
            EXPECT_EQ(a.gouge.where, b.gouge.where);
            EXPECT_EQ(a.gouge_cells, b.gouge_cells);
            float deepest = 0;
            std::uint64_t deep = 0;
            for (const float over : b.map)
                deepest = std::max(deepest, -over), deep += -over > block.options.gouge;
            EXPECT_EQ(a.gouge_cells, deep) << "trial " << trial;
            EXPECT_EQ(static_cast<float>(a.gouge.size), deepest) << "trial " << trial;
        }
    }
    EXPECT_GT(gouged, 8);
}

// A program of arcs, cut as arcs, does to the stock what its chords do.
TEST(Simulate, ArcsCutWhatTheirChordsCut) {
    std::string text = kStart + "S12000 M3\nG0 X-5 Y-5 Z25\nZ7\nF3000\n";
    for (const char* z : {"7", "4", "1"})
        text += std::string("G1 Z") + z +
                "\nG2 X25 Y25 I15 J15\nG3 X-5 Y-5 I-30 J0\nG2 X-5 Y-5 I4 J2\nG3 X-8 Y20 R40\nG1 X-5 Y-5\n";
    text += "G0 Z25\nM5\nM2\n";
    Block block;
    Program p = read_gcode(text, "arcs");
    ASSERT_EQ(p.arcs.size(), 12u);
    p.file = "L1_02", p.planned_tool = 3, p.kind = OperationKind::finish;
    block.rough() = p;
    const SimulationReport arcs = block.run(1);
    block.rough().arcs.clear();
    const SimulationReport chords = block.run(1);
    EXPECT_GT(arcs.programs[1].removed_mm3, 1000);
    EXPECT_NEAR(arcs.programs[1].removed_mm3, chords.programs[1].removed_mm3,
                1e-4 * chords.programs[1].removed_mm3);
    EXPECT_NEAR(arcs.layers[0].gouge.size, chords.layers[0].gouge.size, 0.002);
    EXPECT_NEAR(arcs.layers[0].left_rms, chords.layers[0].left_rms, 0.002);
    EXPECT_EQ(arcs.gouge_max, chords.gouge_max);
    EXPECT_EQ(codes(arcs), codes(chords));
    // Read with few chords an arc it is found to do all the same, for nobody goes by them.
    Program few = read_gcode(text, "arcs", {.level_arc_error = 0.01});
    EXPECT_LT(few.steps.size(), p.steps.size() / 5);
    few.file = p.file, few.planned_tool = p.planned_tool, few.kind = p.kind;
    block.rough() = few;
    const SimulationReport read_few = block.run(1);
    EXPECT_NEAR(read_few.gouge_max, arcs.gouge_max, 1e-7);
    EXPECT_EQ(read_few.programs[1].gouge.motions, arcs.programs[1].gouge.motions);
    EXPECT_EQ(read_few.programs[1].removed_mm3, arcs.programs[1].removed_mm3);
    EXPECT_EQ(read_few.programs[1].seconds, arcs.programs[1].seconds);
    EXPECT_EQ(read_few.programs[1].cutting_mm, arcs.programs[1].cutting_mm);
    EXPECT_NEAR(arcs.programs[1].cutting_mm, chords.programs[1].cutting_mm, 0.01);
    EXPECT_NEAR(arcs.programs[1].seconds, chords.programs[1].seconds, 0.02 * chords.programs[1].seconds);
    EXPECT_EQ(codes(read_few), codes(arcs));
}

// The text rounds an arc's end and its centre, each for itself, so that its radius at both ends differs. What
// lies at the cutter's rim there has been cut all the same, and a retract takes none of it.
TEST(Simulate, ARetractFromAnArcsEndTakesNothing) {
    Block block;
    block.input.stock_min = {-100, -100}, block.input.stock_max = {120, 120};
    block.options.cell = 0.1;
    block.input.tools[2] = {3, ToolKind::flat, "flat", 20,   60, 20,   60, 60, 2,
                            0, 18000,          9000,   1500, 1,  10.0, 1};
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> place(-60, 80), angle(0, 2 * std::numbers::pi), radius(3, 40);
    std::string text = kStart + "S12000 M3\nG0 X-200 Y-200 Z25\nF3000\n";
    for (int k = 0; k < 80; ++k) {
        const double x = place(random), y = place(random), r = radius(random), a = angle(random),
                     b = a + 0.2 + angle(random) / 2;
        text +=
            fmt::format("G0 X{:.4f} Y{:.4f}\nG1 Z{:.4f}\n{} X{:.4f} Y{:.4f} I{:.4f} J{:.4f}\nG0 Z25\n",
                        x + r * std::cos(a), y + r * std::sin(a), 11.9 - 0.1 * k, k % 2 == 0 ? "G3" : "G2",
                        x + r * std::cos(b), y + r * std::sin(b), -r * std::cos(a), -r * std::sin(a));
    }
    Program p = read_gcode(text + "M5\nM2\n", "arcs");
    ASSERT_EQ(p.arcs.size(), 80U);
    p.file = "L1_02", p.planned_tool = 3, p.kind = OperationKind::finish;
    block.rough() = p;
    const SimulationReport report = block.run();
    EXPECT_GT(report.programs[1].removed_mm3, 1000);
    for (const Violation& v : report.violations)
        EXPECT_FALSE(v.code == "rapid.through_stock" && v.file == "L1_02") << v.line << ": " << v.message;
}

// An arc is seen to leave the machine's travel though both its ends lie within it, and by how much.
TEST(Simulate, ArcsBulgeBeyondTheTravel) {
    Block block;
    Program p = read_gcode(kStart +
                               "S12000 M3\nG0 X-200 Y-150 Z25\nF3000\nG3 X-200 Y-350 I100 J-100\nG0 "
                               "X0\nM5\nM2\n",
                           "arcs", {.level_arc_error = 50});
    ASSERT_EQ(p.arcs.size(), 1u);
    ASSERT_EQ(p.arcs[0].end - p.arcs[0].begin, 1u) << "its steps do not show where it bulges";
    p.file = "L1_02", p.planned_tool = 3, p.kind = OperationKind::finish;
    block.rough() = p;
    const double span = 100 + 100 * std::sqrt(2.0);
    block.input.machine.travel_x = span + 0.01, block.input.machine.travel_y = 1000;
    EXPECT_EQ(find(block.run(), "travel.exceeded"), nullptr);
    block.input.machine.travel_x = span - 0.01;
    const SimulationReport report = block.run();
    const Violation* const found = find(report, "travel.exceeded");
    ASSERT_NE(found, nullptr);
    EXPECT_NEAR(found->size, 0.01, 1e-9);
}

TEST(Simulate, FlaskMustStay) {
    Block block;
    for (const auto& loop :
         {std::array<Point2, 4>{Point2{-95000, -95000}, {295000, -95000}, {295000, 295000}, {-95000, 295000}},
          std::array<Point2, 4>{
              Point2{-70000, -70000}, {-70000, 270000}, {270000, 270000}, {270000, -70000}}}) {
        for (const Point2 p : loop) block.input.layers[0].flask.points.push_back(p);
        block.input.layers[0].flask.close_loop();
    }
    const SimulationReport r = block.run();
    // The roughing cutter runs out over the flask's whole height: its radius deep in the wall, and all of the
    // stock there.
    double wall = 0, stock = 0;
    for (const Violation& v : r.violations)
        if (v.code == "gouge.flask") (v.file.empty() ? stock : wall) = v.size;
    EXPECT_NEAR(wall, 5, 1e-4) << codes(r);
    EXPECT_NEAR(stock, 10, 1e-4) << codes(r);
}

TEST(Simulate, SlabsThatCannotHoldThePart) {
    Block tall;
    tall.solid = {};
    tall.solid.box({0, 0, 0}, {20, 20, 11});
    EXPECT_NE(find(tall.run(), "stack.short"), nullptr);
    Block wide;
    wide.solid = {};
    wide.solid.box({-12, 0, 0}, {20, 20, 10});
    EXPECT_NE(find(wide.run(), "stack.narrow"), nullptr);
    Block thin;
    thin.input.layers[0].slab_thickness = 9;
    const SimulationReport r = thin.run();
    EXPECT_NE(find(r, "stack.thin"), nullptr);
    EXPECT_NE(find(r, "gouge.stock"), nullptr);
    Block apart(true);
    apart.input.layers[1].z_bottom = 10.5;
    const SimulationReport gap = apart.run();
    ASSERT_NE(find(gap, "stack.gap"), nullptr) << codes(gap);
    EXPECT_EQ(find(gap, "stack.gap")->message,
              "layer 2 begins at z 10.5000, where the one below ends at 10.0000");
}

TEST(Simulate, TimeInClosedForm) {
    Machine m;
    m.acceleration = 1000, m.rapid_feed = 12000, m.max_feed = 9000, m.tool_change_s = 0;
    Program p;
    p.steps = {{0, 0, 0, 0, 1, true}, {100, 0, 0, 6000, 2, true}};
    // L/v + v/a; the last motion has half of the acceleration.
    EXPECT_NEAR(program_seconds(p, m), 100.0 / 100 + 100.0 / 500, 1e-9);
    p.steps[1].x = 1;  // too short to reach 100 mm/s
    EXPECT_NEAR(program_seconds(p, m), 2 * std::sqrt(1.0 / 500), 1e-9);
    p.steps = {{0, 0, 0, 0, 1, true}, {50, 0, 0, 6000, 2, true}, {100, 0, 0, 6000, 3, true}};
    EXPECT_NEAR(program_seconds(p, m), 1.15, 1e-9);  // straight on: no stop
    p.steps[2] = {0, 0, 0, 6000, 3, true};
    EXPECT_NEAR(program_seconds(p, m), 2 * 0.5 + 0.1 + 0.2, 1e-9);  // back: a full stop
    p.dwell_s = 3, m.tool_change_s = 15;
    EXPECT_NEAR(program_seconds(p, m), 19.3, 1e-9);
    // A corner of 90° is rounded by an arc of r = δ·c/(1 − c), c = cos 45°, that bears √(√¾·a·r).
    m.tool_change_s = p.dwell_s = 0;
    p.steps[2] = {50, 50, 0, 6000, 3, true};
    for (const double blend : {0.02, 0.1}) {
        p.blend = blend;
        const double c = std::sqrt(0.5), r = blend * c / (1 - c), v = std::sqrt(std::sqrt(0.75) * 1000 * r);
        // At 100 mm/s from rest, by the acceleration a, and slower for the corner by b.
        const auto leg = [&](double a, double b) {
            return (50 - r) / 100 + 100 / (2 * a) + (100 - v) * (100 - v) / (2 * b * 100);
        };
        EXPECT_NEAR(program_seconds(p, m), leg(1000, 1000) + leg(500, 500) + r * std::numbers::pi / 2 / v,
                    1e-9);
    }
    p.blend = 0;  // exactly by the corner: a stop
    EXPECT_NEAR(program_seconds(p, m), 2 * 0.5 + 0.1 + 0.2, 1e-9);
    // On from a rapid the machine stands still, though the way is straight.
    p.steps = {{0, 0, 0, 0, 1, true}, {50, 0, 0, 0, 2, true}, {100, 0, 0, 6000, 3, true}};
    const double both = 50.0 / 200 + 0.2 + 50.0 / 100 + 0.2;
    EXPECT_NEAR(program_seconds(p, m), both, 1e-9);
    // From where the program before has ended: up 20, across 50, of which y does 40; its tool stays.
    m.tool_change_s = 15;
    Program before = p;
    before.steps = {{0, 0, 0, 0, 1, true}, {30, 40, -20, 0, 2, true}};
    const double approach = 2 * std::sqrt(20.0 / 1000) + 50.0 / 200 + 200 / (1000 / 0.8);
    EXPECT_NEAR(program_seconds(p, m, &before), both + approach, 1e-9);
    before.tool = p.tool + 1;
    EXPECT_NEAR(program_seconds(p, m, &before), both + approach + 15, 1e-9);
}

// What is slanted is as fast as its slowest axis lets it be, and gathers speed so.
TEST(Simulate, TimeByTheSlowestAxis) {
    Machine m;
    m.acceleration = 1000, m.rapid_feed = 12000, m.max_feed = 9000, m.tool_change_s = 0;
    const auto seconds = [&](double x, double y, double z, double feed) {
        Program p;
        p.steps = {{0, 0, 0, 0, 1, true}, {x, y, z, feed, 2, true}};
        return program_seconds(p, m);
    };
    const auto expected = [](double length, double v, double a) { return length / v + v / (a / 2); };
    EXPECT_NEAR(seconds(300, 400, 0, 0), expected(500, 200, 1000 / 0.8), 1e-9);
    m.acceleration_y = 400;
    EXPECT_NEAR(seconds(300, 400, 0, 0), expected(500, 200, 400 / 0.8), 1e-9);
    EXPECT_NEAR(seconds(300, 0, 0, 0), expected(300, 200, 1000), 1e-9);
    m.rapid_z = 1500, m.acceleration_z = 300;
    EXPECT_NEAR(seconds(0, 0, 50, 0), expected(50, 25, 300), 1e-9);
    EXPECT_NEAR(seconds(0, 0, 50, 3000), expected(50, 25, 300), 1e-9);  // a feed as well
    EXPECT_NEAR(seconds(400, 0, 300, 0), expected(500, 25 / 0.6, 300 / 0.6), 1e-9);
    m.rapid_y = 3000;
    EXPECT_NEAR(seconds(300, 400, 0, 9000), expected(500, 50 / 0.8, 400 / 0.8), 1e-9);
    // The way from the program before.
    Program p, before;
    p.steps = {{0, 0, 0, 0, 1, true}}, before.steps = {{0, 100, -30, 0, 1, true}};
    EXPECT_NEAR(program_seconds(p, m, &before), 30 / 25.0 + 25 / 300.0 + 100 / 50.0 + 50 / 400.0, 1e-9);
}

// Of lists of programs in which each may come several times: what is called the same is so in every value and
// comes in the same order, and of a list that is as it was nothing is other, anywhere.
TEST(ProgramChanges, WhatStaysIsKnownAgain) {
    std::mt19937 random(test::seed());
    std::vector<Program> pool(3);
    for (Program& program : pool)
        for (int k = 0; k < 6; ++k)
            program.steps.push_back({static_cast<double>(random() % 50), static_cast<double>(random() % 50),
                                     10, 1000, static_cast<std::uint32_t>(k + 1), true});
    const auto drawn = [&] {
        std::vector<Program> programs;
        for (int layer = 0; layer < 2; ++layer)
            for (std::size_t n = 1 + random() % 4; n-- > 0;) {
                programs.push_back(pool[random() % pool.size()]);
                programs.back().layer = layer;
            }
        return programs;
    };
    const auto same = [](const Program& a, const Program& b) {
        return a.layer == b.layer &&
               std::equal(a.steps.begin(), a.steps.end(), b.steps.begin(), b.steps.end(),
                          [](const ProgramStep& s, const ProgramStep& t) {
                              return s.x == t.x && s.y == t.y && s.z == t.z;
                          });
    };
    CellGrid grid;
    grid.cell = 1, grid.nx = grid.ny = 50;
    for (int round = 0; round < 200; ++round) {
        const std::vector<Program> before = drawn(), now = drawn();
        const ProgramChanges none(before, before), changes(before, now);
        for (std::size_t i = 0; i < before.size(); ++i) {
            EXPECT_TRUE(none.is_same(i)) << round << " program " << i;
            EXPECT_EQ(none.before(i), i);
        }
        TileResult tile;
        tile.programs.assign(before.size(), TileProgram{});
        for (TileProgram& program : tile.programs) program.removed = 1;
        EXPECT_FALSE(none.touch(grid, 1e3, tile));
        std::optional<std::size_t> last;
        for (std::size_t i = 0; i < now.size(); ++i) {
            const std::optional<std::size_t> was = changes.before(i);
            if (!was) continue;
            EXPECT_TRUE(!last || *last < *was) << round;
            last = was;
            if (changes.is_same(i)) {
                EXPECT_TRUE(same(before[*was], now[i])) << round << " program " << i;
            }
        }
        if (same(before[0], now[0])) {
            EXPECT_TRUE(changes.is_same(0)) << round;
        }
    }
}

TEST(Simulate, MapsCancelMemoryAndNonsense) {
    Block block;
    block.options.maps = true;
    block.rough().steps.resize(8);  // most of the rings are missing
    SimulationReport r = block.run();
    ASSERT_EQ(r.layers[0].map.size(), static_cast<std::size_t>(r.nx) * static_cast<std::size_t>(r.ny));
    double most = 0;
    for (const float v : r.layers[0].map) most = std::max<double>(most, v);
    EXPECT_NEAR(most, r.layers[0].left.size, 1e-4);

    block.input.mesh = block.solid.mesh.view();
    Context cancelled;
    cancelled.cancel();
    try {
        (void)simulate(cancelled, block.input, StandingPart(cancelled, block.input.mesh), block.options);
        FAIL() << "was not cancelled";
    } catch (const Error& e) {
        EXPECT_EQ(e.kind(), ErrorKind::cancelled);
    }
    Context poor({.threads = 1, .memory_bytes = 1000});
    try {
        (void)simulate(poor, block.input, StandingPart(poor, block.input.mesh), block.options);
        FAIL() << "took more than it may";
    } catch (const Error& e) {
        EXPECT_EQ(e.code(), "memory.limit");
    }
    // What tiles keep of programs and layers counts beside the stock of the one that is simulated.
    const std::uint64_t one_stock = std::uint64_t{128} * 128 * 4 * (block.input.layers.size() + 4);
    Context tight({.threads = 1, .memory_bytes = one_stock + 64});
    Context context;
    const StandingPart part(context, block.input.mesh);
    SimulationOptions without_maps = block.options;
    without_maps.maps = false;
    EXPECT_THROW((void)simulate(tight, block.input, part, without_maps), Error);
    SimulationInput nonsense = block.input;
    nonsense.layers[0].z_top = nonsense.layers[0].z_bottom;
    EXPECT_THROW((void)simulate(context, nonsense, part, block.options), Error);
    nonsense = block.input;
    nonsense.stock_max[0] = nonsense.stock_min[0];
    EXPECT_THROW((void)simulate(context, nonsense, part, block.options), Error);
}
