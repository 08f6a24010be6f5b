// plan.json and sequence.json keep their contracts (the schemas beside the writers), and OUT is all or
// nothing.
#include "io/write/plan_json.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <regex>
#include <set>
#include <sstream>

#include "engine/schedule/schedule.h"
#include "io/posts/gcode_writer.h"
#include "io/posts/tool_table.h"
#include "io/read/job_toml.h"
#include "io/slabwright.h"
#include "io/text/json_text.h"
#include "io/write/job_toml.h"
#include "io/write/sequence_json.h"
#include "kernels/errors.h"
#include "tests/support/comma_locale.h"
#include "tests/support/files.h"
#include "tests/support/places.h"
#include "tests/support/schema.h"
#include "tests/support/seed.h"
#include "tests/support/temporary_folder.h"

using namespace slabwright;
namespace fs = std::filesystem;
using nlohmann::json;
using slabwright::support::schema_complaint;
using slabwright::support::slurp;
using slabwright::support::spit;
using slabwright::support::TemporaryFolder;
using slabwright::support::tree;

namespace {

Plan hand_made() {
    Plan plan;
    plan.input.file = "pümp \"cover\"\n.stl";
    plan.input.sha256 = std::string(64, 'a');
    plan.input.triangles = 12;
    plan.input.min = {-1.25, 0, 3};
    plan.input.max = {98.75, 50, 40};
    plan.stock_min = {-26.65, -25.4};
    plan.stock_max = {124.15, 75.4};
    Feature flat;
    flat.type = FeatureType::up_flat;
    flat.found_by = FoundBy::facets;
    flat.z_low = flat.z_high = 18.123456789;
    flat.x = 1e-9;
    flat.area = 123.4567;
    flat.facets = {1, 2};
    Feature shallow = flat;
    shallow.type = FeatureType::shallow;
    shallow.z_low = shallow.z_high = 7;
    Feature peak;
    peak.type = FeatureType::peak;
    peak.found_by = FoundBy::exact;
    peak.z_low = peak.z_high = 37;
    plan.features = {peak, flat, shallow};
    for (int i = 1; i <= 2; ++i) {
        Layer layer;
        layer.index = i;
        layer.z_bottom = 18.5 * (i - 1);
        layer.z_top = 18.5 * i;
        layer.slab_thickness = 19;
        layer.reason = "as high as a layer may be";
        Joint& joint = layer.joints.emplace_back();
        joint.z = layer.z_bottom;
        joint.glue.points = {{0, 0}, {500000, 0}, {500000, 300000}, {0, 300000}};
        joint.glue.close_loop();
        joint.standing_mm2 = 1800;
        joint.area_mm2 = 1500;
        joint.centroid = {25, 15};
        joint.force_n = 750;
        joint.pressure_mpa = 0.5;
        for (int k = 0; k < 3; ++k) {
            Operation operation;
            operation.kind = k == 0   ? OperationKind::face
                             : k == 1 ? OperationKind::rough
                                      : OperationKind::semi_rough;
            operation.purpose = "levels";
            operation.tool = k == 2 ? 3 : k + 1;
            operation.stepdown = 2.54;
            operation.spindle_rpm = 18000;
            const std::int32_t clearance = to_units(layer.z_top + 10);
            operation.clearance_z = layer.z_top + 10;
            operation.moves = {{0, 0, clearance, 0},
                               {k, 5, clearance, 0},
                               {k, 5, clearance - 110000, 900},
                               {400000, 5, clearance - 110000, 9000},
                               {400000, 5, clearance, 0}};
            operation.cutting_mm = 51;
            operation.rapid_mm = 11;
            operation.minutes = 1.0 / 3;
            operation.peak_force_n = 20.5;
            operation.deflection_mm = 1.25e-5;
            operation.wall_error_mm = 1e-5;
            operation.peak_at = {1, 2, 3};
            layer.operations.push_back(operation);
        }
        plan.layers.push_back(layer);
    }
    plan.diagnostics = {{Severity::note, "mesh.welded", "3 vertices were merged", std::nullopt},
                        {Severity::warning, "undercut.unmade", "x", std::array<double, 3>{1, 2, 3.5}}};
    schedule(plan);
    return plan;
}

}  // namespace

// What a terminal could obey, and what is no UTF-8, is not shown.
TEST(JsonText, PrintableTextHasNoControlsAndIsUtf8) {
    EXPECT_EQ(printable("a\x01"
                        "b\x1B[31m\x7F\tz",
                        true),
              "a b [31m  z");
    EXPECT_EQ(printable("\xC2\x85|\xC2\x9F|\xC2\xA0|\xC3\xA4|\xE2\x82\xAC|\xF0\x9F\x98\x80", true),
              " | |\xC2\xA0|\xC3\xA4|\xE2\x82\xAC|\xF0\x9F\x98\x80");
    EXPECT_EQ(printable("\xFF|\xC3|\x80|\xC0\xAF|\xE0\x80\x80|\xED\xA0\x80|\xF4\x90\x80\x80", true),
              "?|?|?|??|???|???|????");
    EXPECT_EQ(printable("a\nb", true), "a b");
    EXPECT_EQ(printable("a\nb\r", false), "a\nb ");
    EXPECT_EQ(quoting_line(std::string(400, 'x')), std::string(400, 'x'));
    EXPECT_EQ(quoting_line(std::string(401, 'x')), std::string(400, 'x') + " …");
}

TEST(JsonText, NumbersHaveNoExponentAndReadBack) {
    const unsigned seed = test::seed();
    std::mt19937_64 random(seed);
    const std::regex plain("-?(0|[1-9][0-9]*)(\\.[0-9]{0,2}[1-9])?");
    for (int i = 0; i < 20000; ++i) {
        double value = 0;
        const std::uint64_t bits = random();
        std::memcpy(&value, &bits, sizeof value);
        if (!std::isfinite(value)) continue;
        JsonText text;
        text.exact(value);
        const std::string digits = text.take();
        ASSERT_EQ(digits.find_first_of("eE"), std::string::npos);
        ASSERT_EQ(std::strtod(digits.c_str(), nullptr), value) << digits;
        const double small = std::fmod(value, 1e6);
        std::string rounded;
        append_rounded(rounded, small, 3);
        ASSERT_NEAR(std::strtod(rounded.c_str(), nullptr), small, 0.5001e-3);
        ASSERT_TRUE(std::regex_match(rounded, plain)) << rounded;
        ASSERT_NE(rounded, "-0");
    }
    JsonText text;
    EXPECT_THROW(text.exact(std::numeric_limits<double>::quiet_NaN()), Error);
    EXPECT_THROW(text.rounded(std::numeric_limits<double>::infinity(), 3), Error);
    JsonText zeros;
    zeros.begin_array(JsonText::Shape::line)
        .exact(-0.0)
        .rounded(-1e-9, 3)
        .rounded(100, 0)
        .rounded(0.125, 9)
        .end();
    EXPECT_EQ(zeros.take(), "[0, 0, 100, 0.125]\n");
}

TEST(JsonText, StringsReadBackWhateverTheyHold) {
    std::string all;
    for (int c = 0; c < 128; ++c) all += static_cast<char>(c);
    all += "ä€\xF0\x9F\x94\xA9";
    JsonText text;
    text.string(all);
    EXPECT_EQ(json::parse(text.take()).get<std::string>(), all);
    std::mt19937 random(5);
    for (int i = 0; i < 2000; ++i) {
        std::string garbage;
        for (int k = 0; k < 12; ++k) garbage += static_cast<char>(random() & 255u);
        JsonText other;
        other.string(garbage);
        EXPECT_TRUE(json::accept(other.take())) << "a file name of any bytes makes readable JSON";
    }
}

TEST(PlanJson, KeepsItsSchema) {
    for (const Frame frame : {Frame::pattern_base, Frame::layer_top}) {
        Plan plan = hand_made();
        plan.job.machine.frame = frame;
        schedule(plan);
        EXPECT_EQ(schema_complaint(plan_json(plan), support::checkout("io/plan.schema.json")), "");
        EXPECT_EQ(schema_complaint(sequence_json(plan), support::checkout("io/sequence.schema.json")), "");
    }
    Plan plan = hand_made();
    schedule(plan);
    for (const char* how : {"none", "mend", "rebuild"}) {
        plan.input.repair = InputRepair{how, {}, .02, .25, .1, .05, 1000};
        plan.input.repair->defects = {{"crack", 12, .03, "mm", {1, 2, 3}}, {"degenerate", 1, 0, "", {}}};
        EXPECT_EQ(schema_complaint(plan_json(plan), support::checkout("io/plan.schema.json")), "");
        EXPECT_EQ(json::parse(plan_json(plan))["input"]["repair"]["defects"][0]["count"], 12);
    }
}

TEST(PlanJson, SchemaRefusesWhatBreaksTheContract) {
    // A schema that accepts anything would make the test above worthless.
    const json good = json::parse(plan_json(hand_made()));
    const auto refused = [&](const std::function<void(json&)>& change) {
        json broken = good;
        change(broken);
        return schema_complaint(broken.dump(), support::checkout("io/plan.schema.json")) != "";
    };
    EXPECT_TRUE(refused([](json& j) { j["layers"][0]["operations"][0].erase("peak_force_n"); }));
    EXPECT_TRUE(refused([](json& j) { j["layers"][0]["operations"][0]["kind"] = "polish"; }));
    EXPECT_TRUE(refused([](json& j) { j["tools"][0]["diameter"] = "12.7"; }));
    EXPECT_TRUE(refused([](json& j) { j["frame"] = "table"; }));
    EXPECT_TRUE(refused([](json& j) { j["made_at"] = "2026-01-01"; }));
    EXPECT_TRUE(refused([](json& j) { j["diagnostics"][0].erase("where"); }));
    json sequence = json::parse(sequence_json(hand_made()));
    sequence["steps"][2].erase("needs");
    EXPECT_NE(schema_complaint(sequence.dump(), support::checkout("io/sequence.schema.json")), "");
}

TEST(PlanJson, SaysWhatThePlanHolds) {
    const Plan plan = hand_made();
    const std::string text = plan_json(plan);
    const json j = json::parse(text);
    EXPECT_EQ(j["schema"], "slabwright.plan/1");
    EXPECT_EQ(j["input"]["file"], plan.input.file);
    EXPECT_EQ(j["input"]["bbox"]["min"], json::array({-1.25, 0, 3}));
    EXPECT_EQ(j["stock"]["max"][0], 124.15);
    EXPECT_TRUE(j["flask"].is_null());
    EXPECT_EQ(j["tools"].size(), 3u);
    EXPECT_EQ(j["tools"][1]["kind"], "flat");
    EXPECT_EQ(j["tools"][1]["holder"]["diameter"], 40);
    EXPECT_EQ(j["features"][0]["z"], 37);
    EXPECT_EQ(j["features"][2]["z"], json::array({7, 7})) << "a patch has a range, even a thin one";
    EXPECT_EQ(j["layers"].size(), 2u);
    const json& operation = j["layers"][1]["operations"][2];
    EXPECT_EQ(operation["kind"], "semi_rough");
    EXPECT_EQ(operation["file"], "nc/L002_03_semi_rough_T3.ngc");
    EXPECT_EQ(operation["minutes"], 0.3333);
    EXPECT_NEAR(operation["deflection_mm"].get<double>(), 1.25e-5, 0.5e-6);
    EXPECT_NEAR(operation["wall_error_mm"].get<double>(), 1e-5, 0.5e-6);
    EXPECT_EQ(operation["peak_at"], json::array({1, 2, 3}));
    EXPECT_EQ(j["totals"]["layers"], 2);
    EXPECT_EQ(j["totals"]["tool_changes"], 6);
    EXPECT_TRUE(j["diagnostics"][0]["where"].is_null());
    EXPECT_EQ(j["diagnostics"][1]["where"], json::array({1, 2, 3.5}));
    EXPECT_EQ(j["frame"], "layer-top");
    EXPECT_EQ(j["job"]["machine"]["frame"], "auto");
    EXPECT_EQ(j["job"]["cutting"]["finish_feed"], 5000);
    EXPECT_EQ(text.find("e-"), std::string::npos) << "no number has an exponent";
    EXPECT_EQ(plan_json(plan), text);
}

TEST(PlanJson, SaysWhatStaysOfTheSlabs) {
    Plan plan = hand_made();
    const auto square = [](std::int32_t half) {
        Loops loops;
        loops.points = {{-half, -half}, {half, -half}, {half, half}, {-half, half}};
        loops.close_loop();
        return loops;
    };
    plan.flask = Flask{square(1000001), {square(500000), square(510000)}, 24.5, 2e6, 1e6};
    const std::string text = plan_json(plan);
    EXPECT_EQ(schema_complaint(text, support::checkout("io/plan.schema.json")), "");
    const json flask = json::parse(text)["flask"];
    EXPECT_EQ(flask["outer"][0], json::array({-100.0001, -100.0001}));
    EXPECT_EQ(flask["inner"], flask["inner_by_layer"][0]);
    EXPECT_EQ(flask["inner_by_layer"][1][2], json::array({51, 51}));
    EXPECT_EQ(flask["mass_kg"], 1.5);
    EXPECT_EQ(flask["wall_mm"], 24.5);
}

TEST(PlanJson, NotANumberIsAnErrorNotAFile) {
    Plan plan = hand_made();
    plan.layers[1].operations[0].peak_force_n = std::nan("");
    EXPECT_THROW((void)plan_json(plan), Error);
    TemporaryFolder folder;
    Context context;
    EXPECT_THROW(write(context, plan, (folder.path / "out").string()), Error);
    EXPECT_TRUE(fs::is_empty(folder.path)) << "nothing half-written stays";
}

TEST(SequenceJson, PointersAndNeedsResolve) {
    const Plan plan = hand_made();
    const json j = json::parse(sequence_json(plan));
    std::set<int> ids;
    int glue_steps = 0;
    for (const json& step : j["steps"]) {
        for (const json& need : step["needs"]) EXPECT_TRUE(ids.count(need.get<int>()));
        ids.insert(step["id"].get<int>());
        if (step["action"] == "glue") {
            ++glue_steps;
            const json& glue = j.at(json::json_pointer(step["polygons"].get<std::string>().substr(1)));
            EXPECT_EQ(glue["layer"], step["layer"]);
            EXPECT_EQ(glue["loops"][0][2], json::array({50, 30}));
        }
    }
    EXPECT_EQ(glue_steps, 2);
}

TEST(Locale, CommasChangeNothing) {
    const support::CommaLocale locale;
    const Plan plan = hand_made();
    const auto everything = [&] {
        return plan_json(plan) + sequence_json(plan) + tool_table(plan.job) +
               program_text(plan, plan.layers[1], plan.layers[1].operations[1]) +
               job_toml(parse_job(job_toml(Job{}), "defaults"));
    };
    const std::string expected = everything();
    const support::CommaScope scope(locale);
    if (!scope.active) {
        std::printf("skipped: no locale with decimal commas could be made here\n");
        return;
    }
    EXPECT_EQ(everything(), expected);
}

TEST(Write, HoldsTheContractAndReplacesOnlyItsOwn) {
    TemporaryFolder folder;
    const fs::path out = folder.path / "a" / "b" / "out";
    Context context({.threads = 2, .memory_bytes = 0, .progress = {}});
    const Plan plan = hand_made();
    write(context, plan, out.string());
    const auto first = tree(out);
    EXPECT_EQ(first.size(), 6u + 6u);
    EXPECT_EQ(first.at("plan.json"), plan_json(plan));
    EXPECT_EQ(first.at("tool.tbl"), tool_table(plan.job));
    EXPECT_EQ(first.at("sequence.json"), sequence_json(plan));
    EXPECT_EQ(first.at("nc/L001_02_rough_T2.ngc"),
              program_text(plan, plan.layers[0], plan.layers[0].operations[1]));

    // A plan of ours is replaced whole: the second has one layer less.
    Plan shorter = plan;
    shorter.layers.pop_back();
    schedule(shorter);
    Context single({.threads = 1, .memory_bytes = 0, .progress = {}});
    write(single, shorter, out.string() + "/");
    EXPECT_EQ(tree(out).size(), 6u + 3u);
    EXPECT_EQ(std::distance(fs::directory_iterator(out.parent_path()), fs::directory_iterator()), 1)
        << "nothing stays beside it";

    const auto refused = [&](const fs::path& target) {
        const auto before = tree(folder.path);
        try {
            write(context, plan, target.string());
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::input);
            EXPECT_FALSE(error.place().empty() && !target.empty());
            EXPECT_EQ(tree(folder.path), before) << "a refusal changes nothing";
            return true;
        }
        return false;
    };
    // A folder with somebody's files, ours or not, is not replaced.
    spit(out / "notes.txt", "do not lose this");
    EXPECT_TRUE(refused(out));
    fs::remove(out / "notes.txt");
    spit(out / "nc" / "hand.txt", "nor this");
    EXPECT_TRUE(refused(out));
    fs::remove(out / "nc" / "hand.txt");
    spit(out / "verify.json", "{}");  // one of ours
    EXPECT_FALSE(refused(out));
    fs::create_directory(folder.path / "foreign");
    spit(folder.path / "foreign" / "plan.json", "{\"schema\": \"somebody.else/1\"}");
    EXPECT_TRUE(refused(folder.path / "foreign"));
    spit(folder.path / "file", "x");
    EXPECT_TRUE(refused(folder.path / "file"));
    EXPECT_TRUE(refused(folder.path / "file" / "below"));
    EXPECT_TRUE(refused(""));
    EXPECT_TRUE(refused("/proc/nowhere/out"));
    fs::create_directory(folder.path / "empty");
    EXPECT_FALSE(refused(folder.path / "empty"));
    fs::create_directory_symlink(out, folder.path / "link");
    EXPECT_FALSE(refused(folder.path / "link"));
    EXPECT_TRUE(fs::is_symlink(folder.path / "link")) << "the link stays, what it points to is replaced";
}

TEST(Write, CancelledAtAnyMomentLeavesTheOldPlan) {
    TemporaryFolder folder;
    const fs::path out = folder.path / "out";
    Plan plan = hand_made();
    Context first;
    write(first, plan, out.string());
    const auto before = tree(folder.path);
    plan.input.file = "other.stl";
    // The sink is called at the phase's start and after every program, so each of these stops the work
    // somewhere else.
    for (int stop_at = 1; stop_at <= 6; ++stop_at) {
        int calls = 0;
        Context* context = nullptr;
        Context cancelled({.threads = 1, .memory_bytes = 0, .progress = [&](const Progress&) {
                               if (++calls == stop_at) context->cancel();
                           }});
        context = &cancelled;
        try {
            write(cancelled, plan, out.string());
            ADD_FAILURE() << "not cancelled at call " << stop_at;
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::cancelled);
        }
        EXPECT_EQ(tree(folder.path), before);
        fs::path fresh = folder.path / "x" / "y" / "new";
        EXPECT_THROW(write(cancelled, plan, fresh.string()), Error);
        EXPECT_FALSE(fs::exists(folder.path / "x")) << "parents that were made for it go again";
    }
}
