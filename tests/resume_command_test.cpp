// `slabwright resume`: plans of a real pattern, killed after every step and made again in every layer, from
// what lies on disk; and what the command says and refuses.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <string>

#include "engine/simulate/planned_build.h"
#include "engine/simulate/resume_point.h"
#include "io/read/planned_folder.h"
#include "io/read/sequence_reader.h"
#include "io/resume.h"
#include "io/slabwright.h"
#include "io/text/progress_json.h"
#include "kernels/stock/stock.h"
#include "tests/support/command.h"
#include "tests/support/files.h"
#include "tests/support/places.h"
#include "tests/support/schema.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

using nlohmann::json;
using support::CommandResult;
using support::run_command;
using support::schema_complaint;
using support::slurp;
using support::spit;
using support::TemporaryFolder;
using support::tree;

const std::string command = support::built_command();
const std::string pump_cover = support::checkout("tests/data/pump-cover.stl");
constexpr std::int64_t kNow = 1'795'617'730;

/// Plans the pump cover, unproven, into a folder.
void make_plan(const std::string& out, const std::string& keys) {
    Context context;
    const Job job = job_from_toml(keys, "test");
    write(context, plan(context, PatternSource(pump_cover), job), out);
}

struct Kind {
    const char* name;
    const char* keys;
};

const std::vector<Kind> kinds{
    {"default", ""},
    {"pattern base", "[machine]\nframe = \"pattern-base\"\n"},
    {"layer top, fixed table", "[machine]\ntable = \"fixed\"\nframe = \"layer-top\"\ntravel_z = 300.0\n"},
    {"a magazine of two places", "[machine]\nmagazine = 2\n"},
    {"combined, little feed",
     "[layers]\nstrategy = \"combined\"\n[slabs]\nthicknesses = [12.0]\n[machine]\nfeed_height = 40.0\n"},
    {"flask", "[flask]\nenabled = true\n"}};

PlannedFolder folder_of(const std::string& out) {
    return read_planned_folder(out, {ErrorKind::input, "plan", "program"});
}

/// The wood that the steps of a sequence leave, run from the programs' texts: the height of every cell.
std::vector<double> wood_of(const std::string& out, const BuildSequence& sequence) {
    const PlannedFolder folder = folder_of(out);
    const BuildPlan& build = folder.build;
    const PlannedBuild heights(build);
    constexpr double cell = 3;
    const double x = build.stock_max[0] - build.stock_min[0], y = build.stock_max[1] - build.stock_min[1];
    Stock stock({build.stock_min[0] + cell / 2, build.stock_min[1] + cell / 2, cell,
                 static_cast<int>(x / cell), static_cast<int>(y / cell)});
    const auto run = [&](const Program& program) {
        const CutterEnd end = cutter_end(cutter_shape(*heights.tool_of(program.tool)));
        for (std::size_t i = 1; i < program.steps.size(); ++i) {
            const ProgramStep &a = program.steps[i - 1], &b = program.steps[i];
            if (a.known() && b.known() && !b.rapid()) (void)stock.cut(end, {a.x, a.y, a.z}, {b.x, b.y, b.z});
        }
    };
    for (const SequenceStep& step : sequence.steps) {
        const auto layer = static_cast<std::size_t>(step.layer - 1);
        if (step.action == "place")
            for (const auto& [key, value] : step.numbers)
                if (key == "z_bottom_mm")
                    stock.add_slab(value, build.layers[layer].slab_thickness / build.layers[layer].slabs);
        for (const auto& [key, file] : step.words) {
            if (key != "program") continue;
            if (step.action == "face_off") {
                Program program = read_gcode(slurp(out + "/" + file), file);
                for (ProgramStep& s : program.steps) s.z += heights.origin_of(layer);
                run(program);
                EXPECT_LE(stock.highest(), build.layers[layer].z_bottom + 1e-3) << step.id;
                continue;
            }
            for (std::size_t p = 0; p < build.programs.size(); ++p)
                if (build.programs[p].file == file)
                    run(folder.read_program(p, {ErrorKind::input, "plan", "program"}));
        }
    }
    std::vector<double> tops;
    for (std::size_t c = 0; c < stock.grid().count(); ++c) tops.push_back(stock.top(c));
    return tops;
}

TEST(ResumeFolder, KilledAfterAnyStepItGoesOnFromDiskAndEndsTheSame) {
    Context context;
    for (const Kind& kind : kinds) {
        SCOPED_TRACE(kind.name);
        const TemporaryFolder folder;
        const std::string out = folder / "out";
        make_plan(out, kind.keys);
        const PlannedFolder planned = folder_of(out);
        const BuildSequence sequence = read_sequence(slurp(out + "/sequence.json"));
        const std::size_t count = sequence.steps.size();
        const ReplayedBuild whole = replay_steps(planned.build, sequence, {}, count);
        ASSERT_TRUE(whole.violations.empty()) << whole.violations[0].message;
        for (std::size_t k = 0; k <= count; ++k) {
            const int after = static_cast<int>(k);
            const ResumeStatus said = resume_build(context, out, {after, {}, kNow});
            const ResumeStatus read = resume_build(context, out, {{}, {}, kNow + 60});
            ASSERT_EQ(read.after, after);
            ASSERT_EQ(read.time_s, kNow);
            const BuildState state =
                parse_progress_state(slurp(out + "/progress.json"), planned.build, sequence, "");
            const ReplayedBuild rest = replay_steps(planned.build, sequence, state, count);
            ASSERT_TRUE(rest.violations.empty()) << k << ' ' << rest.violations[0].message;
            BuildState end = rest.state;  // which also knows how low and high the spindle has been
            end.lowest = whole.state.lowest, end.highest = whole.state.highest;
            ASSERT_EQ(end, whole.state) << k;
        }
        EXPECT_EQ(
            schema_complaint(slurp(out + "/progress.json"), support::checkout("io/progress.schema.json")),
            "");
        EXPECT_NEAR(resume_build(context, out, {0, {}, kNow}).minutes_left,
                    json::parse(slurp(out + "/plan.json"))["totals"]["build_minutes"].get<double>(), 0.1);
    }
}

/// The step after which a layer has run half of its programs.
int middle_of(const BuildSequence& sequence, int layer) {
    std::vector<int> runs;
    for (const SequenceStep& step : sequence.steps)
        if (step.layer == layer && (step.action == "mill" || step.action == "face")) runs.push_back(step.id);
    return runs[runs.size() / 2];
}

TEST(ResumeFolder, EveryLayerIsMadeAgainAndTheWoodEndsTheSame) {
    Context context;
    for (const Kind& kind : kinds) {
        SCOPED_TRACE(kind.name);
        const TemporaryFolder folder;
        const std::string out = folder / "out";
        make_plan(out, kind.keys);
        const BuildPlan build = folder_of(out).build;
        const BuildSequence own = read_sequence(slurp(out + "/sequence.json"));
        const std::vector<double> wood = wood_of(out, own);
        const int top = build.layers.back().index;
        for (int layer = 1; layer <= top; ++layer) {
            SCOPED_TRACE(layer);
            std::filesystem::remove(out + "/progress.json");
            std::filesystem::remove_all(out + "/resume_001");
            const int on_top = std::min(top, layer + (layer % 2));  // the layer above goes with it, or not
            const int after = middle_of(own, on_top);
            const ResumeStatus made = resume_build(context, out, {after, layer, kNow});
            EXPECT_EQ(made.after, after);
            EXPECT_EQ(made.sequence, "resume_001/sequence.json");
            EXPECT_EQ(made.programs.size(), static_cast<std::size_t>(on_top - layer + 1));
            const std::string text = slurp(out + "/resume_001/sequence.json");
            if (layer == 1) {
                EXPECT_EQ(schema_complaint(text, support::checkout("io/sequence.schema.json")), "");
                EXPECT_EQ(schema_complaint(slurp(out + "/progress.json"),
                                           support::checkout("io/progress.schema.json")),
                          "");
            }
            const BuildSequence again = read_sequence(text);
            const auto faced = std::find_if(again.steps.rbegin(), again.steps.rend(),
                                            [](const auto& s) { return s.action == "face_off"; });
            const ResumePoint bare = *resume_build(context, out, {faced->id, {}, kNow}).point;
            EXPECT_NEAR(bare.bonded_mm, build.layers[static_cast<std::size_t>(layer - 1)].z_bottom, 1e-9);
            EXPECT_TRUE(std::any_of(bare.checks.begin(), bare.checks.end(), [](const std::string& c) {
                return c.find("bare wood") != std::string::npos;
            }));
            const std::vector<double> stands = wood_of(out, again);
            ASSERT_EQ(stands.size(), wood.size());
            double most = 0;
            for (std::size_t c = 0; c < wood.size(); ++c)
                most = std::max(most, std::abs(stands[c] - wood[c]));
            EXPECT_LT(most, 1e-4);
            // And the remade one is killed after each of its steps.
            for (std::size_t k = 0; k <= again.steps.size(); k += 7) {
                const ResumeStatus s = resume_build(context, out, {static_cast<int>(k), {}, kNow});
                EXPECT_EQ(s.sequence, made.sequence);
                EXPECT_EQ(resume_build(context, out, {{}, {}, kNow}).after, static_cast<int>(k));
            }
        }
    }
}

TEST(ResumeFolder, ALayerMadeAgainCanBeMadeAgain) {
    Context context;
    const TemporaryFolder folder;
    const std::string out = folder / "out";
    make_plan(out, "");
    const BuildSequence own = read_sequence(slurp(out + "/sequence.json"));
    (void)resume_build(context, out, {middle_of(own, 3), 2, kNow});
    const BuildSequence first = read_sequence(slurp(out + "/resume_001/sequence.json"));
    const int second = middle_of(first, 2) > middle_of(own, 3) ? middle_of(first, 2)
                                                               : static_cast<int>(first.steps.size()) - 3;
    const ResumeStatus made = resume_build(context, out, {second, 1, kNow});
    EXPECT_EQ(made.sequence, "resume_002/sequence.json");
    EXPECT_TRUE(std::filesystem::is_directory(out + "/resume_001")) << "its programs are of the past steps";
    // Without progress.json the last one is in force.
    std::filesystem::remove(out + "/progress.json");
    EXPECT_EQ(resume_build(context, out, {second, {}, kNow}).sequence, "resume_002/sequence.json");
    // A program that is changed is found when the folder is read again: one that goes below the joint, and
    // one that takes too much at once.
    const std::string file = out + "/" + made.programs[0];
    const std::string text = slurp(file);
    const auto told = [&](std::size_t at, const std::string& words) -> std::string {
        std::string changed = text;
        changed.replace(at, text.find_first_of(" \n", at) - at, words);
        spit(file, changed);
        try {
            (void)resume_build(context, out, {{}, {}, kNow});
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::verification);
            EXPECT_FALSE(error.remedy().empty());
            return error.code();
        }
        return "";
    };
    const std::size_t first_pass = text.find("Z-");
    ASSERT_NE(first_pass, std::string::npos);
    EXPECT_EQ(told(first_pass, text.substr(first_pass, text.find_first_of(" \n", first_pass) - first_pass)),
              "");
    EXPECT_EQ(told(first_pass, "Z-40"), "resume.sequence");
    EXPECT_EQ(told(first_pass, "Z-9"), "resume.program");
}

class ResumeCommand : public testing::Test {
protected:
    static void SetUpTestSuite() {
        made_ = new TemporaryFolder;
        make_plan(*made_ / "out", "[bonding]\nopen_time_s = 30.0\n[cutting]\nopen_waste = false\n");
    }
    static void TearDownTestSuite() { delete made_; }
    void SetUp() override {
        std::filesystem::copy(*made_ / "out", out_, std::filesystem::copy_options::recursive);
    }
    [[nodiscard]] CommandResult resume(std::vector<std::string> more = {}) const {
        std::vector<std::string> arguments{command, "resume", out_};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run_command(arguments);
    }
    /// That the command refuses with this exit code and code, in one line, and changes nothing.
    void expect_refusal(int exit, const std::string& code, std::vector<std::string> more = {}) const {
        SCOPED_TRACE(code);
        const auto before = tree(out_);
        more.emplace_back("--json");
        const CommandResult refused = resume(more);
        EXPECT_EQ(refused.exit, exit) << refused.err << refused.out;
        EXPECT_EQ(std::count(refused.err.begin(), refused.err.end(), '\n'), 1) << refused.err;
        const json error = json::parse(refused.err, nullptr, false);
        ASSERT_FALSE(error.is_discarded()) << refused.err;
        EXPECT_NE(refused.err.find('"' + code + '"'), std::string::npos) << refused.err;
        EXPECT_TRUE(tree(out_) == before);
    }
    [[nodiscard]] int step(const std::string& action, int layer) const {
        for (const SequenceStep& s : read_sequence(slurp(out_ + "/sequence.json")).steps)
            if (s.action == action && s.layer == layer) return s.id;
        ADD_FAILURE() << action;
        return 0;
    }

    TemporaryFolder folder_;
    const std::string out_ = folder_ / "out";
    static TemporaryFolder* made_;
};
TemporaryFolder* ResumeCommand::made_ = nullptr;

TEST_F(ResumeCommand, SaysWhereTheBuildStandsAndWritesNothingUnasked) {
    const auto before = tree(out_);
    CommandResult said = resume();
    ASSERT_EQ(said.exit, 0) << said.err;
    EXPECT_NE(said.out.find("nothing has been written down yet"), std::string::npos) << said.out;
    EXPECT_TRUE(tree(out_) == before);
    const int milled = step("mill", 2);
    said = resume({"--after", std::to_string(milled)});
    ASSERT_EQ(said.exit, 0) << said.err;
    said = resume();
    EXPECT_NE(said.out.find("layer 2 on top"), std::string::npos) << said.out;
    EXPECT_NE(said.out.find("the base board's at z = -28.13 mm"), std::string::npos) << said.out;
    // Where to touch off, edges before the top.
    const std::string next = resume({"--after", std::to_string(step("touch_off", 2) - 1)}).out;
    EXPECT_TRUE(std::regex_search(
        next, std::regex("touch_off: the slab's edges at x = -125\\.4 mm, y = -[0-9.]+ mm, its top at z = "
                         "-?[0-9.]+ mm")))
        << next;
    ASSERT_EQ(resume({"--after", std::to_string(milled)}).exit, 0);
    const json told = json::parse(resume({"--json"}).out);
    EXPECT_EQ(told["schema"], "slabwright.resume/1");
    EXPECT_EQ(told["after"], milled);
    EXPECT_EQ(told["left"][0], milled + 1);
    EXPECT_EQ(told["machine"]["layer"], 2);
    EXPECT_EQ(told["machine"]["slabs"], 2);
    EXPECT_EQ(told["machine"]["glue"], "none");
    EXPECT_EQ(told["machine"]["glue_lost"], false);
    EXPECT_NEAR(told["machine"]["stack_mm"].get<double>(), 19 + 28.1304, 1e-6);
    // Glue that was spread a year ago.
    EXPECT_EQ(resume({"--after", std::to_string(step("place", 3))}).exit, 0);
    std::string text = slurp(out_ + "/progress.json");
    const std::size_t time = text.find("\"time\": \"") + 9;
    text.replace(time, 4, std::to_string(std::stoi(text.substr(time, 4)) - 1));
    spit(out_ + "/progress.json", text);
    EXPECT_EQ(json::parse(resume({"--json"}).out)["machine"]["glue_lost"], true);
}

TEST_F(ResumeCommand, RefusesWhatIsNotThisBuild) {
    expect_refusal(2, "resume.step", {"--after", "9999"});
    expect_refusal(2, "usage", {"--after", "-1"});
    expect_refusal(2, "resume.layer", {"--after", "0", "--remake", "1"});
    std::filesystem::remove(out_ + "/progress.json");
    const std::string milled = std::to_string(step("mill", 2));
    ASSERT_EQ(resume({"--after", milled}).exit, 0);
    expect_refusal(2, "resume.layer", {"--remake", "3"});
    expect_refusal(2, "resume.layer", {"--remake", "77"});
    const std::string good = slurp(out_ + "/progress.json");
    const auto with = [&](const std::function<void(json&)>& change) {
        json document = json::parse(good);
        change(document);
        spit(out_ + "/progress.json", document.dump());
    };
    with([](json& j) { j["plan_sha256"] = std::string(64, '0'); });
    expect_refusal(3, "resume.other_plan");
    expect_refusal(3, "resume.other_plan", {"--after", milled});
    with([](json& j) { j["sequence_sha256"] = std::string(64, '0'); });
    expect_refusal(3, "resume.other_sequence");
    with([](json& j) { j["sequence"] = "../sequence.json"; });
    expect_refusal(3, "resume.progress");
    with([](json& j) { j["after"] = j["after"].get<int>() + 1; });
    expect_refusal(3, "resume.state");
    with([](json& j) { j["state"]["tool"] = 3; });
    expect_refusal(3, "resume.state");
    with([](json& j) { j.erase("state"); });
    expect_refusal(3, "resume.progress");
    with([](json& j) { j["after"] = 99999; });
    expect_refusal(2, "resume.step");
    spit(out_ + "/progress.json", good.substr(0, good.size() / 2));
    expect_refusal(3, "resume.progress");
    // What was said can be corrected where the file is whole.
    with([](json& j) { j["state"]["tool"] = 3; });
    EXPECT_EQ(resume({"--after", milled}).exit, 0);
    EXPECT_EQ(resume().exit, 0);
    // The steps were changed since; by a machine that would go wrong, or only in their bytes.
    const std::string steps = slurp(out_ + "/sequence.json");
    spit(out_ + "/sequence.json", steps + "\n");
    expect_refusal(3, "resume.other_sequence");
    std::filesystem::remove(out_ + "/progress.json");
    json sequence = json::parse(steps);
    sequence["steps"].erase(6);
    spit(out_ + "/sequence.json", sequence.dump());
    expect_refusal(5, "resume.sequence");
    std::filesystem::remove(out_ + "/plan.json");
    expect_refusal(3, "resume.plan");
}

TEST_F(ResumeCommand, ARemadeLayerIsWrittenWholeAndPlanDoesNotReplaceABuildUnderWay) {
    const CommandResult made =
        resume({"--after", std::to_string(step("mill", 2)), "--remake", "2", "--json"});
    ASSERT_EQ(made.exit, 0) << made.err;
    const json told = json::parse(made.out);
    EXPECT_EQ(told["sequence"], "resume_001/sequence.json");
    ASSERT_EQ(told["programs"].size(), 1U);
    EXPECT_TRUE(std::filesystem::is_regular_file(out_ + "/" + told["programs"][0].get<std::string>()));
    const CommandResult verified = run_command({command, "verify", out_, "--stl", pump_cover, "--cell", "2"});
    EXPECT_EQ(verified.exit, 0) << verified.err << verified.out;
    const CommandResult again = run_command({command, "plan", pump_cover, "-o", out_, "--no-verify"});
    EXPECT_EQ(again.exit, 3);
    EXPECT_NE(again.err.find("progress.json"), std::string::npos) << again.err;
}

// The plan's own programs keep within the spindle's travel, but the face mill does not reach the joint.
TEST_F(ResumeCommand, AJointOutOfTheFaceMillsReachIsRefusedAndNothingIsWritten) {
    json plan = json::parse(slurp(out_ + "/plan.json"));
    for (json& tool : plan["tools"])
        if (tool["kind"] == "face") tool["holder"]["stickout"] = tool["flute_length"];
    double travel = 30;
    for (CommandResult said{.exit = 1, .out = {}, .err = {}}; said.exit != 0 && travel < 150;) {
        plan["job"]["machine"]["travel_z"] = travel += 2;
        spit(out_ + "/plan.json", plan.dump());
        said = resume();
    }
    const std::string milled = std::to_string(step("mill", 2));
    expect_refusal(4, "resume.remake", {"--after", milled, "--remake", "2"});
    plan["job"]["machine"]["travel_z"] = travel + 20;
    spit(out_ + "/plan.json", plan.dump());
    EXPECT_EQ(resume({"--after", milled, "--remake", "2"}).exit, 0);
}

}  // namespace
}  // namespace slabwright
