// Codes of the machines that cut sheets: what a file says, and what it is refused for.
#include "io/read/sheet_post.h"

#include <gtest/gtest.h>

#include <string>

#include "kernels/errors.h"
#include "tests/support/command.h"
#include "tests/support/files.h"
#include "tests/support/places.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

using support::run_command;
using support::TemporaryFolder;

const std::string command = support::built_command();
const std::string half_sphere = support::checkout("tests/data/half-sphere.stl");

TEST(SheetPost, SaysWhatEachHeadHas) {
    const SheetPost post = parse_sheet_post(
        "[jet]\non = \"M62 P0\"\noff = \"M63 P0\"\npierce_s = 0.8\nclearance = 20\nbegin = [\"M64 P1\"]\n"
        "[router]\nend = [\"M9\", \"M65 P2\"]\n",
        "p.toml");
    SheetJob jet;
    jet.head = SheetHead::jet;
    apply(post, jet);
    EXPECT_EQ(jet.on, "M62 P0");
    EXPECT_EQ(jet.off, "M63 P0");
    EXPECT_EQ(jet.pierce_s, 0.8);
    EXPECT_EQ(jet.clearance, 20);
    EXPECT_EQ(jet.begin, std::vector<std::string>{"M64 P1"});
    EXPECT_TRUE(jet.end.empty());
    SheetJob router;
    apply(post, router);
    EXPECT_EQ(router.on, SheetJob().on);
    EXPECT_EQ(router.end, (std::vector<std::string>{"M9", "M65 P2"}));
    SheetJob laser;
    laser.head = SheetHead::laser;
    apply(post, laser);
    EXPECT_EQ(laser.pierce_s, SheetJob().pierce_s);
    EXPECT_TRUE(laser.begin.empty() && laser.end.empty());
}

TEST(SheetPost, RefusesWithFileAndLine) {
    const auto refuses = [](const std::string& text, const char* code, const char* place) {
        try {
            (void)parse_sheet_post(text, "p.toml");
            ADD_FAILURE() << text;
        } catch (const Error& error) {
            EXPECT_EQ(error.code(), code) << text;
            EXPECT_EQ(error.place(), place) << text;
            EXPECT_FALSE(error.remedy().empty()) << text;
            EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << text;
        }
    };
    refuses("[jet\n", "post.syntax", "p.toml:1");
    refuses("\n[plasma]\n", "post.unknown_key", "p.toml:2");
    refuses("[jet]\n\nonn = \"M3\"\n", "post.unknown_key", "p.toml:3");
    refuses("[router]\non = \"M3\"\n", "post.unknown_key", "p.toml:2");
    refuses("jet = 3\n", "post.type", "p.toml:1");
    refuses("[jet]\non = 3\n", "post.type", "p.toml:2");
    refuses("[jet]\npierce_s = \"long\"\n", "post.type", "p.toml:2");
    refuses("[jet]\npierce_s = true\n", "post.type", "p.toml:2");
    refuses("[jet]\npierce_s = nan\n", "post.range", "p.toml:2");
    refuses("[laser]\nclearance = -1\n", "post.range", "p.toml:2");
    refuses("[laser]\nbegin = \"M7\"\n", "post.type", "p.toml:2");
    refuses("[laser]\nbegin = [\n7]\n", "post.type", "p.toml:3");
    refuses("a" + std::string(5000, '.') + "b = 1\n", "post.syntax", "p.toml:1");
}

TEST(SheetPost, StandsInTheProgramsAndOptionsComeBeforeIt) {
    const TemporaryFolder folder;
    support::spit(
        folder / "shop.toml",
        "[laser]\non = \"M62 P0\"\noff = \"M63 P0\"\npierce_s = 1.25\nbegin = [\"M7\"]\nend = [\"M9\"]\n");
    const auto sheets = [&](const std::vector<std::string>& more) {
        std::vector<std::string> arguments{
            command, "sheets", half_sphere, "-o",          folder / "out", "--stock", "400",
            "400",   "--head", "laser",     "--thickness", "12",           "--codes", folder / "shop.toml"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run_command(arguments);
    };
    const auto made = sheets({});
    ASSERT_EQ(made.exit, 0) << made.out << made.err;
    std::string text = support::slurp(folder / "out/nc/sheet_01.ngc");
    for (const char* part : {"(head on M62 P0 off M63 P0)", "(beside the head M7)", "G54\nM7\n",
                             "M62 P0\nG4 P1.25\n", "M9\nM2\n"})
        EXPECT_NE(text.find(part), std::string::npos) << part;
    EXPECT_EQ(run_command({command, "verify", folder / "out", "--stl", half_sphere}).exit, 0);
    EXPECT_EQ(sheets({"--on", "M64 P3"}).exit, 2) << "M63 P0 would not switch it off";
    ASSERT_EQ(sheets({"--on", "M64 P3", "--off", "M65 P3"}).exit, 0);
    text = support::slurp(folder / "out/nc/sheet_01.ngc");
    EXPECT_NE(text.find("(head on M64 P3 off M65 P3)"), std::string::npos);
    support::spit(folder / "shop.toml", "[laser]\nbegin = [\"M30\"]\n");
    const auto refused = sheets({});
    EXPECT_EQ(refused.exit, 2);
    EXPECT_NE(refused.err.find("switches nothing beside the head"), std::string::npos) << refused.err;
    EXPECT_EQ(
        run_command({command, "sheets", half_sphere, "-o", folder / "out", "--codes", folder / "none.toml"})
            .exit,
        2);
}

}  // namespace
}  // namespace slabwright
