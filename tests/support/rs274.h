// LinuxCNC's interpreter as the judge of programs: runs `rs274` (Debian's linuxcnc-uspace) and reads its
// canonical motions.
#pragma once

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "tests/support/temporary_folder.h"

namespace slabwright::support {

/// Where a motion ends, mm; an arc in the XY plane is one motion; `feed` is the rate in force (mm/min), 0 for
/// a rapid.
struct CanonMotion {
    double x = 0, y = 0, z = 0;
    bool rapid = false;
    double feed = 0;
};

/// What the interpreter made of a program, beside its motions.
struct CanonProgram {
    std::vector<CanonMotion> motions;
    int tool = 0;            ///< last SELECT_TOOL
    double spindle_rpm = 0;  ///< last SET_SPINDLE_SPEED
    double dwell_s = 0;      ///< sum
    bool clockwise = false;  ///< the spindle was started clockwise
    bool ended = false;      ///< PROGRAM_END was reached
    int arcs = 0;            ///< ARC_FEED calls
    std::string text;        ///< the canonical calls as printed
};

/// The numbers in brackets of one canonical call, e.g. "STRAIGHT_FEED(1.0000, 2.0000, …)".
inline std::vector<double> canon_numbers(std::string_view arguments) {
    std::vector<double> numbers;
    for (std::size_t i = 0; i < arguments.size();) {
        double value = 0;
        const auto result = std::from_chars(arguments.data() + i, arguments.data() + arguments.size(), value);
        if (result.ec == std::errc()) {
            numbers.push_back(value);
            i = static_cast<std::size_t>(result.ptr - arguments.data());
        } else {
            ++i;
        }
    }
    return numbers;
}

/// Interprets a program's text with a tool table's text. @throws std::runtime_error with the interpreter's
/// own words when it refuses the program or is not installed
inline CanonProgram interpret_rs274(std::string_view program, std::string_view tool_table) {
    namespace fs = std::filesystem;
    const TemporaryFolder temporary;
    const std::string folder = temporary.path.string();
    std::ofstream(folder + "/in.ngc", std::ios::binary) << program;
    std::ofstream(folder + "/tool.tbl", std::ios::binary) << tool_table;
    // The interpreter keeps its tools in $HOME/.tool.mmap: two at once in one home die of bus errors.
    const std::string command =
        "cd '" + folder + "' && HOME=\"$PWD\" rs274 -g -t tool.tbl in.ngc out.txt </dev/null >log.txt 2>&1";
    const int status = std::system(command.c_str());
    const auto slurp = [&](const char* name) {
        std::ifstream in(folder + "/" + name, std::ios::binary);
        std::ostringstream text;
        text << in.rdbuf();
        return text.str();
    };
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
        if (WIFEXITED(status) && WEXITSTATUS(status) == 127)
            throw std::runtime_error("rs274 is missing: install linuxcnc-uspace");
        throw std::runtime_error("rs274 refuses the program: " + slurp("log.txt"));
    }
    CanonProgram canon;
    canon.text = slurp("out.txt");
    double feed = 0;
    const std::string_view all = canon.text;
    for (std::size_t begin = 0; begin < all.size();) {
        const std::size_t end = std::min(all.find('\n', begin), all.size());
        const std::string_view line = all.substr(begin, end - begin);
        begin = end + 1;
        const std::size_t dots = line.find("N..... "), open = line.find('(');
        if (dots == std::string_view::npos || open == std::string_view::npos) continue;
        const std::string_view call = line.substr(dots + 7, open - dots - 7);
        if (call == "COMMENT" || call == "MESSAGE") continue;
        const std::vector<double> n = canon_numbers(line.substr(open));
        if (call == "STRAIGHT_TRAVERSE") canon.motions.push_back({n.at(0), n.at(1), n.at(2), true, 0});
        else if (call == "STRAIGHT_FEED") canon.motions.push_back({n.at(0), n.at(1), n.at(2), false, feed});
        else if (call == "SET_FEED_RATE") feed = n.at(0);
        else if (call == "SELECT_TOOL") canon.tool = static_cast<int>(n.at(0));
        else if (call == "SET_SPINDLE_SPEED") canon.spindle_rpm = n.at(1);
        else if (call == "START_SPINDLE_CLOCKWISE") canon.clockwise = true;
        else if (call == "DWELL") canon.dwell_s += n.at(0);
        else if (call == "ARC_FEED") {
            ++canon.arcs;
            canon.motions.push_back({n.at(0), n.at(1), n.at(5), false, feed});
        } else if (call == "PROGRAM_END") canon.ended = true;
    }
    return canon;
}

/// Just the motions.
inline std::vector<CanonMotion> run_rs274(std::string_view program, std::string_view tool_table) {
    return interpret_rs274(program, tool_table).motions;
}

}  // namespace slabwright::support
