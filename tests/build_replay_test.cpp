// The sequence as a program: replayed from its text. Good ones pass in any order that their needs allow;
// every corruption is told as what it is.
#include "engine/simulate/build_replay.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <random>

#include "engine/schedule/schedule.h"
#include "engine/simulate/sequence_findings.h"
#include "io/read/sequence_reader.h"
#include "io/slabwright.h"
#include "io/write/sequence_json.h"
#include "kernels/errors.h"
#include "tests/support/block_build.h"
#include "tests/support/files.h"
#include "tests/support/places.h"
#include "tests/support/seed.h"
#include "tests/support/shuffled_steps.h"
#include "tests/support/temporary_folder.h"

using namespace slabwright;
using nlohmann::json;
using support::block;
using support::random_job;
using support::random_shape;
using support::shuffled;
using support::stated;

namespace {

std::vector<Violation> found_in(const BuildPlan& build, const json& sequence) {
    return replay_build(build, read_sequence(sequence.dump()));
}

/// The codes, each once, in the order of their first violation.
std::string codes_of(const std::vector<Violation>& found) {
    std::string codes;
    for (const Violation& v : found)
        if ((" " + codes + " ").find(" " + v.code + " ") == std::string::npos)
            codes += (codes.empty() ? "" : " ") + v.code;
    return codes;
}

std::string first_message(const std::vector<Violation>& found) {
    return found.empty() ? "" : found.front().code + ": " + found.front().message;
}

/// The place of the n-th step of this action, from 0.
std::size_t place_of(const json& steps, const std::string& action, int n = 0) {
    for (std::size_t i = 0; i < steps.size(); ++i)
        if (steps[i]["action"] == action && n-- == 0) return i;
    ADD_FAILURE() << "no " << action;
    return 0;
}

/// Adds to a coordinate.
void move(json& bead, std::size_t k, double by) { bead[k] = bead[k].get<double>() + by; }

/// Whether every step comes after those that it needs.
bool keeps_needs(const json& steps) {
    std::map<int, bool> done;
    for (const json& step : steps) {
        for (const json& need : step["needs"])
            if (!done[need.get<int>()]) return false;
        done[step["id"].get<int>()] = true;
    }
    return true;
}

}  // namespace

TEST(BuildReplay, GoodSequencesPassInEveryOrderThatTheirNeedsAllow) {
    std::mt19937 random(test::seed());
    for (int round = 0; round < 300; ++round) {
        const Plan plan = block(random_job(random), random_shape(random));
        json sequence = json::parse(sequence_json(plan));
        const std::vector<Violation> found = found_in(stated(plan), sequence);
        ASSERT_EQ(codes_of(found), "") << round << ' ' << first_message(found);
        sequence["steps"] = shuffled(sequence["steps"], random);
        const std::vector<Violation> other = found_in(stated(plan), sequence);
        ASSERT_EQ(codes_of(other), "") << round << ' ' << first_message(other);
    }
}

TEST(BuildReplay, EachCorruptionIsToldAsWhatItIs) {
    Job job;
    job.machine.feed_height = 60;
    const Plan plan = block(job, {4, 2, true});
    const BuildPlan build = stated(plan);
    const json good = json::parse(sequence_json(plan));
    struct Case {
        const char* name;
        std::function<void(json& sequence, json& steps)> corrupt;
        const char* code;
    };
    const auto set = [](const char* action, int n, const char* key, json value) {
        return [=](json&, json& steps) { steps[place_of(steps, action, n)][key] = value; };
    };
    const auto drop = [](const char* action, int n) {
        return [=](json&, json& steps) { steps.erase(place_of(steps, action, n)); };
    };
    const auto exchange = [](const char* a, int n, const char* b, int m) {
        return [=](json&, json& steps) {
            std::swap(steps[place_of(steps, a, n)], steps[place_of(steps, b, m)]);
        };
    };
    const std::vector<Case> cases{
        {"clamp dropped", drop("clamp", 1), "sequence.needs"},
        {"press dropped", drop("press", 1), "sequence.order"},
        {"board dropped", drop("mount_board", 0), "sequence.order"},
        {"load dropped", drop("load_feed", 1), "sequence.feed"},
        {"slab dropped", drop("take_slab", 2), "sequence.order"},
        {"place dropped", drop("place", 3), "sequence.missing"},
        {"table dropped", drop("table", 2), "sequence.order"},
        {"touch-off dropped", drop("touch_off", 2), "sequence.order"},
        {"tool change dropped", drop("tool_change", 2), "sequence.tool"},
        {"program dropped", drop("mill", 4), "sequence.missing"},
        {"facing dropped", drop("face", 1), "sequence.missing"},
        {"unload dropped", drop("unload", 0), "sequence.missing"},
        {"box dropped", drop("mould_box", 0), "sequence.missing"},
        {"glue before the facing below", exchange("glue", 1, "face", 0), "sequence.order"},
        {"mill before press", exchange("press", 1, "mill", 3), "sequence.order"},
        {"table before press", exchange("press", 0, "table", 0), "sequence.order"},
        {"step doubled",
         [](json&, json& steps) {
             const auto at = static_cast<std::ptrdiff_t>(place_of(steps, "glue", 1));
             steps.insert(steps.begin() + at, json(steps[static_cast<std::size_t>(at)]));
         },
         "sequence.id"},
        {"glue doubled under a number of its own",
         [](json&, json& steps) {
             const std::size_t at = place_of(steps, "glue", 1);
             json again = steps[at];
             again["id"] = steps.size() + 1;
             again["needs"] = json::array({steps[at]["id"]});
             steps.insert(steps.begin() + static_cast<std::ptrdiff_t>(at) + 1, again);
         },
         "sequence.order"},
        {"program run again",
         [](json&, json& steps) {
             const std::size_t at = place_of(steps, "mill", 2);
             json again = steps[at];
             again["id"] = steps.size() + 1;
             again["needs"] = json::array({steps[at]["id"]});
             steps.insert(steps.begin() + static_cast<std::ptrdiff_t>(at) + 1, again);
         },
         "sequence.program"},
        {"table height", set("table", 1, "table_height_mm", -19), "sequence.table"},
        {"work offset", set("table", 1, "work_offset_z_mm", 5), "sequence.table"},
        {"touch-off at 5 mm", set("touch_off", 1, "slab_top_mm", 5), "sequence.touch_off"},
        {"other slab", set("take_slab", 1, "thickness_mm", 19), "sequence.slab"},
        {"short slab", set("take_slab", 1, "length_mm", 150), "sequence.slab"},
        {"other material", set("take_slab", 1, "material", "pine"), "sequence.slab"},
        {"slab's place", set("place", 1, "z_bottom_mm", 19), "sequence.place"},
        {"slab beside", set("place", 1, "x_mm", 0), "sequence.place"},
        {"glue's area", set("glue", 1, "area_mm2", 100), "sequence.glue"},
        {"glue of another layer", set("glue", 1, "polygons", "#/glue/0"), "sequence.glue"},
        {"no such glue", set("glue", 1, "polygons", "#/glue/99"), "sequence.glue"},
        {"glue beside the slab",
         [](json& sequence, json&) {
             for (json& point : sequence["glue"][1]["loops"][0]) point[0] = point[0].get<double>() + 150;
         },
         "sequence.glue"},
        {"glue on the stack, not under the slab", set("glue", 1, "side", "stack"), "sequence.glue_side"},
        {"other grams", set("glue", 1, "glue_g", 99), "sequence.glue_mass"},
        {"no grams", [](json&, json& steps) { steps[place_of(steps, "glue", 1)].erase("glue_g"); },
         "sequence.value"},
        {"pump too fast", set("glue", 1, "pump_g_min", 5000), "sequence.pump"},
        {"pump too slow", set("glue", 1, "pump_g_min", 1), "sequence.pump"},
        {"head too fast", set("glue", 1, "speed_mm_min", 6000), "sequence.pump"},
        {"length of beads", set("glue", 1, "bead_mm", 10), "sequence.glue_path"},
        {"a bead moved along", [](json& sequence, json&) { move(sequence["glue"][1]["beads"][3], 1, 30); },
         "sequence.glue_path"},
        {"a bead beyond the joint",
         [](json& sequence, json&) { move(sequence["glue"][1]["beads"][3], 1, 2); }, "sequence.glue_path"},
        {"a bead between two rows",
         [](json& sequence, json&) { move(sequence["glue"][1]["beads"][3], 0, 1); }, "sequence.glue_path"},
        {"a bead in a row beside the joint",
         [](json& sequence, json&) { sequence["glue"][1]["beads"][3][0] = 72.5; }, "sequence.glue_path"},
        {"a bead left out", [](json& sequence, json&) { sequence["glue"][1]["beads"].erase(3); },
         "sequence.glue_path"},
        {"a bead twice",
         [](json& sequence, json&) {
             json& beads = sequence["glue"][1]["beads"];
             beads.push_back(json(beads[3]));
         },
         "sequence.glue_path"},
        {"no beads", [](json& sequence, json&) { sequence["glue"][1].erase("beads"); }, "sequence.glue_path"},
        {"a slab of another stack", set("take_slab", 1, "stack", 1), "sequence.stack"},
        {"a pile in another order", set("load_feed", 0, "pile", "1 x 12, 1 x 19"), "sequence.stack"},
        {"handler elsewhere", set("take_slab", 1, "handler_mm", 100), "sequence.handler"},
        {"slab not over the table", set("place", 1, "handler_mm", 1500), "sequence.handler"},
        {"handler past its end", set("place", 1, "handler_mm", 2500), "sequence.travel"},
        {"handler before its beginning", set("glue", 1, "handler_mm", -20), "sequence.travel"},
        {"handler's time", set("place", 1, "seconds", 1), "sequence.time"},
        {"gluing a slab that is not clamped", exchange("glue", 1, "clamp", 1), "sequence.order"},
        {"fetching before the press", exchange("press", 0, "take_slab", 1), "sequence.order"},
        {"press too hard", set("press", 1, "force_n", 17000), "sequence.press"},
        {"press too short", set("press", 1, "time_s", 3), "sequence.press"},
        {"table not up to the press", set("press", 1, "lift_mm", 3), "sequence.press"},
        {"tool 99", set("mill", 1, "tool", 99), "sequence.tool"},
        {"tool 99 changed in", set("tool_change", 1, "tool", 99), "sequence.tool"},
        {"another program's tool", set("mill", 1, "tool", 2), "sequence.tool"},
        {"half a tool", set("mill", 1, "tool", 2.5), "sequence.value"},
        {"programs exchanged",
         [](json&, json& steps) {
             std::swap(steps[place_of(steps, "mill", 1)]["program"],
                       steps[place_of(steps, "mill", 4)]["program"]);
         },
         "sequence.program"},
        {"programs of one tool exchanged",
         [](json&, json& steps) {
             std::swap(steps[place_of(steps, "mill", 1)]["program"],
                       steps[place_of(steps, "mill", 2)]["program"]);
         },
         "sequence.program"},
        {"program of no plan", set("mill", 1, "program", "nc/other.ngc"), "sequence.program"},
        {"program's height", set("mill", 1, "z_low_mm", -100), "sequence.height"},
        {"milled as facing", set("mill", 1, "action", "face"), "sequence.program"},
        {"unknown action", set("mill", 1, "action", "drill"), "sequence.action"},
        {"needs what does not exist", set("mill", 1, "needs", json::array({999})), "sequence.needs"},
        {"needs itself", [](json&, json& steps) { steps[20]["needs"].push_back(steps[20]["id"]); },
         "sequence.needs"},
        {"needs nothing", set("glue", 1, "needs", json::array()), "sequence.needs"},
        {"handler not waited for",
         [](json&, json& steps) {
             json& take = steps[place_of(steps, "take_slab", 2)];
             take["needs"] = json::array({1});
         },
         "sequence.needs"},
        {"other layer", set("press", 1, "layer", 1), "sequence.layer"},
        {"other time", set("mill", 1, "seconds", 1), "sequence.time"},
        {"load on the table", set("place", 1, "table_load_kg", 900), "sequence.mass"},
        {"more slabs than lie there", set("load_feed", 0, "slabs", 9), "sequence.feed"},
        {"quantity missing",
         [](json&, json& steps) { steps[place_of(steps, "table", 0)].erase("table_height_mm"); },
         "sequence.value"},
        {"other pattern", [](json& sequence, json&) { sequence["sha256"] = std::string(64, 'c'); },
         "sequence.pattern"},
        {"other frame", [](json& sequence, json&) { sequence["frame"] = "pattern-base"; }, "sequence.frame"},
        {"endless",
         [](json&, json& steps) {
             for (int i = 0; i < 500; ++i) steps.push_back(steps.back());
         },
         "sequence.length"},
        {"empty", [](json&, json& steps) { steps = json::array(); }, "sequence.missing"},
    };
    for (const Case& c : cases) {
        json sequence = good;
        json steps = sequence["steps"];
        c.corrupt(sequence, steps);
        sequence["steps"] = steps;
        const std::vector<Violation> found = found_in(build, sequence);
        EXPECT_TRUE((" " + codes_of(found) + " ").find(std::string(" ") + c.code + " ") != std::string::npos)
            << c.name << ": " << codes_of(found) << " | " << first_message(found);
        EXPECT_LE(found.size(), kMostSequenceViolations);
        for (const Violation& v : found) EXPECT_EQ(v.file, "sequence.json");
    }
}

// What the machine could not do although the text is as planned.
TEST(BuildReplay, LimitsOfTheMachineAreItsOwn) {
    const Plan plan = block(Job{}, {5, 1, false});
    const json sequence = json::parse(sequence_json(plan));
    const auto codes = [&](const std::function<void(Machine&)>& change) {
        BuildPlan build = stated(plan);
        change(build.job.machine);
        return codes_of(found_in(build, sequence));
    };
    EXPECT_EQ(codes([](Machine&) {}), "");
    EXPECT_EQ(codes([](Machine& m) { m.travel_z = 40; }), "sequence.travel");
    EXPECT_EQ(codes([](Machine& m) { m.build_height = 60; }), "sequence.travel");
    EXPECT_EQ(codes([](Machine& m) { m.feed_height = 50; }), "sequence.travel");
    EXPECT_EQ(codes([](Machine& m) { m.build_mass_kg = 1; }), "sequence.mass");
    EXPECT_EQ(codes([](Machine& m) { m.feed_mass_kg = 1; }), "sequence.mass");
    EXPECT_NE(codes([](Machine& m) { m.handler_travel = 90; }).find("sequence.travel"), std::string::npos)
        << "100 mm of glue do not pass the head";
    EXPECT_EQ(codes([](Machine& m) { m.pump_g_min = 10; }), "sequence.pump sequence.time");
    // The same programs on a table that stays: the sequence would have to move their zero.
    EXPECT_NE(codes([](Machine& m) { m.table = BuildTable::fixed; }).find("sequence.table"),
              std::string::npos);
}

// A router's table stays: nobody carries, glue goes on by hand, and nothing is said of beads.
TEST(BuildReplay, ARoutersGlueGoesOnByHand) {
    Job job;
    job.machine.table = BuildTable::fixed;
    job.machine.travel_z = 400;
    const json sequence = json::parse(sequence_json(block(job, {3, 1, false})));
    for (const json& step : sequence["steps"])
        for (const char* key :
             {"side", "bead_mm", "speed_mm_min", "glue_g", "pump_g_min", "handler_mm", "stack", "pile"})
            EXPECT_FALSE(step.contains(key)) << step;
    for (const json& glue : sequence["glue"]) EXPECT_FALSE(glue.contains("beads"));
    EXPECT_NEAR(sequence["steps"][place_of(sequence["steps"], "glue")]["seconds"], 60 * .006, 0.005);
}

// Seeded corruptions of good sequences: each is told, or it changes nothing that the machine does.
TEST(BuildReplay, RandomCorruptionsAreToldOrChangeNothing) {
    std::mt19937 random(test::seed());
    std::map<std::string, std::pair<int, int>> tally;  // told, equivalent
    for (int round = 0; round < 1500; ++round) {
        const Plan plan = block(random_job(random), random_shape(random));
        const BuildPlan build = stated(plan);
        json sequence = json::parse(sequence_json(plan));
        json steps = sequence["steps"];
        const std::size_t i = random() % steps.size(), j = random() % steps.size();
        const std::string before = steps[i].dump();
        std::string kind;
        bool equivalent = false;
        switch (random() % 8) {
            case 0:
                kind = "drop";
                steps.erase(i);
                break;
            case 1:
                kind = "swap";
                std::swap(steps[i], steps[j]);
                equivalent = keeps_needs(steps);
                break;
            case 2: {
                kind = "neighbours";
                const std::size_t k = std::min(i + 1, steps.size() - 1);
                std::swap(steps[i], steps[k]);
                equivalent = keeps_needs(steps);
                break;
            }
            case 3: {
                kind = "double";
                const json again = steps[i];
                steps.insert(steps.begin() + static_cast<std::ptrdiff_t>(j), again);
                break;
            }
            case 4: {
                kind = "number";
                std::vector<std::string> keys;
                for (const auto& [key, value] : steps[i].items())
                    if (value.is_number()) keys.push_back(key);
                const std::string key = keys[random() % keys.size()];
                json& value = steps[i][key];
                if (value.is_number_integer() &&
                    (key == "id" || key == "layer" || key == "tool" || key == "slabs"))
                    value =
                        value.get<int>() + (random() % 2 ? 1 : -1) * (1 + static_cast<int>(random() % 20));
                else value = value.get<double>() + (1 + static_cast<double>(random() % 200)) / 2;
                kind += " " + key;
                break;
            }
            case 5: {
                kind = "program";
                json& a = steps[place_of(steps, random() % 2 ? "face" : "mill")];
                json& b = steps[place_of(steps, "mill", 1 + static_cast<int>(random() % 2))];
                equivalent = a["program"] == b["program"];
                std::swap(a["program"], b["program"]);
                break;
            }
            case 6: {
                kind = "tool";
                json& change = steps[place_of(steps, random() % 2 ? "tool_change" : "mill",
                                              static_cast<int>(random() % 2))];
                change["tool"] = change["tool"].get<int>() % 3 + 1;
                break;
            }
            default: {
                kind = "need";
                json& needs = steps[i]["needs"];
                if (needs.empty()) {
                    equivalent = true;
                } else {
                    // With one need only, nothing else says what the step waits for.
                    equivalent = needs.size() > 1;
                    needs.erase(random() % needs.size());
                }
            }
        }
        sequence["steps"] = steps;
        const std::vector<Violation> found = found_in(build, sequence);
        auto& [told, same] = tally[kind.substr(0, kind.find(' '))];
        ++(found.empty() ? same : told);
        if (kind == "need" && equivalent) continue;  // told or not, by what the other need waits for
        if (equivalent && kind.find(' ') == std::string::npos) {
            EXPECT_EQ(codes_of(found), "") << round << ' ' << kind << ' ' << first_message(found);
        } else if (!equivalent) {
            EXPECT_NE(codes_of(found), "") << round << ' ' << kind << ' ' << i << ' ' << j << ' ' << before;
        }
    }
    for (const auto& [kind, count] : tally)
        std::printf("%-10s told %d, changes nothing %d\n", kind.c_str(), count.first, count.second);
}

// Texts with many corruptions at once, and texts that are no JSON any more: the reader refuses or the replay
// tells, and neither fails in another way.
TEST(BuildReplay, SequencesCorruptedThroughAndThroughAreToldOrRefused) {
    std::mt19937 random(test::seed());
    int told = 0, refused = 0;
    for (int round = 0; round < 400; ++round) {
        const Plan plan = block(random_job(random), random_shape(random));
        const BuildPlan build = stated(plan);
        const std::string good = sequence_json(plan);
        json sequence = json::parse(good);
        json& steps = sequence["steps"];
        for (int k = 0, n = 2 + static_cast<int>(random() % 30); k < n && !steps.empty(); ++k) {
            json& step = steps[random() % steps.size()];
            switch (random() % 5) {
                case 0:
                    steps.erase(random() % steps.size());
                    break;
                case 1:
                    steps.insert(steps.begin() + static_cast<std::ptrdiff_t>(random() % steps.size()),
                                 json(step));
                    break;
                case 2:
                    std::swap(step, steps[random() % steps.size()]);
                    break;
                case 3:
                    for (auto& [key, value] : step.items())
                        if (value.is_number() && key != "seconds" && random() % 3 == 0)
                            value = static_cast<int>(random() % 2001) - 1000;
                    break;
                default:
                    step["action"] = steps[random() % steps.size()]["action"];
            }
        }
        std::string text = sequence.dump();
        if (random() % 2) {
            text = good;
            for (int k = 0, n = 1 + static_cast<int>(random() % 8); k < n; ++k)
                text[random() % text.size()] = static_cast<char>(random() & 255U);
        }
        try {
            const BuildSequence read = read_sequence(text);
            told += !replay_build(build, read).empty();
        } catch (const Error& e) {
            ASSERT_EQ(e.code(), "verify.sequence") << e.message();
            ++refused;
        }
    }
    std::printf("told %d, refused %d of 400\n", told, refused);
    EXPECT_GT(told, 100);
    EXPECT_GT(refused, 100);
}

TEST(SequenceReader, RefusesWhatIsNoSequence) {
    const json good = json::parse(sequence_json(block(Job{}, {2, 1, false})));
    const auto refused = [](const std::string& text) -> std::string {
        try {
            (void)read_sequence(text);
        } catch (const Error& e) {
            EXPECT_EQ(e.code(), "verify.sequence");
            EXPECT_EQ(e.kind(), ErrorKind::verification);
            return e.message();
        }
        return {};
    };
    EXPECT_EQ(refused(good.dump()), "");
    const auto changed = [&](const std::function<void(json&)>& change) {
        json broken = good;
        change(broken);
        return refused(broken.dump());
    };
    EXPECT_NE(refused(""), "");
    EXPECT_NE(refused("[]"), "");
    EXPECT_NE(refused(good.dump().substr(0, 500)), "");
    EXPECT_NE(refused(std::string(1 << 20, '[')), "");
    EXPECT_NE(changed([](json& j) { j["schema"] = "slabwright.sequence/2"; }), "");
    EXPECT_NE(changed([](json& j) { j["units"] = "in"; }), "");
    EXPECT_NE(changed([](json& j) { j["frame"] = "auto"; }), "");
    EXPECT_NE(changed([](json& j) { j.erase("glue"); }), "");
    EXPECT_NE(changed([](json& j) { j["steps"][3].erase("needs"); }), "");
    EXPECT_NE(changed([](json& j) { j["steps"][3]["id"] = "4"; }), "");
    EXPECT_NE(changed([](json& j) { j["steps"][3]["id"] = 4.5; }), "");
    EXPECT_NE(changed([](json& j) { j["steps"][3]["id"] = 1e12; }), "");
    EXPECT_NE(changed([](json& j) { j["steps"][3]["seconds"] = -1; }), "");
    EXPECT_NE(changed([](json& j) { j["steps"][3]["action"] = true; }), "");
    EXPECT_NE(changed([](json& j) { j["steps"][3]["needs"] = 3; }), "");
    EXPECT_NE(changed([](json& j) { j["steps"][3]["setback_mm"] = nullptr; }), "");
    EXPECT_NE(changed([](json& j) { j["glue"][0]["loops"][0][0] = json::array({1, 2, 3}); }), "");
    std::string twice = good.dump();
    twice.insert(twice.find("\"action\""), "\"id\":99,");
    EXPECT_NE(refused(twice).find("twice"), std::string::npos);
    std::string huge = good.dump();
    huge.replace(huge.find("\"seconds\":") + 10, 1, "1e999");
    EXPECT_NE(refused(huge), "");
}

// Plans as the planner makes them, read back from their folder: nothing is told of any of them.
TEST(BuildReplay, NothingIsToldOfThePlannersOwnBuilds) {
    const std::string stl = support::checkout("tests/data/half-sphere.stl");
    struct Variant {
        const char* name;
        std::function<void(Job&)> change;
    };
    const std::vector<Variant> variants{
        {"default", [](Job&) {}},
        {"pattern-base", [](Job& job) { job.machine.frame = Frame::pattern_base; }},
        {"fixed table", [](Job& job) { job.machine.table = BuildTable::fixed; }},
        {"fixed table, layer-top",
         [](Job& job) {
             job.machine.table = BuildTable::fixed;
             job.machine.frame = Frame::layer_top;
         }},
        {"flask", [](Job& job) { job.flask.enabled = true; }},
        {"bonded slabs",
         [](Job& job) {
             job.layers.strategy = LayerStrategy::combined;
             for (Tool& tool : job.tools)
                 if (tool.kind != ToolKind::face) tool.flute_length = 70, tool.stickout = 80;
         }},
    };
    for (const Variant& variant : variants) {
        support::TemporaryFolder folder;
        Context context({.threads = 2, .memory_bytes = 0, .progress = {}});
        Job job;
        job.cutting.engagement = Engagement::nominal;
        variant.change(job);
        const Plan planned = plan(context, stl, job);
        if (job.layers.strategy == LayerStrategy::combined) {
            EXPECT_TRUE(std::any_of(planned.layers.begin(), planned.layers.end(),
                                    [](const Layer& layer) { return layer.slabs > 1; }));
        }
        const std::string out = (folder.path / "out").string();
        write(context, planned, out);
        const VerifyResult result = verify(context, out, stl, {}, 1);
        for (const Diagnostic& d : result.violations)
            EXPECT_FALSE(d.code.starts_with("sequence.")) << variant.name << ": " << d.message;
    }
}
