// The job: defaults that are valid, a file that round-trips, and errors that name file, line and the key that
// was meant.
#include "engine/job.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>

#include "engine/base_board.h"
#include "io/read/job_toml.h"
#include "io/text/job_keys.h"
#include "io/write/job_toml.h"
#include "kernels/errors.h"
#include "tests/support/seed.h"

using namespace slabwright;

namespace {

Error error_of(const std::string& text) {
    try {
        (void)parse_job(text, "my.toml");
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::usage);
        return error;
    }
    ADD_FAILURE() << "accepted: " << text;
    return Error(ErrorKind::usage, "", "");
}

bool is_valid(const std::function<void(Job&)>& change) {
    Job job;
    change(job);
    try {
        validate(job);
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::usage);
        return false;
    }
    return true;
}

/// Gives every key a value of its own, so that a round trip that drops or swaps one is seen.
struct Scramble {
    std::mt19937 random;
    int tools = 0;
    double real(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); }
    void table(const char*, const char*) {}
    void required() {}
    void key(const char* name, double& value, const char*) {
        const std::string_view key(name);
        if (key.starts_with("rapid_") || key.starts_with("acceleration_")) value = real(100, 200);
        else value = value == 0 ? real(0, 1e-3) : value * (1 - real(0, 0.005));
    }
    void key(const char*, int& value, const char*) { value += 2; }
    void key(const char*, bool& value, const char*) { value = !value; }
    void key(const char*, std::string& value, const char*) { value += " \"quoted\" \\ \n\t \xC3\xA4"; }
    void key(const char* name, std::vector<double>& value, const char*) {
        if (name == std::string_view("thicknesses")) value = {6.35, 12.7, real(18, 19), 25.4};
        else if (name == std::string_view("board_m2")) value = {real(10, 20)};
        else if (name == std::string_view("pin")) value = {1, real(2, 3)};
        else if (name == std::string_view("skin_box")) value = {0, 1, real(0, 2), 3, 4, 5};
        else value = {1, 2, real(0.1, 3)};
    }
    void degrees(const char*, double& value, const char*) {
        value = std::round(real(0, 40)) * std::numbers::pi / 180;
    }
    template <class Enum, std::size_t N>
    void word(const char*, Enum& value, const Word<Enum> (&words)[N], const char*) {
        value = words[(static_cast<std::size_t>(value) + 1) % N].value;
    }
};

/// The values of all keys, a line each.
struct Values {
    std::string text;
    void table(const char*, const char*) {}
    void required() {}
    template <class Value>
    void key(const char* name, Value& value, const char*) {
        text += fmt::format("{} = {}\n", name, value);
    }
    void degrees(const char* name, double& value, const char*) {
        text += fmt::format("{} = {:.9f}\n", name, value);
    }
    template <class Enum, std::size_t N>
    void word(const char* name, Enum& value, const Word<Enum> (&)[N], const char*) {
        text += fmt::format("{} = {}\n", name, static_cast<int>(value));
    }
};

std::string values_of(Job job) {
    Values values;
    visit_job_keys(job, values);
    for (Tool& tool : job.tools) visit_tool_keys(tool, values);
    return values.text;
}

}  // namespace

TEST(Job, DefaultsAreValidAndRoundTrip) {
    const Job defaults;
    EXPECT_NO_THROW(validate(defaults));
    const std::string text = job_toml(defaults);
    const Job read = parse_job(text, "defaults");
    EXPECT_EQ(job_toml(read), text);
    EXPECT_EQ(read.tools.size(), 3u);
    EXPECT_EQ(read.tools[1].stepdown_max, defaults.tools[1].stepdown_max);
    EXPECT_EQ(read.tools[1].helix_rad, defaults.tools[1].helix_rad);
    EXPECT_EQ(read.material.min_thickness, defaults.material.min_thickness);
    EXPECT_EQ(read.material.source, defaults.material.source);
    EXPECT_EQ(read.material.transform, CoefficientTransform::oblique);
    const Job empty = parse_job("", "empty");
    EXPECT_EQ(job_toml(empty), text) << "what a file leaves out keeps its default";
}

TEST(Job, EveryKeyRoundTrips) {
    const unsigned seed = test::seed();
    Job job;
    Scramble scramble{std::mt19937(seed)};
    visit_job_keys(job, scramble);
    for (Tool& tool : job.tools) visit_tool_keys(tool, scramble);
    for (Tool& tool : job.tools) tool.corner_radius = tool.taper_deg = 0;  // not every kind has them
    for (Tool& tool : job.tools)
        if (tool.kind != ToolKind::drill) tool.point_deg = Tool{}.point_deg;
    for (Tool& tool : job.tools) tool.holder_profile[1] = tool.holder_diameter;  // the nose, told twice
    job.tools[1].kind = ToolKind::bull_nose;
    job.tools[1].corner_radius = scramble.real(0.5, 2);
    job.tools[2].kind = ToolKind::tapered_ball;
    job.tools[2].corner_radius = scramble.real(0.5, 2);
    job.tools[2].taper_deg = scramble.real(3, 20);
    const std::string text = job_toml(job);
    EXPECT_NE(text, job_toml(Job{}));
    const Job read = parse_job(text, "scrambled");
    EXPECT_EQ(job_toml(read), text);
    EXPECT_EQ(values_of(read), values_of(job));
    EXPECT_EQ(read.machine.name, job.machine.name);
    EXPECT_EQ(read.slabs.thicknesses, job.slabs.thicknesses);
    EXPECT_EQ(read.layers.strategy, LayerStrategy::combined);
    EXPECT_EQ(read.cutting.finish_feed, job.cutting.finish_feed);
    EXPECT_EQ(read.tools[2].stickout, job.tools[2].stickout);
    EXPECT_EQ(read.tools[0].kind, ToolKind::drill);
    EXPECT_EQ(read.tools[1].kind, ToolKind::bull_nose);
    EXPECT_EQ(read.tools[1].corner_radius, job.tools[1].corner_radius);
    EXPECT_EQ(read.tools[0].point_deg, job.tools[0].point_deg);
    EXPECT_NE(read.tools[0].point_deg, Tool{}.point_deg);
    EXPECT_EQ(read.tools[2].taper_deg, job.tools[2].taper_deg);
    EXPECT_EQ(read.tools[2].holder_profile, job.tools[2].holder_profile);
}

TEST(Job, EveryKeyIsCommented) {
    const std::string text = job_toml(Job{});
    std::size_t keys = 0, comments = 0;
    for (std::size_t begin = 0; begin < text.size();) {
        const std::size_t end = text.find('\n', begin);
        const std::string line = text.substr(begin, end - begin);
        if (line.find(" = ") != std::string::npos && line[0] != '#') {
            ++keys;
            if (line.find("  # ") != std::string::npos) ++comments;
        }
        begin = end + 1;
    }
    EXPECT_GT(keys, 100u);
    EXPECT_GE(comments, keys - 3) << "only names go without a comment";
}

TEST(Job, ValuesAreTaken) {
    const Job job = parse_job(
        "units = \"in\"\n[slabs]\nthicknesses = [12, 19.05]\n[machine]\nframe = \"layer-top\"\nclearance = "
        "5\n[layers]\nfinder = "
        "\"both\"\nsaddles_constrain = true\n"
        "[[tool]]\nnumber = 7\nkind = \"ball\"\ndiameter = 3.175\nflute_length = 25\nstickout = "
        "40\nshank_diameter = 3.175\nholder_diameter = "
        "32\nstepdown_max = 1.5\nhelix_deg = 45\n",
        "x");
    EXPECT_EQ(job.units, LengthUnit::inch);
    EXPECT_EQ(job.slabs.thicknesses, (std::vector<double>{12, 19.05}));
    EXPECT_EQ(job.machine.frame, Frame::layer_top);
    EXPECT_EQ(job.machine.clearance, 5);
    EXPECT_EQ(job.layers.finder, Finder::both);
    EXPECT_TRUE(job.layers.saddles_constrain);
    ASSERT_EQ(job.tools.size(), 1u) << "a [[tool]] replaces the library";
    EXPECT_EQ(job.tools[0].number, 7);
    EXPECT_NEAR(job.tools[0].helix_rad, std::numbers::pi / 4, 1e-15);
    EXPECT_TRUE(job.tools[0].plunges) << "a ball end mill does, unless the job says otherwise";
}

TEST(Job, DepthAndLengthOfAFileAreBounded) {
    const auto repeated = [](const std::string& piece, std::size_t times) {
        std::string text;
        for (std::size_t i = 0; i < times; ++i) text += piece;
        return text;
    };
    const std::size_t many = 50'000;
    const std::string deep = repeated("a.", many) + "a";
    for (const std::string& text :
         {deep + " = 1\n", "[" + deep + "]\n", "[[" + deep + "]]\n", "machine = {" + deep + " = 1}\n",
          repeated("\"a b\" . ", many) + "a = 1\n", repeated("'#'.", many) + "a = 1\n",
          "x = [{a = \"\"\" # \"\"\"\"\", " + deep + " = 1}]\n", "x = " + repeated("[", many) + "\n",
          "x = " + repeated("{a = ", many) + "\n", repeated("[a]\n", many), repeated("[[a]]\n", many),
          repeated("a", 1 << 20) + " = 1\n", "[machine]\n" + repeated("a", 1 << 20) + " = 1\n",
          "units = \"" + repeated("a", 1 << 20) + "\"\n"}) {
        const Error error = error_of(text);
        EXPECT_LT(std::string(error.what()).size(), 1000u) << text.substr(0, 60);
        EXPECT_NE(error.place().find("my.toml"), std::string::npos);
    }
    // Fifty thousand keys of their own: the first is told.
    std::string wide;
    for (std::size_t i = 0; i < many; ++i) wide += "a.b" + std::to_string(i) + " = 1\n";
    EXPECT_EQ(error_of(wide).code(), "job.unknown_key");
    // What looks like a deep key inside a text or a comment is none.
    const std::string harmless = "# " + deep + "\n[machine]\nname = \"" + deep + "\\\"" + deep + "\" # " +
                                 deep + "\n[material]\nname = \"\"\"" + deep + "\n\"\"\"\nsource = '" + deep +
                                 "'\n[tolerances]\ngouge = 0.02 # a.b\n";
    EXPECT_EQ(parse_job(harmless, "x").tolerances.gouge, 0.02);
}

// Within which a tool has no edge, and how steeply it may go down because of that.
TEST(Job, ToolsHaveACoreUnlessTheyPlunge) {
    const Job job;
    const Tool &face = job.tools[0], &flat = job.tools[1], &ball = job.tools[2];
    EXPECT_DOUBLE_EQ(core_diameter_of(face), 40);
    EXPECT_DOUBLE_EQ(core_diameter_of(flat), 0.3 * 12.7);
    EXPECT_EQ(core_diameter_of(ball), 0);
    EXPECT_EQ(ramp_limit_deg(face), 2);
    EXPECT_EQ(ramp_limit_deg(flat), 10);
    EXPECT_EQ(ramp_limit_deg(ball), 90);
    EXPECT_NEAR(core_recess(face), 40 * std::tan(2 * std::numbers::pi / 180), 1e-12);
    EXPECT_EQ(core_recess(ball), 0);
    Tool plunging = flat;
    plunging.plunges = true;
    EXPECT_EQ(core_diameter_of(plunging), 0);
    const Job read = parse_job(
        "[[tool]]\nnumber = 7\nkind = \"flat\"\ndiameter = 10\nflute_length = 25\nstickout = "
        "40\nshank_diameter = 10\nstepdown_max = 3\nholder_diameter = 32\ncore_diameter = 4\n"
        "ramp_deg = 3\n",
        "x");
    EXPECT_EQ(core_diameter_of(read.tools[0]), 4);
    EXPECT_EQ(ramp_limit_deg(read.tools[0]), 3);
    EXPECT_FALSE(is_valid([](Job& j) { j.tools[0].core_diameter = 50; })) << "no edge at all";
    EXPECT_FALSE(is_valid([](Job& j) { j.tools[0].core_diameter = 20, j.tools[0].plunges = true; }));
    EXPECT_FALSE(is_valid([](Job& j) { j.tools[2].core_diameter = 1, j.tools[2].plunges = false; }));
    EXPECT_FALSE(is_valid([](Job& j) { j.tools[0].ramp_deg = 91; }));
    EXPECT_TRUE(is_valid([](Job& j) { j.tools[0].core_diameter = 20, j.tools[0].ramp_deg = 0; }));
}

TEST(Job, UnknownKeysNameTheNearest) {
    Error error = error_of("# a job\n[machine]\nclearence = 5\n");
    EXPECT_EQ(error.code(), "job.unknown_key");
    EXPECT_EQ(error.place(), "my.toml:3");
    EXPECT_NE(error.remedy().find("machine.clearance"), std::string::npos) << error.what();
    error = error_of("unit = \"mm\"\n");
    EXPECT_NE(error.remedy().find("units"), std::string::npos);
    error = error_of("\n[machines]\nclearance = 5\n");
    EXPECT_EQ(error.place(), "my.toml:2");
    EXPECT_NE(error.remedy().find("machine"), std::string::npos);
    EXPECT_EQ(parse_job("[material]\ntransform = \"printed\"\nsource = \"own\"\n", "job").material.transform,
              CoefficientTransform::printed);
    error = error_of("[material]\nclearance = 5\n");
    EXPECT_NE(error.remedy().find("machine.clearance"), std::string::npos)
        << "right key, wrong table: " << error.what();
    error = error_of("[[tool]]\nnumber = 1\ndiametre = 5\n");
    EXPECT_EQ(error.place(), "my.toml:3");
    EXPECT_NE(error.remedy().find("tool.diameter"), std::string::npos);
}

TEST(Job, WrongTypesAndWordsNameFileAndLine) {
    for (const char* text : {"\n[machine]\nclearance = \"5\"\n", "\n[machine]\nclearance = true\n",
                             "\n[machine]\nclearance = nan\n", "\n[machine]\nclearance = inf\n",
                             "\n[machine]\nclearance = [5]\n", "\n[slabs]\nthicknesses = 19\n",
                             "\n[slabs]\nthicknesses = [19, \"25\"]\n", "\n[machine]\nname = 5\n",
                             "\n[layers]\nsaddles_constrain = 1\n", "\n\ntool = 5\n", "\n\nmachine = 5\n",
                             "\n\nallow_undercut = \"no\"\n", "\n[machine]\nclearance = 2026-01-01\n"}) {
        const Error error = error_of(text);
        EXPECT_EQ(error.code(), "job.type") << text;
        EXPECT_EQ(error.place(), "my.toml:3") << text << error.what();
        EXPECT_FALSE(error.remedy().empty());
    }
    const Error word = error_of("[layers]\nstrategy = \"optimum\"\n");
    EXPECT_EQ(word.code(), "job.word");
    EXPECT_EQ(word.place(), "my.toml:2");
    EXPECT_NE(word.remedy().find("optimal"), std::string::npos);
    const Error integer = error_of("[[tool]]\nnumber = 1.5\n");
    EXPECT_EQ(integer.code(), "job.type");
    const Error missing = error_of("[[tool]]\nnumber = 1\nkind = \"flat\"\n");
    EXPECT_EQ(missing.code(), "job.missing_key");
    EXPECT_NE(missing.message().find("diameter"), std::string::npos);
}

TEST(Job, RangesNameFileAndLine) {
    Error error = error_of("[machine]\n\nclearance = -5\n");
    EXPECT_EQ(error.code(), "job.range");
    EXPECT_EQ(error.place(), "my.toml:3");
    EXPECT_NE(error.message().find("machine.clearance"), std::string::npos);
    error = error_of("[slabs]\nthicknesses = [25, 19]\n");
    EXPECT_EQ(error.place(), "my.toml:2");
    error = error_of("[slabs]\nthicknesses = []\n");
    EXPECT_EQ(error.place(), "my.toml:2");
    const std::string tool =
        "[[tool]]\nnumber = 3\nkind = \"flat\"\ndiameter = 6\nflute_length = 25\nstickout = "
        "40\nshank_diameter = 6\nholder_diameter = "
        "32\nstepdown_max = 2\n";
    error = error_of(tool + tool);
    EXPECT_EQ(error.place(), "my.toml:11") << "the second tool's number";
    error = error_of(tool + "stepdown_min = 3\n");
    EXPECT_NE(error.message().find("stepdown_max"), std::string::npos);
}

TEST(Job, BrokenTomlNamesTheLine) {
    for (const char* text : {"[machine\n", "a = = 3\n", "x\n", "[machine]\nclearance = 1\nclearance = 2\n",
                             "units = \"mm\n", "\xFF\xFE\n", "a = 1,5\n"}) {
        const Error error = error_of(text);
        EXPECT_EQ(error.code(), "job.syntax") << text;
        EXPECT_EQ(error.place().rfind("my.toml:", 0), 0u) << error.place();
    }
}

TEST(Job, GarbageNeverDoesMoreThanAnError) {
    const unsigned seed = test::seed();
    std::mt19937 random(seed);
    const std::string good = job_toml(Job{});
    int refused = 0;
    for (int round = 0; round < 300; ++round) {
        std::string text = good;
        for (int k = std::uniform_int_distribution<int>(1, 4)(random); k > 0; --k) {
            const std::size_t at = std::uniform_int_distribution<std::size_t>(0, text.size() - 1)(random);
            switch (std::uniform_int_distribution<int>(0, 2)(random)) {
                case 0:
                    text[at] = static_cast<char>(std::uniform_int_distribution<int>(0, 255)(random));
                    break;
                case 1:
                    text.erase(at, 5);
                    break;
                default:
                    text.insert(
                        at, text.substr(
                                std::uniform_int_distribution<std::size_t>(0, text.size() - 1)(random), 9));
            }
        }
        try {
            validate(parse_job(text, "garbage"));  // what it accepts is valid
        } catch (const Error& error) {
            EXPECT_EQ(error.kind(), ErrorKind::usage);
            ++refused;
        }
    }
    EXPECT_GT(refused, 100);
}

TEST(Job, ValidateRefusesWhatNoMachineHas) {
    EXPECT_TRUE(is_valid([](Job&) {}));
    EXPECT_FALSE(is_valid([](Job& j) { j.material.strength_mpa = 0; }));
    EXPECT_FALSE(is_valid([](Job& j) { j.material.shallow_limit_deg = 90; }));
    EXPECT_FALSE(is_valid([](Job& j) { j.slabs.thicknesses.clear(); }));
    EXPECT_FALSE(is_valid([](Job& j) { j.slabs.thicknesses = {19, 19}; }));
    EXPECT_FALSE(is_valid([](Job& j) { j.slabs.facing_allowance = 19; }));
    EXPECT_FALSE(is_valid([](Job& j) { j.machine.acceleration = std::numeric_limits<double>::quiet_NaN(); }));
    EXPECT_FALSE(is_valid([](Job& j) { j.machine.acceleration_z = -1; }));
    EXPECT_FALSE(is_valid([](Job& j) { j.machine.rapid_y = 0.5; }));
    EXPECT_TRUE(is_valid([](Job& j) { j.machine.rapid_y = 500, j.machine.acceleration_z = 0; }));
    EXPECT_FALSE(is_valid([](Job& j) { j.machine.rapid_feed = std::numeric_limits<double>::infinity(); }));
    EXPECT_FALSE(is_valid([](Job& j) { j.machine.base_board_cut = 20; }));
    EXPECT_TRUE(is_valid([](Job& j) { j.machine.base_board_cut = 0; }));
    EXPECT_FALSE(is_valid([](Job& j) { j.bonding.max_pressure_mpa = 0; }));
    EXPECT_FALSE(is_valid([](Job& j) { j.tolerances.cusp = 0; }));
    EXPECT_FALSE(is_valid([](Job& j) { j.layers.halving_resolution = 3; }));
    EXPECT_FALSE(is_valid([](Job& j) { j.layers.min_layer = 18.6; })) << "no layer can be that thick";
    EXPECT_FALSE(is_valid([](Job& j) { j.cutting.vertical_deg = 45; }));
    EXPECT_FALSE(is_valid([](Job& j) { j.cutting.min_stepover = 0; }));
    EXPECT_FALSE(is_valid([](Job& j) { j.cutting.max_engagement = 0; }));
    EXPECT_TRUE(is_valid([](Job& j) { j.cutting.max_engagement = 1; }));
    EXPECT_FALSE(is_valid([](Job& j) { j.cutting.max_engagement = 1.1; }));
    EXPECT_FALSE(is_valid([](Job& j) { j.tools.clear(); }));
    EXPECT_FALSE(is_valid([](Job& j) { j.tools[1].number = 1; }));
    EXPECT_FALSE(is_valid([](Job& j) { j.tools[1].stickout = 31; }));
    EXPECT_FALSE(is_valid([](Job& j) { j.tools[1].stepover = 1.1; }));
    EXPECT_FALSE(is_valid([](Job& j) { j.tools[1].flutes = 0; }));
    EXPECT_FALSE(is_valid([](Job& j) { j.tools[2].flute_length = 5; })) << "no layer is left";
    EXPECT_TRUE(is_valid([](Job& j) { j.prepare.skin_normal = {0, 0, 2}; }));
    EXPECT_FALSE(is_valid([](Job& j) { j.prepare.skin_normal = {0, 0, 0}; })) << "no direction";
    EXPECT_FALSE(is_valid([](Job& j) { j.prepare.skin_normal = {0, 1}; }));
    EXPECT_FALSE(is_valid([](Job& j) { j.prepare.skin_normal = {0, 0, 1e7}; }));
    EXPECT_TRUE(is_valid([](Job& j) { j.prepare.skin_box = {0, 0, 0, 1, 1, 0}; }));
    EXPECT_FALSE(is_valid([](Job& j) { j.prepare.skin_box = {0, 2, 0, 1, 1, 0}; })) << "the wrong way round";
    EXPECT_FALSE(is_valid([](Job& j) { j.prepare.skin_box = {0, 0, 0, 1}; }));
    // What would never end, or divide by a step of nothing.
    EXPECT_FALSE(is_valid([](Job& j) { j.tolerances.gouge = 1e-10; }));
    EXPECT_FALSE(is_valid([](Job& j) { j.tools[1].stepdown_max = 1e-9, j.tools[1].stepdown_min = 0; }));
    EXPECT_FALSE(is_valid([](Job& j) { j.tools[1].stepover = 1e-6; }));
    EXPECT_FALSE(is_valid([](Job& j) { j.tools[1].diameter = 1e-6; }));
    EXPECT_FALSE(is_valid([](Job& j) { j.tools[1].diameter = 0.1, j.tools[1].stepover = 0.1; }));
    EXPECT_FALSE(is_valid([](Job& j) { j.slabs.thicknesses = {0.001}, j.slabs.facing_allowance = 0; }));
    EXPECT_FALSE(is_valid([](Job& j) { j.slabs.facing_allowance = 18.99, j.layers.min_layer = 0; }));
    EXPECT_FALSE(is_valid([](Job& j) { j.machine.clearance = 1e-6; }));
    EXPECT_FALSE(is_valid([](Job& j) { j.cutting.ramp_deg = 1e-6; }));
}

TEST(Job, TallestLayerIsTheLeastOfSlabAndTools) {
    Job job;
    EXPECT_DOUBLE_EQ(max_layer_thickness(job), 18.5);
    job.slabs.thicknesses = {12, 50};
    // Ball: 30 mm of flutes less 2 mm of clearance less R(1 - cos 89.5°).
    EXPECT_NEAR(max_layer_thickness(job), 30 - 2 - 3.175 * (1 - std::cos(89.5 * std::numbers::pi / 180)),
                1e-12);
    job.tools[2].flute_length = 40;
    job.tools[2].stickout = 50;
    EXPECT_DOUBLE_EQ(max_layer_thickness(job), 30) << "the flat end mill's 32 mm less 2 mm";
    job.tools[0].flute_length = 1;
    EXPECT_DOUBLE_EQ(max_layer_thickness(job), 30) << "a face mill works on top only";
}

TEST(Job, ALayerTallerThanSomeToolsIsLeftToTheOthers) {
    Job job;
    job.tools.push_back(job.tools[1]), job.tools.back().number = 4,
                                       job.tools.back().flute_length = 45;  // a longer flat
    EXPECT_DOUBLE_EQ(max_layer_of(job, job.tools[1]), 30);
    EXPECT_DOUBLE_EQ(max_layer_of(job, job.tools[3]), 43);
    EXPECT_DOUBLE_EQ(max_layer_of_longest(job), max_layer_of(job, job.tools[2])) << "no longer ball";
    job.tools.push_back(job.tools[2]), job.tools.back().number = 5, job.tools.back().flute_length = 60;
    EXPECT_DOUBLE_EQ(max_layer_of_longest(job), 43);
    EXPECT_DOUBLE_EQ(max_bonded_layer_thickness(job), max_layer_of(job, job.tools[2]))
        << "every tool makes it";
    EXPECT_EQ(with_tools_for(job, 20).tools.size(), 5U);
    EXPECT_EQ(with_tools_for(job, max_layer_of(job, job.tools[2])).tools.size(), 5U) << "just tall enough";
    const Job fitted = with_tools_for(job, 43);
    ASSERT_EQ(fitted.tools.size(), 3U);
    EXPECT_EQ(fitted.tools[0].kind, ToolKind::face) << "works on top";
    EXPECT_EQ(fitted.tools[1].number, 4);
    EXPECT_EQ(fitted.tools[2].number, 5);
}

TEST(Job, RoughBlendStaysWithinTheAllowances) {
    Cutting cutting;
    EXPECT_DOUBLE_EQ(rough_blend(cutting), 0.1);
    cutting.wall_allowance = 0.15;
    EXPECT_DOUBLE_EQ(rough_blend(cutting), 0.05);
    cutting.floor_allowance = 0;
    EXPECT_DOUBLE_EQ(rough_blend(cutting), kJunction);
    cutting.wall_allowance = cutting.floor_allowance = 9;
    EXPECT_DOUBLE_EQ(rough_blend(cutting), 0.1);
    EXPECT_TRUE(is_valid([](Job& j) { j.cutting.rough_blend = 0.02; }));
    EXPECT_FALSE(is_valid([](Job& j) { j.cutting.rough_blend = 0.01; }));
}

// A flat and a ball end mill must pass between flask and pattern, with their allowance and 2.5 mm for leads.
TEST(Job, AFlaskLeavesRoomForAFlatAndABall) {
    Job job;
    job.cutting.wall_allowance = 0.5;
    job.tools = {tool_of_kind(job, ToolKind::face), tool_of_kind(job, ToolKind::flat),
                 tool_of_kind(job, ToolKind::ball)};
    job.tools[1].diameter = 16;
    EXPECT_EQ(least_flask_gap(job), 19);
    job.tools[1].diameter = 0.5, job.tools[2].diameter = 0.75;
    EXPECT_EQ(least_flask_gap(job), 3.75);
    job.tools.push_back(job.tools[1]);
    job.tools.back().diameter = 25;
    EXPECT_EQ(least_flask_gap(job), 3.75) << "wider ones may stay outside";
}

// Unless it is stated, the base board is cut as deep as the largest ball reaches below the pattern.
TEST(Job, TheBaseBoardIsCutByBalls) {
    Job job;
    job.tools = {tool_of_kind(job, ToolKind::face), tool_of_kind(job, ToolKind::ball)};
    job.tools[1].diameter = 8;
    EXPECT_EQ(board_cut_limit(job.machine, job.tools), 4);
    job.machine.base_board_cut = 1.5;
    EXPECT_EQ(board_cut_limit(job.machine, job.tools), 1.5);
    job.machine.base_board_cut = -1;
    job.tools[1].diameter = 60;
    EXPECT_EQ(board_cut_limit(job.machine, job.tools), job.machine.base_board_thickness - 2)
        << "something of it stays over the table";
    job.machine.base_board_thickness = 1;
    EXPECT_EQ(board_cut_limit(job.machine, job.tools), 0);
    job.machine.base_board_cut = 1;
    EXPECT_EQ(board_cut_limit(job.machine, job.tools), 1) << "whoever says so may cut through";
}

TEST(Job, ToolOfKind) {
    Job job;
    EXPECT_EQ(tool_of_kind(job, ToolKind::face).number, 1);
    EXPECT_EQ(tool_of_kind(job, ToolKind::flat).number, 2);
    EXPECT_EQ(tool_of_kind(job, ToolKind::ball).number, 3);
    try {
        (void)tool_of_kind(job, ToolKind::drill);
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.kind(), ErrorKind::usage);
        EXPECT_EQ(error.code(), "job.tool");
    }
}
