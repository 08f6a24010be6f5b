// Tools of other programs' files: what they state, what the job adds, and what is refused with its place.
#include "io/read/tool_library.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <random>

#include "engine/tools/libraries.h"
#include "io/slabwright.h"
#include "io/write/job_toml.h"
#include "kernels/errors.h"
#include "tests/support/files.h"
#include "tests/support/seed.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

using support::spit;
using support::TemporaryFolder;

constexpr const char* kCsv =
    "# the shop's tools\n"
    "number;kind;name;diameter;flute_length;stickout;shank_diameter;holder_diameter;flutes;stepdown_max;"
    "plunges\n"
    "1;face;\"face mill; 50\";50;20;60;20;60;4;4;\n"
    "2;flat;\"1/2\"\" flat\";12.7;32;50;12.7;40;2;3.8;true\n"
    "\n"
    "3;ball;;6.35;30;45;6.35;32;;2.5;\n";

constexpr const char* kEndmill = R"({
  "version": 2,
  "name": "5mm Endmill",
  "shape": "endmill.fcstd",
  "parameter": {
    "CuttingEdgeHeight": "30.0000 mm",
    "Diameter": "5.0000 mm",
    "Length": "50.0000 mm",
    "ShankDiameter": "0.25 in"
  },
  "attribute": {"Flutes": "3"}
})";

constexpr const char* kRest =
    "stickout = 45.0\nholder_diameter = 30.0\nstepdown_max = 3.0\nflute_length = 30.0\n";

// The error of something, as "code place: message".
std::string error_of(const std::function<void()>& body) {
    try {
        body();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::usage);
        EXPECT_FALSE(error.remedy().empty());
        return error.code() + " " + std::filesystem::path(error.place()).filename().string() + ": " +
               error.message();
    }
    return "none";
}

TEST(ToolLibrary, CsvStatesToolsWhole) {
    const TemporaryFolder folder;
    spit(folder / "shop.csv", kCsv);
    const Job job = read_job("", folder / "shop.csv");
    ASSERT_EQ(job.tools.size(), 3u);
    EXPECT_EQ(job.tools[0].name, "face mill; 50");
    EXPECT_EQ(job.tools[0].flutes, 4);
    EXPECT_FALSE(job.tools[0].plunges);
    EXPECT_EQ(job.tools[1].name, "1/2\" flat");
    EXPECT_EQ(job.tools[1].diameter, 12.7);
    EXPECT_TRUE(job.tools[1].plunges);
    EXPECT_EQ(job.tools[2].kind, ToolKind::ball);
    EXPECT_TRUE(job.tools[2].plunges);  // as of every ball
    EXPECT_EQ(job.tools[2].flutes, Tool{}.flutes);
}

TEST(ToolLibrary, FreecadStatesShapesAndTheJobTheRest) {
    const TemporaryFolder folder;
    std::filesystem::create_directories(folder.path / "Library");
    std::filesystem::create_directories(folder.path / "Bit");
    spit(folder / "Bit/mill.fctb", kEndmill);
    std::string drill = kEndmill;
    drill.replace(drill.find("endmill"), 7, "drill");
    drill.replace(drill.find("\"Length\""), 8, "\"TipAngle\": \"118.00 °\", \"Length\"");
    spit(folder / "Library/drill.fctb", drill);
    spit(folder / "Library/shop.fctl",
         "{\"version\": 1, \"tools\": [\n {\"nr\": 4, \"path\": \"mill.fctb\"},\n"
         " {\"nr\": 7, \"path\": \"drill.fctb\"},\n {\"nr\": 9, \"path\": \"none.fctb\"}]}");
    const std::string more =
        "[[tool]]\nnumber = 4\nstickout = 33.0\n"
        "[[tool]]\nnumber = 5\nkind = \"ball\"\ndiameter = 6.0\nflute_length = 20.0\nstickout = 40.0\n"
        "shank_diameter = 6.0\nholder_diameter = 30.0\nstepdown_max = 2.0\n";
    const auto job_with = [&](const std::string& tools) {
        spit(folder / "job.toml", "[tools]\nlibrary = \"Library/shop.fctl\"\n" + tools);
        return read_job(folder / "job.toml");
    };
    const std::string rest = "stickout = 45.0\nholder_diameter = 30.0\nstepdown_max = 3.0\n";
    const Job job = job_with("numbers = [4, 7]\n" + rest + more);
    ASSERT_EQ(job.tools.size(), 3u);
    const Tool &mill = job.tools[0], &bit = job.tools[1], &ball = job.tools[2];
    EXPECT_EQ(mill.number, 4);
    EXPECT_EQ(mill.kind, ToolKind::flat);
    EXPECT_EQ(mill.name, "5mm Endmill");
    EXPECT_EQ(mill.diameter, 5);
    EXPECT_EQ(mill.flute_length, 30);
    EXPECT_NEAR(mill.shank_diameter, 6.35, 1e-12);
    EXPECT_EQ(mill.flutes, 3);
    EXPECT_EQ(mill.stickout, 33);  // a [[tool]] goes before [tools]
    EXPECT_EQ(mill.holder_diameter, 30);
    EXPECT_EQ(bit.kind, ToolKind::drill);
    EXPECT_EQ(bit.stickout, 45);
    EXPECT_EQ(ball.number, 5);
    EXPECT_EQ(ball.stickout, 40);

    EXPECT_EQ(error_of([&] { (void)job_with(rest); }), "tools.missing shop.fctl:4: there is no 'none.fctb'");
    EXPECT_EQ(error_of([&] { (void)job_with("numbers = [4, 8]\n" + rest); }),
              "tools.number shop.fctl: it has no tool 8");
    EXPECT_EQ(error_of([&] { (void)job_with("numbers = [4]\n"); }),
              "job.missing_key shop.fctl:2: tool[1].stickout is missing");
    EXPECT_EQ(error_of([&] {
                  (void)job_with("numbers = [4]\n" + rest + "[[tool]]\nnumber = 4\ndiameter = 6.0\n");
              }).substr(0, 26),
              "tools.conflict job.toml:9:");
    for (const auto& [text, said] :
         {std::pair{"[1]", "no object"},
          {"{\"tools\": 3}", "no list of tools"},
          {"{\"tools\": [{\"nr\": \"4\", \"path\": \"mill.fctb\"}]}", "a tool without nr and path"}}) {
        spit(folder / "Library/odd.fctl", text);
        spit(folder / "job.toml", "[tools]\nlibrary = \"Library/odd.fctl\"\n" + rest);
        const std::string error = error_of([&] { (void)read_job(folder / "job.toml"); });
        EXPECT_TRUE(error.starts_with("tools.syntax odd.fctl:1") && error.ends_with(said)) << error;
    }
    drill.replace(drill.find("118.00"), 6, "135.00");
    spit(folder / "Library/drill.fctb", drill);
    EXPECT_EQ(job_with("numbers = [7]\n" + rest).tools[0].point_deg, 135);
    EXPECT_EQ(error_of([&] { (void)job_with("numbers = [\"4\"]\n" + rest); }),
              "job.type job.toml:3: tools.numbers is not a list of whole numbers");
}

TEST(ToolLibrary, LinuxcncStatesNumbersAndDiameters) {
    const TemporaryFolder folder;
    spit(folder / "tool.tbl", "; the machine's\nT2 P2 D12.7 Z0 ;flat 1/2\n\nt3 p3 d6.35 z+0.0\n");
    const std::string kinds =
        "[[tool]]\nnumber = 2\nkind = \"flat\"\n[[tool]]\nnumber = 3\nkind = \"ball\"\n";
    spit(folder / "job.toml", fmt::format("[tools]\n{}shank_diameter = 6.0\n{}", kRest, kinds));
    const Job job = read_job(folder / "job.toml", folder / "tool.tbl");
    ASSERT_EQ(job.tools.size(), 2u);
    EXPECT_EQ(job.tools[0].diameter, 12.7);
    EXPECT_EQ(job.tools[0].name, "flat 1/2");
    EXPECT_EQ(job.tools[1].diameter, 6.35);
    EXPECT_EQ(job.tools[1].kind, ToolKind::ball);
    // Alone it does not say what its tools are.
    EXPECT_EQ(error_of([&] { (void)read_job("", folder / "tool.tbl"); }),
              "job.missing_key tool.tbl:2: tool[1].kind is missing");
}

TEST(ToolLibrary, WhatCannotBeTakenIsRefusedWithItsLine) {
    const TemporaryFolder folder;
    const auto of = [&](const std::string& name, const std::string& text) {
        spit(folder / name, text);
        return error_of([&] { (void)read_tool_library(folder.path / name); });
    };
    EXPECT_EQ(of("a.tbl", "T1 D6\nT2 D6 K4\n"), "tools.syntax a.tbl:2: 'K4' is no word of a tool table");
    EXPECT_EQ(of("a.tbl", "T1 D6mm\n"), "tools.value a.tbl:1: '6mm' is not a number");
    EXPECT_EQ(of("a.tbl", "\nD6\n"), "tools.syntax a.tbl:2: a row without a tool's number");
    EXPECT_EQ(of("a.tbl", "T1 T2\n"), "tools.syntax a.tbl:1: the word T stands twice");
    EXPECT_EQ(of("a.tbl", "T1.5 D6\n"), "tools.value a.tbl:1: T1.5 is no tool's number");
    EXPECT_EQ(of("a.tbl", "; nothing\n"), "tools.empty a.tbl: there are no tools in it");
    EXPECT_EQ(of("a.csv", "number,width\n1,2\n"), "tools.key a.csv:1: 'width' is no key of a tool");
    EXPECT_EQ(of("a.csv", "number,number\n1,2\n"), "tools.key a.csv:1: number stands twice");
    EXPECT_EQ(of("a.csv", "number,diameter\n1,2,3\n"), "tools.syntax a.csv:2: 3 cells under 2 keys");
    EXPECT_EQ(of("a.csv", "number,diameter\n1.5,2\n"),
              "tools.value a.csv:2: number is 1.5, not a whole number");
    EXPECT_EQ(of("a.csv", "number,plunges\n1,yes\n"),
              "tools.value a.csv:2: plunges is 'yes', not true or false");
    EXPECT_EQ(of("a.csv", "number,name\n1,\"half\n"), "tools.syntax a.csv:2: a quote is not closed");
    EXPECT_EQ(of("a.fctb", "{\n \"shape\": }"), "tools.syntax a.fctb:2: not JSON");
    EXPECT_EQ(of("a.fctb", "{\n \"shape\": \"dovetail.fcstd\"}"),
              "tools.shape a.fctb:2: a bit of the shape 'dovetail' cannot be planned with");
    std::string furlongs = kEndmill;
    furlongs.replace(furlongs.find("5.0000 mm"), 9, "5 furlongs");
    EXPECT_EQ(of("a.fctb", furlongs),
              "tools.unit a.fctb:7: Diameter is '5 furlongs', without a unit of length");
    EXPECT_EQ(of("a.txt", "T1"), "tools.format a.txt: tools are not read from files of this kind");
    EXPECT_EQ(error_of([&] { (void)read_tool_library(folder.path / "no.csv"); }).substr(0, 13),
              "tools.missing");
    EXPECT_EQ(error_of([&] { (void)job_from_toml("[tools]\nlibrary = \"a.csv\"\n", "line"); }).substr(0, 14),
              "tools.no_files");
}

TEST(ToolLibrary, TheHousesOwnAreKnownByName) {
    for (const std::string name : {"fixed", "shop", "forms", "metric", "luo"}) {
        const std::vector<Tool> listed = job_from_toml(default_job_toml(name), name).tools;
        const std::vector<Tool> named = job_from_toml("[tools]\nlibrary = \"" + name + "\"\n", name).tools;
        const std::vector<Tool> option = read_job("", name).tools;
        ASSERT_EQ(named.size(), listed.size()) << name;
        ASSERT_EQ(option.size(), listed.size()) << name;
        for (std::size_t i = 0; i < named.size(); ++i) {
            Job one, two, three;
            one.tools = {named[i]};
            two.tools = {listed[i]};
            three.tools = {option[i]};
            EXPECT_EQ(job_toml(one), job_toml(two)) << name;
            EXPECT_EQ(job_toml(one), job_toml(three)) << name;
        }
    }
    EXPECT_EQ(job_toml(Job{}), default_job_toml("fixed"));
}

TEST(ToolLibrary, TheShopsIsTheDefault) {
    EXPECT_EQ(default_job_toml(), default_job_toml("shop"));
    EXPECT_EQ(job_toml(default_job()), default_job_toml());
    EXPECT_EQ(job_toml(read_job("")), default_job_toml());
    EXPECT_EQ(job_toml(job_from_toml("", "nothing")), default_job_toml());
    EXPECT_EQ(job_toml(read_job("", "fixed")), job_toml(Job{}));
}

TEST(ToolLibrary, AListedToolGoesBeforeTheHousesOwn) {
    const std::string own =
        "[[tool]]\nnumber = 6\nstickout = 42.5\n"
        "[[tool]]\nnumber = 20\nkind = \"drill\"\ndiameter = 6.0\nflute_length = 40.0\nstickout = 50.0\n"
        "shank_diameter = 6.0\nholder_diameter = 30.0\nstepdown_max = 6.0\n";
    const Job job = job_from_toml("[tools]\nlibrary = \"shop\"\nnumbers = [1, 2, 3, 6]\n" + own, "job");
    ASSERT_EQ(job.tools.size(), 5u);
    EXPECT_EQ(job.tools[3].number, 6);
    EXPECT_EQ(job.tools[3].stickout, 42.5);
    EXPECT_EQ(job.tools[3].diameter, shop_library()[5].diameter);
    EXPECT_EQ(job.tools[2].stickout, shop_library()[2].stickout);
    EXPECT_EQ(job.tools[4].kind, ToolKind::drill);

    const auto of = [](const std::string& text, const std::string& library = {}) {
        return error_of([&] {
            const TemporaryFolder folder;
            spit(folder / "job.toml", text);
            (void)read_job(folder / "job.toml", library);
        });
    };
    EXPECT_EQ(of("\n[tools]\nlibrary = \"shoppe\"\n"),
              "tools.library job.toml:3: there is no tool library \"shoppe\"");
    EXPECT_EQ(of("", "default"), "tools.library : there is no tool library \"default\"");
    EXPECT_EQ(of("", "shop.csv").substr(0, 13), "tools.missing") << "a file by its ending";
    EXPECT_EQ(of("", "./shop").substr(0, 12), "tools.format") << "a file by its folder";
    EXPECT_EQ(of("[tools]\nlibrary = \"shop\"\nstickout = 40.0\n"),
              "tools.conflict job.toml:3: the library shop states stickout of every tool");
    EXPECT_EQ(of("[tools]\nlibrary = \"shop\"\nnumbers = [1, 2, 3, 12]\n"),
              "tools.number shop: it has no tool 12");
    EXPECT_EQ(of("[tools]\nlibrary = \"shop\"\n[[tool]]\nnumber = 6\ndiameter = \"wide\"\n"),
              "job.type job.toml:5: tool[6].diameter is a text, not a number");
    EXPECT_EQ(error_of([&] { (void)default_job_toml("default"); }),
              "job.library : there is no tool library \"default\"");
}

TEST(ToolLibrary, DamagedFilesAreReadOrRefused) {
    std::mt19937 random(test::seed());
    const TemporaryFolder folder;
    for (const auto& [name, text] : {std::pair<std::string, std::string>{"a.csv", kCsv},
                                     {"a.fctb", kEndmill},
                                     {"a.tbl", "T2 P2 D12.7 Z0 ;flat 1/2\nT3 P3 D6.35\n"}})
        for (int i = 0; i < 300; ++i) {
            std::string damaged = text;
            for (int k = std::uniform_int_distribution<int>(1, 4)(random); k > 0; --k) {
                const std::size_t at = random() % damaged.size();
                if (random() % 3 == 0) damaged.erase(at, 1 + random() % 5);
                else damaged[at] = static_cast<char>(random());
                if (damaged.empty()) damaged = " ";
            }
            spit(folder / name, damaged);
            try {
                (void)read_job("", folder / name);
            } catch (const Error& error) {
                EXPECT_EQ(error.kind(), ErrorKind::usage) << damaged;
            }
        }
}

}  // namespace
}  // namespace slabwright
