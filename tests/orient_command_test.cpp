// `orient` and `quote`, and plans that are laid on their best side, as the command's users meet them.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/support/command.h"
#include "tests/support/files.h"
#include "tests/support/places.h"
#include "tests/support/temporary_folder.h"

using nlohmann::json;
using slabwright::support::CommandResult;
using slabwright::support::TemporaryFolder;

namespace {

const std::string kDome = slabwright::support::checkout("tests/data/half-sphere.stl");

CommandResult slabwright_command(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), slabwright::support::built_command());
    return slabwright::support::run_command(arguments);
}

TEST(OrientCommand, TellsEverySideTheBestFirst) {
    const CommandResult told = slabwright_command({"orient", kDome, "--plans", "1", "--json"});
    ASSERT_EQ(told.exit, 0) << told.err;
    const json ways = json::parse(told.out).at("ways");
    ASSERT_GE(ways.size(), 6U);
    EXPECT_EQ(ways[0].at("unmade_mm3"), 0.0);
    EXPECT_GT(ways[0].at("build_minutes"), 1.0);
    EXPECT_FALSE(ways[1].contains("build_minutes"));
    EXPECT_GT(ways.back().at("unmade_mm3"), 1000.0) << "on its dome most of it hangs over";
}

// Turned over, the dome hangs over its base: refused as it lies, made as it is laid.
TEST(OrientCommand, APlanIsLaidOnItsBestSide) {
    const TemporaryFolder folder;
    const std::string over = folder / "over.stl", out = folder / "out";
    ASSERT_EQ(slabwright_command({"prepare", kDome, "-o", over, "--turn", "180,0,0"}).exit, 0);
    EXPECT_EQ(slabwright_command({"plan", over, "-o", out, "--quiet"}).exit, 4);
    const CommandResult report = slabwright_command({"plan", over, "-o", out, "--orient", "report"});
    EXPECT_EQ(report.exit, 0) << report.err;
    EXPECT_NE(report.out.find("180,0,0"), std::string::npos) << report.out;
    EXPECT_FALSE(std::filesystem::exists(out)) << "a report writes nothing";
    const CommandResult planned = slabwright_command({"plan", over, "-o", out, "--orient", "auto"});
    EXPECT_EQ(planned.exit, 0) << planned.err;
    EXPECT_NE(planned.out.find("turned by 180 0 0"), std::string::npos) << planned.out;
    EXPECT_EQ(slabwright_command({"verify", out, "--stl", over}).exit, 0);
    const CommandResult both =
        slabwright_command({"plan", over, "-o", out, "--orient", "auto", "--turn", "0,90,0"});
    EXPECT_EQ(both.exit, 2);
    EXPECT_NE(both.err.find("--orient"), std::string::npos) << both.err;
}

TEST(QuoteCommand, TellsPeopleAndPrograms) {
    const CommandResult people = slabwright_command({"quote", kDome});
    ASSERT_EQ(people.exit, 0) << people.err;
    EXPECT_NE(people.out.find("3 of 19 x"), std::string::npos) << people.out;
    const CommandResult programs = slabwright_command({"quote", kDome, "--json"});
    const json quoted = json::parse(programs.out);
    EXPECT_EQ(quoted.at("schema"), "slabwright.quote/1");
    EXPECT_EQ(quoted.at("layers"), 3);
}

}  // namespace
