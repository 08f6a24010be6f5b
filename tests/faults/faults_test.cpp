// What io/FORMATS.md promises of files when the system fails: disks fill, memory ends, reads come in pieces,
// clocks jump, processes are killed. tests/faults/fault_shim.cpp makes it fail.
#include <gtest/gtest.h>
#include <signal.h>

#include <filesystem>
#include <map>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "io/write/stl_writer.h"
#include "kernels/mesh/weld.h"
#include "tests/mesh_shapes.h"
#include "tests/support/command.h"
#include "tests/support/files.h"
#include "tests/support/seed.h"
#include "tests/support/temporary_folder.h"

using namespace slabwright;
using support::CommandResult;
using support::TemporaryFolder;
using Tree = std::map<std::string, std::string>;

namespace {

std::size_t soak() {
    const char* wanted = std::getenv("SLABWRIGHT_SOAK");
    return wanted != nullptr ? std::strtoul(wanted, nullptr, 10) : 0;
}

/// A plate with a boss, planned in a tenth of a second.
struct Bench {
    TemporaryFolder folder;
    std::string part = folder / "part.stl", out = folder / "out";

    explicit Bench(float height = 20) {
        Context context;
        shapes::Facets facets = shapes::box({0, 0, 0}, {30, 20, 8});
        shapes::append(facets, shapes::box({8, 6, 6}, {20, 14, height}));
        write_stl(part, weld(context, facets));
    }
    [[nodiscard]] std::vector<std::string> plan() const {
        return {SLABWRIGHT_COMMAND, "plan", part, "-o", out, "--quiet", "--threads", "1"};
    }
    [[nodiscard]] std::vector<std::string> verify() const {
        return {SLABWRIGHT_COMMAND, "verify", out, "--stl", part, "--threads", "1"};
    }
    [[nodiscard]] std::vector<std::string> report() const {
        return {SLABWRIGHT_COMMAND, "report", out, "--stl", part, "--threads", "1"};
    }
    /// Names beside part and OUT.
    [[nodiscard]] std::string strangers() const {
        std::string names;
        for (const auto& entry : std::filesystem::directory_iterator(folder.path)) {
            const std::string name = entry.path().filename().string();
            if (name != "part.stl" && name != "out") names += name + " ";
        }
        return names;
    }
};

CommandResult run(const std::vector<std::string>& command, const std::string& fault,
                  const std::string& count = {}) {
    return support::run_command(command, {{"LD_PRELOAD", SLABWRIGHT_FAULT_SHIM},
                                          {"SLABWRIGHT_FAULT", fault},
                                          {"SLABWRIGHT_FAULT_COUNT", count}});
}

/// How often a command calls what can fail.
std::map<std::string, long> calls(const std::vector<std::string>& command) {
    const TemporaryFolder folder;
    const CommandResult good = run(command, "none", folder / "count");
    EXPECT_EQ(good.exit, 0) << good.err;
    std::istringstream in(support::slurp(folder / "count"));
    std::map<std::string, long> counts;
    std::string name;
    for (long count = 0; in >> name >> count;) counts[name] = count;
    return counts;
}

/// All of 1 … count, or as many of them as there is time for: the first and last few, and some between.
std::vector<long> chosen(long count, long most) {
    std::vector<long> all;
    if (count <= most) {
        for (long n = 1; n <= count; ++n) all.push_back(n);
        return all;
    }
    std::mt19937 random(test::seed());
    for (long k = 0; k < most; ++k) {
        const long low = 1 + k * count / most, high = (k + 1) * count / most;
        all.push_back(std::uniform_int_distribution<long>(low, std::max(low, high))(random));
    }
    return all;
}

void expect_one_clear_line(const CommandResult& result, const std::string& what) {
    EXPECT_EQ(result.signal, 0) << what;
    EXPECT_TRUE(result.exit >= 3 && result.exit <= 5)
        << what << ": exit " << result.exit << ' ' << result.err;
    const std::string& err = result.err;
    EXPECT_FALSE(err.empty()) << what;
    EXPECT_EQ(err.find("report this"), std::string::npos) << what << ": " << err;
}

/// A command that changes OUT from `before` to `after` is run with each fault: it does so, or fails with a
/// clear line and changes nothing.
void expect_all_or_nothing(const Bench& bench, const std::vector<std::string>& command, const Tree& before,
                           const Tree& after, const std::vector<std::string>& kinds, long most) {
    const auto restore = [&] {
        std::filesystem::remove_all(bench.out);
        for (const auto& [name, text] : before) {
            const std::filesystem::path path = std::filesystem::path(bench.out) / name;
            std::filesystem::create_directories(path.parent_path());
            if (name == "nc") {
                std::filesystem::create_directories(path);
            } else {
                support::spit(path, text);
            }
        }
    };
    restore();
    const std::map<std::string, long> counts = calls(command);
    std::size_t told = 0, runs = 0, ended = 0;
    for (const std::string& kind : kinds) {
        for (const long n : chosen(counts.at(kind), most + static_cast<long>(soak()))) {
            restore();
            const std::string what = command[1] + ", " + kind + " " + std::to_string(n);
            const CommandResult result = run(command, kind + " " + std::to_string(n));
            ++runs;
            if (kind == "new" && result.signal == SIGABRT) {
                // The destructor of a nlohmann::json allocates, and nobody can catch what it throws: as after
                // SIGKILL, OUT is one of the two, and the next plan clears away the rest.
                ++ended;
                EXPECT_NE(result.err.find("bad_alloc"), std::string::npos) << what << result.err;
                const Tree now = support::tree(bench.out);
                EXPECT_TRUE(now == before || now == after) << what << ": OUT is changed";
                EXPECT_EQ(run(command, "none").exit, 0) << what;
            }
            EXPECT_EQ(bench.strangers(), "") << what;
            if (kind == "new" && result.signal == SIGABRT) continue;
            if (result.exit == 0) {
                EXPECT_TRUE(support::tree(bench.out) == after) << what << ": another result, exit 0";
                continue;
            }
            ++told;
            expect_one_clear_line(result, what);
            EXPECT_TRUE(support::tree(bench.out) == before) << what << ": OUT is changed";
        }
    }
    std::printf("%s: %zu of %zu faults were told, the others did no harm\n", command[1].c_str(), told, runs);
    EXPECT_GT(told, 0u);
    EXPECT_LE(10 * ended, runs) << "the process ended where memory ended";
}

}  // namespace

TEST(Faults, APlanIsWholeOrThereIsNone) {
    const Bench bench;
    ASSERT_EQ(run(bench.plan(), "none").exit, 0);
    const Tree whole = support::tree(bench.out);
    expect_all_or_nothing(bench, bench.plan(), {}, whole,
                          {"write", "open", "rename", "mkdir", "sync", "read"}, 8);
}

TEST(Faults, AnOldPlanStaysUntilTheNewOneIsWhole) {
    const Bench old(14), bench;
    ASSERT_EQ(run(old.plan(), "none").exit, 0);
    const Tree before = support::tree(old.out);
    ASSERT_EQ(run(bench.plan(), "none").exit, 0);
    expect_all_or_nothing(bench, bench.plan(), before, support::tree(bench.out),
                          {"write", "open", "rename", "mkdir"}, 5);
}

TEST(Faults, VerifyAndReportReplaceAFileOrLeaveIt) {
    const Bench bench;
    ASSERT_EQ(run(bench.plan(), "none").exit, 0);
    ASSERT_EQ(run(bench.verify(), "none").exit, 0);
    const Tree whole = support::tree(bench.out);
    Tree before = whole;
    before["verify.json"] = "{}\n";
    before.erase("report.html");  // or verify would make it again
    Tree after = whole;
    after.erase("report.html");
    expect_all_or_nothing(bench, bench.verify(), before, after, {"write", "open", "rename", "read"}, 6);
    if (whole.count("report.html") == 0) return;  // built without the page
    before = whole;
    before["report.html"] = "<html>slabwright</html>\n";
    expect_all_or_nothing(bench, bench.report(), before, whole, {"write", "open", "rename", "read"}, 4);
}

TEST(Faults, MemoryThatEndsIsAClearError) {
    const Bench bench;
    ASSERT_EQ(run(bench.plan(), "none").exit, 0);
    const Tree whole = support::tree(bench.out);
    expect_all_or_nothing(bench, bench.plan(), {}, whole, {"new"}, 40);
}

TEST(Faults, PiecesInterruptionsAndClocksChangeNothing) {
    const Bench bench;
    ASSERT_EQ(run(bench.plan(), "none").exit, 0);
    const Tree whole = support::tree(bench.out);
    for (const char* fault : {"short", "interrupted", "clock"})
        for (const auto& command : {bench.plan(), bench.verify(), bench.report()}) {
            const CommandResult result = run(command, fault);
            EXPECT_EQ(result.exit, 0) << fault << ' ' << command[1] << ": " << result.err;
            EXPECT_TRUE(support::tree(bench.out) == whole) << fault << ' ' << command[1];
        }
}

TEST(Faults, AKilledPlanLeavesTheOldOneOrTheNewOne) {
    const Bench old(14), bench;
    ASSERT_EQ(run(old.plan(), "none").exit, 0);
    const Tree before = support::tree(old.out);
    ASSERT_EQ(run(bench.plan(), "none").exit, 0);
    const Tree after = support::tree(bench.out);
    const long changes = calls(bench.plan()).at("kill");
    for (const long n : chosen(changes, 16 + static_cast<long>(soak()))) {
        const Bench fresh;  // beside another OUT, so that what remains is this process's
        std::filesystem::copy(old.out, fresh.out, std::filesystem::copy_options::recursive);
        const CommandResult killed = run(fresh.plan(), "kill " + std::to_string(n));
        if (killed.exit == 0) continue;  // it was done before
        EXPECT_EQ(killed.signal, SIGKILL) << n;
        const Tree now = support::tree(fresh.out);
        EXPECT_TRUE(now == before || now == after) << "killed at change " << n;
        const CommandResult again = run(fresh.plan(), "none");
        EXPECT_EQ(again.exit, 0) << n << ": " << again.err;
        EXPECT_TRUE(support::tree(fresh.out) == after) << n;
        EXPECT_EQ(fresh.strangers(), "") << "after a kill at change " << n;
    }
}

TEST(Faults, LimitsOfTheSystemAreKeptOrTold) {
    const Bench bench;
    ASSERT_EQ(run(bench.plan(), "none").exit, 0);
    const Tree whole = support::tree(bench.out);
    for (const char* limit :
         {"ulimit -n 16", "ulimit -v 524288", "ulimit -f 10", "ulimit -s 256", "unset HOME PATH TMPDIR"}) {
        const Bench fresh;
        std::vector<std::string> command = {"/bin/bash", "-c", std::string(limit) + "; exec \"$0\" \"$@\""};
        for (const std::string& word : fresh.plan()) command.push_back(word);
        const CommandResult result = support::run_command(command);
        EXPECT_EQ(fresh.strangers(), "") << limit;
        if (result.exit == 0) {
            EXPECT_TRUE(support::tree(fresh.out) == whole) << limit;
        } else {
            expect_one_clear_line(result, limit);
            EXPECT_TRUE(support::tree(fresh.out).empty()) << limit;
        }
    }
}
