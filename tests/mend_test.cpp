// The loop from a proof back into the plan: every kind of fault, made on purpose in a good plan, is mended,
// and the proof from text says so.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <stdexcept>
#include <string>
#include <tuple>

#include "engine/mend/free_cutter.h"
#include "engine/mend/patches.h"
#include "engine/mend/touch_up.h"
#include "engine/schedule/schedule.h"
#include "io/slabwright.h"
#include "io/write/stl_writer.h"
#include "tests/support/files.h"
#include "tests/support/height_field.h"
#include "tests/support/seed.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

/// Hills over 60 × 60 mm, none steeper than about 60°.
Mesh hills(Context& context) {
    return test::height_field(context, 60, 1.0,
                              [](double x, double y) { return 12 + 4 * std::sin(x / 6) * std::cos(y / 7); });
}

Tool ball(double diameter) {
    Tool tool;
    tool.number = 1;
    tool.kind = ToolKind::ball;
    tool.diameter = tool.shank_diameter = diameter;
    tool.plunges = true;
    tool.flute_length = 30;
    tool.stickout = 40;
    tool.holder_diameter = 30;
    return tool;
}

double xy(double mm) { return std::round(mm * 1e4) / 1e4; }

/// Straight moves between random places over the hills, some of them far into them, between rapids.
std::vector<Move> random_moves(std::mt19937_64& random) {
    std::uniform_real_distribution<double> across(-25, 25), height(6, 20);
    std::vector<Move> moves{{0, 0, to_units(30), 0}};
    for (int k = 0; k < 6; ++k)
        moves.push_back(
            {to_units(xy(across(random))), to_units(xy(across(random))), to_units(xy(height(random))), 1000});
    moves.push_back({moves.back().x, moves.back().y, to_units(30), 0});
    return moves;
}

TEST(Mend, ALiftedWayIsFreeNeverLowerAndEndsWhereItDid) {
    Context context;
    const Mesh mesh = hills(context);
    const StandingPart part(context, mesh.view());
    const Tool tool = ball(6);
    const FreeCutter cutter(part, 100, tool, 0, 0.008);
    std::mt19937_64 random(test::seed());
    for (int round = 0; round < 20; ++round) {
        const std::vector<Move> moves = random_moves(random);
        const MovePatch patch = lifted_over_part(moves, 1, moves.size() - 1, cutter);
        ASSERT_FALSE(patch.moves.empty());
        const Move &first = moves.front(), &end = moves[moves.size() - 2];
        EXPECT_EQ(std::tie(patch.moves.back().x, patch.moves.back().y), std::tie(end.x, end.y));
        const Move* before = &first;
        for (const Move& m : patch.moves) {
            const Point3 a{to_mm(before->x), to_mm(before->y), to_mm(before->z)},
                b{to_mm(m.x), to_mm(m.y), to_mm(m.z)};
            EXPECT_LE(part.ball(100, a, b, 3, 0.01).depth, 0.01) << "round " << round;
            before = &m;
        }
        // Every point of it lies straight over a point of the way, no lower.
        for (const Move& m : patch.moves) {
            double over = -1e300;
            for (std::size_t k = 1; k + 1 < moves.size(); ++k) {
                const double ax = to_mm(moves[k - 1].x), ay = to_mm(moves[k - 1].y),
                             az = to_mm(moves[k - 1].z), dx = to_mm(moves[k].x) - ax,
                             dy = to_mm(moves[k].y) - ay, dz = to_mm(moves[k].z) - az;
                const double t = std::clamp(
                    ((to_mm(m.x) - ax) * dx + (to_mm(m.y) - ay) * dy) / std::max(1e-12, dx * dx + dy * dy),
                    0.0, 1.0);
                if (std::hypot(ax + t * dx - to_mm(m.x), ay + t * dy - to_mm(m.y)) < 1e-3)
                    over = std::max(over, to_mm(m.z) - (az + t * dz));
            }
            EXPECT_GE(over, -1e-3);
        }
    }
}

TEST(Mend, TheLiftIsTheLeastThatIsFree) {
    Context context;
    const Mesh mesh = hills(context);
    const StandingPart part(context, mesh.view());
    const FreeCutter cutter(part, 100, ball(8), 0, 0.005);
    std::mt19937_64 random(test::seed());
    std::uniform_real_distribution<double> across(-22, 22), height(5, 16);
    int lifted = 0;
    for (int k = 0; k < 200; ++k) {
        const Point3 at{across(random), across(random), height(random)};
        const double up = cutter.lift(at);
        const Point3 free{at[0], at[1], at[2] + up}, less{at[0], at[1], at[2] + up - 2 * FreeCutter::kLift};
        EXPECT_TRUE(cutter.is_free(free, free));
        if (up <= 2 * FreeCutter::kLift) continue;
        ++lifted;
        EXPECT_FALSE(cutter.is_free(less, less));
    }
    EXPECT_GT(lifted, 50);
}

/// A hill with a pocket in it, 60 × 60 mm and 30 mm high.
Mesh pocket(Context& context) {
    return test::height_field(context, 24, 2.5, [](double x, double y) {
        if (std::abs(x) < 11 && std::abs(y + 4) < 11) return 9.0;
        return std::max(20.0, 30 - 0.02 * (x * x + y * y));
    });
}

/// A good plan of a part, into which faults are put.
class ProvenPlan : public testing::Test {
protected:
    static void SetUpTestSuite() {
        Context context;
        folder_ = new support::TemporaryFolder;
        write_stl(*folder_ / "part.stl", pocket(context));
        job_ = new Job;
        job_->bonding.accept_weak = true;
        pattern_ = new std::shared_ptr<Pattern>(read_pattern(context, *folder_ / "part.stl", *job_));
        good_ = new Plan(plan(context, **pattern_, *job_));
    }
    static void TearDownTestSuite() { delete good_, delete pattern_, delete job_, delete folder_; }

    ProvenPlan() : plan_(*good_) {}

    /// The first operation of a kind that has so many moves.
    Operation& operation(OperationKind kind, std::size_t least_moves = 30) {
        for (Layer& layer : plan_.layers)
            for (Operation& op : layer.operations)
                if (op.kind == kind && op.moves.size() >= least_moves) return op;
        throw std::runtime_error("the plan has no such operation");
    }

    std::set<std::string> faults_of(const Plan& plan) {
        const VerifyResult faulty = write_verified(context_, plan, *folder_ / "out", *pattern_);
        std::set<std::string> codes;
        for (const Diagnostic& d : faulty.violations) codes.insert(d.code);
        return codes;
    }

    /// That the plan has this fault, that write_proven() mends it, and that verify() agrees.
    void expect_mended(const std::string& code) {
        schedule(plan_);
        EXPECT_TRUE(faults_of(plan_).contains(code)) << code;
        const std::string out = *folder_ / "out";
        const Plan faulty = plan_;
        const VerifyResult proven = write_proven(context_, plan_, out, *pattern_);
        for (const Diagnostic& d : proven.violations) ADD_FAILURE() << d.code << ": " << d.message;
        EXPECT_TRUE(proven.passed);
        EXPECT_TRUE(proven.written);
        // What was not simulated again is what a simulation from scratch finds.
        const std::string verdict = support::slurp(out + "/verify.json");
        EXPECT_TRUE(verify(context_, out, *folder_ / "part.stl").passed);
        EXPECT_EQ(support::slurp(out + "/verify.json"), verdict);
        // What lies there is the plan that was mended.
        const nlohmann::json json = nlohmann::json::parse(support::slurp(out + "/plan.json"));
        int rounds = 0;
        for (std::size_t l = 0; l < plan_.layers.size(); ++l) {
            EXPECT_EQ(json.at("layers")[l].at("rounds"), plan_.layers[l].rounds);
            rounds += plan_.layers[l].rounds;
        }
        EXPECT_GE(rounds, 1);
        std::ptrdiff_t told = 0;
        for (const Diagnostic& d : plan_.diagnostics) {
            if (d.code != "proof.round") continue;
            ++told;
            std::printf("%s\n", d.message.c_str());
        }
        EXPECT_GE(told, rounds);
        // The same on any number of threads.
        const auto bytes = support::tree(out);
        for (const int threads : {1, 4}) {
            Context context({.threads = threads});
            Plan again = faulty;
            EXPECT_TRUE(write_proven(context, again, out, *pattern_).passed);
            EXPECT_EQ(support::tree(out), bytes) << threads << " threads";
        }
    }

    static inline support::TemporaryFolder* folder_ = nullptr;
    static inline Job* job_ = nullptr;
    static inline std::shared_ptr<Pattern>* pattern_ = nullptr;
    static inline Plan* good_ = nullptr;
    Context context_{{.threads = 2}};
    Plan plan_;
};

TEST_F(ProvenPlan, APlanThatPassesIsWrittenAsItIs) {
    EXPECT_TRUE(write_proven(context_, plan_, *folder_ / "a", *pattern_).passed);
    EXPECT_TRUE(write_verified(context_, *good_, *folder_ / "b", *pattern_).passed);
    EXPECT_EQ(support::tree(*folder_ / "a"), support::tree(*folder_ / "b"));
    for (const Layer& layer : plan_.layers) EXPECT_EQ(layer.rounds, 0);
}

TEST_F(ProvenPlan, GougesAreRaised) {
    Operation& op = operation(OperationKind::finish, 60);
    std::size_t lowered = 0;
    for (std::size_t k = op.moves.size() / 3; k + 1 < op.moves.size() && lowered < 12; ++k)
        if (op.moves[k].feed != 0 && op.moves[k - 1].feed != 0 && !op.moves[k].is_arc() &&
            !op.moves[k + 1].is_arc())
            op.moves[k].z -= to_units(0.5), ++lowered;
    expect_mended("gouge.cutter");
}

TEST_F(ProvenPlan, WhatIsLeftIsTouchedUp) {
    // Nobody cuts the corners that the ball leaves.
    std::size_t dropped = 0;
    for (Layer& layer : plan_.layers)
        dropped += std::erase_if(layer.operations, [](const Operation& op) {
            return op.kind == OperationKind::corner || op.purpose == "what is left";
        });
    EXPECT_GT(dropped, 0U);
    expect_mended("left.missed");
}

TEST_F(ProvenPlan, AnOperationThatRemovesNothingIsDropped) {
    Layer& layer = plan_.layers.front();
    const std::size_t operations = layer.operations.size();
    layer.operations.push_back(layer.operations.back());
    expect_mended("operation.empty");
    EXPECT_EQ(plan_.layers.front().operations.size(), operations);
}

TEST_F(ProvenPlan, ProgramsThatAreNumberedThroughAreWrittenAgainWhereTheNumbersChange) {
    // Over a hundred programs of a layer are numbered through; when those that cut nothing are dropped, every
    // program has another number.
    Job job = *job_;
    job.machine.post = Post::fanuc;
    job.slabs.thicknesses = {12};
    const std::shared_ptr<Pattern> pattern = read_pattern(context_, *folder_ / "part.stl", job);
    Plan made = plan(context_, *pattern, job);
    ASSERT_GE(made.layers.size(), 2U);
    const int number = made.layers[1].operations.front().number;
    EXPECT_EQ(number, 201);
    Layer& layer = made.layers.front();
    for (int k = 0; k < 100; ++k) layer.operations.push_back(layer.operations.back());
    schedule(made);
    EXPECT_NE(made.layers[1].operations.front().number, number);
    const std::string out = *folder_ / "numbered";
    const VerifyResult proven = write_proven(context_, made, out, pattern);
    for (const Diagnostic& d : proven.violations) ADD_FAILURE() << d.code << ": " << d.message;
    EXPECT_TRUE(proven.passed);
    EXPECT_EQ(made.layers[1].operations.front().number, number);
    EXPECT_TRUE(verify(context_, out, *folder_ / "part.stl").passed);
}

TEST_F(ProvenPlan, RapidsThatMeetStockGoAboveIt) {
    Layer& layer = plan_.layers.front();
    const auto op = std::find_if(layer.operations.begin(), layer.operations.end(),
                                 [](const Operation& o) { return o.kind == OperationKind::rough; });
    ASSERT_NE(op, layer.operations.end());
    std::vector<Move>& moves = op->moves;
    for (std::size_t k = 2; k + 2 < moves.size(); ++k)
        if (moves[k].feed == 0 && moves[k - 1].feed == 0 && moves[k].z == moves[k - 1].z &&
            moves[k].z > to_units(layer.z_top))
            moves[k - 1].z = moves[k].z = to_units(layer.z_top - 3);
    expect_mended("rapid.through_stock");
}

TEST_F(ProvenPlan, WhatIsTooDeepIsCutInPasses) {
    operation(OperationKind::rough).stepdown *= 0.4;
    expect_mended("cut.too_deep");
}

TEST_F(ProvenPlan, ACoreThatComesDownOnStockComesOnARamp) {
    // The ramps and helices of the roughing end somewhat over where they lead, and straight down from there.
    Operation& op = operation(OperationKind::rough);
    std::vector<Move>& moves = op.moves;
    constexpr double kEnds = 0.8;  // mm
    for (std::size_t k = 1; k + 1 < moves.size(); ++k) {
        const bool slopes = moves[k].feed != 0 && moves[k].z < moves[k - 1].z &&
                            (moves[k].x != moves[k - 1].x || moves[k].y != moves[k - 1].y);
        if (!slopes) continue;
        std::size_t end = k;
        while (end + 1 < moves.size() && moves[end + 1].feed != 0 && moves[end + 1].z < moves[end].z) ++end;
        const std::int32_t lowest = moves[end].z + to_units(kEnds);
        for (; k < end; ++k) moves[k].z = std::max(moves[k].z, lowest);
    }
    expect_mended("plunge.not_center_cutting");
}

TEST_F(ProvenPlan, WhatCannotBeMendedIsRefusedAndLeavesNothing) {
    // Nobody mills the top layer.
    plan_.layers.pop_back();
    schedule(plan_);
    const Plan faulty = plan_;
    const VerifyResult refused = write_proven(context_, plan_, *folder_ / "never", *pattern_);
    EXPECT_FALSE(refused.passed);
    EXPECT_FALSE(refused.written);
    ASSERT_FALSE(refused.refusals.empty());
    for (const Error& e : refused.refusals) {
        EXPECT_EQ(e.kind(), ErrorKind::no_plan);
        EXPECT_NE(e.place().find("part.stl"), std::string::npos);
        EXPECT_FALSE(e.remedy().empty());
        EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
    }
    EXPECT_TRUE(support::tree(*folder_ / "never").empty());
    // Asked for, it is written with its verdict.
    plan_ = faulty;
    const VerifyResult kept = write_proven(context_, plan_, *folder_ / "kept", *pattern_, true);
    EXPECT_FALSE(kept.passed);
    EXPECT_TRUE(kept.written);
    EXPECT_TRUE(support::tree(*folder_ / "kept").contains("verify.json"));
}

}  // namespace
}  // namespace slabwright
