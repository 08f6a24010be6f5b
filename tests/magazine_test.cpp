// The magazine: what is put in and when, with the fewest swaps; what the sequence says of it, and what the
// replay says of a sequence that does otherwise.
#include "engine/schedule/magazine.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>

#include "engine/simulate/build_replay.h"
#include "io/posts/tool_table.h"
#include "io/posts/tool_table_check.h"
#include "io/read/sequence_reader.h"
#include "io/slabwright.h"
#include "io/write/sequence_json.h"
#include "kernels/errors.h"
#include "tests/support/block_build.h"
#include "tests/support/files.h"
#include "tests/support/places.h"
#include "tests/support/schema.h"
#include "tests/support/seed.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

using nlohmann::json;
using support::block;
using support::stated;

unsigned bit(int tool) { return 1U << static_cast<unsigned>(tool); }

/// The fewest swaps, by trying every set of tools before every program. @param places that are not filled
/// take a tool without a swap
int fewest_swaps(const std::vector<ProgramTools>& programs, const std::vector<int>& loaded) {
    constexpr int kFar = std::numeric_limits<int>::max() / 2;
    constexpr unsigned kTools = 7;  // 1 … 6
    unsigned start = 0;
    for (const int tool : loaded)
        if (tool != 0) start |= bit(tool);
    const auto places = static_cast<int>(loaded.size());
    std::vector<int> best(1U << kTools, kFar);
    best[start] = 0;
    for (const ProgramTools& program : programs) {
        unsigned needed = 0;
        for (const int tool : program.tools) needed |= bit(tool);
        std::vector<int> next(best.size(), kFar);
        for (unsigned from = 0; from < best.size(); ++from)
            for (unsigned to = 0; to < best.size() && best[from] < kFar; ++to) {
                if ((to & needed) != needed || std::popcount(to) > places) continue;
                // A tool is taken out for another only: each that goes is a swap.
                const int put_in = std::popcount(to & ~from), taken_out = std::popcount(from & ~to);
                if (taken_out <= put_in) next[to] = std::min(next[to], best[from] + taken_out);
            }
        best = next;
    }
    return *std::min_element(best.begin(), best.end());
}

struct RandomBuild {
    std::vector<ProgramTools> programs;
    std::vector<int> loaded;
    int spindle = 0;
};

RandomBuild random_build(std::mt19937& random) {
    const auto below = [&](unsigned n) { return static_cast<int>(random() % n); };
    RandomBuild build;
    build.loaded.assign(static_cast<std::size_t>(1 + below(4)), 0);
    std::vector<int> tools{1, 2, 3, 4, 5, 6};
    std::shuffle(tools.begin(), tools.end(), random);
    if (random() % 2)
        for (std::size_t i = 0; i < build.loaded.size(); ++i)
            if (random() % 3) build.loaded[i] = tools[i];
    if (random() % 2) build.spindle = build.loaded[random() % build.loaded.size()];
    for (int i = below(10); i >= 0; --i) {
        std::shuffle(tools.begin(), tools.end(), random);
        const auto count = 1 + random() % std::min<std::size_t>(3, build.loaded.size());
        ProgramTools& program = build.programs.emplace_back();
        program.tools.assign(tools.begin(), tools.begin() + static_cast<std::ptrdiff_t>(count));
        program.last = program.tools[random() % count];
    }
    return build;
}

TEST(Magazine, SwapsAsSeldomAsCanBe) {
    std::mt19937 random(test::seed());
    int swapped = 0;
    for (int round = 0; round < 2000; ++round) {
        const RandomBuild build = random_build(random);
        const auto loads = plan_tool_loads(build.programs, build.loaded, build.spindle);
        ASSERT_EQ(loads.size(), build.programs.size());
        std::vector<int> in = build.loaded;
        int swaps = 0;
        for (std::size_t i = 0; i < loads.size(); ++i) {
            for (const ToolLoad& load : loads[i]) {
                ASSERT_GE(load.place, 1);
                ASSERT_LE(load.place, static_cast<int>(in.size()));
                int& place = in[static_cast<std::size_t>(load.place) - 1];
                ASSERT_EQ(place, load.tool_out) << "what is taken out stands there";
                ASSERT_EQ(std::count(in.begin(), in.end(), load.tool), 0) << "no tool stands in two places";
                ASSERT_TRUE(i == 0 || load.tool_out != 0) << "empty places are filled at the start";
                place = load.tool;
                swaps += load.tool_out != 0 ? 1 : 0;
            }
            for (const int tool : build.programs[i].tools)
                ASSERT_EQ(std::count(in.begin(), in.end(), tool), 1) << round << ' ' << i;
        }
        ASSERT_EQ(swaps, fewest_swaps(build.programs, build.loaded)) << round;
        swapped += swaps;
    }
    EXPECT_GT(swapped, 2000) << "there was something to choose";
}

TEST(Magazine, OfWhatIsNeededNoMoreTheLowestNumberGoesAndTheSpindleLast) {
    const auto one = [](int tool) { return ProgramTools{{tool}, tool}; };
    // 4 and 7 are needed no more when 9 comes; 7 is in the spindle.
    const std::vector<ProgramTools> spindle{one(4), one(2), one(7), one(9), one(2)};
    EXPECT_EQ(plan_tool_loads(spindle, {0, 0, 0}, 0)[0],
              (std::vector<ToolLoad>{{1, 2, 0}, {2, 4, 0}, {3, 7, 0}}));
    EXPECT_EQ(plan_tool_loads(spindle, {0, 0, 0}, 0)[3], (std::vector<ToolLoad>{{2, 9, 4}}));
    // 4 and 7 likewise, and neither is in the spindle.
    const std::vector<ProgramTools> both{one(7), one(4), one(2), one(9), one(2)};
    EXPECT_EQ(plan_tool_loads(both, {0, 0, 0}, 0)[3], (std::vector<ToolLoad>{{2, 9, 4}}));
    // 2 is needed sooner than 4.
    const std::vector<ProgramTools> later{one(2), one(4), one(9), one(2), one(4)};
    EXPECT_EQ(plan_tool_loads(later, {0, 0}, 0)[2], (std::vector<ToolLoad>{{2, 9, 4}}));
}

/// A block whose layers use six tools, of which places hold fewer.
Plan six_tools(int places) {
    Job job;
    job.machine.magazine = places;
    job.machine.magazine_swap_s = 40;
    for (int number = 4; number <= 6; ++number) {
        job.tools.push_back(job.tools[1]);
        job.tools.back().number = number;
    }
    Plan plan = block(job, {3, 1, false});
    for (std::size_t l = 0; l < plan.layers.size(); ++l) {
        std::vector<Operation>& all = plan.layers[l].operations;
        all.push_back(all[1]);
        all.back().tool = 4 + static_cast<int>(l % 2);
        all.push_back(all[1]);
        all.back().tool = 6;
    }
    schedule(plan);
    return plan;
}

std::vector<std::string> loads_of(const Plan& plan) {
    std::vector<std::string> loads;
    for (const SequenceStep& step : plan.sequence) {
        if (step.action != "load_tool") continue;
        std::string& text = loads.emplace_back(fmt::format("layer {}:", step.layer));
        for (const auto& [key, value] : step.numbers) text += fmt::format(" {} {:.0f}", key, value);
        for (const auto& [key, value] : step.words) text += fmt::format(" {} {}", key, value);
    }
    return loads;
}

TEST(Magazine, TheSequenceSaysWhatIsPutInAndSwapped) {
    EXPECT_TRUE(loads_of(six_tools(0)).empty()) << "by hand nothing is said";
    EXPECT_EQ(loads_of(six_tools(9)).size(), 6u);
    const Plan plenty = six_tools(9), few = six_tools(4);
    EXPECT_EQ(plenty.totals.magazine_swaps, 0);
    EXPECT_EQ(plenty.totals.magazine_minutes, 0);
    // Layers use 1 2 3 4 6, 1 2 3 5 6, 1 2 3 4 6.
    EXPECT_EQ(loads_of(few),
              (std::vector<std::string>{
                  "layer 1: place 1 tool 1", "layer 1: place 2 tool 2", "layer 1: place 3 tool 3",
                  "layer 1: place 4 tool 4", "layer 1: place 4 tool 6 tool_out 4 from spindle",
                  "layer 2: place 3 tool 5 tool_out 3 from spindle", "layer 3: place 1 tool 3 tool_out 1",
                  "layer 3: place 2 tool 4 tool_out 2"}));
    EXPECT_EQ(few.totals.magazine_swaps, 4);
    EXPECT_NEAR(few.totals.magazine_minutes, 4 * 40 / 60.0, 1e-9);
    EXPECT_NEAR(few.totals.build_minutes, plenty.totals.build_minutes + 4 * 40 / 60.0, 1e-9);
    EXPECT_EQ(few.totals.tool_changes, plenty.totals.tool_changes);
    for (const SequenceStep& step : few.sequence)
        if (step.action == "load_tool") {
            EXPECT_EQ(step.seconds, step.numbers.size() == 3 ? 40 : 0);
        }
    EXPECT_EQ(magazine_at_start(few.sequence, 4), (std::vector<int>{1, 2, 3, 4}));
    EXPECT_EQ(magazine_at_start(plenty.sequence, 9), (std::vector<int>{1, 2, 3, 4, 5, 6, 0, 0, 0}));
}

TEST(Magazine, AProgramOfMoreToolsThanPlacesIsRefused) {
    Job job;
    job.machine.magazine = 2;
    job.machine.programs = ProgramSpan::layer;
    try {
        (void)block(job, {2, 1, false});
        ADD_FAILURE();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::no_plan);
        EXPECT_EQ(error.code(), "machine.magazine");
        EXPECT_EQ(error.message(), "a program changes between 3 tools, the magazine has 2 places");
    }
    job.machine.magazine = 3;
    const Plan plan = block(job, {2, 1, false});
    EXPECT_TRUE(replay_build(stated(plan), read_sequence(sequence_json(plan))).empty());
    job.machine.programs = ProgramSpan::operation;
    job.machine.post = Post::grbl;
    EXPECT_THROW(validate(job), Error) << "its programs cannot change a tool";
    EXPECT_THROW((void)job_from_toml("[machine]\nmagazine = -1\n", "job"), Error);
}

TEST(Magazine, EachCorruptionIsToldAsWhatItIs) {
    const Plan plan = six_tools(4);
    const BuildPlan build = stated(plan);
    const json good = json::parse(sequence_json(plan));
    const auto codes = [&](const std::function<void(json & steps)>& corrupt) {
        json sequence = good;
        corrupt(sequence["steps"]);
        std::vector<std::string> found;
        for (const Violation& v : replay_build(build, read_sequence(sequence.dump())))
            found.push_back(v.code);
        return found;
    };
    EXPECT_TRUE(codes([](json&) {}).empty());
    const auto place_of = [](const json& steps, const std::string& action, int n) {
        for (std::size_t i = 0; i < steps.size(); ++i)
            if (steps[i]["action"] == action && n-- == 0) return i;
        ADD_FAILURE() << action;
        return std::size_t{0};
    };
    const auto set = [&](const char* action, int n, const char* key, const json& value) {
        return codes([&](json& steps) { steps[place_of(steps, action, n)][key] = value; });
    };
    const auto erased = [&](const char* action, int n, const char* key) {
        return codes([&](json& steps) { steps[place_of(steps, action, n)].erase(key); });
    };
    const auto has = [](const std::vector<std::string>& found, const char* code) {
        return std::count(found.begin(), found.end(), code) > 0;
    };
    // A swap dropped: the tool is not there when it is wanted. So with what fills a place at the start.
    for (int n = 0; n < 8; ++n) {
        const auto found = codes([&](json& steps) { steps.erase(place_of(steps, "load_tool", n)); });
        EXPECT_TRUE(has(found, "sequence.magazine")) << n;
    }
    for (int n = 0; n < 8; ++n) {
        const int other = good["steps"][place_of(good["steps"], "load_tool", n)]["place"].get<int>() % 4 + 1;
        EXPECT_TRUE(has(set("load_tool", n, "place", other), "sequence.magazine")) << n;
        EXPECT_TRUE(has(set("load_tool", n, "place", 5), "sequence.magazine")) << n;
        EXPECT_TRUE(has(set("load_tool", n, "place", 0), "sequence.magazine")) << n;
        EXPECT_TRUE(has(set("load_tool", n, "seconds", 7), "sequence.time")) << n;
        EXPECT_TRUE(has(set("load_tool", n, "layer", 9), "sequence.layer")) << n;
        EXPECT_TRUE(has(set("load_tool", n, "tool", 77), "sequence.tool")) << n;
        EXPECT_TRUE(has(erased("load_tool", n, "place"), "sequence.value")) << n;
        if (n < 4) continue;
        EXPECT_TRUE(has(set("load_tool", n, "tool", 2), "sequence.magazine")) << n << ": a tool twice";
        EXPECT_TRUE(has(set("load_tool", n, "tool_out", 6), "sequence.magazine")) << n;
        EXPECT_TRUE(has(erased("load_tool", n, "tool_out"), "sequence.magazine")) << n;
        EXPECT_TRUE(has(set("load_tool", n, "needs", json::array()), "sequence.needs")) << n;
    }
    EXPECT_TRUE(has(erased("load_tool", 4, "from"), "sequence.value")) << "it is in the spindle";
    EXPECT_TRUE(has(set("load_tool", 6, "from", "spindle"), "sequence.magazine")) << "it is not";
    EXPECT_TRUE(has(set("tool_change", 2, "place", 4), "sequence.magazine"));
    EXPECT_TRUE(has(erased("tool_change", 2, "place"), "sequence.value"));
    // A swap after the program that it is for.
    EXPECT_TRUE(has(codes([&](json& steps) {
                        const std::size_t at = place_of(steps, "load_tool", 5);
                        std::swap(steps[at], steps[at + 2]);
                    }),
                    "sequence.magazine"));
    // A machine without a magazine has no such step.
    BuildPlan by_hand = build;
    by_hand.job.machine.magazine = 0;
    const std::vector<Violation> found = replay_build(by_hand, read_sequence(good.dump()));
    EXPECT_EQ(std::count_if(found.begin(), found.end(),
                            [](const Violation& v) { return v.code == "sequence.magazine"; }),
              8);
}

TEST(Magazine, PocketsOfTheToolTableArePlaces) {
    Job job;
    const std::vector<int> magazine{3, 0, 1};
    const std::string table = tool_table(job, magazine);
    EXPECT_EQ(table.substr(0, 6), "T1 P3 ");
    EXPECT_NE(table.find("T2 P4 "), std::string::npos) << "in no place: behind the last";
    EXPECT_NE(table.find("T3 P1 "), std::string::npos);
    EXPECT_TRUE(check_tool_table(table, "tool.tbl", job.tools, magazine).empty());
    EXPECT_EQ(check_tool_table(table, "tool.tbl", job.tools).size(), 3u);
    EXPECT_EQ(check_tool_table(tool_table(job), "tool.tbl", job.tools, magazine).size(), 3u);
    std::string inside = table;
    inside.replace(inside.find("P4"), 2, "P2");
    EXPECT_EQ(check_tool_table(inside, "tool.tbl", job.tools, magazine).size(), 1u);
    inside.replace(inside.find("T2 P2"), 5, "T2 P1");
    EXPECT_EQ(check_tool_table(inside, "tool.tbl", job.tools, magazine).size(), 2u) << "and twice";
}

TEST(Magazine, AFolderProvesItself) {
    const support::TemporaryFolder folder;
    const std::string out = folder / "out", pattern = support::checkout("tests/data/pump-cover.stl");
    Context context;
    const Job job = job_from_toml("[machine]\nmagazine = 2\n", "job", Job{});
    const Plan made = plan(context, PatternSource(pattern), job);
    EXPECT_GT(made.totals.magazine_swaps, 0);
    write(context, made, out, PatternSource(pattern));
    EXPECT_EQ(support::schema_complaint(support::slurp(out + "/sequence.json"),
                                        support::checkout("io/sequence.schema.json")),
              "");
    EXPECT_EQ(support::schema_complaint(support::slurp(out + "/plan.json"),
                                        support::checkout("io/plan.schema.json")),
              "");
    const VerifyResult verified = verify(context, out, PatternSource(pattern));
    EXPECT_TRUE(verified.passed) << (verified.violations.empty() ? "" : verified.violations[0].message);
    std::string table = support::slurp(out + "/tool.tbl");
    EXPECT_NE(table.find("T3 P3 "), std::string::npos) << table;
    table.replace(table.find("T3 P3 "), 6, "T3 P1 ");
    support::spit(out + "/tool.tbl", table);
    const VerifyResult wrong = verify(context, out, PatternSource(pattern));
    EXPECT_FALSE(wrong.passed);
    const std::string page = support::slurp(out + "/report.html");
    EXPECT_NE(page.find("\"from\":\"spindle\""), std::string::npos);
}

}  // namespace
}  // namespace slabwright
