// `slabwright sheets`: the folder, its drawings, its proof, and what it refuses.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/command.h"
#include "tests/support/files.h"
#include "tests/support/places.h"
#include "tests/support/rs274.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

using support::CommandResult;
using support::run_command;
using support::TemporaryFolder;

const std::string command = support::built_command();
const std::string half_sphere = support::checkout("tests/data/half-sphere.stl");

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

TEST(SheetsCommand, VerifyRefusesAFolderThatIsNoneOfOurs) {
    const TemporaryFolder folder;
    const std::string out = folder / "out";
    ASSERT_EQ(sheets(out, {"--thickness", "12"}).exit, 0);
    const auto verified = [&] { return run_command({command, "verify", out, "--stl", half_sphere}); };
    const std::string good = support::slurp(out + "/sheets.json");
    const auto change = [&](const std::function<void(nlohmann::json&)>& edit) {
        nlohmann::json document = nlohmann::json::parse(good);
        edit(document);
        support::spit(out + "/sheets.json", document.dump());
    };
    const std::vector<std::function<void(nlohmann::json&)>> edits{
        [](nlohmann::json& j) { j["schema"] = "slabwright.sheets/2"; },
        [](nlohmann::json& j) { j["input"]["units"] = "furlong"; },
        [](nlohmann::json& j) { j["axis"] = ""; },
        [](nlohmann::json& j) { j["programs"] = 5; },
        [](nlohmann::json& j) { j.erase("input"); },
    };
    for (const auto& edit : edits) {
        change(edit);
        const CommandResult result = verified();
        EXPECT_EQ(result.exit, 5) << result.out << result.err;
        EXPECT_NE(result.err.find("is no sheets.json of ours"), std::string::npos) << result.err;
    }
    support::spit(out + "/sheets.json", good);
    support::spit(out + "/nc/sheet_99.ngc", "M2\n");
    const CommandResult stray = verified();
    EXPECT_EQ(stray.exit, 5) << stray.out << stray.err;
    EXPECT_NE(stray.err.find("is a program that sheets.json does not name"), std::string::npos) << stray.err;
    std::filesystem::remove(out + "/nc/sheet_99.ngc");
    EXPECT_EQ(verified().exit, 0);
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
    refuses({"--align", "dowels", "--dowel", "40"}, 4, "an island of sheet");
    refuses({"--align", "holes", "--dowel", "4"}, 2, "wider than a dowel");
    refuses({"--offcut", "7", "100", "100"}, 2, "no thickness in stock");
}

TEST(SheetsCommand, HeldSheetsFixturesAndCostsStandInTheFolder) {
    const TemporaryFolder folder;
    const std::string out = folder / "out";
    const CommandResult made = sheets(
        out, {"--stock", "600",      "600",     "--thickness", "6",         "12",       "--head",    "jet",
              "--align", "dowels",   "--dowel", "6",           "--bonding", "braze",    "--compare", "--nest",
              "--crate", "--price",  "800",     "--material",  "aluminium", "--offcut", "6",         "150",
              "150",     "--offcut", "6",       "140",         "140"});
    ASSERT_EQ(made.exit, 0) << made.out << made.err;
    for (const char* part : {"uniform ", "adaptive", "curved  ", "adaptive beside uniform: ",
                             "curved beside uniform: ", " % fewer sheets", "0 islands are held by nothing"})
        EXPECT_NE(made.out.find(part), std::string::npos) << part << '\n' << made.out;
    const auto document = nlohmann::json::parse(support::slurp(out + "/sheets.json"));
    EXPECT_EQ(document["alignment"], "dowels");
    EXPECT_EQ(document["bonding"]["kind"], "braze");
    EXPECT_NEAR(document["bond"].get<double>(), 0.0254, 1e-12);
    EXPECT_NEAR(document["weakest_joint"]["bears_n"].get<double>(),
                document["weakest_joint"]["area_mm2"].get<double>() * 32.04, 20);
    ASSERT_EQ(document["ways"].size(), 3u);
    EXPECT_EQ(document["ways"][2]["sheets"], document["totals"]["sheets"]);
    EXPECT_GT(document["ways"][0]["money"].get<double>(), 0);
    for (const auto& piece : document["pieces"]) {
        EXPECT_GE(piece["dowels"].size(), 2u);
        ASSERT_EQ(piece["pins"].size(), 4u);
        EXPECT_NEAR(piece["pins"][0][0].get<double>(), -piece["pins"][1][0].get<double>(), 0.02);
    }
    EXPECT_EQ(document["programs"][0]["length"], 150);
    const auto verdict = nlohmann::json::parse(support::slurp(out + "/verify.json"));
    EXPECT_EQ(verdict["islands"], 0);
    EXPECT_GT(verdict["dowels"], 0);
    for (const char* name : {"nest_01", "crate_x1", "crate_x3", "crate_y1", "crate_y3"})
        EXPECT_TRUE(std::filesystem::is_regular_file(out + "/fixture/" + name + ".dxf")) << name;
    // Written again in its place: the fixture is one of ours.
    EXPECT_EQ(sheets(out, {"--stock", "600", "600"}).exit, 0);
    EXPECT_FALSE(std::filesystem::exists(out + "/fixture"));
}

// FDFF equation 3, and back from a test cut.
TEST(SheetsCommand, FeedIsTheFormulasAndATestCutFitsTheMaterial) {
    const CommandResult feed = run_command({command, "feed", "6.35"});
    EXPECT_EQ(feed.exit, 0) << feed.err;
    EXPECT_NE(feed.out.find("1835.8 mm/min"), std::string::npos) << feed.out;
    const CommandResult fitted = run_command({command, "feed", "12", "--test-cut", "500", "--json"});
    EXPECT_EQ(fitted.exit, 0) << fitted.err;
    const auto document = nlohmann::json::parse(fitted.out);
    EXPECT_NEAR(document["feed_mm_min"].get<double>(), 500, 1e-3);
    EXPECT_NEAR(document["energy_j_mm3"].get<double>(), 13.6 * 1835.75 * 6.35 / 12 / 500, 1e-2);
    EXPECT_NE(run_command({command, "feed", "6.35", "--tilt", "60"}).out.find("917.9"), std::string::npos);
    EXPECT_EQ(run_command({command, "feed", "0"}).exit, 2);
}

bool has_ezdxf() { return std::system("/usr/bin/python3 -c 'import ezdxf' >/dev/null 2>&1") == 0; }

/// Whether ezdxf, which many shops' programs are built on, reads all drawings in folders without a finding.
bool ezdxf_accepts(const TemporaryFolder& scratch, const std::vector<std::string>& folders) {
    support::spit(scratch / "audit.py",
                  "import sys, ezdxf\n"
                  "for name in sys.argv[1:]:\n"
                  "    document = ezdxf.readfile(name)\n"
                  "    audit = document.audit()\n"
                  "    assert not audit.errors and not audit.fixes, (audit.errors, audit.fixes)\n"
                  "    layers = {layer.dxf.name for layer in document.layers}\n"
                  "    assert {'CUT', 'HOLE', 'LABEL', 'TAB'} <= layers, layers\n"
                  "    lines = document.modelspace().query('POLYLINE')\n"
                  "    assert len(lines) > 0\n"
                  "    assert all(line.is_closed == (line.dxf.layer != 'LABEL') for line in lines)\n");
    std::string line = "/usr/bin/python3 '" + std::string(scratch / "audit.py") + "'";
    for (const std::string& folder : folders)
        for (const auto& entry : std::filesystem::directory_iterator(folder))
            line += " '" + entry.path().string() + "'";
    return std::system(line.c_str()) == 0;
}

// Five parts of the corpus from the sheets in stock, one by two heads, numbers engraved: the programs make
// the part, cut into it nowhere by more than .02 mm, LinuxCNC reads each of them, ezdxf each drawing.
TEST(SheetsCommand, CorpusPartsPassTheirProofAndOthersReadTheirProgramsAndDrawings) {
    const char* corpus = std::getenv("SLABWRIGHT_CORPUS");
    if (corpus == nullptr) GTEST_SKIP() << "SLABWRIGHT_CORPUS names no folder of meshes";
    const bool reads_dxf = has_ezdxf();
    if (!reads_dxf) std::printf("  python3-ezdxf is not installed: drawings are not read\n");
    for (const auto& [part, head] : {std::pair{"castings/bearing_block", "router"},
                                     {"castings/bearing_block", "jet"},
                                     {"castings/mold_cavity_ktool", "jet"},
                                     {"castings/casting_cover", "laser"},
                                     {"castings/robot_base_fanuc_cr35ia", "router"},
                                     {"pool/fanuc_10", "laser"}}) {
        const TemporaryFolder folder;
        const std::string out = folder / "out";
        const CommandResult made = run_command({command, "sheets", std::string(corpus) + "/" + part + ".stl",
                                                "-o", out, "--stock", "2440", "1220", "--thickness", "6", "9",
                                                "12", "18", "--head", head, "--engrave", "1"});
        ASSERT_EQ(made.exit, 0) << part << '\n' << made.out << made.err;
        const auto verdict = nlohmann::json::parse(support::slurp(out + "/verify.json"));
        EXPECT_TRUE(verdict["passed"].get<bool>()) << part;
        EXPECT_LE(verdict["gouge_mm"].get<double>(), 0.02) << part;
        EXPECT_GT(verdict["engraved"].get<int>(), 0) << part;
        for (const auto& entry : std::filesystem::directory_iterator(out + "/nc"))
            EXPECT_TRUE(
                support::interpret_rs274(support::slurp(entry.path()), "T1 P1 D6 Z0\nT2 P2 D1 Z0\n").ended)
                << part << ' ' << entry.path();
        EXPECT_TRUE(!reads_dxf || ezdxf_accepts(folder, {out + "/dxf"})) << part;
    }
}

TEST(SheetsCommand, EzdxfReadsEveryDrawingWithoutAFinding) {
    if (!has_ezdxf()) GTEST_SKIP() << "python3-ezdxf is not installed; tools/setup tests does that";
    const TemporaryFolder folder;
    const std::string out = folder / "out";
    ASSERT_EQ(sheets(out, {"--stock", "600", "600", "--head", "jet", "--thickness", "6", "12", "--align",
                           "tabs", "--nest", "--crate", "--engrave", "1"})
                  .exit,
              0);
    EXPECT_TRUE(ezdxf_accepts(folder, {out + "/dxf", out + "/fixture"}));
    EXPECT_NE(support::slurp(out + "/svg/sheet_01.svg").find("class=\"engraved\""), std::string::npos);
    const auto document = nlohmann::json::parse(support::slurp(out + "/sheets.json"));
    EXPECT_EQ(document["pieces"][0]["engraved"][0]["text"], "1");
}

}  // namespace
}  // namespace slabwright
