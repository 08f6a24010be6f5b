// Commands in little of everything: memory, descriptors, disk, environment, rights. They end as ever, or in a
// clear error that changes nothing.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include "tests/faults/undertaking.h"

using namespace slabwright;
using namespace slabwright::faults;
using support::CommandResult;

namespace {

/// A command after some words of a shell, which know the undertaking's folder as $folder.
CommandResult run_after(const std::string& words, const Attempts& attempts, const Command& before = {}) {
    Command command = before;
    const std::string script = "folder='" + attempts.folder() + "'; " + words;
    command.insert(command.end(), {"/bin/bash", "-c", script});
    command.insert(command.end(), attempts.command().begin(), attempts.command().end());
    return support::run_command(command);
}

/// What gives a process file systems of its own; nothing where the machine forbids that.
Command own_mounts() {
    for (const Command& command : {Command{"/usr/bin/unshare", "-m"}, Command{"/usr/bin/unshare", "-Urm"}}) {
        Command tried = command;
        tried.insert(tried.end(), {"/bin/sh", "-c", "mount -t tmpfs -o size=64k none /mnt"});
        if (support::run_command(tried).exit == 0) return command;
    }
    return {};
}

/// The folder on a disk of its own with $spare KiB left, copied there and back.
const std::string kOnASmallDisk =
    "kept=$(mktemp -d); cp -a $folder/. $kept; used=$(find $kept -type f -size +0 -printf '%s\\n' | awk '{n "
    "+= int(($1 + 4095) / 4096) * 4} END {print n}'); "
    "mount -t tmpfs -o size=$((used + spare))k none $folder; cp -a $kept/. $folder; "
    "\"$0\" \"$@\"; status=$?; "
    "rm -rf $kept/*; cp -a $folder/. $kept; umount $folder; "
    "rm -rf $folder/*; cp -a $kept/. $folder; rm -rf $kept; exit $status";

std::vector<Undertaking> all_undertakings() { return {std::begin(kUndertakings), std::end(kUndertakings)}; }

std::vector<Undertaking> some_undertakings() {
    std::vector<Undertaking> some;
    for (const Undertaking& u : kUndertakings)
        for (const std::string_view name : {"plan", "verify", "resume_remake"})
            if (name == u.name) some.push_back(u);
    return some;
}

class SystemLimits : public testing::TestWithParam<Undertaking> {};

}  // namespace

TEST_P(SystemLimits, OfProcessesAreKeptOrTold) {
    const Attempts attempts(GetParam());
    for (const char* limit :
         {"ulimit -n 16", "ulimit -n 7", "ulimit -v 524288", "ulimit -v 300000", "ulimit -v 200000",
          "ulimit -f 10", "ulimit -s 256", "unset HOME PATH TMPDIR"}) {
        attempts.begin();
        const CommandResult result = run_after(std::string(limit) + "; exec \"$0\" \"$@\"", attempts);
        if (result.exit == 127 || result.signal == SIGABRT) {
            // Before anything of ours runs: the linker's own word, or log4cplus (OpenVDB's), which wants
            // threads.
            EXPECT_TRUE(result.err.find("error while loading shared libraries") != std::string::npos ||
                        result.err.find("Resource temporarily unavailable") != std::string::npos)
                << limit << result.err;
            attempts.expect_survived(limit);
            continue;
        }
        (void)attempts.expect_done_or_told(result, limit);
    }
}

TEST_P(SystemLimits, FullDisksAndThoseThatCannotBeWrittenAreTold) {
    const Command mounts = own_mounts();
    if (mounts.empty()) GTEST_SKIP() << "this machine gives nobody file systems of his own";
    const Attempts attempts(GetParam());
    const CommandResult read_only =
        run_after("mount --bind $folder $folder && mount -o remount,bind,ro $folder && exec \"$0\" \"$@\"",
                  attempts, mounts);
    EXPECT_TRUE(attempts.expect_done_or_told(read_only, "read only"));
    EXPECT_EQ(read_only.exit, 3) << read_only.err;
    int told = 0;
    for (const int spare_kib : {0, 16, 64}) {
        attempts.begin();
        const CommandResult full =
            run_after("spare=" + std::to_string(spare_kib) + "; " + kOnASmallDisk, attempts, mounts);
        told += attempts.expect_done_or_told(full, std::to_string(spare_kib) + " KiB left");
    }
    EXPECT_GT(told, 0);
}

// One that makes a folder, one that replaces files and one that does both; SLABWRIGHT_SOAK=1 tries all.
INSTANTIATE_TEST_SUITE_P(Of, SystemLimits,
                         testing::ValuesIn(soak() > 0 ? all_undertakings() : some_undertakings()),
                         [](const auto& which) { return std::string(which.param.name); });
