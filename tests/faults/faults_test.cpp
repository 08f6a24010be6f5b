// io/FORMATS.md, "When the system fails", call by call: disks fill, memory ends, reads come in pieces, clocks
// jump, processes are killed. A sample of each is tried; SLABWRIGHT_SOAK=1000000 tries all.
#include <gtest/gtest.h>
#include <signal.h>

#include <map>
#include <random>
#include <string>
#include <vector>

#include "tests/faults/faulty_run.h"
#include "tests/faults/undertaking.h"

using namespace slabwright;
using namespace slabwright::faults;
using support::CommandResult;

namespace {

using Calls = std::map<std::string, std::vector<long>>;

void fail_calls(const Undertaking& u, const Attempts& attempts, const Calls& calls) {
    std::size_t told = 0, runs = 0;
    for (const char* kind : {"write", "open", "rename", "mkdir", "sync", "close", "read", "map"}) {
        if (std::string_view(kind) == "map" && !u.maps) continue;
        for (const long n : chosen(calls.at(kind), 2 + soak()))
            for (const char* onwards : {"", "+"}) {
                if (*onwards != 0 && (n % 2 == 0 || std::string_view(kind) == "map") && soak() == 0) continue;
                attempts.begin();
                const std::string fault = std::string(kind) + " " + std::to_string(n) + onwards;
                told += attempts.expect_done_or_told(run(attempts.command(), fault), u.name + (", " + fault));
                ++runs;
            }
    }
    std::printf("%s: %zu of %zu faults were told, the others did no harm\n", u.name, told, runs);
    EXPECT_GT(told, 0u);
}

/// The destructor of a nlohmann::json allocates, and nobody can catch what it throws: the process ends as if
/// it were killed.
void end_memory(const Undertaking& u, const Attempts& attempts, const Calls& calls) {
    std::size_t told = 0, runs = 0, ended = 0;
    for (const long n : chosen(calls.at("new"), u.memory + soak())) {
        attempts.begin();
        const std::string what = u.name + (", new " + std::to_string(n));
        const CommandResult result = run(attempts.command(), "new " + std::to_string(n));
        ++runs;
        if (result.signal == SIGABRT) {
            ++ended;
            EXPECT_NE(result.err.find("terminate called"), std::string::npos) << what << result.err;
            attempts.expect_survived(what);
        } else {
            told += attempts.expect_done_or_told(result, what);
        }
    }
    std::printf("%s: %zu of %zu were told, %zu ended the process\n", u.name, told, runs, ended);
    EXPECT_GT(told, 0u);
    EXPECT_LE(10 * ended, runs + 10) << "the process ended where memory ended";
}

void kill(const Undertaking& u, const Attempts& attempts, const Calls& calls) {
    for (const long n : chosen(calls.at("kill"), u.kills + soak())) {
        attempts.begin();
        const CommandResult killed = run(attempts.command(), "kill " + std::to_string(n));
        EXPECT_EQ(killed.signal, SIGKILL) << n << killed.err;
        attempts.expect_survived(u.name + (", killed at change " + std::to_string(n)));
    }
    std::mt19937 random(test::seed());
    for (long k = 0; k < 1 + std::min(soak(), 200L); ++k) {
        attempts.begin();
        const double moment = std::uniform_real_distribution<double>(0, 0.2)(random);
        (void)support::run_command(attempts.command(), {}, moment, SIGKILL);
        attempts.expect_survived(u.name + (", killed after s " + std::to_string(moment)));
    }
}

class Faults : public testing::TestWithParam<Undertaking> {};

}  // namespace

TEST_P(Faults, AreToldAndHarmless) {
    const Undertaking& u = GetParam();
    const Attempts attempts(u);
    const Calls all = calls(attempts.command());
    fail_calls(u, attempts, all);
    end_memory(u, attempts, all);
    kill(u, attempts, all);
    for (const char* fault : {"short", "interrupted", "clock"}) {
        attempts.begin();
        const CommandResult result = run(attempts.command(), fault);
        EXPECT_EQ(result.exit, 0) << fault << ' ' << u.name << ": " << result.err;
        (void)attempts.expect_done_or_told(result, fault);
    }
}

INSTANTIATE_TEST_SUITE_P(Of, Faults, testing::ValuesIn(kUndertakings),
                         [](const auto& which) { return std::string(which.param.name); });
