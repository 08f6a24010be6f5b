// Whatever stands where a file is to be read: an answer at once, never a wait, never memory without end.
#include "io/read/input_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "kernels/errors.h"
#include "tests/support/command.h"
#include "tests/support/files.h"
#include "tests/support/places.h"
#include "tests/support/temporary_folder.h"

using namespace slabwright;
using slabwright::support::CommandResult;
using slabwright::support::run_command;
using slabwright::support::slurp;
using slabwright::support::spit;
using slabwright::support::TemporaryFolder;
namespace fs = std::filesystem;

namespace {

const std::string kStl = support::checkout("tests/data/half-sphere.stl");

/// The command, ended by force (exit 137) where it does not come back by itself.
CommandResult bounded_command(const std::vector<std::string>& arguments) {
    std::vector<std::string> all = {"/usr/bin/timeout", "-s", "KILL", "120", support::built_command()};
    all.insert(all.end(), arguments.begin(), arguments.end());
    return run_command(all);
}

/// What may stand where a file is expected, made at a path.
struct Oddity {
    std::string name;
    std::function<void(const fs::path&)> make;
};
const std::vector<Oddity> kOddities = {
    {"pipe", [](const fs::path& p) { ASSERT_EQ(::mkfifo(p.c_str(), 0600), 0); }},
    {"/dev/zero", [](const fs::path& p) { fs::create_symlink("/dev/zero", p); }},
    {"folder", [](const fs::path& p) { fs::create_directory(p); }},
    {"nothing but zeros without end",
     [](const fs::path& p) {
         spit(p, "");
         ASSERT_EQ(::truncate(p.c_str(), off_t{1} << 41), 0) << "the disk has no sparse files";
     }},
    {"a link to nowhere", [](const fs::path& p) { fs::create_symlink("nowhere", p); }},
    {"nothing", [](const fs::path&) {}},
};

}  // namespace

TEST(InputFile, ReadsWholeFilesWithinTheirLimit) {
    TemporaryFolder folder;
    spit(folder.path / "a", "twelve bytes");
    const ReadRule rule{ErrorKind::usage, "test.", 12};
    EXPECT_EQ(read_whole(folder / "a", rule), "twelve bytes");
    const auto code_of = [&](const std::string& name, std::uint64_t most) {
        try {
            (void)read_whole(folder / name, {ErrorKind::usage, "test.", most});
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::usage);
            EXPECT_EQ(error.place(), folder / name);
            EXPECT_FALSE(error.remedy().empty());
            return error.code();
        }
        return std::string("read");
    };
    EXPECT_EQ(code_of("a", 11), "test.too_large");
    EXPECT_EQ(code_of("b", 12), "test.missing");
    EXPECT_EQ(code_of("a/b", 12), "test.missing");
    EXPECT_EQ(code_of("", 12), "test.directory");
    ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
    EXPECT_EQ(code_of("pipe", 12), "test.unreadable");
    const InputFile file(folder / "a", rule);
    file.require_unchanged();
    ASSERT_EQ(::truncate((folder / "a").c_str(), 5), 0);
    char bytes[12];
    EXPECT_THROW(file.read(0, bytes, 12), Error);
    EXPECT_THROW(file.require_unchanged(), Error);
}

TEST(InputFile, DocumentsAreNoDeeperThanOurs) {
    TemporaryFolder folder;
    const auto read = [&](const std::string& text) {
        spit(folder.path / "a.json", text);
        return read_document(folder / "a.json", ErrorKind::input, "test", "plan again");
    };
    const std::string wide = "{\"a\": [" + std::string(1000, ' ') + "[], [], {}, \"[[[[\\\"{{{\\\\\"]}";
    EXPECT_EQ(read(wide), wide);
    std::string many = "[";
    for (int i = 0; i < 1000; ++i) many += "[],";
    EXPECT_EQ(read(many), many);
    EXPECT_THROW((void)read(std::string(100'000, '[')), Error);
    EXPECT_THROW((void)read("[\"\\\"\", " + std::string(100, '{')), Error);
}

TEST(InputFile, NothingThatIsReadIsWaitedForOrReadWithoutEnd) {
    TemporaryFolder folder;
    const std::string out = folder / "out", job = folder / "job.toml", stl = folder / "part.stl";
    ASSERT_EQ(bounded_command({"plan", kStl, "-o", out, "--quiet"}).exit, 0);
    const std::string program = fs::directory_iterator(out + "/nc")->path().filename().string();
    struct Case {
        std::string place;  ///< what is odd
        std::vector<std::string> arguments;
        std::vector<int> exits;
    };
    const std::vector<Case> cases = {
        {job, {"plan", kStl, "-o", folder / "new", "--job", job}, {2}},
        {job, {"inspect", kStl, "--job", job}, {2}},
        {stl, {"plan", stl, "-o", folder / "new"}, {3}},
        {stl, {"slice", stl, "--every", "5", "-o", folder / "x.svg"}, {3}},
        {stl, {"verify", out, "--stl", stl}, {3}},
        {out + "/plan.json", {"verify", out, "--stl", kStl}, {5}},
        {out + "/plan.json", {"report", out, "--stl", kStl}, {3, 2}},
        {out + "/plan.json", {"plan", kStl, "-o", out}, {3}},
        {out + "/tool.tbl", {"verify", out, "--stl", kStl}, {5}},
        {out + "/nc/" + program, {"verify", out, "--stl", kStl}, {5}},
        {out + "/nc/" + program, {"report", out, "--stl", kStl}, {3, 2}},
        {out + "/sequence.json", {"report", out, "--stl", kStl}, {3, 2, 0}},
        {out + "/verify.json", {"report", out, "--stl", kStl}, {3, 2, 0}},
    };
    for (const Case& c : cases) {
        const bool was_there = fs::exists(c.place);
        if (was_there) fs::rename(c.place, folder.path / "kept");
        for (const Oddity& oddity : kOddities) {
            oddity.make(c.place);
            const CommandResult result = bounded_command(c.arguments);
            EXPECT_NE(std::find(c.exits.begin(), c.exits.end(), result.exit), c.exits.end())
                << oddity.name << " at " << c.place << " for " << c.arguments.front() << ": " << result.exit
                << " " << result.err << result.out;
            EXPECT_LT(result.peak_bytes, std::uint64_t{1} << 30);
            fs::remove_all(c.place);
        }
        if (was_there) fs::rename(folder.path / "kept", c.place);
    }
    // The report that verify would make again.
    for (const Oddity& oddity : kOddities) {
        fs::remove_all(out + "/report.html");
        oddity.make(out + "/report.html");
        const CommandResult result = bounded_command({"verify", out, "--stl", kStl});
        EXPECT_EQ(result.exit, 0) << oddity.name << result.err;
    }
}
