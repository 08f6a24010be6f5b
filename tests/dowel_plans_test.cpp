// Plans with dowels: their programs, lists and steps, proven from the text; and what is told where one of
// them is not as planned.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>
#include <sstream>

#include "io/slabwright.h"
#include "tests/data/models.h"
#include "tests/support/files.h"
#include "tests/support/places.h"
#include "tests/support/rs274.h"
#include "tests/support/schema.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

using nlohmann::json;
using support::slurp;
using support::spit;
using support::TemporaryFolder;

// The default job with dowels, and a drill or an end mill for their holes.
Job with_dowels(int per_joint, ToolKind kind = ToolKind::drill, double diameter = 8) {
    Job job;
    job.dowels.per_joint = per_joint;
    Tool tool = job.tools[1];
    tool.number = 11;
    tool.kind = kind;
    tool.name = "for dowels";
    tool.diameter = tool.shank_diameter = diameter;
    tool.flute_length = 45;
    tool.stickout = 60;
    tool.plunge_feed = 600;
    tool.plunges = kind == ToolKind::drill;
    tool.stepdown_min = 1;
    tool.stepdown_max = 6;
    job.tools.push_back(tool);
    return job;
}

// A model planned and written with its proof, to be spoilt and verified again.
struct Built {
    TemporaryFolder folder;
    std::string out = folder / "out", stl = folder / "pattern.stl";
    json plan;
    bool passed = false;

    Built(const std::string& bytes, const Job& job, bool accept = false) {
        spit(stl, bytes);
        Context context;
        Job asked = job;
        asked.allow_undercut = asked.bonding.accept_weak = accept;
        const std::shared_ptr<Pattern> pattern = read_pattern(context, stl, asked);
        Plan made = slabwright::plan(context, *pattern, asked);
        passed = write_proven(context, made, out, pattern).passed;
        plan = json::parse(slurp(out + "/plan.json"));
    }
    [[nodiscard]] std::string program(std::size_t layer) const {
        for (const json& op : plan["layers"][layer]["operations"])
            if (op["purpose"] == "dowel holes") return out + "/" + op["file"].get<std::string>();
        return "";
    }
    // The codes of what is found when a file holds another text for once, each once, in their order.
    [[nodiscard]] std::string found(const std::string& file, const std::string& text) const {
        const std::string was = slurp(file);
        spit(file, text);
        Context context;
        std::set<std::string> codes;
        for (const Diagnostic& d : verify(context, out, stl, "", 1).violations) codes.insert(d.code);
        spit(file, was);
        std::string all;
        for (const std::string& code : codes) all += (all.empty() ? "" : " ") + code;
        return all;
    }
};

std::string replaced(std::string text, const std::string& from, const std::string& to) {
    EXPECT_NE(text.find(from), std::string::npos) << from;
    for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
        text.replace(at, from.size(), to);
    return text;
}

// Every X, Y or Z word of a program through a function.
std::string with_words(const std::string& program, char letter, const std::function<double(double)>& turn) {
    std::string text;
    std::istringstream lines(program);
    for (std::string line; std::getline(lines, line); text += line + '\n') {
        const std::size_t at = line[0] == '(' ? std::string::npos : line.find(letter);
        if (at == std::string::npos) continue;
        const std::size_t end = line.find_first_not_of("-.0123456789", at + 1);
        const double value = std::stod(line.substr(at + 1));
        line = line.substr(0, at + 1) + fmt::format("{:.4f}", turn(value)) +
               (end == std::string::npos ? "" : line.substr(end));
    }
    return text;
}

TEST(DowelPlans, ArePlannedProvenAndTold) {
    Job job = with_dowels(2);
    job.dowels.clearance = 6;
    job.prices.dowel = 0.25;
    const Built built(stl_bytes("pump", pump_cover()), job);
    EXPECT_TRUE(built.passed);
    const json proof = json::parse(slurp(built.out + "/verify.json"));
    EXPECT_TRUE(proof["violations"].empty()) << proof["violations"].dump(1);
    for (const char* name : {"plan", "sequence"})
        EXPECT_EQ(support::schema_complaint(slurp(fmt::format("{}/{}.json", built.out, name)),
                                            support::checkout(fmt::format("io/{}.schema.json", name))),
                  "");
    const json sequence = json::parse(slurp(built.out + "/sequence.json"));
    std::istringstream list(slurp(built.out + "/dowels.csv"));
    std::string line;
    std::getline(list, line);
    std::size_t dowels = 0;
    for (std::size_t l = 0; l < built.plan["layers"].size(); ++l) {
        const json& layer = built.plan["layers"][l];
        EXPECT_EQ(layer.contains("dowels"), !built.program(l).empty());
        if (!layer.contains("dowels")) continue;
        EXPECT_EQ(layer["rounds"], 0) << "the proof took a dowel for a gouge";
        EXPECT_EQ(layer["operations"].back()["purpose"], "dowel holes");
        const json& next = built.plan["layers"][l + 1];
        for (const json& step : sequence["steps"])
            if (step["action"] == "set_dowels" && step["layer"] == next["index"]) {
                EXPECT_EQ(step["count"], layer["dowels"].size());
                EXPECT_EQ(step["seconds"], 5 * static_cast<int>(layer["dowels"].size()));
                EXPECT_LT(step["length_mm"].get<double>(), layer["dowels"][0]["below"].get<double>() +
                                                               layer["dowels"][0]["above"].get<double>());
            }
        // LinuxCNC's own interpreter goes down there and nowhere else.
        const support::CanonProgram canon =
            support::interpret_rs274(slurp(built.program(l)), slurp(built.out + "/tool.tbl"));
        EXPECT_TRUE(canon.ended);
        std::set<std::pair<double, double>> places;
        double lowest = 0;
        for (const support::CanonMotion& m : canon.motions)
            if (m.z < 0) {
                places.insert({m.x, m.y});
                lowest = std::min(lowest, m.z);
            }
        EXPECT_EQ(places.size(), layer["dowels"].size());
        for (const json& dowel : layer["dowels"]) {
            ++dowels;
            EXPECT_TRUE(places.contains({dowel["x"].get<double>(), dowel["y"].get<double>()}));
            const double point = 4 / std::tan(59 * std::numbers::pi / 180);
            EXPECT_NEAR(lowest, -dowel["below"].get<double>() - point, 2e-4);
            // The list's hole, turned over, lies above it.
            ASSERT_TRUE(std::getline(list, line));
            std::replace(line.begin(), line.end(), ',', ' ');
            std::istringstream cells(line);
            double index = 0, slab = 0, hole = 0, diameter = 0, depth = 0, left = 0, front = 0;
            cells >> index >> slab >> hole >> diameter >> depth >> left >> front;
            EXPECT_EQ(index, next["index"].get<double>());
            EXPECT_NEAR(next["blank"]["max"][0].get<double>() - left, dowel["x"].get<double>(), 1e-3);
            EXPECT_NEAR(next["blank"]["min"][1].get<double>() + front, dowel["y"].get<double>(), 1e-3);
            EXPECT_NEAR(depth, dowel["above"].get<double>(), 1e-9);
        }
    }
    EXPECT_GE(dowels, 4u);
    EXPECT_FALSE(std::getline(list, line));
    const std::string dxf = slurp(built.out + "/cut_list.dxf");
    std::size_t circles = 0;
    for (std::size_t at = 0; (at = dxf.find("CIRCLE\n8\nDOWELS", at)) != std::string::npos; ++at) ++circles;
    EXPECT_EQ(circles, dowels);
    EXPECT_NEAR(built.plan["cost"]["dowels"].get<double>(), 0.25 * static_cast<double>(dowels), 1e-9);
}

TEST(DowelPlans, ASpoiltHoleIsTold) {
    const Built built(stl_bytes("pump", pump_cover()), with_dowels(2));
    ASSERT_TRUE(built.passed);
    const std::string file = built.program(0), text = slurp(file);
    ASSERT_FALSE(text.empty());
    EXPECT_EQ(built.found(file, text), "");
    const auto told = [&](const std::string& other) { return " " + built.found(file, other) + " "; };
    const auto has = [&](const std::string& codes, const char* code) {
        return codes.find(fmt::format(" {} ", code)) != std::string::npos;
    };
    const auto plus = [](double by) { return [by](double v) { return v + by; }; };
    // Moved: by a little as a place, by more as a gouge too, far away as a hole that is missing.
    std::string codes = told(with_words(text, 'X', plus(0.2)));
    EXPECT_TRUE(has(codes, "dowel.place") && has(codes, "gouge.cutter")) << codes;
    codes = told(with_words(text, 'Y', plus(1)));
    EXPECT_TRUE(has(codes, "dowel.place") && has(codes, "gouge.cutter")) << codes;
    codes = told(with_words(text, 'Y', plus(12)));
    EXPECT_TRUE(has(codes, "dowel.missing") && has(codes, "gouge.cutter")) << codes;
    // Deeper and not as deep.
    const auto down = [](double by) { return [by](double z) { return z < -1 ? z - by : z; }; };
    codes = told(with_words(text, 'Z', down(0.3)));
    EXPECT_TRUE(has(codes, "dowel.depth") && has(codes, "gouge.cutter")) << codes;
    codes = told(with_words(text, 'Z', down(-0.3)));
    EXPECT_TRUE(has(codes, "dowel.depth") && !has(codes, "gouge.cutter")) << codes;
    EXPECT_FALSE(has(told(with_words(text, 'Z', down(0.05))), "dowel.depth"));
    // Sideways at the bottom of a hole.
    const std::size_t last = text.rfind("Z-");
    const std::size_t line_end = text.find('\n', last);
    codes = told(text.substr(0, line_end + 1) + "G1 X0 F600\n" + text.substr(line_end + 1));
    EXPECT_TRUE(has(codes, "gouge.cutter")) << codes;
    // A rapid down.
    codes = told(replaced(text, "Z-5.5517 F600", "G0 Z-5.5517\nG1 F600"));
    EXPECT_TRUE(has(codes, "dowel.rapid") && has(codes, "rapid.through_stock")) << codes;
}

TEST(DowelPlans, ASpoiltPlanListOrSequenceIsTold) {
    const Built built(stl_bytes("pump", pump_cover()), with_dowels(2));
    ASSERT_TRUE(built.passed);
    const std::string plan_file = built.out + "/plan.json", list_file = built.out + "/dowels.csv",
                      sequence_file = built.out + "/sequence.json";
    const auto told = [&](const std::string& file, const std::string& text) {
        return " " + built.found(file, text) + " ";
    };
    const auto has = [&](const std::string& codes, const char* code) {
        return codes.find(fmt::format(" {} ", code)) != std::string::npos;
    };
    // A clearance that is not kept, a dowel that is thicker, one that goes through its slab.
    json plan = built.plan;
    plan["job"]["dowels"]["clearance"] = 60;
    EXPECT_TRUE(has(told(plan_file, plan.dump()), "dowel.wood"));
    plan = built.plan;
    plan["layers"][0]["dowels"][0]["diameter"] = 9;
    std::string codes = told(plan_file, plan.dump());
    EXPECT_TRUE(has(codes, "dowel.diameter") && has(codes, "dowel.list")) << codes;
    plan = built.plan;
    plan["layers"][0]["dowels"][1]["above"] = 30;
    EXPECT_TRUE(has(told(plan_file, plan.dump()), "dowel.wood"));
    plan = built.plan;
    plan["layers"][0].erase("dowels");
    codes = told(plan_file, plan.dump());
    EXPECT_TRUE(has(codes, "gouge.cutter") && has(codes, "gouge.stock") && has(codes, "sequence.dowels"))
        << codes;
    // Holes of one slab that meet.
    plan = built.plan;
    for (const char* key : {"x", "y"})
        plan["layers"][1]["dowels"][0][key] = plan["layers"][0]["dowels"][0][key];
    plan["layers"][0]["dowels"][0]["above"] = 12;
    const std::string as_planned = slurp(plan_file);
    spit(plan_file, plan.dump());
    Context context;
    bool meet = false;
    for (const Diagnostic& d : verify(context, built.out, built.stl, "", 1).violations)
        meet |= d.message.find("runs into one in the slab's underside") != std::string::npos;
    EXPECT_TRUE(meet);
    spit(plan_file, as_planned);
    // The list: not turned over, shorter, garbage.
    const std::string list = slurp(list_file);
    const std::size_t second = list.find('\n') + 1, third = list.find('\n', second) + 1;
    EXPECT_TRUE(has(told(list_file, list.substr(0, second) + list.substr(third)), "dowel.list"));
    const double x = built.plan["layers"][0]["dowels"][0]["x"],
                 left = built.plan["layers"][1]["blank"]["max"][0].get<double>() - x,
                 not_turned = x - built.plan["layers"][1]["blank"]["min"][0].get<double>();
    EXPECT_TRUE(
        has(told(list_file, replaced(list, fmt::format(",{:g},", left), fmt::format(",{:g},", not_turned))),
            "dowel.list"));
    EXPECT_TRUE(has(told(list_file, list + "2,1,x\n"), "dowel.list_unreadable"));
    EXPECT_TRUE(has(told(list_file, "nothing\n"), "dowel.list_unreadable"));
    std::filesystem::rename(list_file, list_file + ".kept");
    EXPECT_EQ(built.found(built.program(0), slurp(built.program(0))), "dowel.no_list");
    std::filesystem::rename(list_file + ".kept", list_file);
    // The sequence: a dowel too few, none at all, set before the glue.
    const std::string sequence = slurp(sequence_file);
    EXPECT_TRUE(
        has(told(sequence_file, replaced(sequence, "\"count\": 2", "\"count\": 1")), "sequence.dowels"));
    EXPECT_TRUE(
        has(told(sequence_file, replaced(sequence, "\"set_dowels\"", "\"clear\"")), "sequence.order"));
}

TEST(DowelPlans, AnEndMillBoresWhereNoDrillIs) {
    Job job = with_dowels(3, ToolKind::flat, 5);
    job.dowels.diameter = 7;
    job.dowels.clearance = 5;
    const Built built(stl_bytes("pump", pump_cover()), job);
    EXPECT_TRUE(built.passed);
    const std::string file = built.program(0), text = slurp(file);
    ASSERT_FALSE(text.empty());
    EXPECT_EQ(built.plan["layers"][0]["rounds"], 0);
    EXPECT_EQ(built.found(file, text), "");
    const support::CanonProgram canon = support::interpret_rs274(text, slurp(built.out + "/tool.tbl"));
    EXPECT_TRUE(canon.ended);
    // Wider by .2 mm all around: every way from the middle of the first hole 1.2 times as long.
    const json& dowels = built.plan["layers"][0]["dowels"];
    const auto wider = [&](const char* key) {
        return [&, key](double v) {
            double nearest = 1e9;
            for (const json& d : dowels)
                if (const double at = d[key]; std::abs(at - v) < std::abs(nearest - v)) nearest = at;
            return nearest + 1.2 * (v - nearest);
        };
    };
    const std::string codes =
        built.found(file, with_words(with_words(text, 'X', wider("x")), 'Y', wider("y")));
    EXPECT_NE(codes.find("dowel.diameter"), std::string::npos) << codes;
    EXPECT_NE(codes.find("gouge.cutter"), std::string::npos) << codes;
}

TEST(DowelPlans, WithoutDowelsAPlanIsWhatItWas) {
    Job job = with_dowels(0);
    const Built plain(stl_bytes("pump", pump_cover()), job);
    job.dowels.depth = 9;
    job.dowels.clearance = 33;
    const Built other(stl_bytes("pump", pump_cover()), job);
    for (const char* name : {"plan.json", "sequence.json", "cut_list.csv", "cut_list.dxf"})
        EXPECT_EQ(slurp(plain.out + "/" + name), slurp(other.out + "/" + name)) << name;
    EXPECT_FALSE(std::filesystem::exists(plain.out + "/dowels.csv"));
    EXPECT_EQ(slurp(plain.out + "/plan.json").find("dowel\""), std::string::npos);
    EXPECT_EQ(slurp(plain.out + "/plan.json").find("\"dowels"), std::string::npos);
    EXPECT_EQ(slurp(plain.out + "/cut_list.dxf").find("DOWELS"), std::string::npos);
}

TEST(DowelPlans, GlueLeavesTheHolesOut) {
    Job job = with_dowels(2);
    job.machine.glue_head = GlueHead::stack;
    job.bonding.edge_setback = 2;
    const Built built(stl_bytes("pump", pump_cover()), job);
    EXPECT_TRUE(built.passed);
    const json sequence = json::parse(slurp(built.out + "/sequence.json"));
    const json& dowels = built.plan["layers"][0]["dowels"];
    int beads = 0;
    for (const json& glue : sequence["glue"]) {
        if (glue["layer"] != 2) continue;
        for (const json& bead : glue["beads"]) {
            ++beads;
            for (const json& d : dowels) {
                const double y = bead[0].get<double>() - d["y"].get<double>();
                const auto [low, high] = std::minmax({bead[1].get<double>(), bead[2].get<double>()});
                const double x = std::clamp(d["x"].get<double>(), low, high) - d["x"].get<double>();
                EXPECT_GT(std::hypot(x, y), 4.4);
            }
        }
    }
    EXPECT_GT(beads, 10);
}

TEST(DowelPlans, CastingsAreProvenWithDowels) {
    const char* corpus = std::getenv("SLABWRIGHT_CORPUS");
    if (corpus == nullptr) GTEST_SKIP() << "SLABWRIGHT_CORPUS is not set";
    for (const char* name : {"bearing_block", "casting_cover"}) {
        Job job = with_dowels(2);
        job.dowels.clearance = 5;
        const Built built(slurp(fmt::format("{}/castings/{}.stl", corpus, name)), job, true);
        EXPECT_TRUE(built.passed) << name;
        std::size_t dowels = 0;
        for (const json& layer : built.plan["layers"])
            if (layer.contains("dowels")) dowels += layer["dowels"].size();
        EXPECT_GE(dowels, 4u) << name;
        EXPECT_TRUE(json::parse(slurp(built.out + "/verify.json"))["violations"].empty()) << name;
    }
}

}  // namespace
}  // namespace slabwright
