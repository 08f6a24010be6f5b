// Programs that hold several operations, one tool's or a layer's: the same motions as one program each, in
// every dialect; damaged texts and sequences are told; the folder proves itself.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "engine/schedule/schedule.h"
#include "engine/simulate/build_replay.h"
#include "io/posts/dialect.h"
#include "io/posts/gcode_reader.h"
#include "io/posts/gcode_writer.h"
#include "io/posts/program_check.h"
#include "io/posts/program_grid.h"
#include "io/posts/tool_table.h"
#include "io/read/planned_folder.h"
#include "io/read/sequence_reader.h"
#include "io/resume.h"
#include "io/slabwright.h"
#include "io/verify.h"
#include "io/write/sequence_json.h"
#include "kernels/errors.h"
#include "tests/support/block_build.h"
#include "tests/support/every_control.h"
#include "tests/support/files.h"
#include "tests/support/places.h"
#include "tests/support/rs274.h"
#include "tests/support/schema.h"
#include "tests/support/seed.h"
#include "tests/support/temporary_folder.h"

using namespace slabwright;
using namespace slabwright::support;

namespace {

constexpr ProgramSpan kSpans[] = {ProgramSpan::operation, ProgramSpan::tool, ProgramSpan::layer};

bool takes(Post post, ProgramSpan span) { return span != ProgramSpan::layer || changes_tools(post); }

/// An operation of random motions, arcs among them, that begins and ends as it must.
Operation random_operation(std::mt19937& random, int tool, Post post) {
    const auto pick = [&](int low, int high) {
        return std::uniform_int_distribution<int>(low, high)(random);
    };
    Operation op;
    op.kind = OperationKind::rough;
    op.purpose = fmt::format("levels of {}", pick(1, 99));
    op.tool = tool;
    op.spindle_rpm = 9000 + 3000 * pick(0, 2);
    op.blend = says_rounding(post) && pick(0, 1) == 1 ? 0.1 : kJunction;
    op.minutes = pick(1, 500) * 0.01;
    const std::int32_t clear = 470000 + pick(0, 3) * 10007;
    op.clearance_z = to_mm(clear);
    Move at{pick(-500000, 500000), pick(-500000, 500000), clear, 0};
    op.moves.push_back(at);
    for (int n = pick(2, 12); n-- > 0;) {
        at.feed = static_cast<std::uint32_t>(pick(1, 6) * 1500);
        at.i = at.j = 0;
        at.x += pick(-90000, 90000), at.y += pick(-90000, 90000);
        if (pick(0, 2) == 0) at.z = pick(-30, 36) * 10000 + pick(0, 9999);
        op.moves.push_back(at);
        if (pick(0, 2) != 0) continue;
        const std::int32_t r = pick(3, 90) * 1000;  // a quarter of a circle
        at.i = 0, at.j = r;
        at.x += r, at.y += r;
        op.moves.push_back(at);
    }
    at.i = at.j = 0;
    at.feed = 0;
    at.z = clear;
    op.moves.push_back(at);
    return op;
}

Plan random_plan(std::mt19937& random, Post post, LengthUnit units, ProgramSpan span, int operations) {
    Plan plan;
    plan.job.machine.post = post;
    plan.job.machine.units = units;
    plan.job.machine.programs = span;
    plan.input.file = "pump.stl";
    Layer& layer = plan.layers.emplace_back();
    layer.index = 2;
    layer.z_bottom = 18.5, layer.z_top = 37, layer.slab_thickness = 19;
    for (int k = 0, tool = 1; k < operations; ++k) {
        if (random() % 2 == 0) tool = 1 + static_cast<int>(random() % 3);
        layer.operations.push_back(random_operation(random, tool, post));
    }
    name_programs(plan);
    return plan;
}

std::string file_text(const Plan& plan, std::size_t begin) {
    std::string text;
    write_file(plan, plan.layers[0], begin, [&](std::string_view piece) { text += piece; });
    return text;
}

std::vector<std::string> lines_of(const std::string& text) {
    std::vector<std::string> lines;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = text.find('\n', at);
        lines.push_back(text.substr(at, end - at));
        at = end + 1;
    }
    return lines;
}

/// What differs between a program of its own and a part of another, but for lines; "" where nothing does.
std::string difference(const Program& alone, const Program& part) {
    if (alone.tool != part.tool) return fmt::format("tool {} for {}", part.tool, alone.tool);
    if (alone.spindle_rpm != part.spindle_rpm) return "another speed";
    if (alone.blend != part.blend || alone.strays != part.strays) return "corners rounded otherwise";
    if (alone.dwell_s != part.dwell_s) return "another dwell";
    if (alone.steps.size() != part.steps.size() || alone.arcs.size() != part.arcs.size())
        return "more or fewer motions";
    for (std::size_t i = 0; i < alone.steps.size(); ++i) {
        const ProgramStep &a = alone.steps[i], &b = part.steps[i];
        const bool same = a.known() == b.known() && a.feed == b.feed && a.spindle == b.spindle &&
                          (!a.known() || (a.x == b.x && a.y == b.y)) && a.z == b.z;
        if (!same) return fmt::format("motion {} goes elsewhere", i);
    }
    return "";
}

/// The first that is told of a text of the plan's first program; "" where it passes.
std::string verdict(const Plan& plan, const std::string& text) {
    const Layer& layer = plan.layers[0];
    const std::size_t count = file_end(layer, 0);
    try {
        std::vector<Program> programs =
            read_planned_operations(text, std::string(file_of(layer.operations[0].file)), plan.job, count);
        const double up = to_mm(program_origin(plan, layer).z);
        for (std::size_t k = 0; k < count; ++k) {
            const Operation& op = layer.operations[k];
            ProgramPlan said;
            said.spindle_rpm = op.spindle_rpm;
            said.blend = op.blend;
            said.feeds =
                written_feed_lengths(dialect_of(plan.job.machine), op.moves, program_origin(plan, layer));
            for (ProgramStep& step : programs[k].steps) step.z += up;
            for (ProgramArc& arc : programs[k].arcs) arc.arc.z += up;
            if (programs[k].tool != op.tool) return "tool";
            const auto tool = std::find_if(plan.job.tools.begin(), plan.job.tools.end(),
                                           [&](const Tool& t) { return t.number == op.tool; });
            for (const Violation& v : check_program(programs[k], said, &*tool, plan.job.machine))
                return v.code;
        }
        return "";
    } catch (const Error& error) {
        return error.code();
    }
}

}  // namespace

TEST(SharedPrograms, GoWhereOneProgramForEachOperationGoes) {
    std::mt19937 random(test::seed());
    for (int round = 0; round < 40; ++round)
        for (const Post post : kPosts)
            for (const ProgramSpan span : kSpans) {
                if (!takes(post, span)) continue;
                const LengthUnit units = kUnits[random() % 2];
                const Plan plan = random_plan(random, post, units, span, 1 + static_cast<int>(random() % 6));
                Plan single = plan;
                single.job.machine.programs = ProgramSpan::operation;
                name_programs(single);
                const Layer& layer = plan.layers[0];
                const Dialect dialect = dialect_of(plan.job.machine);
                const GcodeLimits limits = gcode_limits(plan.job.tolerances);
                std::set<std::string> names;
                for (std::size_t begin = 0, end = 0; begin < layer.operations.size(); begin = end) {
                    end = file_end(layer, begin);
                    const std::string text = file_text(plan, begin),
                                      name(file_of(layer.operations[begin].file));
                    EXPECT_TRUE(names.insert(name).second) << name;
                    std::string parts;
                    for (std::size_t i = begin; i < end; ++i)
                        parts += program_text(plan, layer, layer.operations[i]);
                    EXPECT_EQ(parts, text);
                    const std::vector<Program> read =
                        read_planned_operations(text, name, plan.job, end - begin);
                    for (std::size_t i = begin; i < end; ++i) {
                        const Operation& own = single.layers[0].operations[i];
                        const Program alone = read_program_text(program_text(single, single.layers[0], own),
                                                                own.file, dialect, limits);
                        EXPECT_EQ(difference(alone, read[i - begin]), "") << text;
                        // Lines are those of the whole text.
                        std::set<std::uint32_t> moved, stated;
                        for (const ProgramStep& step : read[i - begin].steps) moved.insert(step.line);
                        for (const std::uint32_t l : move_lines(plan, layer, layer.operations[i]))
                            if (l != 0) stated.insert(l);
                        EXPECT_TRUE(std::includes(moved.begin(), moved.end(), stated.begin(), stated.end()));
                        const std::size_t line = program_line(plan, layer, layer.operations[i], 2,
                                                              lines_before(plan, layer, layer.operations[i]));
                        if (line != 0) {
                            EXPECT_EQ(line, move_lines(plan, layer, layer.operations[i])[2]);
                        }
                    }
                }
                // By tool no two neighbours use the same one; by layer there is one file.
                if (span == ProgramSpan::layer) {
                    EXPECT_EQ(names.size(), 1u);
                }
                for (std::size_t i = 0; span == ProgramSpan::tool && i < layer.operations.size();) {
                    const std::size_t end = file_end(layer, i);
                    for (std::size_t k = i; k < end; ++k)
                        EXPECT_EQ(layer.operations[k].tool, layer.operations[i].tool);
                    if (end < layer.operations.size()) {
                        EXPECT_NE(layer.operations[end].tool, layer.operations[i].tool);
                    }
                    i = end;
                }
            }
}

TEST(SharedPrograms, WordForWord) {
    std::mt19937 random(7);
    Plan plan = random_plan(random, Post::fanuc, LengthUnit::mm, ProgramSpan::layer, 3);
    constexpr std::int32_t mm = 10000;
    const std::vector<Move> moves{{0, 0, 47 * mm, 0},
                                  {29 * mm, 3 * mm, 47 * mm, 0},
                                  {29 * mm, 3 * mm, 32 * mm, 1500},
                                  {29 * mm, 3 * mm, 47 * mm, 0}};
    const int tools[] = {1, 2, 2}, speeds[] = {9000, 18000, 18000};
    for (std::size_t k = 0; k < 3; ++k) {
        Operation& op = plan.layers[0].operations[k];
        op.tool = tools[k], op.spindle_rpm = speeds[k], op.moves = moves, op.clearance_z = 47;
        op.blend = kJunction;
    }
    const auto body = [&](Post post) {
        plan.job.machine.post = post;
        name_programs(plan);
        std::string out;
        for (const std::string& line : lines_of(file_text(plan, 0)))
            if (line[0] != '(' && line.find("; ") == std::string::npos) out += line + "\n";
        return out;
    };
    EXPECT_EQ(body(Post::fanuc),
              "%\nO0201\nG21 G17 G90 G94 G40 G49 G80\nG64\nG54\nT1 M6\nS9000 M3\nG4 P3000\nG0 G43 H1 Z10.\n"
              "X29. Y3.\nG1 Z-5. F1500.\nG0 Z10.\n"
              "M5\nT2 M6\nS18000 M3\nG4 P3000\nG0 G43 H2 Z10.\nX29. Y3.\nG1 Z-5. F1500.\nG0 Z10.\n"
              "S18000 M3\nG4 P3000\nG0 G43 H2 Z10.\nX29. Y3.\nG1 Z-5. F1500.\nG0 Z10.\nM5\nM30\n%\n");
    EXPECT_EQ(
        body(Post::linuxcnc),
        "G21 G17 G90 G94 G40 G49 G80\nG8 G97\nG64 P0.02 Q0\nG54\nT1 M6\nG43 H1\nS9000 M3\nG4 P3\nG0 Z10\n"
        "X29 Y3\nG1 Z-5 F1500\nG0 Z10\n"
        "M5\nT2 M6\nG43 H2\nS18000 M3\nG64 P0.02 Q0\nG4 P3\nG0 Z10\nX29 Y3\nG1 Z-5 F1500\nG0 Z10\n"
        "S18000 M3\nG64 P0.02 Q0\nG4 P3\nG0 Z10\nX29 Y3\nG1 Z-5 F1500\nG0 Z10\nM5\nM2\n");
    EXPECT_EQ(plan.layers[0].operations[2].file, "L002.ngc#3");
}

TEST(SharedPrograms, ALostLineIsTold) {
    std::mt19937 random(test::seed());
    for (const Post post : kPosts)
        for (const ProgramSpan span : {ProgramSpan::tool, ProgramSpan::layer}) {
            if (!takes(post, span)) continue;
            Plan plan = random_plan(random, post, LengthUnit::mm, span, 4);
            std::vector<Operation>& all = plan.layers[0].operations;
            const int by_layer[] = {1, 2, 2, 3};
            for (std::size_t k = 0; k < all.size(); ++k) {
                all[k].tool = span == ProgramSpan::layer ? by_layer[k] : 2;
                all[k].spindle_rpm = k % 2 == 0 ? 9000 : 12000;
                all[k].blend = says_rounding(post) && k % 2 == 1 ? 0.1 : kJunction;
            }
            name_programs(plan);
            const std::string text = file_text(plan, 0);
            ASSERT_EQ(verdict(plan, text), "") << text;
            const std::vector<std::string> lines = lines_of(text);
            const auto without = [&](std::size_t lost) {
                std::string out;
                for (std::size_t i = 0; i < lines.size(); ++i)
                    if (i != lost) out += lines[i] + "\n";
                return out;
            };
            for (std::size_t i = 0; i < lines.size(); ++i) {
                const std::string& line = lines[i];
                const bool comment = line[0] == '(' || line.find("; ") != std::string::npos;
                if (comment && post != Post::heidenhain) continue;
                // A spindle that turns at its speed needs neither dwell nor M3 again but as a mark; where
                // arcs count from is said once too often.
                const bool again = line == "G91.1";
                // The stop of the spindle at the very end is the control's as well (M2, M30).
                const bool last_stop = line.find("M5") != std::string::npos && i + 4 > lines.size();
                if (again || last_stop) continue;
                EXPECT_NE(verdict(plan, without(i)), "")
                    << in_words(post, LengthUnit::mm) << " " << i + 1 << ": " << line << "\n"
                    << text;
            }
        }
}

TEST(SharedPrograms, WhatNoOperationMayDoIsTold) {
    std::mt19937 random(3);
    Plan plan = random_plan(random, Post::linuxcnc, LengthUnit::mm, ProgramSpan::layer, 2);
    std::vector<Operation>& all = plan.layers[0].operations;
    all[0].tool = 1, all[1].tool = 2;
    all[0].spindle_rpm = all[1].spindle_rpm = 6000;
    name_programs(plan);
    const std::string text = file_text(plan, 0);
    const auto with = [&](const std::string& from, const std::string& to) {
        std::string other = text;
        const std::size_t at = other.rfind(from);
        EXPECT_NE(at, std::string::npos) << from;
        return other.replace(at, from.size(), to);
    };
    EXPECT_EQ(verdict(plan, with("M5\nT2 M6", "T2 M6")), "gcode.tool");
    EXPECT_EQ(verdict(plan, with("T2 M6\nG43 H2\n", "T2 M6\nG43 H2\nG0 Z5\n")), "gcode.spindle");
    EXPECT_EQ(verdict(plan, with("M5\nM2\n", "M5\nT1 M6\nM2\n")), "gcode.tool");
    EXPECT_EQ(verdict(plan, with("T2 M6\nG43 H2\n", "T3 M6\nG43 H3\n")), "tool");
    EXPECT_EQ(verdict(plan, with("M5\nT2 M6\nG43 H2\n", "")), "tool");
    EXPECT_EQ(
        verdict(plan, with("M5\nM2\n", fmt::format("S{:.0f} M3\nG0 Z60\nM5\nM2\n", all[1].spindle_rpm))),
        "gcode.operations");
    // A program of one operation changes no tool.
    EXPECT_THROW((void)read_planned_program(text, "nc/x", plan.job), Error);
}

TEST(SharedPrograms, LinuxcncRunsThem) {
    if (std::system("command -v rs274 >/dev/null 2>&1") != 0) GTEST_SKIP() << "rs274 is not installed";
    std::mt19937 random(test::seed());
    for (int round = 0; round < 5; ++round)
        for (const LengthUnit units : kUnits) {
            const Plan plan = random_plan(random, Post::linuxcnc, units, ProgramSpan::layer, 5);
            const support::CanonProgram canon =
                support::interpret_rs274(file_text(plan, 0), tool_table(plan.job));
            EXPECT_TRUE(canon.ended);
            std::size_t moves = 0;
            for (const Operation& op : plan.layers[0].operations)
                for (const std::uint32_t line : move_lines(plan, plan.layers[0], op)) moves += line != 0;
            // The first and the last motion of each operation are none of its moves' own.
            EXPECT_EQ(canon.motions.size(), moves + 2 * plan.layers[0].operations.size());
        }
}

TEST(SharedPrograms, GrblHasNoneThatChangeTools) {
    Job job;
    job.machine.post = Post::grbl;
    job.machine.programs = ProgramSpan::layer;
    try {
        validate(job);
        ADD_FAILURE() << "passes";
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), "job.range");
        EXPECT_NE(std::string(error.what()).find("machine.programs"), std::string::npos) << error.what();
    }
    job.machine.programs = ProgramSpan::tool;
    EXPECT_NO_THROW(validate(job));
}

TEST(SharedPrograms, TheSequenceRunsFiles) {
    std::mt19937 random(test::seed());
    for (int round = 0; round < 30; ++round)
        for (const ProgramSpan span : {ProgramSpan::tool, ProgramSpan::layer}) {
            Job job = support::random_job(random);
            int& places = job.machine.magazine;
            if (span == ProgramSpan::layer && places > 0) places = std::max(places, 3);  // a layer's tools
            const Plan single = support::block(job, support::random_shape(random));
            job.machine.programs = span;
            Plan plan = single;
            plan.job = job;
            schedule(plan);
            // The same work, the same time, whatever it is cut into.
            EXPECT_EQ(plan.totals.tool_changes, single.totals.tool_changes);
            EXPECT_DOUBLE_EQ(plan.totals.build_minutes, single.totals.build_minutes);
            EXPECT_LT(plan.sequence.size(), single.sequence.size());
            double seconds = 0, single_seconds = 0;
            for (const SequenceStep& step : plan.sequence) seconds += step.seconds;
            for (const SequenceStep& step : single.sequence) single_seconds += step.seconds;
            EXPECT_NEAR(seconds, single_seconds, 1e-6);
            const nlohmann::json sequence = nlohmann::json::parse(sequence_json(plan));
            const BuildPlan build = support::stated(plan);
            const auto found = [&](const nlohmann::json& steps) {
                return replay_build(build, read_sequence(steps.dump()));
            };
            const std::vector<Violation> none = found(sequence);
            ASSERT_TRUE(none.empty()) << none[0].message;
            // Any number or word of a step that runs a program, changed, is told.
            for (std::size_t i = 0; i < sequence["steps"].size(); ++i) {
                if (!sequence["steps"][i].contains("program")) continue;
                for (const auto& [key, value] : sequence["steps"][i].items()) {
                    if (key == "id" || key == "needs") continue;
                    nlohmann::json other = sequence;
                    nlohmann::json& at = other["steps"][i][key];
                    if (value.is_number_integer()) at = value.get<int>() + 1;
                    else if (value.is_number()) at = value.get<double>() + 1;
                    else at = value.get<std::string>() + "x";
                    EXPECT_FALSE(found(other).empty()) << key << " of " << sequence["steps"][i].dump();
                }
                nlohmann::json fewer = sequence;
                fewer["steps"][i]["program"] = sequence["steps"][i]["program"].get<std::string>() + "#1";
                EXPECT_FALSE(found(fewer).empty());
            }
        }
}

TEST(SharedPrograms, EachOperationIsReadBackWithItsOwnStepdown) {
    const TemporaryFolder folder;
    const std::string out = folder / "out";
    Context context;
    Job job;
    job.machine.programs = ProgramSpan::layer;
    const Plan made = plan(context, PatternSource(kModels + "half-sphere.stl"), job);
    write(context, made, out);
    const PlannedFolder planned = read_planned_folder(out, {});
    std::size_t i = 0;
    std::set<double> stepdowns;
    for (const Layer& layer : made.layers) {
        const std::vector<Program> programs = planned.read_file(i, {});
        ASSERT_EQ(programs.size(), layer.operations.size()) << "a layer is one file";
        for (std::size_t k = 0; k < programs.size(); ++k) {
            EXPECT_NEAR(programs[k].planned_stepdown, layer.operations[k].stepdown, 6e-5) << k;
            EXPECT_EQ(planned.read_program(i + k, {}).planned_stepdown, programs[k].planned_stepdown) << k;
            stepdowns.insert(programs[k].planned_stepdown);
        }
        i += programs.size();
    }
    EXPECT_GE(stepdowns.size(), 2U) << "with none, and with some";
}

TEST(SharedPrograms, AFolderProvesItself) {
    for (const Post post : {Post::linuxcnc, Post::haas, Post::heidenhain, Post::grbl})
        for (const ProgramSpan span : {ProgramSpan::tool, ProgramSpan::layer}) {
            if (!takes(post, span)) continue;
            const TemporaryFolder folder;
            const std::string out = folder / "out";
            Context context;
            const PatternSource source(kModels + "half-sphere.stl");
            Job job;
            job.machine.post = post;
            job.machine.programs = span;
            const Plan made = plan(context, source, job);
            const VerifyResult result = write_verified(context, made, out, source, 1);
            EXPECT_TRUE(result.passed) << (result.violations.empty() ? "" : result.violations[0].message);
            std::set<std::string> files, named;
            for (const auto& entry : std::filesystem::directory_iterator(out + "/nc"))
                files.insert(entry.path().filename().string());
            for (const Layer& layer : made.layers)
                for (const Operation& op : layer.operations) named.insert(std::string(file_of(op.file)));
            EXPECT_EQ(files, named);
            if (span == ProgramSpan::layer) {
                EXPECT_EQ(files.size(), made.layers.size());
            }
            for (const char* name : {"plan", "sequence"})
                EXPECT_EQ(schema_complaint(slurp(out + "/" + name + ".json"),
                                           support::checkout(fmt::format("io/{}.schema.json", name))),
                          "");
            // Interrupted in layer 2, its first program done, it is made again.
            int after = 0;
            for (const SequenceStep& step : made.sequence)
                if (step.layer == 2 && (step.action == "face" || step.action == "mill") && after == 0)
                    after = step.id;
            const ResumeStatus status = resume_build(context, out, {after, 1, 1'795'617'730});
            EXPECT_EQ(status.programs.size(), 2u);
            EXPECT_EQ(schema_complaint(slurp(out + "/resume_001/sequence.json"),
                                       support::checkout("io/sequence.schema.json")),
                      "");
            (void)resume_build(context, out, {{}, {}, 1'795'617'790});
            // Two operations exchanged within a program are told.
            nlohmann::json document = nlohmann::json::parse(slurp(out + "/plan.json"));
            for (nlohmann::json& layer : document["layers"]) {
                nlohmann::json& all = layer["operations"];
                if (all.size() < 2 || part_of(all[1]["file"].get<std::string>()) != 2) continue;
                std::swap(all[0]["file"], all[1]["file"]);
                spit(out + "/plan.json", document.dump());
                EXPECT_THROW((void)verify_folder(context, out, {.source = source, .cell = 2}), Error);
                break;
            }
        }
}
