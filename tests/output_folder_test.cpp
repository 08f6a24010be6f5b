// What plan, verify and report may touch on the disk, and what is left when they fail.
#include "io/write/output_folder.h"
#include "io/slabwright.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "io/write/output_file.h"
#include "kernels/errors.h"
#include "tests/support/command.h"
#include "tests/support/files.h"
#include "tests/support/places.h"
#include "tests/support/temporary_folder.h"

using namespace slabwright;
using slabwright::support::CommandResult;
using slabwright::support::run_command;
using slabwright::support::slurp;
using slabwright::support::spit;
using slabwright::support::TemporaryFolder;
using slabwright::support::tree;
namespace fs = std::filesystem;

namespace {

const std::string kStl = support::checkout("tests/data/half-sphere.stl");

/// A plan folder with two programs, as far as a replacement looks at it.
void write_plan_folder(const fs::path& out) {
    fs::create_directories(out / "nc");
    spit(out / "plan.json",
         R"({"schema": "slabwright.plan/1", "layers": [{"operations": [{"file": "nc/L1_01_face_T1.ngc"}]},
             {"operations": [{"file": "nc/L2_01_face_T1.ngc"}]}]})");
    for (const char* name :
         {"tool.tbl", "sequence.json", "report.html", "verify.json", "cut_list.csv", "cut_list.dxf"})
        spit(out / name, "x");
    for (const char* name : {"L1_01_face_T1.ngc", "L2_01_face_T1.ngc"}) spit(out / "nc" / name, "M2\n");
}

/// The refusal of a folder; an empty text where it may be replaced.
std::string refusal(const fs::path& out) {
    try {
        require_replaceable(out.string());
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::input);
        EXPECT_FALSE(error.remedy().empty());
        return error.what();
    }
    return "";
}

CommandResult slabwright_command(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), support::built_command());
    return run_command(arguments);
}

/// Hidden names in a folder: what was under way there.
std::vector<std::string> hidden(const fs::path& folder) {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder))
        if (const std::string name = entry.path().filename().string(); name.front() == '.')
            names.push_back(name);
    return names;
}

}  // namespace

TEST(OutputFolder, OnlyWhatAPlanFolderHoldsIsReplaced) {
    TemporaryFolder folder;
    const fs::path out = folder.path / "out", elsewhere = folder.path / "elsewhere";
    fs::create_directory(elsewhere);
    spit(elsewhere / "L1_01_face_T1.ngc", "somebody's");
    const std::vector<std::pair<std::string, std::function<void(const fs::path&)>>> kinds = {
        {"file", [](const fs::path& p) { spit(p, "somebody's"); }},
        {"folder",
         [](const fs::path& p) {
             fs::create_directory(p);
             spit(p / "deep", "somebody's");
         }},
        {"link", [&](const fs::path& p) { fs::create_symlink(elsewhere / "L1_01_face_T1.ngc", p); }},
        {"link to a folder", [&](const fs::path& p) { fs::create_directory_symlink(elsewhere, p); }},
        {"pipe", [](const fs::path& p) { ASSERT_EQ(::mkfifo(p.c_str(), 0600), 0); }}};
    const std::vector<std::string> places = {"plan.json",
                                             "tool.tbl",
                                             "sequence.json",
                                             "report.html",
                                             "verify.json",
                                             "nc",
                                             "notes",
                                             "nc/notes",
                                             "nc/mine.ngc",
                                             "nc/L1_01_face_T1.ngc",
                                             "maps",
                                             ".partial-1-2",
                                             ".plan.json.partial-1",
                                             "nc/.hidden",
                                             "verify.json.partial"};
    for (const std::string& place : places)
        for (const auto& [kind, make] : kinds) {
            fs::remove_all(out);
            write_plan_folder(out);
            ASSERT_EQ(refusal(out), "");
            const bool known = fs::exists(out / place);
            fs::remove_all(out / place);
            make(out / place);
            if (known && kind == "file" && place != "plan.json" && place != "nc") {
                EXPECT_EQ(refusal(out), "") << place;
                continue;
            }
            const auto before = tree(folder.path);
            const std::string told = refusal(out);
            EXPECT_NE(told, "") << kind << " at " << place;
            if (place != "plan.json") {
                EXPECT_NE(told.find(place), std::string::npos) << told;
                EXPECT_NE(told.find("move that away"), std::string::npos) << told;
            }
            EXPECT_EQ(tree(folder.path), before) << "a refusal changes nothing";
        }
    EXPECT_EQ(slurp(elsewhere / "L1_01_face_T1.ngc"), "somebody's");
}

TEST(OutputFolder, WhatComesIntoItWhileThePlanIsMadeIsNotLost) {
    TemporaryFolder folder;
    const fs::path out = folder.path / "out";
    write_plan_folder(out);
    OutputFolder fresh(out.string());
    write_file_in(fresh.path(), "plan.json", "new");
    spit(out / "nc" / "mine.ngc", "somebody's");
    EXPECT_THROW(fresh.commit(), Error);
    EXPECT_EQ(slurp(out / "nc" / "mine.ngc"), "somebody's");
    fs::remove(out / "nc" / "mine.ngc");
    fresh.commit();
    EXPECT_EQ(tree(out).size(), 1u);
    EXPECT_TRUE(hidden(folder.path).empty());
}

TEST(OutputFolder, OurOwnLeftoversAreKnown) {
    TemporaryFolder folder;
    const fs::path out = folder.path / "out";
    write_plan_folder(out);
    for (const char* name : {"verify.json.part", ".verify.json.partial-4711-0", ".report.html.partial-1-12"})
        spit(out / name, "half");
    EXPECT_EQ(refusal(out), "");
}

TEST(OutputFolder, PlacesThatCannotTakeAPlanAreToldAtOnce) {
    TemporaryFolder folder;
    EXPECT_NE(refusal("/proc").find("mounted"), std::string::npos) << refusal("/proc");
    EXPECT_NE(refusal("/"), "");
    EXPECT_NE(refusal(folder / std::string(300, 'n')), "");
    EXPECT_NE(refusal(folder / ("a/b/" + std::string(300, 'n'))), "");
    EXPECT_NE(refusal("/proc/nowhere/out"), "");
    EXPECT_EQ(refusal(folder / std::string(240, 'n')), "");
    EXPECT_TRUE(fs::is_empty(folder.path)) << "asking leaves nothing";
    OutputFolder longest(folder / std::string(255, 'n'));
    write_file_in(longest.path(), "plan.json", "x");
    longest.commit();
    EXPECT_EQ(slurp(folder.path / std::string(255, 'n') / "plan.json"), "x");
}

TEST(OutputFolder, TheRemainsOfDeadProcessesGoOthersStay) {
    TemporaryFolder folder;
    const fs::path out = folder.path / "out";
    const pid_t child = ::fork();
    if (child == 0) {
        OutputFolder fresh(out.string());
        fs::create_directory(fresh.path() / "nc");
        spit(fresh.path() / "nc" / "L1_01_face_T1.ngc", "half");
        spit(fresh.path() / "nc" / ".L2_01_face_T1.ngc.partial-7-7", "half");
        ::kill(::getpid(), SIGKILL);
    }
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status));
    ASSERT_EQ(hidden(folder.path).size(), 1u);
    const fs::path dead = folder.path / hidden(folder.path).front();
    // Somebody's folder of a like name; one whose process lives; one that holds what is not ours.
    const std::string process = std::to_string(child);
    fs::create_directory(folder.path / (".other.partial-" + process + "-0"));
    fs::create_directory(folder.path / (".out.partial-" + process));
    fs::create_directory(folder.path / (".out.partial-" + std::to_string(::getppid()) + "-0"));
    fs::create_directory(folder.path / (".out.partial-" + process + "-99"));
    spit(folder.path / (".out.partial-" + process + "-99") / "letter", "somebody's");
    {
        const OutputFolder living(out.string());
        EXPECT_FALSE(fs::exists(dead));
        EXPECT_EQ(hidden(folder.path).size(), 5u);
        EXPECT_EQ(refusal(out), "");
        EXPECT_TRUE(fs::exists(living.path())) << "this one is under way";
    }
    EXPECT_EQ(hidden(folder.path).size(), 4u);
}

TEST(OutputFile, NothingIsWrittenThroughALink) {
    TemporaryFolder folder;
    spit(folder.path / "victim", "precious");
    fs::create_symlink(folder.path / "victim", folder.path / "report.html");
    write_file_in(folder.path, "report.html", "page");
    EXPECT_EQ(slurp(folder.path / "victim"), "precious");
    EXPECT_FALSE(fs::is_symlink(folder.path / "report.html"));
    EXPECT_EQ(slurp(folder.path / "report.html"), "page");
    // Where the user names a link himself, what it leads to is what he means.
    fs::create_symlink(folder.path / "victim", folder.path / "drawing");
    write_file_whole(folder / "drawing", "lines");
    EXPECT_EQ(slurp(folder.path / "victim"), "lines");
    EXPECT_TRUE(fs::is_symlink(folder.path / "drawing"));
    EXPECT_TRUE(hidden(folder.path).empty());
}

TEST(OutputFile, DevicesAndFoldersAreNotReplaced) {
    TemporaryFolder folder;
    ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
    fs::create_directory(folder.path / "taken");
    for (const char* name : {"pipe", "taken"}) {
        EXPECT_THROW(write_file_in(folder.path, name, "x"), Error) << name;
        EXPECT_THROW(write_file_whole(folder / name, "x"), Error) << name;
    }
    EXPECT_THROW(write_file_whole("/dev/null", "x"), Error);
    EXPECT_TRUE(hidden(folder.path).empty());
}

TEST(OutputFolder, VerifyAndReportTouchNothingElse) {
    TemporaryFolder folder;
    const std::string out = folder / "out";
    CommandResult made = slabwright_command({"plan", kStl, "-o", out, "--quiet"});
    ASSERT_EQ(made.exit, 0) << made.err;
    const auto sound = tree(out);
    // A plan folder from a stranger: the names that we write lead to files of the user.
    spit(folder.path / "victim", "precious");
    for (const char* name : {"verify.json", "verify.json.part", "report.html", ".verify.json.partial-1-0"}) {
        fs::remove(fs::path(out) / name);
        fs::create_symlink(folder.path / "victim", fs::path(out) / name);
    }
    ASSERT_EQ(slabwright_command({"verify", out, "--stl", kStl}).exit, 0);
    const CommandResult report = slabwright_command({"report", out, "--stl", kStl});
    EXPECT_EQ(slurp(folder.path / "victim"), "precious");
    EXPECT_EQ(slurp(fs::path(out) / "verify.json"), sound.at("verify.json"));
    EXPECT_EQ(report.exit != 0, fs::is_symlink(fs::path(out) / "report.html")) << report.err;
    for (const char* name : {"verify.json.part", ".verify.json.partial-1-0"})
        fs::remove(fs::path(out) / name);
    fs::remove(fs::path(out) / "report.html");

    // A full disk, played by a limit on the length of files: what was there stays, and nothing beside it.
    const auto before = tree(out);
    const CommandResult full = run_command({"/bin/sh", "-c", "trap '' XFSZ; ulimit -f 1; exec \"$@\"", "sh",
                                            support::built_command(), "verify", out, "--stl", kStl});
    EXPECT_EQ(full.exit, 3) << full.out << full.err;
    EXPECT_NE(full.err.find("verify.json"), std::string::npos) << full.err;
    EXPECT_EQ(tree(out), before);
    made = slabwright_command({"plan", kStl, "-o", out, "--quiet", "--no-verify"});
    EXPECT_EQ(made.exit, 0) << made.err;
}

TEST(OutputFolder, AKilledPlanIsClearedAwayByTheNext) {
    TemporaryFolder folder;
    const std::string out = folder / "out";
    const std::vector<std::string> arguments = {
        support::built_command(), "plan", kStl, "-o", out, "--no-verify"};
    bool caught = false;
    for (int attempt = 0; attempt < 20 && !caught; ++attempt) {
        const pid_t child = ::fork();
        if (child == 0) {
            std::vector<char*> argv;
            for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
            argv.push_back(nullptr);
            ::execv(argv[0], argv.data());
            ::_exit(127);
        }
        // It is killed as soon as its folder is seen.
        for (int status = 0; ::waitpid(child, &status, WNOHANG) == 0;) {
            if (!hidden(folder.path).empty()) ::kill(child, SIGKILL);
        }
        caught = !hidden(folder.path).empty();
    }
    ASSERT_TRUE(caught) << "no plan was killed while its folder was under way";
    const CommandResult made = run_command(arguments);
    EXPECT_EQ(made.exit, 0) << made.err;
    EXPECT_TRUE(hidden(folder.path).empty());
}
