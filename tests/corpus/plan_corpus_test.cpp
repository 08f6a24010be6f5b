// The command on real meshes made by others, one process a file: every part is planned or refused with a true reason and
// a place, nothing crashes, hangs or stays silent, and every program that comes out is read by LinuxCNC's interpreter.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "io/gcode_reader.h"
#include "tests/support/files.h"
#include "tests/support/rs274.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

namespace fs = std::filesystem;
using support::slurp;
using support::TemporaryFolder;

struct Outcome {
    int status = -1;  // exit status, 128 + signal for a crash
    std::string errors;
};

Outcome run_command(const std::string& arguments, const fs::path& folder) {
    // timeout's 124 tells a hang from a crash.
    const std::string command =
        "timeout 600 '" SLABWRIGHT_COMMAND "' " + arguments + " >'" + (folder / "stdout").string() + "' 2>'" + (folder / "stderr").string() + "'";
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), slurp(folder / "stderr")};
}

// Every program is accepted, and the interpreter stops where our own reader says.
void check_programs(const fs::path& out) {
    const std::string table = slurp(out / "tool.tbl");
    const nlohmann::json plan = nlohmann::json::parse(slurp(out / "plan.json"));
    std::size_t named = 0;
    for (const auto& layer : plan["layers"])
        for (const auto& operation : layer["operations"]) {
            const std::string file = operation["file"];
            ++named;
            const std::string text = slurp(out / file);
            ASSERT_FALSE(text.empty()) << file;
            support::CanonProgram canon;
            ASSERT_NO_THROW(canon = support::interpret_rs274(text, table)) << file;
            EXPECT_TRUE(canon.ended && canon.clockwise) << file;
            EXPECT_EQ(canon.tool, operation["tool"].get<int>()) << file;
            std::vector<ProgramStep> ours;  // the last of each line: an arc is many chords on one
            for (const ProgramStep& step : read_gcode(text, file).steps) {
                if (!ours.empty() && ours.back().line == step.line) ours.back() = step;
                else ours.push_back(step);
            }
            ASSERT_EQ(canon.motions.size(), ours.size()) << file;
            for (std::size_t k = 3; k < ours.size(); ++k) {  // from where all axes are known
                const auto& a = canon.motions[k];
                const auto& b = ours[k];
                ASSERT_TRUE(std::abs(a.x - b.x) < 6e-5 && std::abs(a.y - b.y) < 6e-5 && std::abs(a.z - b.z) < 6e-5 && a.rapid == b.rapid())
                    << file << " motion " << k;
            }
        }
    EXPECT_EQ(named, static_cast<std::size_t>(std::distance(fs::directory_iterator(out / "nc"), fs::directory_iterator{})));
    EXPECT_GT(named, 0U);
}

class PlanCorpus : public testing::TestWithParam<const char*> {};

TEST_P(PlanCorpus, PlannedOrRefused) {
    const char* corpus = std::getenv("SLABWRIGHT_CORPUS");
    if (!corpus) {
        std::printf("skipped: SLABWRIGHT_CORPUS is not set\n");
        return;
    }
    const fs::path folder = fs::path(corpus) / GetParam();
    const bool nasty = std::string(GetParam()) == "nasty";
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    ASSERT_FALSE(files.empty());
    for (const fs::path& file : files) {
        SCOPED_TRACE(file.filename().string());
        TemporaryFolder temporary;
        const fs::path out = temporary.path / "out";
        Outcome outcome = run_command("plan '" + file.string() + "' -o '" + out.string() + "' --json", temporary.path);
        if (outcome.status == 0) {
            std::printf("%-44s planned\n", file.filename().c_str());
            check_programs(out);
            continue;
        }
        EXPECT_TRUE(outcome.status == 3 || outcome.status == 4) << "exit " << outcome.status << ' ' << outcome.errors;
        EXPECT_FALSE(fs::exists(out)) << "something half-written stays";
        nlohmann::json error;
        ASSERT_NO_THROW(error = nlohmann::json::parse(outcome.errors)) << outcome.errors;
        if (error.contains("error")) error = error["error"];
        const std::string code = error["code"], place = error["place"], remedy = error["remedy"];
        std::printf("%-44s refused: %s\n", file.filename().c_str(), code.c_str());
        EXPECT_FALSE(place.empty());
        EXPECT_FALSE(remedy.empty());
        // What can be accepted is planned once it is: an undercut by the flag, hairline cracks by the weld it names.
        std::string accept;
        if (code == "undercut.unmade" && !nasty) accept = "--allow-undercut";
        if (const std::size_t at = remedy.find("--weld "); at != std::string::npos && !nasty) {
            const std::string number = remedy.substr(at + 7);
            accept = "--allow-undercut --weld " + number.substr(0, number.find(' '));
        }
        if (accept.empty()) continue;
        outcome = run_command("plan '" + file.string() + "' -o '" + out.string() + "' --json " + accept, temporary.path);
        ASSERT_EQ(outcome.status, 0) << accept << ": " << outcome.errors;
        const nlohmann::json plan = nlohmann::json::parse(slurp(out / "plan.json"));
        if (code == "undercut.unmade") {
            bool told = false;
            for (const auto& d : plan["diagnostics"]) told |= d["code"] == "undercut.unmade" && d.contains("where");
            EXPECT_TRUE(told) << "the undercut is accepted but not told";
        }
        check_programs(out);
    }
}

INSTANTIATE_TEST_SUITE_P(Real, PlanCorpus, testing::Values("castings", "relief", "nasty"), [](const auto& p) { return std::string(p.param); });

}  // namespace
}  // namespace slabwright
