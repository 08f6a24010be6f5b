// Feeds and speeds from the material's cutting data: whose they are, which line a tool gets, and what follows
// for it.
#include "engine/cutting_data.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>

#include "io/read/job_toml.h"
#include "io/slabwright.h"
#include "io/write/job_toml.h"
#include "kernels/errors.h"
#include "tests/support/files.h"
#include "tests/support/places.h"
#include "tests/support/schema.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

using nlohmann::json;

const std::string kData = support::checkout("tests/data/");

std::string tool_text(int number, const char* kind, double diameter, const std::string& more = "") {
    return "[[tool]]\nnumber = " + std::to_string(number) + "\nkind = \"" + kind +
           "\"\ndiameter = " + std::to_string(diameter) + "\nflute_length = 30.0\nstickout = 45.0\n" +
           "shank_diameter = " + std::to_string(diameter) + "\nholder_diameter = 32.0\nstepdown_max = 3.0\n" +
           more;
}

std::string line_text(const std::string& keys) {
    return "[[material.cutting]]\nsource = \"test cut of May\"\n" + keys;
}

const std::string kBall = tool_text(9, "ball", 6), kChart = "[material]\nchart = \"mdf\"\n";

Tool tool_of(const std::string& text) { return parse_job(text, "x").tools.front(); }

TEST(CuttingData, EveryLineOfAChartNamesItsSource) {
    for (const CuttingChart chart :
         {CuttingChart::mdf, CuttingChart::pine, CuttingChart::plywood, CuttingChart::foam}) {
        const auto lines = lines_of(chart);
        ASSERT_FALSE(lines.empty());
        EXPECT_NO_THROW(validate_cutting_data({lines.begin(), lines.end()}));
        for (std::size_t i = 0; i < lines.size(); ++i) {
            EXPECT_NE(lines[i].source.find(".com/"), std::string::npos) << lines[i].source;
            // No width belongs to two lines, and a wider cutter takes no thinner chip.
            if (i == 0) continue;
            EXPECT_GT(lines[i].diameter_min, lines[i - 1].diameter_max);
            EXPECT_GE(lines[i].chip_load, lines[i - 1].chip_load);
        }
    }
    EXPECT_TRUE(lines_of(CuttingChart::none).empty());
}

TEST(CuttingData, AToolThatStatesNoFeedGetsThatOfTheChart) {
    // 1/4 in in MDF: .012 in a tooth of two, 18 000 a minute unless the tool turns slower.
    EXPECT_NEAR(tool_of(kChart + tool_text(1, "flat", 6.35) + kBall).max_feed, 0.012 * 25.4 * 2 * 18000,
                1e-6);
    EXPECT_NEAR(
        tool_of(kChart + tool_text(1, "flat", 6.35, "max_rpm = 12000.0\nflutes = 3\n") + kBall).max_feed,
        0.012 * 25.4 * 3 * 12000, 1e-6);
    // As fast in pine and in foam, however fast tool and machine may turn: .005 and .004 in a tooth.
    for (const auto& [chart, inches] : {std::pair{"pine", 0.005}, {"foam", 0.004}}) {
        const Tool tool =
            tool_of("[machine]\nmax_rpm = 30000.0\n[material]\nchart = \"" + std::string(chart) + "\"\n" +
                    tool_text(1, "flat", 6.35, "max_rpm = 24000.0\n") + kBall);
        EXPECT_NEAR(tool.max_feed, inches * 25.4 * 2 * 18000, 1e-6) << chart;
    }
    // The machine's spindle is no faster than it is.
    EXPECT_NEAR(
        tool_of(kChart + "[machine]\nmax_rpm = 10000.0\n" + tool_text(1, "flat", 6.35) + kBall).max_feed,
        0.012 * 25.4 * 2 * 10000, 1e-6);
    // What it states stays; without data, or where no line is for it, everything is as without a chart.
    EXPECT_EQ(tool_of(kChart + tool_text(1, "flat", 6.35, "max_feed = 12345.0\n") + kBall).max_feed, 12345);
    EXPECT_EQ(tool_of(kChart + tool_text(1, "flat", 20) + kBall).max_feed, Tool{}.max_feed);
    EXPECT_EQ(tool_of(tool_text(1, "flat", 6.35) + kBall).max_feed, Tool{}.max_feed);
    EXPECT_EQ(tool_of(tool_text(1, "flat", 6.35) + kBall).max_rpm, Tool{}.max_rpm);
}

TEST(CuttingData, SurfaceSpeedIsKeptWithinTheSpindle) {
    const std::string line = line_text("chip_load = 0.1\nsurface_speed = 300.0\n");
    const Tool tool = tool_of(line + tool_text(1, "flat", 20) + kBall);
    EXPECT_NEAR(tool.max_rpm, 300e3 / (std::numbers::pi * 20), 1e-6);
    EXPECT_NEAR(tool.max_feed, 0.1 * 2 * tool.max_rpm, 1e-6);
    const Tool fast = tool_of("[machine]\nmin_rpm = 8000.0\n" + line + tool_text(1, "flat", 20) + kBall);
    EXPECT_EQ(fast.max_rpm, 8000);
    EXPECT_NEAR(fast.max_feed, 1600, 1e-9);
}

TEST(CuttingData, TheFirstOwnLineThatCoversAToolIsIts) {
    const std::string own = line_text("kind = \"ball\"\nchip_load = 0.05\n") +
                            line_text("diameter_max = 8.0\nflutes = 2\nchip_load = 0.06\n") +
                            line_text("kind = \"end-mill\"\nchip_load = 0.07\n");
    const Job job =
        parse_job(kChart + own + tool_text(1, "flat", 6.35) + tool_text(2, "ball", 6.35) +
                      tool_text(3, "flat", 6.35, "flutes = 3\n") + tool_text(4, "drill", 8.5) + kBall,
                  "x");
    const auto chip = [&](std::size_t i) {
        const CuttingData* const data = cutting_data_of(job.material, job.tools[i]);
        return data != nullptr ? data->chip_load : 0;
    };
    EXPECT_EQ(chip(0), 0.06);
    EXPECT_EQ(chip(1), 0.05);
    EXPECT_EQ(chip(2), 0.07) << "the house's chart is asked last";
    EXPECT_EQ(chip(3), 0);
    EXPECT_EQ(job.material.cutting.size(), 3u);
    const std::string text = job_toml(job);
    EXPECT_EQ(parse_job(text, "again").material.cutting, job.material.cutting);
    EXPECT_EQ(job_toml(parse_job(text, "again")), text);
}

TEST(CuttingData, LimitsOfToolsAreKeptAndTwiceIsOnce) {
    Job job = parse_job(kChart + tool_text(1, "flat", 3.175, "max_feed = 9000.0\n") +
                            tool_text(2, "flat", 12.7, "max_feed = 2000.0\nplunge_feed = 2500.0\n") + kBall,
                        "x");
    const Job once = with_cutting_data(job), twice = with_cutting_data(once);
    EXPECT_NEAR(once.tools[0].max_feed, 0.004 * 25.4 * 2 * 18000, 1e-6);
    EXPECT_EQ(once.tools[1].max_feed, 2000);
    EXPECT_EQ(once.tools[1].plunge_feed, 2000);
    EXPECT_EQ(job_toml(twice), job_toml(once));
    // Without data nothing is touched.
    EXPECT_EQ(job_toml(with_cutting_data(Job{})), job_toml(Job{}));
}

TEST(CuttingData, FaultsAreToldWithKeyAndLine) {
    struct Case {
        std::string text, code, words, place;
    };
    for (const Case& c : std::vector<Case>{
             {"[[material.cutting]]\nchip_load = 0.1\n", "job.missing_key", "material.cutting[1].source",
              "my:1"},
             {"[[material.cutting]]\nsource = \"a\"\n", "job.missing_key", "material.cutting[1].chip_load",
              "my:1"},
             {line_text("chip_load = 0.0\n"), "job.range", "chip_load is 0", "my:3"},
             {line_text("chip_load = 0.1\ndiameter_min = 5.0\ndiameter_max = 4.0\n"), "job.range",
              "diameter_max is 4", "my:5"},
             {"[[material.cutting]]\nsource = \"\"\nchip_load = 0.1\n", "job.range", "source is empty",
              "my:2"},
             {line_text("chip_load = 0.1\nkind = \"saw\"\n"), "job.word", "none of any, end-mill", "my:4"},
             {line_text("chipload = 0.1\n"), "job.unknown_key", "material.cutting.chipload", "my:3"},
             {"[material]\nchart = \"tooling board\"\n", "job.word", "none of none, mdf, pine, plywood, foam",
              "my:2"},
             {"[machine]\nmin_rpm = 20000.0\n", "job.range", "min_rpm is 20000", "my:2"}}) {
        try {
            (void)parse_job(c.text, "my");
            ADD_FAILURE() << "accepted: " << c.text;
        } catch (const Error& error) {
            EXPECT_EQ(error.code(), c.code) << error.what();
            EXPECT_NE(error.message().find(c.words), std::string::npos) << error.what();
            EXPECT_EQ(error.place(), c.place) << error.what();
        }
    }
}

TEST(CuttingData, APlanSaysWhoseFeedsItHasAndIsProven) {
    const support::TemporaryFolder folder;
    Context context;
    const std::string stl = kData + "half-sphere.stl", out = folder / "out";
    const std::string text =
        "[selection]\nmode = \"fixed\"\n" + line_text("kind = \"flat\"\nchip_load = 0.05\n") +
        "[[tool]]\nnumber = 1\nkind = \"face\"\ndiameter = 50.0\nflute_length = 20.0\nstickout = "
        "60.0\nshank_diameter = 20.0\nholder_diameter = 60.0\nstepdown_max = 4.0\n" +
        tool_text(2, "flat", 12) + kBall;
    write(context, plan(context, stl, parse_job(text, "x")), out);
    const std::string written = support::slurp(out + "/plan.json");
    EXPECT_EQ(support::schema_complaint(written, support::checkout("io/plan.schema.json")), "");
    const json document = json::parse(written);
    ASSERT_EQ(document["cutting_data"].size(), 1u);
    EXPECT_EQ(document["cutting_data"][0]["source"], "test cut of May");
    EXPECT_EQ(document["tools"][1]["max_feed"], 1800.0);
    std::string notes;
    for (const json& told : document["diagnostics"])
        if (told["code"].get<std::string>().starts_with("feeds."))
            notes += told["message"].get<std::string>() + "\n";
    EXPECT_NE(
        notes.find("tool 2: at most 18000 turns and 1800 mm a minute, by 0.05 mm a tooth (test cut of May)"),
        std::string::npos)
        << notes;
    EXPECT_NE(notes.find("tools 1, 9: no cutting data"), std::string::npos) << notes;
    for (const Diagnostic& v : verify(context, out, stl, {}, 1).violations)
        ADD_FAILURE() << v.code << v.message;
    // A plan without it says nothing of it.
    const std::string plain = folder / "plain";
    write(context, plan(context, stl, Job{}), plain);
    for (const char* word : {"cutting_data", "feeds.no_source", "\"chart\"", "min_rpm", "\"edges\""})
        EXPECT_EQ(support::slurp(plain + "/plan.json").find(word), std::string::npos) << word;
}

}  // namespace
}  // namespace slabwright
