// Plans of slabs that are milled on both sides: what they make, proven from the text, and what is told where
// an underside, its place or its turning is not as planned.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "engine/undersides/floors.h"
#include "engine/undersides/loose_pieces.h"
#include "engine/undersides/underside_target.h"
#include "io/quote.h"
#include "io/resume.h"
#include "io/slabwright.h"
#include "io/write/stl_writer.h"
#include "kernels/features/unmade_air.h"
#include "kernels/mesh/weld.h"
#include "kernels/slicing/slicing.h"
#include "tests/support/command.h"
#include "tests/support/files.h"
#include "tests/support/places.h"
#include "tests/support/schema.h"
#include "tests/support/seed.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/tunnels.h"

namespace slabwright {
namespace {

using nlohmann::json;
using support::slurp;
using support::spit;
using support::TemporaryFolder;

ResumeOptions finished(int step, std::optional<int> remake = std::nullopt) {
    ResumeOptions options;
    options.after = step;
    options.remake = remake;
    options.now_s = 1'795'617'730;
    return options;
}

/// The default job with slabs milled on both sides, and a drill for dowels of 8 mm.
Job two_sided() {
    Job job;
    job.layers.sides = SlabSides::two;
    job.dowels.per_joint = 2;
    Tool drill = job.tools[1];
    drill.number = 11;
    drill.kind = ToolKind::drill;
    drill.name = "drill 8 mm";
    drill.diameter = drill.shank_diameter = 8;
    drill.flute_length = 45;
    drill.stickout = 60;
    drill.plunge_feed = 600;
    drill.plunges = true;
    job.tools.push_back(drill);
    return job;
}

/// Planned and written once, for all tests to spoil and put back.
class TwoSided : public testing::Test {
protected:
    static void SetUpTestSuite() {
        built_ = new Built;
        Context context;
        // A block with a tunnel of radius 15 along y.
        write_stl(built_->stl,
                  weld(context, support::block_with_tunnels({0, 0, 0}, {100, 70, 36}, {{50, 18, 15}})));
        const Job job = two_sided();
        const std::shared_ptr<Pattern> pattern = read_pattern(context, built_->stl, job);
        Plan made = plan(context, *pattern, job);
        built_->result = write_proven(context, made, built_->out, pattern, true);
        built_->plan = json::parse(slurp(built_->out + "/plan.json"));
        for (const json& layer : built_->plan["layers"])
            if (layer.contains("underside"))
                built_->undersides.push_back(built_->out + "/" +
                                             layer["underside"]["folder"].get<std::string>());
    }
    static void TearDownTestSuite() {
        delete built_;
        built_ = nullptr;
    }

    /// What is found when a file holds another text for once.
    static std::set<std::string> found(const std::string& file, const std::string& text) {
        const std::string was = slurp(file);
        spit(file, text);
        Context context;
        std::set<std::string> codes;
        for (const Diagnostic& d : verify(context, built_->out, built_->stl, "", 1).violations)
            codes.insert(d.code);
        spit(file, was);
        return codes;
    }
    /// The program of an underside with this purpose or kind.
    static std::string program(const std::string& underside, const std::string& key,
                               const std::string& value) {
        const json under = json::parse(slurp(underside + "/plan.json"));
        for (const json& op : under["layers"][0]["operations"])
            if (op[key] == value) return underside + "/" + op["file"].get<std::string>();
        return "";
    }

    struct Built {
        TemporaryFolder folder;
        std::string out = folder / "out", stl = folder / "tunnel.stl";
        VerifyResult result;
        json plan;
        std::vector<std::string> undersides;
    };
    static Built* built_;
};

TwoSided::Built* TwoSided::built_ = nullptr;

TEST_F(TwoSided, ATunnelIsMadeWholeAndProvenFromTheText) {
    for (const Diagnostic& d : built_->result.violations) ADD_FAILURE() << d.code << ": " << d.message;
    EXPECT_TRUE(built_->result.passed);
    EXPECT_EQ(built_->undersides.size(), 1U);
    EXPECT_LT(built_->result.unmade_mm3, 1);
    const json verified = json::parse(slurp(built_->out + "/verify.json"));
    ASSERT_EQ(verified["undersides"].size(), 1U);
    EXPECT_GT(verified["undersides"][0]["removed_mm3"].get<double>(), 0.45 * 3.1416 * 225 * 70);
}

TEST_F(TwoSided, DocumentsKeepToTheirSchemas) {
    for (std::string folder : {built_->out, built_->undersides.at(0)}) {
        for (const std::string name : {"plan", "sequence"})
            EXPECT_EQ(support::schema_complaint(slurp(folder + "/" + name + ".json"),
                                                support::checkout("io/") + name + ".schema.json"),
                      "");
    }
}

TEST_F(TwoSided, AnUndersideCutTooDeepIsAGouge) {
    const std::string file = program(built_->undersides.at(0), "kind", "rough");
    ASSERT_NE(file, "");
    // Every height of the program half a millimetre lower.
    std::string text;
    std::istringstream lines(slurp(file));
    for (std::string line; std::getline(lines, line);) {
        if (const std::size_t z = line.find('Z'); z != std::string::npos && line.front() != '(') {
            std::size_t used = 0;
            const double height = std::stod(line.substr(z + 1), &used);
            line = line.substr(0, z + 1) + fmt::format("{:.4f}", height - 0.5) + line.substr(z + 1 + used);
        }
        text += line + '\n';
    }
    const std::set<std::string> codes = found(file, text);
    EXPECT_TRUE(codes.contains("gouge.cutter")) << fmt::format("{}", fmt::join(codes, " "));
}

TEST_F(TwoSided, AnUndersideThatIsNotMilledIsFound) {
    const std::string file = program(built_->undersides.at(0), "purpose", "level contours");
    ASSERT_NE(file, "");
    std::filesystem::rename(file, file + ".away");
    Context context;
    std::set<std::string> codes;
    for (const Diagnostic& d : verify(context, built_->out, built_->stl, "", 1).violations)
        codes.insert(d.code);
    std::filesystem::rename(file + ".away", file);
    EXPECT_TRUE(codes.contains("program.missing"));
    EXPECT_TRUE(codes.contains("left.missed") || codes.contains("left.too_much"));
}

TEST_F(TwoSided, ASlabThatIsNotTurnedIsFound) {
    const std::string file = built_->out + "/sequence.json";
    for (const char* action : {"turn_over", "mill_underside"}) {
        json sequence = json::parse(slurp(file));
        json& steps = sequence["steps"];
        const auto step =
            std::find_if(steps.begin(), steps.end(), [&](const json& s) { return s["action"] == action; });
        ASSERT_NE(step, steps.end());
        // Those that wait for it wait for what it waits for.
        const json id = (*step)["id"], before = (*step)["needs"];
        steps.erase(step);
        for (json& s : steps) {
            json needs = json::array();
            for (const json& need : s["needs"])
                if (need != id) needs.push_back(need);
                else needs.insert(needs.end(), before.begin(), before.end());
            s["needs"] = needs;
        }
        const std::set<std::string> codes = found(file, sequence.dump());
        EXPECT_TRUE(codes.contains("sequence.order")) << action;
    }
}

TEST_F(TwoSided, ADowelMirroredTheWrongWayIsFound) {
    // Turned about x in place of y: in the plan of the underside, and in the program that drills it.
    const std::string file = built_->undersides.at(0) + "/plan.json";
    json under = json::parse(slurp(file));
    json& dowels = under["layers"][0]["dowels"];
    ASSERT_GE(dowels.size(), 2U);
    const double width = under["stock"]["max"][1];
    for (json& d : dowels) d["y"] = width - d["y"].get<double>();
    EXPECT_TRUE(found(file, under.dump()).contains("dowel.underside"));
    const std::string holes = program(built_->undersides.at(0), "purpose", "dowel holes");
    ASSERT_NE(holes, "");
    std::string text;
    std::istringstream lines(slurp(holes));
    for (std::string line; std::getline(lines, line);) {
        if (const std::size_t y = line.find('Y'); y != std::string::npos && line.front() != '(') {
            std::size_t used = 0;
            const double at = std::stod(line.substr(y + 1), &used);
            line = line.substr(0, y + 1) + fmt::format("{:.4f}", width - at) + line.substr(y + 1 + used);
        }
        text += line + '\n';
    }
    const std::set<std::string> codes = found(holes, text);
    EXPECT_TRUE(codes.contains("dowel.missing") || codes.contains("dowel.place"))
        << fmt::format("{}", fmt::join(codes, " "));
}

TEST_F(TwoSided, AnUndersideOfAnotherSlabIsFound) {
    const std::string file = built_->undersides.at(0) + "/plan.json";
    const std::string whole = slurp(file);
    json under = json::parse(whole);
    under["turned"]["z_bottom"] = under["turned"]["z_bottom"].get<double>() + 0.5;
    EXPECT_TRUE(found(file, under.dump()).contains("underside.slab"));
    under = json::parse(whole), under["turned"]["web"] = 1000;
    EXPECT_TRUE(found(file, under.dump()).contains("underside.slab"));
    under.erase("turned");
    EXPECT_THROW((void)found(file, under.dump()), Error);
    spit(file, whole);
}

TEST_F(TwoSided, WhatDoesNotGoWithItIsRefused) {
    Context context;
    const auto refused = [&](const std::function<void(Job&)>& change) {
        Job job = two_sided();
        change(job);
        try {
            (void)plan(context, built_->stl, job);
        } catch (const Error& error) {
            return error.code() + (error.remedy().empty() ? " without remedy" : "");
        }
        return std::string("planned");
    };
    EXPECT_EQ(refused([](Job& job) { job.dowels.per_joint = 0; }), "job.range");
    EXPECT_EQ(refused([](Job& job) {
                  job.flask.enabled = true;
                  job.flask.gap = 30;
              }),
              "layers.sides");
    EXPECT_EQ(refused([](Job& job) { job.layers.strategy = LayerStrategy::combined; }), "layers.sides");
    EXPECT_EQ(refused([](Job& job) { job.layers.sides = SlabSides::one; }), "undercut.unmade");
}

TEST_F(TwoSided, ABuildKilledAfterAnyStepGoesOnFromDisk) {
    Context context;
    const auto steps_of = [](const std::string& folder) {
        return json::parse(slurp(folder + "/sequence.json"))["steps"];
    };
    for (const std::string& folder : {built_->out, built_->undersides.at(0)}) {
        const json steps = steps_of(folder);
        for (std::size_t after = 0; after <= steps.size(); ++after) {
            (void)resume_build(context, folder, finished(static_cast<int>(after)));
            if (after == 1) {  // when the slab is milled from below and not turned yet
                EXPECT_EQ(support::schema_complaint(slurp(folder + "/progress.json"),
                                                    support::checkout("io/progress.schema.json")),
                          "");
            }
            // What is on disk is what the steps bring about.
            const ResumeStatus status = resume_build(context, folder, {});
            EXPECT_EQ(status.after, static_cast<int>(after));
            EXPECT_NE(resume_text(status, folder).find("check"), std::string::npos);
        }
        std::filesystem::remove(folder + "/progress.json");
    }
    // A state that says otherwise is refused.
    (void)resume_build(context, built_->out, finished(2));
    const std::string file = built_->out + "/progress.json";
    json progress = json::parse(slurp(file));
    ASSERT_EQ(progress["state"]["undersides"].size(), 1U) << progress["state"].dump();
    const auto refused = [&](const json& undersides) {
        progress["state"]["undersides"] = undersides;
        spit(file, progress.dump());
        try {
            (void)resume_build(context, built_->out, {});
        } catch (const Error& error) {
            return error.code();
        }
        return std::string();
    };
    json not_turned = progress["state"]["undersides"];
    for (json& of : not_turned) of = json::array({1, 0});
    EXPECT_EQ(refused(not_turned), "resume.state");
    EXPECT_EQ(refused(json::object()), "resume.progress");
    std::filesystem::remove(file);
}

TEST_F(TwoSided, ALayerIsMadeAgainWhereItsSlabNeedsNoUnderside) {
    Context context;
    const json steps = json::parse(slurp(built_->out + "/sequence.json"))["steps"];
    const auto last_of = [&](const char* action, int layer) {
        int id = 0;
        for (const json& step : steps)
            if (step["action"] == action && step["layer"] == layer) id = step["id"];
        return id;
    };
    const int turned = built_->plan["layers"].size() == 2 ? 2 : 0;
    ASSERT_EQ(turned, 2) << "the tunnel's upper half is milled from below";
    const std::string progress = built_->out + "/progress.json", remade = built_->out + "/resume_001";
    const ResumeStatus again = resume_build(context, built_->out, finished(last_of("mill", 1), 1));
    int slabs = 0;
    for (std::size_t i = static_cast<std::size_t>(again.after); i < again.steps.size(); ++i) {
        EXPECT_NE(again.steps[i].action, "mill_underside");
        EXPECT_NE(again.steps[i].action, "turn_over");
        slabs += again.steps[i].action == "place";
    }
    EXPECT_EQ(slabs, 2);
    std::filesystem::remove_all(remade);
    std::filesystem::remove(progress);
    const auto refused = [&](const std::string& folder, int after, int layer) -> std::string {
        try {
            (void)resume_build(context, folder, finished(after, layer));
        } catch (const Error& error) {
            EXPECT_NE(error.remedy(), "");
            return error.code();
        }
        return "made";
    };
    EXPECT_EQ(refused(built_->out, last_of("mill", 2), 2), "resume.underside");
    EXPECT_EQ(refused(built_->out, last_of("mill", 2), 1), "resume.underside");
    EXPECT_EQ(refused(built_->undersides.at(0), 1, 2), "resume.turned");
    EXPECT_FALSE(std::filesystem::exists(progress)) << "what is refused writes nothing";
}

TEST_F(TwoSided, AQuoteSaysWhatThePlanSays) {
    Context context;
    const QuotedModel quoted = quote_model(context, built_->stl, two_sided());
    const Quote& q = quoted.quote;
    const json& totals = built_->plan["totals"];
    EXPECT_EQ(q.outcome.layers, static_cast<int>(built_->plan["layers"].size()));
    EXPECT_EQ(q.undersides, 1);
    EXPECT_LT(q.outcome.unmade_mm3, 1);
    const double minutes = totals["build_minutes"], below = totals["underside_minutes"];
    // A quote's factors are fitted to castings; of a tunnel, all whose slopes pass 45°, it asks for too much.
    EXPECT_NEAR(q.build_minutes, minutes, 0.5 * minutes);
    EXPECT_NEAR(q.underside_minutes, below, 0.5 * below);
    EXPECT_NEAR(q.build_minutes,
                q.cutting_minutes + q.bonding_minutes + q.tool_change_minutes + q.underside_minutes, 1e-9);
    EXPECT_NE(quote_text(quoted).find("1 of the slabs is milled from below first"), std::string::npos)
        << quote_text(quoted);
    EXPECT_NE(quote_json(quoted).find("\"undersides\": 1"), std::string::npos) << quote_json(quoted);
}

TEST_F(TwoSided, CommandsSayWhatTheyCannotDo) {
    const auto told = [&](std::vector<std::string> arguments) {
        arguments.insert(arguments.begin(), support::built_command());
        return support::run_command(arguments);
    };
    // The option brings two dowels a joint with it: of 10 mm, since those of 8 are too narrow for the shop's
    // tools, unless the job wants those.
    const std::string out = built_->folder / "other", wanted = built_->folder / "eight.toml";
    const support::CommandResult other = told({"plan", built_->stl, "--sides", "two", "-o", out});
    EXPECT_EQ(other.exit, 0) << other.err;
    const json plan = json::parse(slurp(out + "/plan.json"));
    EXPECT_EQ(plan["job"]["dowels"]["diameter"], 10) << plan["job"]["dowels"];
    spit(wanted, "[dowels]\nper_joint = 2\ndiameter = 8.0\n");
    const support::CommandResult eight =
        told({"plan", built_->stl, "--sides", "two", "--job", wanted, "-o", built_->folder / "eight"});
    EXPECT_EQ(eight.exit, 2) << eight.err;
    EXPECT_NE(eight.err.find("or take dowels.diameter = 10, whose holes T5 makes"), std::string::npos)
        << eight.err;
    const support::CommandResult quoted = told({"quote", built_->stl, "--sides", "two"});
    EXPECT_EQ(quoted.exit, 0) << quoted.err;
    EXPECT_NE(quoted.out.find("1 of the slabs is milled from below first"), std::string::npos) << quoted.out;
    const support::CommandResult alone = told({"verify", built_->undersides.at(0)});
    EXPECT_NE(alone.exit, 0);
    EXPECT_NE(alone.err.find("underside"), std::string::npos) << alone.err;
}

TEST_F(TwoSided, AFolderWithUndersidesIsReplacedAsAPlanAndKeptWithAStranger) {
    EXPECT_NO_THROW(require_replaceable(built_->out));
    const std::string note = built_->undersides.at(0) + "/note.txt";
    spit(note, "mine");
    EXPECT_THROW(require_replaceable(built_->out), Error);
    std::filesystem::remove(note);
    EXPECT_NO_THROW(require_replaceable(built_->out));
}

TEST_F(TwoSided, AutomaticMillsFromBelowOnlyWhereThatMakesMore) {
    Context context;
    Job job = two_sided();
    job.layers.sides = SlabSides::automatic;
    EXPECT_EQ(plan(context, built_->stl, job).undersides.size(), 1U);
    const std::string block = built_->folder / "block.stl";
    write_stl(block, weld(context, shapes::box({0, 0, 0}, {100, 70, 36})));
    EXPECT_TRUE(plan(context, block, job).undersides.empty());
}

/// A small block with a tunnel of radius 10 along y, planned and written by a job.
struct SmallBuild {
    explicit SmallBuild(const Job& job) {
        Context context;
        write_stl(stl, weld(context, support::block_with_tunnels({0, 0, 0}, {60, 40, 30}, {{30, 15, 10}})));
        const std::shared_ptr<Pattern> pattern = read_pattern(context, stl, job);
        Plan made = plan(context, *pattern, job);
        result = write_proven(context, made, out, pattern, true);
        for (const Plan& under : made.undersides)
            undersides.push_back(out + "/" + underside_folder(under.turned->layer));
    }
    [[nodiscard]] std::set<std::string> codes() const {
        Context context;
        std::set<std::string> found;
        for (const Diagnostic& d : verify(context, out, stl, "", 1).violations) found.insert(d.code);
        return found;
    }
    TemporaryFolder folder;
    std::string stl = folder / "tunnel.stl", out = folder / "out";
    VerifyResult result;
    std::vector<std::string> undersides;
};

// A clamp on the slabs' left front corner, a fence on the board before them, and a pad beside them on which z
// 0 is found: of the undersides too, whose slabs lie with that corner where the board has its own.
TEST(TwoSidedTable, KeepOutsAndProbingHoldForUndersides) {
    Job job = two_sided();
    job.machine.table = BuildTable::fixed;
    job.machine.travel_z = 400;
    job.machine.probe = ProbeMode::cycle;
    job.probing.reference = {-40, 20, 30};
    job.machine.zero = WorkZero::model;
    const double margin = job.slabs.margin;
    KeepOut fence;
    fence.name = "fence";
    fence.rectangle = {-margin, -margin - 80, 60 + margin, -margin - 70};
    fence.height = 60;
    fence.clearance = 2;
    job.machine.keep_outs = {fence};
    const SmallBuild built(job);
    for (const Diagnostic& d : built.result.violations) ADD_FAILURE() << d.code << ": " << d.message;
    ASSERT_EQ(built.undersides.size(), 1U);
    const json under = json::parse(slurp(built.undersides[0] + "/plan.json"));
    EXPECT_EQ(under["probes"].size(), 1U);
    // Were it in the middle, programs of both sides would run into it.
    std::vector<KeepOut> other{fence};
    other[0].rectangle = {28, 18, 34, 24};
    std::set<std::string> files;
    Context context;
    for (const Diagnostic& d : verify(context, built.out, built.stl, "", 1, &other).violations)
        if (d.code == "keep_out.cut") files.insert(d.message.substr(0, d.message.find('/')));
    EXPECT_TRUE(files.contains("undersides")) << fmt::format("{}", fmt::join(files, " "));
    // The slab of an underside lies with its left front corner where the board has its own: what is there is
    // entered.
    job.machine.keep_outs[0].rectangle = {-margin, -margin - 30, -margin + 5, -margin + 5};
    try {
        (void)plan(context, built.stl, job);
        ADD_FAILURE() << "planned";
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), "keep_out.entered");
    }
}

TEST(TwoSidedTable, AControlHoldsAllProgramsByTheirNumbers) {
    Job job = two_sided();
    job.machine.post = Post::fanuc;
    const SmallBuild built(job);
    for (const Diagnostic& d : built.result.violations) ADD_FAILURE() << d.code << ": " << d.message;
    ASSERT_EQ(built.undersides.size(), 1U);
    const json under = json::parse(slurp(built.undersides[0] + "/plan.json"));
    const std::string file =
        built.undersides[0] + "/" + under["layers"][0]["operations"][0]["file"].get<std::string>();
    std::string text = slurp(file);
    const std::size_t number = text.find("\nO");
    ASSERT_NE(number, std::string::npos);
    EXPECT_EQ(text.substr(number + 1, 5), fmt::format("O{:02}51", under["layers"][0]["index"].get<int>()));
    text.replace(number + 4, 2, "01");
    spit(file, text);
    EXPECT_TRUE(built.codes().contains("program.number"));
}

/// A slab of 19 mm in a block of 60 x 40 x 18 mm, with 10 mm around it.
TurnedSlab slab_of_block() { return {1, 0, 18, 19, {{-10, -10}, {70, 50}}, 0, 10}; }

TEST(UndersideTarget, IsThePatternTurnedInItsTray) {
    Context context;
    // A plate on a foot: what lies beside the foot, under the plate, is milled from below.
    shapes::Facets facets = shapes::box({20, 10, 0}, {40, 30, 10});
    shapes::append(facets, shapes::box({0, 0, 8}, {60, 40, 18}));
    const Mesh pattern = weld(context, facets);
    TurnedSlab slab = slab_of_block();
    const Mesh target = underside_target(context, pattern.view(), slab);
    const std::vector<Plane> planes{{5, Side::above}, {18, Side::above}, {0.5, Side::above}};
    const std::vector<Section> sections = slice(context, target.view(), planes);
    const auto is_solid = [&](std::size_t k, double x, double y) {
        return winding(sections[k].loops, {to_units(x), to_units(y)}) != 0;
    };
    EXPECT_TRUE(is_solid(0, 40, 30));   // the plate, which lies at z' 1 to 11
    EXPECT_TRUE(is_solid(1, 40, 30));   // the foot
    EXPECT_FALSE(is_solid(1, 15, 30));  // beside it
    EXPECT_TRUE(is_solid(1, 1, 1));     // the rim
    EXPECT_TRUE(is_solid(2, 5, 5));     // the film
    EXPECT_TRUE(hangs_together(context, target, slab) ||
                area(underside_region(context, pattern.view(), slab)) > 70.0 * 50);
}

TEST(UndersideTarget, WhatComesLooseIsHeldByStrips) {
    Context context;
    // A mushroom upside down: its cap is an island in what is milled around it.
    shapes::Facets facets = shapes::box({25, 15, 0}, {35, 25, 10});
    shapes::append(facets, shapes::box({15, 5, 8}, {45, 35, 18}));
    const Mesh pattern = weld(context, facets);
    TurnedSlab slab = slab_of_block();
    slab.blank = {{-30, -30}, {90, 70}};
    EXPECT_FALSE(hangs_together(context, underside_target(context, pattern.view(), slab), slab));
    slab.web = kStripWeb;
    EXPECT_TRUE(has_strips(slab));
    EXPECT_TRUE(hangs_together(context, underside_target(context, pattern.view(), slab), slab));
    slab.web = kWholeWeb;
    EXPECT_FALSE(has_strips(slab));
}

// Two pieces of successive sections hold together where 20 mm² of them lie on each other.
TEST(UndersideTarget, PiecesHoldByTwentySquareMillimetres) {
    Context context;
    const TurnedSlab slab = slab_of_block();
    const auto hold = [&](float mm2) {
        // A plate whose corner lies on that of the rim below it, 5 mm wide there.
        shapes::Facets facets = shapes::box({0, 0, 0}, {50, 50, 10});
        shapes::append(facets, shapes::box({50 - mm2 / 5, 45, 10}, {90, 90, 20}));
        return hangs_together(context, weld(context, facets), slab);
    };
    EXPECT_TRUE(hold(20.5F));
    EXPECT_FALSE(hold(19.5F));
}

TEST(UndersideTarget, WhatLiesInItsWebStaysUnmade) {
    Context context;
    // Under a roof that is 1 mm thick: of 17 mm of air 2 lie in the web.
    shapes::Facets facets = shapes::box({0, 0, 0}, {20, 40, 18});
    shapes::append(facets, shapes::box({10, 0, 17}, {60, 40, 18}));
    const AirGaps gaps = air_gaps(context, weld(context, facets).view(), 0.5);
    const auto left = [&](const MilledLayer& layer) {
        return unmade_air(context, gaps, {{layer}}).volume_mm3;
    };
    const double mm2 = 40 * 40;
    EXPECT_NEAR(left({18, MilledFrom::above}), 17 * mm2, 0.03 * 17 * mm2);
    EXPECT_NEAR(left({18, MilledFrom::both_sides}), 0, 1);
    EXPECT_NEAR(left({18, MilledFrom::both_sides, 3}), 2 * mm2, 0.05 * 2 * mm2);
    const MilledLayer strips{18, MilledFrom::both_sides, 3, 20, 5, 0, 0};
    EXPECT_NEAR(left(strips), 2 * mm2 / 4, 0.15 * 2 * mm2 / 4);
}

/// The floor of a layer over what is milled from below.
std::optional<LoadedFloor> floor_of(const shapes::Facets& facets, const MilledLayer& layer, double bottom,
                                    const FloorLoads& loads, double cell = 0.5) {
    Context context;
    const Mesh pattern = weld(context, facets);
    const AirGaps gaps = air_gaps(context, pattern.view(), cell);
    return FloorMap(context, pattern.view(), gaps).weakest(context, layer, bottom, loads);
}

// Roofs of any thickness over air between two walls, or beyond one: how thick they are, how far they reach
// and what they bear is as the plate says.
TEST(UndersideFloors, BearWhatPlatesBear) {
    const unsigned seed = test::seed();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const auto between = [&](double low, double high) {
        return low + (high - low) * static_cast<double>(random()) / static_cast<double>(std::mt19937::max());
    };
    for (int round = 0; round < 12; ++round) {
        SCOPED_TRACE(round);
        const bool bridge = round % 2 == 0, goes_on = round % 3 == 0;
        const double t = between(0.6, 3), span = between(8 * t, 40), wide = 100 + span;
        const auto box = [](double x0, double x1, double z0, double z1) {
            return shapes::box({static_cast<float>(x0), 0, static_cast<float>(z0)},
                               {static_cast<float>(x1), static_cast<float>(90), static_cast<float>(z1)});
        };
        shapes::Facets facets = box(0, 50, 0, 18);
        if (bridge) shapes::append(facets, box(50 + span, wide, 0, 18));
        shapes::append(facets, box(20, bridge ? wide - 20 : 50 + span, 18 - t, 18));
        if (goes_on) shapes::append(facets, box(20, bridge ? wide - 20 : 50 + span, 17.9, 30));
        const MilledLayer layer{18, MilledFrom::both_sides, 0};
        const FloorLoads loads{between(5, 60), between(0, 0.5)};
        const auto floor = floor_of(facets, layer, 0, loads);
        ASSERT_TRUE(floor);
        const double reach = bridge ? span / 2 : span;
        EXPECT_NEAR(floor->thickness_mm, t, 1e-3);
        EXPECT_NEAR(floor->at[2], 18 - t, 1e-3);
        EXPECT_NEAR(floor->push_mpa, 6 * 0.51 * loads.push_n / (t * t), 0.01 * floor->push_mpa);
        if (goes_on && floor->press_mpa > floor->push_mpa) {
            const double a = floor->reach_mm / t;
            EXPECT_NEAR(floor->reach_mm, reach, 2);
            // At its open ends a bridge is held from both sides all the same, but air is nearer there.
            EXPECT_GE(floor->press_mpa, 1.99 * loads.pressure_mpa * a * a);
            EXPECT_LE(floor->press_mpa, 3.01 * loads.pressure_mpa * a * a);
            if (!bridge) {
                EXPECT_NEAR(floor->press_mpa, 3 * loads.pressure_mpa * a * a, 0.01 * floor->press_mpa);
            }
        }
        if (!goes_on) {
            EXPECT_EQ(floor->press_mpa, 0) << "no slab is glued onto it";
        }
        const Diagnostic told = weak_floor(3, *floor, loads, 27);
        EXPECT_EQ(told.code, "floor.weak");
        EXPECT_EQ(told.where, floor->at);
        EXPECT_NE(told.message.find(fmt::format("layer 3: a floor {:.1f} mm thick", t)), std::string::npos);
    }
    // A short one is part of what carries it, and a solid block has none.
    shapes::Facets lip = shapes::box({0, 0, 0}, {50, 90, 18});
    shapes::append(lip, shapes::box({40, 0, 14}, {58, 90, 18}));
    const MilledLayer layer{18, MilledFrom::both_sides, 0};
    EXPECT_FALSE(floor_of(lip, layer, 0, {10, 0.5}));
    EXPECT_FALSE(floor_of(shapes::box({0, 0, 0}, {50, 90, 18}), layer, 0, {10, 0.5}));
}

// A roof that reaches out to any of the four sides bears the same, as far out and over as many lines.
TEST(UndersideFloors, BearTheSameWhicheverWayTheyReach) {
    std::mt19937 random(test::seed());
    for (int round = 0; round < 12; ++round) {
        // In whole lines of the grid, so that they lie alike over each.
        const auto wide = static_cast<float>(30 + random() % 12) / 2,
                   foot = static_cast<float>(10 + random() % 12) / 2,
                   reach = static_cast<float>(24 + random() % 40) / 2;
        const float t = 1 + static_cast<float>(random() % 8) / 8;
        std::optional<LoadedFloor> first;
        for (int turns = 0; turns < 4; ++turns) {
            shapes::Facets facets = shapes::box({0, 0, 0}, {foot, wide, 18});
            shapes::append(facets, shapes::box({0, 0, 18 - t}, {foot + reach, wide, 30}));
            for (auto& facet : facets)
                for (Vec3f& v : facet)
                    for (int k = 0; k < turns; ++k) v = {-v.y, v.x, v.z};
            const auto floor = floor_of(facets, {18, MilledFrom::both_sides, 0}, 0, {20, 0.3});
            ASSERT_TRUE(floor) << round;
            if (!first) first = floor;
            EXPECT_NEAR(floor->reach_mm, reach, 2) << round << ", turned " << turns;
            EXPECT_DOUBLE_EQ(floor->reach_mm, first->reach_mm) << round << ", turned " << turns;
            EXPECT_NEAR(floor->press_mpa, first->press_mpa, 1e-3 * first->press_mpa) << round;
            EXPECT_NEAR(floor->push_mpa, first->push_mpa, 1e-3 * first->push_mpa) << round;
        }
    }
}

}  // namespace
}  // namespace slabwright
