// How many faults in programs and tool tables the proof finds. Planned folders get hundreds of edits, one at
// a time: each must be found, or do nothing to a machine, as LinuxCNC's interpreter says, whether it was
// fresh or left in a foreign state by what ran before.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/edited_programs.h"
#include "tests/support/seed.h"

using namespace slabwright;
using namespace slabwright::support;

namespace {

constexpr int kEdits = 500;  // of each folder

struct Count {
    int edits = 0, caught = 0, by_simulation = 0, harmless = 0;
};

/// Judges one edited program; whether the proof did its work.
void judge(Planned& p, const std::string& file, const std::string& text, const std::string& what,
           std::map<std::string, std::array<std::vector<CanonAct>, 2>>& originals, Count& count,
           std::map<std::string, int>& codes) {
    ++count.edits;
    std::string found = p.glance(file, text);
    if (!found.empty()) {
        ++count.caught;
        ++codes[found];
        // The whole verification says no less; now and then it is asked.
        if (count.edits % 40 == 0) {
            EXPECT_NE(p.verdict("nc/" + file, text), "") << what;
        }
        return;
    }
    found = p.verdict("nc/" + file, text);
    if (!found.empty()) {
        ++count.caught;
        ++count.by_simulation;
        return;
    }
    try {
        if (!originals.contains(file)) originals[file] = p.acts(p.texts.at(file));
        const auto edited = p.acts(text);
        for (const std::size_t k : {0, 1}) {
            const std::string differs = support::difference(originals[file][k], edited[k]);
            EXPECT_EQ(differs, "") << "passes, but a machine " << (k == 0 ? "fresh" : "left otherwise")
                                   << " does something else: " << file << " " << what;
        }
        ++count.harmless;
    } catch (const std::runtime_error& e) {
        ADD_FAILURE() << "passes, but LinuxCNC refuses: " << file << " " << what << "\n" << e.what();
    }
}

const std::array<Case, 6> kCases{
    Case{"pattern-base, arcs", Frame::pattern_base, true}, Case{"layer-top, arcs", Frame::layer_top, true},
    Case{"layer-top, lines", Frame::layer_top, false},
    // A joint that lies on no 0.1 µm, in a flask, on a slow machine that needs no time to start its spindle.
    Case{"layer-top, two layers", Frame::layer_top, true,
         [](Job& job) {
             job.flask.enabled = true;
             job.machine.max_feed = 3999.7;
             job.machine.max_rpm = 9000.4;
             job.machine.spindle_dwell_s = 0;
         },
         28.0 + 1.0 / 3},
    Case{"pattern-base, slow tools", Frame::pattern_base, true,
         [](Job& job) {
             for (Tool& tool : job.tools) {
                 tool.max_feed = 2345.6;
                 tool.max_rpm = 7000.6;
             }
             job.machine.spindle_dwell_s = 1.2345;
             job.cutting.rough_blend = 0.0712345;
         }},
    Case{"layer-top, zigzag, feeds as planned", Frame::layer_top, true,
         [](Job& job) {
             job.cutting.adapt_feed = false;
             job.cutting.rough_pattern = RoughPattern::zigzag;
             job.selection.mode = SelectionMode::fixed;
         },
         25.1234567}};

}  // namespace

TEST(GcodeMutation, NoFalseAlarm) {
    Random random(test::seed());
    for (const Case& which : kCases) {
        Planned p(which);
        EXPECT_EQ(p.verdict("tool.tbl", p.table), "") << which.name;
        int arcs = 0, respelled = 0;
        for (const auto& [file, text] : p.texts) {
            EXPECT_EQ(p.glance(file, text), "") << which.name << " " << file;
            const auto acts = p.acts(text);
            EXPECT_EQ(support::difference(acts[0], acts[1], 4), "")
                << which.name << " " << file << " depends on what the machine was left in";
            for (const CanonAct& act : acts[0]) arcs += act.call == "ARC_FEED";
            for (int k = 0; k < 20; ++k) {
                std::vector<std::string> lines = split(text);
                const std::string what = respell(random, lines);
                if (what.empty()) continue;
                ++respelled;
                EXPECT_EQ(p.glance(file, join(lines)), "") << which.name << " " << file << " " << what;
            }
            EXPECT_EQ(p.glance(file, "%\n" + text + "%\n"), "");
        }
        EXPECT_EQ(arcs > 0, which.arcs) << which.name;
        std::printf("%s: %zu programs, %d spellings, no alarm\n", which.name, p.texts.size(), respelled);
    }
}

TEST(GcodeMutation, EveryEditIsFoundOrDoesNothing) {
    const std::uint32_t seed = test::seed();
    for (std::size_t c = 0; c < 2; ++c) {
        Planned p(kCases[c]);
        std::map<std::string, std::array<std::vector<CanonAct>, 2>> originals;
        std::map<std::string, int> codes;
        Count count;
        std::vector<std::string> files;
        for (const auto& [file, text] : p.texts) files.push_back(file);
        for (std::uint32_t k = 0; count.edits < kEdits; ++k) {
            Random random(seed + 7919 * k + static_cast<std::uint32_t>(c));
            const std::string& file = any(random, files);
            std::vector<std::string> lines = split(p.texts.at(file));
            const std::string what = edit(random, lines, below(random, kEditKinds));
            const std::string text = join(lines);
            if (what.empty() || text == p.texts.at(file)) continue;
            judge(p, file, text, "seed " + std::to_string(seed) + " edit " + std::to_string(k) + " " + what,
                  originals, count, codes);
        }
        std::printf("%s: %d edits, %d caught (%d by the simulation alone), %d harmless\n", kCases[c].name,
                    count.edits, count.caught, count.by_simulation, count.harmless);
        for (const auto& [code, times] : codes) std::printf("  %s %d\n", code.c_str(), times);
        EXPECT_GT(count.caught, count.edits / 2);
        EXPECT_GT(count.harmless, 0) << "an edit of a comment is none of a machine";
    }
}

// Each line of the list at the beginning, in the middle and at the end of a program.
TEST(GcodeMutation, EveryDangerousLineEverywhere) {
    Planned p(kCases[0]);
    std::map<std::string, std::array<std::vector<CanonAct>, 2>> originals;
    std::map<std::string, int> codes;
    Count count;
    const auto& [file, good] =
        *std::max_element(p.texts.begin(), p.texts.end(),
                          [](const auto& a, const auto& b) { return a.second.size() > b.second.size(); });
    const std::vector<std::string> lines = split(good);
    for (const std::string& dangerous : kDangerous)
        for (std::size_t at = 0; at <= lines.size(); ++at) {
            // All lines of comment are alike, and so is most of what lies between the first moves and the
            // last.
            if ((at > 0 && lines[at - 1][0] == '(') || (at > 20 && at + 4 < lines.size())) continue;
            std::vector<std::string> edited = lines;
            edited.insert(edited.begin() + static_cast<std::ptrdiff_t>(at), dangerous);
            judge(p, file, join(edited), dangerous + " before line " + std::to_string(at + 1), originals,
                  count, codes);
        }
    std::printf("%d insertions, %d caught (%d by the simulation alone), %d harmless\n", count.edits,
                count.caught, count.by_simulation, count.harmless);
}

TEST(GcodeMutation, EveryEditOfTheToolTableIsFoundOrDoesNothing) {
    const std::uint32_t seed = test::seed();
    const Job job;
    const std::string good = tool_table(job);
    int caught = 0, harmless = 0;
    for (std::uint32_t k = 0; caught + harmless < 2000; ++k) {
        Random random(seed + 104729 * k);
        std::vector<std::string> lines = split(good);
        std::string what = edit(random, lines, below(random, kEditKinds));
        const std::string text = join(lines);
        if (what.empty() || text == good) continue;
        std::string found;
        try {
            for (const Violation& v : check_tool_table(text, "tool.tbl", job.tools)) found += v.message;
        } catch (const Error& e) {
            found = e.what();
        }
        if (!found.empty()) {
            ++caught;
            continue;
        }
        ++harmless;
        EXPECT_EQ(rows(text), rows(good)) << "seed " << seed << " edit " << k << " " << what;
    }
    std::printf("tool table: %d edits, %d caught, %d harmless\n", caught + harmless, caught, harmless);
    EXPECT_GT(caught, 200);
}
