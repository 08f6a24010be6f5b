// What `inspect` and a refusal tell of layers milled from above and on both sides, as the command's users
// meet it.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "io/write/stl_writer.h"
#include "kernels/mesh/weld.h"
#include "tests/mesh_shapes.h"
#include "tests/support/command.h"
#include "tests/support/files.h"
#include "tests/support/places.h"
#include "tests/support/schema.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/tunnels.h"

using nlohmann::json;
using slabwright::support::CommandResult;
using slabwright::support::schema_complaint;
using slabwright::support::TemporaryFolder;

namespace {

const std::string kData = slabwright::support::checkout("tests/data/");
const std::string kSchema = slabwright::support::checkout("io/inspect.schema.json");

CommandResult slabwright_command(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), slabwright::support::built_command());
    return slabwright::support::run_command(arguments);
}

/// A block of 80 x 40 x 60 mm with a tunnel of r 12 that the default layers cut.
std::string tunnelled(const TemporaryFolder& folder) {
    using namespace slabwright;
    Context context({.threads = 1});
    std::string stl = folder / "block.stl";
    write_stl(stl, weld(context, support::block_with_tunnels({0, 0, 0}, {80, 40, 60}, {{40, 30, 12}})));
    return stl;
}

TEST(InspectCommand, TellsWhatStaysOnEachSide) {
    const TemporaryFolder folder;
    const std::string stl = tunnelled(folder);
    const CommandResult told = slabwright_command({"inspect", stl, "--json"});
    ASSERT_EQ(told.exit, 0) << told.err;
    EXPECT_EQ(schema_complaint(told.out, kSchema), "");
    const json ways = json::parse(told.out).at("ways");
    ASSERT_EQ(ways.size(), 6U);
    EXPECT_EQ(ways[0].at("turn_deg"), json::array({0, 0, 0}));
    const json above = ways[0].at("milled_from_above"), both = ways[0].at("milled_on_both_sides");
    EXPECT_GT(above.at("volume"), 0.2 * std::numbers::pi * 144 * 40);
    EXPECT_LT(both.at("volume"), 1);
    ASSERT_FALSE(above.at("largest").empty());
    const json where = above.at("largest")[0].at("where");
    EXPECT_LT(std::hypot(where[0].get<double>() - 40, where[2].get<double>() - 30), 12) << "in the tunnel";
    EXPECT_LT(ways[2].at("milled_from_above").at("volume"), 1) << "on end the tunnel is a hole";
    const CommandResult people = slabwright_command({"inspect", stl});
    EXPECT_NE(people.out.find("milled on both sides, in "), std::string::npos) << people.out;
    EXPECT_NE(people.out.find("90,0,0"), std::string::npos) << people.out;
}

TEST(InspectCommand, TellsNothingMoreWhereNothingStays) {
    const CommandResult told = slabwright_command({"inspect", kData + "pump-cover.stl", "--json"});
    ASSERT_EQ(told.exit, 0) << told.err;
    EXPECT_EQ(schema_complaint(told.out, kSchema), "");
    const json ways = json::parse(told.out).at("ways");
    ASSERT_EQ(ways.size(), 1U);
    EXPECT_EQ(ways[0].at("milled_from_above").at("volume"), 0);
    const CommandResult people = slabwright_command({"inspect", kData + "pump-cover.stl"});
    EXPECT_NE(people.out.find("layers: nothing\n"), std::string::npos) << people.out;
}

TEST(InspectCommand, ARefusalTellsTheSame) {
    const TemporaryFolder folder;
    const std::string stl = tunnelled(folder), out = folder / "out";
    const json inspected = json::parse(slabwright_command({"inspect", stl, "--json"}).out);
    const CommandResult refused = slabwright_command({"plan", stl, "-o", out, "--json"});
    EXPECT_EQ(refused.exit, 4);
    EXPECT_EQ(json::parse(refused.err).at("error").at("code"), "undercut.unmade");
    const json told = json::parse(refused.out);
    EXPECT_EQ(told.at("schema"), "slabwright.ways_out/1");
    EXPECT_EQ(told.at("ways"), inspected.at("ways"));
    ASSERT_FALSE(told.at("commands").empty());
    EXPECT_LT(told.at("commands")[0].at("unmade_mm3"), told.at("as_it_lies").at("unmade_mm3"));
    EXPECT_EQ(told.at("commands")[0].at("command").get<std::string>().substr(0, 11), "slabwright ");
    const CommandResult people = slabwright_command({"plan", stl, "-o", out});
    EXPECT_NE(people.out.find("cm3, "), std::string::npos) << people.out;
    EXPECT_NE(people.out.find("on both sides, cm3"), std::string::npos) << people.out;
    EXPECT_EQ(slabwright_command({"plan", stl, "-o", out, "--quiet"}).out, "");
}

// Heights that no layers can be placed for are told, and the rest of the inspection with them.
TEST(InspectCommand, GoesOnWhereNoLayersCanBePlaced) {
    const CommandResult told =
        slabwright_command({"inspect", kData + "pump-cover.stl", "--json", "--scale", "5000"});
    ASSERT_EQ(told.exit, 0) << told.err;
    EXPECT_EQ(schema_complaint(told.out, kSchema), "");
    const json report = json::parse(told.out);
    EXPECT_TRUE(report.at("ways").empty());
    EXPECT_TRUE(report.at("solid").get<bool>());
    bool noted = false;
    for (const json& d : report.at("diagnostics")) noted |= d.at("code") == "layers.request";
    EXPECT_TRUE(noted);
}

TEST(InspectCommand, TellsDraftThinWallsAndCorners) {
    const TemporaryFolder folder;
    const std::string stl = tunnelled(folder), map = folder / "draw.ply";
    const CommandResult told =
        slabwright_command({"inspect", stl, "--json", "--draft", "2", "--thin", "20", "--map", map});
    ASSERT_EQ(told.exit, 0) << told.err;
    EXPECT_EQ(schema_complaint(told.out, kSchema), "");
    const json draw = json::parse(told.out).at("draw");
    EXPECT_EQ(draw.at("limits").at("draft_deg"), 2);
    // The block's four sides, less the tunnel's two mouths, and a strip of the tunnel.
    const double sides = 2 * (80 + 40) * 60 - 2 * std::numbers::pi * 144;
    EXPECT_NEAR(draw.at("little_draft").at("area").get<double>(), sides, 0.05 * sides);
    EXPECT_NEAR(draw.at("undercut_to_draw").at("area").get<double>(), std::numbers::pi * 12 * 40, 20);
    EXPECT_NEAR(draw.at("undercut_to_draw").at("largest")[0].at("draft_deg").get<double>(), -90, 1);
    const json thin = draw.at("thin_walls").at("largest");
    ASSERT_FALSE(thin.empty()) << "18 mm stay over and under the tunnel";
    EXPECT_NEAR(thin[0].at("thickness").get<double>(), 18, 0.1);
    EXPECT_EQ(draw.at("inner_corners").at("places"), 0);
    const std::string ply = slabwright::support::slurp(map);
    EXPECT_EQ(ply.substr(0, 4), "ply\n");
    EXPECT_NE(ply.find("property float thickness\n"), std::string::npos);
    const CommandResult people = slabwright_command({"inspect", stl, "--draft", "2"});
    EXPECT_NE(people.out.find("draft under 2 deg: "), std::string::npos) << people.out;
    EXPECT_NE(people.out.find("undercut to the draw: "), std::string::npos) << people.out;
    EXPECT_EQ(slabwright_command({"inspect", stl, "--draft", "50"}).exit, 2);
    EXPECT_EQ(slabwright_command({"inspect", stl, "--map", folder / "no/such/place.ply"}).exit, 3);
}

TEST(InspectCommand, TellsSharpEdges) {
    const TemporaryFolder folder;
    const std::string stl = folder / "box.stl";
    {
        using namespace slabwright;
        Context context({.threads = 1});
        write_stl(stl, weld(context, shapes::box({0, 0, 0}, {30, 20, 10})));
    }
    const CommandResult told = slabwright_command({"inspect", stl, "--json"});
    ASSERT_EQ(told.exit, 0) << told.err;
    EXPECT_EQ(schema_complaint(told.out, kSchema), "");
    const json edges = json::parse(told.out).at("edges");
    EXPECT_EQ(edges.at("convex"), json({{"chains", 12}, {"closed", 0}, {"length", 240}}));
    EXPECT_EQ(edges.at("concave").at("chains"), 0);
    EXPECT_EQ(edges.at("longest")[0].at("sharpest_deg"), 90);
    const CommandResult people = slabwright_command({"inspect", stl});
    EXPECT_NE(people.out.find("240 mm convex in 12 chains (0 closed), 0 mm concave in 0 chains"),
              std::string::npos)
        << people.out;
    const json none = json::parse(slabwright_command({"inspect", stl, "--json", "--edges", "91"}).out);
    EXPECT_EQ(none.at("edges").at("convex").at("chains"), 0);
    EXPECT_EQ(slabwright_command({"inspect", stl, "--edges", "180"}).exit, 2);
}

TEST(InspectCommand, TellsNarrowCavitiesAndTheirTools) {
    const TemporaryFolder folder;
    const std::string stl = folder / "slot.stl";
    {
        using namespace slabwright;
        using Corner = std::array<Vec3f, 3>;
        std::vector<Corner> walls;  // 5 mm between two walls on a plate, 16 mm deep
        const auto box = [&](Vec3f low, Vec3f high) {
            for (const Corner& c : shapes::box(low, high)) walls.push_back(c);
        };
        box({0, 0, 0}, {80, 60, 2.5F});
        box({10, 10, 2}, {35, 50, 18});
        box({40, 10, 2}, {65, 50, 18});
        Context context({.threads = 1});
        write_stl(stl, weld(context, walls));
    }
    const CommandResult told = slabwright_command({"inspect", stl, "--tools", "fixed", "--json"});
    ASSERT_EQ(told.exit, 0) << told.err;
    EXPECT_EQ(schema_complaint(told.out, kSchema), "");
    const json cavities = json::parse(told.out).at("cavities");
    ASSERT_EQ(cavities.at("places"), 1) << cavities.dump();
    const json slot = cavities.at("slenderest")[0];
    EXPECT_NEAR(slot.at("width").get<double>(), 5, 1e-3);
    EXPECT_NEAR(slot.at("depth").get<double>(), 15.5, 1e-3);
    EXPECT_NEAR(slot.at("where")[0].get<double>(), 37.5, 1e-3);
    EXPECT_TRUE(slot.at("tool").is_null());
    EXPECT_EQ(slot.at("missing").at("diameter"), 5);
    const CommandResult people = slabwright_command({"inspect", stl, "--tools", "fixed"});
    EXPECT_NE(people.out.find("5.00 mm wide, 15.50 deep (3.1 times)"), std::string::npos) << people.out;
    EXPECT_NE(people.out.find("flat end mill 5 mm x "), std::string::npos) << people.out;
    const CommandResult metric = slabwright_command({"inspect", stl, "--tools", "metric"});
    EXPECT_NE(metric.out.find("tool 6 reaches all of it"), std::string::npos) << metric.out << metric.err;
    EXPECT_EQ(slabwright_command({"inspect", stl, "--slender", "4"}).out.find("mm wide"), std::string::npos);
    EXPECT_EQ(slabwright_command({"inspect", stl, "--narrow", "0.1"}).exit, 2);
}

}  // namespace
