// Bull-nose end mills from the job to the proof: what they are told by, what they leave, and who takes it.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <string>

#include "engine/stock/standing.h"
#include "engine/tools/tools.h"
#include "io/posts/tool_table.h"
#include "io/read/tool_library.h"
#include "io/slabwright.h"
#include "io/write/job_toml.h"
#include "kernels/errors.h"
#include "kernels/stock/stock.h"
#include "nlohmann/json.hpp"
#include "tests/support/files.h"
#include "tests/support/places.h"
#include "tests/support/seed.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

using nlohmann::json;
using support::slurp;
using support::spit;
using support::TemporaryFolder;

const std::string kData = support::checkout("tests/data/");

std::string tool_text(int number, const char* kind, double diameter, const char* more = "") {
    const bool face = std::string(kind) == "face";
    return "[[tool]]\nnumber = " + std::to_string(number) + "\nkind = \"" + kind +
           "\"\ndiameter = " + std::to_string(diameter) + "\nflute_length = 32.0\nstickout = 60.0\n" +
           "shank_diameter = " + std::to_string(face ? 20.0 : diameter) +
           "\nholder_diameter = 40.0\nstepdown_min = 1.0\nstepdown_max = 3.5\nname = \"tool " +
           std::to_string(number) + "\"\n" + (face ? "stepover = 0.6\nhelix_deg = 0.0\n" : "") + more;
}

std::string bull_nose_text(const char* corner = "corner_radius = 2.0\n") {
    return tool_text(4, "bull-nose", 12, corner);
}

std::string code_of(const std::string& toml) {
    try {
        const Job job = job_from_toml(toml, "t");
        validate(job);
    } catch (const Error& error) {
        return error.code() + ": " + error.message();
    }
    return "none";
}

TEST(BullNose, IsReadFromAJobAndWrittenAgain) {
    const std::string rest = tool_text(1, "face", 50) + tool_text(3, "ball", 6);
    const Job job = job_from_toml(rest + bull_nose_text(), "t");
    ASSERT_EQ(job.tools.size(), 3u);
    const Tool& tool = job.tools[2];
    EXPECT_EQ(tool.kind, ToolKind::bull_nose);
    EXPECT_EQ(tool.corner_radius, 2);
    EXPECT_FALSE(tool.plunges);
    EXPECT_EQ(cutter_shape(tool), (CutterShape{6, 2, 0}));
    EXPECT_NEAR(core_diameter_of(tool), 3.6, 1e-12);
    EXPECT_TRUE(is_end_mill(tool.kind) && mills(tool.kind) && roughs_layers(tool.kind));
    EXPECT_FALSE(roughs_layers(ToolKind::ball) || roughs_layers(ToolKind::face));
    const Job again = job_from_toml(job_toml(job), "again");
    EXPECT_EQ(again.tools[2].kind, ToolKind::bull_nose);
    EXPECT_EQ(again.tools[2].corner_radius, 2);
}

TEST(BullNose, CornersThatMakeNoneAreRefused) {
    const std::string rest = tool_text(1, "face", 50) + tool_text(3, "ball", 6);
    EXPECT_EQ(code_of(rest + bull_nose_text()), "none");
    for (const char* corner : {"", "corner_radius = 0.0\n", "corner_radius = 6.0\n", "corner_radius = 7.0\n",
                               "corner_radius = -1.0\n"})
        EXPECT_NE(code_of(rest + bull_nose_text(corner)).find("tool[3].corner_radius"), std::string::npos)
            << corner;
    EXPECT_NE(code_of(rest + tool_text(2, "flat", 12, "corner_radius = 1.0\n")).find("no bull-nose"),
              std::string::npos);
}

TEST(BullNose, RoughsWhereThereIsNoFlatAndAFlatFollowsIt) {
    const std::string rest = tool_text(1, "face", 50) + tool_text(3, "ball", 6);
    const Job alone = job_from_toml(rest + bull_nose_text(), "t");
    EXPECT_EQ(fixed_tools(alone).rough.kind, ToolKind::bull_nose);
    EXPECT_TRUE(fixed_tools(alone).rest.empty());
    // Where there is one, the fixed set begins with the flat.
    const Job both =
        job_from_toml(rest + bull_nose_text() + tool_text(5, "flat", 12) + tool_text(6, "flat", 20), "t");
    EXPECT_EQ(fixed_tools(both).rough.number, 5);
    const Tool& bull_nose = both.tools[2];
    const std::vector<Tool> after = rest_tools(both, bull_nose, 6);
    ASSERT_EQ(after.size(), 1u);
    EXPECT_EQ(after[0].number, 5);  // as wide as it is
    const Job wide = job_from_toml(rest + bull_nose_text() + tool_text(6, "flat", 20), "t");
    ASSERT_EQ(rest_tools(wide, wide.tools[2], 6).size(), 1u);
    EXPECT_EQ(rest_tools(wide, wide.tools[2], 6)[0].number, 6);  // the narrowest there is
    EXPECT_TRUE(rest_tools(both, both.tools[3], 6).empty());     // after the narrower flat as before
}

TEST(BullNose, GoesIntoToolTablesAndComesBack) {
    const TemporaryFolder folder;
    const Job job = job_from_toml(
        tool_text(1, "face", 50) + tool_text(3, "ball", 6) + bull_nose_text("corner_radius = 1.25\n"), "t");
    const std::string table = tool_table(job, {});
    EXPECT_NE(table.find("T4 P4 D12 Z0 ;tool 4, bull-nose R1.25\n"), std::string::npos) << table;
    spit(folder / "tool.tbl", table);
    const auto tools = read_tool_library(folder.path / "tool.tbl");
    const auto stated = [&](std::size_t tool, const std::string& key) {
        return std::any_of(tools[tool].values.begin(), tools[tool].values.end(),
                           [&](const StatedValue& v) { return v.first == key; });
    };
    ASSERT_EQ(tools.size(), 3u);
    EXPECT_TRUE(stated(2, "corner_radius") && stated(2, "kind") && stated(2, "name"));
    EXPECT_FALSE(stated(1, "corner_radius") || stated(1, "kind"));
}

TEST(BullNose, IsReadFromFreecadsBits) {
    const TemporaryFolder folder;
    const auto job_of = [&](const std::string& parameter) {
        spit(folder / "bit.fctb",
             R"({"version": 2, "name": "6 mm Bull Nose", "shape": "bullnose.fcstd", "parameter": {
  "CuttingEdgeHeight": "20.0 mm", "Diameter": "6.0 mm", )" +
                 parameter + R"("Length": "50.0 mm", "ShankDiameter": "6.0 mm"}, "attribute": {}})");
        spit(folder / "tools.fctl", R"({"version": 1, "tools": [ {"nr": 4, "path": "bit.fctb"}]})");
        spit(folder / "job.toml",
             "[tools]\nlibrary = \"tools.fctl\"\nstickout = 45.0\nholder_diameter = 30.0\nstepdown_max = "
             "3.0\n");
        return read_job(folder / "job.toml");
    };
    const Job corner = job_of("\"CornerRadius\": \"1.5 mm\", ");
    EXPECT_EQ(corner.tools[0].kind, ToolKind::bull_nose);
    EXPECT_EQ(corner.tools[0].corner_radius, 1.5);
    // As FreeCAD had it before: the radius of the floor.
    EXPECT_NEAR(job_of("\"FlatRadius\": \"2.2 mm\", ").tools[0].corner_radius, 0.8, 1e-12);
    try {
        (void)job_of("");
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.code(), "tools.shape");
    }
}

// The upper bound that links go by is one after a bull-nose, and says something.
TEST(BullNose, WhatMayStandAfterItIsABound) {
    std::mt19937 random(test::seed());
    std::uniform_real_distribution<double> place(-4, 44), up(0.5, 14), step(-8, 8);
    constexpr double top = 15;
    const CutterShape cutter{6, 2, 0};
    const CutterEnd end = cutter_end({6, 2, 0});
    const CellGrid grid{0.003, 0.004, 0.0917, 436, 436};
    for (int trial = 0; trial < 4; ++trial) {
        Stock stock(grid);
        stock.add_slab(0, top);
        Standing standing({0, 0}, {40, 40}, top);
        std::array<double, 3> at{place(random), place(random), up(random)};
        for (int move = 0; move < 60; ++move) {
            std::array<double, 3> to{at[0] + step(random), at[1] + step(random), at[2]};
            if (move % 5 == 3) to[2] = up(random);
            stock.cut(end, at, to);
            standing.cut(cutter, at, to);
            at = to;
        }
        std::size_t known = 0, cut = 0;
        for (int j = 2; j < grid.ny; j += 7)
            for (int i = 2; i < grid.nx; i += 7) {
                const double exact = stock.top(grid.index(i, j)),
                             bound = standing.top(0.01, {grid.x(i), grid.y(j)}, {grid.x(i), grid.y(j)});
                ASSERT_GE(bound, exact) << "trial " << trial << " at " << grid.x(i) << ' ' << grid.y(j);
                if (exact >= top - 1) continue;
                ++cut;
                known += static_cast<std::size_t>(bound <= exact + 1.5);
            }
        EXPECT_GT(2 * known, cut) << "the bound says nothing";
        // No exact point is within the cutter where it may go down to; a cell's diagonal at the rim excepted.
        for (int query = 0; query < 50; ++query) {
            const std::array<double, 2> p{place(random), place(random)};
            const double tip = standing.free_tip(cutter, p, p);
            sweep(grid, cutter_end({5, 2, 0}), {p[0], p[1], tip}, {p[0], p[1], tip},
                  [&](std::size_t c, double z) {
                      ASSERT_GE(z + 1e-3, stock.top(c)) << "trial " << trial << " at " << p[0] << ' ' << p[1];
                  });
        }
    }
}

json planned(const TemporaryFolder& folder, const std::string& name, const std::string& toml) {
    Context context;
    const Job job = job_from_toml(toml, name);
    const std::string out = folder / name, stl = kData + "pump-cover.stl";
    write(context, plan(context, stl, job), out);
    const VerifyResult result = verify(context, out, stl, {}, 1);
    json proof = json::parse(slurp(out + "/verify.json"));
    for (const Diagnostic& d : result.violations) ADD_FAILURE() << name << ": " << d.code << ' ' << d.message;
    proof["plan"] = json::parse(slurp(out + "/plan.json"));
    return proof;
}

std::map<std::string, int> operations_of(const json& proof, int tool) {
    std::map<std::string, int> of;
    for (const json& layer : proof["plan"]["layers"])
        for (const json& op : layer["operations"])
            if (op["tool"] == tool) ++of[op["kind"]];
    return of;
}

TEST(BullNose, PlansWithItAreProvenAndTheFilletIsSeen) {
    const TemporaryFolder folder;
    const std::string rest = tool_text(1, "face", 50) + tool_text(3, "ball", 6, "plunges = true\n"),
                      fixed = "[selection]\nmode = \"fixed\"\n";
    const json alone = planned(folder, "alone", fixed + rest + bull_nose_text()),
               followed = planned(
                   folder, "followed",
                   "[selection]\ncompare = false\n" + rest + bull_nose_text() + tool_text(5, "flat", 6));
    EXPECT_GT(operations_of(alone, 4)["rough"], 0);
    EXPECT_EQ(alone["plan"]["tools"][2]["kind"], "bull-nose");
    EXPECT_EQ(alone["plan"]["tools"][2]["corner_radius"], 2.0);
    // The corners at the foot of walls stay, and are told as out of every tool's reach, unless a flat
    // follows.
    EXPECT_GT(operations_of(followed, 4)["rough"], 0);
    EXPECT_GT(operations_of(followed, 5)["corner"], 0);
    EXPECT_GT(alone["totals"]["unreachable_mm2"].get<double>(),
              followed["totals"]["unreachable_mm2"].get<double>() + 20);
}

}  // namespace
}  // namespace slabwright
