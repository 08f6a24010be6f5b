// A build killed after any step goes on from what lies on disk and ends the same; a spoilt layer is faced off
// and made again, and the stack ends the same.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <set>

#include "engine/planner/remake.h"
#include "engine/simulate/face_off_proof.h"
#include "engine/simulate/planned_build.h"
#include "engine/simulate/resume_point.h"
#include "io/posts/gcode_reader.h"
#include "io/posts/gcode_writer.h"
#include "io/read/sequence_reader.h"
#include "io/resume.h"
#include "io/text/progress_json.h"
#include "io/write/sequence_json.h"
#include "kernels/errors.h"
#include "tests/support/block_build.h"
#include "tests/support/seed.h"
#include "tests/support/shuffled_steps.h"

namespace slabwright {
namespace {

using support::block;
using support::random_job;
using support::random_shape;
using support::stated;

std::string first_message(const std::vector<Violation>& found) {
    return found.empty() ? "" : found.front().code + ": " + found.front().message;
}

/// What stands in the end, by nothing but the steps' own words: each slab with where it lies and the programs
/// that ran while it was on top.
std::vector<std::string> stack_of(const std::vector<SequenceStep>& steps) {
    std::vector<std::string> stack;
    std::vector<int> layers;
    for (const SequenceStep& step : steps) {
        if (step.action == "place") {
            stack.push_back("layer " + std::to_string(step.layer));
            layers.push_back(step.layer);
            for (const auto& [key, value] : step.numbers)
                if (key == "z_bottom_mm") stack.back() += " at " + std::to_string(value);
        }
        if (step.action == "face" || step.action == "mill")
            for (const auto& [key, value] : step.words)
                if (key == "program" && !stack.empty()) stack.back() += ", " + value;
        while (step.action == "face_off" && !layers.empty() && layers.back() == step.layer) {
            layers.pop_back();
            stack.pop_back();
        }
    }
    return stack;
}

/// A build under way: the sequence in force and what its programs that face layers off say.
struct UnderWay {
    BuildPlan plan;
    BuildSequence sequence;
};

BuildState state_after(const UnderWay& build, std::size_t steps) {
    ReplayedBuild replayed = replay_steps(build.plan, build.sequence, {}, steps);
    EXPECT_EQ(first_message(replayed.violations), "");
    return std::move(replayed.state);
}

/// Reads back, from its text, a program that faces a layer off.
Program read_face_off(const Remake& made, std::size_t k, const std::string& file) {
    const Layer& layer = made.plan.layers[made.layers[k]];
    Program program = read_gcode(program_text(made.plan, layer, layer.operations[0]), file);
    const bool from_top = frame_of(made.plan.job.machine) == Frame::layer_top;
    for (ProgramStep& step : program.steps) step.z += from_top ? layer.z_top : 0;
    program.file = file;
    return program;
}

BlockToFaceOff block_of(const Remake& made, std::size_t k) {
    return {made.plan.stock_min, made.plan.stock_max, made.plan.layers[made.layers[k]].z_bottom, made.tops[k],
            made.most_mm};
}

/// The build with a layer made again; every program is proven from its text.
UnderWay remade(Context& context, const UnderWay& build, const BuildSequence& own, const BuildState& state,
                int layer, const std::string& folder) {
    const Remake made =
        remake_layer(context, {build.plan, build.sequence, own, state, layer, folder + "/nc/"});
    UnderWay again{build.plan, build.sequence};
    for (std::size_t k = 0; k < made.layers.size(); ++k) {
        const Layer& faced = made.plan.layers[made.layers[k]];
        const Program program = read_face_off(made, k, folder + "/nc/" + faced.operations[0].file);
        EXPECT_EQ(first_message(check_face_off(program, made.plan.job.tools[0], block_of(made, k))), "");
        PlannedProgram& planned = again.plan.face_offs.emplace_back();
        planned.file = program.file;
        planned.layer = made.layers[k];
        planned.kind = OperationKind::face;
        planned.tool = program.tool;
        planned.low = planned.high = faced.z_bottom;
        for (const ProgramStep& step : program.steps)
            if (std::isfinite(step.z)) planned.high = std::max(*planned.high, step.z);
    }
    again.sequence.steps = made.steps;
    again.sequence = read_sequence(sequence_json(again.sequence));
    return again;
}

TEST(Resume, KilledAfterAnyStepTheRestBringsAboutTheSame) {
    std::mt19937 random(test::seed());
    for (int round = 0; round < 40; ++round) {
        const Plan plan = block(random_job(random), random_shape(random));
        const UnderWay build{stated(plan), read_sequence(sequence_json(plan))};
        const std::size_t count = build.sequence.steps.size();
        const BuildState whole = state_after(build, count);
        for (std::size_t k = 0; k <= count; ++k) {
            BuildProgress progress;
            progress.after = static_cast<int>(k);
            progress.state = state_after(build, k);
            const std::string text = progress_json(progress, build.plan, build.sequence);
            const BuildState read = parse_progress_state(text, build.plan, build.sequence, "progress.json");
            ASSERT_EQ(read, progress.state) << round << ' ' << k;
            const ReplayedBuild rest = replay_steps(build.plan, build.sequence, read, count);
            ASSERT_EQ(first_message(rest.violations), "") << round << ' ' << k;
            ASSERT_EQ(rest.state, whole) << round << ' ' << k;
        }
    }
}

// Each part of the state is needed: where one is lost, the rest is refused or ends otherwise.
TEST(Resume, NoPartOfTheStateIsIdle) {
    Job job;
    job.machine.feed_height = 60;
    const Plan plan = block(job, {4, 2, true});
    const UnderWay build{stated(plan), read_sequence(sequence_json(plan))};
    const std::size_t count = build.sequence.steps.size();
    const BuildState whole = state_after(build, count);
    const std::set<std::string> quantities{"slabs_taken", "slabs_placed",   "programs_begun",
                                           "feed_slabs",  "feed_height_mm", "handler_mm",
                                           "tool",        "table_load_kg"};
    std::map<std::string, int> matters;
    for (std::size_t k = 0; k <= count; ++k) {
        BuildProgress progress;
        progress.after = static_cast<int>(k);
        progress.state = state_after(build, k);
        const nlohmann::json good =
            nlohmann::json::parse(progress_json(progress, build.plan, build.sequence));
        for (const auto& [key, value] : good["state"].items()) {
            nlohmann::json changed = good;
            nlohmann::json& part = changed["state"][key];
            if (value.is_boolean()) part = !value.get<bool>();
            else if (key == "programs" && !value.empty()) part.erase(value.begin().key());
            else if (quantities.contains(key)) part = value.get<double>() >= 1 ? 0 : 1;
            else if (value.is_number() && key != "board_thickness_mm") part = nullptr;
            else if (value.is_number()) part = 1;
            else continue;
            const BuildState read =
                parse_progress_state(changed.dump(), build.plan, build.sequence, "progress.json");
            EXPECT_NE(read, progress.state) << key;
            const ReplayedBuild rest = replay_steps(build.plan, build.sequence, read, count);
            matters[key] += !rest.violations.empty() || rest.state != whole;
        }
    }
    EXPECT_EQ(matters.size(), 30U);
    for (const auto& [key, times] : matters) EXPECT_GT(times, 0) << key;
}

TEST(Resume, EveryLayerCanBeMadeAgainAndTheStackEndsTheSame) {
    std::mt19937 random(test::seed());
    Context context({.threads = 1});
    int made = 0, twice = 0;
    for (int round = 0; round < 24; ++round) {
        const Plan plan = block(random_job(random), random_shape(random));
        const UnderWay first{stated(plan), read_sequence(sequence_json(plan))};
        const std::vector<std::string> whole = stack_of(first.sequence.steps);
        for (int n = 0; n < 4; ++n) {
            UnderWay build = first;
            for (int generation = 1; generation <= 2; ++generation) {
                const std::size_t k = random() % build.sequence.steps.size();
                const BuildState state = state_after(build, k);
                const PlannedBuild heights(build.plan);
                const auto top = heights.whole_layer(state);
                if (!top || state.to_press || state.unloaded) break;
                const int layer = build.plan.layers[random() % (*top + 1)].index;
                SCOPED_TRACE(testing::Message() << "round " << round << " after " << k << " layer " << layer
                                                << " generation " << generation);
                build = remade(context, build, first.sequence, state, layer,
                               "resume_00" + std::to_string(generation));
                const std::vector<SequenceStep>& steps = build.sequence.steps;
                ASSERT_EQ(first_message(replay_build(build.plan, build.sequence)), "");
                ASSERT_EQ(stack_of(steps), whole);
                const BuildState end = state_after(build, steps.size());
                EXPECT_EQ(end.placed, whole.size());
                EXPECT_TRUE(end.unloaded);
                // Every order that the needs allow is as good.
                BuildSequence other = build.sequence;
                nlohmann::json text = nlohmann::json::parse(sequence_json(other));
                text["steps"] = support::shuffled(text["steps"], random);
                ASSERT_EQ(first_message(replay_build(build.plan, read_sequence(text.dump()))), "");
                // And it may be killed anywhere too.
                const std::size_t again = random() % (steps.size() + 1);
                const ReplayedBuild rest =
                    replay_steps(build.plan, build.sequence, state_after(build, again), steps.size());
                EXPECT_EQ(first_message(rest.violations), "");
                EXPECT_EQ(rest.state, end);
                ++(generation == 1 ? made : twice);
            }
        }
    }
    std::printf("%d layers made again, %d of them a second time\n", made, twice);
    EXPECT_GT(made, 20);
    EXPECT_GT(twice, 5);
}

// Killed between the change of tool for a program that faces off and that program, and made again then.
TEST(Resume, ALayerIsMadeAgainWhereTheFacingOffHadNotBegun) {
    Context context({.threads = 1});
    const Plan plan = block(Job{}, {3, 1, false});
    const UnderWay first{stated(plan), read_sequence(sequence_json(plan))};
    std::size_t k = first.sequence.steps.size();
    while (first.sequence.steps[k - 1].action != "mill") --k;
    const UnderWay build = remade(context, first, first.sequence, state_after(first, k), 2, "resume_001");
    std::size_t change = k;
    while (build.sequence.steps[change].action != "tool_change") ++change;
    ASSERT_EQ(build.sequence.steps[change + 1].action, "face_off");
    const UnderWay again =
        remade(context, build, first.sequence, state_after(build, change + 1), 1, "resume_002");
    EXPECT_EQ(first_message(replay_build(again.plan, again.sequence)), "");
    EXPECT_EQ(stack_of(again.sequence.steps), stack_of(first.sequence.steps));
}

TEST(Resume, ARemadeSequenceThatIsChangedIsTold) {
    Context context({.threads = 1});
    Job job;
    job.machine.feed_height = 60;
    const Plan plan = block(job, {4, 1, false});
    const UnderWay first{stated(plan), read_sequence(sequence_json(plan))};
    std::size_t k = 0;  // after the first program of layer 3
    while (first.sequence.steps[k].layer != 3 || first.sequence.steps[k].action != "face") ++k;
    const UnderWay build = remade(context, first, first.sequence, state_after(first, k + 1), 2, "resume_001");
    using Steps = std::vector<SequenceStep>;
    const auto nth = [](Steps& steps, const char* action, int n) {
        return std::find_if(steps.begin(), steps.end(),
                            [&](const SequenceStep& s) { return s.action == action && n-- == 0; });
    };
    // A program that goes lower by so much, and a step that says so.
    const auto reach = [&](UnderWay& b, int n, double by) {
        *b.plan.face_offs[static_cast<std::size_t>(n)].low += by;
        for (auto& [key, value] : nth(b.sequence.steps, "face_off", n)->numbers)
            if (key == "z_low_mm") value += by;
    };
    struct Case {
        const char* name;
        std::function<void(UnderWay&)> change;
        const char* code;
    };
    const std::vector<Case> cases{
        {"not cleared", [&](UnderWay& b) { nth(b.sequence.steps, "clear", 0)->action = "unload"; },
         "sequence.order"},
        {"another layer", [&](UnderWay& b) { nth(b.sequence.steps, "face_off", 0)->layer = 1; },
         "sequence.layer"},
        {"below the joint", [&](UnderWay& b) { reach(b, 1, -0.1); }, "sequence.height"},
        {"above the joint", [&](UnderWay& b) { reach(b, 0, 0.1); }, "sequence.height"},
        {"not what the step says", [](UnderWay& b) { *b.plan.face_offs[0].high += 1; }, "sequence.height"},
        {"another tool", [](UnderWay& b) { b.plan.face_offs[0].tool = 2; }, "sequence.tool"},
        {"no such program", [](UnderWay& b) { b.plan.face_offs[0].file += "x"; }, "sequence.program"},
        {"the layer under it", [](UnderWay& b) { b.plan.face_offs[0].layer = 0; }, "sequence.order"},
        {"not waited for", [&](UnderWay& b) { nth(b.sequence.steps, "face_off", 1)->needs = {1}; },
         "sequence.needs"},
        {"cleared too late to be safe", [&](UnderWay& b) { nth(b.sequence.steps, "clear", 0)->needs = {1}; },
         "sequence.needs"}};
    for (const Case& c : cases) {
        UnderWay changed = build;
        c.change(changed);
        std::string codes;
        for (const Violation& v : replay_build(changed.plan, changed.sequence)) codes += v.code + " ";
        EXPECT_NE(codes.find(c.code), std::string::npos) << c.name << ": " << codes;
    }
}

TEST(FaceOffProof, EachFaultIsToldAsWhatItIs) {
    Context context({.threads = 1});
    const Plan plan = block(Job{}, {3, 1, false});
    const UnderWay build{stated(plan), read_sequence(sequence_json(plan))};
    std::size_t k = build.sequence.steps.size();
    while (build.sequence.steps[k - 1].action != "mill") --k;
    const Remake made = remake_layer(
        context, {build.plan, build.sequence, build.sequence, state_after(build, k), 3, "resume_001/nc/"});
    ASSERT_EQ(made.layers.size(), 1U);
    EXPECT_EQ(made.plan.layers[2].operations.back().file, "F001_L003_face_off_T1.ngc");
    const Program good = read_face_off(made, 0, "F001.ngc");
    const BlockToFaceOff whole = block_of(made, 0);
    const Tool& tool = made.plan.job.tools[0];
    EXPECT_EQ(first_message(check_face_off(good, tool, whole)), "");
    const auto code = [&](const std::function<void(Program&)>& change) {
        Program changed = good;
        change(changed);
        const std::vector<Violation> found = check_face_off(changed, tool, whole);
        return found.empty() ? std::string() : found.front().code;
    };
    EXPECT_EQ(code([&](Program& p) {
                  for (ProgramStep& s : p.steps)
                      if (s.z < whole.joint + 0.001) s.z -= 0.05;
              }),
              "face_off.joint");
    EXPECT_EQ(code([&](Program& p) {
                  for (ProgramStep& s : p.steps) s.feed = 0;
              }),
              "face_off.rapid");
    EXPECT_EQ(code([](Program& p) {
                  for (ProgramStep& s : p.steps) s.spindle = false;
              }),
              "face_off.rapid");
    EXPECT_EQ(code([&](Program& p) {  // the highest pass is left out
                  std::erase_if(p.steps, [&](const ProgramStep& s) {
                      return s.feed > 0 && s.z > whole.top - whole.most_mm - 0.5 && s.z < whole.top;
                  });
              }),
              "face_off.depth");
    EXPECT_EQ(code([](Program& p) { p.steps.resize(p.steps.size() / 2); }), "face_off.left");
}

/// The code of a refusal to make a layer again, with its remedy checked to be there.
std::string refusal(Context& context, const UnderWay& build, std::size_t after, int layer) {
    try {
        (void)remake_layer(context, {build.plan, build.sequence, build.sequence, state_after(build, after),
                                     layer, "resume_001/nc/"});
    } catch (const Error& e) {
        EXPECT_FALSE(e.remedy().empty());
        return e.code();
    }
    return "";
}

TEST(Resume, WhatCannotBeMadeAgainIsRefused) {
    Context context({.threads = 1});
    const Plan plan = block(Job{}, {3, 2, false});  // layer 2 has two slabs
    const UnderWay build{stated(plan), read_sequence(sequence_json(plan))};
    const auto after = [&](const char* action, int layer, int n = 0) {
        for (std::size_t i = 0; i < build.sequence.steps.size(); ++i)
            if (build.sequence.steps[i].action == action && build.sequence.steps[i].layer == layer &&
                n-- == 0)
                return i + 1;
        ADD_FAILURE() << action;
        return std::size_t{0};
    };
    EXPECT_EQ(refusal(context, build, after("mill", 1), 4), "resume.layer");
    EXPECT_EQ(refusal(context, build, after("mill", 1), 0), "resume.layer");
    EXPECT_EQ(refusal(context, build, after("mill", 1), 2), "resume.layer") << "not begun";
    EXPECT_EQ(refusal(context, build, after("mount_board", 1), 1), "resume.layer") << "not begun";
    EXPECT_EQ(refusal(context, build, after("place", 1), 1), "resume.unpressed");
    EXPECT_EQ(refusal(context, build, after("press", 2), 2), "resume.incomplete");
    EXPECT_EQ(refusal(context, build, after("press", 2), 1), "resume.incomplete");
    EXPECT_EQ(refusal(context, build, after("unload", 3), 3), "resume.unloaded");
    EXPECT_EQ(refusal(context, build, after("press", 2, 1), 2), "");
    UnderWay other = build;
    other.plan.job_stated = false;
    EXPECT_EQ(refusal(context, other, after("mill", 1), 1), "resume.job");
    other = build;
    other.plan.tools[0].kind = ToolKind::flat;
    EXPECT_NE(refusal(context, other, after("mill", 1), 1), "") << "no face mill";
}

TEST(ResumePoint, SaysWhatTheMachineIsFoundLike) {
    Job job;
    job.bonding.open_time_s = 100;
    const Plan plan = block(job, {2, 1, false});
    const UnderWay build{stated(plan), read_sequence(sequence_json(plan))};
    const auto point = [&](const char* action, int layer, double waited) {
        for (std::size_t i = 0; i < build.sequence.steps.size(); ++i)
            if (build.sequence.steps[i].action == action && build.sequence.steps[i].layer == layer)
                return resume_point(build.plan, build.sequence, state_after(build, i + 1), waited);
        ADD_FAILURE() << action;
        return ResumePoint{};
    };
    const auto says = [](const ResumePoint& p, const char* words) {
        return std::any_of(p.checks.begin(), p.checks.end(),
                           [&](const std::string& c) { return c.find(words) != std::string::npos; });
    };
    ResumePoint p = point("mount_board", 1, 0);
    EXPECT_EQ(p.layer, 0);
    EXPECT_DOUBLE_EQ(p.stack_mm, job.machine.base_board_thickness);
    p = point("touch_off", 1, 0);  // a raw slab of 19 mm on a board of 19 mm
    EXPECT_DOUBLE_EQ(p.stack_mm, 38);
    EXPECT_DOUBLE_EQ(p.tolerance_mm, 0.4);
    EXPECT_FALSE(p.faced);
    ASSERT_TRUE(p.touch_off_mm);
    EXPECT_NEAR(*p.touch_off_mm, 0.5, 1e-9) << "it is faced down by half a millimetre";
    p = point("face", 1, 0);
    EXPECT_DOUBLE_EQ(p.stack_mm, 37.5);
    EXPECT_DOUBLE_EQ(p.tolerance_mm, 0.2);
    EXPECT_TRUE(p.faced);
    EXPECT_EQ(p.tool, 1);
    EXPECT_NEAR(*p.touch_off_mm, 0, 1e-9);
    EXPECT_NEAR(*p.nose_mm, plan.job.tools[0].stickout, 1e-9) << "in the first layer z = 0 is the machine's";
    p = point("glue", 2, 50);
    EXPECT_EQ(p.glue, GlueState::spread);
    EXPECT_FALSE(p.glue_lost);
    EXPECT_TRUE(says(p, "of its open time of 100 s"));
    p = point("glue", 2, 101);
    EXPECT_TRUE(p.glue_lost);
    EXPECT_TRUE(says(p, "longer than its open time of 100 s"));
    p = point("place", 2, 101);
    EXPECT_EQ(p.glue, GlueState::unpressed);
    EXPECT_TRUE(p.glue_lost);
    EXPECT_TRUE(says(p, "--remake 2"));
    EXPECT_FALSE(p.touch_off_mm) << "the table is still where layer 1 was cut";
    p = point("press", 2, 1000);
    EXPECT_EQ(p.glue, GlueState::none);
    EXPECT_FALSE(p.glue_lost);
    p = point("unload", 2, 0);
    EXPECT_TRUE(says(p, "off the machine"));
}

// Heights in words are those in numbers, to a thousandth of a millimetre and without zeros at their end.
TEST(ResumePoint, SaysItsHeightsInMillimetres) {
    Job job;
    job.machine.base_board_thickness = 18.1234;
    const Plan plan = block(job, {3, 1, false});
    const UnderWay build{stated(plan), read_sequence(sequence_json(plan))};
    const auto written = [](double value) {
        const auto thousandths = std::llround(value * 1000);
        std::string text = fmt::format("{}{}.{:03d}", thousandths < 0 ? "-" : "",
                                       std::abs(thousandths) / 1000, std::abs(thousandths) % 1000);
        while (text.back() == '0') text.pop_back();
        if (text.back() == '.') text.pop_back();
        return text;
    };
    int told = 0, touched = 0;
    for (std::size_t i = 1; i <= build.sequence.steps.size(); ++i) {
        const ResumePoint p = resume_point(build.plan, build.sequence, state_after(build, i), 0);
        for (const std::string& check : p.checks) {
            if (check.find("the stack stands") == 0) {
                EXPECT_EQ(
                    check.find(fmt::format("the stack stands {} mm above the table, base board included, "
                                           "to {} mm",
                                           written(p.stack_mm), written(p.tolerance_mm))),
                    0U)
                    << check;
                ++told;
            }
            if (check.find("the stack's top lies at") == std::string::npos) continue;
            EXPECT_NE(check.find(fmt::format("lies at z = {} mm in the programs", written(*p.touch_off_mm))),
                      std::string::npos)
                << check;
            ++touched;
        }
    }
    EXPECT_GT(told, 10);
    EXPECT_GT(touched, 10);
}

// Whoever measures the stack by a program reads these numbers, not the words.
TEST(ResumePoint, IsWrittenForProgramsAsItIs) {
    Job job;
    job.machine.magazine = 2;
    const Plan plan = block(job, {2, 1, false});
    const UnderWay build{stated(plan), read_sequence(sequence_json(plan))};
    for (std::size_t i = 0; i <= build.sequence.steps.size(); ++i) {
        const auto p =
            std::make_shared<ResumePoint>(resume_point(build.plan, build.sequence, state_after(build, i), 0));
        ResumeStatus status;
        status.sequence = "sequence.json";
        status.after = static_cast<int>(i);
        status.point = p;
        status.steps = build.sequence.steps;
        const auto document = nlohmann::json::parse(resume_json(status));
        const auto& machine = document.at("machine");
        for (const auto& [key, value] : {std::pair{"bonded_mm", p->bonded_mm},
                                         {"stack_mm", p->stack_mm},
                                         {"tolerance_mm", p->tolerance_mm},
                                         {"load_kg", p->load_kg}})
            EXPECT_NEAR(machine.at(key).get<double>(), value, 1e-3) << key << " after " << i << " steps";
        for (const auto& [key, value] : {std::pair{"table_height_mm", p->table_mm},
                                         {"work_offset_z_mm", p->work_offset_mm},
                                         {"touch_off_mm", p->touch_off_mm},
                                         {"spindle_nose_mm", p->nose_mm}}) {
            ASSERT_EQ(machine.at(key).is_null(), !value) << key << " after " << i << " steps";
            if (!value) continue;
            EXPECT_NEAR(machine.at(key).get<double>(), *value, 1e-4) << key;
        }
        for (const auto& [key, value] : {std::pair{"layer", p->layer},
                                         {"slabs", p->slabs},
                                         {"feed_slabs", p->in_feed},
                                         {"tool", p->tool}})
            EXPECT_EQ(machine.at(key), value) << key << " after " << i << " steps";
        EXPECT_EQ(machine.at("magazine"), p->magazine);
        EXPECT_EQ(machine.at("faced"), p->faced);
        EXPECT_EQ(machine.at("in_hand"), p->in_hand);
        EXPECT_EQ(document.at("left").size(), build.sequence.steps.size() - i);
        EXPECT_EQ(document.at("checks"), p->checks);
    }
}

TEST(Progress, ATextThatIsNoneIsRefusedWithWhatIsWrong) {
    const Plan plan = block(Job{}, {2, 1, false});
    const UnderWay build{stated(plan), read_sequence(sequence_json(plan))};
    BuildProgress progress;
    progress.after = 12;
    progress.time_s = 1'795'617'730;
    progress.state = state_after(build, 12);
    const std::string text = progress_json(progress, build.plan, build.sequence);
    EXPECT_EQ(parse_progress(text, "p").after, 12);
    EXPECT_EQ(parse_progress(text, "p").time_s, progress.time_s);
    EXPECT_EQ(utc_text(progress.time_s), "2026-11-25T14:42:10Z");
    EXPECT_EQ(utc_text(0), "1970-01-01T00:00:00Z");
    const nlohmann::json good = nlohmann::json::parse(text);
    const auto message = [&](const std::string& changed) -> std::string {
        try {
            (void)parse_progress(changed, "p");
            (void)parse_progress_state(changed, build.plan, build.sequence, "p");
        } catch (const Error& e) {
            EXPECT_EQ(e.code(), "resume.progress");
            EXPECT_EQ(e.kind(), ErrorKind::input);
            EXPECT_FALSE(e.remedy().empty());
            return e.message();
        }
        return "";
    };
    EXPECT_EQ(message(text), "");
    for (const auto& [key, value] : good.items()) {
        nlohmann::json changed = good;
        changed.erase(key);
        EXPECT_NE(message(changed.dump()).find(key), std::string::npos) << key;
        changed[key] = true;
        EXPECT_NE(message(changed.dump()), "") << key;
    }
    for (const auto& [key, value] : good["state"].items()) {
        nlohmann::json changed = good;
        changed["state"].erase(key);
        EXPECT_NE(message(changed.dump()).find(key), std::string::npos) << key;
        changed["state"][key] = "word";
        EXPECT_NE(message(changed.dump()), "") << key;
    }
    nlohmann::json changed = good;
    changed["state"]["pressed"] = 999;
    EXPECT_NE(message(changed.dump()), "");
    changed = good;
    changed["state"]["programs"]["nc/other.ngc"] = 3;
    EXPECT_NE(message(changed.dump()), "");
    changed = good;
    changed["time"] = "2026-13-25T14:42:10Z";
    EXPECT_NE(message(changed.dump()), "");
    std::mt19937 random(test::seed());
    for (int round = 0; round < 500; ++round) {  // any bytes: read, or refused with one clear error
        std::string bytes = text;
        for (int n = 0; n < 4; ++n) bytes[random() % bytes.size()] = static_cast<char>(random() & 255U);
        if (random() % 4 == 0) bytes.resize(random() % bytes.size());
        (void)message(bytes);
    }
}

}  // namespace
}  // namespace slabwright
