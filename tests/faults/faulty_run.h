// Commands that the system fails: which of their calls can fail, and runs in which one does (fault_shim.cpp).
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/command.h"
#include "tests/support/files.h"
#include "tests/support/places.h"
#include "tests/support/seed.h"
#include "tests/support/temporary_folder.h"

namespace slabwright::faults {

using Command = std::vector<std::string>;

/// How many more of each kind of fault SLABWRIGHT_SOAK asks for; a million is all that there are.
inline long soak() {
    const char* wanted = std::getenv("SLABWRIGHT_SOAK");
    return wanted != nullptr ? std::strtol(wanted, nullptr, 10) : 0;
}

/// @param fault as SLABWRIGHT_FAULT says it, e.g. "write 17"; "none". One arena, made before anything fails:
/// jemalloc 5.3 dies of a signal where it gets no memory for that of another thread.
inline support::CommandResult run(const Command& command, const std::string& fault,
                                  const std::string& count = {}, const std::string& sites = {}) {
    return support::run_command(command, {{"LD_PRELOAD", support::fault_shim()},
                                          {"MALLOC_CONF", "narenas:1"},
                                          {"SLABWRIGHT_FAULT", fault},
                                          {"SLABWRIGHT_FAULT_COUNT", count},
                                          {"SLABWRIGHT_FAULT_SITES", sites}});
}

/// What of a command can fail: the numbers of its calls by kind. Of allocations, which are 100 000, those
/// that are the first by their way through the code.
inline std::map<std::string, std::vector<long>> calls(const Command& command) {
    const support::TemporaryFolder folder;
    const support::CommandResult good = run(command, "none", folder / "count", folder / "sites");
    EXPECT_EQ(good.exit, 0) << good.err;
    std::map<std::string, std::vector<long>> calls;
    std::string name;
    std::istringstream counts(support::slurp(folder / "count"));
    for (long count = 0; counts >> name >> count;)
        for (long n = 1; n <= std::max(count, 1L); ++n) calls[name].push_back(n);
    std::istringstream sites(support::slurp(folder / "sites"));
    for (long first = 0; sites >> name >> first;)
        if (name == "new") calls[name].push_back(first);
    std::sort(calls["new"].begin(), calls["new"].end());
    return calls;
}

/// All of them, or `most`: one, drawn by chance, of each of so many equal parts, and the last, when all is
/// written and only said.
inline std::vector<long> chosen(const std::vector<long>& all, long most) {
    const auto count = static_cast<long>(all.size());
    if (count <= most) return all;
    static std::mt19937 random(test::seed());
    std::vector<long> some;
    for (long k = 0; k + 1 < most; ++k) {
        const long low = k * count / most, high = (k + 1) * count / most - 1;
        const long at = std::uniform_int_distribution<long>(low, high)(random);
        some.push_back(all[static_cast<std::size_t>(at)]);
    }
    some.push_back(all.back());
    return some;
}

/// An error of ours: 3, 4 or 5, in words, and none that asks to be reported.
inline void expect_clear_error(const support::CommandResult& result, const std::string& what) {
    EXPECT_EQ(result.signal, 0) << what << ": " << result.err;
    EXPECT_TRUE(result.exit >= 3 && result.exit <= 5)
        << what << ": exit " << result.exit << ' ' << result.err;
    EXPECT_FALSE(result.err.empty()) << what;
    EXPECT_EQ(result.err.find("report this"), std::string::npos) << what << ": " << result.err;
}

}  // namespace slabwright::faults
