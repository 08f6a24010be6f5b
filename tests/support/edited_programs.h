// Planned folders whose programs are edited, a line at a time, with what the proof and LinuxCNC's interpreter
// say of each edit.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "engine/moves/feed_lengths.h"
#include "io/posts/gcode_reader.h"
#include "io/posts/program_check.h"
#include "io/posts/tool_table.h"
#include "io/posts/tool_table_check.h"
#include "io/read/pattern_mesh.h"
#include "io/read/planned_folder.h"
#include "io/slabwright.h"
#include "io/verify.h"
#include "io/write/stl_writer.h"
#include "kernels/errors.h"
#include "tests/support/canon_motions.h"
#include "tests/support/files.h"
#include "tests/support/seed.h"

namespace slabwright::support {

namespace fs = std::filesystem;

constexpr double kCell = 2;  // mm

/// A frustum with round corners at its foot: flats, slopes, walls, arcs in its programs.
inline Mesh hill(double height) {
    constexpr int sides = 24;
    Mesh mesh;
    const auto ring = [&](double half_x, double half_y, double corner, float z) {
        for (int k = 0; k < sides; ++k) {
            const double angle = (k + 0.5) * 2 * std::numbers::pi / sides;
            const double x = std::copysign(half_x - corner, std::cos(angle)) + corner * std::cos(angle),
                         y = std::copysign(half_y - corner, std::sin(angle)) + corner * std::sin(angle);
            mesh.vertices.push_back({static_cast<float>(x), static_cast<float>(y), z});
        }
    };
    ring(20, 14, 6, 0);
    ring(20, 14, 6, 4);
    ring(12, 8, 4, static_cast<float>(height));
    const auto count = static_cast<std::uint32_t>(sides);
    for (std::uint32_t k = 0; k < count; ++k) {
        const std::uint32_t next = (k + 1) % count;
        for (const std::uint32_t low : {0u, count}) {
            mesh.facets.push_back({low + k, low + next, low + count + next});
            mesh.facets.push_back({low + k, low + count + next, low + count + k});
        }
        if (k == 0 || next == 0) continue;
        mesh.facets.push_back({0, next, k});
        mesh.facets.push_back({2 * count, 2 * count + k, 2 * count + next});
    }
    return mesh;
}

struct Case {
    const char* name;
    Frame frame;
    bool arcs;
    /// What else of the job differs from the defaults.
    void (*change)(Job&) = [](Job&) {};
    double height = 14;  ///< mm, of the hill
};

/// A planned folder with what the judges need of it.
struct Planned {
    TemporaryFolder folder;
    Context context;
    std::shared_ptr<Pattern> pattern;
    Plan plan;
    std::map<std::string, std::string> texts;    // by file under nc/
    std::map<std::string, ProgramPlan> sayings;  // of the plan, by file
    std::string table, judged_table;             // the latter with lengths, so that G43 shows

    explicit Planned(const Case& which) {
        Job job;
        job.machine.frame = which.frame;
        job.cutting.arcs = which.arcs;
        which.change(job);
        const std::string stl = folder / "hill.stl";
        write_stl(stl, hill(which.height));
        pattern = read_pattern(context, stl, job);
        plan = slabwright::plan(context, *pattern, job);
        slabwright::write(context, plan, out());
        for (const Layer& layer : plan.layers)
            for (const Operation& op : layer.operations) {
                texts[op.file] = slurp(fs::path(out()) / "nc" / op.file);
                sayings[op.file] = {std::round(op.spindle_rpm), op.blend, feed_lengths(op.moves)};
            }
        table = slurp(fs::path(out()) / "tool.tbl");
        for (const Tool& tool : plan.job.tools)
            judged_table += "T" + std::to_string(tool.number) + " P" + std::to_string(tool.number) + " D" +
                            std::to_string(tool.diameter) + " Z" + std::to_string(tool.number) + "\n";
    }
    [[nodiscard]] std::string out() const { return folder / "out"; }

    /// What reader and check say of a program alone; "" where they find nothing.
    std::string glance(const std::string& file, const std::string& text) const {
        try {
            Program program = read_gcode(text, file, gcode_limits(plan.job.tolerances));
            for (const Layer& layer : plan.layers)
                for (const Operation& op : layer.operations)
                    if (op.file == file && plan.job.machine.frame == Frame::layer_top) {
                        for (ProgramStep& s : program.steps) s.z += to_mm(to_units(layer.z_top));
                        for (ProgramArc& a : program.arcs) a.arc.z += to_mm(to_units(layer.z_top));
                    }
            const Tool* loaded = nullptr;
            for (const Tool& tool : plan.job.tools)
                if (tool.number == program.tool) loaded = &tool;
            const std::vector<Violation> found =
                check_program(program, sayings.at(file), loaded, plan.job.machine);
            return found.empty() ? "" : found.front().code;
        } catch (const Error& e) {
            EXPECT_EQ(e.kind(), ErrorKind::verification) << e.what();
            EXPECT_NE(e.place().find(file), std::string::npos) << e.what();
            return e.code();
        }
    }
    /// What the whole verification says of the folder with one file changed.
    std::string verdict(const std::string& file, const std::string& text) {
        const fs::path path = fs::path(out()) / file;
        const std::string good = slurp(path);
        spit(path, text);
        std::string found;
        try {
            const Verification v = verify_folder(
                context, out(),
                {.source = folder / "hill.stl", .pattern = pattern, .cell = kCell, .write = false});
            for (const Violation& w : v.report.violations) found += w.code + " ";
        } catch (const Error& e) {
            found = e.code();
        }
        spit(path, good);
        return found;
    }
    /// What a machine does by a program, fresh and left in a foreign state; throws where it refuses.
    std::array<std::vector<CanonAct>, 2> acts(const std::string& text) const {
        const std::size_t begin = text.rfind("%\n", 0) == 0 ? 2 : 0;
        const std::string left = text.substr(0, begin) + kLeftInForce + text.substr(begin);
        return {canon_acts(interpret_rs274(text, judged_table).text),
                canon_acts(interpret_rs274(left, judged_table).text)};
    }
};

using Random = std::mt19937;

inline std::size_t below(Random& random, std::size_t count) {
    return std::uniform_int_distribution<std::size_t>(0, count - 1)(random);
}
template <class List>
const auto& any(Random& random, const List& list) {
    return list[below(random, std::size(list))];
}

inline std::vector<std::string> split(const std::string& text) {
    std::vector<std::string> lines;
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    return lines;
}
inline std::string join(const std::vector<std::string>& lines) {
    std::string text;
    for (const std::string& line : lines) text += line + "\n";
    return text;
}

/// Where words begin in a line without its comments.
inline std::vector<std::size_t> words(const std::string& line) {
    std::vector<std::size_t> at;
    if (line.empty() || line[0] == '(') return at;
    for (std::size_t i = 0; i < line.size(); ++i)
        if (line[i] >= 'A' && line[i] <= 'Z') at.push_back(i);
    return at;
}
inline std::size_t word_end(const std::string& line, std::size_t at) {
    return std::min(line.find_first_not_of("+-.0123456789", at + 1), line.size());
}

/// Half of the time a line of the beginning or the end, where few lines decide all.
inline std::size_t pick_line(Random& random, const std::vector<std::string>& lines) {
    switch (below(random, 4)) {
        case 0:
            return below(random, std::min<std::size_t>(lines.size(), 20));
        case 1:
            return lines.size() - 1 - below(random, std::min<std::size_t>(lines.size(), 5));
        default:
            return below(random, lines.size());
    }
}

// clang-format off
inline const std::vector<std::string> kDangerous{
    "G49", "G43 H1", "G43 H0", "G43.1 Z5", "G43.2 H1", "G55", "G59.3", "G92 X5", "G92.1", "G52 X5",
    "G10 L2 P1 Z5", "G10 L2 P1 R45", "G10 L1 P2 Z9", "G28", "G30", "G53 G0 Z0", "G20", "G91", "G90.1",
    "G18", "G19", "G7", "G41 D1", "G42 D2", "G64", "G64 P0", "G64 P5", "G64 P0.02", "G61", "G61.1", "G93",
    "G95", "G96 D3000 S100", "M0", "M1", "M60", "M2", "M30", "M3 S50", "M4", "M5", "M6", "T1 M6", "T2 M6",
    "T3 M6", "T3", "M7", "M8", "M19", "M61 Q1", "M62 P0", "M100", "M199 P1", "M98 P1", "%", "S50",
    "S999999", "S0", "F99999", "F1", "F0.001", "G4 P999999", "G4 P30", "G4 P-1", "(LOGOPEN,log.txt)",
    "(PROBEOPEN x.txt)", "(MSG,hello)", "(DEBUG,#1)", "(PRINT,1)", "(AXIS,stop)", "(abort,now)", "#1=5",
    "#<_x>=1", "O100 call", "O<a> sub", "/G0 Z-5", "G38.2 Z-9 F100", "G33 Z-5 K1", "G76 P1 Z-5 I-1 J1 K1",
    "G81 X0 Y0 Z-5 R2 F100", "G73 X0 Y0 Z-5 R2 Q1 F100", "G0 Z-20", "G1 Z-5 F1000", "G0 X500 Y0",
    "G0 X0 Y0", "G1 X0 Y0", "G0 A90", "G2 X1 Y1 I5 J5", "G3 I5 J0", "G5 X1 Y1 I1 J1 P1 Q1", "G0 Z5 Z-5",
    "G0 G1 Z-5", "X1 Y1 Z1", "G0 X#1", "G0 Z[1-9]", "G0 Z1e1", "G80", "M9 M8", "M3 M5", "M49", "M48",
    "M50 P0", "M66 P0 L3 Q5", "G17.1", "G51 X1", "G68 R45", "G0 \xC3\xA4", "G98", "G0 X0 Y0 Z0 B0",
    "M2 (end)"};
// clang-format on

/// Kinds of edits that edit() knows.
constexpr std::size_t kEditKinds = 16;

/// One edit. @return what it was; "" where this line offers nothing to it
inline std::string edit(Random& random, std::vector<std::string>& lines, std::size_t kind) {
    const std::size_t at = pick_line(random, lines);
    std::string& line = lines[at];
    const std::string before = line, place = " line " + std::to_string(at + 1) + ": " + before;
    const auto here = [&](std::size_t i) { return lines.begin() + static_cast<std::ptrdiff_t>(i); };
    const std::vector<std::size_t> at_word = words(line);
    const std::size_t word = at_word.empty() ? 0 : any(random, at_word),
                      end = at_word.empty() ? 0 : word_end(line, word);
    switch (kind) {
        case 0:
            lines.erase(here(at));
            return "deleted" + place;
        case 1:
            lines.insert(here(at), before);
            return "doubled" + place;
        case 2: {
            const std::size_t other =
                below(random, 2) == 0 ? pick_line(random, lines) : (at + 1) % lines.size();
            std::swap(lines[at], lines[other]);
            return "swapped with line " + std::to_string(other + 1) + place;
        }
        case 3:
        case 4: {  // another number
            if (at_word.empty()) return {};
            double value = 0;
            std::from_chars(line.data() + word + 1, line.data() + end, value);
            const double to = any(random, std::vector<double>{value + 1, value - 1, value + 0.1, value * 10,
                                                              value / 10, -value, 0, value + 0.01});
            std::string number = std::to_string(to);
            number.erase(number.find_last_not_of('0') + 1);
            if (number.back() == '.') number.pop_back();
            line.replace(word + 1, end - word - 1, number);
            return "number now " + line + place;
        }
        case 5: {  // another code
            if (at_word.empty() || (line[word] != 'G' && line[word] != 'M')) return {};
            static const std::vector<std::string> codes{
                "0",  "1",  "2",  "3",  "4",  "5",  "6",  "7",  "8",  "17", "18", "20", "21", "30",   "40",
                "43", "49", "54", "55", "61", "64", "80", "90", "91", "93", "94", "97", "98", "90.1", "91.1"};
            line.replace(word + 1, end - word - 1, any(random, codes));
            return "code now " + line + place;
        }
        case 6:
        case 7: {
            const std::string& insert = any(random, kDangerous);
            lines.insert(here(at), insert);
            return "inserted " + insert + " before" + place;
        }
        case 8: {
            const std::size_t sign = line.find('-');
            if (at_word.empty() || sign == std::string::npos) return {};
            line.erase(sign, 1);
            return "sign dropped" + place;
        }
        case 9: {
            const std::size_t dot = line.find('.');
            if (at_word.empty() || dot == std::string::npos) return {};
            line.erase(dot, 1);
            return "point dropped" + place;
        }
        case 10:
            if (at_word.empty()) return {};
            line.erase(word, end - word);
            return "word dropped" + place;
        case 11:
            if (at_word.empty()) return {};
            line[word] = any(random, std::string("XYZIJFSTHPQGMRKN"));
            return "letter now " + line + place;
        case 12:
            lines.resize(at);
            return "cut off at" + place;
        case 13: {
            const std::size_t to = below(random, line.size() + 1);
            const char byte = static_cast<char>(below(random, 256));
            line.insert(to, 1, byte == '\n' ? '\0' : byte);
            return "byte " + std::to_string(static_cast<unsigned char>(byte)) + " inserted in" + place;
        }
        case 14: {
            if (at + 1 >= lines.size()) return {};
            line += " " + lines[at + 1];
            lines.erase(here(at + 1));
            return "joined to the next" + place;
        }
        default: {
            lines.erase(here(at));
            const std::size_t to = pick_line(random, lines);
            lines.insert(here(to), before);
            return "moved to line " + std::to_string(to + 1) + place;
        }
    }
}

/// Other spellings of the same: none may be found fault with.
inline std::string respell(Random& random, std::vector<std::string>& lines) {
    const std::size_t at = pick_line(random, lines);
    std::string& line = lines[at];
    if (words(line).empty()) return {};
    const std::string before = line;
    switch (below(random, 7)) {
        case 0:
            std::transform(line.begin(), line.end(), line.begin(),
                           [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
            break;
        case 1:
            line = "N" + std::to_string(at * 10) + " " + line;
            break;
        case 2:
            line += " (a comment, and more)";
            break;
        case 3:
            line += "\r";
            break;
        case 4:
            line.erase(std::remove(line.begin(), line.end(), ' '), line.end());
            break;
        case 5:
            lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(at), "");
            break;
        default:
            line.insert(1, "0");
            if (words(before).size() > 0 && before.size() > 1 && before[1] == '-') line = before + "  ; far";
    }
    return before + " → " + line;
}

/// The rows of a tool table as numbers, without what is zero anyway, for whoever asks whether two are the
/// same.
inline std::multimap<std::string, double> rows(const std::string& table) {
    std::multimap<std::string, double> all;
    for (std::string line : split(table)) {
        line = line.substr(0, line.find(';'));
        std::istringstream in(line);
        std::string first, word;
        in >> first;
        all.emplace(first, 0);
        while (in >> word) {
            double value = 0;
            const auto [rest, status] = std::from_chars(word.data() + 1, word.data() + word.size(), value);
            if (status != std::errc{} || rest != word.data() + word.size())
                all.emplace("unreadable " + word, 0);
            else if (value != 0) all.emplace(first + word[0], value);
        }
    }
    all.erase("");
    return all;
}

}  // namespace slabwright::support
