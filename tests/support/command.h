// Runs the built command as a user's shell would, with its output caught and its time taken.
#pragma once

#include <fcntl.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/temporary_folder.h"

namespace slabwright::support {

struct CommandResult {
    int exit = -1;   ///< −1 when a signal ended it
    int signal = 0;  ///< that signal
    std::string out, err;
    double seconds = 0;            ///< from start to end
    double after_interrupt = 0;    ///< from the signal that was sent to the end; 0 when it had ended before
    std::uint64_t peak_bytes = 0;  ///< of memory, mapped files too
};

/// Whether a process has a handler for a signal, as Linux tells: from then on the signal does not just end
/// it.
inline bool catches(pid_t process, int signal) {
    std::ifstream status("/proc/" + std::to_string(process) + "/status");
    for (std::string line; std::getline(status, line);)
        if (line.rfind("SigCgt:", 0) == 0)
            return (std::stoull(line.substr(7), nullptr, 16) >> (signal - 1) & 1) != 0;
    return false;
}

/// @param interrupt_after seconds from when the command handles `interrupt_by` until it is sent; negative:
/// never. A loaded machine takes half a second to load the command's libraries, before it can have a handler.
inline CommandResult run_command(const std::vector<std::string>& arguments,
                                 const std::vector<std::pair<std::string, std::string>>& environment = {},
                                 double interrupt_after = -1, int interrupt_by = SIGINT) {
    using Clock = std::chrono::steady_clock;
    const TemporaryFolder temporary;
    const std::string out_name = temporary / "out", err_name = temporary / "err";
    const int out = ::open(out_name.c_str(), O_RDWR | O_CREAT | O_EXCL, 0600),
              err = ::open(err_name.c_str(), O_RDWR | O_CREAT | O_EXCL, 0600);
    if (out < 0 || err < 0) throw std::runtime_error("no temporary files");
    const auto begin = Clock::now();
    const pid_t child = ::fork();
    if (child < 0) throw std::runtime_error("cannot fork");
    if (child == 0) {
        ::dup2(::open("/dev/null", O_RDONLY), 0);
        ::dup2(out, 1);
        ::dup2(err, 2);
        for (const auto& [key, value] : environment) ::setenv(key.c_str(), value.c_str(), 1);
        std::vector<char*> argv;
        for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
        argv.push_back(nullptr);
        ::execv(argv[0], argv.data());
        ::_exit(127);
    }
    const auto since = [](Clock::time_point then) {
        return std::chrono::duration<double>(Clock::now() - then).count();
    };
    CommandResult result;
    int status = 0;
    bool interrupted = false;
    Clock::time_point interrupt{}, ready{};
    rusage used{};
    while (::wait4(child, &status, WNOHANG, &used) == 0) {
        if (interrupt_after >= 0 && ready == Clock::time_point{} && catches(child, interrupt_by))
            ready = Clock::now();
        if (ready != Clock::time_point{} && !interrupted && since(ready) >= interrupt_after) {
            interrupted = true;
            interrupt = Clock::now();
            ::kill(child, interrupt_by);
        }
        ::usleep(2000);
    }
    result.seconds = since(begin);
    result.peak_bytes = static_cast<std::uint64_t>(used.ru_maxrss) * 1024;
    if (interrupted) result.after_interrupt = since(interrupt);
    if (WIFEXITED(status)) result.exit = WEXITSTATUS(status);
    if (WIFSIGNALED(status)) result.signal = WTERMSIG(status);
    const auto slurp = [](const std::string& name) {
        std::ifstream in(name, std::ios::binary);
        std::ostringstream text;
        text << in.rdbuf();
        return text.str();
    };
    result.out = slurp(out_name);
    result.err = slurp(err_name);
    ::close(out);
    ::close(err);
    return result;
}

}  // namespace slabwright::support
