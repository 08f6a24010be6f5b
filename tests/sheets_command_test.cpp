// `slabwright sheets`: the folder, its drawings, its proof, and what it refuses.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/command.h"
#include "tests/support/files.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

using support::CommandResult;
using support::run_command;
using support::TemporaryFolder;

const std::string command = SLABWRIGHT_COMMAND;
const std::string half_sphere = SLABWRIGHT_SOURCE_DIR "/tests/data/half-sphere.stl";

CommandResult sheets(const std::string& out, std::vector<std::string> more = {}) {
    std::vector<std::string> arguments{command, "sheets", half_sphere, "-o", out, "--stock", "400", "400"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_command(arguments);
}

TEST(SheetsCommand, WritesAFolderThatItsProofAccepts) {
    const TemporaryFolder folder;
    const std::string out = folder / "out";
    const CommandResult made = sheets(out, {"--thickness", "3", "6", "12"});
    ASSERT_EQ(made.exit, 0) << made.out << made.err;
    EXPECT_NE(made.out.find("the programs make the part"), std::string::npos) << made.out;
    const auto document = nlohmann::json::parse(support::slurp(out + "/sheets.json"));
    EXPECT_EQ(document["schema"], "slabwright.sheets/1");
    EXPECT_LE(document["totals"]["sheets"], document["totals"]["uniform_sheets"]);
    for (const auto& program : document["programs"])
        for (const char* key : {"file", "dxf", "svg"})
            EXPECT_TRUE(std::filesystem::is_regular_file(out + "/" + program[key].get<std::string>()));
    const auto before = support::tree(out);
    const CommandResult verified = run_command({command, "verify", out, "--stl", half_sphere});
    EXPECT_EQ(verified.exit, 0) << verified.out << verified.err;
    EXPECT_EQ(support::tree(out), before) << "the same verdict";
    // Again, in its place, on one thread: the same bytes.
    EXPECT_EQ(sheets(out, {"--thickness", "3", "6", "12", "--threads", "1"}).exit, 0);
    EXPECT_EQ(support::tree(out), before);
}

TEST(SheetsCommand, VerifyFindsAChangedProgramAndForeignFilesStay) {
    const TemporaryFolder folder;
    const std::string out = folder / "out";
    ASSERT_EQ(sheets(out, {"--head", "laser", "--thickness", "12"}).exit, 0);
    const std::string program = out + "/nc/sheet_01.ngc";
    std::string text = support::slurp(program);
    const std::size_t at = text.find("kerf 0.2 ");
    ASSERT_NE(at, std::string::npos);
    text.replace(at, 9, "kerf 0.9 ");
    support::spit(program, text);
    const CommandResult wrong = run_command({command, "verify", out, "--stl", half_sphere});
    EXPECT_EQ(wrong.exit, 5) << wrong.out;
    EXPECT_NE(wrong.out.find("sheets.gouge"), std::string::npos) << wrong.out;
    support::spit(program, text.substr(0, text.size() / 2));
    EXPECT_EQ(run_command({command, "verify", out, "--stl", half_sphere}).exit, 5);
    support::spit(out + "/notes.txt", "mine");
    const CommandResult refused = sheets(out);
    EXPECT_EQ(refused.exit, 3);
    EXPECT_EQ(support::slurp(out + "/notes.txt"), "mine");
}

TEST(SheetsCommand, RefusesInOneLine) {
    const TemporaryFolder folder;
    const auto refuses = [&](const std::vector<std::string>& more, int exit, const char* part) {
        const CommandResult result = sheets(folder / "out", more);
        EXPECT_EQ(result.exit, exit) << result.out << result.err;
        EXPECT_NE(result.err.find(part), std::string::npos) << result.err;
        EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
        EXPECT_FALSE(std::filesystem::exists(folder / "out"));
    };
    refuses({"--thickness", "500"}, 4, "the thinnest sheet");
    refuses({"--stock", "50", "50"}, 4, "does not fit");
    refuses({"--tilt", "30"}, 2, "only a jet");
    refuses({"--head", "jet", "--tilt", "30", "--side", "middle"}, 2, "outside");
    refuses({"--head", "plasma"}, 2, "plasma");
    refuses({"--thickness", "6", "6"}, 2, "ascend");
}

// The drawings as ezdxf, which many shops' programs are built on, sees them.
TEST(SheetsCommand, EzdxfReadsEveryDrawingWithoutAFinding) {
    if (std::system("/usr/bin/python3 -c 'import ezdxf' >/dev/null 2>&1") != 0)
        GTEST_SKIP() << "python3-ezdxf is not installed; tools/setup does that";
    const TemporaryFolder folder;
    const std::string out = folder / "out";
    ASSERT_EQ(sheets(out, {"--head", "jet", "--thickness", "6", "12"}).exit, 0);
    support::spit(folder / "audit.py",
                  "import sys, ezdxf\n"
                  "for name in sys.argv[1:]:\n"
                  "    document = ezdxf.readfile(name)\n"
                  "    audit = document.audit()\n"
                  "    assert not audit.errors and not audit.fixes, (audit.errors, audit.fixes)\n"
                  "    layers = {layer.dxf.name for layer in document.layers}\n"
                  "    assert {'CUT', 'HOLE', 'LABEL', 'TAB'} <= layers, layers\n"
                  "    lines = document.modelspace().query('POLYLINE')\n"
                  "    assert len(lines) > 0 and all(line.is_closed for line in lines)\n");
    std::string line = "/usr/bin/python3 '" + std::string(folder / "audit.py") + "'";
    for (const auto& entry : std::filesystem::directory_iterator(out + "/dxf"))
        line += " '" + entry.path().string() + "'";
    EXPECT_EQ(std::system(line.c_str()), 0);
}

}  // namespace
}  // namespace slabwright
