// GRBL programs as another interpreter runs them: gcode-toolpath of npm, which CNCjs shows programs by.
#pragma once

#include <cmath>
#include <filesystem>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "engine/plan.h"
#include "io/posts/program_grid.h"
#include "tests/support/command.h"
#include "tests/support/files.h"
#include "tests/support/places.h"
#include "tests/support/temporary_folder.h"

namespace slabwright::support {

struct ToolpathMotion {
    std::string word;  ///< G0 to G3
    int tool = 0;
    double x = 0, y = 0, z = 0;  ///< mm, its end
    double cx = 0, cy = 0;       ///< of an arc
};

inline const std::string kNodeModules = support::checkout("io/report/node_modules");

/// Whether node and gcode-toolpath are there; tools/setup fetches it.
inline bool has_grbl_toolpath() {
    return std::filesystem::exists(kNodeModules + "/gcode-toolpath/package.json") &&
           run_command({"/usr/bin/env", "node", "--version"}).exit == 0;
}

/// @param texts of programs by file name. @returns what each does; empty where node fails
inline std::map<std::string, std::vector<ToolpathMotion>> grbl_toolpaths(
    const std::map<std::string, std::string>& texts) {
    const TemporaryFolder folder;
    std::vector<std::string> command{"/usr/bin/env", "node",
                                     support::checkout("tests/posts/grbl_toolpath.mjs"), kNodeModules};
    for (const auto& [file, text] : texts) {
        spit(folder / file, text);
        command.push_back(folder / file);
    }
    std::map<std::string, std::vector<ToolpathMotion>> paths;
    std::istringstream lines(run_command(command).out);
    std::vector<ToolpathMotion>* path = nullptr;
    for (std::string line; std::getline(lines, line);) {
        std::istringstream words(line);
        ToolpathMotion motion;
        words >> motion.word;
        if (motion.word == "program") {
            words >> line;
            path = &paths[line];
        } else if (path != nullptr && words >> motion.tool >> motion.x >> motion.y >> motion.z) {
            words >> motion.cx >> motion.cy;
            path->push_back(motion);
        }
    }
    return paths;
}

/// Holds what was run against the moves of an operation, places within `near` mm.
/// @returns what differs, "" where nothing does
inline std::string grbl_difference(const Plan& plan, const Layer& layer, const Operation& op,
                                   const std::vector<ToolpathMotion>& run, double near) {
    const ProgramOrigin origin = program_origin(plan, layer);
    struct Wanted {
        std::string word;
        double x, y, z, cx, cy;
    };
    std::vector<Wanted> wanted;
    for (std::size_t i = 0; i < op.moves.size(); ++i) {
        const Move& m = op.moves[i];
        Wanted w{m.feed == 0 ? "G0" : "G1",
                 to_mm(m.x - origin.x),
                 to_mm(m.y - origin.y),
                 to_mm(m.z - origin.z),
                 0,
                 0};
        if (i > 0 && m.is_arc()) {
            const ArcShape arc = arc_shape(op.moves[i - 1], m);
            w.word = arc.sweep > 0 ? "G3" : "G2";
            w.cx = arc.x - to_mm(origin.x);
            w.cy = arc.y - to_mm(origin.y);
        }
        const bool stays = !wanted.empty() && m.x == op.moves[i - 1].x && m.y == op.moves[i - 1].y &&
                           m.z == op.moves[i - 1].z;
        if (!stays) wanted.push_back(w);
    }
    std::vector<ToolpathMotion> ran;
    for (const ToolpathMotion& m : run) {
        const bool stays = !ran.empty() && m.x == ran.back().x && m.y == ran.back().y && m.z == ran.back().z;
        if (!stays) ran.push_back(m);
    }
    const auto differs = [&](double a, double b) { return !(std::abs(a - b) <= near); };
    const auto is_at = [&](const ToolpathMotion& m, const Wanted& w) {
        return !differs(m.x, w.x) && !differs(m.y, w.y) && !differs(m.z, w.z);
    };
    // From wherever the machine stands it goes up, then over the first place.
    std::size_t next = 0;
    while (next < ran.size() && next < 2 && !is_at(ran[next], wanted[0])) ++next;
    for (std::size_t i = 0; i < wanted.size(); ++i) {
        const Wanted& w = wanted[i];
        const bool is_arc = w.word == "G2" || w.word == "G3";
        const bool runs = next < ran.size() && ran[next].word == w.word && ran[next].tool == op.tool &&
                          is_at(ran[next], w) &&
                          (!is_arc || (!differs(ran[next].cx, w.cx) && !differs(ran[next].cy, w.cy)));
        // A move shorter than the program's least step is not written.
        if (!runs && (is_arc || next == 0 || !is_at(ran[next - 1], w)))
            return "motion " + std::to_string(i) + " of " + std::to_string(wanted.size());
        next += runs ? 1 : 0;
    }
    if (next != ran.size()) return std::to_string(ran.size() - next) + " motions that nobody planned";
    return "";
}

}  // namespace slabwright::support
