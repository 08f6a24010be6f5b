// The proof's score: seeded edits of programs, tables, sequences and plans, by classes. What would make a
// machine, or the person at it, do something else must be found; what is not found is held against what they
// would do. SLABWRIGHT_EDITS=2000 says how many (bench/edits); the sample of every day is small.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <iterator>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tests/support/edited_programs.h"
#include "tests/support/seed.h"

using namespace slabwright;
using namespace slabwright::support;
using Json = nlohmann::ordered_json;

namespace {

constexpr int kSample = 80;

/// Files of a folder, by name from OUT; nothing is a file that is missing.
using Files = std::map<std::string, std::optional<std::string>>;

/// A class of edits.
struct EditClass {
    const char* what;
    const char* machine;  ///< what a machine, or the person at it, would do
    double share;         ///< of all edits, in parts of the sum
    /// Changes files of a folder, of which it is given the good texts. @return what it did; "" for nothing
    std::function<std::string(Random&, const Planned&, Files&)> edit;
};

// ---- Programs and the tool table, by lines

const std::string& any_program(Random& random, const Planned& p) {
    return std::next(p.texts.begin(), static_cast<std::ptrdiff_t>(below(random, p.texts.size())))->first;
}

std::string edit_program(Random& random, const Planned& p, Files& files, std::size_t kind) {
    const std::string& file = any_program(random, p);
    std::vector<std::string> lines = split(p.texts.at(file));
    const std::string what = edit(random, lines, kind);
    files["nc/" + file] = join(lines);
    return what.empty() || join(lines) == p.texts.at(file) ? "" : file + ": " + what;
}

EditClass program_class(const char* what, const char* machine, double share, std::vector<std::size_t> kinds) {
    return {what, machine, share, [kinds](Random& random, const Planned& p, Files& files) {
                return edit_program(random, p, files, any(random, kinds));
            }};
}

std::string edit_table(Random& random, const Planned& p, Files& files) {
    std::vector<std::string> lines = split(p.table);
    static const std::vector<std::size_t> kinds{0, 1, 2, 3, 4, 8, 9, 10, 11, 12, 13, 14, 15};
    std::string what = edit(random, lines, any(random, kinds));
    if (!lines.empty() && below(random, 3) == 0) {
        static const std::vector<std::string> words{"X50", "Y-30", "Z5", "I90", "A45", "Q3", "U1", "J10"};
        std::string& line = lines[below(random, lines.size())];
        line.insert(std::min(line.find(';'), line.size()), any(random, words) + " ");
        what = "word added: " + line;
    }
    files["tool.tbl"] = join(lines);
    return what.empty() || join(lines) == p.table ? "" : what;
}

std::string exchange_programs(Random& random, const Planned& p, Files& files) {
    const std::string &a = any_program(random, p), &b = any_program(random, p);
    if (a == b) return "";
    files["nc/" + a] = p.texts.at(b);
    files["nc/" + b] = p.texts.at(a);
    return a + " and " + b;
}

std::string lose_file(Random& random, const Planned& p, Files& files) {
    static const std::vector<std::string> others{"tool.tbl", "sequence.json", "plan.json", "cut_list.csv"};
    const std::string file = below(random, 2) == 0 ? any(random, others) : "nc/" + any_program(random, p);
    files[file] = std::nullopt;
    return file;
}

// ---- Documents, by values

/// All leaves of a document, by their JSON pointers.
void leaves(const Json& at, const std::string& path, std::vector<std::string>& found) {
    if (at.is_structured())
        for (const auto& [key, value] : at.items()) leaves(value, path + "/" + key, found);
    else found.push_back(path);
}

Json document(const Planned& p, const char* file) { return Json::parse(slurp(fs::path(p.out()) / file)); }

std::string put(Files& files, const char* file, const Json& edited, const std::string& what) {
    files[file] = edited.dump(2) + "\n";
    return what;
}

/// Another value of the same type in place of one, of those under `root` whose pointers `chosen` takes.
std::string edit_value(Random& random, Json& document,
                       const std::function<bool(const std::string&)>& chosen) {
    std::vector<std::string> all;
    leaves(document, "", all);
    std::erase_if(all, [&](const std::string& path) { return !chosen(path); });
    if (all.empty()) return "";
    const std::string& path = any(random, all);
    Json& value = document[Json::json_pointer(path)];
    const Json before = value;
    if (value.is_boolean()) value = !value.get<bool>();
    else if (value.is_number_integer())
        value = value.get<std::int64_t>() + any(random, std::vector<int>{1, -1, 2, 10});
    else if (value.is_number()) {
        const double v = value.get<double>();
        value = any(random, std::vector<double>{v + 5, v - 5, v * 2, -v - 1, v + 0.5});
    } else if (value.is_string()) {
        std::vector<std::string> others;  // of the same key elsewhere
        const std::string key = path.substr(path.rfind('/') + 1);
        std::vector<std::string> every;
        leaves(document, "", every);
        for (const std::string& other : every)
            if (other.ends_with("/" + key)) {
                const Json& there = document[Json::json_pointer(other)];
                if (there.is_string() && there != before) others.push_back(there.get<std::string>());
            }
        value =
            others.empty() || below(random, 4) == 0 ? before.get<std::string>() + "x" : any(random, others);
    } else {
        return "";
    }
    return path + " from " + before.dump() + " to " + value.dump();
}

/// Keys of steps that are for people who plan their day, or tell in words what the program says.
bool is_told_only(const std::string& path) {
    static const std::set<std::string> keys{"seconds", "purpose", "pattern", "material", "glue"};
    return keys.contains(path.substr(path.rfind('/') + 1));
}

std::string edit_step(Random& random, const Planned& p, Files& files) {
    Json sequence = document(p, "sequence.json");
    const std::string what = edit_value(random, sequence, [](const std::string& path) {
        return path.starts_with("/steps/") && path.find("/needs/") == std::string::npos &&
               !is_told_only(path);
    });
    return put(files, "sequence.json", sequence, what);
}

std::string edit_glue(Random& random, const Planned& p, Files& files) {
    Json sequence = document(p, "sequence.json");
    const std::string what =
        edit_value(random, sequence, [](const std::string& path) { return path.starts_with("/glue/"); });
    return put(files, "sequence.json", sequence, what);
}

std::string edit_head(Random& random, const Planned& p, Files& files) {
    Json sequence = document(p, "sequence.json");
    const std::string what = edit_value(random, sequence, [](const std::string& path) {
        return !path.starts_with("/glue/") && !path.starts_with("/steps/") && !is_told_only(path);
    });
    return put(files, "sequence.json", sequence, what);
}

std::string edit_needs(Random& random, const Planned& p, Files& files) {
    Json sequence = document(p, "sequence.json");
    const std::string what = edit_value(
        random, sequence, [](const std::string& path) { return path.find("/needs/") != std::string::npos; });
    return put(files, "sequence.json", sequence, what);
}

/// Numbers steps as they stand.
void number(Json& steps) {
    std::map<int, int> now;
    for (std::size_t i = 0; i < steps.size(); ++i) now[steps[i]["id"].get<int>()] = static_cast<int>(i) + 1;
    for (Json& step : steps) {
        step["id"] = now.at(step["id"].get<int>());
        for (Json& need : step["needs"])
            if (const auto other = now.find(need.get<int>()); other != now.end()) need = other->second;
    }
}

std::string edit_order(Random& random, const Planned& p, Files& files) {
    Json sequence = document(p, "sequence.json");
    Json& steps = sequence["steps"];
    const std::size_t at = below(random, steps.size()), to = below(random, steps.size());
    std::string what = std::to_string(at + 1) + " " + steps[at]["action"].get<std::string>();
    const std::size_t kind = below(random, 3);
    if (kind == 0) {
        steps.erase(at);
        what = "without " + what;
    } else if (kind == 1) {
        const Json copy = steps[at];
        steps.insert(steps.begin() + static_cast<std::ptrdiff_t>(at), copy);
        what = "twice " + what;
    } else {
        if (at == to) return "";
        std::swap(steps[at], steps[to]);
        what += " exchanged with " + std::to_string(to + 1);
    }
    number(steps);
    return put(files, "sequence.json", sequence, what);
}

/// What of plan.json the machine is set up by: tools, wood, heights, programs.
std::string edit_plan(Random& random, const Planned& p, Files& files, const std::vector<std::string>& under) {
    Json plan = document(p, "plan.json");
    const std::string& root = any(random, under);
    const std::string what = edit_value(random, plan, [&](const std::string& path) {
        const std::size_t star = root.find('*');
        if (star == std::string::npos) return path.starts_with(root);
        const std::size_t rest = path.find('/', star);
        return path.starts_with(root.substr(0, star)) && rest != std::string::npos &&
               path.substr(rest).starts_with(root.substr(star + 1));
    });
    return put(files, "plan.json", plan, what);
}

EditClass plan_class(const char* what, const char* machine, double share, std::vector<std::string> under) {
    return {what, machine, share, [under](Random& random, const Planned& p, Files& files) {
                return edit_plan(random, p, files, under);
            }};
}

const std::vector<EditClass> kClasses{
    program_class("line lost", "leaves out a move or a word of state", 8, {0}),
    program_class("line twice", "does it again", 4, {1}),
    program_class("lines moved or exchanged", "goes by another way", 8, {2, 15}),
    program_class("number changed", "goes elsewhere, faster, deeper", 10, {3, 4}),
    program_class("sign or point lost", "goes to the other side, or ten times as far", 6, {8, 9}),
    program_class("word of state changed", "reads what follows in another unit, plane, frame", 6, {5}),
    program_class("foreign line", "whatever it says: offsets, subprograms, files, stops", 10, {6, 7}),
    program_class("word lost, letter changed", "takes another axis, or none", 6, {10, 11}),
    program_class("cut off", "stops in the cut, spindle on", 3, {12}),
    program_class("byte inserted, lines joined", "reads another word, or stops", 5, {13, 14}),
    {"programs exchanged", "cuts another layer's, or by another tool", 3, exchange_programs},
    {"file lost", "cannot begin, or runs what lay there before", 2, lose_file},
    {"tool.tbl", "applies another tool's length, pocket or offset", 10, edit_table},
    {"sequence.json: step", "takes another tool, program, slab, height", 12, edit_step},
    {"sequence.json: steps lost, twice, exchanged", "cuts before it has glued, or without a tool", 8,
     edit_order},
    {"sequence.json: needs", "begins before it may", 4, edit_needs},
    {"sequence.json: glue", "glues beside the joint", 3, edit_glue},
    {"sequence.json: head", "builds for another pattern or frame", 2, edit_head},
    plan_class("plan.json: tools", "is given another cutter", 5,
               {"/tools/*/number", "/tools/*/diameter", "/tools/*/kind"}),
    plan_class("plan.json: layers", "is set to another height", 5,
               {"/layers/*/z_bottom", "/layers/*/z_top", "/layers/*/slab_thickness", "/layers/*/slabs"}),
    plan_class("plan.json: programs", "runs another program, by another tool", 5,
               {"/layers/*/operations/0/file", "/layers/*/operations/0/tool", "/layers/*/operations/1/tool"}),
    plan_class("plan.json: setup", "stands elsewhere, in other units", 4,
               {"/frame", "/zero", "/stock", "/units", "/job/machine/post", "/job/machine/units", "/schema"}),
    {"other spelling", "does the same", 5,
     [](Random& random, const Planned& p, Files& files) {
         const std::string& file = any_program(random, p);
         std::vector<std::string> lines = split(p.texts.at(file));
         const std::string what = respell(random, lines);
         files["nc/" + file] = join(lines);
         return what.empty() ? "" : file + ": " + what;
     }},
};

// ---- The judges

std::string verdict_of(Planned& p, const Files& files) {
    Files good;
    for (const auto& [name, text] : files) {
        const fs::path path = fs::path(p.out()) / name;
        good[name] = slurp(path);
        if (text) spit(path, *text);
        else fs::remove(path);
    }
    std::string found;
    try {
        const Verification v = verify_folder(
            p.context, p.out(),
            {.source = p.folder / "hill.stl", .pattern = p.pattern, .cell = kCell, .write = false});
        for (const Violation& w : v.report.violations) found += w.code + " ";
    } catch (const Error& e) {
        found = e.code();
    }
    for (const auto& [name, text] : good) spit(fs::path(p.out()) / name, *text);
    return found;
}

/// By step, the steps that must be done before it, by way of others too.
std::vector<std::set<std::size_t>> all_needs(const Json& sequence) {
    std::vector<std::set<std::size_t>> all;
    for (const Json& step : sequence["steps"]) {
        std::set<std::size_t> needs;
        for (const Json& need : step["needs"]) {
            const auto other = need.get<std::size_t>() - 1;
            if (other >= all.size()) return {};
            needs.insert(other);
            needs.insert(all[other].begin(), all[other].end());
        }
        all.push_back(std::move(needs));
    }
    return all;
}

/// Whether one sequence has the steps of another, none of which may begin earlier.
bool later_at_most(const std::string& edited, const std::string& good) {
    Json a = Json::parse(edited), b = Json::parse(good);
    const auto needs = all_needs(a), of_good = all_needs(b);
    if (needs.size() != of_good.size()) return false;
    for (std::size_t i = 0; i < needs.size(); ++i)
        if (!std::includes(needs[i].begin(), needs[i].end(), of_good[i].begin(), of_good[i].end()))
            return false;
    for (Json* sequence : {&a, &b})
        for (Json& step : (*sequence)["steps"]) step.erase("needs");
    return a == b;
}

/// Whether two plans have a machine set up alike. A flat end mill cuts what a face mill of its diameter does.
/// Of the last layer's top nobody hears where programs count from the pattern's base: nothing is laid on it.
bool same_setup(const std::string& edited, const std::string& good) {
    Json a = Json::parse(edited), b = Json::parse(good);
    for (Json* plan : {&a, &b}) {
        for (Json& tool : (*plan)["tools"])
            if (tool["kind"] == "face") tool["kind"] = "flat";
        if ((*plan)["frame"] == "pattern-base") (*plan)["layers"].back().erase("z_top");
    }
    return a == b;
}

/// What a machine does otherwise by what passed; "" for nothing.
std::string does_otherwise(const Planned& p, const Files& files, bool& interpreter) {
    for (const auto& [name, text] : files) {
        if (!text) return name + " is missing";
        if (name == "tool.tbl") {
            if (rows(*text) != rows(p.table)) return "another tool table";
            continue;
        }
        if (name == "sequence.json" && later_at_most(*text, slurp(fs::path(p.out()) / name))) continue;
        if (name == "plan.json" && same_setup(*text, slurp(fs::path(p.out()) / name))) continue;
        if (!name.starts_with("nc/")) return "another " + name;
        if (!interpreter) continue;
        try {
            const auto good = p.acts(p.texts.at(name.substr(3))), edited = p.acts(*text);
            for (const std::size_t k : {0, 1})
                if (const std::string differs = difference(good[k], edited[k]); !differs.empty())
                    return differs;
        } catch (const std::runtime_error& e) {
            if (std::string(e.what()).find("is missing") == std::string::npos) return e.what();
            interpreter = false;
        }
    }
    return "";
}

struct Score {
    int edits = 0, caught = 0, harmless = 0, wrong = 0;
};

}  // namespace

TEST(EditsScore, WhatAMachineWouldDoOtherwiseIsFound) {
    const char* wanted = std::getenv("SLABWRIGHT_EDITS");
    const int edits = wanted != nullptr ? std::atoi(wanted) : kSample;
    const std::uint32_t seed = test::seed();
    std::vector<std::unique_ptr<Planned>> folders;
    folders.push_back(std::make_unique<Planned>(Case{"two layers", Frame::layer_top, true, [](Job&) {}, 24}));
    if (edits > kSample)
        folders.push_back(std::make_unique<Planned>(Case{"one layer", Frame::pattern_base, true}));
    for (const auto& folder : folders) EXPECT_EQ(verdict_of(*folder, {}), "") << "a false alarm";
    double sum = 0;
    for (const EditClass& c : kClasses) sum += c.share;
    bool interpreter = true;
    Score all;
    std::printf(
        "| edit | a machine then | edits | caught | harmless | passed |\n|---|---|---|---|---|---|\n");
    for (std::size_t c = 0; c < kClasses.size(); ++c) {
        const EditClass& which = kClasses[c];
        const bool spelling = c + 1 == kClasses.size();
        const int count = std::max(1, static_cast<int>(std::lround(edits * which.share / sum)));
        Score score;
        for (std::uint32_t k = 0; score.edits < count && k < 100u * static_cast<std::uint32_t>(count); ++k) {
            Random random(seed + 104729 * k + 7919 * static_cast<std::uint32_t>(c));
            Planned& folder = *folders[k % folders.size()];
            Files files;
            const std::string what = which.edit(random, folder, files);
            if (what.empty()) continue;
            ++score.edits;
            const std::string found = verdict_of(folder, files);
            const std::string differs = found.empty() ? does_otherwise(folder, files, interpreter) : "";
            const bool wrong = spelling ? !found.empty() : !differs.empty();
            if (wrong) ++score.wrong;
            else if (found.empty()) ++score.harmless;
            else ++score.caught;
            EXPECT_FALSE(wrong) << which.what << ", edit " << k << ": " << what << "\n"
                                << (spelling ? "a false alarm: " + found : "passes; then " + differs);
        }
        std::printf("| %s | %s | %d | %d | %d | %d |\n", which.what, which.machine, score.edits, score.caught,
                    score.harmless, score.wrong);
        all.edits += score.edits;
        all.caught += score.caught;
        all.harmless += score.harmless;
        all.wrong += score.wrong;
    }
    std::printf(
        "\n%d edits: %d caught, %d do nothing to a machine, %d passed or false alarms%s\n", all.edits,
        all.caught, all.harmless, all.wrong,
        interpreter ? "" : " (without rs274, which is not installed: what passed was not asked further)");
}

// Another height of a joint, which a handler that lays glue goes by, changes no area and no outline.
TEST(EditsScore, GlueAtAnotherHeightIsFound) {
    Planned folder(Case{"two layers", Frame::layer_top, true, [](Job&) {}, 24});
    Json sequence = document(folder, "sequence.json");
    ASSERT_EQ(sequence["glue"].size(), 2U);
    sequence["glue"][1]["z_mm"] = sequence["glue"][1]["z_mm"].get<double>() + 0.5;
    EXPECT_EQ(verdict_of(folder, {{"sequence.json", sequence.dump(2)}}), "sequence.glue ");
}
