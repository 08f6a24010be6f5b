// Where z 0 lies and how it is found: frames, pins, and the probing programs with all that reads them back.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "engine/schedule/probes.h"
#include "engine/simulate/build_replay.h"
#include "engine/simulate/resume_point.h"
#include "io/posts/probe_check.h"
#include "io/posts/probe_program.h"
#include "io/posts/tool_table.h"
#include "io/read/job_toml.h"
#include "io/read/planned_folder.h"
#include "io/read/sequence_reader.h"
#include "io/resume.h"
#include "io/slabwright.h"
#include "io/verify.h"
#include "kernels/errors.h"
#include "tests/support/files.h"
#include "tests/support/places.h"
#include "tests/support/rs274.h"
#include "tests/support/schema.h"
#include "tests/support/temporary_folder.h"

using namespace slabwright;
using slabwright::support::schema_complaint;
using slabwright::support::slurp;
using slabwright::support::spit;
using slabwright::support::TemporaryFolder;

namespace {

const std::string kSphere = support::checkout("tests/data/half-sphere.stl");
constexpr const char* kOnTable =
    "[probing]\nplate = 2.0\nreference = [-40.0, 25.0, 10.0]\n[machine]\ntable = \"fixed\"\nprobe = "
    "\"cycle\"\n";
constexpr const char* kGrbl =
    "[machine]\npost = \"grbl\"\nprograms = \"tool\"\ntable = \"fixed\"\nprobe = \"cycle\"\n"
    "[probing]\nplate = 1.5\nreference = [-40.0, 25.0, 10.0]\n";

/// Plans the half sphere as a job file says, and writes it.
Plan made(const std::string& toml, const std::string& out) {
    Context context;
    const Plan planned = plan(context, PatternSource(kSphere), job_from_toml(toml, "t"));
    write(context, planned, out);
    return planned;
}

/// The codes of what verify finds, each once.
std::string codes(const std::string& out) {
    Context context;
    std::string found;
    const Verification result = verify_folder(context, out, {.source = PatternSource(kSphere), .cell = 1});
    for (const Violation& v : result.report.violations)
        if (found.find(v.code) == std::string::npos) found += v.code + " ";
    return found;
}

std::string refusal(const std::string& toml) {
    try {
        Context context;
        (void)plan(context, PatternSource(kSphere), job_from_toml(toml, "t"));
    } catch (const Error& error) {
        return error.code() + ": " + error.message() + "; " + error.remedy();
    }
    return "";
}

double quantity(const nlohmann::json& step, const char* key) { return step.at(key).get<double>(); }

std::vector<nlohmann::json> steps_of(const std::string& out, const std::string& action) {
    std::vector<nlohmann::json> steps;
    const auto document = nlohmann::json::parse(slurp(out + "/sequence.json"));
    for (const auto& step : document["steps"])
        if (step["action"] == action) steps.push_back(step);
    return steps;
}

void replace(std::string& text, const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from << " in\n" << text;
    text.replace(at, from.size(), to);
}

}  // namespace

TEST(ZeroInZ, ProgramsCountFromTheMachinesTable) {
    for (const char* table : {"fixed", "moving"}) {
        const TemporaryFolder folder;
        const std::string base = folder / "base", on_table = folder / "table";
        const std::string toml = fmt::format(
            "[machine]\ntable = \"{}\"\nbase_board_thickness = 21.5\nbuild_height = 500.0\nframe = ", table);
        const Plan planned = made(toml + "\"table-top\"\n", on_table);
        made(toml + "\"pattern-base\"\n", base);
        EXPECT_EQ(codes(on_table), "") << table;
        const auto touched = steps_of(on_table, "touch_off"), below = steps_of(base, "touch_off");
        const auto milled = steps_of(on_table, "mill"), lower = steps_of(base, "mill");
        ASSERT_EQ(touched.size(), below.size());
        for (std::size_t i = 0; i < touched.size(); ++i)
            EXPECT_NEAR(quantity(touched[i], "slab_top_mm"), quantity(below[i], "slab_top_mm") + 21.5, 1e-6);
        for (std::size_t i = 0; i < milled.size(); ++i)
            EXPECT_NEAR(quantity(milled[i], "z_low_mm"), quantity(lower[i], "z_low_mm") + 21.5, 1e-6);
        // The table itself is where z 0 lies, and the spindle's travel does not know of it.
        for (const auto& step : steps_of(on_table, "table"))
            EXPECT_NEAR(quantity(step, "table_height_mm"), quantity(step, "work_offset_z_mm"), 1e-6);
        EXPECT_NE(slurp(on_table + "/nc/" + planned.layers[0].operations[0].file).find("machine table's top"),
                  std::string::npos);
        EXPECT_EQ(schema_complaint(slurp(on_table + "/plan.json"), support::checkout("io/plan.schema.json")),
                  "");
        // Programs that are read from another height do not make the part.
        auto document = nlohmann::json::parse(slurp(on_table + "/plan.json"));
        document["job"]["machine"]["base_board_thickness"] = 22.5;
        spit(on_table + "/plan.json", document.dump());
        EXPECT_NE(codes(on_table).find("gouge.cutter"), std::string::npos) << table;
    }
}

TEST(ZeroInZ, AFrameOfTheTableNeedsTheBoardsThickness) {
    const TemporaryFolder folder;
    const std::string out = folder / "out";
    made("[machine]\ntable = \"fixed\"\nframe = \"table-top\"\n", out);
    auto document = nlohmann::json::parse(slurp(out + "/plan.json"));
    document.erase("job");
    spit(out + "/plan.json", document.dump());
    EXPECT_THROW((void)codes(out), Error);
}

TEST(ZeroAtAPin, ProgramsCountFromIt) {
    const TemporaryFolder folder;
    const std::string out = folder / "out";
    const Plan planned = made("[machine]\nzero = \"pin\"\npin = [-12.5, 30.0]\n", out);
    EXPECT_EQ(codes(out), "");
    const auto document = nlohmann::json::parse(slurp(out + "/plan.json"));
    EXPECT_NEAR(document["zero"][0].get<double>(), planned.stock_min[0] - 12.5, 1e-4);
    EXPECT_NEAR(document["zero"][1].get<double>(), planned.stock_min[1] + 30, 1e-4);
    EXPECT_EQ(schema_complaint(slurp(out + "/plan.json"), support::checkout("io/plan.schema.json")), "");
    const auto touched = steps_of(out, "touch_off");
    EXPECT_NEAR(quantity(touched.at(0), "slab_left_mm"), 12.5, 1e-3);
    EXPECT_NEAR(quantity(touched.at(0), "slab_front_mm"), -30, 1e-3);
    EXPECT_NE(slurp(out + "/nc/" + planned.layers[0].operations[0].file).find("x = y = 0 at the pin"),
              std::string::npos);
}

TEST(ZeroAtAPin, ThatNobodyNamedIsRefused) {
    EXPECT_NE(refusal("[machine]\nzero = \"pin\"\n").find("give machine.pin = [x, y]"), std::string::npos);
    EXPECT_NE(refusal("[machine]\nzero = \"pin\"\npin = [1.0]\n").find("machine.pin has 1 numbers"),
              std::string::npos);
}

TEST(Probing, JobsThatDoNotUseItSayNothingOfIt) {
    const TemporaryFolder folder;
    const std::string out = folder / "out";
    made("", out);
    for (const char* file : {"/plan.json", "/sequence.json"})
        EXPECT_EQ(slurp(out + file).find("prob"), std::string::npos) << file;
    EXPECT_EQ(slurp(out + "/plan.json").find("\"pin\""), std::string::npos);
}

TEST(Probing, TheReferenceIsProbedInEachLayer) {
    for (const char* units : {"mm", "in"})
        for (const char* frame : {"layer-top", "pattern-base", "table-top"}) {
            const TemporaryFolder folder;
            const std::string out = folder / "out";
            const Plan planned = made(
                fmt::format("{}units = \"{}\"\nframe = \"{}\"\nzero = \"corner\"\n", kOnTable, units, frame),
                out);
            EXPECT_EQ(codes(out), "") << units << " " << frame;
            EXPECT_TRUE(steps_of(out, "touch_off").empty());
            const auto probed = steps_of(out, "probe");
            ASSERT_EQ(probed.size(), planned.layers.size());
            for (std::size_t l = 0; l < probed.size(); ++l) {
                const Layer& layer = planned.layers[l];
                EXPECT_NEAR(quantity(probed[l], "touch_x_mm"), -40, 1e-6);
                EXPECT_NEAR(quantity(probed[l], "touch_y_mm"), 25, 1e-6);
                // The pattern's bottom lies on the base board.
                EXPECT_NEAR(quantity(probed[l], "touch_z_mm"),
                            10 + 2 - planned.job.machine.base_board_thickness -
                                zero_height(planned.job.machine, layer.z_top),
                            1e-6);
                EXPECT_NEAR(quantity(probed[l], "start_z_mm"), quantity(probed[l], "touch_z_mm") + 10, 1e-6);
                EXPECT_EQ(probed[l]["program"], fmt::format("nc/L{:03}_00_probe_T99.ngc", l + 1));
            }
            EXPECT_EQ(schema_complaint(slurp(out + "/plan.json"), support::checkout("io/plan.schema.json")),
                      "");
            EXPECT_EQ(
                schema_complaint(slurp(out + "/sequence.json"), support::checkout("io/sequence.schema.json")),
                "");
            // The folder is ours, with its probing programs.
            Context context;
            write(context, planned, out);
        }
}

TEST(Probing, EachTipIsProbedOnTheReferenceWhereTheControlKeepsNoLengths) {
    const TemporaryFolder folder;
    const std::string out = folder / "out";
    const Plan planned = made(kGrbl, out);
    EXPECT_EQ(codes(out), "");
    std::string last;
    int probes = 0;
    const auto document = nlohmann::json::parse(slurp(out + "/sequence.json"));
    for (const auto& step : document["steps"]) {
        const std::string action = step["action"];
        if (action == "tool_change") {
            EXPECT_EQ(step["length"], "probe");
        }
        if (last == "tool_change" || last == "table") {
            EXPECT_TRUE(action == "probe" || action == "tool_change") << action;
        }
        if (action == "probe") {
            ++probes;
            EXPECT_NEAR(quantity(step, "touch_z_mm"), 10 + 1.5 - planned.job.machine.base_board_thickness,
                        1e-6);
        }
        last = action;
    }
    EXPECT_EQ(static_cast<std::size_t>(probes), planned.probes.size());
    EXPECT_GE(static_cast<std::size_t>(probes), 2 * planned.layers.size());
    EXPECT_EQ(schema_complaint(slurp(out + "/sequence.json"), support::checkout("io/sequence.schema.json")),
              "");
}

TEST(Probing, LinuxCncsInterpreterFindsZeroWhereThePlanSays) {
    const TemporaryFolder folder;
    const std::string out = folder / "out";
    const Plan planned = made(kOnTable, out);
    const std::string table = slurp(out + "/tool.tbl");
    EXPECT_NE(table.find("T99 P99 D3 Z0 ;probe"), std::string::npos) << table;
    for (const ProbeProgram& probe : planned.probes) {
        const support::CanonProgram canon = support::interpret_rs274(slurp(out + "/nc/" + probe.file), table);
        EXPECT_TRUE(canon.ended);
        EXPECT_FALSE(canon.clockwise);
        EXPECT_EQ(canon.tool, 99);
        // A dry interpreter touches where a probing move ends: 20 down, 2 up, 4 down, then up by the retract.
        ASSERT_EQ(canon.motions.size(), 2u) << canon.text;
        EXPECT_NEAR(canon.motions[1].z, probe.touches[2] + 10, 1e-6) << canon.text;
        EXPECT_NE(canon.text.find("STRAIGHT_PROBE"), std::string::npos);
    }
}

TEST(Probing, ADamagedProgramIsTold) {
    struct Damage {
        const char *from, *to, *code;
    };
    const std::vector<Damage> all{{"G38.2 Z-20", "G38.2 Z20", "probe.descent"},
                                  {"G38.2 Z-4", "G38.2 Z4", "probe.descent"},
                                  {"G0 Z2", "G0 Z-2", "probe.descent"},
                                  {"G0 Z10", "G0 Z-10", "probe.descent"},
                                  {"G38.2 Z-20", "G1 Z-20", "probe"},
                                  {"G38.2 Z-4", "G0 Z-4", "probe"},
                                  {"G38.2 Z-4", "G38.3 Z-4", "probe.word"},
                                  {"F200", "F2000", "probe.feed"},
                                  {"F50", "F500", "probe.feed"},
                                  {" F50", "", "probe.word"},
                                  {"Z-20 F", "Z-60 F", "probe.search"},
                                  {"Z-4 F", "Z-1 F", "probe.search"},
                                  {"G10 L20 P1 Z", "G10 L20 P2 Z", "probe.offset"},
                                  {"G10 L20 P1 Z", "G10 L2 P1 Z", "probe.offset"},
                                  {"G10 L20 P1 Z-5", "G10 L20 P1 Z5", "probe.offset"},
                                  {"G10 L20 P1 Z-5", "G10 L20 P1 Z-6", "probe.offset"},
                                  {"G10 L20", "(G10 L20)", "probe"},
                                  {"G0 Z10", "", "probe.retract"},
                                  {"G0 Z10\n", "G0 Z10 X5\n", "probe.word"},
                                  {"M5\n", "M3 S1000\n", "probe.spindle"},
                                  {"M5\n", "M5\nM3\n", "probe.spindle"},
                                  {"M5\n", "", "probe.spindle"},
                                  {"G91\n", "", "probe"},
                                  {"G90\nM2", "M2", "probe.word"},
                                  {"M2\n", "", "probe.word"},
                                  {"M2\n", "M2\nG0 Z-50\n", "probe.word"},
                                  {"G54\n", "G55\n", "probe.word"},
                                  {"G21 ", "G20 ", "probe.word"},
                                  {"T99 M6", "T2 M6", "probe.tool"},
                                  {"G43 H99\n", "G43 H2\n", "probe.tool"},
                                  {"G43 H99\n", "", "probe.tool"}};
    const TemporaryFolder folder;
    const std::string out = folder / "out";
    const Plan planned = made(std::string(kOnTable) + "frame = \"layer-top\"\n", out);
    const std::string file = out + "/nc/" + planned.probes.back().file, whole = slurp(file);
    const ProbeTask task{99, planned.probes.back().touches[2]};
    EXPECT_TRUE(check_probe(whole, file, task, planned.job).empty());
    for (const Damage& damage : all) {
        std::string text = whole;
        replace(text, damage.from, damage.to);
        const std::vector<Violation> found = check_probe(text, file, task, planned.job);
        EXPECT_TRUE(std::any_of(found.begin(), found.end(),
                                [&](const Violation& v) { return v.code.starts_with(damage.code); }))
            << damage.from << " -> " << damage.to << (found.empty() ? "" : ": " + found[0].code);
    }
    std::string text = whole;
    replace(text, "F50", "F300");
    spit(file, text);
    EXPECT_EQ(codes(out), "probe.feed probe.offset ");
    std::filesystem::remove(file);
    EXPECT_EQ(codes(out), "program.missing ");
}

TEST(Probing, EveryLostOrDoubledLineOfWordsIsToldOrDoesNothing) {
    const TemporaryFolder folder;
    const std::string out = folder / "out";
    const Plan planned = made(kOnTable, out);
    const std::string whole = slurp(out + "/nc/" + planned.probes[0].file);
    const ProbeTask task{99, planned.probes[0].touches[2]};
    for (std::size_t at = 0; at < whole.size();) {
        const std::size_t end = whole.find('\n', at) + 1;
        const std::string line = whole.substr(at, end - at);
        if (line[0] != '(') {
            const std::string lost = whole.substr(0, at) + whole.substr(end);
            EXPECT_FALSE(check_probe(lost, "x", task, planned.job).empty()) << "lost " << line;
        }
        at = end;
    }
}

TEST(Probing, AStepThatLiesIsTold) {
    struct Lie {
        const char* key;
        nlohmann::json value;
        const char* code;
    };
    const std::vector<Lie> lies{
        {"touch_x_mm", 3, "sequence.probe "},  {"touch_z_mm", 3, "sequence.probe "},
        {"start_z_mm", 90, "sequence.probe "}, {"tool", 2, "sequence.tool "},
        {"touch_y_mm", 0, "sequence.probe "},  {"program", "nc/L001_01_face_T1.ngc", "sequence.program "}};
    const TemporaryFolder folder;
    const std::string out = folder / "out";
    made(kOnTable, out);
    const auto good = nlohmann::json::parse(slurp(out + "/sequence.json"));
    const auto with = [&](const std::function<bool(nlohmann::json&)>& change) {
        auto document = good;
        for (auto& step : document["steps"])
            if (step["action"] == "probe" && change(step)) break;
        spit(out + "/sequence.json", document.dump());
        return codes(out);
    };
    for (const Lie& lie : lies)
        EXPECT_EQ(with([&](nlohmann::json& step) {
                      step[lie.key] = lie.value;
                      return true;
                  }),
                  lie.code)
            << lie.key;
}

TEST(Probing, IsRefusedWhereNoCycleIsSure) {
    for (const char* post : {"fanuc", "haas", "mach", "iso", "siemens", "heidenhain"}) {
        const std::string told = refusal(fmt::format("[machine]\npost = \"{}\"\nprobe = \"cycle\"\n", post));
        EXPECT_TRUE(told.starts_with("job.probe: no probing program is written")) << post << told;
        EXPECT_NE(told.find("the sequence asks the operator"), std::string::npos);
    }
    EXPECT_NE(refusal("[machine]\npost = \"grbl\"\ntable = \"fixed\"\nprobe = \"cycle\"\n")
                  .find("give probing.reference"),
              std::string::npos);
    EXPECT_NE(refusal("[machine]\ntable = \"fixed\"\nprobe = \"cycle\"\n").find("a raw slab is no place"),
              std::string::npos);
    EXPECT_NE(refusal("[machine]\nprobe = \"cycle\"\n[probing]\nreference = [0.0, 0.0, 0.0]\n")
                  .find("moves away with the stack"),
              std::string::npos);
    EXPECT_NE(refusal("[machine]\nprobe = \"cycle\"\nmagazine = 12\n").find("no place in the magazine"),
              std::string::npos);
    for (const char* key :
         {"fast_feed = 900.0", "slow_feed = 300.0", "search = 1.0", "retract = 0.5", "plate = -1.0",
          "reference = [1.0]", "tool = 0", "tool = 100000", "tip_diameter = 0.0"})
        EXPECT_TRUE(refusal(fmt::format("[machine]\ntable = \"fixed\"\nprobe = \"cycle\"\n[probing]\n{}{}\n",
                                        std::string_view(key).starts_with("reference")
                                            ? ""
                                            : "reference = [-40.0, 25.0, 10.0]\n",
                                        key))
                        .starts_with("job.range"))
            << key;
}

TEST(Probing, TheTipKeepsClearOfWhatStandsBesideThePad) {
    const auto with_bolt = [](const std::string& job, double x) {
        return fmt::format(
            "{}zero = \"corner\"\n[[machine.keep_out]]\nname = \"bolt\"\ncircle = [{}, 25, 4]\nheight "
            "= 20\nclearance = 5\n",
            job, x);
    };
    // Tip 3 mm wide: 1.5 + 5 + 4 mm from middle to middle are enough.
    const std::string probe =
        "[probing]\nplate = 2.0\nreference = [-80.0, 25.0, 10.0]\n[machine]\ntable = \"fixed\"\nprobe = "
        "\"cycle\"\n";
    EXPECT_EQ(refusal(with_bolt(probe, -90.6)), "");
    const std::string told = refusal(with_bolt(probe, -90.4));
    EXPECT_TRUE(told.starts_with("keep_out.probe: T99 finds z 0 6.40 mm from \"bolt\"")) << told;
    EXPECT_NE(told.find("move probing.reference"), std::string::npos) << told;
    // A GRBL has each tool of the job touched off: the face mill is 25 mm to the side.
    const std::string grbl =
        "[probing]\nplate = 1.5\nreference = [-60.0, 25.0, 10.0]\n[machine]\npost = \"grbl\"\nprograms = "
        "\"tool\"\ntable = \"fixed\"\nprobe = \"cycle\"\n";
    EXPECT_TRUE(refusal(with_bolt(grbl, -93)).starts_with("keep_out.probe: T1 finds z 0 29.00 mm"));
    EXPECT_EQ(refusal(with_bolt(grbl, -94.1)), "");
}

TEST(Probing, ABoltThatCameLaterIsToldAtThePad) {
    const TemporaryFolder folder;
    const std::string out = folder / "out";
    const Plan planned = made(std::string(kOnTable) + "zero = \"corner\"\n", out);
    KeepOut bolt;
    bolt.name = "bolt";
    bolt.height = 5;
    const auto found = [&](double x) {
        bolt.circle = {x, 25, 4};
        const std::vector<KeepOut> later{bolt};
        Context context;
        std::set<std::string> files;
        for (const Violation& v :
             verify_folder(context, out, {.source = PatternSource(kSphere), .cell = 1, .keep_outs = &later})
                 .report.violations)
            if (v.code == "keep_out.cut") files.insert(v.file);
        return files;
    };
    EXPECT_TRUE(found(-50.6).empty());
    std::set<std::string> probes;
    for (const ProbeProgram& probe : planned.probes) probes.insert(probe.file);
    EXPECT_EQ(found(-50.4), probes);
}

TEST(Probing, ABuildUnderWayIsResumedAndALayerMadeAgain) {
    for (const std::string& toml : {std::string(kOnTable), std::string(kGrbl)}) {
        const TemporaryFolder folder;
        const std::string out = folder / "out";
        const Plan planned = made(toml, out);
        int after = 0;
        for (const SequenceStep& step : planned.sequence)
            if (step.layer == 2 && after == 0 && (step.action == "face" || step.action == "mill"))
                after = step.id;
        ASSERT_GT(after, 0);
        Context context;
        (void)resume_build(context, out, {after, {}, 1'795'617'730});
        (void)resume_build(context, out, {{}, 2, 1'795'617'790});
        EXPECT_EQ(schema_complaint(slurp(out + "/resume_001/sequence.json"),
                                   support::checkout("io/sequence.schema.json")),
                  "");
        // Layer 2 is probed again, after it has been laid anew.
        const auto probed = steps_of(out + "/resume_001", "probe");
        EXPECT_GT(probed.size(), planned.probes.size());
        (void)resume_build(context, out, {{}, {}, 1'795'617'850});
    }
}
