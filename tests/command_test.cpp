// The command as its users meet it: exit codes, errors, cancel, and the same bytes however it is run.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "tests/data/models.h"
#include "tests/support/comma_locale.h"
#include "tests/support/command.h"
#include "tests/support/drilled_plate.h"
#include "tests/support/files.h"
#include "tests/support/places.h"
#include "tests/support/rs274.h"
#include "tests/support/temporary_folder.h"

using namespace slabwright;
using slabwright::support::CommandResult;
using slabwright::support::run_command;
using slabwright::support::slurp;
using slabwright::support::spit;
using slabwright::support::TemporaryFolder;
using slabwright::support::tree;
namespace fs = std::filesystem;
using nlohmann::json;

namespace {

const std::string kData = support::checkout("tests/data/");

void write_metre_pattern(const std::string& path, const MetrePattern& pattern) {
    std::ofstream stl(path, std::ios::binary);
    stl << stl_head("pattern", metre_pattern_facets(pattern));
    metre_pattern(pattern, [&](const Facet& facet) {
        const auto bytes = stl_facet(facet);
        stl.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    });
}

CommandResult slabwright_command(std::vector<std::string> arguments,
                                 const std::vector<std::pair<std::string, std::string>>& environment = {},
                                 double interrupt_after = -1) {
    arguments.insert(arguments.begin(), support::built_command());
    return run_command(arguments, environment, interrupt_after);
}

/// An axis-parallel box, `open` without its top.
std::vector<Facet> box(Vec3f low, Vec3f high, bool open = false) {
    const auto at = [&](int i) {
        return Vec3f{i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z};
    };
    const int quads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                             {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    std::vector<Facet> facets;
    for (int q = 0; q < 6; ++q) {
        if (open && q == 1) continue;
        const int* c = quads[q];
        facets.push_back({at(c[0]), at(c[1]), at(c[2])});
        facets.push_back({at(c[0]), at(c[2]), at(c[3])});
    }
    return facets;
}

/// A board on a post: its underside can never be milled from above in one layer, nor be met by a boundary if
/// it slopes.
std::vector<Facet> mushroom() {
    // A cone standing on its tip's stump: every side facet leans outwards.
    std::vector<Facet> facets;
    const int n = 24;
    const auto ring = [&](int i, float radius, float z) {
        const double angle = 2 * 3.14159265358979 * (i % n) / n;
        return Vec3f{static_cast<float>(radius * std::cos(angle)),
                     static_cast<float>(radius * std::sin(angle)), z};
    };
    for (int i = 0; i < n; ++i) {
        facets.push_back({Vec3f{0, 0, 0}, ring(i + 1, 20, 0), ring(i, 20, 0)});
        facets.push_back({Vec3f{0, 0, 30}, ring(i, 40, 30), ring(i + 1, 40, 30)});
        facets.push_back({ring(i, 20, 0), ring(i + 1, 20, 0), ring(i + 1, 40, 30)});
        facets.push_back({ring(i, 20, 0), ring(i + 1, 40, 30), ring(i, 40, 30)});
    }
    return facets;
}

void expect_one_line(const CommandResult& result) {
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_TRUE(!result.err.empty() && result.err.back() == '\n');
    EXPECT_EQ(result.err.rfind("slabwright: ", 0), 0u) << result.err;
    EXPECT_EQ(result.out, "");
}

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr double kCancelSeconds = 5;  // sanitizers slow everything down
#else
constexpr double kCancelSeconds = 0.5;
#endif

}  // namespace

#ifdef SLABWRIGHT_JEMALLOC
TEST(Command, TakesItsMemoryAsToolsAllocatorSays) {
    const CommandResult told = slabwright_command({"--version"}, {{"MALLOC_CONF", "stats_print:true"}});
    ASSERT_EQ(told.exit, 0) << told.err;
    for (const char* setting :
         {"opt.thp: \"always\"", "opt.oversize_threshold: 0", "opt.dirty_decay_ms: 3000"})
        EXPECT_NE(told.err.find(setting), std::string::npos)
            << setting << " is not in " << told.err.substr(0, 2000);
}

// What is given back is kept while there is plenty, and no more than the promise of --memory allows where
// there is not.
TEST(Command, KeepsMemoryWithinWhatMayBeUsed) {
    const TemporaryFolder folder;
    const std::string stl = folder / "metre.stl";
    write_metre_pattern(stl, {.size_mm = 290, .height_mm = 29, .facets = 600'000});
    struct Memory {
        std::uint64_t peak_bytes;
        std::uint64_t returned_pages;  ///< that the allocator gave back to the system, of 4096 bytes
    };
    const auto memory = [&](const char* gib) -> Memory {
        const CommandResult made =
            slabwright_command({"plan", stl, "-o", folder / "out", "--tools", "fixed", "--allow-undercut",
                                "--no-verify", "--quiet", "--threads", "2", "--memory", gib},
                               {{"MALLOC_CONF", "stats_print:true,stats_print_opts:Jgdablxeh"}});
        EXPECT_EQ(made.exit, 0) << made.err;
        std::smatch purged;
        EXPECT_TRUE(std::regex_search(made.err, purged, std::regex("\"dirty_purged\":([0-9]+)"))) << made.err;
        return {made.peak_bytes, purged.empty() ? 0 : std::stoull(purged[1])};
    };
    const Memory bounded = memory("0.2"), plenty = memory("6");
    EXPECT_LT(static_cast<double>(bounded.peak_bytes), 0.2 * (1 << 30) + (256 << 20));
    // 123000 and 719 here. The peaks tell less: the large arrays of a layer are kept by KeptMemory.
    EXPECT_GT(bounded.returned_pages, 30'000);
    EXPECT_LT(plenty.returned_pages, 5'000);
}
#endif

TEST(Command, HelpAndVersionSucceed) {
    for (const std::vector<std::string>& arguments :
         std::vector<std::vector<std::string>>{{"--help"}, {"plan", "--help"}, {"--version"}}) {
        const CommandResult result = slabwright_command(arguments);
        EXPECT_EQ(result.exit, 0);
        EXPECT_FALSE(result.out.empty());
        EXPECT_EQ(result.err, "");
    }
}

TEST(Command, WrongUseExitsTwoWithOneLine) {
    TemporaryFolder folder;
    const std::string stl = kData + "half-sphere.stl", out = folder / "out";
    spit(folder.path / "bad.toml", "[machine]\nclearence = 5\n");
    const std::vector<std::vector<std::string>> wrong = {
        {},
        {"bake"},
        {"plan"},
        {"plan", stl},
        {"plan", stl, "-o", out, "--units", "cm"},
        {"plan", stl, "-o", out, "--threads", "0"},
        {"plan", stl, "-o", out, "--threads", "-1"},
        {"plan", stl, "-o", out, "--threads", "two"},
        {"plan", stl, "-o", out, "--memory", "0"},
        {"plan", stl, "-o", out, "--strategy", "best"},
        {"plan", stl, "-o", out, "--finder", "luck"},
        {"plan", stl, "-o", out, "--weld", "-1"},
        {"plan", stl, "-o", out, "--wled", "1"},
        {"plan", stl, "-o", out, "--cell", "0"},
        {"verify", out, "--cell", "20"},
        {"plan", stl, "-o", out, "--job", folder / "missing.toml"},
        {"plan", stl, "-o", out, "--job", folder.path.string()},
        {"plan", stl, "-o", out, "--job", folder / "bad.toml"},
        {"slice", stl, "-o", out + ".svg"},
        {"slice", stl, "--every", "0", "-o", out + ".svg"},
        {"slice", stl, "--every", "-3", "-o", out + ".svg"},
        {"slice", stl, "--every", "1e-9", "-o", out + ".svg"},
        {"slice", stl, "--every", "500", "-o", out + ".svg"},
        {"slice", stl, "--every", "5", "-o", out + ".png"},
        {"job"}};
    for (const auto& arguments : wrong) {
        const CommandResult result = slabwright_command(arguments);
        std::string line;
        for (const std::string& argument : arguments) line += argument + " ";
        EXPECT_EQ(result.exit, 2) << line << result.err;
        expect_one_line(result);
    }
    const CommandResult job = slabwright_command({"plan", stl, "-o", out, "--job", folder / "bad.toml"});
    EXPECT_NE(job.err.find("bad.toml:2"), std::string::npos) << job.err;
    EXPECT_NE(job.err.find("machine.clearance"), std::string::npos) << job.err;
    EXPECT_FALSE(fs::exists(out));
}

TEST(Command, UnusableInputExitsThree) {
    TemporaryFolder folder;
    const std::string out = folder / "out";
    const std::string whole = stl_bytes("box", box({0, 0, 0}, {50, 40, 30}));
    spit(folder.path / "empty.stl", "");
    spit(folder.path / "short.stl", whole.substr(0, whole.size() - 7));
    spit(folder.path / "text.stl", "solid x\nfacet normal 0 0 1\nouter loop\nvertex 1 2 three\n");
    std::mt19937 random(1);
    test::DrilledPlate plate(40, 30);
    const test::LoopAxis axis{{20, 20, 0}};
    const std::vector<double> angles = test::turn(40, 0, 0, random);
    const Vec3d floor{20, 20, 10};
    plate.cell(40, axis, {axis.ring(angles, 3, 30), axis.ring(angles, 3, 10)}, &floor);
    spit(folder.path / "drilled.stl", stl_bytes("drilled", test::rounded(plate.closed())));
    const CommandResult drilled = slabwright_command({"inspect", folder / "drilled.stl", "--json"});
    ASSERT_EQ(drilled.exit, 0) << drilled.err;
    const json holes = json::parse(drilled.out)["holes"];
    ASSERT_EQ(holes.size(), 1u);
    EXPECT_EQ(holes[0]["kind"], "plain");
    EXPECT_EQ(holes[0]["bottom"], "flat");
    EXPECT_EQ(holes[0]["into"], json({0, 0, -1}));
    EXPECT_NEAR(holes[0]["diameter"].get<double>(), 6, 1e-3);
    EXPECT_EQ(holes[0]["steps"].size(), 1u);
    EXPECT_NE(slabwright_command({"inspect", folder / "drilled.stl"})
                  .out.find("plain 6 mm, 20 mm deep, flat bottom, at x 20 y 20 z 30"),
              std::string::npos);

    spit(folder.path / "open.stl", stl_bytes("open", box({0, 0, 0}, {50, 40, 30}, true)));
    spit(folder.path / "flat.stl", stl_bytes("flat", box({0, 0, 7}, {50, 40, 7})));
    for (const char* name : {"missing.stl", "empty.stl", "short.stl", "text.stl", "open.stl", "flat.stl"}) {
        const CommandResult result = slabwright_command({"plan", folder / name, "-o", out});
        EXPECT_EQ(result.exit, 3) << name << result.err;
        expect_one_line(result);
        EXPECT_NE(result.err.find(name), std::string::npos) << result.err;
        EXPECT_FALSE(fs::exists(out));
    }
    // A place that cannot be written is told before any planning.
    spit(folder.path / "file", "x");
    const CommandResult result =
        slabwright_command({"plan", kData + "pump-cover.stl", "-o", folder / "file"});
    EXPECT_EQ(result.exit, 3);
    expect_one_line(result);
}

TEST(Command, ImpossiblePartExitsFourAndSaysWhere) {
    TemporaryFolder folder;
    const std::string out = folder / "out";
    spit(folder.path / "wide.stl", stl_bytes("wide", box({0, 0, 0}, {3000, 40, 30})));
    spit(folder.path / "mushroom.stl", stl_bytes("mushroom", mushroom()));
    for (const char* name : {"wide.stl", "mushroom.stl"}) {
        const CommandResult result = slabwright_command({"plan", folder / name, "-o", out});
        EXPECT_EQ(result.exit, 4) << name << result.err;
        EXPECT_FALSE(fs::exists(out));
        if (name != std::string_view("mushroom.stl")) {
            expect_one_line(result);
            continue;
        }
        EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
        // What would build it, as commands: the cap down, nothing hangs over.
        EXPECT_NE(result.out.find("--turn 180,0,0\n    leaves nothing unmade"), std::string::npos)
            << result.out;
    }
    const CommandResult memory =
        slabwright_command({"plan", kData + "pump-cover.stl", "-o", out, "--memory", "0.001"});
    EXPECT_EQ(memory.exit, 4) << memory.err;
    EXPECT_FALSE(fs::exists(out));
    const CommandResult allowed =
        slabwright_command({"plan", folder / "mushroom.stl", "-o", out, "--allow-undercut"});
    EXPECT_EQ(allowed.exit, 0) << allowed.err;
    EXPECT_NE(allowed.out.find("warning: "), std::string::npos) << "what stays unmade is told";
}

TEST(Command, ErrorsComeAsJsonOnRequest) {
    TemporaryFolder folder;
    const std::vector<std::pair<int, std::vector<std::string>>> cases = {
        {3, {"plan", folder / "missing.stl", "-o", folder / "out", "--json"}},
        {2, {"plan", "--json"}},
        {2, {"plan", "x", "-o", folder / "out", "--json", "--threads", "0"}},
        {3, {"inspect", folder / "missing.stl", "--json"}}};
    for (const auto& [exit, arguments] : cases) {
        const CommandResult result = slabwright_command(arguments);
        EXPECT_EQ(result.exit, exit);
        EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
        const json error = json::parse(result.err)["error"];
        EXPECT_EQ(error["exit"], exit);
        for (const char* key : {"kind", "code", "message", "place", "remedy"})
            EXPECT_TRUE(error[key].is_string()) << key;
        EXPECT_FALSE(error["message"].get<std::string>().empty());
    }
}

TEST(Command, SameBytesOnAnyThreadsAndInAnyLocale) {
    TemporaryFolder folder;
    const support::CommaLocale locale;
    if (!locale.made)
        std::printf("no locale with decimal commas could be made here; LC_ALL is tried without one\n");
    const std::vector<std::pair<std::string, std::string>> commas = {{"LOCPATH", locale.folder},
                                                                     {"LC_ALL", locale.name}};
    for (const char* model : {"pump-cover", "luo-tool-sample"}) {
        std::map<std::string, std::string> first;
        for (const char* threads : {"1", "2", "4", "commas"}) {
            const bool in_commas = std::string(threads) == "commas";
            const std::string out = folder / (std::string(model) + "-" + threads);
            const CommandResult result = slabwright_command(
                {"plan", kData + model + ".stl", "-o", out, "--threads", in_commas ? "2" : threads},
                in_commas ? commas : std::vector<std::pair<std::string, std::string>>{});
            ASSERT_EQ(result.exit, 0) << result.err;
            EXPECT_EQ(result.err, "") << "no progress where there is no terminal";
            const auto files = tree(out);
            EXPECT_TRUE(files.count("plan.json") && files.count("tool.tbl") && files.count("sequence.json"));
            if (first.empty()) {
                first = files;
                continue;
            }
            ASSERT_EQ(files.size(), first.size());
            for (const auto& [name, bytes] : files)
                EXPECT_TRUE(first[name] == bytes) << name << " differs at " << threads;
        }
    }
}

TEST(Command, ProgramsOfAPlanPassTheInterpreter) {
    TemporaryFolder folder;
    const std::string out = folder / "out";
    ASSERT_EQ(slabwright_command({"plan", kData + "luo-tool-sample.stl", "-o", out}).exit, 0);
    const json plan = json::parse(slurp(out + "/plan.json"));
    const std::string table = slurp(out + "/tool.tbl");
    std::size_t programs = 0;
    std::string previous;
    for (const json& layer : plan["layers"])
        for (const json& operation : layer["operations"]) {
            const std::string file = operation["file"];
            EXPECT_LT(previous, file) << "names sort in the order of execution";
            previous = file;
            const support::CanonProgram canon = support::interpret_rs274(slurp(out + "/" + file), table);
            EXPECT_TRUE(canon.ended && canon.clockwise) << file;
            EXPECT_EQ(canon.tool, operation["tool"].get<int>());
            EXPECT_GT(canon.motions.size(), 3u);
            ++programs;
        }
    EXPECT_EQ(programs, plan["totals"]["operations"].get<std::size_t>());
    EXPECT_EQ(programs, static_cast<std::size_t>(
                            std::distance(fs::directory_iterator(out + "/nc"), fs::directory_iterator())));
}

// SLABWRIGHT_SOAK=6 does it for so many seeds, and for larger patterns too.
TEST(Command, PlansPassTheirOwnVerification) {
    // Ribs around bosses, channels hardly wider than the cutter or narrower, drafted walls that go on below a
    // layer.
    const MetrePattern small{.size_mm = 400, .height_mm = 120, .facets = 60000},
        wide{.size_mm = 700, .height_mm = 200, .facets = 400000},
        full{.size_mm = 1160, .height_mm = 300, .facets = 150000};
    std::vector<MetrePattern> patterns;
    if (const char* soak = std::getenv("SLABWRIGHT_SOAK"))
        for (std::uint64_t seed = 1; seed <= std::stoull(soak); ++seed)
            for (const MetrePattern& p : {small, wide, full})
                patterns.push_back(p), patterns.back().seed = seed;
    else
        for (const std::uint64_t seed : {5U, 6U}) patterns.push_back(small), patterns.back().seed = seed;
    TemporaryFolder folder;
    for (const MetrePattern& pattern : patterns) {
        write_metre_pattern(folder / "pattern.stl", pattern);
        const CommandResult result =
            slabwright_command({"plan", folder / "pattern.stl", "-o", folder / "out", "--allow-undercut"});
        const std::string which =
            std::to_string(pattern.size_mm) + " mm, seed " + std::to_string(pattern.seed);
        EXPECT_EQ(result.exit, 0) << which << ": " << result.out << result.err;
        const json verified = json::parse(slurp(folder / "out/verify.json"));
        EXPECT_TRUE(verified["passed"].get<bool>()) << which << ": " << verified["violations"];
        EXPECT_GT(verified["totals"]["within_tolerance_share"].get<double>(), 0.9999) << which;
        fs::remove_all(folder.path / "out");
    }
}

TEST(Command, InterruptStopsWithinHalfASecondAndLeavesNothing) {
    TemporaryFolder folder;
    MetrePattern pattern;
    pattern.size_mm = 1000;
    pattern.height_mm = 200;
    pattern.facets = 600000;
    write_metre_pattern(folder / "big.stl", pattern);
    fs::create_directory(folder.path / "place");
    int interrupted = 0;
    for (const double after : {0.05, 0.3, 0.8, 1.5, 2.5, 4.0}) {
        const CommandResult result =
            slabwright_command({"plan", folder / "big.stl", "-o", folder / "place/a/out", "--allow-undercut",
                                "--accept-weak-joints"},
                               {}, after);
        if (result.after_interrupt == 0) {
            EXPECT_EQ(result.exit, 0) << result.err;
            fs::remove_all(folder.path / "place" / "a");
            continue;
        }
        ++interrupted;
        std::printf("SIGINT after %.2f s: ended %.3f s later\n", after, result.after_interrupt);
        EXPECT_EQ(result.exit, 6) << result.err;
        expect_one_line(result);
        EXPECT_LT(result.after_interrupt, kCancelSeconds);
        EXPECT_TRUE(fs::is_empty(folder.path / "place")) << "nothing half-written stays";
    }
    EXPECT_GE(interrupted, 3) << "the pattern is too small to interrupt its planning";
}

TEST(Command, InspectTellsPeopleAndPrograms) {
    TemporaryFolder folder;
    const CommandResult text = slabwright_command({"inspect", kData + "pump-cover.stl"});
    EXPECT_EQ(text.exit, 0) << text.err;
    EXPECT_NE(text.out.find("200 x 150 x 60 mm"), std::string::npos) << text.out;
    const CommandResult result = slabwright_command({"inspect", kData + "pump-cover.stl", "--json"});
    ASSERT_EQ(result.exit, 0) << result.err;
    const json report = json::parse(result.out);
    EXPECT_EQ(report["schema"], "slabwright.inspect/1");
    EXPECT_TRUE(report["solid"].get<bool>());
    EXPECT_EQ(report["mesh"]["open_edges"]["count"], 0);
    EXPECT_FALSE(report["features"].empty());
    EXPECT_TRUE(report["undercuts"].empty());
    EXPECT_TRUE(report["holes"].empty());

    spit(folder.path / "open.stl", stl_bytes("open", box({0, 0, 0}, {50, 40, 30}, true)));
    const CommandResult open = slabwright_command({"inspect", folder / "open.stl", "--json"});
    ASSERT_EQ(open.exit, 0) << "an open mesh is a finding, not a failure: " << open.err;
    const json open_report = json::parse(open.out);
    EXPECT_FALSE(open_report["solid"].get<bool>());
    EXPECT_EQ(open_report["mesh"]["open_edges"]["count"], 4);

    spit(folder.path / "mushroom.stl", stl_bytes("mushroom", mushroom()));
    const json undercut = json::parse(slabwright_command({"inspect", folder / "mushroom.stl", "--json"}).out);
    ASSERT_EQ(undercut["undercuts"].size(), 1u);
    EXPECT_GT(undercut["undercuts"][0]["height"].get<double>(), 1);
}

TEST(Command, WhatDoesNotReachStdoutIsAnError) {
    TemporaryFolder folder;
    const std::string stl = kData + "half-sphere.stl", out = folder / "out";
    for (const std::vector<std::string>& arguments :
         std::vector<std::vector<std::string>>{{"job", "--defaults"},
                                               {"inspect", stl},
                                               {"inspect", stl, "--json"},
                                               {"--help"},
                                               {"plan", "--help"},
                                               {"--version"},
                                               {"plan", stl, "-o", out, "--no-verify"},
                                               {"plan", stl, "-o", out, "--no-verify", "--json"},
                                               {"verify", out, "--stl", stl}}) {
        std::vector<std::string> all = {"/bin/sh", "-c", "exec \"$@\" >/dev/full", "sh",
                                        support::built_command()};
        all.insert(all.end(), arguments.begin(), arguments.end());
        const CommandResult result = run_command(all);
        EXPECT_EQ(result.exit, 3) << arguments.front() << result.err;
        EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
        EXPECT_NE(result.err.find("standard output"), std::string::npos) << result.err;
    }
}

TEST(Command, NamesGiveATerminalNoCommands) {
    TemporaryFolder folder;
    // Escape, the same as one character of the second set, a backspace, a broken UTF-8 sequence.
    const std::string name =
                          "a\x1b]0;owned\x07"
                          "b\xC2\x9B"
                          "2Jc\bd\x9B"
                          "e\n.stl",
                      stl = folder / name;
    fs::copy_file(kData + "half-sphere.stl", stl);
    spit(folder.path / "job.toml", "[material]\nname = \"x\\u001b[2Jy\\u009b3Jz\"\n");
    for (const std::vector<std::string>& arguments : std::vector<std::vector<std::string>>{
             {"inspect", stl},
             {"inspect", stl, "--json"},
             {"inspect", stl + "\x1b[1m"},
             {"inspect", stl + "\x1b[1m", "--json"},
             {"plan", stl, "-o", folder / "out\x1b[1m\xC2\x9B", "--job", folder / "job.toml", "--no-verify"},
             {"plan", stl, "-o", folder / "out\x1b[1m\xC2\x9B", "--no-verify", "--json"}}) {
        const CommandResult result = slabwright_command(arguments);
        for (const std::string& text : {result.out, result.err}) {
            for (const char c : text)
                EXPECT_TRUE(c == '\n' || !(static_cast<unsigned char>(c) < 0x20 || c == 0x7F)) << text;
            EXPECT_EQ(text.find("\xC2\x9B"), std::string::npos);
            EXPECT_EQ(text.find("\x9B"), std::string::npos);
        }
        EXPECT_FALSE(result.out.empty() && result.err.empty());
    }
}

TEST(Command, AHangUpCancels) {
    TemporaryFolder folder;
    write_metre_pattern(folder / "big.stl", {.size_mm = 1000, .height_mm = 200, .facets = 600'000});
    fs::create_directory(folder.path / "place");
    const std::string line = "exec timeout -s HUP 2 \"$@\"";
    CommandResult result =
        run_command({"/bin/sh", "-c", line, "sh", support::built_command(), "plan", folder / "big.stl", "-o",
                     folder / "place/a/out", "--allow-undercut", "--no-verify"});
    EXPECT_NE(result.err.find("cancelled"), std::string::npos) << result.err;
    EXPECT_TRUE(fs::is_empty(folder.path / "place")) << "nothing half-written stays";
    // Under nohup it goes on.
    result =
        run_command({"/bin/sh", "-c", "trap '' HUP; \"$@\" & sleep 0.3; kill -HUP $!; wait $!", "sh",
                     support::built_command(), "plan", kData + "pump-cover.stl", "-o", folder / "place/out"});
    EXPECT_EQ(result.exit, 0) << result.err;
    EXPECT_NE(result.out.find("layers"), std::string::npos) << result.err;
}

TEST(Command, SliceWritesEveryFormatWhole) {
    TemporaryFolder folder;
    for (const char* ending : {".svg", ".dxf", ".json"}) {
        const std::string out = folder / (std::string("sections") + ending);
        const CommandResult result =
            slabwright_command({"slice", kData + "half-sphere.stl", "--every", "12.5", "-o", out});
        EXPECT_EQ(result.exit, 0) << result.err;
        EXPECT_GT(fs::file_size(out), 1000u);
    }
    // Half a sphere of 50 mm: sections at 12.5, 25 and 37.5, none at the top; areas are those of circles
    // within the facets.
    const json drawing = json::parse(slurp(folder / "sections.json"));
    ASSERT_EQ(drawing["sections"].size(), 3u);
    for (std::size_t i = 0; i < 3; ++i) {
        const double z = 12.5 * static_cast<double>(i + 1);
        EXPECT_EQ(drawing["sections"][i]["z"], z);
        EXPECT_NEAR(drawing["sections"][i]["area_mm2"].get<double>(), 3.14159265 * (2500 - z * z),
                    0.01 * 7854);
    }
    const CommandResult nowhere = slabwright_command(
        {"slice", kData + "half-sphere.stl", "--every", "5", "-o", folder / "no/such/folder.svg"});
    EXPECT_EQ(nowhere.exit, 3);
    expect_one_line(nowhere);
}

TEST(Command, JobDefaultsPlanTheSameAsNoJob) {
    TemporaryFolder folder;
    const CommandResult defaults = slabwright_command({"job", "--defaults"});
    ASSERT_EQ(defaults.exit, 0);
    spit(folder.path / "job.toml", defaults.out);
    ASSERT_EQ(slabwright_command({"plan", kData + "half-sphere.stl", "-o", folder / "a"}).exit, 0);
    const CommandResult with_job = slabwright_command(
        {"plan", kData + "half-sphere.stl", "-o", folder / "b", "--job", folder / "job.toml"});
    ASSERT_EQ(with_job.exit, 0) << with_job.err;
    EXPECT_EQ(tree(folder / "a"), tree(folder / "b"));
}

TEST(Command, SummaryTellsWhatToLoad) {
    TemporaryFolder folder;
    const CommandResult result =
        slabwright_command({"plan", kData + "half-sphere.stl", "-o", folder / "out"});
    ASSERT_EQ(result.exit, 0) << result.err;
    for (const char* wanted :
         {"layers", "min", "slabs", "19 mm MDF", "T4 flat end mill 1 in", "layer   1: 0 to"})
        EXPECT_NE(result.out.find(wanted), std::string::npos) << wanted << "\n" << result.out;
    const CommandResult quiet =
        slabwright_command({"plan", kData + "half-sphere.stl", "-o", folder / "out", "--quiet"});
    EXPECT_EQ(quiet.exit, 0);
    EXPECT_EQ(quiet.out + quiet.err, "");
    const CommandResult as_json =
        slabwright_command({"plan", kData + "half-sphere.stl", "-o", folder / "out", "--json"});
    EXPECT_EQ(json::parse(as_json.out)["layers"], 3);
    const CommandResult coarse =
        slabwright_command({"verify", folder / "out", "--stl", kData + "half-sphere.stl", "--cell", "0.5"});
    EXPECT_EQ(coarse.exit, 0) << coarse.out << coarse.err;
    EXPECT_NE(coarse.out.find("simulated at 0.500 mm"), std::string::npos) << coarse.out;
}
