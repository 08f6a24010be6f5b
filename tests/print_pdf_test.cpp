// `slabwright report --pdf`, with browsers that print, do not print, or are not there.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "io/slabwright.h"
#include "tests/support/command.h"
#include "tests/support/files.h"
#include "tests/support/places.h"
#include "tests/support/temporary_folder.h"

using namespace slabwright;
using slabwright::support::CommandResult;
using slabwright::support::slurp;
using slabwright::support::spit;
using slabwright::support::TemporaryFolder;
namespace fs = std::filesystem;

namespace {

const std::string kStl = support::checkout("tests/data/half-sphere.stl");

/// An executable of a few lines.
std::string script(const TemporaryFolder& folder, const std::string& name, const std::string& lines) {
    const std::string file = folder / name;
    spit(file, "#!/bin/sh\n" + lines);
    fs::permissions(file, fs::perms::owner_all);
    return file;
}

CommandResult print(const std::string& out, const std::string& pdf,
                    std::vector<std::pair<std::string, std::string>> environment) {
    return support::run_command(
        {support::built_command(), "report", out, "--no-3d", "--stl", kStl, "--pdf", pdf}, environment);
}

}  // namespace

TEST(PrintPdf, TheBrowserPrintsOrSaysWhyNot) {
    const TemporaryFolder folder;
    Context context;
    const std::string out = folder / "a plan", pdf = folder / "sheets.pdf";
    write(context, plan(context, kStl, Job{}), out, kStl);
    if (!fs::exists(out + "/report.html")) GTEST_SKIP() << "this build makes no page";
    // One that prints what it was given: the page's address, and no user's profile.
    const std::string good =
        script(folder, "good",
               "for a in \"$@\"; do case $a in --print-to-pdf=*) to=${a#*=};; file://*) page=$a;; "
               "--user-data-dir=*) profile=$a;; esac; done\n"
               "test -n \"$profile\" || exit 1\n"
               "printf '%%PDF-1.4 %s' \"$page\" > \"$to\"\n");
    const CommandResult printed = print(out, pdf, {{"SLABWRIGHT_CHROMIUM", good}});
    EXPECT_EQ(printed.exit, 0) << printed.err;
    EXPECT_EQ(slurp(pdf), "%PDF-1.4 file://" + (folder / "a%20plan") + "/report.html");
    // Those that do not leave the file as it was, and one line.
    for (const std::string& bad :
         {script(folder, "fails", "exit 1\n"), script(folder, "silent", "exit 0\n"),
          script(folder, "other",
                 "for a in \"$@\"; do case $a in --print-to-pdf=*) echo no > ${a#*=};; esac; done\n"),
          std::string("/nowhere/chromium")}) {
        spit(pdf, "mine");
        const CommandResult result = print(out, pdf, {{"SLABWRIGHT_CHROMIUM", bad}});
        EXPECT_EQ(result.exit, 3) << bad << result.err;
        EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
        EXPECT_NE(result.err.find("prints no PDF"), std::string::npos) << result.err;
        EXPECT_EQ(slurp(pdf), "mine");
    }
    const CommandResult nowhere = print(out, folder / "no/folder.pdf", {{"SLABWRIGHT_CHROMIUM", good}});
    EXPECT_EQ(nowhere.exit, 3);
    EXPECT_NE(nowhere.err.find("cannot be written"), std::string::npos) << nowhere.err;
    const CommandResult none = print(out, pdf, {{"PATH", folder.path.string()}, {"SLABWRIGHT_CHROMIUM", ""}});
    EXPECT_EQ(none.exit, 2) << none.err;
    EXPECT_NE(none.err.find("apt install chromium"), std::string::npos) << none.err;
    EXPECT_EQ(slurp(pdf), "mine");
}
